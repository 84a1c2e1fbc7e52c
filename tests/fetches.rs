//! The promise: `marmor fetches` accounts for a picture, and its exit code tells scripts whether it keeps a budget.

mod common;

use common::device::present;
use common::program::{folder, names, run};
use serde_json::Value;

const SMALL: [&str; 6] = [
    "fetches",
    "statue-1k",
    "--size",
    "64x48",
    "--light-map",
    "64",
];

fn fetches(folder: &std::path::Path, more: &[&str]) -> common::program::Ran {
    run(folder, &[&SMALL[..], more].concat())
}

#[test]
fn the_ledger_is_a_table_and_a_document() {
    if !present() {
        return;
    }
    let folder = folder();
    let mixture = ["--multiple", "mixture", "--single", "8"];
    let table = fetches(folder.path(), &[&mixture[..], &["--sites"]].concat());
    assert_eq!((table.code, table.stderr.as_str()), (0, ""));
    for fragment in [
        "shade single",
        "shade multiple",
        "resolve other",
        "reads of input attachments",
        "reduce, smooth.comp",
        "single.glsl:",
        " above: sample x 8, loop single.glsl:",
        "unrolled 36 times",
    ] {
        assert!(
            table.stdout.contains(fragment),
            "{fragment}: {}",
            table.stdout
        );
    }
    assert!(!table.stdout.contains("DIFFERS"));
    let json = fetches(folder.path(), &[&mixture[..], &["--json"]].concat());
    let json: Value = serde_json::from_str(&json.stdout).expect("JSON");
    let per_pixel = &json["per_pixel"];
    assert_eq!(per_pixel["declared"], per_pixel["found"]);
    assert_eq!(
        per_pixel["declared"].as_f64(),
        per_pixel["measured"].as_f64()
    );
    let terms = json["terms"].as_array().expect("terms");
    let single = terms
        .iter()
        .find(|t| t["term"] == "single")
        .expect("single");
    assert_eq!(
        (&single["declared"], &single["measured"]),
        (&8.0.into(), &8.0.into())
    );
    assert_eq!(single["textures"][0]["sites"][0]["function"], "above");
    assert_eq!(json["disagreements"], Value::Array(Vec::new()));
}

#[test]
fn a_budget_names_what_breaks_it() {
    if !present() {
        return;
    }
    let folder = folder();
    let plan = ["--multiple", "samples", "--samples", "16", "--single", "4"];
    let with = |budget: &str| fetches(folder.path(), &[&plan[..], &["--budget", budget]].concat());
    // The gather, 4 of the march, 18 of the samples, and one to resolve.
    assert_eq!(with("24").code, 0);
    let broken = with("23");
    assert_eq!(broken.code, 1);
    assert_eq!(
        broken.stderr,
        "marmor: the budget of 23 fetches a pixel breaks in pass resolve, term other: 24 with it, 24 in all\n"
    );
    let broken = with("20");
    assert!(
        broken
            .stderr
            .contains("pass shade, term multiple: 23 with it"),
        "{}",
        broken.stderr
    );
    assert!(
        broken.stdout.contains("in all"),
        "the table is printed all the same"
    );
    let broken = with("3");
    assert!(
        broken.stderr.contains("pass shade, term single: 5 with it"),
        "{}",
        broken.stderr
    );
}

#[test]
fn the_heatmap_has_a_legend() {
    if !present() {
        return;
    }
    let folder = folder();
    let ran = fetches(
        folder.path(),
        &[
            "--multiple",
            "mixture",
            "--single",
            "off",
            "--heatmap",
            "map.png",
        ],
    );
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let map = image::open(folder.path().join("map.png"))
        .expect("a picture")
        .to_rgba8();
    assert!(map.width() >= 64 && map.height() > 48 + 20);
    // Statue and background differ.
    assert_ne!(map.get_pixel(32, 24), map.get_pixel(1, 1));
}

#[test]
fn what_cannot_be_accounted_for_is_refused() {
    let folder = folder();
    for (more, fragment) in [
        (
            &["--split", "brdf", "--multiple", "samples"][..],
            "--split: the ledger is of one method",
        ),
        (
            &["--heatmap", "map.exr"][..],
            "map.exr: the map is for display; name a .png file",
        ),
        (&["--budget", "0"][..], "--budget"),
    ] {
        let ran = fetches(folder.path(), more);
        assert_eq!(ran.code, 2, "{more:?}");
        assert!(ran.stderr.contains(fragment), "{}", ran.stderr);
        assert_eq!(names(folder.path()), [""; 0]);
    }
}
