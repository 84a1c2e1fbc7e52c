//! What single scattering promises: closed forms where there are any, the traced reference in the limit,
//! no light from nowhere, and no fewer or more samples than asked for.

mod common;

use common::device;
use common::media::medium;
use common::shapes;
use glam::DVec3;
use marmor::cpu::traced::{self, Tracer};
use marmor::cpu::{light, shade, view};
use marmor::optics::{fresnel, single};
use marmor::scene::{
    Exits, Jitter, March, Material, Mesh, Method, Multiple, Plan, Request, Single,
};

const LINEAR: March = March {
    steps: 8,
    exits: Exits::Linear,
};

/// Single scattering alone: `mesh` of `material`, lit and seen from (azimuth, elevation).
fn alone(mesh: Mesh, material: Material, light: [f64; 2], eye: [f64; 2]) -> Plan {
    let mut plan = device::plan(mesh, material, light, eye, [96, 72], Multiple::None);
    plan.single = Single::March(LINEAR);
    plan
}

fn with_steps(mut plan: Plan, steps: u32) -> Plan {
    plan.single = Single::March(March { steps, ..LINEAR });
    plan
}

/// The traced reference of `plan`'s frame.
fn traced(plan: &Plan) -> Vec<[f64; 4]> {
    let mut plan = plan.clone();
    plan.jitter = Jitter::Off;
    let covered = coverage(&plan);
    traced::picture(&plan, &|| ())
        .iter()
        .zip(covered)
        .map(|(&[r, g, b], a)| [r.into(), g.into(), b.into(), a])
        .collect()
}

/// The same of the middle pixel alone.
fn traced_middle(plan: &Plan) -> DVec3 {
    let mesh = centered(&plan.scene.mesh);
    let tracer = Tracer::new(&mesh);
    let medium = traced::Medium {
        tracer: &tracer,
        material: &plan.scene.material,
        to_light: plan.scene.light.to_light(),
        irradiance: plan.scene.light.perpendicular_irradiance(),
    };
    let view = plan.view_at(plan.scene.mesh.center(), mesh.bounding_radius(), 0);
    let [width, height] = plan.size.map(|n| n as usize);
    let gbuffer = view::draw(&mesh, &view, width, height);
    let receiver = shade::receiver(&gbuffer, &view, height / 2 * width + width / 2);
    traced::single(&medium, &receiver.expect("a covered middle"))
}

fn coverage(plan: &Plan) -> Vec<f64> {
    let mesh = centered(&plan.scene.mesh);
    let view = plan.view_at(plan.scene.mesh.center(), mesh.bounding_radius(), 0);
    let [width, height] = plan.size.map(|n| n as usize);
    let gbuffer = view::draw(&mesh, &view, width, height);
    gbuffer
        .depth
        .iter()
        .map(|&d| f64::from(u8::from(d < 1.0)))
        .collect()
}

fn centered(mesh: &Mesh) -> Mesh {
    let center = mesh.center();
    let mut mesh = mesh.clone();
    mesh.positions.iter_mut().for_each(|p| *p -= center);
    mesh
}

/// The picture of the CPU twin.
fn twin(plan: &Plan) -> Vec<[f64; 4]> {
    let mesh = centered(&plan.scene.mesh);
    let view = plan.view_at(plan.scene.mesh.center(), mesh.bounding_radius(), 0);
    let [width, height] = plan.size.map(|n| n as usize);
    let gbuffer = view::draw(&mesh, &view, width, height);
    let map = light::draw(&mesh, &plan.light_frame(), plan.scene.material.eta);
    let noise = shade::noise();
    let shading = shade::Shading::new(&plan.scene.material, &plan.scene.light, &map, noise, 0);
    let march = plan.march(plan.multiple);
    shade::shade(&gbuffer, &view, &shading, plan.multiple, march, false)
}

/// A wide plate of the given thickness (mm), its faces across z.
fn plate(thickness: f64) -> Mesh {
    shapes::cuboid(DVec3::new(30.0, 30.0, 0.5 * thickness))
}

/// The middle of a picture.
fn middle(plan: &Plan, picture: &[[f64; 4]]) -> DVec3 {
    let [width, height] = plan.size.map(|n| n as usize);
    let [r, g, b, a] = picture[height / 2 * width + width / 2];
    assert_eq!(a, 1.0, "the middle is covered");
    DVec3::new(r, g, b)
}

/// Radiance once scattered in a plate of thickness t, lit and seen at normals' cosines mu_i and mu_o: the ray
/// goes x deep at cos_o and the light comes along cos_i below the surface, so that the exponent is linear in
/// x, from 0 where both sides are one, or from the whole plate where the light comes from behind.
fn slab(plan: &Plan, thickness: f64, mu_i: f64, mu_o: f64) -> DVec3 {
    let material = &plan.scene.material;
    let eta = material.eta;
    let below = |mu: f64| (1.0 - (1.0 - mu * mu) / (eta * eta)).sqrt();
    let (cos_i, cos_o) = (below(mu_i.abs()), below(mu_o));
    let sigma_t = material.unreduced_sigma_s() + material.sigma_a;
    let far = thickness / cos_o;
    let channel = |c: usize| {
        let s = sigma_t[c];
        let (start, slope) = if mu_i > 0.0 {
            (0.0, s * (1.0 + cos_o / cos_i))
        } else {
            (s * thickness / cos_i, s * (1.0 - cos_o / cos_i))
        };
        let integral = if slope.abs() < 1e-9 {
            far
        } else {
            (1.0 - (-slope * far).exp()) / slope
        };
        (-start).exp() * integral
    };
    let integral = DVec3::from_array([0, 1, 2].map(channel));
    let boundary = fresnel::transmittance(mu_i.abs(), eta) * fresnel::transmittance(mu_o, eta);
    let phase = single::henyey_greenstein(0.0, 0.0);
    plan.scene.light.perpendicular_irradiance()
        * material.unreduced_sigma_s()
        * integral
        * (boundary * phase)
}

/// A plate's middle is in closed form, thin or thick, lit from the front or from behind: by the march of the CPU, by
/// that of the GPU, and by rays.
#[test]
fn a_plate_is_as_in_closed_form() {
    let device = device::device();
    for name in ["marble", "skin1", "ketchup"] {
        for thickness in [0.3, 2.0, 12.0] {
            for azimuth in [0.0, 50.0, 180.0, 140.0] {
                let mut plan = alone(
                    plate(thickness),
                    medium(name).material(),
                    [azimuth, 0.0],
                    [0.0, 0.0],
                );
                // An odd side has a pixel in the middle, which looks along the axis.
                plan.size = [65, 49];
                plan.light_map = 256;
                let mu_i = azimuth.to_radians().cos();
                let expected = slab(&plan, thickness, mu_i, 1.0);
                let check = |what: &str, picture: &[[f64; 4]], tolerance: f64| {
                    let off = (middle(&plan, picture) - expected) / expected;
                    assert!(
                        off.abs().max_element() < tolerance,
                        "{what}: {name}, {thickness} mm, lit from {azimuth}: off by {off}"
                    );
                };
                check("march", &twin(&plan), 0.02);
                if let Some(device) = &device {
                    check("GPU", &device::wide(&device::render(device, &plan)), 0.02);
                }
                let off = (traced_middle(&plan) - expected) / expected;
                assert!(
                    off.abs().max_element() < 2e-3,
                    "rays: {name}, {thickness}: {off}"
                );
            }
        }
    }
}

/// Rays meet a sphere where they must, and know which way they cross it.
#[test]
fn rays_meet_what_is_there() {
    let mesh = shapes::sphere(10.0, 5);
    let tracer = Tracer::new(&mesh);
    for i in 0..200 {
        // Lines at all distances from the middle.
        let side = 12.0 * (f64::from(i) + 0.5) / 200.0;
        let direction = DVec3::new(0.3, -0.5, 0.8).normalize();
        let across = direction.any_orthonormal_vector();
        let hits = tracer.hits(across * side - direction * 30.0, direction);
        if side > 10.0 {
            assert!(hits.is_empty(), "{side}");
            continue;
        }
        let half = (100.0 - side * side).sqrt();
        // A sphere of facets; where the line grazes it, their edges decide.
        if side < 9.9 {
            assert_eq!(hits.len(), 2, "{side}");
            assert!(!hits[0].leaves && hits[1].leaves);
            assert!((hits[1].t - hits[0].t - 2.0 * half).abs() < 0.15);
            let at = across * side + direction * (hits[1].t - 30.0);
            assert!(hits[1].normal.dot(at.normalize()) > 0.999);
        }
    }
    // From within there is one way out.
    let hits = tracer.hits(DVec3::new(1.0, 2.0, 3.0), DVec3::X);
    assert_eq!(hits.len(), 1);
    assert!(hits[0].leaves);
}

/// More samples come nearer to the reference, and many come close; on convex bodies, where the exit is known well.
#[test]
fn many_samples_converge_to_rays() {
    for (name, light, bounds) in [
        ("marble", [40.0, 35.0], [0.004, 0.0015]),
        ("ketchup", [120.0, 10.0], [0.025, 0.02]),
    ] {
        let mut plan = alone(
            shapes::sphere(20.0, 6),
            medium(name).material(),
            light,
            [0.0, 5.0],
        );
        plan.light_map = 1024;
        let truth = traced(&plan);
        let errors: Vec<f64> = [1, 2, 4, 8, 64]
            .map(|steps| device::rr(&truth, &twin(&with_steps(plan.clone(), steps))))
            .into();
        assert!(
            errors.windows(2).take(3).all(|e| e[1] < e[0]),
            "{name}: {errors:?}"
        );
        assert!(
            errors[3] < bounds[0] && errors[4] < bounds[1],
            "{name}: {errors:?}"
        );
    }
}

/// A body with hollows and shadows on itself: what no closed form has. Regression guards, as measured.
#[test]
fn shadows_and_hollows_stay_near_to_rays() {
    for (name, bounds) in [
        ("marble", [0.025, 0.04, 0.1]),
        ("skin1", [0.02, 0.03, 0.15]),
    ] {
        let mut plan = alone(
            shapes::bumpy(20.0, 6),
            medium(name).material(),
            [60.0, 35.0],
            [20.0, 10.0],
        );
        plan.light_map = 512;
        let truth = traced(&plan);
        let errors = [Exits::Linear, Exits::Nearest, Exits::Depth].map(|exits| {
            let mut plan = plan.clone();
            plan.single = Single::March(March { exits, ..LINEAR });
            device::rr(&truth, &twin(&plan))
        });
        for (error, bound) in errors.into_iter().zip(bounds) {
            assert!(error < bound, "{name}: {errors:?}");
        }
        // What the bilinear tap of the moments is for.
        assert!(
            errors[0] < errors[1] && errors[1] < errors[2],
            "{name}: {errors:?}"
        );
    }
}

/// No seam and no halo: at the rim of a sphere, at its terminator, and beyond it, every pixel is near to the
/// reference's.
#[test]
fn rims_and_terminators_have_no_seams() {
    let mut plan = alone(
        shapes::sphere(20.0, 6),
        medium("skin1").material(),
        [100.0, 20.0],
        [0.0, 0.0],
    );
    plan.size = [160, 120];
    plan.light_map = 512;
    let (truth, picture) = (traced(&plan), twin(&plan));
    let brightest = truth.iter().map(|p| p[0]).fold(0.0, f64::max);
    let worst = truth
        .iter()
        .zip(&picture)
        .map(|(t, p)| (t[0] - p[0]).abs() / brightest)
        .fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst} of the brightest pixel");
}

/// Whatever is asked for, no pixel is negative, not a number, or brighter than light allows.
#[test]
fn energy_is_neither_negative_nor_made() {
    let Some(device) = device::device() else {
        return;
    };
    let mut materials: Vec<_> = ["marble", "ketchup", "spectralon"]
        .map(|n| medium(n).material())
        .into();
    // Nearly transparent, nearly black, and channels six orders apart.
    for (sigma_s, sigma_a) in [
        (DVec3::splat(1e-4), DVec3::splat(1e-6)),
        (DVec3::splat(1e-3), DVec3::splat(50.0)),
        (DVec3::new(1e-3, 1.0, 1e3), DVec3::splat(1e-6)),
    ] {
        let mut material = medium("marble").material();
        (material.sigma_s, material.sigma_a) = (sigma_s, sigma_a);
        materials.push(material);
    }
    let sheet = shapes::plane(DVec3::ZERO, DVec3::X * 20.0, DVec3::Y * 20.0);
    let meshes = [
        shapes::bumpy(20.0, 4),
        plate(0.05),
        // Edges at every depth before each other.
        shapes::joined(
            shapes::cuboid(DVec3::new(20.0, 1.0, 3.0)),
            shapes::moved(&shapes::cuboid(DVec3::new(1.5, 20.0, 1.5)), DVec3::Z * 9.0),
        ),
        shapes::joined(
            sheet,
            shapes::moved(&shapes::sphere(5.0, 3), DVec3::Z * 12.0),
        ),
    ];
    for mesh in &meshes {
        for (i, material) in materials.iter().enumerate() {
            for (steps, exits, g) in [
                (1, Exits::Linear, 0.0),
                (2, Exits::Nearest, -0.9),
                (8, Exits::Linear, 0.9),
                (8, Exits::Depth, 0.0),
                (64, Exits::Linear, 0.0),
            ] {
                // From in front, from behind, and along the sheet.
                let light = [[30.0, 20.0], [180.0, -35.0], [90.0, 0.0]][i % 3];
                let mut plan = alone(
                    mesh.clone(),
                    material.clone(),
                    light,
                    [160.0 * (i % 2) as f64, 10.0],
                );
                plan.scene.material.g = g;
                plan.single = Single::March(March { steps, exits });
                // What enters is at most E0, and of what the view ray meets the albedo is scattered.
                let sigma_s = plan.scene.material.unreduced_sigma_s();
                let albedo = sigma_s / (sigma_s + plan.scene.material.sigma_a);
                let peak = single::henyey_greenstein(g.signum(), g);
                let most = plan.scene.light.perpendicular_irradiance() * albedo * peak * 1.0001;
                for (pixel, [r, g, b, _]) in device::render(&device, &plan).iter().enumerate() {
                    assert!(
                        [r, g, b].iter().all(|x| x.is_finite() && **x >= 0.0),
                        "pixel {pixel}: {r} {g} {b}; {:?}, {}",
                        plan.scene.material,
                        plan.single
                    );
                    let radiance = DVec3::new((*r).into(), (*g).into(), (*b).into());
                    assert!(
                        radiance.cmple(most).all(),
                        "pixel {pixel}: {radiance}, at most {most}; {:?}, {}",
                        plan.scene.material,
                        plan.single
                    );
                }
            }
        }
    }
}

/// The same plate seen at an angle: the refracted ray leaves nearer than the view ray would.
#[test]
fn a_plate_seen_at_an_angle_is_as_in_closed_form() {
    let device = device::device();
    for (eye, light) in [(40.0, 20.0), (60.0, 0.0), (40.0, 170.0), (60.0, 180.0)] {
        let mut plan = alone(
            plate(2.0),
            medium("skin1").material(),
            [light, 0.0],
            [eye, 0.0],
        );
        plan.scene.material.eta = 1.4;
        plan.size = [65, 49];
        plan.light_map = 512;
        let (mu_i, mu_o) = (f64::to_radians(light).cos(), f64::to_radians(eye).cos());
        let expected = slab(&plan, 2.0, mu_i, mu_o);
        let check = |what: &str, found: DVec3, tolerance: f64| {
            let off = (found - expected) / expected;
            assert!(
                off.abs().max_element() < tolerance,
                "{what}: seen at {eye}, lit at {light}: off by {off}"
            );
        };
        check("rays", traced_middle(&plan), 3e-3);
        check("march", middle(&plan, &twin(&plan)), 0.015);
        if let Some(device) = &device {
            let picture = device::wide(&device::render(device, &plan));
            check("GPU", middle(&plan, &picture), 0.015);
        }
    }
}

/// One sample cannot tell much, but it tells the side that is lit from the one that is not.
#[test]
fn one_sample_casts_a_shadow() {
    let lit = |azimuth: f64| {
        let mut plan = alone(
            shapes::sphere(20.0, 5),
            medium("marble").material(),
            [azimuth, 0.0],
            [0.0, 0.0],
        );
        plan.size = [65, 49];
        plan.light_map = 256;
        middle(&plan, &twin(&with_steps(plan.clone(), 1))).x
    };
    assert!(lit(180.0) < 1e-3 * lit(0.0), "{} {}", lit(180.0), lit(0.0));
}

/// An open sheet has no way out: lit from where it is seen it is a half-space, from either side.
#[test]
fn a_sheet_is_a_half_space() {
    let sheet = shapes::plane(DVec3::ZERO, DVec3::X * 30.0, DVec3::Y * 30.0);
    for side in [0.0, 180.0] {
        let mut plan = alone(
            sheet.clone(),
            medium("skin1").material(),
            [side, 0.0],
            [side, 0.0],
        );
        plan.size = [65, 49];
        let expected = slab(&plan, 1e3, 1.0, 1.0);
        let off = (middle(&plan, &twin(&plan)) - expected) / expected;
        assert!(off.abs().max_element() < 0.02, "{off}");
        // Rays see the same: the sheet is lit from either side.
        let off = (traced_middle(&plan) - expected) / expected;
        assert!(off.abs().max_element() < 2e-3, "{side}: {off}");
    }
}

/// The opaque baseline knows no transport: the left half of a split picture is what it was without.
#[test]
fn the_opaque_half_scatters_nothing() {
    let Some(device) = device::device() else {
        return;
    };
    let mut plan = alone(
        shapes::sphere(10.0, 4),
        medium("skin1").material(),
        [20.0, 20.0],
        [0.0, 0.0],
    );
    plan.split = Some(Multiple::Brdf);
    let with = device::render(&device, &plan);
    plan.single = Single::Off;
    let without = device::render(&device, &plan);
    let width = plan.size[0] as usize;
    let changed = |columns: std::ops::Range<usize>| {
        (0..with.len())
            .filter(|i| columns.contains(&(i % width)) && with[*i] != without[*i])
            .count()
    };
    assert_eq!(changed(0..width / 2), 0);
    assert!(changed(width / 2..width) > 500);
}

/// Rays are cast in the part that scatters, wherever the divider is.
#[test]
fn traced_columns_follow_the_divider() {
    let mut plan = alone(
        shapes::sphere(10.0, 3),
        medium("skin1").material(),
        [20.0, 20.0],
        [0.0, 0.0],
    );
    (plan.size, plan.single) = ([24, 18], Single::Traced);
    let whole = traced::picture(&plan, &|| ());
    plan.split = Some(Multiple::Brdf);
    for (share, divider) in [(0.0, 0), (0.5, 12), (0.4, 10), (1.0, 24)] {
        plan.split_at = share;
        for (i, pixel) in traced::picture(&plan, &|| ()).into_iter().enumerate() {
            let expected = if i % 24 < divider { [0.0; 3] } else { whole[i] };
            assert_eq!(pixel, expected, "pixel {i}, divider at {divider}");
        }
    }
    let lit = |i: &usize| whole[*i] != [0.0; 3];
    let columns: Vec<_> = (0..whole.len()).filter(lit).map(|i| i % 24).collect();
    assert!(columns.contains(&9) && columns.contains(&11) && columns.contains(&12));
}

/// A phase function that goes on favours what is lit from behind, and one that turns back what is lit from the front.
#[test]
fn the_phase_function_has_its_direction() {
    let brightness = |azimuth: f64, g: f64| {
        let mut plan = alone(
            plate(0.2),
            medium("skin1").material(),
            [azimuth, 0.0],
            [0.0, 0.0],
        );
        plan.size = [65, 49];
        plan.scene.material.g = g;
        // The same medium, not the same reduced one.
        plan.scene.material.sigma_s *= 1.0 - g;
        middle(&plan, &twin(&plan)).x
    };
    for (azimuth, cos) in [(0.0, -1.0), (180.0, 1.0)] {
        for g in [-0.6, 0.7] {
            let ratio = brightness(azimuth, g) / brightness(azimuth, 0.0);
            let expected = single::henyey_greenstein(cos, g) / single::henyey_greenstein(cos, 0.0);
            assert!(
                (ratio / expected - 1.0).abs() < 1e-6,
                "{azimuth}, {g}: {ratio}"
            );
        }
    }
}

/// Thousands of edges before each other at all depths: what arrives through any of them stays within what enters.
#[test]
fn no_edge_of_the_statue_makes_light() {
    let Some(device) = device::device() else {
        return;
    };
    for azimuth in [-140.0, 40.0] {
        for steps in [2, 16] {
            let mut request = Request::statue();
            request.multiple = Method::None;
            request.specular = false;
            request.light.azimuth = azimuth;
            request.single = Single::March(March { steps, ..LINEAR });
            let plan = request.plan().expect("a plan");
            let brightest = device::render(&device, &plan)
                .iter()
                .flat_map(|p| &p[..3])
                .copied()
                .fold(0.0, f32::max);
            // E0 / 4 pi, and less.
            assert!(brightest < 0.25, "lit from {azimuth}, {steps}: {brightest}");
        }
    }
}
