//! What egui has laid out, as triangles that the frame draws.

use crate::frame::panel::{Panel, Texels, Triangles, Vertex};
use egui::epaint::{ClippedPrimitive, ImageDelta, Primitive, textures::TexturesDelta};
use egui::{Rect, TextureFilter, TextureId};

/// What is new and gone of textures, and what is drawn, in a window of `size` pixels.
pub fn panel(
    mut textures: TexturesDelta,
    primitives: Vec<ClippedPrimitive>,
    scale: f32,
    size: [u32; 2],
) -> Panel {
    let mut new = Vec::new();
    for (id, deltas) in std::mem::take(&mut textures.set) {
        new.extend(deltas.into_iter().filter_map(|delta| texels(id, delta)));
    }
    let gone = std::mem::take(&mut textures.free);
    let triangles = primitives.into_iter().filter_map(|clipped| {
        let Primitive::Mesh(mesh) = clipped.primitive else {
            return None;
        };
        Some(Triangles {
            clip: pixels(clipped.clip_rect, scale, size),
            texture: number(mesh.texture_id)?,
            vertices: mesh
                .vertices
                .iter()
                .map(|vertex| Vertex {
                    position: vertex.pos.into(),
                    place: vertex.uv.into(),
                    color: vertex.color.to_array(),
                })
                .collect(),
            indices: mesh.indices,
        })
    });
    Panel {
        scale,
        new,
        triangles: triangles.collect(),
        gone: gone.into_iter().filter_map(number).collect(),
    }
}

/// egui's own textures; we lend it none.
fn number(id: TextureId) -> Option<u64> {
    match id {
        TextureId::Managed(number) => Some(number),
        TextureId::User(_) => None,
    }
}

fn texels(id: TextureId, delta: ImageDelta) -> Option<Texels> {
    let egui::ImageData::Color(image) = &delta.image;
    Some(Texels {
        texture: number(id)?,
        origin: delta.pos.map(|origin| origin.map(|at| at as u32)),
        size: image.size.map(|side| side as u32),
        texels: image.pixels.iter().map(|color| color.to_array()).collect(),
        smooth: delta.options.magnification == TextureFilter::Linear,
    })
}

/// The columns and rows that `rect` (points) covers: x, y, width, height, within a window of `size` pixels.
pub fn pixels(rect: Rect, scale: f32, size: [u32; 2]) -> [u32; 4] {
    let at = |point: f32, side: u32| (point * scale).round().clamp(0.0, side as f32) as u32;
    let (left, top) = (at(rect.min.x, size[0]), at(rect.min.y, size[1]));
    let (right, bottom) = (at(rect.max.x, size[0]), at(rect.max.y, size[1]));
    [
        left,
        top,
        right.saturating_sub(left),
        bottom.saturating_sub(top),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    #[test]
    fn rectangles_stay_inside_the_window() {
        let size = [100, 50];
        let rect = |a, b, c, d| Rect::from_min_max(pos2(a, b), pos2(c, d));
        assert_eq!(pixels(rect(1.0, 2.0, 3.0, 4.0), 2.0, size), [2, 4, 4, 4]);
        assert_eq!(
            pixels(rect(-9.0, -9.0, 999.0, 999.0), 1.0, size),
            [0, 0, 100, 50]
        );
        assert_eq!(pixels(rect(30.0, 9.0, 20.0, 9.0), 1.0, size), [30, 9, 0, 0]);
        let everything = Rect::EVERYTHING;
        assert_eq!(pixels(everything, 1.5, size), [0, 0, 100, 50]);
    }
}
