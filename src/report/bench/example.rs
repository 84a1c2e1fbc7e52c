//! A run made up for tests, with the structure that real ones have.

use super::*;
use std::io::Cursor;

/// A generator of numbers that look random: SplitMix64.
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    /// Evenly spread over [0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Of a normal distribution with mean 0 and variance 1 (Box and Muller).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// `count` times around `time` with relative deviation `noise`.
pub(crate) fn spread(numbers: &mut Numbers, time: f64, noise: f64, count: u32) -> Spread {
    let values = (0..count).map(|_| time * (noise * numbers.normal()).exp());
    Spread::of(values.collect())
}

/// What a case of the example varies.
struct Make<'a> {
    group: &'a str,
    name: String,
    scene: &'a str,
    triangles: u64,
    size: [u32; 2],
    light_map: u32,
    multiple: &'a str,
    single: &'a str,
    fetches: u32,
    error: Option<f64>,
}

impl Default for Make<'_> {
    fn default() -> Self {
        Make {
            group: "methods",
            name: String::new(),
            scene: "statue",
            triangles: 81_920,
            size: [960, 540],
            light_map: 512,
            multiple: "mixture(3)",
            single: "off",
            fetches: 9,
            error: None,
        }
    }
}

fn case(numbers: &mut Numbers, make: Make<'_>) -> Case {
    let covered = 0.42;
    let pixels = f64::from(make.size[0]) * f64::from(make.size[1]) * covered;
    let texels = f64::from(make.light_map).powi(2);
    let fetches = pixels * f64::from(make.fetches);
    let triangles = make.triangles as f64;
    // Milliseconds, executed fetches, milliseconds of one.
    let passes = [
        ("light", 0.6 + triangles * 9e-6 + texels * 2.4e-6, 0.0, 0.0),
        ("reduce", 0.05 + texels * 4.1e-6, texels * 1.6, 1.1e-6),
        ("view", 0.7 + triangles * 9e-6 + pixels * 5e-6, 0.0, 0.0),
        (
            "shade",
            0.4 + pixels * 6e-6 + fetches * 9e-6,
            fetches,
            4.7e-6,
        ),
        ("resolve", 0.3 + pixels * 4e-6, pixels * 2.0, 1.1e-6),
    ];
    let passes: Vec<Pass> = passes
        .into_iter()
        .map(|(pass, time, fetches, cost)| Pass {
            pass: pass.to_owned(),
            time: spread(numbers, time, 0.04, 60),
            fetches,
            bytes: fetches * 64.0,
            floor: (fetches > 0.0).then_some(fetches * cost),
            invocations: (pass == "shade").then_some(pixels as u64),
        })
        .collect();
    let total: f64 = passes.iter().map(|pass| pass.time.median).sum();
    Case {
        picture: (make.group == "methods").then(|| picture(numbers)),
        name: format!("{}/{}", make.group, make.name),
        group: make.group.to_owned(),
        scene: make.scene.to_owned(),
        triangles: make.triangles,
        size: make.size,
        light_map: make.light_map,
        multiple: make.multiple.to_owned(),
        single: make.single.to_owned(),
        light_rests: false,
        budget: None,
        fetches: make.fetches,
        covered,
        error: make.error,
        wall: spread(numbers, total + 0.8, 0.05, 60),
        device: spread(numbers, total, 0.04, 60),
        passes,
    }
}

/// A lit ball, so that the page has something to show.
fn picture(numbers: &mut Numbers) -> Vec<u8> {
    let tint = [230.0, 150.0 + 80.0 * numbers.uniform(), 150.0];
    let image = image::RgbImage::from_fn(240, 135, |x, y| {
        let (dx, dy) = ((f64::from(x) - 120.0) / 55.0, (f64::from(y) - 67.0) / 55.0);
        let height = 1.0 - dx * dx - dy * dy;
        let light = if height > 0.0 {
            (0.5 * height.sqrt() - 0.4 * dx - 0.3 * dy + 0.3).clamp(0.0, 1.0)
        } else {
            0.1
        };
        image::Rgb(tint.map(|channel| (channel * light) as u8))
    });
    let mut png = Cursor::new(Vec::new());
    image
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("a PNG");
    png.into_inner()
}

fn methods(numbers: &mut Numbers) -> Vec<Case> {
    let methods = [
        ("samples(8)", "off", 10, 0.239),
        ("samples(16)", "off", 18, 0.152),
        ("samples(30)", "off", 32, 0.0935),
        ("samples(60)", "off", 62, 0.0605),
        ("rings(5)", "off", 5, 0.501),
        ("rings(10)", "off", 10, 0.693),
        ("mixture(3)", "off", 6, 0.0977),
        ("mixture(3, 5 volumes)", "off", 8, 0.0233),
        ("mixture(4)", "off", 12, 0.0657),
        ("mixture(4, 5 volumes)", "march(8)", 17, 0.0215),
        ("brdf", "off", 1, 0.83),
    ];
    let mut cases = Vec::new();
    for (scene, harder) in [("statue", 1.0), ("sphere", 0.4)] {
        for (multiple, single, fetches, error) in methods {
            let make = Make {
                name: format!("{scene} {multiple}"),
                scene,
                multiple,
                single,
                fetches,
                error: Some(error * harder),
                ..Make::default()
            };
            cases.push(case(numbers, make));
        }
    }
    cases
}

fn sweeps(numbers: &mut Numbers) -> Vec<Case> {
    let mut makes = Vec::new();
    for triangles in [1_280, 5_120, 20_480, 81_920, 327_680, 1_310_720] {
        makes.push(Make {
            group: "triangles",
            name: triangles.to_string(),
            triangles,
            ..Make::default()
        });
    }
    for size in [
        [480, 270],
        [640, 360],
        [960, 540],
        [1280, 720],
        [1920, 1080],
    ] {
        for (multiple, fetches) in [("mixture(3)", 9), ("samples(30)", 32)] {
            makes.push(Make {
                group: "pixels",
                name: format!("{}x{} {multiple}", size[0], size[1]),
                size,
                multiple,
                fetches,
                ..Make::default()
            });
        }
    }
    for (multiple, fetches) in [
        ("samples(4)", 6),
        ("samples(8)", 10),
        ("samples(16)", 18),
        ("samples(32)", 34),
        ("samples(64)", 66),
        ("rings(4)", 4),
        ("rings(8)", 8),
        ("rings(16)", 16),
    ] {
        makes.push(Make {
            group: "fetches",
            name: multiple.to_owned(),
            multiple,
            fetches,
            ..Make::default()
        });
    }
    for light_map in [256, 512, 1024, 2048] {
        makes.push(Make {
            group: "light map",
            name: light_map.to_string(),
            light_map,
            ..Make::default()
        });
    }
    makes.into_iter().map(|make| case(numbers, make)).collect()
}

fn fits(cases: &[Case]) -> Vec<Fit> {
    let of = |group: &'static str, multiple: &'static str| {
        cases
            .iter()
            .filter(move |case| case.group == group && case.multiple.starts_with(multiple))
    };
    let mut fits = Vec::new();
    for method in ["mixture(3)", "samples(30)"] {
        let points = Fit::points(of("pixels", method), COVERED_PIXELS, "shade");
        fits.extend(Fit::linear(
            "pixels",
            method,
            COVERED_PIXELS,
            "shade",
            &points,
        ));
        fits.extend(Fit::power(
            "pixels",
            method,
            COVERED_PIXELS,
            "shade",
            &points,
        ));
    }
    for family in ["samples", "rings"] {
        let points = Fit::points(of("fetches", family), FETCHES, "shade");
        fits.extend(Fit::linear("fetches", family, FETCHES, "shade", &points));
    }
    let points = Fit::points(of("triangles", "mixture(3)"), TRIANGLES, FRAME);
    fits.extend(Fit::linear(
        "triangles",
        "mixture(3)",
        TRIANGLES,
        FRAME,
        &points,
    ));
    fits
}

/// The example. Each call makes the same.
pub(crate) fn run() -> Run {
    let mut numbers = Numbers(7);
    let mut cases = methods(&mut numbers);
    cases.extend(sweeps(&mut numbers));
    let costs = [
        ("bilinear", "RGBA32F", 4.7, 16),
        ("bilinear", "RGBA16F", 5.9, 8),
        ("nearest", "RGBA32F", 2.6, 16),
        ("texel", "RGBA32F", 1.1, 16),
        ("gather and compare", "D32F", 3.8, 4),
        ("trilinear", "RGBA32F", 9.9, 16),
    ];
    Run {
        format: FORMAT,
        header: Header {
            marmor: "0.1.0".to_owned(),
            commit: Some("311918c".to_owned()),
            date: "2025-06-01T12:34:56Z".to_owned(),
            command: "marmor bench --html bench.html".to_owned(),
            device: "llvmpipe (LLVM 15.0.6, 256 bits)".to_owned(),
            driver: "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)".to_owned(),
            cpu: "A processor @ 2.50 GHz".to_owned(),
            cores: 2,
            validation: false,
        },
        complete: true,
        frames: 60,
        costs: costs
            .into_iter()
            .map(|(kind, format, time, bytes)| Cost {
                kind: kind.to_owned(),
                format: format.to_owned(),
                nanoseconds: spread(&mut numbers, time, 0.03, 40),
                bytes,
            })
            .collect(),
        fits: fits(&cases),
        cases,
        notes: vec!["exact: left out at 1920x1080, it would take 40 s a frame".to_owned()],
    }
}
