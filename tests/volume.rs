//! Volumes of light: against the sum that they stand for, nothing lost, and the GPU against its twin.

mod common;

use common::device::{self, TestDevice};
use common::media::medium;
use common::random::Random;
use common::shapes;
use glam::{DVec2, DVec3};
use marmor::cpu::volume::{self, Light};
use marmor::cpu::{LightMap, light};
use marmor::frame::{Renderer, Setup, Target};
use marmor::scene::volume::Volumes;
use marmor::scene::{Jitter, LightFrame, Mixture, Multiple, Plan, Taps};
use rayon::prelude::*;

const MIXTURE: Mixture = Mixture {
    volumes: 5,
    ..Mixture::THREE
};

/// A light map of the bumpy sphere of `size` texels a side, its taps in skin, and its volumes.
fn drawn(size: u32) -> (LightMap, Taps, Volumes) {
    let mesh = shapes::bumpy(20.0, 5);
    let to_light = DVec3::new(0.5, 0.6, 0.62).normalize();
    let positions = mesh.positions.iter().copied();
    let frame = LightFrame::fit(positions, to_light, size, DVec2::new(0.3, -0.2));
    let map = light::draw(&mesh, &frame, 1.3);
    let taps = taps(&frame);
    let volumes = taps.volumes.clone().expect("volumes");
    (map, taps, volumes)
}

fn taps(frame: &LightFrame) -> Taps {
    let dipoles = medium("skin1").material().dipoles();
    Taps::new(&dipoles.map(|d| d.resolved(frame.texel)), MIXTURE, frame)
}

/// sum a w e^(-d^2 / (2 s^2)) / (2 pi s^2) at `q`, mm of light space, and what bounds the change by a cell's
/// width squared: the absolute second derivatives along the axes, summed once over the texels, and once texel
/// by texel.
fn brute_force(map: &LightMap, q: DVec3, s: f64) -> [f64; 2] {
    let frame = &map.frame;
    let scale = frame.texel_area() / (2.0 * std::f64::consts::PI * s * s);
    let (mut light, mut second, mut single) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for (i, m) in (0..).zip(&map.moments).filter(|(_, m)| m[0] > 0.0) {
        let uv = frame.texel_center(i % frame.size, i / frame.size);
        let d = uv.extend(m[1] / m[0] * frame.z_half + frame.z_center) - q;
        let value = scale * m[0] * (-0.5 * d.length_squared() / (s * s)).exp();
        light += value;
        let bend = value * (d * d / (s * s) - 1.0) / (s * s);
        second += bend;
        single += bend.abs();
    }
    [light, (second.abs() + single).element_sum()]
}

/// A tap is right but for two ripples, of the tap and of the deposit. A tent spreads a point by x (1 - x) cells
/// squared, x being where it falls between two cells, and 1/6 of that is part of s: what is left, -1/6 to
/// 1/12, changes the light by half as much times its second derivative along each axis.
#[test]
fn a_tap_is_the_sum_over_the_map() {
    let (map, taps, volumes) = drawn(128);
    assert!(volumes.volumes.len() >= 4);
    let made = volume::volumes(&map, &volumes);
    let frame = &map.frame;
    for (i, light) in (taps.first_volume as usize..).zip(&made) {
        let s = taps.widths[i];
        let cell = frame.texel / light.grid.scale;
        // Points on the lit surface, and in the body behind it.
        let mut random = Random(7);
        let texels = map.moments.len();
        let points: Vec<DVec3> = std::iter::repeat_with(|| {
            let texel = (random.uniform() * texels as f64) as usize;
            let behind = (3.0 * random.uniform() - 1.0).max(0.0);
            (
                texel,
                DVec2::new(random.uniform(), random.uniform()),
                behind,
            )
        })
        .filter(|(texel, ..)| map.moments[*texel][0] > 0.0)
        .map(|(texel, within, behind)| {
            let [w, wz, ..] = map.moments[texel];
            let at = DVec2::new(
                (texel as u32 % frame.size) as f64,
                (texel as u32 / frame.size) as f64,
            );
            let z = (wz / w * frame.z_half + behind * s).min(frame.z_half);
            (frame.origin + (at + within) * frame.texel).extend(frame.z_center + z)
        })
        .take(400)
        .collect();
        let found: Vec<[f64; 3]> = points
            .par_iter()
            .map(|&q| {
                let st = frame.to_texel(q.truncate());
                let depth = (q.z - frame.z_center) / frame.texel;
                let tap = light.tap(light.grid.place(st.extend(depth)));
                let [truth, second] = brute_force(&map, q, s);
                [tap, truth, second]
            })
            .collect();
        let most = found.iter().fold(0.0_f64, |most, f| most.max(f[1]));
        let (mut squares, mut sum) = (0.0, 0.0);
        for [tap, truth, second] in found {
            let allowed = cell * cell / 12.0 * second + 0.002 * most;
            assert!(
                (tap - truth).abs() <= allowed,
                "level {i}, cells of {:.2} s: {tap} for {truth}, allowed {allowed}",
                cell / s
            );
            squares += (tap - truth).powi(2);
            sum += truth * truth;
        }
        // In the mean: 0.037 cell^2, the deviation of x (1 - x) / 2, times f'' = V / s^2 along one axis, twice.
        let rr = (squares / sum).sqrt();
        let bound = 0.053 * (cell / s).powi(2);
        eprintln!(
            "level {i}, cells of {:.2} s: rr {rr:.4}, {bound:.4}",
            cell / s
        );
        assert!(
            rr < bound,
            "level {i}, cells of {:.2} s: rr {rr:.4}, {bound:.4}",
            cell / s
        );
    }
}

#[test]
fn no_light_is_lost_in_the_grids() {
    for size in [33, 37, 128, 201] {
        let (map, _, volumes) = drawn(size);
        let light: f64 = map.moments.iter().map(|m| m[0]).sum();
        let mut grids: Vec<Light> = Vec::new();
        for grid in &volumes.grids {
            grids.push(match grids.last() {
                None => volume::deposit(&map, grid),
                Some(finer) => volume::halve(finer, grid),
            });
        }
        // Halving takes means of eight cells, so that a cell of each grid holds an eighth.
        for (i, grid) in (0..).zip(&grids) {
            let kept = grid.total() * 8_f64.powi(i) / light;
            assert!((kept - 1.0).abs() < 1e-9, "{size}, grid {i}: {kept}");
        }
    }
}

fn plan(light_map: u32, mixture: Mixture) -> Plan {
    let mut plan = device::plan(
        shapes::bumpy(20.0, 5),
        medium("skin1").material(),
        [60.0, 35.0],
        [20.0, 10.0],
        [40, 30],
        Multiple::Mixture(mixture),
    );
    plan.light_map = light_map;
    plan.jitter = Jitter::All;
    plan
}

/// What the GPU has made of its own light map, against the twin's, in frame `index`.
fn compare(device: &TestDevice, light_map: u32, mixture: Mixture, index: u32) {
    let what = format!("{light_map}, {mixture}, frame {index}");
    let plan = plan(light_map, mixture);
    let mut renderer = Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
    // Frames before it, whose light must be gone.
    renderer
        .render_frames(0..index + 1, &mut |_| ())
        .expect("frames");
    let frame = renderer.light_frame(index);
    let volumes = plan.taps(mixture, &frame).volumes.expect("volumes");
    let map = LightMap {
        frame,
        ..device::light_map(&mut renderer)
    };
    let gpu = renderer.read(Target::Volumes).expect("the volumes");
    let [columns, rows, slices] = volumes.image.map(|n| n as usize);
    assert_eq!(gpu.len(), columns * rows * slices);
    let mut inside = vec![false; gpu.len()];
    for (light, volume) in volume::volumes(&map, &volumes).iter().zip(&volumes.volumes) {
        let [x, y, _] = light.grid.size.map(|n| n as usize);
        let origin = volume.origin.map(|at| at as usize);
        let most = light.cells.iter().copied().fold(0.0, f64::max);
        assert!(most > 0.01, "{what}: {most}");
        for (i, twin) in light.cells.iter().enumerate() {
            let at = [
                i % x + origin[0],
                i / x % y + origin[1],
                i / (x * y) + origin[2],
            ];
            let at = (at[2] * rows + at[1]) * columns + at[0];
            inside[at] = true;
            let off = (f64::from(gpu[at][0]) - twin).abs() / most;
            assert!(
                off < 3e-6,
                "{what}: cell {i} is off by {off} of the largest"
            );
        }
    }
    let outside = gpu.iter().zip(inside).filter(|(_, inside)| !inside);
    assert!(
        outside.into_iter().all(|(cell, _)| cell[0] == 0.0),
        "{what}"
    );
}

#[test]
fn the_gpu_makes_the_volumes_of_its_twin() {
    let Some(device) = device::device() else {
        return;
    };
    let second = Mixture {
        level_step: 2,
        volumes: 2,
        ..Mixture::FOUR
    };
    for (light_map, mixture, index) in [
        (128, MIXTURE, 0),
        (37, MIXTURE, 0),
        (201, MIXTURE, 2),
        (300, second, 1),
        (
            64,
            Mixture {
                volumes: 1,
                ..MIXTURE
            },
            1,
        ),
    ] {
        compare(&device, light_map, mixture, index);
    }
}

/// What a plan asks for is what it gets, within its limits.
#[test]
fn the_coarsest_levels_read_volumes() {
    let taps = |light_map, mixture| {
        plan(light_map, mixture).taps(mixture, &plan(light_map, mixture).light_frame())
    };
    for volumes in 0..=8 {
        let found = taps(
            128,
            Mixture {
                volumes,
                ..Mixture::FOUR
            },
        );
        let wanted = volumes.min(found.levels.count - 1);
        assert_eq!(found.levels.count - found.first_volume, wanted);
        assert_eq!(found.volumes.is_some(), wanted > 0);
        assert_eq!(found.fourth, 0..found.first_volume);
        assert_eq!(
            found.counts(),
            [
                found.first_volume + wanted.min(2),
                found.first_volume,
                wanted
            ]
        );
    }
    // Eight volumes of so dense a medium would have too many cells.
    let mixture = Mixture {
        volumes: 8,
        ..MIXTURE
    };
    let frame = plan(2048, mixture).light_frame();
    let dense = medium("cream").material().dipoles();
    let found = Taps::new(&dense.map(|d| d.resolved(frame.texel)), mixture, &frame);
    let cells = found.volumes.as_ref().expect("volumes").cells();
    assert!(cells > 100_000 && found.first_volume > 1, "{cells}");
    assert!(found.counts()[2] < 8, "{:?}", found.counts());
}
