//! A run as plain text, at most [`WIDTH`] columns wide.

use super::{Case, Pass, Run, Spread, count, digits, error, fits_in_words, grouped};

/// Columns that a line has at most, so that it fits beside another window.
pub const WIDTH: usize = 100;

/// Columns of a case's name. A longer one stands in a line of its own.
const NAME: usize = 38;

impl Run {
    /// The run as text: header, costs of fetches, and a block a group.
    pub fn table(&self) -> String {
        let mut lines = self.head();
        lines.push(String::new());
        lines.extend(self.cost_lines());
        lines.push(String::new());
        lines.extend(wrap("", LEGEND));
        for (group, cases) in self.groups() {
            lines.push(String::new());
            lines.extend(self.block(group, &cases));
        }
        if !self.notes.is_empty() {
            lines.push(String::new());
            for note in &self.notes {
                lines.extend(wrap("note: ", note));
            }
        }
        lines.push(String::new());
        lines.join("\n")
    }

    fn head(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for (name, value) in self.header_rows() {
            lines.extend(wrap(&format!("{name:12}"), &value));
        }
        if self.header.validation {
            lines.extend(wrap("", VALIDATION));
        }
        if !self.complete {
            lines.extend(wrap("", &self.incomplete()));
        }
        lines
    }

    /// What the header says, by name.
    pub(super) fn header_rows(&self) -> Vec<(&'static str, String)> {
        let header = &self.header;
        let commit = header.commit.as_deref();
        let marmor = match commit {
            Some(commit) => format!("{}, commit {commit}", header.marmor),
            None => header.marmor.clone(),
        };
        let validation = if header.validation { "on" } else { "off" };
        vec![
            ("marmor", marmor),
            ("date", header.date.clone()),
            ("command", header.command.clone()),
            ("device", header.device.clone()),
            ("driver", header.driver.clone()),
            ("cpu", format!("{}, {} cores", header.cpu, header.cores)),
            ("validation", validation.to_owned()),
            (
                "measured",
                format!("{} cases, {} frames each", self.cases.len(), self.frames),
            ),
        ]
    }

    /// What to say where the run was interrupted.
    pub(super) fn incomplete(&self) -> String {
        format!(
            "INCOMPLETE: interrupted after {} cases; those below are measured in full, others are \
             missing",
            self.cases.len()
        )
    }

    fn cost_lines(&self) -> Vec<String> {
        if self.costs.is_empty() {
            return vec!["what a fetch costs was not measured".to_owned()];
        }
        let mut lines = vec![
            "what a fetch costs, all cores together".to_owned(),
            format!(
                "  {:20} {:10} {:>6} {:>8} {:>17} {:>12}",
                "kind", "format", "bytes", "ns", "[p5     p95]", "M a second"
            ),
        ];
        for cost in &self.costs {
            let time = cost.nanoseconds;
            let rate = if time.median > 0.0 {
                digits(1e3 / time.median)
            } else {
                "-".to_owned()
            };
            lines.push(format!(
                "  {:20} {:10} {:>6} {:>8} {:>17} {rate:>12}",
                cost.kind,
                cost.format,
                cost.bytes,
                digits(time.median),
                ends(time),
            ));
        }
        lines
    }

    fn block(&self, group: &str, cases: &[&Case]) -> Vec<String> {
        let mut lines = vec![
            group.to_owned(),
            row(
                "case",
                [
                    "fetches",
                    "rr",
                    "frame ms",
                    "[p5     p95]",
                    "wall ms",
                    "fps",
                ]
                .map(str::to_owned),
            ),
        ];
        for case in cases {
            lines.extend(case_lines(case));
        }
        let fits = self.fits.iter().filter(|fit| fit.group == group);
        for words in fits_in_words(fits) {
            lines.extend(wrap("  fit: ", &words));
        }
        lines
    }
}

/// What to say where the validation layers watched.
pub(super) const VALIDATION: &str =
    "VALIDATION ON: the layers slow every frame; measure without --validation to use the times";

/// What the columns mean.
pub const LEGEND: &str = "fetches: declared a pixel of a case; of a pass those of a frame, declared \
    times pixels or texels, and the bytes that they touch. frame: the passes' times on the device. wall: until the fence; fps are by it. [p5 p95]: 5 % of the \
    frames took less, 95 % took less. x floor: the pass's time over what its fetches alone take.";

fn case_lines(case: &Case) -> Vec<String> {
    let mut lines = Vec::new();
    let mut name = case.name.as_str();
    if name.chars().count() > NAME {
        lines.extend(wrap("  ", name));
        name = "";
    }
    let dash = || "-".to_owned();
    lines.push(row(
        name,
        [
            grouped(case.fetches.into()),
            case.error.map_or_else(dash, error),
            digits(case.device.median),
            ends(case.device),
            digits(case.wall.median),
            case.rate().map_or_else(dash, digits),
        ],
    ));
    lines.extend(case.passes.iter().map(pass_line));
    lines
}

fn pass_line(pass: &Pass) -> String {
    let mut line = row(
        &format!("  {}", pass.pass),
        [
            count(pass.fetches),
            bytes(pass.bytes),
            digits(pass.time.median),
            ends(pass.time),
            String::new(),
            String::new(),
        ],
    );
    line.truncate(line.trim_end().len());
    if let Some(factor) = pass.over_floor() {
        line.push_str(&format!(" {:>8} x floor", digits(factor)));
    }
    line
}

/// Bytes in a column of rr, where a pass has none; nothing of none.
fn bytes(bytes: f64) -> String {
    if bytes > 0.0 {
        format!("{}B", count(bytes))
    } else {
        String::new()
    }
}

fn row(name: &str, [fetches, rr, frame, ends, wall, rate]: [String; 6]) -> String {
    format!("  {name:NAME$} {fetches:>7} {rr:>7} {frame:>8} {ends:>17} {wall:>8} {rate:>6}")
}

fn ends(spread: Spread) -> String {
    format!("[{:>7} {:>7}]", digits(spread.p5), digits(spread.p95))
}

/// `text` in lines of at most [`WIDTH`] columns, the first after `head`, the others
/// indented as far. Words longer than a line are cut.
pub(super) fn wrap(head: &str, text: &str) -> Vec<String> {
    let indent = head.chars().count();
    let room = WIDTH.saturating_sub(indent).max(1);
    let mut lines: Vec<String> = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let letters: Vec<char> = word.chars().collect();
        for piece in letters.chunks(room) {
            let length = line.chars().count();
            if length > 0 && length + 1 + piece.len() > room {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.extend(piece);
        }
    }
    lines.push(line);
    let blank = " ".repeat(indent);
    lines
        .iter()
        .enumerate()
        .map(|(index, line)| {
            let before = if index == 0 { head } else { &blank };
            format!("{before}{line}").trim_end().to_owned()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::*;

    fn narrow(text: &str) {
        for line in text.lines() {
            assert!(line.chars().count() <= WIDTH, "{line}");
            assert_eq!(line, line.trim_end());
        }
    }

    #[test]
    fn the_table_names_every_case_and_stays_narrow() {
        let run = example::run();
        let table = run.table();
        narrow(&table);
        for case in &run.cases {
            assert!(table.contains(&case.name), "{} is missing", case.name);
        }
        for (group, _) in run.groups() {
            assert!(table.lines().any(|line| line == group));
        }
        assert!(table.contains("x floor") && table.contains("gather and compare"));
        assert!(!table.contains("INCOMPLETE") && !table.contains("VALIDATION ON"));
    }

    #[test]
    fn figures_stand_in_their_columns() {
        let mut run = example::run();
        let case = &mut run.cases[0];
        let spread = |median: f64| Spread {
            median,
            p5: median / 2.0,
            p95: median * 2.0,
            count: 9,
        };
        (case.name, case.error) = ("a case".to_owned(), Some(0.0123));
        (case.device, case.wall) = (spread(12.0), spread(20.0));
        case.passes.truncate(1);
        case.passes[0].time = spread(3.0);
        (case.passes[0].fetches, case.passes[0].bytes) = (2e6, 32e6);
        case.passes[0].floor = Some(1.5);
        let lines = case_lines(case);
        let words: Vec<Vec<&str>> = lines
            .iter()
            .map(|line| line.split_whitespace().collect())
            .collect();
        assert_eq!(
            words[0],
            [
                "a", "case", "10", "0.0123", "12.0", "[", "6.00", "24.0]", "20.0", "50.0"
            ]
        );
        assert_eq!(
            words[1],
            [
                "light", "2.00", "M", "32.0", "MB", "3.00", "[", "1.50", "6.00]", "2.00", "x",
                "floor"
            ]
        );
    }

    #[test]
    fn long_names_commands_and_notes_are_not_lost() {
        let mut run = example::run();
        let long = "statue lit from behind, seen through a very long lens, mixture(4 from level 2)";
        run.cases[0].name = long.to_owned();
        run.header.command = "marmor bench --only ".to_owned() + &"word ".repeat(60);
        run.notes.push("x".repeat(250));
        let table = run.table();
        narrow(&table);
        assert!(table.contains(long));
        assert_eq!(table.matches("word").count(), 60);
        assert_eq!(table.matches('x').count() - run_x(&run), 250);
    }

    /// How many x the table has beside those of the long note.
    fn run_x(run: &Run) -> usize {
        let mut short = run.clone();
        short.notes.pop();
        short.table().matches('x').count()
    }

    #[test]
    fn an_interrupted_run_says_so_and_how_far_it_came() {
        let mut run = example::run();
        run.complete = false;
        run.header.validation = true;
        run.cases.truncate(3);
        let table = run.table();
        assert!(table.contains("INCOMPLETE: interrupted after 3 cases"));
        assert!(table.contains("VALIDATION ON"));
        run.cases.clear();
        run.costs.clear();
        assert!(run.table().contains("was not measured"));
    }
}
