//! A device watched by the validation layer, and pictures made on it.

use std::sync::{Arc, Mutex, MutexGuard};

use glam::{DVec2, DVec3};
use marmor::cpu::{GBuffer, LightMap};
use marmor::frame::{Options, Renderer, Setup, Target, open_device};
use marmor::gpu::{Device, Instance};
use marmor::scene::{
    Camera, Jitter, Light, Material, Mesh, Multiple, Plan, Scattering, Scene, Single,
};

/// One GPU test at a time: the device is shared, and two cores are few.
static TURN: Mutex<()> = Mutex::new(());

/// A device for one test. When it has gone, anything the validation layer said fails the test: of its end, too, which tells
/// of what was never destroyed.
pub struct TestDevice {
    // Dropped first.
    pub device: Arc<Device>,
    _watch: Watch,
}

struct Watch {
    instance: Arc<Instance>,
    _turn: MutexGuard<'static, ()>,
}

/// Opens the device of the tests: the one of MARMOR_DEVICE, or the best there is.
///
/// None, where there is none and MARMOR_REQUIRE_DEVICE is not set: the test then says that
/// it was skipped. Validation is on where the layer is installed, and MARMOR_REQUIRE_VALIDATION
/// makes its absence a failure.
pub fn device() -> Option<TestDevice> {
    let turn = TURN.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let opened = open_device(&options(true)).or_else(|error| {
        assert!(!set("MARMOR_REQUIRE_VALIDATION"), "{error}");
        let opened = open_device(&options(false));
        if opened.is_ok() {
            eprintln!("without validation: {error}");
        }
        opened
    });
    match opened {
        Ok(device) => {
            let watch = Watch {
                instance: Arc::clone(device.instance()),
                _turn: turn,
            };
            Some(TestDevice {
                device,
                _watch: watch,
            })
        }
        Err(error) => {
            assert!(!set("MARMOR_REQUIRE_DEVICE"), "{error}");
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// Whether there is a device to test on; says so where there is none.
pub fn present() -> bool {
    device().is_some()
}

fn options(validation: bool) -> Options {
    Options {
        device: std::env::var("MARMOR_DEVICE").ok(),
        validation,
        measure: false,
        memory_limit: None,
        redraw_light: false,
    }
}

/// Whether the variable `name` of the environment is set, and not to 0.
pub fn set(name: &str) -> bool {
    std::env::var_os(name).is_some_and(|value| !value.is_empty() && value != "0")
}

impl Drop for Watch {
    fn drop(&mut self) {
        let messages = self.instance.take_messages();
        if !std::thread::panicking() {
            assert!(
                messages.is_empty(),
                "the validation layer says:\n{}",
                messages.join("\n")
            );
        }
    }
}

/// A plan to see `mesh` of `material`, lit from (azimuth, elevation), with a camera that
/// fits it from (azimuth, elevation); no specular reflection, no jitter.
pub fn plan(
    mesh: Mesh,
    material: Material,
    light: [f64; 2],
    view: [f64; 2],
    size: [u32; 2],
    multiple: Multiple,
) -> Plan {
    let center = mesh.center();
    let radius = mesh.bounding_radius();
    let light_at = |[azimuth, elevation]: [f64; 2]| Light {
        azimuth,
        elevation,
        irradiance: std::f64::consts::PI,
        color: DVec3::new(1.0, 0.9, 0.8),
    };
    let eye = center + light_at(view).to_light() * radius * 4.0;
    Plan {
        scene: Scene {
            name: "test".into(),
            mesh,
            material,
            light: light_at(light),
            camera: Camera {
                eye,
                target: center,
                up: DVec3::Y,
                fov: 28.0,
            },
        },
        motion: None,
        time: 0.0,
        size,
        part: None,
        multiple,
        split: None,
        split_at: 0.5,
        single: Single::Off,
        scattering: Scattering::Full,
        specular: false,
        light_map: 128,
        frames_averaged: 1,
        jitter: Jitter::Off,
        exposure: 1.0,
        background: None,
    }
}

/// Renders `plan`; returns its linear radiance.
pub fn render(device: &TestDevice, plan: &Plan) -> Vec<[f32; 4]> {
    let mut renderer = Renderer::new(&device.device, plan, &Setup::default()).expect("a renderer");
    renderer.render(&mut |_| ()).expect("a picture");
    renderer.radiance().expect("its radiance")
}

/// What the GPU drew into its light map, as the CPU twin's.
pub fn light_map(renderer: &mut Renderer) -> LightMap {
    let read = |renderer: &mut Renderer, target| renderer.read(target).expect("an image");
    LightMap {
        frame: renderer.light_frame(0),
        moments: read(renderer, Target::LightMoments)
            .iter()
            .map(|m| m.map(f64::from))
            .collect(),
        fourth: read(renderer, Target::LightFourth)
            .iter()
            .map(|m| f64::from(m[0]))
            .collect(),
        depth: read(renderer, Target::LightDepth)
            .iter()
            .map(|d| f64::from(d[0]))
            .collect(),
    }
}

/// What the GPU drew into its G-buffer, as the CPU twin's.
pub fn gbuffer(renderer: &mut Renderer, size: [u32; 2]) -> GBuffer {
    let targets = [
        Target::ViewDepth,
        Target::ViewNormal,
        Target::BackDepth,
        Target::BackNormal,
    ];
    gbuffer_of(renderer, targets, size)
}

/// As [`gbuffer`], of half the size, for a picture of `size` pixels.
pub fn half_gbuffer(renderer: &mut Renderer, size: [u32; 2]) -> GBuffer {
    let targets = [
        Target::HalfViewDepth,
        Target::HalfViewNormal,
        Target::HalfBackDepth,
        Target::HalfBackNormal,
    ];
    gbuffer_of(renderer, targets, size.map(|side| side.div_ceil(2)))
}

fn gbuffer_of(
    renderer: &mut Renderer,
    [view_depth, view_normal, back_depth_of, back_normal_of]: [Target; 4],
    size: [u32; 2],
) -> GBuffer {
    let read = |renderer: &mut Renderer, target| renderer.read(target).expect("an image");
    let depth: Vec<f64> = read(renderer, view_depth)
        .iter()
        .map(|d| f64::from(d[0]))
        .collect();
    let normal = read(renderer, view_normal)
        .iter()
        .zip(&depth)
        .map(|(e, &d)| {
            if d < 1.0 {
                decode(DVec2::new(e[0].into(), e[1].into()))
            } else {
                DVec3::ZERO
            }
        })
        .collect();
    let back_depth: Vec<f64> = read(renderer, back_depth_of)
        .iter()
        .map(|d| f64::from(d[0]))
        .collect();
    // Stored as seen, against what is outward of a back face.
    let back_normal = read(renderer, back_normal_of)
        .iter()
        .zip(&back_depth)
        .map(|(e, &d)| {
            if d < 1.0 {
                -decode(DVec2::new(e[0].into(), e[1].into()))
            } else {
                DVec3::ZERO
            }
        })
        .collect();
    GBuffer {
        width: size[0] as usize,
        height: size[1] as usize,
        normal,
        back_normal,
        back_depth,
        depth,
    }
}

/// The unit vector of an octahedral code.
fn decode(e: DVec2) -> DVec3 {
    let z = 1.0 - e.x.abs() - e.y.abs();
    let fold = (-z).max(0.0);
    DVec3::new(e.x - fold.copysign(e.x), e.y - fold.copysign(e.y), z).normalize()
}

/// rr: the relative RMSE of DESIGN over pixels that `reference` covers.
pub fn rr(reference: &[[f64; 4]], image: &[[f64; 4]]) -> f64 {
    let covered: Vec<_> = reference
        .iter()
        .zip(image)
        .filter(|(r, _)| r[3] > 0.999)
        .collect();
    let n = covered.len() as f64;
    let sum: f64 = (0..3)
        .map(|c| {
            let mean = covered.iter().map(|(r, _)| r[c]).sum::<f64>() / n;
            covered
                .iter()
                .map(|(r, i)| ((i[c] - r[c]) / mean).powi(2))
                .sum::<f64>()
        })
        .sum();
    (sum / (3.0 * n)).sqrt()
}

/// Radiance in f64.
pub fn wide(image: &[[f32; 4]]) -> Vec<[f64; 4]> {
    image.iter().map(|p| p.map(f64::from)).collect()
}
