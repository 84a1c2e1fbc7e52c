//! The GPU against analytic truth and against itself.

mod common;

use common::device;
use common::media::medium;
use common::shapes;
use glam::{DVec2, DVec3};
use marmor::frame::{Renderer, Setup, Target};
use marmor::optics::{Dipole, fresnel};
use marmor::scene::{Jitter, Material, Multiple};

/// A plane below a sheet that shades half of it, far enough above to add nothing itself.
#[test]
fn exact_meets_the_analytic_half_plane() {
    let Some(device) = device::device() else {
        return;
    };
    // A transport length of about 2 mm, resolved by texels of 0.2 mm.
    let material = Material {
        name: "custom".into(),
        sigma_s: DVec3::new(0.9, 1.0, 1.2),
        sigma_a: DVec3::new(0.08, 0.10, 0.12),
        eta: 1.3,
        g: 0.0,
        roughness: 0.3,
    };
    let half = 24.0;
    let plane = shapes::plane(DVec3::ZERO, DVec3::X * half, DVec3::Z * -half);
    let sheet = shapes::plane(
        DVec3::new(half / 2.0, 45.0, 0.0),
        DVec3::X * (half / 2.0),
        DVec3::Z * -half,
    );
    let mesh = shapes::joined(plane, sheet);
    let mut plan = device::plan(
        mesh,
        material.clone(),
        [0.0, 90.0],
        [0.0, 90.0],
        [96, 8],
        Multiple::Exact,
    );
    plan.light_map = 256;
    // The camera looks at the plane from below the sheet, obliquely along z.
    plan.scene.camera.eye = DVec3::new(0.0, 20.0, 30.0);
    plan.scene.camera.target = DVec3::ZERO;
    plan.scene.camera.fov = 2.0;
    let mut renderer = Renderer::new(
        &device.device,
        &plan,
        &Setup {
            keep_gbuffer: true,
            ..Setup::default()
        },
    )
    .expect("a renderer");
    renderer.render(&mut |_| ()).expect("a picture");
    let radiance = renderer.radiance().expect("radiance");
    let depth = renderer.read(Target::ViewDepth).expect("depth");
    let view = renderer.view(0);

    // The edge of the shadow lies where the map says: between the last lit texel of the
    // plane and the first shaded one.
    let frame = renderer.light_frame(0);
    let edge = (frame.to_texel(frame.to_light_space(-renderer.center()).truncate())).floor()
        * frame.texel
        + frame.origin;
    let edge_texel = frame.to_light_space(DVec3::ZERO - renderer.center());
    assert!((edge - edge_texel.truncate()).abs().max_element() <= frame.texel);

    let dipoles =
        [0, 1, 2].map(|c| Dipole::new(material.sigma_s[c], material.sigma_a[c], material.eta));
    let e0 = plan.scene.light.perpendicular_irradiance();
    let enters = fresnel::transmittance(1.0, material.eta);
    let mut compared = [0, 0];
    for (i, (pixel, d)) in radiance.iter().zip(&depth).enumerate() {
        assert!(pixel[3] > 0.0, "the plane fills the picture");
        let xy = DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5);
        let p = view.position(xy, f64::from(d[0])) + renderer.center();
        let wo = (view.eye - p + renderer.center()).normalize();
        let leaves = fresnel::transmittance(wo.y, material.eta) / std::f64::consts::PI;
        for c in 0..3 {
            let exitance = f64::from(pixel[c]) / (leaves * e0[c] * enters);
            let total = dipoles[c].total();
            // Lit where x < 0.
            let truth = if p.x < 0.0 {
                total - dipoles[c].beyond(-p.x)
            } else {
                dipoles[c].beyond(p.x)
            };
            compared[usize::from(p.x > 0.0)] += 1;
            let off = (exitance - truth).abs() / total;
            assert!(
                off <= 0.005,
                "x = {:.3} mm, channel {c}: {exitance} for {truth}, {off} of R_tot",
                p.x
            );
        }
    }
    assert!(compared.iter().all(|&n| n > 500), "{compared:?}");
}

/// White furnace: without absorption all that enters a broadly lit plane leaves it.
#[test]
fn what_enters_leaves() {
    let Some(device) = device::device() else {
        return;
    };
    let material = Material {
        name: "white".into(),
        sigma_s: DVec3::splat(2.0),
        sigma_a: DVec3::splat(1e-5),
        eta: 1.3,
        g: 0.0,
        roughness: 0.3,
    };
    let half = 400.0;
    let mesh = shapes::plane(DVec3::ZERO, DVec3::X * half, DVec3::Z * -half);
    for multiple in [Multiple::Exact, Multiple::Samples(30), Multiple::Brdf] {
        let mut plan = device::plan(
            mesh.clone(),
            material.clone(),
            [0.0, 90.0],
            [0.0, 60.0],
            [16, 8],
            multiple,
        );
        plan.scene.camera.eye = DVec3::new(0.0, 20.0, 12.0);
        plan.scene.camera.fov = 4.0;
        plan.light_map = 2048;
        plan.frames_averaged = if multiple == Multiple::Exact { 1 } else { 64 };
        plan.jitter = Jitter::Samples;
        if multiple == Multiple::Exact {
            // 0.4 mm texels are enough for a source 0.5 mm deep; the rest only costs time.
            plan.scene.mesh = shapes::plane(DVec3::ZERO, DVec3::X * 100.0, DVec3::Z * -100.0);
            plan.light_map = 512;
        }
        let image = device::render(&device, &plan);
        let mean = image.iter().map(|p| f64::from(p[1])).sum::<f64>() / image.len() as f64;
        let wo = DVec3::new(0.0, 20.0, 12.0).normalize();
        let expected = plan.scene.light.perpendicular_irradiance().y
            * fresnel::transmittance(1.0, 1.3)
            * fresnel::transmittance(wo.y, 1.3)
            / std::f64::consts::PI;
        // What the finite plane loses beyond its edge.
        let reach = if multiple == Multiple::Exact {
            100.0
        } else {
            half
        };
        let dipole = Dipole::new(2.0, 1e-5, 1.3);
        let kept = match multiple {
            Multiple::Brdf => dipole.total(),
            _ => dipole.total() - dipole.phi(reach * reach) * 1.2,
        };
        let off = (mean / expected / kept - 1.0).abs();
        assert!(off < 0.01, "{multiple:?}: {mean} for {}", expected * kept);
        assert!(mean / expected < 1.0 + 1e-3, "{multiple:?} makes energy");
    }
}

/// `samples` has the expectation of `exact`: over many frames the mean goes to it, and the
/// deviation is what the variance says.
#[test]
fn samples_average_to_exact() {
    let Some(device) = device::device() else {
        return;
    };
    for name in ["marble", "skin1", "ketchup"] {
        let mut plan = device::plan(
            shapes::bumpy(20.0, 5),
            medium(name).material(),
            [140.0, 25.0],
            [20.0, 10.0],
            [64, 48],
            Multiple::Exact,
        );
        plan.jitter = Jitter::Samples;
        let exact = device::wide(&device::render(&device, &plan));
        plan.multiple = Multiple::Samples(12);
        let mut renderer =
            Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
        const FRAMES: u32 = 192;
        let mut sum = vec![[0.0; 2]; exact.len()];
        for index in 0..FRAMES {
            renderer
                .render_frames(index..index + 1, &mut |_| ())
                .expect("a frame");
            for (s, p) in sum.iter_mut().zip(renderer.radiance().expect("radiance")) {
                s[0] += f64::from(p[1]);
                s[1] += f64::from(p[1]).powi(2);
            }
        }
        let n = f64::from(FRAMES);
        let (mut z2, mut count, mut bias, mut total) = (0.0, 0.0, 0.0, 0.0);
        for (e, s) in exact.iter().zip(&sum).filter(|(e, _)| e[3] > 0.0) {
            let mean = s[0] / n;
            let variance = (s[1] / n - mean * mean).max(0.0) * n / (n - 1.0);
            assert!(
                variance > 0.0 || e[1] == 0.0,
                "{name}: a pixel without noise"
            );
            let z = (mean - e[1]) / (variance / n).sqrt().max(1e-9);
            assert!(z.abs() < 6.0, "{name}: z = {z}, {mean} for {}", e[1]);
            z2 += z * z;
            count += 1.0;
            bias += mean - e[1];
            total += e[1];
        }
        assert!(count > 500.0);
        // The sequence covers its domain more evenly than chance, so z is at most normal.
        assert!(
            (z2 / count).sqrt() < 1.2,
            "{name}: RMS z {}",
            (z2 / count).sqrt()
        );
        assert!((bias / total).abs() < 2e-3, "{name}: bias {}", bias / total);
    }
}

/// A mesh cut finer is the same surface.
#[test]
fn a_subdivided_mesh_gives_the_same_picture() {
    let Some(device) = device::device() else {
        return;
    };
    let mesh = shapes::bumpy(20.0, 4);
    // Flat triangles with the normals' interpolation left as it is: subdivision at the
    // middles moves no point of the surface, but normalised normals bend a little.
    let fine = shapes::subdivided(&mesh);
    for multiple in [Multiple::Exact, Multiple::Samples(30)] {
        let picture = |mesh| {
            let plan = device::plan(
                mesh,
                medium("marble").material(),
                [140.0, 25.0],
                [20.0, 10.0],
                [96, 72],
                multiple,
            );
            device::wide(&device::render(&device, &plan))
        };
        let (a, b) = (picture(mesh.clone()), picture(fine.clone()));
        let rr = device::rr(&a, &b);
        assert!(rr < 0.01, "{multiple:?}: rr {rr}");
    }
}

/// The same scene far away, or in other units, gives the same picture.
#[test]
fn a_moved_or_rescaled_scene_gives_the_same_picture() {
    let Some(device) = device::device() else {
        return;
    };
    for multiple in [Multiple::Exact, Multiple::Samples(30), Multiple::Brdf] {
        let mut plan = device::plan(
            shapes::bumpy(20.0, 4),
            medium("skin1").material(),
            [140.0, 25.0],
            [20.0, 10.0],
            [96, 72],
            multiple,
        );
        plan.specular = true;
        let base = device::wide(&device::render(&device, &plan));

        let offset = DVec3::new(4096.0, -8192.0, 16384.0);
        let mut moved = plan.clone();
        moved.scene.mesh = shapes::moved(&plan.scene.mesh, offset);
        moved.scene.camera.eye += offset;
        moved.scene.camera.target += offset;
        let rr = device::rr(&base, &device::wide(&device::render(&device, &moved)));
        assert!(rr < 5e-3, "{multiple:?} moved: rr {rr}");

        // Lengths times 2, coefficients by 2: the same optical thickness everywhere.
        let mut scaled = plan.clone();
        scaled
            .scene
            .mesh
            .positions
            .iter_mut()
            .for_each(|p| *p *= 2.0);
        scaled.scene.camera.eye *= 2.0;
        scaled.scene.camera.target *= 2.0;
        scaled.scene.material.sigma_s *= 0.5;
        scaled.scene.material.sigma_a *= 0.5;
        let rr = device::rr(&base, &device::wide(&device::render(&device, &scaled)));
        assert!(rr < 5e-3, "{multiple:?} scaled: rr {rr}");
    }
}

/// Two runs give the same bits: of `samples` on any number of threads, of `exact` however its
/// rows were dealt out to submits, which is a matter of time.
#[test]
fn pictures_are_reproducible() {
    let Some(device) = device::device() else {
        return;
    };
    for multiple in [Multiple::Samples(30), Multiple::Exact] {
        let mut plan = device::plan(
            shapes::bumpy(20.0, 4),
            medium("marble").material(),
            [140.0, 25.0],
            [20.0, 10.0],
            [96, 72],
            multiple,
        );
        plan.specular = true;
        plan.frames_averaged = 3;
        plan.jitter = Jitter::All;
        let first = device::render(&device, &plan);
        assert!(first == device::render(&device, &plan), "{multiple:?}");
    }
}

/// No pixel is NaN, infinite or negative, whatever the material, light and view.
#[test]
fn every_pixel_is_finite() {
    let Some(device) = device::device() else {
        return;
    };
    let mut materials: Vec<_> = ["marble", "ketchup", "spectralon", "cream"]
        .map(|n| medium(n).material())
        .into();
    // Nearly transparent, and nearly black.
    for (s, a) in [(1e-4, 1e-6), (1e-3, 50.0)] {
        materials.push(Material {
            name: "extreme".into(),
            sigma_s: DVec3::splat(s),
            sigma_a: DVec3::splat(a),
            eta: 1.0,
            g: 0.0,
            roughness: 0.02,
        });
    }
    let meshes = [
        shapes::bumpy(20.0, 3),
        shapes::disc(20.0, 24),
        shapes::plane(DVec3::ZERO, DVec3::X, DVec3::Y),
    ];
    for mesh in &meshes {
        for material in &materials {
            for light in [
                [0.0, 0.0],
                [90.0, 0.0],
                [180.0, 0.0],
                [17.0, 90.0],
                [0.0, -90.0],
            ] {
                for multiple in [
                    Multiple::Samples(1),
                    Multiple::Samples(31),
                    Multiple::Brdf,
                    Multiple::Exact,
                ] {
                    let mut plan = device::plan(
                        mesh.clone(),
                        material.clone(),
                        light,
                        [8.0, 5.0],
                        [24, 16],
                        multiple,
                    );
                    plan.specular = true;
                    plan.light_map = 32;
                    plan.frames_averaged = 2;
                    plan.jitter = Jitter::All;
                    let image = device::render(&device, &plan);
                    assert!(image.iter().any(|p| p[3] > 0.0), "nothing is seen");
                    let sound = image.iter().flatten().all(|x| x.is_finite() && *x >= 0.0);
                    assert!(sound, "{multiple:?} {} from {light:?}", material.name);
                }
            }
        }
    }
}
