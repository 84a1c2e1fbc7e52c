//! The CPU twin against analytic truths, and its methods against each other.

mod common;

use std::f64::consts::{FRAC_PI_4, PI};

use common::media::{Medium, medium};
use common::random::Random;
use common::shapes;
use glam::{DVec2, DVec3};
use marmor::cpu::shade::{self, Receiver, Shading};
use marmor::cpu::{GBuffer, LightMap, light, view};
use marmor::optics::fresnel;
use marmor::scene::{Camera, Light, LightFrame, Mesh, Multiple, View};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

/// A light that is aligned with no axis.
fn slanted() -> Light {
    Light {
        azimuth: 35.0,
        elevation: 25.0,
        irradiance: 3.0,
        color: DVec3::new(1.0, 0.9, 0.7),
    }
}

fn light_map(mesh: &Mesh, light: &Light, size: u32, eta: f64) -> LightMap {
    let positions = mesh.positions.iter().copied();
    let frame = LightFrame::fit(positions, light.to_light(), size, DVec2::ZERO);
    light::draw(mesh, &frame, eta)
}

/// A picture of `size` x `size` pixels of a mesh of the given radius around `center`.
fn picture(mesh: &Mesh, center: DVec3, radius: f64, size: usize) -> (View, GBuffer) {
    let camera = Camera {
        eye: center + DVec3::new(0.6, 0.4, 3.2) * radius,
        target: center,
        up: DVec3::Y,
        fov: 42.0,
    };
    let bound = 1.4 * radius;
    let view = camera.view(size as u32, size as u32, center, bound, DVec2::ZERO);
    let gbuffer = view::draw(mesh, &view, size, size);
    (view, gbuffer)
}

fn receivers(gbuffer: &GBuffer, view: &View) -> Vec<Receiver> {
    (0..gbuffer.depth.len())
        .filter_map(|i| shade::receiver(gbuffer, view, i))
        .collect()
}

/// A point that faces `n` and the viewer.
fn facing(p: DVec3, n: DVec3) -> Receiver {
    Receiver {
        p,
        n,
        wo: n,
        pixel: [0, 0],
        back: None,
    }
}

#[test]
fn exact_follows_the_analytic_half_plane() {
    // A sheet 20 transport lengths above a plane that faces the light hides half of it. The
    // sheet is lit itself, but from so far away nothing of that arrives.
    let medium = medium("skin1");
    let light = slanted();
    let to_light = light.to_light();
    let frame = LightFrame::fit([DVec3::ZERO, DVec3::ONE], to_light, 16, DVec2::ZERO);
    let (u, v) = (frame.u, frame.v);
    let length = 1.0 / medium.dipole(0).sigma_tr;
    let half = 12.0 * length;
    let floor = shapes::plane(DVec3::ZERO, u * half, v * half);
    let above = to_light * (20.0 * length);
    let sheet = shapes::plane(above - u * (0.5 * half), u * (0.5 * half), v * half);
    let mesh = shapes::joined(floor, sheet);
    // The size is even and the extent centred, so the sheet's edge lies between two texels.
    let map = light_map(&mesh, &light, 512, medium.eta);
    let noise = shade::noise();
    let shading = Shading::new(&medium.material(), &light, &map, noise, 0);

    let free_path = medium.dipole(1).z_r;
    let entering = light.perpendicular_irradiance() * fresnel::transmittance(1.0, medium.eta);
    for k in -10..=10 {
        let d = 0.5 * f64::from(k) * free_path;
        // Off the texels' symmetry along v as well.
        let m = shade::exact(&shading, &facing(u * d + v * 0.37, to_light)) / entering;
        for c in 0..3 {
            let dipole = medium.dipole(c);
            let beyond = dipole.beyond(d.abs());
            let truth = if d < 0.0 {
                beyond
            } else {
                dipole.total() - beyond
            };
            let error = (m[c] - truth).abs() / dipole.total();
            assert!(
                error <= 0.005,
                "channel {c}, {d:.2} mm from the edge: {error}"
            );
        }
    }
    // The bound is tight: an edge misplaced by a twentieth of a free path would exceed it.
    let dipole = medium.dipole(1);
    let slip = 0.5 * dipole.total() - dipole.beyond(0.05 * free_path);
    assert!(slip > 0.005 * dipole.total());
}

#[test]
fn a_broadly_lit_plane_without_absorption_returns_all_that_enters() {
    let white = Medium {
        name: "white",
        sigma_s: [1.0, 1.3, 1.6],
        sigma_a: [0.0; 3],
        reflectance: [1.0; 3],
        eta: 1.2,
    };
    let light = slanted();
    let noise = shade::noise();
    let half = 70.0;
    // Facing the light, and tilted away from it: only the cosine may change.
    for tilt in [0.0_f64, 0.6, 1.0] {
        let frame = LightFrame::fit([DVec3::ZERO, DVec3::ONE], light.to_light(), 16, DVec2::ZERO);
        let a = frame.u * tilt.cos() - frame.to_light * tilt.sin();
        let n = frame.to_light * tilt.cos() + frame.u * tilt.sin();
        let mesh = shapes::plane(DVec3::ZERO, a * half, frame.v * half);
        let map = light_map(&mesh, &light, 512, white.eta);
        let shading = Shading::new(&white.material(), &light, &map, noise, 0);
        let receiver = facing(DVec3::ZERO, n);
        let cos = tilt.cos();
        let entering =
            light.perpendicular_irradiance() * (fresnel::transmittance(cos, white.eta) * cos);
        let m = shade::exact(&shading, &receiver) / entering;
        for c in 0..3 {
            let dipole = white.dipole(c);
            // What lands outside the square: 8 wedges of Phi at its border, by the midpoint rule.
            let steps = 200;
            let outside: f64 = (0..steps)
                .map(|k| {
                    let angle = FRAC_PI_4 * (f64::from(k) + 0.5) / f64::from(steps);
                    dipole.phi((half / angle.cos()).powi(2)) / f64::from(steps)
                })
                .sum();
            assert!(outside < 0.05);
            let total = m[c] + outside;
            assert!(
                (total - 1.0).abs() < 1e-3,
                "tilt {tilt}, channel {c}: {total}"
            );
        }
        // Without transport the plane is a Lambertian reflector of the same total.
        let lambert = shade::brdf(&shading, &receiver) / entering;
        assert!(
            (lambert - 1.0).abs().max_element() < 1e-12,
            "tilt {tilt}: {lambert}"
        );
    }
}

/// z-scores of `samples` against `exact`, frame by frame with independent uniform shifts.
fn z_scores(name: &str, n: u32, frames: u32) -> Vec<f64> {
    let medium = medium(name);
    let light = Light {
        azimuth: 70.0,
        ..slanted()
    };
    let mesh = shapes::bumpy(8.0, 4);
    let map = light_map(&mesh, &light, 96, medium.eta);
    let noise = shade::noise();
    let shading = Shading::new(&medium.material(), &light, &map, noise, 0);
    let (view, gbuffer) = picture(&mesh, DVec3::ZERO, 8.0, 22);
    let receivers = receivers(&gbuffer, &view);
    assert!(receivers.len() >= 200, "only {} receivers", receivers.len());
    receivers
        .par_iter()
        .enumerate()
        .flat_map_iter(|(k, receiver)| {
            let mut random = Random((k as u64) << 20);
            let exact = shade::exact(&shading, receiver);
            let (mut mean, mut squares) = (DVec3::ZERO, DVec3::ZERO);
            for f in 0..frames {
                let xi = [random.uniform(), random.uniform()];
                let m = shade::samples_shifted(&shading, receiver, n, xi);
                let delta = m - mean;
                mean += delta / f64::from(f + 1);
                squares += delta * (m - mean);
            }
            let error = (squares / f64::from(frames - 1) / f64::from(frames)).map(f64::sqrt);
            ((mean - exact) / error).to_array()
        })
        .collect()
}

#[test]
fn samples_are_unbiased_and_their_spread_is_as_estimated() {
    // 7 samples leave techniques with one and with two of them, 2 leave most with none.
    for (name, n, frames) in [
        ("marble", 30, 600),
        ("skin1", 30, 600),
        ("ketchup", 30, 600),
        ("marble", 7, 2000),
        ("skin1", 2, 4000),
    ] {
        let z = z_scores(name, n, frames);
        let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
        let worst = z.iter().fold(0.0_f64, |a, z| a.max(z.abs()));
        // Bonferroni: the chance that any of the scores exceeds the bound is 0.1 %.
        let normal = Normal::new(0.0, 1.0).expect("a standard normal");
        let bound = normal.inverse_cdf(1.0 - 0.5e-3 / z.len() as f64);
        println!("{name} {n}: rms {rms}, worst {worst}, bound {bound}");
        assert!(worst < bound, "{name} {n}: worst z {worst}, bound {bound}");
        assert!((rms - 1.0).abs() < 0.1, "{name} {n}: RMS of z {rms}");
    }
}

#[test]
fn frames_of_the_sequence_converge_to_exact() {
    let medium = medium("marble");
    let light = slanted();
    let mesh = shapes::bumpy(8.0, 4);
    let map = light_map(&mesh, &light, 96, medium.eta);
    let noise = shade::noise();
    let (view, gbuffer) = picture(&mesh, DVec3::ZERO, 8.0, 24);
    let mut errors = [0.0; 2];
    for (k, frames) in [1, 64].into_iter().enumerate() {
        let receivers = receivers(&gbuffer, &view);
        let squares: f64 = receivers
            .par_iter()
            .map(|receiver| {
                let mean: DVec3 = (0..frames)
                    .map(|frame| {
                        let shading = Shading::new(&medium.material(), &light, &map, noise, frame);
                        shade::samples(&shading, receiver, 30) / f64::from(frames)
                    })
                    .sum();
                let shading = Shading::new(&medium.material(), &light, &map, noise, 0);
                (mean - shade::exact(&shading, receiver)).length_squared()
            })
            .sum();
        errors[k] = squares.sqrt();
    }
    println!("{errors:?}: gain {}", errors[0] / errors[1]);
    // Independent frames would gain a factor of 8.
    assert!(errors[0] / errors[1] > 10.0, "{errors:?}");
}

#[test]
fn no_pixel_is_ever_nan_or_infinite() {
    let mesh = shapes::joined(shapes::bumpy(8.0, 3), shapes::disc(16.0, 24));
    let (view, gbuffer) = picture(&mesh, DVec3::ZERO, 10.0, 48);
    let noise = shade::noise();
    for name in ["spectralon", "ketchup", "marble"] {
        let material = medium(name).material();
        // From the front, exactly grazing the disc, and from behind.
        for azimuth in [0.0, 90.0, 180.0] {
            let light = Light {
                azimuth,
                elevation: 0.0,
                ..slanted()
            };
            let map = light_map(&mesh, &light, 64, material.eta);
            let shading = Shading::new(&material, &light, &map, noise, 5);
            for multiple in [
                Multiple::None,
                Multiple::Brdf,
                Multiple::Samples(1),
                Multiple::Samples(30),
                Multiple::Exact,
            ] {
                let image = shade::shade(&gbuffer, &view, &shading, multiple, None, true);
                for (i, pixel) in image.iter().enumerate() {
                    let fine = pixel.iter().all(|x| x.is_finite() && *x >= 0.0);
                    assert!(fine, "{name} {azimuth} {multiple:?} pixel {i}: {pixel:?}");
                    let expected = if gbuffer.depth[i] < 1.0 { 1.0 } else { 0.0 };
                    assert_eq!(pixel[3], expected);
                }
            }
        }
    }
}

#[test]
fn the_light_sees_the_sphere_that_geometry_describes() {
    let (radius, eta) = (5.0, 1.4);
    let light = slanted();
    let mesh = shapes::sphere(radius, 6);
    let map = light_map(&mesh, &light, 128, eta);
    let frame = &map.frame;
    let mut flux = 0.0;
    for texel in map.lit_texels() {
        flux += texel.w * frame.texel_area();
        let rho2 = texel.x.truncate().length_squared();
        if rho2 < 0.9 * radius * radius {
            let height = (radius * radius - rho2).sqrt();
            assert!((texel.x.z + height).abs() < 0.005, "{}", texel.x);
            let w = fresnel::transmittance(height / radius, eta);
            assert!((texel.w - w).abs() < 1e-3, "{} {w}", texel.w);
        }
    }
    // The flux that enters is pi r^2 times the cosine-weighted mean transmittance.
    let steps = 10_000;
    let mean: f64 = (0..steps)
        .map(|k| {
            let mu = (f64::from(k) + 0.5) / f64::from(steps);
            2.0 * mu * fresnel::transmittance(mu, eta) / f64::from(steps)
        })
        .sum();
    assert!((flux / (PI * radius * radius * mean) - 1.0).abs() < 2e-3);
    for (moments, depth) in map.moments.iter().zip(&map.depth) {
        let [w, wz, wzz, wzzz] = *moments;
        if w == 0.0 {
            assert_eq!([wz, wzz, wzzz], [0.0; 3]);
            continue;
        }
        let z = wz / w;
        assert!((wzz / w - z * z).abs() < 1e-12 && (wzzz / w - z * z * z).abs() < 1e-12);
        assert!((light::depth_of(z) - depth).abs() < 1e-12);
        assert!(depth > &0.0 && depth < &1.0);
    }
}

#[test]
fn a_mesh_turned_inside_out_takes_in_the_same_light() {
    let mesh = shapes::bumpy(5.0, 3);
    let mut turned = mesh.clone();
    for t in &mut turned.triangles {
        t.swap(1, 2);
    }
    for n in &mut turned.normals {
        *n = -*n;
    }
    let (a, b) = (
        light_map(&mesh, &slanted(), 64, 1.3),
        light_map(&turned, &slanted(), 64, 1.3),
    );
    // Both the winding and the normals are turned, so the turn towards the light must happen in
    // one of the two.
    assert_eq!(a.depth, b.depth);
    for (a, b) in a.moments.iter().zip(&b.moments) {
        assert!((a[0] - b[0]).abs() < 1e-12);
    }
    assert!(a.lit_texels().count() > 500);
}

#[test]
fn a_finer_mesh_of_the_same_shape_gives_the_same_light_map() {
    let mesh = shapes::bumpy(5.0, 3);
    let (a, b) = (
        light_map(&mesh, &slanted(), 96, 1.3),
        light_map(&shapes::subdivided(&mesh), &slanted(), 96, 1.3),
    );
    let mut flipped = 0;
    for (a, b) in a.moments.iter().zip(&b.moments) {
        if (a[0] == 0.0) != (b[0] == 0.0) {
            flipped += 1;
        } else {
            for k in 0..4 {
                assert!((a[k] - b[k]).abs() < 1e-9, "{a:?} {b:?}");
            }
        }
    }
    assert!(flipped <= 2, "{flipped} texels changed coverage");
}

#[test]
fn moving_the_scene_changes_nothing() {
    let offset = DVec3::new(130.0, -40.0, 75.0);
    let light = slanted();
    let material = medium("skin1").material();
    let noise = shade::noise();
    let mesh = shapes::bumpy(8.0, 4);
    let images = [DVec3::ZERO, offset].map(|offset| {
        let mesh = shapes::moved(&mesh, offset);
        let map = light_map(&mesh, &light, 96, material.eta);
        let (view, gbuffer) = picture(&mesh, offset, 8.0, 32);
        let shading = Shading::new(&material, &light, &map, noise, 3);
        [Multiple::Exact, Multiple::Brdf, Multiple::Samples(30)]
            .map(|multiple| shade::shade(&gbuffer, &view, &shading, multiple, None, true))
    });
    for (here, there) in images[0].iter().flatten().zip(images[1].iter().flatten()) {
        for k in 0..4 {
            assert!((here[k] - there[k]).abs() < 1e-8, "{here:?} {there:?}");
        }
    }
}

#[test]
fn the_view_pass_sees_both_sides_of_a_sphere() {
    let mesh = shapes::sphere(5.0, 6);
    let (view, gbuffer) = picture(&mesh, DVec3::ZERO, 5.0, 64);
    let mut seen = 0;
    for i in 0..gbuffer.depth.len() {
        let Some(receiver) = shade::receiver(&gbuffer, &view, i) else {
            assert_eq!(gbuffer.back_depth[i], 1.0);
            assert_eq!(gbuffer.normal[i], DVec3::ZERO);
            continue;
        };
        seen += 1;
        // On the surface to within the facets' sagitta, and its normal points out.
        assert!((receiver.p.length() - 5.0).abs() < 0.003);
        assert!(receiver.n.distance(receiver.p / 5.0) < 0.002);
        let xy = DVec2::new((i % 64) as f64 + 0.5, (i / 64) as f64 + 0.5);
        assert!(gbuffer.back_depth[i] > gbuffer.depth[i]);
        if gbuffer.back_depth[i] < 1.0 {
            let exit = view.position(xy, gbuffer.back_depth[i]);
            assert!((exit.length() - 5.0).abs() < 0.003);
        }
    }
    assert!(seen > 700, "{seen}");
}

#[test]
fn visibility_separates_light_from_shadow() {
    let light = Light {
        azimuth: 0.0,
        elevation: 90.0,
        ..slanted()
    };
    let floor = shapes::plane(DVec3::ZERO, DVec3::X * 20.0, -DVec3::Z * 20.0);
    let sheet = shapes::plane(
        DVec3::new(-10.0, 5.0, 0.0),
        DVec3::X * 10.0,
        -DVec3::Z * 20.0,
    );
    let map = light_map(&shapes::joined(floor, sheet), &light, 128, 1.3);
    let texel = map.frame.texel;
    let at = |x: f64| shade::visibility(&map, DVec3::new(x, 0.0, 3.1), DVec3::Y);
    assert_eq!((at(-2.0 * texel), at(2.0 * texel)), (0.0, 1.0));
    // The edge is one texel wide and linear.
    assert!((at(0.0) - 0.5).abs() < 1e-9);
    assert!((at(0.25 * texel) - 0.75).abs() < 1e-9);
    // No light from below, none lost outside the map.
    assert_eq!(shade::visibility(&map, DVec3::ZERO, -DVec3::Y), 0.0);
    assert_eq!(at(300.0), 1.0);
}

#[test]
fn a_lit_sphere_does_not_shadow_itself() {
    let light = slanted();
    let mesh = shapes::sphere(5.0, 5);
    let map = light_map(&mesh, &light, 128, 1.3);
    for p in &mesh.positions {
        let n = p.normalize();
        let cos = n.dot(light.to_light());
        if cos > 0.3 {
            assert_eq!(shade::visibility(&map, *p, n), 1.0, "cos {cos}");
        } else if cos <= 0.0 {
            assert_eq!(shade::visibility(&map, *p, n), 0.0);
        }
    }
}

#[test]
fn samples_do_not_depend_on_the_number_of_threads() {
    let medium = medium("marble");
    let mesh = shapes::bumpy(8.0, 3);
    let (view, gbuffer) = picture(&mesh, DVec3::ZERO, 8.0, 24);
    let noise = shade::noise();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a thread pool").install(|| {
            let map = light_map(&mesh, &slanted(), 64, medium.eta);
            let shading = Shading::new(&medium.material(), &slanted(), &map, noise, 0);
            shade::shade(&gbuffer, &view, &shading, Multiple::Samples(30), None, true)
        })
    };
    assert_eq!(run(1), run(3));
}
