//! The promise: a request that is written as a scene file is read back as the same request.

mod common;

use common::program::{file, folder, run};
use common::random::Random;
use glam::DVec3;
use marmor::optics::mixture::Fit;
use marmor::scene::deformer::{DEFORMERS_MAX, Kind};
use marmor::scene::keys::{Ease, Track};
use marmor::scene::motion::CameraKeys;
use marmor::scene::{
    Animation, Bundled, Deformer, Exits, Jitter, Light, March, Material, MeshSource, Method,
    Request, Scattering, Single, Viewpoint, bundled, file as scene_file, preset,
};
use std::path::Path;

/// What a file of `request` says, wherever it lies.
fn again(request: &Request) -> Request {
    let text = request.to_toml().expect("a scene that a file can say");
    scene_file::parse(&text, "elsewhere.toml", Path::new("/elsewhere"))
        .unwrap_or_else(|error| panic!("{error} in\n{text}"))
}

fn holds(request: &Request) {
    let found = again(request);
    let text = request.to_toml().expect("a scene");
    assert_eq!(&found, request, "by\n{text}");
}

fn of(mesh: Bundled) -> Request {
    Request::of_mesh(mesh.name().to_owned(), MeshSource::Bundled(mesh))
}

#[test]
fn bundled_scenes_and_meshes() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes");
    let mut scenes = 0;
    for entry in std::fs::read_dir(folder).expect("a folder") {
        holds(&Request::open(&entry.expect("an entry").path()).expect("a scene"));
        scenes += 1;
    }
    assert!(scenes >= 2, "{scenes}");
    for name in bundled::NAMES {
        holds(&Request::open(Path::new(name)).expect("a mesh"));
    }
}

const METHODS: [Method; 6] = [
    Method::None,
    Method::Brdf,
    Method::Samples,
    Method::Rings,
    Method::Mixture,
    Method::Exact,
];

#[test]
fn every_method() {
    for multiple in METHODS {
        for split in [None, Some(Method::Brdf), Some(Method::Exact)] {
            holds(&Request {
                multiple,
                split,
                split_at: 0.1,
                ..Request::statue()
            });
        }
    }
    holds(&Request {
        fetch_budget: Some(16),
        specular: false,
        frames_averaged: Some(3),
        ..Request::statue()
    });
}

/// A preset has its name, whoever reads; and where nobody chose a material, the mesh may.
#[test]
fn materials() {
    let line = |material: &Material, colored_by_mesh| {
        let request = Request {
            material: material.clone(),
            colored_by_mesh,
            ..of(Bundled::Betta)
        };
        holds(&request);
        let text = request.to_toml().expect("a scene");
        let line = text.lines().find(|line| line.starts_with("material"));
        (line.map(str::to_owned), text.contains("[material]"))
    };
    for name in preset::NAMES {
        let mut material = Material::preset(name).expect("a preset");
        let (found, table) = line(&material, false);
        let found = found.expect("a line");
        let expected = format!("material = \"{name}\"");
        assert!(found.starts_with(&expected) && !table, "{found}");
        line(&material, true);
        material.roughness = 0.7;
        line(&material, false);
        line(&material, true);
        material.name = "custom".to_owned();
        line(&material, false);
        material.eta = 1.1 + 0.2;
        line(&material, false);
        // As `--eta` alone leaves it: the mesh still has its colour.
        line(&material, true);
    }
    let default = Material::preset("marble").expect("a preset");
    assert_eq!(line(&default, true), (None, false));
    // A preset in name only is none.
    let mut material = Material::preset("skin1").expect("a preset");
    material.sigma_a.y = 0.25;
    let changed = Request {
        material,
        colored_by_mesh: false,
        ..Request::statue()
    };
    let found = again(&changed).material;
    assert_eq!(found.name, "custom");
    assert_eq!(found.sigma_a, changed.material.sigma_a);
}

fn everything() -> Request {
    let deformer = |kind, towards, wavelength| Deformer {
        kind,
        axis: DVec3::new(0.1, 1.0, 1e-9),
        towards,
        amplitude: 0.1 + 0.2,
        period: 1.0 / 3.0,
        phase: -0.25,
        wavelength,
    };
    let times = vec![0.0, 0.1 + 0.2, 1e-3 + 1.0];
    let track = |k: f64| Track {
        times: times.clone(),
        values: [0.0, 1.0, 2.0].map(|n| [k + n, k / 3.0, n * n]).to_vec(),
        ease: Ease::Spline,
    };
    Request {
        animation: Animation {
            clip: Some("a \"clip\"\nof 'three'\r\nlines \\ \u{1f41f}".to_owned()),
            fps: 1000.0 / 41.0,
            duration: Some(std::f64::consts::E),
            deformers: vec![
                deformer(Kind::Twist, None, None),
                deformer(Kind::Bend, Some(DVec3::X), None),
                deformer(Kind::Breathe, None, None),
                deformer(Kind::Wave, Some(DVec3::Z), Some(1.0 / 7.0)),
            ],
            light_turns: -1.5,
            light_keys: Some(Track {
                times: vec![0.0, 0.7],
                values: vec![[370.0, 89.9, 3.1, 1.0, 0.5, 0.1], [-1.0; 6].map(f64::abs)],
                ease: Ease::Step,
            }),
            camera_turns: 1.0 / 3.0,
            camera_keys: Some(CameraKeys {
                angles: Track {
                    values: vec![[1.0, -2.0, 30.0], [0.3, 4.0, 31.0], [5.0, 6.0, 0.1]],
                    ..track(0.0)
                },
                distance: Some(Track {
                    times: times.clone(),
                    values: vec![[10.0], [1.0 / 3.0], [7.0]],
                    ease: Ease::Spline,
                }),
                target: Some(track(5.0)),
            }),
        },
        time: Some(0.3),
        ..of(Bundled::Betta)
    }
}

#[test]
fn animations() {
    let mut request = everything();
    holds(&request);
    // What a file says of the camera at rest, and keyframes take up.
    request.viewpoint = Viewpoint::Orbit {
        azimuth: 1.0,
        elevation: 2.0,
        distance: Some(3.0),
        target: Some(DVec3::X),
    };
    holds(&request);
    let keys = request.animation.camera_keys.as_mut().expect("keyframes");
    (keys.distance, keys.target) = (None, None);
    // These keyframes fit the object, and so do those that are read back.
    let found = again(&request);
    assert_eq!(found.animation, request.animation);
    request.viewpoint = Viewpoint::Orbit {
        azimuth: 1.0,
        elevation: 2.0,
        distance: None,
        target: None,
    };
    assert_eq!(found, request);
    request.animation.light_keys = None;
    request.animation.camera_turns = 0.0;
    holds(&request);
}

#[test]
fn both_viewpoints() {
    for viewpoint in [
        Viewpoint::Orbit {
            azimuth: -28.1,
            elevation: 90.0,
            distance: Some(0.1),
            target: None,
        },
        Viewpoint::Orbit {
            azimuth: 1e9,
            elevation: -90.0,
            distance: None,
            target: Some(DVec3::new(0.1, 0.2, 0.1 + 0.2)),
        },
        Viewpoint::At {
            eye: DVec3::new(1.0, 2.0, 1.0 / 3.0),
            target: DVec3::ZERO,
            up: DVec3::new(0.0, 1e-3, -1e-3),
        },
    ] {
        holds(&Request {
            viewpoint,
            fov: 0.1 + 0.2,
            ..Request::statue()
        });
    }
}

/// Whatever a mesh is called, and wherever the scene is written.
#[test]
fn paths() {
    let folder = folder();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for name in [
        "plain.obj",
        "with space.obj",
        "a \"quoted\" 'name'.obj",
        "back\\slash\\.obj",
        "two\nlines\tand\u{1}tabs.obj",
        "größe \u{1f41f} \u{202e}.OBJ",
        "'''\"\"\".obj",
        "# no comment = [x].obj",
        "statue.obj",
    ] {
        let path = file(folder.path(), name, triangle);
        holds(&Request::open(&path).expect("a scene"));
    }
    file(folder.path(), "walk_0001.obj", triangle);
    holds(&Request::open(&folder.path().join("walk_%04d.obj")).expect("a sequence"));
    // A relative path is one from here, and reads back as what it stands for.
    let mut relative = Request::open(Path::new("tests/../gone.obj")).expect("a scene");
    let text = relative.to_toml().expect("a scene");
    let here = std::env::current_dir().expect("a folder");
    let path = here.join("tests/../gone.obj");
    assert!(text.contains(path.to_str().expect("UTF-8")), "{text}");
    relative.mesh = MeshSource::File(path);
    assert_eq!(relative.to_toml().expect("a scene"), text);
}

#[test]
fn extreme_numbers() {
    for value in [
        f64::MAX,
        f64::MIN_POSITIVE,
        5e-324,
        1e-5,
        1e16,
        0.1 + 0.2,
        9_007_199_254_740_993.0,
        1.0 / 3.0,
    ] {
        let mut request = everything();
        (request.unit, request.exposure) = (value, value);
        request.light.azimuth = -value;
        request.light.irradiance = value.min(1e30);
        request.viewpoint = Viewpoint::Orbit {
            azimuth: -value,
            elevation: -0.0,
            distance: Some(value),
            target: Some(DVec3::new(value, -value, -0.0)),
        };
        request.animation.light_turns = value;
        request.animation.deformers[2].phase = -value;
        request.background = Some([0.0, value.min(1e6), 1.0]);
        holds(&request);
    }
}

/// Requests at random, within the limits.
struct Dice(Random);

impl Dice {
    fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.0.uniform()
    }

    fn whole(&mut self, from: u32, to: u32) -> u32 {
        self.within(f64::from(from), f64::from(to) + 1.0) as u32
    }

    fn heads(&mut self) -> bool {
        self.0.uniform() < 0.5
    }

    fn pick<T: Clone>(&mut self, of: &[T]) -> T {
        of[self.whole(0, of.len() as u32 - 1) as usize].clone()
    }

    fn maybe<T>(&mut self, make: impl FnOnce(&mut Dice) -> T) -> Option<T> {
        self.heads().then(|| make(self))
    }

    fn vector(&mut self, from: f64, to: f64) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| self.within(from, to)))
    }

    /// Over all magnitudes that a length may have.
    fn length(&mut self) -> f64 {
        10_f64.powf(self.within(-9.0, 9.0))
    }

    fn material(&mut self) -> Material {
        let preset = Material::preset(self.pick(&preset::NAMES)).expect("a preset");
        let roughness = self.within(0.02, 1.0);
        match self.whole(0, 2) {
            0 => preset,
            1 => Material {
                roughness,
                ..preset
            },
            _ => Material {
                name: "custom".to_owned(),
                sigma_s: self.vector(1e-6, 10.0),
                sigma_a: self.vector(0.0, 3.0),
                eta: self.within(1.0, 3.0),
                g: self.within(-0.95, 0.95),
                roughness,
            },
        }
    }

    fn ease(&mut self) -> Ease {
        Ease::named(self.pick(&Ease::NAMES)).expect("a name")
    }

    fn times(&mut self) -> Vec<f64> {
        let mut time = 0.0;
        let count = self.whole(1, 4);
        let mut next = || {
            time += self.within(1e-6, 2.0);
            time
        };
        (0..count).map(|_| next()).collect()
    }

    fn deformer(&mut self) -> Deformer {
        let kind = Kind::named(self.pick(&Kind::NAMES)).expect("a name");
        let turned = matches!(kind, Kind::Bend | Kind::Wave);
        Deformer {
            kind,
            axis: self.vector(0.1, 1.0),
            towards: self.maybe(|d| d.vector(-1.0, 1.0)).filter(|_| turned),
            amplitude: self.within(-100.0, 100.0),
            period: self.length(),
            phase: self.within(-1.0, 1.0),
            wavelength: self.maybe(Dice::length).filter(|_| kind == Kind::Wave),
        }
    }

    fn animation(&mut self, orbit: bool) -> Animation {
        let deformers = self.whole(0, DEFORMERS_MAX as u32);
        let light_keys = self.maybe(|d| {
            let times = d.times();
            Track {
                values: times
                    .iter()
                    .map(|_| {
                        let [r, g, b] = d.vector(0.0, 2.0).to_array();
                        let (azimuth, elevation) = (d.within(-720.0, 720.0), d.within(-90.0, 90.0));
                        [azimuth, elevation, d.within(0.0, 9.0), r, g, b]
                    })
                    .collect(),
                times,
                ease: d.ease(),
            }
        });
        let camera_keys = self.maybe(|d| {
            let (times, ease) = (d.times(), d.ease());
            let angles = times.iter().map(|_| {
                let (azimuth, elevation) = (d.within(-720.0, 720.0), d.within(-90.0, 90.0));
                [azimuth, elevation, d.within(0.1, 170.0)]
            });
            CameraKeys {
                angles: Track {
                    values: angles.collect(),
                    times: times.clone(),
                    ease,
                },
                distance: d.maybe(|d| Track {
                    values: times.iter().map(|_| [d.length()]).collect(),
                    times: times.clone(),
                    ease,
                }),
                target: d.maybe(|d| Track {
                    values: times
                        .iter()
                        .map(|_| d.vector(-9.0, 9.0).to_array())
                        .collect(),
                    times: times.clone(),
                    ease,
                }),
            }
        });
        Animation {
            clip: self.maybe(|d| d.pick(&["swim", "", "\"", "\\n", "ß'\t"]).to_owned()),
            fps: self.within(0.01, 1000.0),
            duration: self.maybe(|d| d.within(1e-3, 1e6)),
            deformers: (0..deformers).map(|_| self.deformer()).collect(),
            light_turns: self.pick(&[0.0, 1.0, -1.0 / 3.0]),
            light_keys,
            camera_turns: self.pick(&[0.0, 1.0, -1.0 / 3.0]),
            camera_keys: camera_keys.filter(|_| orbit),
        }
    }

    fn request(&mut self) -> Request {
        let viewpoint = match self.heads() {
            true => Viewpoint::Orbit {
                azimuth: self.within(-720.0, 720.0),
                elevation: self.within(-90.0, 90.0),
                distance: self.maybe(Dice::length),
                target: self.maybe(|d| d.vector(-1e3, 1e3)),
            },
            false => Viewpoint::At {
                eye: self.vector(1.0, 100.0),
                target: self.vector(-100.0, -1.0),
                up: DVec3::new(-1.0, 1.0, 0.0),
            },
        };
        let mut animation = self.animation(matches!(viewpoint, Viewpoint::Orbit { .. }));
        if let (
            Viewpoint::Orbit {
                distance, target, ..
            },
            Some(keys),
        ) = (&viewpoint, &mut animation.camera_keys)
        {
            // Keyframes take up what the camera at rest has and they have not.
            keys.distance = keys.distance.take().filter(|_| distance.is_some());
            keys.target = keys.target.take().filter(|_| target.is_some());
        }
        let keys = animation.camera_keys.clone();
        let viewpoint = match viewpoint {
            Viewpoint::Orbit {
                azimuth,
                elevation,
                distance,
                target,
            } => Viewpoint::Orbit {
                azimuth,
                elevation,
                distance: distance.filter(|_| keys.as_ref().is_none_or(|k| k.distance.is_some())),
                target: target.filter(|_| keys.as_ref().is_none_or(|k| k.target.is_some())),
            },
            at => at,
        };
        let single = Single::March(March {
            steps: self.whole(1, 64),
            exits: Exits::Linear,
        });
        let request = Request {
            name: self.pick(&["", "a scene", "\"#\" \\ 'ß'"]).to_owned(),
            mesh: MeshSource::Bundled(Bundled::named(self.pick(&bundled::NAMES)).expect("a mesh")),
            unit: self.length(),
            material: self.material(),
            colored_by_mesh: self.heads(),
            animation,
            time: self.maybe(|d| d.within(0.0, 1e6)),
            light: Light {
                azimuth: self.within(-720.0, 720.0),
                elevation: self.within(-90.0, 90.0),
                irradiance: self.length(),
                color: self.vector(0.0, 2.0),
            },
            viewpoint,
            fov: self.within(0.1, 170.0),
            size: [self.whole(1, 16384), self.whole(1, 16384)],
            fetch_budget: None,
            multiple: self.pick(&METHODS),
            split: self.maybe(|d| d.pick(&METHODS)),
            split_at: self.pick(&[0.0, 0.5, 1.0, 1.0 / 3.0]),
            samples: self.whole(1, 256),
            rings: self.whole(1, 14),
            moments: self.whole(3, 4),
            fourth_from: self.whole(0, 13),
            fourth_levels: self.maybe(|d| d.whole(1, 9)),
            level_step: self.whole(1, 2),
            volumes: self.whole(0, 8),
            weights: self.pick(&Fit::ALL),
            single: self.pick(&[Single::Off, Single::Traced, single, single]),
            exits: self.pick(&[Exits::Linear, Exits::Nearest, Exits::Depth]),
            scattering: self.pick(&[Scattering::Full, Scattering::Half]),
            specular: self.heads(),
            light_map: self.whole(16, 8192),
            frames_averaged: self.maybe(|d| d.whole(1, 1_000_000)),
            jitter: self.pick(&[Jitter::Off, Jitter::Samples, Jitter::All]),
            exposure: self.length(),
            background: self.maybe(|d| d.vector(0.0, 1.0).to_array()),
        };
        if self.whole(0, 4) > 0 {
            return request;
        }
        // A budget chooses all that is left at its default here.
        let plain = Request::statue();
        Request {
            fetch_budget: Some(self.whole(1, 1_000_000)),
            multiple: plain.multiple,
            split: plain.split,
            split_at: plain.split_at,
            samples: plain.samples,
            rings: plain.rings,
            moments: plain.moments,
            fourth_from: plain.fourth_from,
            fourth_levels: plain.fourth_levels,
            level_step: plain.level_step,
            volumes: plain.volumes,
            weights: plain.weights,
            single: plain.single,
            exits: plain.exits,
            ..request
        }
    }
}

#[test]
fn requests_at_random() {
    let mut dice = Dice(Random(7));
    for _ in 0..400 {
        holds(&dice.request());
    }
}

/// Every background that a flag can say, as it was said; and any other.
#[test]
fn backgrounds() {
    let with = |background| Request {
        background,
        ..Request::statue()
    };
    for byte in 0..=255_u8 {
        let hex = format!("#{byte:02x}{:02x}80", 255 - byte);
        let text = format!("background = \"{hex}\"");
        let request = scene_file::parse(&text, "s.toml", Path::new("")).expect("a scene");
        holds(&request);
        assert!(request.to_toml().expect("a scene").contains(&text), "{hex}");
    }
    holds(&with(Some([0.1, 0.2, 1e6])));
    holds(&with(None));
}

/// Keys stand in the order in which docs/scene.md has them, and each is there.
#[test]
fn keys_stand_as_documented() {
    let document = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/scene.md"));
    let mut documented = Vec::new();
    let mut table = String::new();
    for line in document.lines() {
        if let Some(title) = line.strip_prefix("## ") {
            table = title.trim_matches(|c| "`[]".contains(c)).to_owned();
        } else if let Some(row) = line.strip_prefix("| `") {
            let key = row.split('`').next().unwrap_or_default();
            documented.push((table.replace("Top of the file", ""), key.to_owned()));
        }
    }
    let place = |table: &str, key: &str| {
        let of = |(t, k): &(String, String)| t == table && k == key;
        documented.iter().rposition(of)
    };
    let mut dice = Dice(Random(8));
    let mut seen = vec![false; documented.len()];
    for _ in 0..200 {
        let text = dice.request().to_toml().expect("a scene");
        let (mut table, mut last) = (String::new(), None);
        for line in text.lines() {
            if let Some(title) = line.strip_prefix('[') {
                table = title.trim_end_matches(']').to_owned();
                continue;
            }
            let key = line.split(" = ").next().unwrap_or_default();
            // Keyframes have tables of their own in docs/animation.md.
            let known = table.starts_with("animation.") || line.starts_with(['#', ' ', '}', ']']);
            if known || line.is_empty() {
                continue;
            }
            let at = place(&table, key);
            // Of an eye the target comes after it.
            let at = at.unwrap_or_else(|| panic!("[{table}] {key} is not documented"));
            assert!(
                last < Some(at) || key == "target",
                "[{table}] {key} in\n{text}"
            );
            (last, seen[at]) = (Some(at), true);
        }
    }
    let missing: Vec<_> = (documented.iter().enumerate())
        .filter(|(i, (t, k))| !seen[*i] && place(t, k) == Some(*i))
        .map(|(_, key)| key)
        .collect();
    assert!(missing.is_empty(), "never written: {missing:?}");
}

/// What no file can say is one line.
#[test]
fn what_cannot_be_written_is_refused() {
    let refused = |request: &Request, fragment: &str| {
        let message = request.to_toml().expect_err(fragment).to_string();
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(message.contains(fragment), "{message}");
    };
    let mut request = Request::statue();
    request.exposure = f64::NAN;
    refused(&request, "NaN");
    let mut request = Request::statue();
    request.light.color.y = f64::INFINITY;
    refused(&request, "inf");
    let mut request = everything();
    request.viewpoint = Viewpoint::At {
        eye: DVec3::X,
        target: DVec3::ZERO,
        up: DVec3::Y,
    };
    refused(&request, "position");
    let mut request = everything();
    let keys = request.animation.light_keys.as_mut().expect("keyframes");
    (keys.times, keys.values) = (Vec::new(), Vec::new());
    refused(&request, "none in them");
    let mut request = everything();
    let keys = request.animation.camera_keys.as_mut().expect("keyframes");
    let distance = keys.distance.as_mut().expect("keyframes");
    distance.times[1] += 0.1;
    refused(&request, "the same times");
    let mut request = everything();
    let keys = request.animation.camera_keys.as_mut().expect("keyframes");
    keys.target.as_mut().expect("keyframes").ease = Ease::Linear;
    refused(&request, "interpolations");
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        let name = std::ffi::OsStr::from_bytes(b"/\xff.obj");
        let request = Request {
            mesh: MeshSource::File(name.into()),
            ..Request::statue()
        };
        refused(&request, "not UTF-8");
    }
}

/// The picture of a written scene is that of the flags it came from.
#[test]
fn the_picture_of_a_written_scene_is_the_same() {
    if !common::device::present() {
        return;
    }
    let folder = folder();
    let flags = "--size 64x48 --multiple mixture --moments 4 --fourth-levels 2 --level-step 2 \
                 --weights fitted --split brdf --split-at 0.3 --material skin1 --eta 1.4 \
                 --light 140,20 --camera 20,10,90 --exposure 1.3 --background #203040 --single 4 \
                 --exits nearest --light-map 128 --frames-averaged 2 --jitter samples --unit 0.9";
    let mut arguments = vec!["render", "statue-1k", "-o", "flags.png"];
    arguments.extend(flags.split_whitespace());
    let by_flags = run(folder.path(), &arguments);
    assert_eq!(by_flags.code, 0, "{}", by_flags.stderr);

    let mut request = of(Bundled::Statue1k);
    request.size = [64, 48];
    request.multiple = Method::Mixture;
    (request.moments, request.fourth_levels, request.level_step) = (4, Some(2), 2);
    request.weights = Fit::LeastSquares;
    (request.split, request.split_at) = (Some(Method::Brdf), 0.3);
    request.material = Material::preset("skin1").expect("a preset");
    request.material.name = "custom".to_owned();
    request.material.eta = 1.4;
    request.colored_by_mesh = false;
    (request.light.azimuth, request.light.elevation) = (140.0, 20.0);
    request.viewpoint = Viewpoint::Orbit {
        azimuth: 20.0,
        elevation: 10.0,
        distance: Some(90.0),
        target: None,
    };
    request.exposure = 1.3;
    let hex = marmor::scene::color::parse_hex("#203040").expect("a colour");
    request.background = Some(hex);
    request.single = Single::March(March {
        steps: 4,
        exits: Exits::Linear,
    });
    request.exits = Exits::Nearest;
    request.light_map = 128;
    request.frames_averaged = Some(2);
    request.jitter = Jitter::Samples;
    request.unit = 0.9;
    let text = request.to_toml().expect("a scene");
    file(folder.path(), "written.toml", text);
    let written = run(folder.path(), &["render", "written.toml", "-o", "file.png"]);
    assert_eq!(written.code, 0, "{}", written.stderr);
    let bytes = |name| std::fs::read(folder.path().join(name)).expect("a picture");
    assert!(bytes("flags.png") == bytes("file.png"), "another picture");
}
