//! What a user sees where Vulkan, a device or memory is missing.

mod common;

use common::program::{folder, marmor, names};

fn check(what: &str, set: &[(&str, &str)], arguments: &[&str], code: i32, holds: &[&str]) {
    let folder = folder();
    let output = marmor()
        .current_dir(folder.path())
        .envs(set.iter().copied())
        .args(arguments)
        .output()
        .expect("the binary runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{what}: {stderr}");
    assert_eq!(stderr.trim_end().lines().count(), 1, "{what}: {stderr}");
    for fragment in holds {
        assert!(
            stderr.contains(fragment),
            "{what}: \"{fragment}\" is not in: {stderr}"
        );
    }
    assert!(
        names(folder.path()).is_empty(),
        "{what}: something was written"
    );
}

const RENDER: [&str; 5] = ["render", "-o", "a.png", "--size", "8x8"];

#[test]
fn no_loader_ends_with_code_3_and_the_remedy() {
    let set = [("MARMOR_VULKAN_LOADER", "/nonexistent/libvulkan.so.1")];
    for arguments in [&RENDER[..], &["devices"], &["bench", "reduce"]] {
        check(
            "no loader",
            &set,
            arguments,
            3,
            &["no Vulkan loader", "libvulkan1"],
        );
    }
}

#[test]
fn no_device_ends_with_code_3_and_the_remedy() {
    // Both names of the variable that lists the drivers, old and new.
    let none = "/nonexistent.json";
    let set = [("VK_DRIVER_FILES", none), ("VK_ICD_FILENAMES", none)];
    for arguments in [&RENDER[..], &["devices"], &["bench", "reduce"]] {
        check("no driver", &set, arguments, 3, &["mesa-vulkan-drivers"]);
    }
}

#[test]
fn what_does_not_fit_the_device_is_refused_before_it_is_tried() {
    if !common::device::present() {
        return;
    }
    let mut small = RENDER.to_vec();
    small.extend(["--memory-limit", "1"]);
    check("light map", &[], &small, 2, &["--light-map", "MiB"]);

    let bench = [
        "bench",
        "reduce",
        "--light-map",
        "1024",
        "--memory-limit",
        "16",
        "--json",
        "t.json",
    ];
    check(
        "bench",
        &[],
        &bench,
        2,
        &["light map 1024", "--light-map", "MiB"],
    );

    // A million triangles need some 17 MiB with their staging copy.
    let folder = folder();
    let path = folder.path().join("large.obj");
    let side = 707;
    let mut text = String::with_capacity(40 << 20);
    for i in 0..=side {
        for j in 0..=side {
            text.push_str(&format!("v {i} {j} {}\n", (i * j) % 7));
        }
    }
    for i in 0..side {
        for j in 0..side {
            let a = i * (side + 1) + j + 1;
            text.push_str(&format!(
                "f {a} {} {}\nf {} {} {}\n",
                a + 1,
                a + side + 1,
                a + 1,
                a + side + 2,
                a + side + 1
            ));
        }
    }
    std::fs::write(&path, text).expect("a large file");
    let path = path.to_string_lossy().into_owned();
    let arguments = [
        "render",
        &path,
        "-o",
        "a.png",
        "--size",
        "8x8",
        "--light-map",
        "64",
        "--memory-limit",
        "12",
    ];
    check(
        "large mesh",
        &[],
        &arguments,
        2,
        &["triangles", "MiB", "decimate", "large.obj"],
    );
}
