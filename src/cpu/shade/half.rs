//! Both terms of scattering, shaded once for four pixels, and brought back to the picture's size.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{MIN_COS_OUT, Receiver, Shading, radiance, receiver, specular};
use crate::cpu::GBuffer;
use crate::optics::fresnel;
use crate::scene::{March, Multiple, View};

/// How far a point may lie off the plane of the pixel's own surface and still count half, squared, in pixels.
const OFF_PLANE: f64 = 2.0;

/// What of the light below the boundary leaves `receiver` towards its viewer, over pi.
fn leaving(shading: &Shading, receiver: &Receiver) -> f64 {
    let cos_out = receiver.n.dot(receiver.wo).max(MIN_COS_OUT);
    fresnel::transmittance(cos_out, shading.eta) * std::f64::consts::FRAC_1_PI
}

/// Shades a picture of half the size ([`View::halved`]): in every covered pixel what is scattered, less what the
/// boundary keeps of it towards the viewer, and the distance along the optical axis, mm; 0 elsewhere, row-major.
pub fn halved(
    gbuffer: &GBuffer,
    view: &View,
    shading: &Shading,
    multiple: Multiple,
    march: Option<March>,
) -> Vec<[f64; 4]> {
    (0..gbuffer.depth.len())
        .into_par_iter()
        .map(|index| {
            receiver(gbuffer, view, index).map_or([0.0; 4], |receiver| {
                let sum = radiance(shading, &receiver, multiple, march, false);
                (sum / leaving(shading, &receiver))
                    .extend(view.axial(gbuffer.depth[index]))
                    .to_array()
            })
        })
        .collect()
}

/// Shades a picture from what [`halved`] has made of it: (radiance, 1) in every covered pixel, 0 elsewhere, row-major.
pub fn upsampled(
    gbuffer: &GBuffer,
    view: &View,
    shading: &Shading,
    half: &[[f64; 4]],
    with_specular: bool,
) -> Vec<[f64; 4]> {
    (0..gbuffer.depth.len())
        .into_par_iter()
        .map(|index| {
            receiver(gbuffer, view, index).map_or([0.0; 4], |receiver| {
                let own = view.axial(gbuffer.depth[index]);
                let size = [gbuffer.width, gbuffer.height].map(|side| side.div_ceil(2));
                let scattered = scattered(view, &receiver, own, half, size);
                let mut sum = leaving(shading, &receiver) * scattered;
                if with_specular {
                    sum += specular(shading, &receiver);
                }
                sum.extend(1.0).to_array()
            })
        })
        .collect()
}

/// Of the four nearest pixels of `half`, the bilinear mean over those that see the surface of `receiver`, which is `own`
/// along the optical axis.
fn scattered(
    view: &View,
    receiver: &Receiver,
    own: f64,
    half: &[[f64; 4]],
    [columns, rows]: [usize; 2],
) -> DVec3 {
    let pixel = own * view.ray_x.length();
    let [x, y] = receiver.pixel.map(i64::from);
    let mut sum = DVec3::ZERO;
    let mut weights = 0.0;
    for k in 0..4 {
        // Of an even pixel the nearer one is its own, of an odd one as well: the other lies across its nearer side.
        let [i, j] = [(x, k & 1), (y, k >> 1)].map(|(at, side)| (at - 1).div_euclid(2) + side);
        if i < 0 || j < 0 || i >= columns as i64 || j >= rows as i64 {
            continue;
        }
        let [r, g, b, distance] = half[j as usize * columns + i as usize];
        if distance <= 0.0 {
            continue;
        }
        let center = DVec2::new(i as f64, j as f64) * 2.0 + 1.0;
        let away = (DVec2::new(x as f64, y as f64) + 0.5 - center).abs() * 0.5;
        let point =
            view.eye + (view.ray_0 + view.ray_x * center.x + view.ray_y * center.y) * distance;
        let off = receiver.n.dot(point - receiver.p) / pixel;
        let weight = (1.0 - away.x) * (1.0 - away.y) / (OFF_PLANE + off * off).powi(2);
        sum += weight * DVec3::new(r, g, b);
        weights += weight;
    }
    sum / weights.max(1e-30)
}
