//! What the ledger declares is what stands in the SPIR-V: sites times trips.

use std::collections::HashMap;

use marmor::frame::shaders;
use marmor::gpu::Shader;
use marmor::ledger::{self, Filter, INPUT, TEXEL};
use marmor::scene::{Exits, March, Method, Multiple, Request, Single};
use rspirv::dr::{Loader, Operand};
use rspirv::spirv::{Dim, Op, StorageClass, Word};

/// Image instructions of a shader that read: of textures and storage images, and of input attachments.
#[derive(Debug, PartialEq, Eq)]
struct Sites {
    fetches: u32,
    inputs: u32,
}

fn sites(shader: &Shader) -> Sites {
    let mut loader = Loader::new();
    rspirv::binary::parse_words(shader.spirv, &mut loader).expect("SPIR-V");
    let module = loader.module();
    let is_input: HashMap<Word, bool> = module
        .types_global_values
        .iter()
        .filter(|i| i.class.opcode == Op::TypeImage)
        .filter_map(|i| {
            let input = i.operands.contains(&Operand::Dim(Dim::DimSubpassData));
            Some((i.result_id?, input))
        })
        .collect();
    let mut type_of = HashMap::new();
    let mut found = Sites {
        fetches: 0,
        inputs: 0,
    };
    for instruction in module.all_inst_iter() {
        if let (Some(id), Some(kind)) = (instruction.result_id, instruction.result_type) {
            type_of.insert(id, kind);
        }
        let name = format!("{:?}", instruction.class.opcode);
        let reads = name.starts_with("ImageSample")
            || name.starts_with("ImageFetch")
            || name.starts_with("ImageGather")
            || name.starts_with("ImageDrefGather")
            || name.starts_with("ImageRead")
            || name.starts_with("ImageSparse");
        if !reads {
            continue;
        }
        let Some(Operand::IdRef(image)) = instruction.operands.first() else {
            panic!("{name} without an image");
        };
        let input = type_of
            .get(image)
            .and_then(|kind| is_input.get(kind))
            .copied();
        if input == Some(true) {
            found.inputs += 1;
        } else {
            found.fetches += 1;
        }
    }
    found
}

/// Loads of floats from storage buffers that stand in a shader, all loops unrolled.
fn loads(shader: &Shader) -> u32 {
    let mut loader = Loader::new();
    rspirv::binary::parse_words(shader.spirv, &mut loader).expect("SPIR-V");
    let module = loader.module();
    let of_buffers: HashMap<Word, ()> = module
        .types_global_values
        .iter()
        .filter(|i| i.class.opcode == Op::TypePointer)
        .filter(|i| {
            i.operands
                .contains(&Operand::StorageClass(StorageClass::StorageBuffer))
        })
        .filter_map(|i| Some((i.result_id?, ())))
        .collect();
    let mut pointers = HashMap::new();
    let mut found = 0;
    for i in module.all_inst_iter() {
        match (i.class.opcode, i.result_id, i.result_type) {
            (Op::AccessChain, Some(id), Some(kind)) if of_buffers.contains_key(&kind) => {
                pointers.insert(id, ());
            }
            (Op::Load, ..) => {
                let from = i.operands.first();
                let counts = matches!(from, Some(Operand::IdRef(id)) if pointers.contains_key(id));
                found += u32::from(counts);
            }
            _ => {}
        }
    }
    found
}

/// What is declared of `pass`: fetches and input reads a pixel.
fn declared(request: Request, pass: &str) -> Sites {
    declared_with(request, pass, Filter::Linear)
}

fn declared_with(request: Request, pass: &str, filter: Filter) -> Sites {
    let plan = request.plan().expect("a plan");
    let lines = ledger::declared(&plan, filter);
    let sum = |input: bool| {
        let of_kind = lines
            .iter()
            .filter(|l| l.pass == pass && (l.term == INPUT) == input && l.term != TEXEL);
        of_kind.map(|l| l.per_pixel).sum()
    };
    Sites {
        fetches: sum(false),
        inputs: sum(true),
    }
}

fn request(method: Method) -> Request {
    Request {
        multiple: method,
        single: Single::Off,
        ..Request::statue()
    }
}

#[test]
fn shading_without_loops_declares_its_sites() {
    // The specular shadow test is one gather; `brdf` shares it.
    for (method, shader) in [
        (Method::None, shaders::SHADE_FRAG_NONE),
        (Method::Brdf, shaders::SHADE_FRAG_BRDF),
    ] {
        assert_eq!(
            declared(request(method), "shade"),
            sites(&shader),
            "{}",
            shader.name
        );
    }
}

#[test]
fn samples_declare_their_sites_times_their_trips() {
    // One site stands in the loops over samples and techniques; the others run once.
    let found = sites(&shaders::SHADE_FRAG_SAMPLES);
    for samples in [1, 7, 30, 256] {
        let request = Request {
            samples,
            ..request(Method::Samples)
        };
        let expected = Sites {
            fetches: found.fetches - 1 + samples,
            inputs: found.inputs,
        };
        assert_eq!(declared(request, "shade"), expected);
    }
}

/// Shaders for devices that filter 32-bit floats, and for those that do not.
const FILTERS: [Filter; 2] = [Filter::Linear, Filter::Texels];

#[test]
fn rings_declare_their_sites_times_their_trips() {
    for (filter, shader) in FILTERS
        .into_iter()
        .zip([shaders::SHADE_FRAG_RINGS, shaders::SHADE_FRAG_RINGS_NEAREST])
    {
        // The shadow test, level 0, and one tap in the loop over the others.
        let tap = filter.fetches();
        let found = sites(&shader);
        assert_eq!(found.fetches, 1 + 2 * tap, "{}", shader.name);
        for (asked, rings) in [(1, 1), (8, 8), (14, 10)] {
            // A map of 512 texels has ten levels.
            let request = Request {
                rings: asked,
                ..request(Method::Rings)
            };
            let expected = Sites {
                fetches: found.fetches - tap + (rings - 1) * tap,
                inputs: found.inputs,
            };
            assert_eq!(declared_with(request, "shade", filter), expected);
        }
    }
}

#[test]
fn the_mixture_declares_its_sites_times_its_trips() {
    for (filter, [three, four]) in FILTERS.into_iter().zip([
        [
            shaders::SHADE_FRAG_MIXTURE,
            shaders::SHADE_FRAG_MIXTURE_FOURTH,
        ],
        [
            shaders::SHADE_FRAG_MIXTURE_NEAREST,
            shaders::SHADE_FRAG_MIXTURE_NEAREST_FOURTH,
        ],
    ]) {
        let tap = filter.fetches();
        for (moments, fourth_from, fourth_levels) in [
            (3, 0, None),
            (4, 0, None),
            (4, 2, None),
            (4, 0, Some(3)),
            (4, 0, Some(9)),
        ] {
            let request = Request {
                moments,
                fourth_from,
                fourth_levels,
                ..request(Method::Mixture)
            };
            let plan = request.plan().expect("a plan");
            let Multiple::Mixture(mixture) = plan.multiple else {
                panic!("another method");
            };
            let taps = plan.taps(mixture, &plan.light_frame());
            let [levels, fourth, _] = taps.counts();
            assert!((5..=9).contains(&levels), "{levels} levels");
            // The shadow test; a loop over levels with one site; or three loops, with one, two and
            // one, whose trips are the levels before, with and after the fourth moment.
            let (shader, expected) = if fourth == 0 {
                (&three, 1 + tap * levels)
            } else {
                let (before, after) = (taps.fourth.start, levels - taps.fourth.end);
                (&four, 1 + tap * (before + 2 * fourth + after))
            };
            let found = sites(shader);
            let loops = if fourth == 0 { 1 } else { 4 };
            assert_eq!(found.fetches, 1 + loops * tap, "{}", shader.name);
            let declared = declared_with(request, "shade", filter);
            assert_eq!(declared.fetches, expected, "{mixture}");
            assert_eq!(declared.inputs, found.inputs);
        }
    }
}

/// Volumes add their own taps, of eight reads where nothing filters.
#[test]
fn volumes_declare_their_sites_times_their_trips() {
    for (filter, [three, four]) in FILTERS.into_iter().zip([
        [
            shaders::SHADE_FRAG_MIXTURE_VOLUMES,
            shaders::SHADE_FRAG_MIXTURE_FOURTH_VOLUMES,
        ],
        [
            shaders::SHADE_FRAG_MIXTURE_NEAREST_VOLUMES,
            shaders::SHADE_FRAG_MIXTURE_NEAREST_FOURTH_VOLUMES,
        ],
    ]) {
        let (tap, volume) = (filter.fetches(), filter.volume_fetches());
        for (moments, fourth_levels, volumes) in
            [(3, None, 1), (3, None, 5), (4, None, 4), (4, Some(1), 2)]
        {
            let request = Request {
                moments,
                fourth_levels,
                volumes,
                ..request(Method::Mixture)
            };
            let plan = request.plan().expect("a plan");
            let Multiple::Mixture(mixture) = plan.multiple else {
                panic!("another method");
            };
            let taps = plan.taps(mixture, &plan.light_frame());
            let blended = volumes.min(2);
            let [levels, fourth, found] = taps.counts();
            assert_eq!(found, volumes);
            assert_eq!(levels, taps.levels.count - volumes + blended);
            // The shadow test; loops over levels as without volumes; one with a tap of each kind, and one with a
            // volume's.
            let shader = if fourth == 0 { &three } else { &four };
            let loops = if fourth == 0 { 1 } else { 4 };
            let sites = sites(shader);
            let expected = 1 + (loops + 1) * tap + 2 * volume;
            assert_eq!(sites.fetches, expected, "{}", shader.name);
            let declared = declared_with(request, "shade", filter);
            let expected = 1 + tap * (levels + fourth) + volume * volumes;
            assert_eq!(declared.fetches, expected, "{mixture}");
            assert_eq!(declared.inputs, sites.inputs);
        }
    }
}

#[test]
fn volumes_declare_their_reads_per_cell() {
    let request = Request {
        volumes: 5,
        ..request(Method::Mixture)
    };
    let plan = request.plan().expect("a plan");
    let Multiple::Mixture(mixture) = plan.multiple else {
        panic!("another method");
    };
    let lines = ledger::declared(&plan, Filter::Linear);
    let lines = lines
        .iter()
        .filter(|l| l.pass == "volume" && l.term == TEXEL);
    let declared: Vec<u32> = lines.map(|l| l.per_pixel).collect();
    // A deposit has one site in a loop over the texels around a column.
    assert_eq!(sites(&shaders::VOLUME_COMP).fetches, 1);
    let volumes = plan
        .taps(mixture, &plan.light_frame())
        .volumes
        .expect("volumes");
    let reach = volumes.grids[0].reach();
    assert!((2.0 / volumes.grids[0].scale) < f64::from(reach));
    // The others read buffers: of eight cells 6x6x6 halved ones, and 8 + 2 radius along an axis.
    assert_eq!(loads(&shaders::VOLUME_HALVE_COMP), 216);
    let radius = volumes.volumes.iter().map(|v| v.weights.len() as u32 - 1);
    let blur = (8 + 2 * radius.max().unwrap_or(0)).div_ceil(8);
    assert_eq!(declared, [reach * reach, 216 / 8, 3 * blur]);
    for shader in [&shaders::VOLUME_HALVE_COMP, &shaders::VOLUME_BLUR_COMP] {
        assert_eq!(sites(shader).fetches, 0, "{}", shader.name);
    }
}

#[test]
fn the_march_declares_one_site_times_its_steps() {
    // By method: without, with, and from the depth buffer; what else each reads must stay the same.
    let shaders = [
        (
            Method::None,
            [
                shaders::SHADE_FRAG_NONE,
                shaders::SHADE_FRAG_NONE_SINGLE,
                shaders::SHADE_FRAG_NONE_SINGLE_DEPTH,
            ],
        ),
        (
            Method::Samples,
            [
                shaders::SHADE_FRAG_SAMPLES,
                shaders::SHADE_FRAG_SAMPLES_SINGLE,
                shaders::SHADE_FRAG_SAMPLES_SINGLE_DEPTH,
            ],
        ),
        (
            Method::Rings,
            [
                shaders::SHADE_FRAG_RINGS,
                shaders::SHADE_FRAG_RINGS_SINGLE,
                shaders::SHADE_FRAG_RINGS_SINGLE_DEPTH,
            ],
        ),
        (
            Method::Mixture,
            [
                shaders::SHADE_FRAG_MIXTURE,
                shaders::SHADE_FRAG_MIXTURE_SINGLE,
                shaders::SHADE_FRAG_MIXTURE_SINGLE_DEPTH,
            ],
        ),
        (
            Method::Mixture,
            [
                shaders::SHADE_FRAG_MIXTURE_NEAREST,
                shaders::SHADE_FRAG_MIXTURE_NEAREST_SINGLE,
                shaders::SHADE_FRAG_MIXTURE_NEAREST_SINGLE_DEPTH,
            ],
        ),
    ];
    for (method, [without, with, from_depth]) in shaders {
        let found = sites(&without);
        for shader in [&with, &from_depth] {
            // One tap in the loop over the steps, and depth and normal of the back face.
            let more = Sites {
                fetches: found.fetches + 1,
                inputs: found.inputs + 2,
            };
            assert_eq!(sites(shader), more, "{}", shader.name);
        }
        for (steps, exits) in [(1, Exits::Linear), (8, Exits::Depth), (64, Exits::Nearest)] {
            for filter in FILTERS {
                let plain = declared_with(request(method), "shade", filter);
                let march = Request {
                    single: Single::March(March { steps, exits }),
                    exits,
                    ..request(method)
                };
                let declared = declared_with(march, "shade", filter);
                assert_eq!(declared.fetches, plain.fetches + steps);
                assert_eq!(declared.inputs, plain.inputs + 2);
            }
        }
    }
    // No transport, and nothing read for it.
    let opaque = Request {
        single: Single::March(March {
            steps: 8,
            exits: Exits::Linear,
        }),
        ..request(Method::Brdf)
    };
    assert_eq!(
        declared(opaque, "shade"),
        declared(request(Method::Brdf), "shade")
    );
}

#[test]
fn reductions_declare_their_reads_per_texel() {
    let per_texel = |method, moments, pass: &str| -> Vec<u32> {
        let request = Request {
            moments,
            ..request(method)
        };
        let lines = ledger::declared(&request.plan().expect("a plan"), Filter::Linear);
        let lines = lines.iter().filter(|l| l.pass == pass && l.term == TEXEL);
        lines.map(|l| l.per_pixel).collect()
    };
    // Of each moment's image: four texels of 6x6 reads, sixteen of 12x12.
    let halve = [
        sites(&shaders::DECIMATE_COMP),
        sites(&shaders::DECIMATE_COMP_FOURTH),
    ];
    let smooth = [
        sites(&shaders::SMOOTH_COMP),
        sites(&shaders::SMOOTH_COMP_FOURTH),
    ];
    for (moments, images) in [(3, 1), (4, 2)] {
        let of_halving = halve[images as usize - 1].fetches / 4;
        // A row of twelve, in a loop of as many.
        assert_eq!(smooth[images as usize - 1].fetches, 12);
        let of_smoothing = images * 12 * 12 / 16;
        let declared = per_texel(Method::Mixture, moments, "reduce");
        assert_eq!(declared, [of_halving, of_smoothing], "{moments} moments");
    }
    let boxes = per_texel(Method::Rings, 3, "boxes");
    assert_eq!(boxes, [sites(&shaders::BOXES_COMP).fetches]);
}

#[test]
fn exact_and_resolve_declare_their_sites_times_their_trips() {
    // exact: the site of the light moments stands in the loop over the map.
    let found = sites(&shaders::EXACT_COMP);
    for size in [16, 512] {
        let request = Request {
            light_map: size,
            ..request(Method::Exact)
        };
        let expected = found.fetches - 1 + size * size;
        assert_eq!(
            declared(request, "exact"),
            Sites {
                fetches: expected,
                inputs: found.inputs
            }
        );
    }
    let request = Request {
        frames_averaged: 2,
        ..request(Method::Samples)
    };
    let declared = declared(request, "resolve");
    for shader in [shaders::RESOLVE_FRAG, shaders::RESOLVE_FRAG_ENCODE] {
        assert_eq!(declared, sites(&shader), "{}", shader.name);
    }
}

#[test]
fn geometry_passes_read_no_texture() {
    for shader in [
        shaders::LIGHT_VERT,
        shaders::LIGHT_FRAG,
        shaders::LIGHT_FRAG_FOURTH,
        shaders::VIEW_VERT,
        shaders::VIEW_FRAG,
        shaders::SHADE_VERT,
    ] {
        assert_eq!(
            sites(&shader),
            Sites {
                fetches: 0,
                inputs: 0
            },
            "{}",
            shader.name
        );
    }
}

#[test]
fn a_box_is_four_texels() {
    let found = sites(&shaders::BOXES_COMP);
    assert_eq!((found.fetches, found.inputs), (4, 0));
}
