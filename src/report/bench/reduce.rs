//! Times of alternatives side by side: `marmor bench reduce`.

use crate::report::{Error, Output};
use serde::Serialize;
use std::io::Write as _;

/// One comparison, as a document for scripts. Times in ms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bench {
    /// Version of marmor.
    pub marmor: &'static str,
    /// What was measured.
    pub bench: &'static str,
    /// Name of the device.
    pub device: String,
    /// Driver name and version.
    pub driver: String,
    /// Whether the validation layers watched; times are then of no use.
    pub validation: bool,
    /// Texels along a side of the light map.
    pub light_map: u32,
    /// How often each way was measured.
    pub rounds: u32,
    /// The way that ratios refer to.
    pub reference: &'static str,
    /// Each way.
    pub ways: Vec<Row>,
    /// Which ways are missing, and why.
    pub notes: Vec<String>,
    /// What the validation layers said.
    pub validation_messages: Vec<String>,
}

/// The times of one way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Its name.
    pub way: String,
    /// Half of the rounds took less.
    pub median: f64,
    /// 5 % of the rounds took less.
    pub p5: f64,
    /// 95 % of the rounds took less.
    pub p95: f64,
    /// Median over that of the reference, where it was measured.
    pub ratio: Option<f64>,
}

/// The rows of `times` (a way and its times, ms), with ratios to the way `reference`.
pub fn rows(times: Vec<(String, Vec<f64>)>, reference: &str) -> Vec<Row> {
    let mut rows: Vec<_> = times
        .into_iter()
        .map(|(way, mut times)| {
            times.sort_by(f64::total_cmp);
            Row {
                way,
                median: quantile(&times, 0.5),
                p5: quantile(&times, 0.05),
                p95: quantile(&times, 0.95),
                ratio: None,
            }
        })
        .collect();
    let base = rows.iter().find(|row| row.way == reference);
    if let Some(base) = base.map(|row| row.median).filter(|&m| m > 0.0) {
        for row in &mut rows {
            row.ratio = Some(row.median / base);
        }
    }
    rows
}

/// The quantile `q` of sorted values, between neighbours in proportion; 0 of none.
pub(super) fn quantile(sorted: &[f64], q: f64) -> f64 {
    let place = q * sorted.len().saturating_sub(1) as f64;
    let at = |k: f64| sorted.get(k as usize).copied().unwrap_or(0.0);
    let (low, high) = (at(place.floor()), at(place.ceil()));
    low + (high - low) * place.fract()
}

impl Bench {
    /// The document as a table with a header.
    pub fn table(&self) -> String {
        let side = self.light_map;
        let mut table = format!(
            "{}, {}\nlight map {side}x{side} RGBA32F, {} rounds, ms\n",
            self.device, self.driver, self.rounds
        );
        let width = self.ways.iter().map(|row| row.way.len()).max().unwrap_or(0);
        let ratio = format!("/ {}", self.reference);
        let right = ratio.len();
        table.push_str(&format!(
            "{:width$}  {:>9}  {:>9}  {:>9}  {ratio}\n",
            "way", "median", "p5", "p95"
        ));
        for row in &self.ways {
            let shown = row.ratio.map_or("-".to_owned(), |r| format!("{r:.3}"));
            table.push_str(&format!(
                "{:width$}  {:9.4}  {:9.4}  {:9.4}  {shown:>right$}\n",
                row.way, row.median, row.p5, row.p95,
            ));
        }
        for note in &self.notes {
            table.push_str(&format!("note: {note}\n"));
        }
        table
    }

    /// Writes the document as JSON, indented.
    ///
    /// # Errors
    /// The disk does not take the file.
    pub fn write(&self, output: &Output) -> Result<(), Error> {
        output.write(|writer| {
            serde_json::to_writer_pretty(&mut *writer, self)?;
            writer.write_all(b"\n")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_hold_quantiles_and_ratios() {
        let times = vec![
            ("a".to_owned(), (0..=100).rev().map(f64::from).collect()),
            ("b".to_owned(), vec![25.0]),
            ("c".to_owned(), vec![1.0, 2.0]),
        ];
        let found = rows(times.clone(), "b");
        assert_eq!(
            (found[0].median, found[0].p5, found[0].p95),
            (50.0, 5.0, 95.0)
        );
        assert_eq!((found[1].p5, found[1].p95), (25.0, 25.0));
        assert_eq!(found[2].median, 1.5);
        let ratios: Vec<_> = found.iter().map(|row| row.ratio).collect();
        assert_eq!(ratios, [Some(2.0), Some(1.0), Some(0.06)]);
        assert!(rows(times, "d").iter().all(|row| row.ratio.is_none()));
    }
}
