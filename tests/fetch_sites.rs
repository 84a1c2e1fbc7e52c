//! What the ledger declares is what stands in the SPIR-V: sites times trips.

use std::collections::HashMap;

use marmor::frame::shaders;
use marmor::gpu::Shader;
use marmor::ledger::{self, Filter, INPUT, TEXEL};
use marmor::scene::{Method, Request};
use rspirv::dr::{Loader, Operand};
use rspirv::spirv::{Dim, Op, Word};

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

/// What is declared of `pass`: fetches and input reads a pixel.
fn declared(request: Request, pass: &str) -> Sites {
    let plan = request.plan().expect("a plan");
    let lines = ledger::declared(&plan, Filter::Linear);
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

#[test]
fn compute_declares_its_sites_times_its_trips() {
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
    assert_eq!(declared(request, "resolve"), sites(&shaders::RESOLVE_COMP));
}

#[test]
fn geometry_passes_read_no_texture() {
    for shader in [
        shaders::LIGHT_VERT,
        shaders::LIGHT_FRAG,
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
