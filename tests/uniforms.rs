//! The uniform block of `shared.glsl` and its Rust mirror have the same layout.

use std::mem::offset_of;

use marmor::frame::{
    shaders,
    uniforms::{LevelTable, Uniforms, VolumeTable},
};
use rspirv::dr::{Loader, Operand};
use rspirv::spirv::{Decoration, Op};

#[test]
fn offsets_agree() {
    let mut loader = Loader::new();
    rspirv::binary::parse_words(shaders::SHADE_FRAG_SAMPLES.words(), &mut loader).expect("SPIR-V");
    let module = loader.module();
    let block = module
        .annotations
        .iter()
        .find_map(|a| match a.operands.as_slice() {
            [Operand::IdRef(id), Operand::Decoration(Decoration::Block)] => Some(*id),
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
