//! The settings of the picture.

use crate::scene::{
    Exits, March, Material, MeshSource, Method, Request, Scattering, Single, bundled, limits,
    preset,
};
use crate::view::session::{Draft, Session};
use crate::view::style;
use egui::{DragValue, Ui};
use glam::DVec3;
use std::path::Path;

/// What the panel remembers of settings that are off.
pub struct Memory {
    /// Whether the last scroll was a wheel's.
    pub wheel: bool,
    /// The file that was opened, which is no bundled mesh, as it was.
    file: Option<Request>,
    single: March,
    multiple: Method,
    budget: u32,
}

impl Memory {
    /// Of a session that begins.
    pub fn new(session: &Session) -> Memory {
        let wanted = &session.wanted;
        Memory {
            wheel: false,
            file: match &wanted.mesh {
                MeshSource::File(_) => Some(wanted.clone()),
                MeshSource::Bundled(_) => None,
            },
            single: match wanted.single {
                Single::March(march) => march,
                _ => March {
                    steps: crate::scene::defaults::SINGLE,
                    exits: Exits::Linear,
                },
            },
            multiple: match wanted.multiple {
                Method::None => Method::Mixture,
                method => method,
            },
            budget: wanted.fetch_budget.unwrap_or(16),
        }
    }

    /// Switches single scattering.
    pub fn toggle_single(&mut self, wanted: &mut Request) {
        wanted.fetch_budget = None;
        wanted.single = match wanted.single {
            Single::March(march) => {
                self.single = march;
                Single::Off
            }
            _ => Single::March(self.single),
        };
    }

    /// Switches multiple scattering.
    pub fn toggle_multiple(&mut self, wanted: &mut Request) {
        wanted.fetch_budget = None;
        wanted.multiple = match wanted.multiple {
            Method::None => self.multiple,
            method => {
                self.multiple = method;
                Method::None
            }
        };
    }
}

/// Shading at half the size gives way to a method that knows none, as it does to a split.
pub fn shade_whole_if_opaque(wanted: &mut Request) {
    if wanted.is_opaque() {
        wanted.scattering = Scattering::Full;
    }
}

/// A heading, and a line above it.
pub fn section(ui: &mut Ui, name: &str) {
    ui.add_space(9.0);
    let line = ui.available_rect_before_wrap();
    ui.painter().hline(
        line.x_range(),
        line.top() - 4.0,
        egui::Stroke::new(1.0, style::LINE),
    );
    ui.label(
        egui::RichText::new(name.to_uppercase())
            .font(style::heading())
            .extra_letter_spacing(1.2)
            .color(style::DIM),
    );
}

/// A setting: its name, and beside it what sets it.
pub fn row<R>(ui: &mut Ui, name: &str, show: impl FnOnce(&mut Ui) -> R) -> R {
    ui.horizontal(|ui| {
        let (rect, _) =
            ui.allocate_exact_size(egui::vec2(style::NAMES - 8.0, 19.0), egui::Sense::hover());
        ui.painter().text(
            rect.left_center(),
            egui::Align2::LEFT_CENTER,
            name,
            egui::TextStyle::Body.resolve(ui.style()),
            style::DIM,
        );
        show(ui)
    })
    .inner
}

/// A setting, which can be changed where that has an effect on the picture.
fn effective<R>(ui: &mut Ui, effect: bool, name: &str, show: impl FnOnce(&mut Ui) -> R) -> R {
    ui.add_enabled_ui(effect, |ui| row(ui, name, show)).inner
}

/// One of several words; whether it was changed.
fn choice<T: PartialEq + Copy>(ui: &mut Ui, name: &str, value: &mut T, all: &[(T, &str)]) -> bool {
    let own = all
        .iter()
        .find(|(each, _)| each == value)
        .map_or("", |(_, word)| word);
    let before = *value;
    egui::ComboBox::from_id_salt(name)
        .selected_text(own)
        .show_ui(ui, |ui| {
            for (each, word) in all {
                ui.selectable_value(value, *each, *word);
            }
        });
    *value != before
}

/// A slider that shows a value beyond its range, or with more digits than it tells, and leaves it as it is.
pub fn slider<N: egui::emath::Numeric>(
    value: &mut N,
    range: std::ops::RangeInclusive<N>,
) -> egui::Slider<'_> {
    egui::Slider::new(value, range)
        .clamping(egui::SliderClamping::Edits)
        .custom_parser(typed)
}

/// A number to drag or to type, likewise.
fn drag<N: egui::emath::Numeric>(value: &mut N) -> DragValue<'_> {
    DragValue::new(value)
        .clamp_existing_to_range(false)
        .custom_parser(typed)
}

/// A number that was typed; none is not a number, and none is infinite: a range would make the largest of either.
fn typed(text: &str) -> Option<f64> {
    let number = text.trim().replace('\u{2212}', "-").parse();
    number.ok().filter(|number: &f64| number.is_finite())
}

/// Three numbers, of red, green and blue.
fn channels(ui: &mut Ui, value: &mut DVec3, least: f64) -> bool {
    let mut changed = false;
    for x in value.as_mut() {
        // A drag doubles a small number as it doubles a large one.
        let speed = 0.01 * x.abs().max(1e-3);
        let drag = drag(x)
            .speed(speed)
            .range(least..=1e3)
            .max_decimals(4)
            .update_while_editing(false);
        changed |= ui.add_sized([58.0, 19.0], drag).changed();
    }
    changed
}

fn derived(ui: &mut Ui, name: &str, values: [f64; 3]) {
    row(ui, name, |ui| {
        for x in values {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(58.0, 15.0), egui::Sense::hover());
            let text = if x >= 100.0 {
                format!("{x:.1}")
            } else {
                format!("{x:.4}")
            };
            ui.painter().text(
                rect.center(),
                egui::Align2::CENTER_CENTER,
                text,
                style::numbers(),
                style::DIM,
            );
        }
    });
}

/// All settings.
pub fn show(ui: &mut Ui, session: &mut Session, memory: &mut Memory) {
    show_scene(ui, session, memory);
    show_material(ui, session);
    show_light(ui, session);
    show_method(ui, session, memory);
    show_picture(ui, session, memory);
}

fn show_scene(ui: &mut Ui, session: &mut Session, memory: &Memory) {
    section(ui, "Scene");
    let wanted = &mut session.wanted;
    row(ui, "mesh", |ui| {
        let word = |mesh: &MeshSource| match mesh {
            MeshSource::Bundled(bundled) => bundled.name().to_owned(),
            MeshSource::File(path) => {
                let name = path.file_name().map(Path::new);
                name.unwrap_or(path).display().to_string()
            }
        };
        let own = word(&wanted.mesh);
        egui::ComboBox::from_id_salt("mesh")
            .selected_text(&own)
            .show_ui(ui, |ui| {
                // The first is another name of the last but one.
                let bundled = bundled::NAMES[1..].iter();
                let bundled = bundled.filter_map(|name| Request::open(Path::new(name)).ok());
                let bundled: Vec<Request> = bundled.collect();
                for each in memory.file.iter().chain(&bundled) {
                    let word = word(&each.mesh);
                    if ui.selectable_label(word == own, &word).clicked() && word != own {
                        wanted.show(each);
                    }
                }
            });
    });
}

fn show_material(ui: &mut Ui, session: &mut Session) {
    section(ui, "Material");
    let shown = session.plan().scene.material.clone();
    let wanted = &mut session.wanted;
    let colored = wanted.colored_by_mesh && shown.name != wanted.material.name;
    // What a mesh has coloured is edited from there on.
    let mut material = if colored {
        shown
    } else {
        wanted.material.clone()
    };
    let before = material.clone();
    row(ui, "preset", |ui| {
        egui::ComboBox::from_id_salt("preset")
            .selected_text(&material.name)
            .height(330.0)
            .show_ui(ui, |ui| {
                for name in preset::NAMES {
                    if ui.selectable_label(material.name == name, name).clicked()
                        && let Ok(chosen) = Material::preset(name)
                    {
                        material = chosen;
                    }
                }
            });
    });
    let mut own = row(ui, "σs'   1/mm", |ui| {
        channels(ui, &mut material.sigma_s, 1e-4)
    });
    own |= row(ui, "σa   1/mm", |ui| {
        channels(ui, &mut material.sigma_a, 0.0)
    });
    let sigma_t = material.sigma_s + material.sigma_a;
    derived(ui, "albedo α'", (material.sigma_s / sigma_t).to_array());
    derived(ui, "free path   mm", (1.0 / sigma_t).to_array());
    own |= row(ui, "η", |ui| {
        ui.add(slider(&mut material.eta, 1.0..=3.0).max_decimals(3))
            .changed()
    });
    own |= row(ui, "g", |ui| {
        ui.add(slider(&mut material.g, -0.95..=0.95).max_decimals(2))
            .changed()
    });
    let specular = wanted.specular;
    own |= effective(ui, specular, "roughness", |ui| {
        ui.add(slider(&mut material.roughness, 0.02..=1.0).max_decimals(3))
            .changed()
    });
    if own {
        material.name = "custom".to_owned();
    }
    if material != before {
        wanted.material = material;
        wanted.colored_by_mesh = false;
    }
}

fn show_light(ui: &mut Ui, session: &mut Session) {
    section(ui, "Light");
    let before = session.light();
    let mut light = before.clone();
    row(ui, "azimuth", |ui| {
        ui.add(
            slider(&mut light.azimuth, -180.0..=180.0)
                .max_decimals(1)
                .suffix("°"),
        )
    });
    row(ui, "elevation", |ui| {
        ui.add(
            slider(&mut light.elevation, -90.0..=90.0)
                .max_decimals(1)
                .suffix("°"),
        )
    });
    row(ui, "irradiance", |ui| {
        let slider = slider(&mut light.irradiance, 0.0..=30.0);
        ui.add(slider.max_decimals(2))
    });
    if light != before {
        session.aim(light);
    }
}

fn show_method(ui: &mut Ui, session: &mut Session, memory: &mut Memory) {
    section(ui, "Method");
    let chosen = session.chosen().map(|chosen| {
        let choice = chosen.row.choice;
        (choice.to_string(), chosen.fetches, chosen.row.expected)
    });
    let fetches = session.fetches();
    let wanted = &mut session.wanted;
    let mut budgeted = wanted.fetch_budget.is_some();
    row(ui, "fetches", |ui| {
        ui.monospace(format!("{fetches}"));
        ui.label(egui::RichText::new("a pixel").color(style::DIM));
        ui.add_space(8.0);
        if ui
            .checkbox(&mut budgeted, "budget")
            .on_hover_text("The best plan that so many fetches a pixel buy")
            .changed()
        {
            wanted.fetch_budget = budgeted.then_some(memory.budget);
            if budgeted {
                // A budget chooses for the whole picture.
                wanted.split = None;
                wanted.scattering = Scattering::Full;
            }
        }
        if let Some(budget) = &mut wanted.fetch_budget
            && ui.add(drag(budget).range(1..=256).speed(0.15)).changed()
        {
            memory.budget = *budget;
        }
    });
    if let Some((choice, fetches, expected)) = chosen {
        ui.label(
            egui::RichText::new(format!(
                "{choice}: {fetches} fetches, expected error {expected:.3}"
            ))
            .small()
            .color(style::DIM),
        );
    }
    ui.add_enabled_ui(!budgeted, |ui| show_methods(ui, wanted, memory));
    row(ui, "light map", |ui| {
        let all = [128, 256, 512, 1024, 2048].map(|side: u32| (side, side.to_string()));
        let mut words: Vec<(u32, &str)> = all
            .iter()
            .map(|(side, word)| (*side, word.as_str()))
            .collect();
        let own = wanted.light_map.to_string();
        if words.iter().all(|(side, _)| *side != wanted.light_map) {
            words.insert(0, (wanted.light_map, &own));
        }
        choice(ui, "light map", &mut wanted.light_map, &words);
    });
    row(ui, "average", |ui| {
        let mut frames = session
            .wanted
            .frames_averaged
            .unwrap_or(crate::view::session::FRAMES);
        let drag = drag(&mut frames)
            .range(1..=4096)
            .speed(0.3)
            .suffix(" frames");
        if ui.add(drag).changed() {
            session.wanted.frames_averaged = Some(frames);
        }
    });
    row(ui, "in motion", |ui| {
        let words = ["auto", "full size", "half size", "a third", "a quarter"];
        let words: Vec<_> = Draft::ALL.into_iter().zip(words).collect();
        choice(ui, "in motion", &mut session.draft_size, &words);
    });
}

fn show_methods(ui: &mut Ui, wanted: &mut Request, memory: &mut Memory) {
    let methods = [
        (Method::Mixture, "mixture"),
        (Method::Samples, "samples"),
        (Method::Rings, "rings"),
        (Method::Brdf, "brdf (opaque)"),
        (Method::None, "none"),
    ];
    row(ui, "multiple", |ui| {
        if choice(ui, "multiple", &mut wanted.multiple, &methods) {
            if wanted.multiple != Method::None {
                memory.multiple = wanted.multiple;
            }
            shade_whole_if_opaque(wanted);
        }
    });
    let uses = |method| wanted.multiple == method || wanted.split == Some(method);
    let [samples, rings, mixture] = [Method::Samples, Method::Rings, Method::Mixture].map(uses);
    if samples {
        row(ui, "samples N", |ui| {
            ui.add(slider(&mut wanted.samples, limits::SAMPLES).logarithmic(true))
        });
    }
    if rings {
        row(ui, "rings N", |ui| {
            ui.add(slider(&mut wanted.rings, limits::RINGS))
        });
    }
    if mixture {
        row(ui, "moments", |ui| {
            for count in [3, 4] {
                ui.selectable_value(&mut wanted.moments, count, count.to_string());
            }
            ui.add_space(6.0);
            ui.label(egui::RichText::new("volumes").color(style::DIM));
            ui.add(drag(&mut wanted.volumes).range(0..=8).speed(0.05));
        });
        row(ui, "levels", |ui| {
            for (step, word) in [(1, "every"), (2, "every second")] {
                ui.selectable_value(&mut wanted.level_step, step, word);
            }
        });
    }
    let opaque = wanted.is_opaque();
    effective(ui, !opaque, "single", |ui| {
        let mut on = wanted.single != Single::Off;
        if ui.checkbox(&mut on, "").changed() {
            memory.toggle_single(wanted);
        }
        if let Single::March(march) = &mut wanted.single {
            let slider = slider(&mut march.steps, limits::STEPS);
            if ui.add(slider.logarithmic(true).prefix("K ")).changed() {
                memory.single = *march;
            }
        }
    });
    effective(ui, !opaque && wanted.single != Single::Off, "exits", |ui| {
        for exits in [Exits::Linear, Exits::Nearest, Exits::Depth] {
            ui.selectable_value(&mut wanted.exits, exits, exits.name());
        }
    });
    // Whoever has asked for half the size can always take it back.
    let half = wanted.scattering == Scattering::Half;
    let halves = half || (!opaque && wanted.split.is_none());
    effective(ui, halves, "shaded at", |ui| {
        for (size, word) in [(Scattering::Full, "full size"), (Scattering::Half, "half")] {
            ui.selectable_value(&mut wanted.scattering, size, word);
        }
    });
    row(ui, "split", |ui| {
        let mut split = wanted.split;
        let mut words = vec![(None, "off")];
        words.extend(methods.map(|(method, word)| (Some(method), word)));
        if choice(ui, "split", &mut split, &words) {
            wanted.split = split;
            if split.is_some() {
                wanted.scattering = Scattering::Full;
            }
        }
    });
}

fn show_picture(ui: &mut Ui, session: &mut Session, memory: &mut Memory) {
    section(ui, "Picture");
    let wanted = &mut session.wanted;
    row(ui, "exposure", |ui| {
        let mut stops = wanted.exposure.log2();
        let slider = slider(&mut stops, -6.0..=6.0).max_decimals(2).suffix(" EV");
        if ui.add(slider).changed() {
            wanted.exposure = stops.exp2();
        }
    });
    row(ui, "terms", |ui| {
        ui.toggle_value(&mut wanted.specular, "specular");
        let mut single = wanted.single != Single::Off;
        ui.add_enabled_ui(!wanted.is_opaque(), |ui| {
            if ui.toggle_value(&mut single, "single").changed() {
                memory.toggle_single(wanted);
            }
        });
        let mut multiple = wanted.multiple != Method::None;
        if ui.toggle_value(&mut multiple, "multiple").changed() {
            memory.toggle_multiple(wanted);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::typed;

    #[test]
    fn what_is_typed_is_a_number() {
        for (text, number) in [
            ("2", 2.0),
            (" -0.5 ", -0.5),
            ("1e-3", 1e-3),
            ("\u{2212}4", -4.0),
        ] {
            assert_eq!(typed(text), Some(number), "{text}");
        }
        for text in ["", "nan", "NaN", "inf", "-infinity", "1e999", "2p", "1 2"] {
            assert_eq!(typed(text), None, "{text}");
        }
    }
}
