//! Who may import whom, and where the dangerous things may stand.

use std::fs;
use std::path::{Path, PathBuf};

fn files(folder: &str, extensions: &[&str]) -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    let mut folders = vec![root.join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of the crate") {
            let path = entry.expect("its entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path
                .extension()
                .and_then(|e| e.to_str())
                .is_some_and(|e| extensions.contains(&e))
            {
                let text = fs::read_to_string(&path).expect("a text file");
                found.push((
                    path.strip_prefix(root).expect("below the root").to_owned(),
                    text,
                ));
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "{folder} is empty");
    found
}

/// The code of a file, its comments left out.
fn code(text: &str) -> String {
    text.lines()
        .map(|l| l.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n")
}

/// The modules that the code names below `crate::`, grouped imports included.
fn imports(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + 7..];
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut name = String::new();
            for c in group.chars() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => found.push(std::mem::take(&mut name)),
                    c if depth == 0 => name.push(c),
                    _ => {}
                }
            }
            found.push(name);
        } else {
            found.push(rest.to_owned());
        }
    }
    found
        .iter()
        .map(|f| {
            f.trim()
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect()
        })
        .filter(|f: &String| !f.is_empty())
        .collect()
}

#[test]
fn layers_import_downwards_only() {
    let allowed: &[(&str, &[&str])] = &[
        ("scene", &["scene", "optics"]),
        ("optics", &["optics"]),
        ("ledger", &["ledger", "scene", "optics"]),
        ("cpu", &["cpu", "optics", "scene", "ledger"]),
        ("gpu", &["gpu"]),
        (
            "frame",
            &["frame", "gpu", "scene", "optics", "ledger", "cpu"],
        ),
        ("report", &["report", "scene", "ledger"]),
        (
            "view",
            &[
                "view", "frame", "scene", "report", "ledger", "optics", "gpu", "cpu",
            ],
        ),
        (
            "cli",
            &[
                "cli", "view", "frame", "scene", "report", "ledger", "optics", "gpu", "cpu",
            ],
        ),
    ];
    for (layer, may) in allowed {
        for (path, text) in files(&format!("src/{layer}"), &["rs"]) {
            for import in imports(&code(&text)) {
                assert!(
                    may.contains(&import.as_str()),
                    "{} imports {import}",
                    path.display()
                );
            }
            if !["gpu", "frame"].contains(layer) {
                assert!(
                    !code(&text).contains("ash::"),
                    "{} knows Vulkan",
                    path.display()
                );
            }
        }
    }
}

/// `frame/mod.rs` joins the passes; they know targets and tools, not each other.
#[test]
fn passes_do_not_import_each_other() {
    let passes = [
        "deform", "light", "reduce", "boxes", "view", "shade", "exact", "resolve", "history",
        "compose", "panel",
    ];
    for pass in passes {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("src/frame/{pass}.rs"));
        let text = code(&fs::read_to_string(path).expect("a pass"));
        for other in passes.iter().filter(|p| **p != pass) {
            // `shaders` is not `shade`.
            for form in [format!("super::{other}::"), format!("frame::{other}::")] {
                assert!(!text.contains(&form), "{pass} imports {other}");
            }
        }
        assert!(
            !["image(", "levels(", "buffer("]
                .iter()
                .any(|kind| text.contains(&format!("barrier::{kind}"))),
            "{pass} places a barrier; that is for frame/mod.rs"
        );
    }
}

#[test]
fn unsafe_stays_where_vulkan_is_called_and_says_why() {
    for (path, text) in files("src", &["rs"]) {
        let inside = path.starts_with("src/gpu") || path.starts_with("src/frame");
        let lines: Vec<_> = text.lines().collect();
        for (i, line) in lines.iter().enumerate() {
            let bare = line.split("//").next().unwrap_or_default();
            if !bare.contains("unsafe {") {
                continue;
            }
            assert!(inside, "{}:{} is unsafe", path.display(), i + 1);
            let near = &lines[i.saturating_sub(6)..i];
            let said = near.iter().any(|l| l.contains("SAFETY:"));
            assert!(
                said,
                "{}:{} does not say why it is sound",
                path.display(),
                i + 1
            );
        }
    }
}

#[test]
fn synchronisation_is_named_and_narrow() {
    for (path, text) in files("src", &["rs"]) {
        let text = code(&text);
        for banned in [
            "ALL_COMMANDS",
            "device_wait_idle",
            "MEMORY_WRITE",
            "MEMORY_READ",
        ] {
            assert!(!text.contains(banned), "{} uses {banned}", path.display());
        }
        // Each barrier's third argument says which hazard it resolves.
        for kind in ["barrier::image(", "barrier::levels(", "barrier::buffer("] {
            for (at, _) in text.match_indices(kind) {
                let call: String = text[at..].chars().take(200).collect();
                let named = ["c\"RAW", "c\"WAR", "c\"WAW", "c\"layout"]
                    .iter()
                    .any(|n| call.contains(n));
                assert!(
                    named,
                    "{}: a barrier names no hazard: {call}",
                    path.display()
                );
            }
        }
    }
}

#[test]
fn only_fetch_glsl_touches_a_texture() {
    let banned = [
        "texture(",
        "textureLod(",
        "textureGrad(",
        "textureOffset(",
        "textureProj(",
        "texelFetch(",
        "texelFetchOffset(",
        "textureGather(",
        "textureGatherOffset(",
        "imageLoad(",
        "subpassLoad(",
        "textureLodOffset(",
        "imageAtomic",
    ];
    for (path, text) in files("shaders", &["glsl", "vert", "frag", "comp"]) {
        if path.ends_with("fetch.glsl") {
            continue;
        }
        for name in banned {
            assert!(
                !code(&text).contains(name),
                "{} calls {name}",
                path.display()
            );
        }
    }
}
