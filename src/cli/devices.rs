//! `marmor devices`: what could draw.

use super::failure::Failure;
use super::{Global, print};
use crate::frame::{self, DeviceInfo};
use clap::Args;
use serde::Serialize;

/// List the Vulkan devices, what each lacks, and which would be chosen
#[derive(Args, Debug)]
#[command(after_long_help = "\
Examples:
  marmor devices
  marmor devices --json
  marmor --device llvmpipe devices
      which would be chosen by that name")]
pub(super) struct Arguments {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Row<'a> {
    index: usize,
    name: &'a str,
    kind: &'a str,
    driver: &'a str,
    api: &'a str,
    memory_mib: u64,
    usable: bool,
    lacks: &'a [String],
    notes: &'a [String],
    chosen: bool,
}

impl<'a> From<&'a DeviceInfo> for Row<'a> {
    fn from(device: &'a DeviceInfo) -> Self {
        Row {
            index: device.index,
            name: &device.name,
            kind: &device.kind,
            driver: &device.driver,
            api: &device.api,
            memory_mib: device.memory_mib,
            usable: device.lacks.is_empty(),
            lacks: &device.lacks,
            notes: &device.notes,
            chosen: device.chosen,
        }
    }
}

pub(super) fn run(global: &Global, arguments: &Arguments) -> Result<(), Failure> {
    let devices = frame::devices(&global.options())?;
    if arguments.json {
        let rows: Vec<Row> = devices.iter().map(Row::from).collect();
        let json = serde_json::to_string_pretty(&rows)
            .map_err(|error| Failure::Input(format!("cannot be written as JSON ({error})")))?;
        print(&(json + "\n"))?;
    } else {
        print(&devices.iter().map(describe).collect::<String>())?;
    }
    if devices.is_empty() {
        Err(Failure::Device(
            "there is no Vulkan device; install a driver, such as mesa-vulkan-drivers".to_owned(),
        ))
    } else if devices.iter().all(|device| !device.lacks.is_empty()) {
        Err(Failure::Device(
            "no device has what marmor needs; update the driver or choose another machine"
                .to_owned(),
        ))
    } else {
        Ok(())
    }
}

fn describe(device: &DeviceInfo) -> String {
    let mark = if device.chosen { '*' } else { ' ' };
    let mut text = format!(
        "{mark} {}  {} ({}), Vulkan {}, {}, {} MiB\n",
        device.index, device.name, device.kind, device.api, device.driver, device.memory_mib
    );
    if !device.lacks.is_empty() {
        text.push_str(&format!("     lacks {}\n", device.lacks.join(", ")));
    }
    for note in &device.notes {
        text.push_str(&format!("     {note}\n"));
    }
    text
}
