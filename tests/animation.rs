//! What moves: the deform pass against its twin, frames that depend on their number alone, and a frame loop that makes
//! nothing.

mod common;

use std::path::Path;
use std::process::Output;
use std::sync::Arc;

use common::device::{TestDevice, device};
use glam::{DAffine3, DQuat, DVec3};
use marmor::cpu::deform::deform;
use marmor::frame::{Renderer, Setup};
use marmor::scene::clip::{Channel, Clip, Interpolation, Values};
use marmor::scene::deformer::{Deformer, Kind};
use marmor::scene::keys::{Ease, Track};
use marmor::scene::model::{Joint, Local, Node, Parts, Rig};
use marmor::scene::{Bundled, Mesh, MeshSource, Method, Model, Motion, Plan, Request, Scattering};

/// How far a vertex of the device may lie from its twin, over the radius of the model: a few digits of float32.
const TOLERANCE: f64 = 2e-6;

/// A tube along y with closed ends, whose vertices follow `influences` of six joints in a row, and of which two morph
/// targets widen the middle and tilt the top.
fn tube(influences: usize) -> Model {
    let (rings, sides) = (24, 16);
    let mut mesh = Mesh::default();
    for ring in 0..=rings {
        for side in 0..sides {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            let height = 60.0 * f64::from(ring) / f64::from(rings);
            let wide = 8.0 + 2.0 * (0.2 * height).sin();
            mesh.positions
                .push(DVec3::new(wide * angle.cos(), height, wide * angle.sin()));
        }
    }
    let at = |ring: u32, side: u32| ring * sides as u32 + side % sides as u32;
    for ring in 0..rings as u32 {
        for side in 0..sides as u32 {
            let (a, b) = (at(ring, side), at(ring, side + 1));
            let (c, d) = (at(ring + 1, side), at(ring + 1, side + 1));
            mesh.triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    for side in 1..sides as u32 - 1 {
        mesh.triangles
            .push([at(0, 0), at(0, side), at(0, side + 1)]);
        let top = rings as u32;
        mesh.triangles
            .push([at(top, 0), at(top, side + 1), at(top, side)]);
    }
    mesh.uvs = vec![[0.0; 2]; mesh.positions.len()];
    mesh.complete_normals();

    let mut rig = Rig {
        influences,
        ..Rig::default()
    };
    for p in &mesh.positions {
        let weights: Vec<f64> = (0..6)
            .map(|j| (-((p.y - 12.0 * f64::from(j)) / 9.0).powi(2)).exp())
            .collect();
        let mut order: Vec<usize> = (0..6).collect();
        order.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]));
        order.truncate(influences.min(6));
        let sum: f64 = order.iter().map(|&j| weights[j]).sum();
        for slot in 0..influences {
            let joint = order.get(slot).copied();
            rig.vertex_joints.push(joint.unwrap_or(0) as u16);
            rig.vertex_weights
                .push(joint.map_or(0.0, |j| (weights[j] / sum) as f32));
        }
        let middle = (-((p.y - 30.0) / 12.0).powi(2)).exp();
        rig.vertex_morphs.push([rig.morphs.len() as u32, 0, 2]);
        let out = DVec3::new(p.x, 0.0, p.z).normalize_or_zero();
        rig.morphs
            .push([4.0 * middle * out, 0.2 * middle * DVec3::Y]);
        rig.morphs.push([DVec3::X * 0.003 * p.y * p.y, DVec3::ZERO]);
    }
    for joint in 0..6 {
        let (step, bottom) = (12.0 * DVec3::Y, joint == 0);
        rig.nodes.push(Node {
            name: format!("joint {joint}"),
            parent: (!bottom).then(|| joint - 1),
            local: Local::Parts(Parts {
                translation: if bottom { DVec3::ZERO } else { step },
                ..Parts::default()
            }),
            first_weight: 0,
            weights: if bottom { vec![0.0; 2] } else { Vec::new() },
        });
        rig.joints.push(Joint {
            node: joint,
            inverse_bind: DAffine3::from_translation(-step * joint as f64),
        });
    }
    let times = vec![0.0, 0.4, 1.0];
    let turn = |x: f64, z: f64| DQuat::from_euler(glam::EulerRot::XYZ, x, 0.3 * x, z);
    let mut channels: Vec<Channel> = (0..6)
        .map(|node| Channel {
            node,
            times: times.clone(),
            interpolation: Interpolation::Linear,
            values: Values::Rotation(vec![
                turn(0.0, 0.0),
                turn(0.3, 0.2 - 0.1 * node as f64),
                turn(0.0, 0.0),
            ]),
        })
        .collect();
    channels.push(Channel {
        node: 3,
        times: times.clone(),
        interpolation: Interpolation::Linear,
        values: Values::Scale(vec![DVec3::ONE, DVec3::new(1.5, 0.8, 0.6), DVec3::ONE]),
    });
    channels.push(Channel {
        node: 0,
        times,
        interpolation: Interpolation::Linear,
        values: Values::Weights(vec![0.0, 0.0, 1.0, -0.5, 0.0, 0.0]),
    });
    rig.clips.push(Clip {
        name: "sway".to_owned(),
        duration: 1.0,
        channels,
    });
    Model {
        shapes: vec![mesh],
        rig: Some(rig),
        base_color: None,
    }
}

/// One deformer of every kind.
fn deformers() -> Vec<Deformer> {
    let of = |kind, amplitude, period| Deformer {
        kind,
        axis: DVec3::new(0.1, 1.0, 0.2),
        towards: matches!(kind, Kind::Bend | Kind::Wave).then_some(DVec3::X),
        amplitude,
        period,
        phase: 0.15,
        wavelength: (kind == Kind::Wave).then_some(25.0),
    };
    vec![
        of(Kind::Breathe, 0.3, 1.0),
        of(Kind::Twist, 60.0, 0.5),
        of(Kind::Bend, 50.0, 1.0),
        of(Kind::Wave, 2.0, 0.25),
    ]
}

/// A request for a small picture of what `model` is put into later.
fn request() -> Request {
    let mut request = Request::of_mesh("test".to_owned(), MeshSource::Bundled(Bundled::Statue1k));
    request.size = [48, 40];
    request.light_map = 128;
    request.multiple = Method::Mixture;
    request.animation.fps = 10.0;
    request
}

fn plan_of(model: &Model, request: &Request) -> (Plan, Arc<Motion>) {
    let plan = request
        .plan_of(&std::sync::Arc::new(model.clone()))
        .expect("a plan");
    let motion = plan.motion.clone().expect("a motion");
    (plan, motion)
}

/// The largest distance of a vertex from its twin over the radius, and of a normal, over every frame of the loop.
fn worst(device: &TestDevice, plan: &Plan, motion: &Arc<Motion>) -> [f64; 2] {
    let mut renderer = Renderer::new(&device.device, plan, &Setup::default()).expect("a renderer");
    let mut worst = [0.0_f64; 2];
    for number in 0..motion.frames {
        let moment = motion.moment(motion.time(number), plan.light_map);
        renderer.show(&moment);
        renderer.render(&mut |_| ()).expect("a frame");
        let twin = deform(&motion.model, &moment.pose, motion.center);
        let vertices = renderer.vertices().expect("vertices");
        assert!(vertices.len() >= twin.positions.len());
        for ((p, n), v) in twin.positions.iter().zip(&twin.normals).zip(&vertices) {
            let at = DVec3::new(v[0].into(), v[1].into(), v[2].into());
            let normal = DVec3::new(v[3].into(), v[4].into(), v[5].into());
            worst[0] = worst[0].max(at.distance(*p) / motion.radius);
            worst[1] = worst[1].max(normal.distance(*n));
        }
        // Nothing lies outside the map, and depths are within their range.
        let frame = &moment.light_frame;
        for p in &twin.positions {
            let q = frame.to_light_space(*p);
            let texel = frame.to_texel(q.truncate());
            let inside =
                texel.min_element() > 1.0 && texel.max_element() < f64::from(frame.size) - 1.0;
            assert!(inside, "{texel} in frame {number}");
            assert!((q.z - frame.z_center).abs() <= frame.z_half * (1.0 + 1e-12));
        }
    }
    worst
}

/// Every frame of the loop is that of the twin.
fn agree(name: &str, device: &TestDevice, plan: &Plan, motion: &Arc<Motion>) {
    let [positions, normals] = worst(device, plan, motion);
    println!(
        "{name}: {positions:.1e} of the radius, normals {normals:.1e}, {} frames",
        motion.frames
    );
    assert!(positions < TOLERANCE, "{name}: {positions}");
    // A unit vector has no size to be relative to.
    assert!(normals < 1e-4, "{name}: normals {normals}");
}

#[test]
fn deformed_vertices_are_those_of_the_twin() {
    let Some(device) = device() else { return };
    let still = Model::of(Bundled::Statue1k.mesh().expect("the statue"));
    for (name, model, bends) in [
        ("4 weights", tube(4), Vec::new()),
        ("8 weights", tube(8), Vec::new()),
        ("8 weights, bent", tube(8), deformers()),
        ("bent", still, deformers()),
    ] {
        let mut request = request();
        request.animation.deformers = bends;
        let (plan, motion) = plan_of(&model, &request);
        agree(name, &device, &plan, &motion);
        assert!(motion.frames >= 10, "{name}");
    }
}

/// Every frame of both clips of the betta: skinned and morphed, 24 frames a second.
#[test]
fn the_betta_deforms_as_its_twin() {
    let Some(device) = device() else { return };
    let model = Bundled::Betta.load().expect("the betta");
    for clip in ["swim", "hover"] {
        let mut request = request();
        request.animation.clip = Some(clip.to_owned());
        request.animation.fps = 24.0;
        let (plan, motion) = plan_of(&model, &request);
        agree(clip, &device, &plan, &motion);
        assert!(motion.frames >= 48, "{clip}");
        // It moves, and all of it stays a solid.
        let meshes = [0, motion.frames / 3].map(|n| motion.mesh(motion.time(n)));
        let pairs = meshes[0].positions.iter().zip(&meshes[1].positions);
        let furthest = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(furthest > 2.0, "{clip}: {furthest} mm");
        assert!(meshes.iter().all(Mesh::is_solid), "{clip}");
    }
}

/// Far from the origin float32 has no digits to spare: positions at rest are relative to their middle.
#[test]
fn a_mesh_far_off_deforms_as_well() {
    let Some(device) = device() else { return };
    let mut model = tube(4);
    let far = DVec3::new(3e4, -2e4, 5e4);
    model.shapes[0].positions.iter_mut().for_each(|p| *p += far);
    if let Some(rig) = &mut model.rig {
        for joint in &mut rig.joints {
            joint.inverse_bind *= DAffine3::from_translation(-far);
        }
        if let Local::Parts(parts) = &mut rig.nodes[0].local {
            parts.translation = far;
        }
    }
    let (plan, motion) = plan_of(&model, &request());
    agree("far off", &device, &plan, &motion);
}

/// Shapes of different triangles, one after the other.
#[test]
fn a_sequence_may_change_its_topology() {
    let Some(device) = device() else { return };
    let coarse = Bundled::Statue1k.mesh().expect("the statue");
    let finer = Bundled::Statue5k.mesh().expect("the statue");
    let model = Model {
        shapes: vec![coarse.clone(), finer.clone(), coarse],
        ..Model::default()
    };
    let (plan, motion) = plan_of(&model, &request());
    assert_eq!(motion.frames, 3);
    agree("sequence", &device, &plan, &motion);
    // What is drawn of the second is what the second alone draws.
    let mut still = plan.at(motion.time(1));
    let mut renderer = Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
    renderer.show(&motion.moment(motion.time(1), plan.light_map));
    renderer.render(&mut |_| ()).expect("a frame");
    let moving = renderer.radiance().expect("radiance");
    still.scene.mesh = finer;
    let covered = |pixels: &[[f32; 4]]| pixels.iter().filter(|p| p[3] > 0.0).count();
    let mut renderer =
        Renderer::new(&device.device, &still, &Setup::default()).expect("a renderer");
    renderer.render(&mut |_| ()).expect("a frame");
    let alone = renderer.radiance().expect("radiance");
    assert!(covered(&alone) > 100);
    let differing = moving.iter().zip(&alone).filter(|(a, b)| {
        let pairs = a.iter().zip(b.iter());
        pairs.into_iter().any(|(a, b)| (a - b).abs() > 1e-3)
    });
    assert_eq!(differing.count(), 0);
}

/// After the first frame nothing is allocated and no pipeline made, whatever moves.
#[test]
fn a_frame_loop_makes_nothing() {
    let Some(device) = device() else { return };
    let sequence = Model {
        shapes: [Bundled::Statue1k, Bundled::Statue5k, Bundled::Statue1k]
            .map(|mesh| mesh.mesh().expect("the statue"))
            .to_vec(),
        ..Model::default()
    };
    let mut rows: Vec<(&str, Model, Request)> = Vec::new();
    for (name, method, volumes) in [
        ("mixture", Method::Mixture, 0),
        ("mixture with volumes", Method::Mixture, 3),
        ("rings", Method::Rings, 0),
        ("samples", Method::Samples, 0),
        ("exact", Method::Exact, 0),
    ] {
        let mut request = request();
        (request.multiple, request.volumes) = (method, volumes);
        request.animation.deformers = deformers();
        rows.push((name, tube(8), request));
    }
    let mut half = request();
    half.scattering = Scattering::Half;
    rows.push(("half", tube(4), half));
    rows.push(("sequence", sequence, request()));
    for (name, model, mut request) in rows {
        request.animation.light_turns = 1.0;
        request.animation.camera_turns = -1.0;
        request.frames_averaged = Some(3);
        if request.multiple == Method::Exact {
            (request.size, request.light_map) = ([16, 16], 32);
        }
        let (plan, motion) = plan_of(&model, &request);
        let mut renderer =
            Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
        let mut draw = |number| {
            renderer.show(&motion.moment(motion.time(number), plan.light_map));
            renderer.render(&mut |_| ()).expect("a frame");
        };
        draw(0);
        let (tally, bytes) = (device.device.tally(), device.device.bytes_in_use());
        assert!(
            tally.allocations > 5 && tally.pipelines > 5 && bytes > 0,
            "{name}: {tally:?}"
        );
        (1..motion.frames).for_each(&mut draw);
        assert_eq!(
            device.device.tally(),
            tally,
            "{name}: allocations and pipelines"
        );
        assert_eq!(device.device.bytes_in_use(), bytes, "{name}");
    }
}

/// An instant beyond the loop is one within it, and the last keyframe holds to the end of the loop.
#[test]
fn instants_repeat_with_the_loop() {
    let mut request = request();
    request.animation.duration = Some(2.0);
    request.animation.camera_turns = 1.0;
    request.animation.light_keys = Some(Track {
        times: vec![0.0, 1.0],
        values: vec![
            [0.0, 10.0, 1.0, 1.0, 1.0, 1.0],
            [90.0, 50.0, 3.0, 1.0, 0.5, 0.0],
        ],
        ease: Ease::Linear,
    });
    let mut scene = |time: f64| {
        request.time = Some(time);
        request.plan().expect("a plan").scene
    };
    let (early, late) = (scene(0.5), scene(1.5));
    assert_eq!((early.light.azimuth, early.light.irradiance), (45.0, 2.0));
    assert_eq!((late.light.azimuth, late.light.irradiance), (90.0, 3.0));
    for turns in [1.0, 3.0] {
        assert_eq!(scene(0.5 + 2.0 * turns), early);
        assert_eq!(scene(1.5 + 2.0 * turns), late);
    }
    assert!((early.camera.eye - late.camera.eye).length() > 10.0);
}

/// Bytes that the process has in memory.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kib.unwrap_or(0) * 1024
}

/// Memory stays flat, on the host and on the device, while everything moves: 300 frames, or as many as
/// MARMOR_SOAK_FRAMES says (scripts/soak.sh: 10 000).
#[test]
fn memory_stays_flat() {
    let Some(device) = device() else { return };
    let frames = std::env::var("MARMOR_SOAK_FRAMES").ok();
    let frames: u32 = frames.and_then(|n| n.parse().ok()).unwrap_or(300);
    let model = Bundled::Betta.load().expect("the betta");
    let mut request = request();
    request.animation.deformers = deformers();
    request.animation.light_turns = 3.0;
    request.animation.camera_turns = -1.0;
    request.animation.fps = 24.0;
    request.frames_averaged = Some(1);
    let (plan, motion) = plan_of(&model, &request);
    let mut renderer = Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
    let mut draw = |number| {
        renderer.show(&motion.moment(motion.time(number), plan.light_map));
        renderer.render(&mut |_| ()).expect("a frame");
        assert!(
            renderer
                .radiance()
                .expect("radiance")
                .iter()
                .flatten()
                .all(|x| x.is_finite())
        );
    };
    // Caches and pools fill in the first loops.
    let warm = (2 * motion.frames).min(frames / 2);
    (0..warm).for_each(&mut draw);
    let (tally, bytes, host) = (
        device.device.tally(),
        device.device.bytes_in_use(),
        resident(),
    );
    (warm..frames).for_each(&mut draw);
    let grown = resident().saturating_sub(host);
    println!(
        "{frames} frames: {} MiB on the device, host {} MiB + {} KiB",
        bytes >> 20,
        host >> 20,
        grown >> 10
    );
    assert_eq!(device.device.tally(), tally);
    assert_eq!(device.device.bytes_in_use(), bytes);
    // What an allocator keeps for itself; a leak of one matrix a frame would be more in 10 000.
    assert!(
        grown < 8 << 20,
        "the host has grown by {grown} bytes in {} frames",
        frames - warm
    );
}

/// Two instants in one submit, which the synchronisation checker sees together.
#[test]
fn instants_do_not_race_with_each_other() {
    let Some(device) = device() else { return };
    let mut request = request();
    request.animation.deformers = deformers();
    request.frames_averaged = Some(2);
    let (plan, _) = plan_of(&tube(4), &request);
    let mut renderer = Renderer::new(&device.device, &plan, &Setup::default()).expect("a renderer");
    renderer.render_pair().expect("two frames");
}

/// The light map has one scale, and its grid stays where it is: corners of all frames are whole texels apart.
#[test]
fn the_grid_of_the_light_map_stands_still() {
    let mut request = request();
    request.animation.deformers = deformers();
    let (plan, motion) = plan_of(&tube(4), &request);
    let frames: Vec<_> = (0..motion.frames)
        .map(|n| motion.light_frame(motion.time(n), plan.light_map))
        .collect();
    let first = &frames[0];
    let mut moved = false;
    for frame in &frames {
        assert_eq!((frame.texel, frame.z_half), (first.texel, first.z_half));
        let shift = (frame.origin - first.origin) / first.texel;
        assert!(
            (shift - shift.round()).abs().max_element() < 1e-6,
            "{shift}"
        );
        moved |= shift.length() > 0.5;
    }
    assert!(moved, "the map follows the mesh");
    // No tighter scale would hold every frame: some frame fills the map but for its pad of 5 texels.
    let filled = frames.iter().zip(0..).map(|(frame, n)| {
        let mesh = motion.mesh(motion.time(n));
        let relative = mesh.positions.iter().map(|p| *p - motion.center);
        let [_, half] = marmor::scene::LightFrame::extents(relative, frame.to_light);
        2.0 * half.truncate().max_element() / frame.texel
    });
    let most = filled.fold(0.0, f64::max);
    assert!(
        (most - f64::from(plan.light_map - 5)).abs() < 1e-6,
        "{most}"
    );
}

fn marmor(arguments: &[&str]) -> Output {
    common::program::marmor()
        .args(arguments)
        .output()
        .expect("the program runs")
}

fn done(arguments: &[&str]) {
    let output = marmor(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {stderr}");
}

const SCENE: &str = r#"
mesh = "statue-1k"
size = [40, 32]
[animation]
duration = 0.6
fps = 10
deform = [{ kind = "twist", amplitude = 30, period = 0.6 }]
[animation.light]
turns = 1
[animation.camera]
turns = -1
[method]
multiple = "mixture"
light_map = 64
frames_averaged = 2
"#;

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Frames are the same to the byte in one process and in two, in any order, beyond the end of the loop, and resumed.
#[test]
fn a_frame_depends_on_its_number_alone() {
    if !common::device::present() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("s.toml");
    std::fs::write(&scene, SCENE).expect("written");
    let scene = scene.to_str().expect("a path");
    let path = |name: &str| folder.path().join(name);
    let draw = |frames: &str, to: &str, more: &[&str]| {
        let to = path(to);
        let to = to.to_str().expect("a path");
        let base = ["-q", "animate", scene, "--frames", frames, "-o", to];
        done(&[&base[..], more].concat());
    };
    draw("0..7", "all/%04d.png", &[]);
    draw("3..7", "parts/%04d.png", &[]);
    draw("0..2", "parts/%04d.png", &[]);
    let frames: Vec<Vec<u8>> = (0..8)
        .map(|n| bytes(&path(&format!("all/{n:04}.png"))))
        .collect();
    for (n, frame) in frames.iter().enumerate() {
        assert_eq!(
            *frame,
            bytes(&path(&format!("parts/{n:04}.png"))),
            "frame {n}"
        );
    }
    // Six are a loop, and no two of them alike.
    assert_eq!(frames[0], frames[6]);
    assert_eq!(frames[1], frames[7]);
    assert!((1..6).all(|n| frames[n] != frames[0]));

    // What is whole is kept, what is cut short or of another size is drawn anew.
    let other = path("parts/0001.png");
    let marked = path("parts/0004.png");
    std::fs::write(path("parts/0002.png"), &frames[2][..frames[2].len() / 2]).expect("cut");
    std::fs::copy(path("all/0005.png"), &marked).expect("another frame");
    done(&[
        "-q",
        "render",
        "statue-1k",
        "--size",
        "8x8",
        "-o",
        other.to_str().expect("a path"),
    ]);
    std::fs::remove_file(path("parts/0003.png")).expect("removed");
    draw("0..5", "parts/%04d.png", &["--resume"]);
    for n in [1, 2, 3] {
        assert_eq!(
            frames[n],
            bytes(&path(&format!("parts/{n:04}.png"))),
            "frame {n}"
        );
    }
    assert_eq!(bytes(&marked), frames[5], "a frame that is there is kept");

    // A still is the frame of its instant.
    let still = path("still.png");
    done(&[
        "-q",
        "render",
        scene,
        "--time",
        "0.2",
        "-o",
        still.to_str().expect("a path"),
    ]);
    assert_eq!(bytes(&still), frames[2]);
}

/// Live frames depend on those before, so a range starts 16 frames ahead: it is the same in every run, and near to what the
/// whole loop shows there.
#[test]
fn live_frames_start_warm() {
    if !common::device::present() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("s.toml");
    std::fs::write(&scene, SCENE).expect("written");
    let scene = scene.to_str().expect("a path");
    let path = |name: &str| folder.path().join(name);
    let draw = |frames: &str, to: &str| {
        let to = path(to);
        let to = to.to_str().expect("a path");
        done(&[
            "-q", "animate", scene, "--live", "--frames", frames, "-o", to,
        ]);
    };
    draw("0..4", "a/%04d.png");
    draw("0..4", "b/%04d.png");
    draw("4..4", "c/%04d.png");
    for n in 0..5 {
        let [a, b] = ["a", "b"].map(|run| bytes(&path(&format!("{run}/{n:04}.png"))));
        assert_eq!(a, b, "frame {n}");
    }
    let pixels = |name: &str| image::open(path(name)).expect("a PNG").to_rgba8();
    let to = path("once/%04d.png");
    let once = [
        "--frames",
        "4",
        "--frames-averaged",
        "1",
        "-o",
        to.to_str().expect("a path"),
    ];
    done(&[&["-q", "animate", scene][..], &once].concat());
    let [whole, alone, once] = ["a/0004.png", "c/0004.png", "once/0004.png"].map(pixels);
    let off = |of: &image::RgbaImage| {
        let pairs = whole.iter().zip(of.iter());
        let sum: f64 = pairs.map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
        sum / whole.len() as f64
    };
    // Jitter differs, and what is older than 16 frames; a frame without history is farther off.
    let (alone, once) = (off(&alone), off(&once));
    println!("a range of its own: {alone:.2} of 255 off in the mean, a single frame {once:.2}");
    assert!(alone < 0.8 * once, "{alone} {once}");
}

#[test]
fn quick_looks_hold_every_frame() {
    if !common::device::present() {
        return;
    }
    use image::AnimationDecoder;
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("s.toml");
    std::fs::write(&scene, SCENE).expect("written");
    let scene = scene.to_str().expect("a path");
    for name in ["a.gif", "a.apng"] {
        let path = folder.path().join(name);
        done(&["-q", "animate", scene, "-o", path.to_str().expect("a path")]);
        let file = std::io::BufReader::new(std::fs::File::open(&path).expect("a file"));
        let frames = if name.ends_with("gif") {
            let decoder = image::codecs::gif::GifDecoder::new(file).expect("a GIF");
            decoder.into_frames().collect_frames()
        } else {
            let decoder = image::codecs::png::PngDecoder::new(file).expect("a PNG");
            decoder
                .apng()
                .expect("animated")
                .into_frames()
                .collect_frames()
        };
        let frames = frames.expect("frames");
        assert_eq!(frames.len(), 6, "{name}");
        for frame in &frames {
            assert_eq!(frame.buffer().dimensions(), (40, 32), "{name}");
            assert_eq!(
                frame.delay().numer_denom_ms().0 / frame.delay().numer_denom_ms().1,
                100,
                "{name}"
            );
        }
        assert_ne!(frames[0].buffer(), frames[3].buffer(), "{name}");
    }
}

/// Bad input is one line that names the fault and the remedy, exit code 2, and no file.
#[test]
fn faults_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out/%04d.png");
    let out = out.to_str().expect("a path");
    let scene = folder.path().join("s.toml");
    let path = scene.to_str().expect("a path");
    let faults = |arguments: &[&str], fragments: &[&str]| {
        let output = marmor(arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        for fragment in fragments {
            assert!(stderr.contains(fragment), "{arguments:?}: {stderr}");
        }
        assert!(
            !folder.path().join("out").exists(),
            "{arguments:?} leaves a folder"
        );
    };
    faults(
        &["animate", "statue-1k", "-o", out],
        &["nothing moves", "--turntable"],
    );
    faults(
        &["animate", "statue-1k", "--turntable", "-o", "a.png"],
        &["a.png", "%04d"],
    );
    faults(
        &["animate", "statue-1k", "--turntable", "-o", "a%d%d.png"],
        &["no number", "%04d"],
    );
    faults(
        &["animate", "statue-1k", "--turntable", "-o", "a%d.jpg"],
        &[".png"],
    );
    faults(
        &[
            "animate",
            "statue-1k",
            "--turntable",
            "-o",
            "a.gif",
            "--resume",
        ],
        &["--resume"],
    );
    for (flags, fragment) in [
        (&["--resume"][..], "--resume"),
        (&["--frames-averaged", "4"], "--frames-averaged"),
        (&["--single", "traced"], "--single traced"),
    ] {
        let live = ["animate", "statue-1k", "--turntable", "--live", "-o", out];
        faults(&[&live[..], flags].concat(), &[fragment, "drop"]);
    }
    faults(
        &[
            "animate",
            "statue-1k",
            "--turntable",
            "-o",
            out,
            "--frames",
            "5..3",
        ],
        &["5..3", "3..5"],
    );
    faults(
        &[
            "animate",
            "statue-1k",
            "--turntable",
            "-o",
            out,
            "--frames",
            "-1..3",
        ],
        &["no range"],
    );
    faults(
        &[
            "animate",
            "statue-1k",
            "--turntable",
            "-o",
            out,
            "--time",
            "1",
        ],
        &["--time", "--frames"],
    );
    faults(
        &[
            "animate",
            "statue-1k",
            "--turntable",
            "-o",
            out,
            "--clip",
            "walk",
        ],
        &["no clip is called", "it has no clips"],
    );
    faults(
        &[
            "animate",
            "statue-1k",
            "--turntable",
            "-o",
            out,
            "--duration",
            "1e5",
        ],
        &["frames, more than 10000"],
    );
    faults(
        &["render", "statue-1k", "--time", "1", "-o", "a.png"],
        &["time", "nothing moves"],
    );
    faults(
        &["render", "statue-1k", "--clip", "walk", "-o", "a.png"],
        &["no clip is called", "it has no clips"],
    );
    faults(
        &[
            "animate",
            "statue-1k",
            "--turntable",
            "-o",
            out,
            "--frames",
            "0..4294967295",
        ],
        &["more than 1000000"],
    );
    faults(
        &[
            "animate",
            "statue-1k",
            "--turntable",
            "-o",
            "a.gif",
            "--fps",
            "60",
        ],
        &["a.gif", "at most 50", ".apng"],
    );
    faults(
        &["animate", "gone_%04d.obj", "-o", out],
        &["gone_%04d.obj", "no file of this name"],
    );
    for (text, fragments) in [
        (
            "deform = [{ kind = \"bounce\", amplitude = 1 }]",
            &[":2: ", "kind in [deform]", "twist"][..],
        ),
        (
            "deform = [{ kind = \"twist\" }]",
            &[":2: ", "needs amplitude"],
        ),
        (
            "deform = [{ kind = \"twist\", amplitude = 1, period = 0 }]",
            &["period", "greater than 0"],
        ),
        (
            "deform = [{ kind = \"twist\", amplitude = 1, towards = [1, 0, 0] }]",
            &["towards", "a bend or a wave"],
        ),
        (
            "deform = [{ kind = \"twist\", amplitude = 1, axis = [0, 0, 0] }]",
            &["axis", "a direction"],
        ),
        ("deform = 3", &["array of tables"]),
        (
            "deform = [{ kind = \"bend\", amplitude = 1e30 }]",
            &["amplitude", "3600", "1e30"],
        ),
        (
            "deform = [{ kind = \"wave\", amplitude = 1, wavelength = 1e-4 }]",
            &["wavelength", "thousandth"],
        ),
        ("time = 1e300", &["time", "1000000"]),
        ("fps = 0", &["fps in [animation]", "0.01"]),
        ("duration = nan", &["duration", "NaN"]),
        ("speed = 3", &["unknown key \"speed\"", "[animation]"]),
        ("light = { keys = [] }", &["must hold a keyframe"]),
        ("light = { keys = [{ azimuth = 1 }] }", &["needs time"]),
        (
            "light = { keys = [{ time = 1 }, { time = 1 }] }",
            &["later than"],
        ),
        (
            "light = { keys = [{ time = 1, elevation = 91 }] }",
            &["-90 to 90"],
        ),
        ("light = { interpolation = \"linear\" }", &["without keys"]),
        (
            "light = { keys = [{ time = 1 }], interpolation = \"bezier\" }",
            &["unknown interpolation", "spline"],
        ),
        (
            "camera = { keys = [{ time = 0, distance = 9 }, { time = 1 }] }",
            &["distance in some only"],
        ),
    ] {
        std::fs::write(&scene, format!("[animation]\n{text}\n")).expect("written");
        faults(
            &["animate", path, "-o", out],
            &[&["s.toml"], fragments].concat(),
        );
    }
}
