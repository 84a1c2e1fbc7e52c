//! The window on the device: pictures and panels against their twins, averages that grow frame by frame, and plans that a
//! renderer takes over.

mod common;

use common::device::device;
use glam::DVec3;
use marmor::cpu::compose::{self, Composed};
use marmor::cpu::resolve::encode_srgb;
use marmor::frame::panel::{Panel, Texels, Triangles, Vertex};
use marmor::frame::{Renderer, Setup, Window, compose_alone};
use marmor::scene::{Bundled, MeshSource, Method, Plan, Request, Scattering, Single};
use std::sync::Arc;

/// Linear RGB of a pixel as bytes.
fn bytes(linear: [f64; 3]) -> [u8; 3] {
    linear.map(|x| (255.0 * encode_srgb(x)).round() as u8)
}

/// The largest difference of a channel between what is shown and what should be.
fn worst(shown: &[[u8; 4]], width: usize, expected: impl Fn([usize; 2]) -> [u8; 3]) -> u8 {
    let differences = shown.iter().enumerate().flat_map(|(i, pixel)| {
        assert_eq!(pixel[3], 255, "a window is opaque");
        let expected = expected([i % width, i / width]);
        (0..3).map(move |c| pixel[c].abs_diff(expected[c]))
    });
    differences.max().expect("pixels")
}

/// Every byte in every channel.
fn ramp() -> Vec<[u8; 4]> {
    (0..=255).map(|i| [i, 255 - i, i ^ 0x55, 255]).collect()
}

#[test]
fn a_picture_comes_to_the_window_byte_for_byte() {
    let Some(test) = device() else { return };
    let picture = ramp();
    for encodes in [true, false] {
        let window = Window {
            size: [20, 22],
            encodes,
            picture: ([16, 16], &picture),
            place: [3, 4, 16, 16],
            backdrop: [0.25; 3],
            panel: &Panel::default(),
        };
        let shown = compose_alone(&test.device, &window).expect("a window");
        let twin = Composed {
            size: [16, 16],
            picture: &picture,
            place: window.place,
            backdrop: [0.25; 3],
        };
        let worst = worst(&shown, 20, |at| bytes(twin.at(at)));
        assert_eq!(worst, 0, "a format that encodes: {encodes}");
    }
}

#[test]
fn a_picture_of_another_size_is_read_between_its_pixels() {
    let Some(test) = device() else { return };
    // Coverage that varies: the backdrop is mixed in as light.
    let picture: Vec<[u8; 4]> = ramp()
        .iter()
        .enumerate()
        .map(|(i, &[r, g, b, _])| [r, g, b, (i * 37 % 256) as u8])
        .collect();
    for (encodes, place) in [
        (true, [5, 2, 41, 29]),
        (false, [5, 2, 41, 29]),
        // Larger than the window on all sides.
        (true, [-7, -9, 80, 70]),
    ] {
        let window = Window {
            size: [50, 40],
            encodes,
            picture: ([16, 16], &picture),
            place,
            backdrop: [0.02, 0.3, 0.9],
            panel: &Panel::default(),
        };
        let shown = compose_alone(&test.device, &window).expect("a window");
        let twin = Composed {
            size: [16, 16],
            picture: &picture,
            place,
            backdrop: [0.02, 0.3, 0.9],
        };
        // Shares between texels have 8 bits on common hardware, which neighbouring bytes can make 255 / 512 of a byte
        // each way, before sRGB stretches the dark.
        let worst = worst(&shown, 50, |at| bytes(twin.at(at)));
        assert!(worst <= 3, "{worst} at {place:?}, encodes: {encodes}");
    }
}

/// A rectangle of one colour, as two triangles.
fn rectangle([x, y, width, height]: [f32; 4], color: [u8; 4], texture: u64) -> Triangles {
    let corner = |x, y, u, v| Vertex {
        position: [x, y],
        place: [u, v],
        color,
    };
    Triangles {
        clip: [0, 0, 64, 48],
        texture,
        vertices: vec![
            corner(x, y, 0.0, 0.0),
            corner(x + width, y, 1.0, 0.0),
            corner(x, y + height, 0.0, 1.0),
            corner(x + width, y + height, 1.0, 1.0),
        ],
        indices: vec![0, 1, 2, 2, 1, 3],
    }
}

#[test]
fn a_panel_is_drawn_over_the_picture() {
    let Some(test) = device() else { return };
    let white = Texels {
        texture: 7,
        origin: None,
        size: [4, 4],
        texels: vec![[255; 4]; 16],
        smooth: false,
    };
    // One texel is made another later: red.
    let part = Texels {
        texture: 7,
        origin: Some([2, 1]),
        size: [1, 1],
        texels: vec![[255, 0, 0, 255]],
        ..white.clone()
    };
    let colors = [[40, 60, 90, 255], [100, 20, 30, 128], [200, 210, 220, 240]];
    let mut clipped = rectangle([40.0, 20.0, 16.0, 16.0], colors[2], 7);
    clipped.clip = [44, 24, 8, 4];
    let panel = Panel {
        scale: 2.0,
        new: vec![white, part],
        triangles: vec![
            rectangle([2.0, 1.0, 4.0, 4.0], colors[0], 7),
            rectangle([10.0, 3.0, 8.0, 8.0], colors[1], 7),
            clipped,
            // Of a texture that nobody made: left out.
            rectangle([0.0, 0.0, 32.0, 24.0], [255; 4], 8),
        ],
        gone: vec![],
    };
    let picture = [[120, 130, 140, 255]];
    for encodes in [true, false] {
        let window = Window {
            size: [64, 48],
            encodes,
            picture: ([1, 1], &picture),
            place: [0, 0, 64, 48],
            backdrop: [0.0; 3],
            panel: &panel,
        };
        let shown = compose_alone(&test.device, &window).expect("a window");
        let below = Composed {
            size: [1, 1],
            picture: &picture,
            place: window.place,
            backdrop: [0.0; 3],
        };
        // Where each lies in pixels, two a point; the clipped one reaches from (80, 40), outside the window.
        let places = [[4, 2, 8, 8], [20, 6, 16, 16]];
        let expected = |[x, y]: [usize; 2]| {
            let mut light = below.at([x, y]);
            for ([left, top, width, height], color) in places.into_iter().zip(colors) {
                if (left..left + width).contains(&x) && (top..top + height).contains(&y) {
                    let texel = [(x - left) * 4 / width, (y - top) * 4 / height];
                    let mut color = color.map(|byte| f64::from(byte) / 255.0);
                    if texel == [2, 1] {
                        (color[1], color[2]) = (0.0, 0.0);
                    }
                    light = compose::panel(light, color, encodes);
                }
            }
            bytes(light)
        };
        let worst = worst(&shown, 64, expected);
        assert!(worst <= 1, "{worst}, encodes: {encodes}");
    }
}

fn plan(change: impl FnOnce(&mut Request)) -> Plan {
    let mut request = Request::of_mesh("test".to_owned(), MeshSource::Bundled(Bundled::Statue1k));
    request.size = [64, 48];
    request.light_map = 64;
    request.multiple = Method::Mixture;
    request.frames_averaged = Some(5);
    change(&mut request);
    request.plan().expect("a plan")
}

fn rendered(device: &Arc<marmor::gpu::Device>, plan: &Plan) -> (Vec<[f32; 4]>, Vec<[u8; 4]>) {
    let mut renderer = Renderer::new(device, plan, &Setup::default()).expect("a renderer");
    renderer.render(&mut |_| ()).expect("a picture");
    let radiance = renderer.radiance().expect("radiance");
    (radiance, renderer.display().expect("bytes"))
}

/// The viewer's average, frame by frame and read back in between, is that of `render`.
#[test]
fn an_average_grows_to_the_picture_of_render() {
    let Some(test) = device() else { return };
    for change in [
        (|_| ()) as fn(&mut Request),
        |request| request.multiple = Method::Samples,
        |request| request.scattering = Scattering::Half,
        |request| request.split = Some(Method::Brdf),
        |request| request.frames_averaged = Some(1),
    ] {
        let plan = plan(change);
        let truth = rendered(&test.device, &plan);
        let mut renderer = Renderer::new(&test.device, &plan, &Setup::default()).expect("one");
        // Twice: the second average begins where the first has left everything.
        for reads in [false, true] {
            for index in 0..plan.frames_averaged {
                renderer.accumulate(index).expect("a frame");
                if reads {
                    renderer.read_mean(index).expect("a mean");
                }
            }
            renderer
                .read_mean(plan.frames_averaged - 1)
                .expect("a mean");
            let grown = (
                renderer.radiance().expect("radiance"),
                renderer.display().expect("bytes"),
            );
            assert!(grown == truth, "{}, read between: {reads}", plan.multiple);
        }
    }
}

/// What one renderer leaves of pipelines the next one takes, whatever its size, and draws as if it were the first.
#[test]
fn renderers_share_their_pipelines() {
    type Change = fn(&mut Request);
    let turns: [Change; 7] = [
        |_| (),
        |request| request.size = [31, 52],
        |request| request.multiple = Method::Samples,
        |request| request.scattering = Scattering::Half,
        |request| request.split = Some(Method::Brdf),
        |request| request.moments = 4,
        |request| request.mesh = MeshSource::Bundled(Bundled::Betta),
    ];
    // Each the first of its device.
    let mut first = Vec::new();
    for change in turns {
        let Some(test) = device() else { return };
        let none = test.device.tally().pipelines;
        first.push(rendered(&test.device, &plan(change)));
        assert!(test.device.tally().pipelines > none + 5, "it makes its own");
    }
    let Some(test) = device() else { return };
    let live = Setup {
        live: true,
        ..Setup::default()
    };
    // All of them are more than are kept, so that in the second round some are made again.
    for round in 0..2 {
        for (turn, change) in turns.into_iter().enumerate() {
            let plan = plan(change);
            let moving = Plan {
                frames_averaged: 1,
                ..plan.clone()
            };
            // Its surface pass writes motion, too: another render pass, of which it shares no pipeline.
            let mut moving = Renderer::new(&test.device, &moving, &live).expect("a live one");
            moving.draw_live(0, true).expect("a frame");
            let before = test.device.tally().pipelines;
            let drawn = rendered(&test.device, &plan);
            assert!(drawn == first[turn], "round {round}, turn {turn}");
            if turn == 1 {
                assert_eq!(test.device.tally().pipelines, before, "for its size alone");
            }
        }
    }
    let there_and_back = || {
        for turn in [0, 2, 1] {
            rendered(&test.device, &plan(turns[turn]));
        }
        test.device.tally().pipelines
    };
    assert_eq!(there_and_back(), there_and_back());
}

/// A renderer that takes a plan over draws it as one that was made for it.
#[test]
fn a_plan_that_is_adopted_is_drawn_as_any_other() {
    let Some(test) = device() else { return };
    let betta = |request: &mut Request| request.mesh = MeshSource::Bundled(Bundled::Betta);
    type Change = fn(&mut Request);
    let serves: [(&str, Change); 9] = [
        ("exposure", |request| request.exposure = 2.0),
        ("background", |request| {
            request.background = Some([0.1, 0.2, 0.3])
        }),
        ("absorption", |request| {
            request.material.sigma_a = DVec3::new(0.01, 0.02, 0.2)
        }),
        ("index", |request| request.material.eta = 1.7),
        ("light", |request| request.light.azimuth += 3.0),
        ("irradiance", |request| request.light.irradiance = 7.0),
        ("camera", |request| request.fov = 25.0),
        ("phase function", |request| request.material.g = 0.4),
        ("roughness", |request| request.material.roughness = 0.1),
    ];
    for moves in [false, true] {
        let of = |change: Change| {
            plan(|request| {
                if moves {
                    betta(request);
                }
                change(request);
            })
        };
        let own = of(|_| ());
        let mut renderer = Renderer::new(&test.device, &own, &Setup::default()).expect("one");
        renderer.render(&mut |_| ()).expect("a picture");
        let mut adopted = 0;
        for (what, change) in serves {
            let plan = of(change);
            let before = test.device.tally();
            if !renderer.adopt(&plan) {
                continue;
            }
            adopted += 1;
            assert_eq!(test.device.tally(), before, "{what}: nothing is made");
            renderer.render(&mut |_| ()).expect("a picture");
            let drawn = (
                renderer.radiance().expect("radiance"),
                renderer.display().expect("bytes"),
            );
            assert!(
                drawn == rendered(&test.device, &plan),
                "{what}, moves: {moves}"
            );
        }
        // Light and index may change which levels are read.
        assert!(adopted >= 7, "{adopted} of {} were adopted", serves.len());
    }
}

#[test]
fn a_plan_that_needs_something_new_is_not_adopted() {
    let Some(test) = device() else { return };
    let own = plan(|_| ());
    let mut renderer = Renderer::new(&test.device, &own, &Setup::default()).expect("one");
    type Change = fn(&mut Request);
    let others: [(&str, Change); 9] = [
        ("mesh", |request| {
            request.mesh = MeshSource::Bundled(Bundled::Betta)
        }),
        ("unit", |request| request.unit = 2.0),
        ("size", |request| request.size = [64, 50]),
        ("light map", |request| request.light_map = 128),
        ("method", |request| request.multiple = Method::Samples),
        ("split", |request| request.split = Some(Method::Brdf)),
        ("moments", |request| request.moments = 4),
        ("single", |request| request.single = Single::Off),
        ("specular", |request| request.specular = false),
    ];
    for (what, change) in others {
        assert!(!renderer.adopt(&plan(change)), "{what}");
    }
    // And it goes on as before.
    renderer.render(&mut |_| ()).expect("a picture");
    let display = renderer.display().expect("bytes");
    assert!(display == rendered(&test.device, &own).1);
}

/// A divider that moves makes nothing anew.
#[test]
fn a_divider_is_adopted() {
    let Some(test) = device() else { return };
    let at = |share: f64| {
        plan(|request| {
            request.split = Some(Method::Brdf);
            request.split_at = share;
        })
    };
    let mut renderer = Renderer::new(&test.device, &at(0.5), &Setup::default()).expect("one");
    for share in [0.3, 0.71] {
        assert!(renderer.adopt(&at(share)));
        renderer.render(&mut |_| ()).expect("a picture");
        let display = renderer.display().expect("bytes");
        assert!(display == rendered(&test.device, &at(share)).1, "{share}");
    }
}
