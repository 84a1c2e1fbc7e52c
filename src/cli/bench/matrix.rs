//! The matrix of cases: which methods, sizes, meshes and light maps are measured.

use crate::optics::mixture::Fit;
use crate::scene::{
    Bundled, Exits, Jitter, March, MeshSource, Method, Request, Scattering, Single, Viewpoint,
    defaults,
};

/// A case before it is measured.
#[derive(Clone, Debug)]
pub(super) struct Desc {
    /// Key of the case.
    pub(super) name: String,
    /// Its sweep.
    pub(super) group: &'static str,
    /// What is drawn.
    pub(super) request: Request,
    /// Whether all frames share one light map.
    pub(super) rests: bool,
    /// The size of the picture whose error is measured, if it is.
    pub(super) error: Option<[u32; 2]>,
}

/// How far the camera stands from the statue's face, mm, so that three quarters of the picture are covered, as in the
/// paper's table.
const CLOSE: f64 = 42.0;

/// The cases of one scene; where there are `several`, its name begins theirs.
pub(super) fn cases(scene: &Request, quick: bool, several: bool) -> Vec<Desc> {
    let (size, small) = match quick {
        true => ([320, 240], [80, 60]),
        false => ([800, 600], [200, 150]),
    };
    let base = Request {
        size,
        split: None,
        scattering: Scattering::Full,
        frames_averaged: Some(1),
        jitter: Jitter::All,
        // The cases say how they are drawn, whatever the scene file says.
        fetch_budget: None,
        samples: defaults::SAMPLES,
        rings: defaults::RINGS,
        moments: defaults::MOMENTS,
        fourth_from: 0,
        fourth_levels: None,
        level_step: 1,
        volumes: 0,
        weights: Fit::Best,
        ..scene.clone()
    };
    let march = |steps| {
        Single::March(March {
            steps,
            exits: Exits::Linear,
        })
    };
    let with = |multiple, single| Request {
        multiple,
        single,
        ..base.clone()
    };
    let mixture = |single| with(Method::Mixture, march(single));
    let half = || Request {
        scattering: Scattering::Half,
        ..mixture(8)
    };
    let mut cases = Vec::new();
    let mut add = |group, name: &str, request: Request| {
        let prefix = if several {
            format!("{}: ", scene.name)
        } else {
            String::new()
        };
        cases.push(Desc {
            name: format!("{prefix}{group}/{name}"),
            group,
            request,
            rests: false,
            // What leaves a part of scattering out has no place among the others.
            error: (group == "budgets"
                || (group == "methods" && (name.contains("single") || name == "brdf")))
                .then_some(small),
        });
    };

    add("methods", "brdf", with(Method::Brdf, Single::Off));
    add(
        "methods",
        "rings 8 + single 8",
        with(Method::Rings, march(8)),
    );
    add(
        "methods",
        "samples 30 + single 8",
        with(Method::Samples, march(8)),
    );
    add("methods", "rings 8", with(Method::Rings, Single::Off));
    add("methods", "mixture 3", with(Method::Mixture, Single::Off));
    add("methods", "mixture 3 + single 8", mixture(8));
    add("methods", "mixture 3 + single 8, half", half());
    if !quick {
        let four = Request {
            moments: 4,
            ..mixture(8)
        };
        add("methods", "mixture 4 + single 8", four);
        let volumes = Request {
            volumes: 4,
            ..mixture(8)
        };
        add("methods", "mixture 3, 4 volumes + single 8", volumes);
    }
    add("methods", "mixture 3 + single 8, light rests", mixture(8));

    let budgets: &[u32] = if quick {
        &[12]
    } else {
        &[4, 8, 12, 16, 24, 32, 64]
    };
    for &fetches in budgets {
        let request = Request {
            fetch_budget: Some(fetches),
            ..base.clone()
        };
        add("budgets", &format!("budget {fetches}"), request);
    }

    let samples: &[u32] = if quick {
        &[4, 8, 16]
    } else {
        &[4, 8, 16, 30, 60]
    };
    for &samples in samples {
        let request = Request {
            samples,
            ..with(Method::Samples, Single::Off)
        };
        add("fetches", &format!("samples {samples}"), request);
    }
    let steps: &[u32] = if quick {
        &[4, 8, 16]
    } else {
        &[2, 4, 8, 16, 32]
    };
    for &steps in steps {
        let request = with(Method::None, march(steps));
        add("fetches", &format!("single {steps}"), request);
    }

    let sizes: &[[u32; 2]] = match quick {
        true => &[[160, 120], [320, 240], [480, 360]],
        false => &[[200, 150], [400, 300], [800, 600], [1600, 1200]],
    };
    for &[width, height] in sizes {
        let request = Request {
            size: [width, height],
            ..mixture(8)
        };
        add("pixels", &format!("{width}x{height}"), request);
    }

    // Of another mesh than the statue there is but one resolution.
    let meshes = [
        ("1K", Bundled::Statue1k),
        ("5K", Bundled::Statue5k),
        ("20K", Bundled::Statue20k),
    ];
    let statue = meshes
        .iter()
        .any(|(_, mesh)| scene.mesh == MeshSource::Bundled(*mesh));
    let meshes = || meshes.into_iter().filter(|_| statue);
    for (name, mesh) in meshes() {
        let request = Request {
            mesh: MeshSource::Bundled(mesh),
            ..mixture(8)
        };
        add("triangles", name, request);
    }

    let maps: &[u32] = if quick { &[256] } else { &[256, 512, 1024] };
    for &light_map in maps {
        let request = Request {
            light_map,
            ..mixture(8)
        };
        add("light map", &light_map.to_string(), request);
    }

    if !quick {
        for (name, mesh) in meshes() {
            for (method, request) in [
                ("rings 8", with(Method::Rings, Single::Off)),
                ("mixture 3", with(Method::Mixture, Single::Off)),
                ("rings 8 + single 8", with(Method::Rings, march(8))),
                ("samples 30 + single 8", with(Method::Samples, march(8))),
                ("mixture 3 + single 8", mixture(8)),
                ("mixture 3 + single 8, half", half()),
            ] {
                let request = Request {
                    mesh: MeshSource::Bundled(mesh),
                    viewpoint: Viewpoint::Orbit {
                        azimuth: -28.0,
                        elevation: 4.0,
                        distance: Some(CLOSE),
                        target: None,
                    },
                    ..request
                };
                add("paper", &format!("{name}, {method}"), request);
            }
        }
    }
    for case in &mut cases {
        if case.name.ends_with("light rests") {
            case.rests = true;
            case.request.jitter = Jitter::Off;
        }
    }
    cases
}
