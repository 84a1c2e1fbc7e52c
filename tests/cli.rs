//! The promise: every command runs as its help says, and scripts can rely on it.

mod common;

use common::program::{folder, marmor, names, run};
use std::process::{Command, Stdio};

const COMMANDS: [&str; 7] = [
    "render",
    "compare",
    "fetches",
    "bench",
    "devices",
    "completions",
    "man",
];

#[test]
fn every_command_has_help_with_examples() {
    let folder = folder();
    let main = run(folder.path(), &["--help"]);
    assert_eq!(main.code, 0);
    for fragment in ["Exit codes", "Examples", "MARMOR_DEVICE"] {
        assert!(main.stdout.contains(fragment), "{fragment}");
    }
    for command in COMMANDS {
        assert!(main.stdout.contains(command), "{command}");
        let long = run(folder.path(), &[command, "--help"]);
        assert_eq!((long.code, long.stderr.as_str()), (0, ""), "{command}");
        assert!(long.stdout.contains("Examples:"), "{command}");
        let short = run(folder.path(), &[command, "-h"]);
        assert_eq!(short.code, 0);
        assert!(short.stdout.len() < long.stdout.len(), "{command}");
    }
    let nested = run(folder.path(), &["bench", "reduce", "--help"]);
    assert_eq!((nested.code, nested.stderr.as_str()), (0, ""));
    assert!(nested.stdout.contains("Examples:"));
    assert_eq!(run(folder.path(), &[]).code, 2);
    assert!(
        run(folder.path(), &["--version"])
            .stdout
            .contains(env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn completions_parse() {
    let folder = folder();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let ran = run(folder.path(), &["completions", shell]);
        assert_eq!(ran.code, 0, "{shell}");
        assert!(ran.stdout.contains("frames-averaged"), "{shell}");
        if shell == "bash" {
            let script = common::program::file(folder.path(), "marmor.bash", &ran.stdout);
            match Command::new("bash").arg("-n").arg(script).status() {
                Ok(status) => assert!(status.success()),
                Err(error) => eprintln!("skipped, no bash: {error}"),
            }
        }
    }
}

#[test]
fn the_manual_is_printed_and_written() {
    let folder = folder();
    let ran = run(folder.path(), &["man"]);
    assert_eq!(ran.code, 0);
    assert!(ran.stdout.contains(".TH marmor 1"), "{}", ran.stdout);
    assert_eq!(run(folder.path(), &["man", "--out", "."]).code, 0);
    let expected: Vec<String> = [
        "-animate",
        "-bench-reduce",
        "-bench",
        "-compare",
        "-completions",
        "-devices",
        "-fetches",
        "-man",
        "-render",
        "-view",
        "",
    ]
    .iter()
    .map(|command| format!("marmor{command}.1"))
    .collect();
    assert_eq!(names(folder.path()), expected);
    let page = std::fs::read_to_string(folder.path().join("marmor-render.1")).expect("a page");
    assert!(
        page.contains("marmor\\-render") || page.contains("marmor-render"),
        "{page}"
    );
}

#[test]
#[cfg(unix)]
fn a_closed_pipe_is_no_fault() {
    // The reader closes before marmor writes, so every write meets a broken pipe.
    let mut child = marmor()
        .args(["completions", "zsh"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_behind_stdout_is_a_fault() {
    let full = std::fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .expect("/dev/full");
    let output = marmor()
        .args(["completions", "zsh"])
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .expect("the binary runs");
    assert_eq!(output.status.code(), Some(2));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.starts_with("marmor: stdout: "), "{stderr}");
}

/// Every way is measured, and the file says what the table says.
#[test]
fn bench_reduce_measures_every_way() {
    if !common::device::present() {
        return;
    }
    let folder = folder();
    let arguments = [
        "bench",
        "reduce",
        "--light-map",
        "64",
        "--rounds",
        "3",
        "--json",
        "t.json",
    ];
    let ran = run(folder.path(), &arguments);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{}", ran.stdout);
    let text = std::fs::read_to_string(folder.path().join("t.json")).expect("a file");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(
        (&json["light_map"], &json["rounds"]),
        (&64.into(), &3.into())
    );
    let ways = json["ways"].as_array().expect("ways");
    let names: Vec<_> = ways.iter().filter_map(|way| way["way"].as_str()).collect();
    assert_eq!(
        names,
        [
            "levels",
            "shared",
            "blit",
            "decimate",
            "decimate, smooth from 0",
            "decimate, smooth from 1"
        ]
    );
    for way in ways {
        let time = |key: &str| way[key].as_f64().expect("a time");
        assert!(0.0 < time("p5") && time("p5") <= time("median") && time("median") <= time("p95"));
        assert!(time("ratio") > 0.0);
        assert!(
            ran.stdout.contains(&format!("{:.4}", time("median"))),
            "{}",
            ran.stdout
        );
    }
    assert!(ran.stdout.contains("64x64") && ran.stdout.contains("3 rounds"));
}
