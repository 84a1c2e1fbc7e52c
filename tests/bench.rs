//! The promise: `marmor bench` writes what it measured, also when it is interrupted, and compares with an earlier run.

mod common;

use common::device::present;
use common::program::{file, folder, marmor, names, run};
use serde_json::Value;
use std::process::{Command, Stdio};

const SMALL: [&str; 6] = ["bench", "statue-1k", "--quick", "--frames", "2", "-q"];

#[test]
fn a_run_is_a_table_a_document_rows_and_a_page() {
    if !present() {
        return;
    }
    let folder = folder();
    let run_of = |more: &[&str]| run(folder.path(), &[&SMALL[..], more].concat());
    let ran = run_of(&[
        "--only",
        "methods/mixture 3 + single 8",
        "--json",
        "a.json",
        "--csv",
        "a.csv",
        "--html",
        "a.html",
    ]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    for fragment in [
        "what a fetch costs",
        "trilinear",
        "mixture 3 + single 8, light rests",
        "x floor",
    ] {
        assert!(ran.stdout.contains(fragment), "{fragment}: {}", ran.stdout);
    }
    assert_eq!(names(folder.path()), ["a.csv", "a.html", "a.json"]);
    let json = std::fs::read_to_string(folder.path().join("a.json")).expect("a document");
    let json: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["complete"], true);
    let cases = json["cases"].as_array().expect("cases");
    let at_full = |c: &&Value| !c["name"].as_str().expect("a name").ends_with("half");
    let cases: Vec<&Value> = cases.iter().filter(at_full).collect();
    assert_eq!(cases.len(), 2);
    let passes = |case: &Value| -> Vec<String> {
        let passes = case["passes"].as_array().expect("passes");
        passes
            .iter()
            .map(|p| p["pass"].as_str().expect("a name").to_owned())
            .collect()
    };
    // Light and pyramid are drawn in each frame, or rest.
    assert!(passes(cases[0]).contains(&"reduce".to_owned()));
    assert!(!passes(cases[1]).contains(&"reduce".to_owned()));
    for case in cases {
        let covered = case["covered"].as_f64().expect("a share");
        let pixels = covered * 320.0 * 240.0;
        let all = case["passes"].as_array().expect("passes");
        let shade = all.iter().find(|p| p["pass"] == "shade").expect("shade");
        // All but resolve's one fetch are of covered pixels.
        let fetches = case["fetches"].as_f64().expect("fetches") - 1.0;
        assert!((shade["fetches"].as_f64().expect("fetches") - pixels * fetches).abs() < 0.5);
        // Where the device counts, a fragment ran for each covered pixel, at least: llvmpipe counts those that the depth
        // test drops as well.
        if let Some(ran) = shade["invocations"].as_f64() {
            assert!(
                ran >= pixels && ran < 1.1 * 320.0 * 240.0,
                "{ran} for {pixels}"
            );
        }
        let error = case["error"].as_f64().expect("an error");
        assert!(error > 0.0 && error < 0.2, "{error}");
        // The passes are the frame, and the host adds little but time of its own.
        let (device, wall) = (&case["device"]["median"], &case["wall"]["median"]);
        assert!(device.as_f64().expect("ms") <= wall.as_f64().expect("ms"));
    }
    let rows = std::fs::read_to_string(folder.path().join("a.csv")).expect("rows");
    assert!(rows.lines().count() > 10);
    let page = std::fs::read_to_string(folder.path().join("a.html")).expect("a page");
    assert!(page.contains("data:image/png;base64,") && page.contains("<svg"));

    // Against itself nothing is slower; a baseline whose shading took a hundredth of the time is.
    let same = run_of(&["--only", "light rests", "--baseline", "a.json"]);
    assert!(!same.stderr.contains("is not"), "{}", same.stderr);
    let mut fast = json;
    for case in fast["cases"].as_array_mut().expect("cases") {
        for pass in case["passes"].as_array_mut().expect("passes") {
            for key in ["median", "p5", "p95"] {
                let time = pass["time"][key].as_f64().expect("ms");
                pass["time"][key] = (0.01 * time).into();
            }
        }
    }
    file(folder.path(), "fast.json", fast.to_string());
    let slower = run_of(&["--only", "light rests", "--baseline", "fast.json"]);
    assert_eq!(slower.code, 1);
    assert!(
        slower
            .stderr
            .contains("slower than the baseline beyond noise"),
        "{}",
        slower.stderr
    );
    assert!(
        slower.stderr.contains("light rests, shade"),
        "{}",
        slower.stderr
    );
}

#[test]
#[cfg(unix)]
fn an_interrupted_run_writes_what_it_has() {
    if !present() {
        return;
    }
    let folder = folder();
    // More frames than anyone waits for.
    let mut child = marmor()
        .current_dir(folder.path())
        .args([
            "bench",
            "statue-1k",
            "--quick",
            "--frames",
            "10000",
            "--only",
            "single 4",
            "-q",
            "--json",
            "a.json",
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    std::thread::sleep(std::time::Duration::from_secs(4));
    let killed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(killed.expect("kill runs").success());
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(1));
    let json = std::fs::read_to_string(folder.path().join("a.json")).expect("a document");
    let json: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["complete"], false);
    assert_eq!(json["cases"].as_array().map(Vec::len), Some(0));
}

/// A scene that moves is posed in every frame, and its own mesh is in all of its cases.
#[test]
fn what_moves_is_measured() {
    if !present() {
        return;
    }
    let folder = folder();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/betta.toml");
    let ran = run(folder.path(), &["bench", scene, "--quick", "--list"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(!ran.stdout.contains("triangles/"), "{}", ran.stdout);
    let only = "methods/mixture 3 + single 8";
    let arguments = [
        "bench", scene, "--quick", "--frames", "2", "-q", "--only", only,
    ];
    let ran = run(folder.path(), &arguments);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(ran.stdout.contains("deform"), "{}", ran.stdout);
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let folder = folder();
    file(folder.path(), "other.json", "{}");
    for (more, fragment) in [
        (
            &["--only", "nothing"][..],
            "--only nothing: no case has that in its name",
        ),
        (
            &["--baseline", "missing.json"][..],
            "missing.json: no such file",
        ),
        (
            &["--baseline", "other.json"][..],
            "other.json: not a run of 'marmor bench'",
        ),
        (&["--html", "no/such/folder.html"][..], "there is no folder"),
        (&["missing.toml"][..], "missing.toml"),
    ] {
        let ran = run(
            folder.path(),
            &[&["bench", "--quick", "--list"][..], more].concat(),
        );
        assert_eq!(ran.code, 2, "{more:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(fragment), "{}", ran.stderr);
    }
    let list = run(folder.path(), &["bench", "--list"]);
    assert_eq!(list.code, 0);
    assert!(
        list.stdout
            .lines()
            .any(|l| l == "paper/20K, mixture 3 + single 8"),
        "{}",
        list.stdout
    );
    assert_eq!(names(folder.path()), ["other.json"]);
}
