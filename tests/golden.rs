//! Small pictures of the statue, kept by driver: nothing changes unseen.
//!
//! `MARMOR_UPDATE_GOLDENS=1 cargo test --release --test golden` writes them anew for the driver
//! at hand. Where a picture differs, what was rendered and the difference, amplified, go to
//! tests/out/, named by driver.

mod common;

use std::path::{Path, PathBuf};

use common::device;
use image::{Rgb, RgbImage};
use marmor::frame::{Renderer, Setup};
use marmor::scene::{Method, Request, Single};

const SIZE: [u32; 2] = [96, 120];

/// The part of a driver's description that names it: "llvmpipe", "nvidia", "radv".
fn driver_of(description: &str) -> String {
    let name: String = description
        .chars()
        .take_while(|c| c.is_alphanumeric())
        .collect::<String>()
        .to_lowercase();
    if name.is_empty() {
        "unknown".to_owned()
    } else {
        name
    }
}

/// Mean and largest difference of two pictures, in 8-bit steps.
fn difference(a: &RgbImage, b: &RgbImage) -> (f64, u8) {
    let steps: Vec<u8> = a
        .as_raw()
        .iter()
        .zip(b.as_raw())
        .map(|(a, b)| a.abs_diff(*b))
        .collect();
    let sum: f64 = steps.iter().map(|s| f64::from(*s)).sum();
    (
        sum / steps.len() as f64,
        steps.into_iter().max().unwrap_or(0),
    )
}

#[test]
fn pictures_are_as_they_were() {
    let Some(device) = device::device() else {
        return;
    };
    let driver = driver_of(&device.device.candidate().driver);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let update = std::env::var_os("MARMOR_UPDATE_GOLDENS").is_some_and(|v| v == "1");
    let mut faults = Vec::new();
    for (method, volumes) in [
        (Method::Brdf, 0),
        (Method::Samples, 0),
        (Method::Rings, 0),
        (Method::Mixture, 0),
        (Method::Mixture, 3),
        (Method::Exact, 0),
        (Method::None, 0),
    ] {
        let name = match (method, volumes) {
            (Method::None, _) => "single".to_owned(),
            (method, 0) => method.name().to_owned(),
            (method, _) => format!("{}-volumes", method.name()),
        };
        let mut request = Request::statue();
        request.size = SIZE;
        request.multiple = method;
        // Alone, since it goes with every method alike.
        request.single = match method {
            Method::None => request.single,
            _ => Single::Off,
        };
        request.volumes = volumes;
        request.light_map = 96;
        // A light map this small resolves a material ten times as transparent.
        request.material.sigma_s *= 0.2;
        request.material.sigma_a *= 0.2;
        request.background = Some([0.01, 0.02, 0.03]);
        request.frames_averaged = Some(if method == Method::Exact { 1 } else { 4 });
        let plan = request.plan().expect("a plan");
        let mut renderer =
            Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
        renderer.render(&mut |_| ()).expect("a picture");
        let rgb = renderer
            .display()
            .expect("its pixels")
            .iter()
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect();
        let picture = RgbImage::from_raw(SIZE[0], SIZE[1], rgb).expect("as many pixels");

        let file = |driver: &str| -> PathBuf {
            root.join("golden").join(driver).join(format!("{name}.png"))
        };
        if update {
            std::fs::create_dir_all(root.join("golden").join(&driver)).expect("a folder");
            picture.save(file(&driver)).expect("a golden picture");
            continue;
        }
        // Rasterisers differ at edges and in rounding: a driver without pictures of its own is
        // held to llvmpipe's, in the mean.
        let own = file(&driver).exists();
        let golden = image::open(file(if own { &driver } else { "llvmpipe" }))
            .expect("a golden picture")
            .to_rgb8();
        let (mean, most) = difference(&golden, &picture);
        // Other processors round differently (llvmpipe compiles for the one at hand), and a
        // sample may fall into the next texel: a few pixels may move a little.
        let good = mean < if own { 0.05 } else { 1.0 };
        if !good {
            let out = root.join("out");
            std::fs::create_dir_all(&out).expect("a folder");
            let file_of = |what: &str| out.join(format!("{name}-{driver}-{what}.png"));
            let amplified = RgbImage::from_fn(SIZE[0], SIZE[1], |x, y| {
                let (a, b) = (golden.get_pixel(x, y), picture.get_pixel(x, y));
                Rgb([0, 1, 2].map(|c| a[c].abs_diff(b[c]).saturating_mul(16)))
            });
            picture.save(file_of("rendered")).expect("a picture");
            amplified.save(file_of("difference")).expect("a picture");
            faults.push(format!(
                "{name}: {mean:.3} steps in the mean, {most} at most; see {}",
                file_of("difference").display()
            ));
        }
    }
    assert!(faults.is_empty(), "on {driver}:\n{}", faults.join("\n"));
}
