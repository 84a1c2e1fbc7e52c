//! A run as one page of HTML that needs nothing beside it: no script, no network.

use super::plot::{self, Key, Plot, hex};
use super::{Case, Cost, Fit, Pass, Run, Spread, count, digits, error, grouped};
use crate::report::{Error, Output};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::io::Write as _;

const STYLE: &str = include_str!("style.css");

impl Run {
    /// Writes [`Run::html`].
    ///
    /// # Errors
    /// The disk does not take the file.
    pub fn write_html(&self, output: &Output) -> Result<(), Error> {
        output.write(|writer| writer.write_all(self.html().as_bytes()))
    }

    /// The run as a page: header, findings, plots, a table a group, and pictures. All in
    /// one file, well-formed as XML but for its first line.
    pub fn html(&self) -> String {
        let header = &self.header;
        let title = format!("marmor bench: {}, {}", header.device, header.date);
        let mut body = self.opening();
        body.push_str(&self.roofline());
        body.push_str(&self.plots());
        let passes = self.passes();
        for (index, (group, cases)) in self.groups().into_iter().enumerate() {
            body.push_str(&section(index, group, &cases, &passes));
        }
        body.push_str(&fits(&self.fits));
        body.push_str(&format!(
            "<footer>Written by marmor {}. The same figures as data: <code>--csv</code> and \
             <code>--json</code>.</footer>",
            escape(&header.marmor)
        ));
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\" />\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\" />\n\
             <title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{body}\n\
             </main>\n</body>\n</html>\n",
            escape(&title)
        )
    }

    fn opening(&self) -> String {
        let device = escape(&self.header.device);
        let date = escape(&self.header.date);
        let mut head = format!("<h1>marmor bench</h1>\n<p class=\"lead\">{device}, {date}</p>\n");
        for warning in self.warnings() {
            head.push_str(&format!("<p class=\"warn\">{}</p>\n", escape(&warning)));
        }
        head.push_str("<nav><a href=\"#costs\">Costs</a><a href=\"#plots\">Plots</a>");
        for (index, (group, _)) in self.groups().iter().enumerate() {
            let name = escape(&capital(group));
            head.push_str(&format!("<a href=\"#group-{index}\">{name}</a>"));
        }
        head.push_str("</nav>\n<div class=\"opening\"><div><h2>Summary</h2>\n");
        head.push_str(&list(&self.findings()));
        head.push_str(
            "</div>\n<div><h2>Run</h2>\n<div class=\"scroll\"><table class=\"facts\"><tbody>",
        );
        for (name, value) in self.header_rows() {
            let (name, value) = (escape(name), escape(&value));
            head.push_str(&format!(
                "<tr><th class=\"t\">{name}</th><td class=\"t\">{value}</td></tr>"
            ));
        }
        head.push_str("</tbody></table></div>\n");
        head.push_str("</div></div>\n");
        if !self.notes.is_empty() {
            head.push_str("<h3>Notes</h3>\n");
            head.push_str(&list(&self.notes));
        }
        head
    }

    fn roofline(&self) -> String {
        let mut html = "<h2 id=\"costs\">What a fetch costs</h2>\n".to_owned();
        if self.costs.is_empty() {
            return html + "<p>Not measured.</p>\n";
        }
        html.push_str(
            "<p>All cores of the device together, in a shader that does nothing else. A pass's \
             floor is the sum of these over its fetches: what it would take if all else were \
             free. That of shading is measured, by a build that only reads.</p>\n",
        );
        let rows = self.costs.iter().map(cost).collect();
        let columns = [
            "kind",
            "format",
            "bytes a texel",
            "ns",
            "5 % to 95 %",
            "M fetches a second",
        ];
        html + &table(&columns.map(str::to_owned), 2, rows)
    }

    fn plots(&self) -> String {
        let mut html = "<h2 id=\"plots\">Plots</h2>\n".to_owned();
        for (group, cases) in self.groups() {
            if let Some(plot) = plot::errors(&cases) {
                html.push_str(&figure(&format!("Error against fetches: {group}"), &plot));
            }
        }
        html.push_str("<div class=\"pair\">\n");
        for (title, plot) in plot::growth(self) {
            html.push_str(&figure(&title, &plot));
        }
        html + "</div>\n"
    }
}

fn cost(cost: &Cost) -> Vec<String> {
    let time = cost.nanoseconds;
    let rate = (time.median > 0.0).then(|| digits(1e3 / time.median));
    vec![
        escape(&cost.kind),
        escape(&cost.format),
        cost.bytes.to_string(),
        digits(time.median),
        ends(time),
        rate.unwrap_or_else(dash),
    ]
}

fn section(index: usize, group: &str, cases: &[&Case], passes: &[&str]) -> String {
    let name = escape(&capital(group));
    let mut html = format!("<h2 id=\"group-{index}\">{name}</h2>\n");
    if let Some(plot) = plot::stacks(cases, passes) {
        html.push_str(&figure("Where the time goes", &plot));
    }
    html.push_str(&cases_table(cases, passes));
    // Said once; the tables are alike.
    if index == 0 {
        html.push_str(&format!("<p class=\"legend\">{LEGEND}</p>\n"));
    }
    html.push_str(&pictures(cases));
    html
}

/// A column of a group's table: its name, and what it says of a case.
type Column = (&'static str, fn(&Case) -> String);

/// What tells cases apart, where it does.
const VARIED: [Column; 5] = [
    ("scene", |case| escape(&case.scene)),
    ("triangles", |case| grouped(case.triangles)),
    ("size", |case| format!("{}×{}", case.size[0], case.size[1])),
    ("light map", |case| format!("{}²", case.light_map)),
    ("budget", |case| {
        case.budget.map_or_else(dash, |budget| budget.to_string())
    }),
];

const FIGURES: [Column; 6] = [
    ("fetches", |case| case.fetches.to_string()),
    ("rr", |case| case.error.map_or_else(dash, error)),
    ("frame ms", |case| digits(case.device.median)),
    ("5 % to 95 %", |case| ends(case.device)),
    ("wall ms", |case| digits(case.wall.median)),
    ("fps", |case| case.rate().map_or_else(dash, digits)),
];

/// What the tables' columns mean.
const LEGEND: &str = "Fetches are declared a pixel. The frame is the sum of its passes on the \
    device; the wall clock runs until the fence, and fps are by it. Each pass has its time, ms, \
    and below it its fetches in a frame (declared times pixels or texels) and its time over its floor.";

fn cases_table(cases: &[&Case], passes: &[&str]) -> String {
    let told = |column: &Column| {
        cases
            .iter()
            .any(|case| column.1(case) != column.1(cases[0]))
    };
    let columns: Vec<Column> = VARIED
        .into_iter()
        .filter(told)
        .chain(FIGURES.into_iter().filter(|(name, value)| {
            // A sweep without references has no errors to show.
            *name != "rr" || cases.iter().any(|case| value(case) != dash())
        }))
        .collect();
    let timed = |pass: &&str| cases.iter().any(|case| case.time(pass).is_some());
    let passes: Vec<&str> = passes.iter().copied().filter(timed).collect();
    let mut names = vec!["case".to_owned()];
    names.extend(columns.iter().map(|(name, _)| (*name).to_owned()));
    names.extend(passes.iter().map(|pass| escape(pass)));
    let rows = cases
        .iter()
        .map(|case| {
            let mut row = vec![escape(&case.name)];
            row.extend(columns.iter().map(|(_, value)| value(case)));
            row.extend(passes.iter().map(|name| {
                let pass = case.passes.iter().find(|pass| pass.pass == *name);
                pass.map_or_else(dash, pass_cell)
            }));
            row
        })
        .collect();
    table(&names, 1, rows)
}

fn pass_cell(pass: &Pass) -> String {
    let mut cell = digits(pass.time.median);
    let factor = pass.over_floor();
    let factor = factor.map(|factor| format!(", {}×", digits(factor)));
    if pass.fetches > 0.0 {
        let (fetches, factor) = (count(pass.fetches), factor.unwrap_or_default());
        cell.push_str(&format!("<small>{fetches}{factor}</small>"));
    }
    cell
}

fn pictures(cases: &[&Case]) -> String {
    let shown: Vec<String> = cases.iter().filter_map(|case| picture(case)).collect();
    if shown.is_empty() {
        return String::new();
    }
    format!("<div class=\"pictures\">\n{}</div>\n", shown.concat())
}

fn picture(case: &Case) -> Option<String> {
    let data = STANDARD.encode(case.picture.as_ref()?);
    let rr = case.error.map(|value| format!(", rr {}", error(value)));
    let name = escape(&case.name);
    Some(format!(
        "<figure><img src=\"data:image/png;base64,{data}\" alt=\"{name}\" /><figcaption>\
         <b>{name}</b>{} fetches a pixel, {} ms{}</figcaption></figure>\n",
        case.fetches,
        digits(case.device.median),
        rr.unwrap_or_default()
    ))
}

fn fits(fits: &[Fit]) -> String {
    if fits.is_empty() {
        return String::new();
    }
    let names = [
        "group",
        "method",
        "time of",
        "against",
        "intercept",
        "slope",
        "R²",
        "exponent",
    ];
    let rows = fits
        .iter()
        .map(|fit| {
            // A power law has neither.
            let line = fit.exponent.is_none();
            let shown = |value: String| if line { value } else { dash() };
            vec![
                escape(&fit.group),
                escape(&fit.method),
                escape(&fit.pass),
                escape(&fit.x),
                shown(format!("{} ms", digits(fit.intercept))),
                shown(super::per_unit(fit.slope)),
                format!("{:.4}", fit.r2),
                fit.exponent
                    .map_or_else(dash, |exponent| format!("{exponent:.3}")),
            ]
        })
        .collect();
    format!(
        "<h2>Fits</h2>\n<p>Time = intercept + slope × abscissa by least squares, or time \
         proportional to a power of it.</p>\n{}",
        table(&names.map(str::to_owned), 4, rows)
    )
}

/// A table whose first columns, so many, are text. Cells are HTML.
fn table(names: &[String], texts: usize, rows: Vec<Vec<String>>) -> String {
    let class = |index: usize| if index < texts { " class=\"t\"" } else { "" };
    let mut html = "<div class=\"scroll\"><table class=\"full\">\n<thead><tr>".to_owned();
    for (index, name) in names.iter().enumerate() {
        html.push_str(&format!("<th{}>{name}</th>", class(index)));
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        html.push_str("<tr>");
        for (index, cell) in row.iter().enumerate() {
            let tag = if index == 0 { "th" } else { "td" };
            html.push_str(&format!("<{tag}{}>{cell}</{tag}>", class(index)));
        }
        html.push_str("</tr>\n");
    }
    html + "</tbody>\n</table></div>\n"
}

fn figure(title: &str, plot: &Plot) -> String {
    let keys: String = plot.keys.iter().map(key).collect();
    let caption: Vec<String> = plot.captions.iter().map(|text| escape(text)).collect();
    format!(
        "<figure><h3>{}</h3>\n<ul class=\"keys\">{keys}</ul>\n{}\n<figcaption>{}</figcaption>\
         </figure>\n",
        escape(&capital(title)),
        plot.svg,
        caption.join("<br />")
    )
}

fn key(key: &Key) -> String {
    let corners: Vec<String> = key
        .outline
        .iter()
        .map(|(x, y)| format!("{x:.2},{y:.2}"))
        .collect();
    format!(
        "<li><svg class=\"swatch\" viewBox=\"-1 -1 2 2\"><polygon points=\"{}\" fill=\"{}\" />\
         </svg>{}</li>",
        corners.join(" "),
        hex(key.color),
        escape(&key.text)
    )
}

fn list(items: &[String]) -> String {
    let items: String = items
        .iter()
        .map(|item| format!("<li>{}</li>\n", escape(item)))
        .collect();
    if items.is_empty() {
        return items;
    }
    format!("<ul>\n{items}</ul>\n")
}

fn ends(spread: Spread) -> String {
    format!("{} – {}", digits(spread.p5), digits(spread.p95))
}

fn dash() -> String {
    "–".to_owned()
}

/// The text with its first letter as a sentence begins.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}

/// The text as HTML shows it, in elements and in quoted attributes. Control characters,
/// which XML forbids, become blanks.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            letter if letter.is_control() => escaped.push(' '),
            letter => escaped.push(letter),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::super::example;
    use super::*;

    /// Checks that each element is closed in order and each attribute quoted.
    fn well_formed(html: &str) {
        let text = html.strip_prefix("<!DOCTYPE html>").expect("a page");
        let mut open: Vec<&str> = Vec::new();
        let mut rest = text;
        while let Some((before, after)) = rest.split_once('<') {
            assert!(
                !before.contains('>') || open.last() == Some(&"style"),
                "{before}"
            );
            let (tag, behind) = after.split_once('>').expect("a tag's end");
            rest = behind;
            if let Some(name) = tag.strip_prefix('/') {
                assert_eq!(open.pop(), Some(name.trim()));
            } else {
                assert_eq!(tag.matches('"').count() % 2, 0, "<{tag}>");
                assert!(!tag.contains("=\"\""), "<{tag}>");
                if !tag.ends_with('/') {
                    let name = tag.split([' ', '\n']).next().expect("a name");
                    open.push(name);
                }
            }
        }
        assert!(open.is_empty(), "{open:?}");
        for entity in text.split('&').skip(1) {
            let name = entity.split(';').next().expect("a name");
            assert!(
                ["amp", "lt", "gt", "quot", "apos", "#39"].contains(&name),
                "&{name}"
            );
        }
    }

    fn written(run: &Run) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        // Kept where a variable says so, to be looked at.
        let kept = std::env::var_os("MARMOR_KEEP_HTML").map(std::path::PathBuf::from);
        let path = kept.unwrap_or_else(|| folder.path().join("bench.html"));
        run.write_html(&Output::check(&path).expect("writable"))
            .expect("written");
        std::fs::read_to_string(&path).expect("text")
    }

    #[test]
    fn the_page_is_whole_and_needs_nothing_else() {
        let run = example::run();
        let html = written(&run);
        well_formed(&html);
        for case in &run.cases {
            assert!(
                html.contains(&format!(">{}</th>", escape(&case.name))),
                "{}",
                case.name
            );
        }
        for forbidden in ["<script", "<link", "@import", "url(", "javascript:"] {
            assert!(!html.contains(forbidden), "{forbidden}");
        }
        // The name of SVG's namespace is the one address, and none is fetched.
        let addresses = html.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
        assert!(!addresses.contains("://"));
        let pictures = run
            .cases
            .iter()
            .filter(|case| case.picture.is_some())
            .count();
        assert_eq!(html.matches("<img ").count(), pictures);
        assert_eq!(
            html.matches("src=\"data:image/png;base64,").count(),
            pictures
        );
        assert_eq!(html.matches("src=").count(), pictures);
        // Errors, four sweeps, and the bars of each group.
        let drawings = html.matches("<svg width=").count();
        assert_eq!(drawings, 1 + 4 + run.groups().len());
        for said in [
            "What a fetch costs",
            "gather and compare",
            "R²",
            "llvmpipe",
            "×</small>",
        ] {
            assert!(html.contains(said), "{said}");
        }
        assert!(!html.contains("class=\"warn\""));
    }

    #[test]
    fn pictures_are_the_bytes_that_were_given() {
        let mut run = example::run();
        run.cases.truncate(1);
        run.cases[0].picture = Some(vec![0, 1, 2, 253, 254, 255, 7]);
        let html = run.html();
        let data = html.split_once("base64,").expect("a picture").1;
        let data = data.split_once('"').expect("its end").0;
        assert_eq!(data, "AAEC/f7/Bw==");
    }

    #[test]
    fn text_is_shown_and_never_obeyed() {
        let mut run = example::run();
        let evil = "<script>alert(\"1\")</script> & 'x'\u{1b}";
        run.cases[0].name = evil.to_owned();
        run.cases[0].scene = evil.to_owned();
        run.cases[0].group = evil.to_owned();
        run.cases[0].multiple = evil.to_owned();
        run.cases[0].passes[0].pass = evil.to_owned();
        run.header.command = evil.to_owned();
        run.header.device = evil.to_owned();
        run.costs[0].kind = evil.to_owned();
        run.fits[0].method = evil.to_owned();
        run.notes.push(evil.to_owned());
        let html = run.html();
        well_formed(&html);
        assert!(!html.contains("<script") && !html.contains('\u{1b}'));
        assert!(html.contains("&lt;script&gt;alert("));
    }

    #[test]
    fn an_interrupted_or_empty_run_has_a_page_that_says_so() {
        let mut run = example::run();
        run.complete = false;
        run.header.validation = true;
        run.cases.truncate(2);
        let html = run.html();
        assert_eq!(html.matches("class=\"warn\"").count(), 2);
        assert!(html.contains("INCOMPLETE: interrupted after 2 cases"));
        run.cases.clear();
        run.costs.clear();
        run.fits.clear();
        run.notes.clear();
        well_formed(&run.html());
    }
}
