//! Every GPU stage against its f64 twin.

mod common;

use common::device::{self, TestDevice};
use common::media::medium;
use common::shapes;
use glam::DVec3;
use marmor::cpu::{self, shade::Shading};
use marmor::frame::{Renderer, Setup};
use marmor::ledger::Filter;
use marmor::scene::{
    Exits, Fourth, Jitter, March, Mesh, Method, Mixture, Multiple, Plan, Request, Scattering,
    Single, Viewpoint,
};

const SIZE: [u32; 2] = [160, 120];

fn bumpy() -> Mesh {
    shapes::bumpy(20.0, 5)
}

/// The bumpy sphere in marble, lit from (azimuth, elevation), by `multiple`.
fn marble(light: [f64; 2], multiple: Multiple) -> Plan {
    device::plan(
        bumpy(),
        medium("marble").material(),
        light,
        [20.0, 10.0],
        SIZE,
        multiple,
    )
}

fn rendered(device: &TestDevice, plan: &Plan) -> Renderer {
    let mut renderer = Renderer::new(
        &device.device,
        plan,
        &Setup {
            keep_gbuffer: true,
            ..Setup::default()
        },
    )
    .expect("a renderer");
    renderer.render(&mut |_| ()).expect("a picture");
    renderer
}

/// Compares two images of `width` texels a row where both are covered, away from edges.
///
/// Rasterisers snap vertices to 1/256 texel or finer, so a value may be that of a point as
/// far away: it must lie within `tolerance` plus a hundredth of the twin's range over the
/// neighbours. A texel whose neighbourhood is not wholly covered, or where another surface
/// begins, may belong to either side and only counts.
fn compare(
    what: &str,
    width: usize,
    gpu: &[Option<f64>],
    twin: &[Option<f64>],
    tolerance: f64,
    jump: f64,
) {
    let height = twin.len() / width;
    let (mut compared, mut edges, mut worst) = (0, 0, 0.0_f64);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let around: Vec<_> = (0..9)
                .map(|k| twin[(y + k / 3 - 1) * width + x + k % 3 - 1])
                .collect();
            let (Some(here), true) = (twin[y * width + x], around.iter().all(Option::is_some))
            else {
                edges += usize::from(twin[y * width + x].is_some() != gpu[y * width + x].is_some());
                continue;
            };
            let lo = around
                .iter()
                .flatten()
                .copied()
                .fold(f64::INFINITY, f64::min);
            let hi = around
                .iter()
                .flatten()
                .copied()
                .fold(f64::NEG_INFINITY, f64::max);
            if hi - lo > jump {
                continue;
            }
            let value = gpu[y * width + x].unwrap_or_else(|| {
                panic!("{what}: the GPU covers no ({x}, {y}) inside the surface")
            });
            let allowed = tolerance + 0.01 * (hi - lo);
            worst = worst.max((value - here).abs() / allowed);
            compared += 1;
        }
    }
    assert!(compared > 1000, "{what}: only {compared} texels compared");
    assert!(worst <= 1.0, "{what}: off by {worst} times what is allowed");
    assert!(
        edges * 100 <= compared,
        "{what}: coverage differs on {edges} edge texels"
    );
}

#[test]
fn light_map() {
    let Some(device) = device::device() else {
        return;
    };
    for light in [[0.0, 0.0], [140.0, 25.0], [-30.0, 80.0]] {
        let plan = device::plan(
            bumpy(),
            medium("marble").material(),
            light,
            [20.0, 10.0],
            SIZE,
            Multiple::None,
        );
        let mut renderer = rendered(&device, &plan);
        let gpu = device::light_map(&mut renderer);
        let mut mesh = plan.scene.mesh.clone();
        mesh.positions
            .iter_mut()
            .for_each(|p| *p -= renderer.center());
        let twin = cpu::light::draw(&mesh, &renderer.light_frame(0), plan.scene.material.eta);
        let width = plan.light_map as usize;
        let some = |depth: &[f64]| {
            depth
                .iter()
                .map(|&d| (d < 1.0).then_some(d))
                .collect::<Vec<_>>()
        };
        compare(
            "depth",
            width,
            &some(&gpu.depth),
            &some(&twin.depth),
            2e-6,
            0.1,
        );
        for k in 0..4 {
            let moment = |map: &cpu::LightMap| {
                let depths = map.depth.iter();
                depths
                    .zip(&map.moments)
                    .map(|(&d, m)| (d < 1.0).then_some(m[k]))
                    .collect::<Vec<_>>()
            };
            compare("moment", width, &moment(&gpu), &moment(&twin), 2e-5, 0.2);
        }
        let empty = gpu
            .depth
            .iter()
            .zip(&gpu.moments)
            .filter(|(d, _)| **d >= 1.0);
        assert!(empty.clone().count() > 1000);
        assert!(
            empty.clone().all(|(_, m)| *m == [0.0; 4]),
            "an empty texel has a weight"
        );
    }
}

#[test]
fn g_buffer() {
    let Some(device) = device::device() else {
        return;
    };
    let mut plan = marble([140.0, 25.0], Multiple::None);
    plan.jitter = Jitter::All;
    let mut renderer = rendered(&device, &plan);
    let gpu = device::gbuffer(&mut renderer, SIZE);
    let mut mesh = plan.scene.mesh.clone();
    mesh.positions
        .iter_mut()
        .for_each(|p| *p -= renderer.center());
    let twin = cpu::view::draw(&mesh, &renderer.view(0), gpu.width, gpu.height);
    let some = |depth: &[f64]| {
        depth
            .iter()
            .map(|&d| (d < 1.0).then_some(d))
            .collect::<Vec<_>>()
    };
    compare(
        "depth",
        gpu.width,
        &some(&gpu.depth),
        &some(&twin.depth),
        2e-6,
        0.05,
    );
    compare(
        "back",
        gpu.width,
        &some(&gpu.back_depth),
        &some(&twin.back_depth),
        2e-6,
        0.05,
    );
    let components = [
        ("normal", &gpu.normal, &twin.normal),
        ("back normal", &gpu.back_normal, &twin.back_normal),
    ];
    for (what, gpu_normals, twin_normals) in components {
        for k in 0..3 {
            let component = |normals: &[DVec3]| {
                normals
                    .iter()
                    .map(|n| (*n != DVec3::ZERO).then_some(n[k]))
                    .collect::<Vec<_>>()
            };
            let (gpu_k, twin_k) = (component(gpu_normals), component(twin_normals));
            compare(what, gpu.width, &gpu_k, &twin_k, 1e-4, 0.5);
        }
    }
}

/// Where front faces meet back faces, the grid that vertices are snapped to may bring a back face before the front
/// face. The picture does not show it: it is lit as the far side is.
#[test]
fn silhouettes_of_a_solid_do_not_show_its_far_side() {
    let Some(device) = device::device() else {
        return;
    };
    for azimuth in [-28.0, 30.0, 100.0, 170.0, -120.0] {
        let mut request = Request::statue();
        request.multiple = Method::None;
        request.specular = false;
        request.size = [200, 150];
        request.viewpoint = Viewpoint::Orbit {
            azimuth,
            elevation: 4.0,
            distance: None,
            target: None,
        };
        let plan = request.plan().expect("a plan");
        assert!(plan.scene.mesh.is_solid(), "the statue is a solid");
        let mut renderer = rendered(&device, &plan);
        let gpu = device::gbuffer(&mut renderer, plan.size);
        let shown = gpu
            .depth
            .iter()
            .zip(&gpu.back_depth)
            .filter(|(front, back)| **front < 1.0 && front == back)
            .count();
        assert_eq!(shown, 0, "pixels that show a back face from {azimuth}");
    }
}

/// Shading is compared on the GPU's own maps, so that only shading can differ.
fn compare_shading(device: &TestDevice, plan: &Plan) -> (Vec<[f64; 4]>, Vec<[f64; 4]>) {
    let mut renderer = rendered(device, plan);
    let map = device::light_map(&mut renderer);
    let gbuffer = device::gbuffer(&mut renderer, plan.size);
    let noise = cpu::shade::noise();
    let mut shading = Shading::new(&plan.scene.material, &plan.scene.light, &map, noise, 0);
    shading.reduce(plan.multiple);
    let (view, march) = (renderer.view(0), plan.march(plan.multiple));
    let twin = if plan.scattering == Scattering::Half {
        let seen = device::half_gbuffer(&mut renderer, plan.size);
        let half_view = view.halved(plan.size).0;
        let half = cpu::shade::halved(&seen, &half_view, &shading, plan.multiple, march);
        cpu::shade::upsampled(&gbuffer, &view, &shading, &half, plan.specular)
    } else {
        let multiple = plan.multiple;
        cpu::shade::shade(&gbuffer, &view, &shading, multiple, march, plan.specular)
    };
    (twin, device::wide(&renderer.radiance().expect("radiance")))
}

fn worst(twin: &[[f64; 4]], gpu: &[[f64; 4]]) -> f64 {
    let scale = twin
        .iter()
        .flat_map(|p| &p[..3])
        .copied()
        .fold(0.0, f64::max);
    twin.iter()
        .zip(gpu)
        .flat_map(|(t, g)| (0..4).map(move |c| (t[c] - g[c]).abs()))
        .fold(0.0, f64::max)
        / scale
}

#[test]
fn exact() {
    let Some(device) = device::device() else {
        return;
    };
    for name in ["marble", "ketchup"] {
        let mut plan = device::plan(
            bumpy(),
            medium(name).material(),
            [140.0, 25.0],
            [20.0, 10.0],
            [64, 48],
            Multiple::Exact,
        );
        plan.light_map = 96;
        let (twin, gpu) = compare_shading(&device, &plan);
        let worst = worst(&twin, &gpu);
        assert!(worst < 2e-5, "{name}: {worst} of the brightest pixel");
    }
}

#[test]
fn brdf_and_specular() {
    let Some(device) = device::device() else {
        return;
    };
    let mut plan = marble([60.0, 35.0], Multiple::Brdf);
    plan.specular = true;
    let (twin, gpu) = compare_shading(&device, &plan);
    // The tap's weights have 8 bits on most devices, and a comparison may fall on either
    // side of equality: few pixels may differ by a texel's worth of light.
    let scale = twin
        .iter()
        .flat_map(|p| &p[..3])
        .copied()
        .fold(0.0, f64::max);
    let off = |limit: f64| {
        let differs =
            |(t, g): &(&[f64; 4], &[f64; 4])| (0..3).any(|c| (t[c] - g[c]).abs() > limit * scale);
        twin.iter().zip(&gpu).filter(differs).count()
    };
    let covered = twin.iter().filter(|p| p[3] > 0.0).count();
    assert!(covered > 3000, "{covered}");
    assert!(
        off(0.01) * 500 < covered,
        "{} of {covered} pixels differ by a texel",
        off(0.01)
    );
    assert!(
        device::rr(&twin, &gpu) < 0.01,
        "rr {}",
        device::rr(&twin, &gpu)
    );
}

#[test]
fn samples() {
    let Some(device) = device::device() else {
        return;
    };
    for (name, n) in [
        ("marble", 30),
        ("skin1", 7),
        ("ketchup", 30),
        ("spectralon", 12),
    ] {
        let plan = device::plan(
            bumpy(),
            medium(name).material(),
            [140.0, 25.0],
            [20.0, 10.0],
            SIZE,
            Multiple::Samples(n),
        );
        let (twin, gpu) = compare_shading(&device, &plan);
        // The same sequence, but a sample within rounding of a texel's edge reads its
        // neighbour: most pixels agree to float32, few by a sample's worth.
        let covered: Vec<_> = twin.iter().zip(&gpu).filter(|(t, _)| t[3] > 0.0).collect();
        let exact = covered
            .iter()
            .filter(|(t, g)| (0..3).all(|c| (t[c] - g[c]).abs() <= 2e-3 * t[c] + 1e-6))
            .count();
        assert!(
            exact * 100 >= covered.len() * 95,
            "{name}: {exact} of {} agree",
            covered.len()
        );
        let rr = device::rr(&twin, &gpu);
        assert!(rr < 0.02, "{name}: rr {rr}");
    }
}

/// Deterministic pictures agree pixel by pixel to `tolerance` of the brightest.
fn agree(what: &str, twin: &[[f64; 4]], gpu: &[[f64; 4]], tolerance: f64) {
    let worst = worst(twin, gpu);
    assert!(worst < tolerance, "{what}: {worst} of the brightest pixel");
}

#[test]
fn rings() {
    let Some(device) = device::device() else {
        return;
    };
    for (name, n) in [("marble", 8), ("skin1", 5), ("ketchup", 1)] {
        let mut plan = marble([60.0, 35.0], Multiple::Rings(n));
        plan.scene.material = medium(name).material();
        let (twin, gpu) = compare_shading(&device, &plan);
        agree(name, &twin, &gpu, 1e-4);
    }
}

#[test]
fn mixture() {
    let Some(device) = device::device() else {
        return;
    };
    let from = |level| Mixture {
        fourth: Fourth::From(level),
        ..Mixture::THREE
    };
    let half = |mixture| Mixture {
        level_step: 2,
        ..mixture
    };
    let with = |volumes, mixture| Mixture { volumes, ..mixture };
    for (name, mixture) in [
        ("marble", Mixture::THREE),
        ("marble", with(3, Mixture::THREE)),
        ("skin1", with(8, Mixture::THREE)),
        ("ketchup", with(1, from(1))),
        ("wholemilk", with(2, half(Mixture::FOUR))),
        ("ketchup", Mixture::THREE),
        ("spectralon", half(Mixture::THREE)),
        ("marble", Mixture::FOUR),
        ("skin1", from(2)),
        ("wholemilk", half(Mixture::FOUR)),
    ] {
        let mut plan = marble([60.0, 35.0], Multiple::Mixture(mixture));
        plan.scene.material = medium(name).material();
        let (twin, gpu) = compare_shading(&device, &plan);
        // Differences of moments in float32 are worth less the narrower the kernel: the worst
        // pixel lies where two surfaces meet, and the picture as a whole is ten times closer.
        let what = format!("{name}, {mixture}");
        agree(&what, &twin, &gpu, 6e-3);
        let rr = device::rr(&twin, &gpu);
        assert!(rr < 1e-3, "{what}: rr {rr}");
    }
}

#[test]
fn single() {
    let Some(device) = device::device() else {
        return;
    };
    let mut cases = Vec::new();
    for steps in [1, 2, 8, 64] {
        cases.push(("skin1", steps, Exits::Linear, 0.0));
    }
    cases.extend([
        ("marble", 8, Exits::Nearest, 0.0),
        ("ketchup", 8, Exits::Depth, 0.0),
        ("ketchup", 6, Exits::Linear, 0.8),
        ("spectralon", 8, Exits::Linear, -0.5),
    ]);
    for (name, steps, exits, g) in cases {
        for light in [[60.0, 35.0], [-150.0, 20.0]] {
            let mut plan = marble(light, Multiple::None);
            plan.scene.material = medium(name).material();
            plan.scene.material.g = g;
            plan.single = Single::March(March { steps, exits });
            let (twin, gpu) = compare_shading(&device, &plan);
            let what = format!("{name}, {}, g {g}", plan.single);
            // Whether there is an edge, or a way out, is a comparison: a pixel where float32 falls on the other side may
            // differ by all that lies between two surfaces. Nearest texels, which are not looked up at
            // their centres, have more such pixels than bilinear taps.
            agree(&what, &twin, &gpu, 0.1);
            let brightest = twin
                .iter()
                .flat_map(|p| &p[..3])
                .copied()
                .fold(0.0, f64::max);
            let differs = |(t, g): &(&[f64; 4], &[f64; 4])| {
                (0..3).any(|c| (t[c] - g[c]).abs() > 3e-4 * brightest)
            };
            let far = twin.iter().zip(&gpu).filter(differs).count();
            let most = if exits == Exits::Linear { 3 } else { 20 };
            assert!(far <= most, "{what}: {far} pixels differ");
        }
    }
}

#[test]
fn half() {
    let Some(device) = device::device() else {
        return;
    };
    let march = Single::March(March {
        steps: 8,
        exits: Exits::Linear,
    });
    for (name, multiple, single, size) in [
        (
            "marble",
            Multiple::Mixture(Mixture::THREE),
            march,
            [200, 150],
        ),
        (
            "skin1",
            Multiple::Mixture(Mixture::FOUR),
            Single::Off,
            [201, 149],
        ),
        ("ketchup", Multiple::Rings(6), march, [200, 151]),
        ("marble", Multiple::None, march, [200, 150]),
    ] {
        let mut plan = marble([60.0, 35.0], multiple);
        plan.scene.material = medium(name).material();
        (plan.single, plan.size) = (single, size);
        plan.specular = true;
        plan.scattering = Scattering::Half;
        let (twin, gpu) = compare_shading(&device, &plan);
        let what = format!("{name}, {}, {}", plan.method_name(), plan.single);
        // As the methods themselves agree: what lies at an edge may see the other side of it.
        agree(&what, &twin, &gpu, 0.1);
        let rr = device::rr(&twin, &gpu);
        assert!(rr < 2e-3, "{what}: rr {rr}");
        // Seen at half size it is the same surface.
        let mut renderer = rendered(&device, &plan);
        let seen = device::half_gbuffer(&mut renderer, size);
        let mut mesh = plan.scene.mesh.clone();
        mesh.positions
            .iter_mut()
            .for_each(|p| *p -= renderer.center());
        let view = renderer.view(0).halved(size).0;
        let drawn = cpu::view::draw(&mesh, &view, seen.width, seen.height);
        let some =
            |depth: &[f64]| -> Vec<_> { depth.iter().map(|&d| (d < 1.0).then_some(d)).collect() };
        let depths = [&seen.depth, &drawn.depth].map(|depth| some(depth));
        compare("half depth", seen.width, &depths[0], &depths[1], 2e-6, 0.05);
    }
}

/// What half the size costs: nothing where the surface is smooth, a pixel or two where it is not; and no seams.
#[test]
fn half_is_close_to_full() {
    let Some(device) = device::device() else {
        return;
    };
    for (size, material, most, per_mille) in [
        ([800, 600], "marble", 0.034, 2),
        ([800, 600], "skin1", 0.039, 2),
        ([200, 150], "marble", 0.14, 20),
    ] {
        let request = Request {
            multiple: Method::Mixture,
            material: medium(material).material(),
            size,
            jitter: Jitter::Off,
            ..Request::statue()
        };
        let mut plan = request.plan().expect("a plan");
        assert_eq!(
            plan.scattering,
            Scattering::Full,
            "half is asked for by name"
        );
        let full = device::wide(&device::render(&device, &plan));
        plan.scattering = Scattering::Half;
        let half = device::wide(&device::render(&device, &plan));
        let rr = device::rr(&full, &half);
        let covered = full.iter().zip(&half).filter(|(f, _)| f[3] > 0.0);
        let luminance = |p: &[f64; 4]| p[0] + p[1] + p[2];
        // Where no pixel of the half sees a surface, it is lit as another: rarely by much, and never left black.
        let (mut pixels, mut far) = (0, 0);
        for (f, h) in covered {
            assert_eq!(f[3], h[3], "coverage is the picture's own");
            let ratio = luminance(h) / luminance(f);
            assert!(ratio > 0.05, "{size:?} {material}: a pixel is left black");
            pixels += 1;
            far += usize::from(!(0.5..=2.0).contains(&ratio));
        }
        assert!(
            far * 1000 <= pixels * per_mille,
            "{size:?} {material}: {far} of {pixels} pixels are off by more than a factor of two"
        );
        assert!(rr < most, "{size:?} {material}: rr {rr}");
    }
}

/// A device that cannot filter 32-bit floats draws the same picture from four reads a tap.
#[test]
fn taps_of_four_texels_are_bilinear_taps() {
    let Some(device) = device::device() else {
        return;
    };
    for multiple in [
        Multiple::Rings(8),
        Multiple::Mixture(Mixture::THREE),
        Multiple::Mixture(Mixture::FOUR),
        Multiple::Mixture(Mixture {
            volumes: 4,
            ..Mixture::THREE
        }),
        Multiple::Mixture(Mixture {
            volumes: 1,
            ..Mixture::FOUR
        }),
    ] {
        let plan = marble([60.0, 35.0], multiple);
        let draw = |filter| {
            let mut renderer = Renderer::new(
                &device.device,
                &plan,
                &Setup {
                    filter: Some(filter),
                    ..Setup::default()
                },
            )
            .expect("one");
            renderer.render(&mut |_| ()).expect("a picture");
            device::wide(&renderer.radiance().expect("radiance"))
        };
        let texels = draw(Filter::Texels);
        if device.device.candidate().linear_floats {
            // Hardware filters by weights of 8 bits.
            agree(&multiple.to_string(), &draw(Filter::Linear), &texels, 5e-3);
        }
        let rr = device::rr(&texels, &compare_shading(&device, &plan).0);
        assert!(rr < 2e-3, "{multiple}: rr {rr}");
    }
}

#[test]
fn resolve() {
    let Some(device) = device::device() else {
        return;
    };
    for background in [None, Some([0.1, 0.02, 0.3])] {
        let mut plan = marble([60.0, 35.0], Multiple::Brdf);
        plan.frames_averaged = 5;
        plan.jitter = Jitter::All;
        plan.exposure = 1.7;
        plan.background = background;
        let renderer = rendered(&device, &plan);
        let radiance = device::wide(&renderer.radiance().expect("radiance"));
        let display = renderer.display().expect("display");
        assert!(
            radiance.iter().any(|p| p[3] > 0.05 && p[3] < 0.95),
            "no partly covered pixel"
        );
        for (pixel, shown) in radiance.iter().zip(&display) {
            let twin = cpu::resolve::resolve(*pixel, plan.exposure, background);
            for c in 0..4 {
                let off = i32::from(shown[c]).abs_diff(i32::from(twin[c]));
                assert!(off <= 1, "{pixel:?} shows {shown:?}, the twin {twin:?}");
            }
        }
    }
}

#[test]
fn averaging_is_the_mean_of_the_frames() {
    let Some(device) = device::device() else {
        return;
    };
    let mut plan = marble([60.0, 35.0], Multiple::Samples(8));
    plan.jitter = Jitter::All;
    plan.frames_averaged = 3;
    let mut renderer = Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
    let mut mean = vec![[0.0; 4]; (SIZE[0] * SIZE[1]) as usize];
    for index in 0..3 {
        renderer
            .render_frames(index..index + 1, &mut |_| ())
            .expect("a frame");
        for (m, p) in mean.iter_mut().zip(renderer.radiance().expect("radiance")) {
            (0..4).for_each(|c| m[c] += f64::from(p[c]) / 3.0);
        }
    }
    renderer
        .render_frames(0..3, &mut |_| ())
        .expect("three frames");
    let worst = worst(
        &mean,
        &device::wide(&renderer.radiance().expect("radiance")),
    );
    assert!(worst < 1e-6, "{worst}");
}

/// Of a solid only front faces are drawn. With a loose triangle inside, which nobody sees, it is none, all faces are drawn,
/// and the picture is the same.
#[test]
fn front_faces_are_all_there_is_to_see_of_a_solid() {
    let Some(device) = device::device() else {
        return;
    };
    let mut plan = marble([140.0, 25.0], Multiple::Mixture(Mixture::THREE));
    plan.specular = true;
    assert!(plan.scene.mesh.is_solid());
    let solid = device::wide(&device::render(&device, &plan));
    let mesh = &mut plan.scene.mesh;
    let first = mesh.positions.len() as u32;
    let middle = mesh.center();
    mesh.positions
        .extend([DVec3::X, DVec3::Y, DVec3::Z].map(|p| middle + p));
    mesh.normals.extend([DVec3::Y; 3]);
    mesh.uvs.extend([[0.0; 2]; 3]);
    mesh.triangles.push([first, first + 1, first + 2]);
    assert!(!mesh.is_solid());
    let all = device::wide(&device::render(&device, &plan));
    let rr = device::rr(&all, &solid);
    assert!(rr < 1e-3, "rr {rr}");
    // Seen from within, it is its back faces that are seen.
    let mut plan = marble([140.0, 25.0], Multiple::Brdf);
    plan.scene.camera.eye = plan.scene.mesh.center();
    plan.scene.camera.target = plan.scene.camera.eye + DVec3::Z;
    let within = device::render(&device, &plan);
    assert!(within.iter().all(|p| p[3] > 0.0), "a hole");
}

/// Two frames in one submit: the layer then checks the barriers between frames, too, and the
/// device of the test fails on any message. The picture is that of two submits.
#[test]
fn frames_do_not_race_with_each_other() {
    let Some(device) = device::device() else {
        return;
    };
    for (multiple, split, keep) in [
        (Multiple::Samples(8), None, false),
        (Multiple::Samples(8), Some(Multiple::Brdf), true),
        (Multiple::Rings(6), None, false),
        (Multiple::Mixture(Mixture::FOUR), None, false),
        (
            Multiple::Mixture(Mixture {
                volumes: 4,
                ..Mixture::FOUR
            }),
            Some(Multiple::Rings(8)),
            false,
        ),
        (
            Multiple::Mixture(Mixture::THREE),
            Some(Multiple::Rings(8)),
            true,
        ),
    ] {
        let mut plan = marble([60.0, 35.0], multiple);
        plan.split = split;
        plan.specular = true;
        // One of them does without back faces.
        if multiple != Multiple::Rings(6) {
            plan.single = Single::March(March {
                steps: 4,
                exits: Exits::Linear,
            });
        }
        plan.frames_averaged = 2;
        for scattering in [Scattering::Full, Scattering::Half] {
            if scattering == Scattering::Half && plan.split.is_some() {
                continue;
            }
            plan.scattering = scattering;
            // The second frame draws the light map anew, or shades from that of the first.
            for jitter in [Jitter::All, Jitter::Samples] {
                plan.jitter = jitter;
                let mut renderer = Renderer::new(
                    &device.device,
                    &plan,
                    &Setup {
                        keep_gbuffer: keep,
                        ..Setup::default()
                    },
                )
                .expect("a renderer");
                renderer.render_pair().expect("two frames");
                let pair = renderer.radiance().expect("radiance");
                renderer.render(&mut |_| ()).expect("two frames again");
                assert!(
                    pair == renderer.radiance().expect("radiance"),
                    "another picture"
                );
            }
        }
    }
}

/// A light map that rests is drawn once, and the picture has the bits of one that is drawn in each frame.
#[test]
fn a_light_map_that_rests_is_drawn_once() {
    let Some(device) = device::device() else {
        return;
    };
    for multiple in [
        Multiple::Samples(8),
        Multiple::Rings(6),
        Multiple::Mixture(Mixture {
            volumes: 3,
            ..Mixture::FOUR
        }),
        Multiple::Exact,
    ] {
        for (jitter, draws) in [(Jitter::Off, 1), (Jitter::Samples, 1), (Jitter::All, 3)] {
            let mut plan = marble([60.0, 35.0], multiple);
            if multiple == Multiple::Exact {
                (plan.size, plan.light_map) = ([32, 24], 48);
            }
            plan.specular = true;
            plan.single = Single::March(March {
                steps: 4,
                exits: Exits::Linear,
            });
            plan.jitter = jitter;
            plan.frames_averaged = 3;
            let mut renderer =
                Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
            let mut draw = |redraw_light| {
                renderer.redraw_light = redraw_light;
                renderer.render(&mut |_| ()).expect("a picture");
                let times = renderer.pass_times();
                let of_light = |pass: &str| ["light", "reduce", "boxes", "volume"].contains(&pass);
                for time in &times {
                    let frames = match time.pass.as_str() {
                        "readback" => 1,
                        pass if of_light(pass) && !redraw_light => draws,
                        _ => 3,
                    };
                    assert_eq!(time.frames, frames, "{multiple}, {}", time.pass);
                }
                let drawn = times.iter().any(|time| time.pass == "light");
                (renderer.radiance().expect("radiance"), drawn)
            };
            let stamped = device.device.candidate().timestamp_bits > 0;
            let (resting, drawn) = draw(false);
            assert_eq!(drawn, stamped);
            let (anew, _) = draw(true);
            assert!(resting == anew, "{multiple}, {jitter:?}: another picture");
            // It lies where the last frame of the same plan left it.
            let (again, drawn) = draw(false);
            assert!(again == resting, "{multiple}, {jitter:?}: another picture");
            assert_eq!(drawn, stamped && jitter == Jitter::All);
        }
    }
}

/// Halves of the same method are the whole.
#[test]
fn a_split_into_one_method_is_that_method() {
    let Some(device) = device::device() else {
        return;
    };
    let mut plan = device::plan(
        bumpy(),
        medium("marble").material(),
        [60.0, 35.0],
        [20.0, 10.0],
        [40, 30],
        Multiple::Exact,
    );
    plan.light_map = 64;
    let whole = device::render(&device, &plan);
    plan.split = Some(Multiple::Exact);
    assert!(whole == device::render(&device, &plan));
}

/// Where the divider of a split picture is, to the column, and whose picture is on either side of it.
#[test]
fn a_split_picture() {
    let Some(device) = device::device() else {
        return;
    };
    let mut plan = marble([60.0, 35.0], Multiple::Mixture(Mixture::THREE));
    plan.single = Single::March(March {
        steps: 4,
        exits: Exits::Linear,
    });
    let right = device::render(&device, &plan);
    plan.multiple = Multiple::Rings(6);
    let left = device::render(&device, &plan);
    plan.multiple = Multiple::Mixture(Mixture::THREE);
    plan.split = Some(Multiple::Rings(6));
    let width = SIZE[0] as usize;
    for (share, divider) in [
        (0.0, 0),
        (0.25, 40),
        (0.5, 80),
        (0.503, 80),
        (0.999, 160),
        (1.0, 160),
    ] {
        plan.split_at = share;
        assert_eq!(plan.divider(), divider as u32);
        let joined: Vec<_> = (0..left.len())
            .map(|i| {
                if i % width < divider {
                    left[i]
                } else {
                    right[i]
                }
            })
            .collect();
        assert!(joined == device::render(&device, &plan), "at {share}");
    }

    plan.split_at = 0.25;
    let mut renderer = rendered(&device, &plan);
    let map = device::light_map(&mut renderer);
    let gbuffer = device::gbuffer(&mut renderer, plan.size);
    let noise = cpu::shade::noise();
    let mut shading = Shading::new(&plan.scene.material, &plan.scene.light, &map, noise, 0);
    let mut twin = vec![[0.0; 4]; left.len()];
    for (columns, method) in plan.parts() {
        shading.reduce(method);
        let (view, march) = (renderer.view(0), plan.march(method));
        let whole = cpu::shade::shade(&gbuffer, &view, &shading, method, march, plan.specular);
        let [first, end] = columns.map(|column| column as usize);
        for (i, pixel) in whole.into_iter().enumerate() {
            if (first..end).contains(&(i % width)) {
                twin[i] = pixel;
            }
        }
    }
    let gpu = device::wide(&renderer.radiance().expect("radiance"));
    // As in `mixture`.
    agree("at a quarter", &twin, &gpu, 6e-3);
}

/// A divider that is moved is one that was there from the start, and no part is drawn that has no columns.
#[test]
fn a_divider_moves() {
    let Some(device) = device::device() else {
        return;
    };
    for (left, right) in [
        (Multiple::Brdf, Multiple::Mixture(Mixture::FOUR)),
        (Multiple::Samples(8), Multiple::Exact),
        (Multiple::Exact, Multiple::Rings(5)),
    ] {
        let mut plan = marble([60.0, 35.0], right);
        (plan.split, plan.size, plan.light_map) = (Some(left), [33, 24], 48);
        plan.single = Single::March(March {
            steps: 3,
            exits: Exits::Linear,
        });
        let mut renderer =
            Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
        for share in [0.3, 0.0, 0.99, 1.0, 0.517, 0.5] {
            plan.split_at = share;
            renderer.set_split_at(share);
            renderer.render(&mut |_| ()).expect("a picture");
            let moved = renderer.radiance().expect("radiance");
            let made = device::render(&device, &plan);
            assert!(moved == made, "{left} and {right} at {share}");
        }
        // Beyond the picture is its edge.
        renderer.set_split_at(7.0);
        renderer.render(&mut |_| ()).expect("a picture");
        plan.split_at = 1.0;
        let made = device::render(&device, &plan);
        assert!(renderer.radiance().expect("radiance") == made);
        // What was made as one part stays one.
        let mut alone =
            Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
        alone.set_split_at(0.3);
        alone.render(&mut |_| ()).expect("a picture");
        assert!(alone.radiance().expect("radiance") == made);
    }
}

/// The same of frames for live display, which the layer watches.
#[test]
fn a_divider_moves_between_live_frames() {
    let Some(device) = device::device() else {
        return;
    };
    let mut plan = marble([60.0, 35.0], Multiple::Mixture(Mixture::THREE));
    (plan.split, plan.size) = (Some(Multiple::Brdf), [40, 30]);
    let setup = Setup {
        live: true,
        ..Setup::default()
    };
    let first = |renderer: &mut Renderer| {
        renderer.forget_history();
        renderer.draw_live(0, true).expect("a frame");
        renderer.radiance().expect("radiance")
    };
    let mut renderer = Renderer::new(&device.device, &plan, &setup).expect("a renderer");
    for (index, share) in [(0, 0.5), (1, 0.0), (2, 1.0), (3, 0.25)] {
        renderer.set_split_at(share);
        renderer.draw_live(index, false).expect("a frame");
    }
    plan.split_at = 0.25;
    let mut made = Renderer::new(&device.device, &plan, &setup).expect("a renderer");
    assert!(first(&mut renderer) == first(&mut made));
}
