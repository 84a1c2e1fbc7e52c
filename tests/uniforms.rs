//! The uniform block of `shared.glsl` and its Rust mirror have the same layout.

use std::mem::offset_of;

use marmor::frame::{
    shaders,
    uniforms::{LevelTable, Reprojection, Uniforms, VolumeTable},
};
use marmor::gpu::Shader;
use rspirv::dr::{Loader, Operand};
use rspirv::spirv::{Decoration, Op};

/// Offsets of the members of the one uniform block called `name` in `shader`.
fn block_offsets(shader: &Shader, name: &str) -> Vec<u32> {
    let mut loader = Loader::new();
    rspirv::binary::parse_words(shader.words(), &mut loader).expect("SPIR-V");
    let module = loader.module();
    let block = module
        .debug_names
        .iter()
        .find_map(|n| match n.operands.as_slice() {
            [Operand::IdRef(id), Operand::LiteralString(text)] if text == name => Some(*id),
            _ => None,
        })
        .expect("a uniform block");
    let mut offsets: Vec<u32> = module
        .annotations
        .iter()
        .filter(|a| a.class.opcode == Op::MemberDecorate)
        .filter_map(|a| match a.operands.as_slice() {
            [
                Operand::IdRef(id),
                Operand::LiteralBit32(_),
                Operand::Decoration(Decoration::Offset),
                Operand::LiteralBit32(offset),
            ] if *id == block => Some(*offset),
            _ => None,
        })
        .collect();
    offsets.sort_unstable();
    offsets
}

#[test]
fn offsets_of_motion_agree() {
    let mirror = [
        offset_of!(Reprojection, now),
        offset_of!(Reprojection, before),
        offset_of!(Reprojection, picture),
    ]
    .map(|offset| offset as u32);
    assert_eq!(
        block_offsets(&shaders::VIEW_VERT_MOTION, "Before")[..2],
        mirror[..2]
    );
    assert_eq!(
        block_offsets(&shaders::VIEW_FRAG_MOTION, "Before").last(),
        mirror.last()
    );
    assert_eq!(size_of::<Reprojection>(), mirror[2] as usize + 16);
}

#[test]
fn offsets_agree() {
    let offsets = block_offsets(&shaders::SHADE_FRAG_SAMPLES, "Frame");
    let mirror = [
        offset_of!(Uniforms, view_proj),
        offset_of!(Uniforms, light_proj),
        offset_of!(Uniforms, eye),
        offset_of!(Uniforms, ray_0),
        offset_of!(Uniforms, ray_x),
        offset_of!(Uniforms, ray_y),
        offset_of!(Uniforms, light_u),
        offset_of!(Uniforms, light_v),
        offset_of!(Uniforms, light_z),
        offset_of!(Uniforms, light_scale),
        offset_of!(Uniforms, map),
        offset_of!(Uniforms, irradiance),
        offset_of!(Uniforms, sigma_tr),
        offset_of!(Uniforms, z_r),
        offset_of!(Uniforms, z_v),
        offset_of!(Uniforms, alpha_prime),
        offset_of!(Uniforms, r_tot),
        offset_of!(Uniforms, sequence),
        offset_of!(Uniforms, background),
        offset_of!(Uniforms, sigma_s),
        offset_of!(Uniforms, sigma_t),
        offset_of!(Uniforms, path),
        offset_of!(Uniforms, march),
        offset_of!(Uniforms, levels),
        offset_of!(Uniforms, levels) + offset_of!(LevelTable, places),
        offset_of!(Uniforms, volumes),
        offset_of!(Uniforms, volumes) + offset_of!(VolumeTable, places),
        offset_of!(Uniforms, rings),
    ]
    .map(|offset| offset as u32);
    assert_eq!(offsets, mirror);
    assert_eq!(
        size_of::<Uniforms>(),
        offsets[offsets.len() - 1] as usize + 14 * 16
    );
}
