//! The promise: the figures of `compare` are what their definitions say.

mod common;

use common::program::{exr, folder, names, png, run};
use std::path::Path;

fn json(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let mut all = vec!["compare", "--json"];
    all.extend(arguments);
    let ran = run(folder, &all);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    serde_json::from_str(&ran.stdout).expect("JSON")
}

fn figure(json: &serde_json::Value, name: &str) -> f64 {
    json[name]
        .as_f64()
        .unwrap_or_else(|| panic!("{name} in {json}"))
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} is not {expected}"
    );
}

#[test]
fn a_constant_offset_has_known_figures() {
    // Reference (0.5, 1, 2), picture 10 % above in every channel: each relative
    // difference is 0.1, and so is rr.
    let folder = folder();
    exr(folder.path(), "a.exr", [16, 8], |_, _| [0.5, 1.0, 2.0, 1.0]);
    exr(folder.path(), "b.exr", [16, 8], |_, _| {
        [0.55, 1.1, 2.2, 1.0]
    });
    let result = json(folder.path(), &["a.exr", "b.exr"]);
    let rmse = ((0.05f64.powi(2) + 0.1f64.powi(2) + 0.2f64.powi(2)) / 3.0).sqrt();
    near(figure(&result, "rr"), 0.1, 1e-6);
    near(figure(&result, "rmse"), rmse, 1e-6);
    // The peak of linear pictures is the reference's largest value.
    near(figure(&result, "psnr"), 20.0 * (2.0 / rmse).log10(), 1e-4);
    near(figure(&result, "peak"), 2.0, 0.0);
    for (channel, expected) in [0.05, 0.1, 0.2].into_iter().enumerate() {
        let found = result["mean_difference"][channel]
            .as_f64()
            .expect("a number");
        near(found, expected, 1e-6);
    }
    assert_eq!(result["domain"], "linear");
    assert_eq!(result["covered"], 128);
}

#[test]
fn a_checkerboard_of_differences_has_known_figures() {
    // Half of the pixels are off by 0.2 where the mean is 1: rr = 0.2 sqrt(1/2). The
    // signs cancel in the mean difference.
    let folder = folder();
    exr(folder.path(), "a.exr", [8, 8], |_, _| [1.0; 4]);
    exr(folder.path(), "b.exr", [8, 8], |x, y| {
        let v = match (x + y) % 4 {
            0 => 1.2,
            2 => 0.8,
            _ => 1.0,
        };
        [v, v, v, 1.0]
    });
    let result = json(folder.path(), &["a.exr", "b.exr"]);
    near(figure(&result, "rr"), 0.2 * 0.5f64.sqrt(), 1e-6);
    near(figure(&result, "rmse"), 0.2 * 0.5f64.sqrt(), 1e-6);
    near(
        result["mean_difference"][0].as_f64().expect("a number"),
        0.0,
        1e-6,
    );
}

#[test]
fn pngs_are_compared_as_displayed_but_rr_is_linear() {
    let folder = folder();
    png(folder.path(), "a.png", [8, 8], |_, _| [200, 200, 200, 255]);
    png(folder.path(), "b.png", [8, 8], |_, _| [180, 180, 180, 255]);
    let result = json(folder.path(), &["a.png", "b.png"]);
    let linear = |code: f64| ((code / 255.0 + 0.055) / 1.055).powf(2.4);
    near(figure(&result, "rmse"), 20.0 / 255.0, 1e-6);
    near(
        figure(&result, "psnr"),
        20.0 * (255.0f64 / 20.0).log10(),
        1e-4,
    );
    near(
        figure(&result, "rr"),
        1.0 - linear(180.0) / linear(200.0),
        1e-6,
    );
    assert_eq!(result["domain"], "display");
    assert!(figure(&result, "flip") > 0.0);
    assert!(figure(&result, "ssim") < 1.0);
}

#[test]
fn sixteen_bits_are_read_in_full() {
    let folder = folder();
    let write = |name: &str, value: u16| {
        image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(4, 4, image::Luma([value]))
            .save(folder.path().join(name))
            .expect("written");
    };
    write("a.png", 40000);
    write("b.png", 40010);
    let result = json(folder.path(), &["a.png", "b.png"]);
    near(figure(&result, "rmse"), 10.0 / 65535.0, 1e-7);
    // Grey without alpha covers every pixel.
    assert_eq!(result["covered"], 16);
}

#[test]
fn only_covered_pixels_count() {
    let folder = folder();
    let picture = |noise: f32| {
        move |x: u32, _: u32| match x {
            0..=3 => [1.0, 1.0, 1.0, 1.0],
            4 => [noise, noise, noise, 0.5],
            _ => [noise, 0.0, noise, 0.0],
        }
    };
    exr(folder.path(), "a.exr", [8, 8], picture(0.3));
    exr(folder.path(), "b.exr", [8, 8], picture(7.0));
    let result = json(folder.path(), &["a.exr", "b.exr"]);
    near(figure(&result, "rr"), 0.0, 0.0);
    assert_eq!(result["covered"], 32);
    assert!(result["psnr"].is_null(), "infinite");
}

#[test]
fn rr_does_not_depend_on_exposure() {
    let folder = folder();
    let picture = |gain: f32, noise: f32| {
        move |x: u32, y: u32| {
            let v = gain * (1.0 + 0.1 * x as f32) * (1.0 + noise * ((x * 7 + y * 13) % 5) as f32);
            [v, 0.5 * v, 0.1 * v, 1.0]
        }
    };
    for (name, gain, noise) in [
        ("a", 1., 0.),
        ("b", 1., 0.01),
        ("c", 16., 0.),
        ("d", 16., 0.01),
    ] {
        exr(
            folder.path(),
            &format!("{name}.exr"),
            [16, 16],
            picture(gain, noise),
        );
    }
    let near_one = figure(&json(folder.path(), &["a.exr", "b.exr"]), "rr");
    let exposed = figure(&json(folder.path(), &["c.exr", "d.exr"]), "rr");
    assert!(near_one > 0.01);
    near(exposed, near_one, 1e-6 * near_one);
}

#[test]
fn the_bound_decides_the_exit_code() {
    let folder = folder();
    exr(folder.path(), "a.exr", [4, 4], |_, _| [1.0; 4]);
    exr(folder.path(), "b.exr", [4, 4], |_, _| [1.1, 1.1, 1.1, 1.0]);
    let pass = run(
        folder.path(),
        &["compare", "a.exr", "b.exr", "--max-rr", "0.11"],
    );
    assert_eq!((pass.code, pass.stderr.as_str()), (0, ""));
    let fail = run(
        folder.path(),
        &["compare", "a.exr", "b.exr", "--max-rr", "0.09"],
    );
    assert_eq!(fail.code, 1);
    assert_eq!(fail.stderr.lines().count(), 1);
    for fragment in ["b.exr", "0.1000", "0.09", "--max-rr"] {
        assert!(fail.stderr.contains(fragment), "{}", fail.stderr);
    }
    // The figures are printed all the same.
    assert!(fail.stdout.starts_with("rr     0.1000"), "{}", fail.stdout);
}

#[test]
fn the_map_holds_the_picture_and_its_legend() {
    let folder = folder();
    exr(folder.path(), "a.exr", [320, 200], |_, _| [1.0; 4]);
    exr(folder.path(), "b.exr", [320, 200], |x, _| {
        let v = 1.0 + x as f32 / 320.0;
        [v, v, v, f32::from(u8::from(x > 10))]
    });
    let ran = run(
        folder.path(),
        &["compare", "a.exr", "b.exr", "--map", "map.png"],
    );
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let map = image::open(folder.path().join("map.png"))
        .expect("a PNG")
        .into_rgba8();
    assert_eq!(map.width(), 320);
    assert!(map.height() > 200);
    let brightness = |x| {
        map.get_pixel(x, 100).0[..3]
            .iter()
            .map(|&v| u32::from(v))
            .sum::<u32>()
    };
    assert!(brightness(300) > brightness(150) && brightness(150) > brightness(20));
    assert_eq!(names(folder.path()), ["a.exr", "b.exr", "map.png"]);
}
