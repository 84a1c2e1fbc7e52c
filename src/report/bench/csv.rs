//! A run as tidy data: one row per case and pass.

use super::{Case, Pass, Run, Spread};
use crate::report::{Error, Output};

/// Names of the columns. A time is a median unless its name says otherwise.
const COLUMNS: [&str; 36] = [
    "date",
    "commit",
    "case",
    "group",
    "scene",
    "triangles",
    "width",
    "height",
    "light_map",
    "multiple",
    "single",
    "light_rests",
    "budget",
    "fetches_per_pixel",
    "covered",
    "rr",
    "wall_ms",
    "wall_p5_ms",
    "wall_p95_ms",
    "wall_count",
    "device_ms",
    "device_p5_ms",
    "device_p95_ms",
    "device_count",
    "pass",
    "pass_ms",
    "pass_p5_ms",
    "pass_p95_ms",
    "pass_count",
    "pass_fetches",
    "pass_bytes",
    "pass_floor_ms",
    "pass_over_floor",
    "pass_invocations",
    "validation",
    "complete",
];

impl Run {
    /// Writes the run as CSV with a header row, quoted by RFC 4180: one row per case and
    /// pass, what belongs to the case repeated in each. A case without passes has one row.
    ///
    /// # Errors
    /// The disk does not take the file.
    pub fn write_csv(&self, output: &Output) -> Result<(), Error> {
        output.write(|writer| {
            let mut writer = csv::Writer::from_writer(writer);
            writer.write_record(COLUMNS)?;
            for case in &self.cases {
                for pass in &case.passes {
                    writer.write_record(self.record(case, Some(pass)))?;
                }
                if case.passes.is_empty() {
                    writer.write_record(self.record(case, None))?;
                }
            }
            writer.flush().map_err(csv::Error::from)
        })
    }

    fn record(&self, case: &Case, pass: Option<&Pass>) -> Vec<String> {
        let mut record = vec![
            self.header.date.clone(),
            self.header.commit.clone().unwrap_or_default(),
            case.name.clone(),
            case.group.clone(),
            case.scene.clone(),
            case.triangles.to_string(),
            case.size[0].to_string(),
            case.size[1].to_string(),
            case.light_map.to_string(),
            case.multiple.clone(),
            case.single.clone(),
            case.light_rests.to_string(),
            shown(case.budget),
            case.fetches.to_string(),
            case.covered.to_string(),
            shown(case.error),
        ];
        record.extend(spread(Some(case.wall)));
        record.extend(spread(Some(case.device)));
        record.push(pass.map(|pass| pass.pass.clone()).unwrap_or_default());
        record.extend(spread(pass.map(|pass| pass.time)));
        record.extend([
            shown(pass.map(|pass| pass.fetches)),
            shown(pass.map(|pass| pass.bytes)),
            shown(pass.and_then(|pass| pass.floor)),
            shown(pass.and_then(Pass::over_floor)),
            shown(pass.and_then(|pass| pass.invocations)),
            self.header.validation.to_string(),
            self.complete.to_string(),
        ]);
        record
    }
}

fn shown(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

fn spread(spread: Option<Spread>) -> [String; 4] {
    [
        shown(spread.map(|s| s.median)),
        shown(spread.map(|s| s.p5)),
        shown(spread.map(|s| s.p95)),
        shown(spread.map(|s| s.count)),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::*;

    fn written(run: &Run) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.csv");
        run.write_csv(&Output::check(&path).expect("writable"))
            .expect("written");
        std::fs::read_to_string(&path).expect("text")
    }

    #[test]
    fn each_case_and_pass_has_a_row_that_reads_back() {
        let run = example::run();
        let text = written(&run);
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let headers = reader.headers().expect("a header").clone();
        let column = |name: &str| headers.iter().position(|h| h == name).expect("a column");
        let rows: Vec<_> = reader
            .records()
            .map(|record| record.expect("a record as long as the header"))
            .collect();
        let expected: usize = run.cases.iter().map(|case| case.passes.len()).sum();
        assert_eq!(rows.len(), expected);
        let (case, pass) = (&run.cases[1], &run.cases[1].passes[3]);
        let row = rows
            .iter()
            .find(|row| row[column("case")] == case.name && row[column("pass")] == pass.pass)
            .expect("the row");
        assert_eq!(row[column("pass_ms")], pass.time.median.to_string());
        assert_eq!(row[column("pass_p95_ms")], pass.time.p95.to_string());
        assert_eq!(row[column("pass_fetches")], pass.fetches.to_string());
        assert_eq!(row[column("wall_p5_ms")], case.wall.p5.to_string());
        assert_eq!(row[column("device_ms")], case.device.median.to_string());
        assert_eq!(row[column("fetches_per_pixel")], case.fetches.to_string());
        assert_eq!(row[column("budget")], *"");
        assert_eq!(row[column("complete")], *"true");
    }

    #[test]
    fn text_is_quoted_and_a_case_without_passes_stays() {
        let mut run = example::run();
        run.cases.truncate(1);
        run.cases[0].scene = "a \"ball\", lit".to_owned();
        run.cases[0].passes.clear();
        let text = written(&run);
        assert_eq!(text.lines().count(), 2);
        assert!(text.contains(",\"a \"\"ball\"\", lit\","), "{text}");
    }
}
