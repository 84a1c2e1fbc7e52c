//! The light pass: what the light sees, as moments of depth weighted by what enters the surface.

use glam::{DVec2, DVec3, DVec4};

use crate::cpu::raster::{self, Cull, Fragment};
use crate::optics::fresnel;
use crate::scene::{LightFrame, Mesh};

/// Share by which the clip range is wider than the casters' depth range, so that rounding clips
/// nothing.
pub const DEPTH_MARGIN: f64 = 1.001;

/// The surface as the light sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct LightMap {
    /// Where the texels lie.
    pub frame: LightFrame,
    /// (w, w z_n, w z_n^2, w z_n^3) of each texel, row-major, row j at v = origin.y + (j + 1/2)
    /// texel.
    ///
    /// w = coverage times Fresnel transmittance at the incidence of the light, z_n the
    /// normalised depth of [`LightFrame`]. Zeros where nothing was hit.
    pub moments: Vec<[f64; 4]>,
    /// The fourth moment, w z_n^4, of each texel.
    pub fourth: Vec<f64>,
    /// Depth-buffer value of each texel, see [`depth_of`]; 1 where nothing was hit.
    pub depth: Vec<f64>,
}

/// A texel of a [`LightMap`] through which light enters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Coverage times Fresnel transmittance, in (0, 1].
    pub w: f64,
    /// The texel's centre at the depth of the surface, in light space (u, v, z), mm.
    pub x: DVec3,
}

/// Depth-buffer value of the normalised depth `z_n`: 0.5 + 0.5 z_n / [`DEPTH_MARGIN`].
pub fn depth_of(z_n: f64) -> f64 {
    0.5 + 0.5 * z_n / DEPTH_MARGIN
}

/// Draws the light map of `mesh` in `frame`, for the relative index `eta` of its boundary.
///
/// The nearest surface to the light wins. Triangles seen from behind are lit too, with their
/// normals turned.
pub fn draw(mesh: &Mesh, frame: &LightFrame, eta: f64) -> LightMap {
    let size = frame.size as usize;
    let clip: Vec<DVec4> = mesh.positions.iter().map(|&p| to_clip(frame, p)).collect();
    let fragments = raster::rasterise(&clip, &mesh.triangles, size, size, Cull::None);
    let (moments, fourth) = fragments
        .iter()
        .map(|fragment| {
            let Some(fragment) = fragment else {
                return ([0.0; 4], 0.0);
            };
            let corners = mesh.triangles[fragment.triangle];
            let z_n = interpolate(fragment, corners, |i| {
                normalised_depth(frame, frame.to_light_space(mesh.positions[i]).z)
            });
            // Rows grow with v, so the picture is mirrored, and what the light sees as
            // counter-clockwise is clockwise in it.
            let turn = if fragment.front_facing { -1.0 } else { 1.0 };
            let normal = turn * normal(mesh, fragment);
            let w = fresnel::transmittance(normal.dot(frame.to_light).max(0.0), eta);
            let moment = |k| w * z_n.powi(k);
            ([w, moment(1), moment(2), moment(3)], moment(4))
        })
        .unzip();
    let depth = fragments
        .iter()
        .map(|f| f.map_or(1.0, |f| f.depth))
        .collect();
    LightMap {
        frame: frame.clone(),
        moments,
        fourth,
        depth,
    }
}

impl LightMap {
    /// Texel (i, j), or none where no light enters.
    pub fn texel(&self, i: u32, j: u32) -> Option<Texel> {
        let [w, wz, ..] = self.moments[self.index(i, j)];
        (w > 0.0).then(|| {
            let z = self.frame.z_center + self.frame.z_half * wz / w;
            Texel {
                w,
                x: self.frame.texel_center(i, j).extend(z),
            }
        })
    }

    /// The texel that contains `uv` (light plane, mm), or none outside the map or where no
    /// light enters.
    pub fn nearest(&self, uv: DVec2) -> Option<Texel> {
        let t = self.frame.to_texel(uv).floor();
        let size = f64::from(self.frame.size);
        let inside = (0.0..size).contains(&t.x) && (0.0..size).contains(&t.y);
        if inside {
            self.texel(t.x as u32, t.y as u32)
        } else {
            None
        }
    }

    /// Depth-buffer value of the texel in column `i` and row `j`; 1, the border, outside the map.
    pub fn depth_at(&self, i: f64, j: f64) -> f64 {
        let size = f64::from(self.frame.size);
        let inside = (0.0..size).contains(&i) && (0.0..size).contains(&j);
        if inside {
            self.depth[self.index(i as u32, j as u32)]
        } else {
            1.0
        }
    }

    /// Every texel through which light enters, in row-major order.
    pub fn lit_texels(&self) -> impl Iterator<Item = Texel> + '_ {
        let size = self.frame.size;
        (0..size).flat_map(move |j| (0..size).filter_map(move |i| self.texel(i, j)))
    }

    fn index(&self, i: u32, j: u32) -> usize {
        j as usize * self.frame.size as usize + i as usize
    }
}

/// z_n of the light-space depth `z` (mm).
pub fn normalised_depth(frame: &LightFrame, z: f64) -> f64 {
    (z - frame.z_center) / frame.z_half
}

/// Scene position to the light's clip space.
fn to_clip(frame: &LightFrame, p: DVec3) -> DVec4 {
    let q = frame.to_light_space(p);
    let xy = frame.to_texel(q.truncate()) * (2.0 / f64::from(frame.size)) - 1.0;
    DVec4::new(xy.x, xy.y, depth_of(normalised_depth(frame, q.z)), 1.0)
}

/// A vertex attribute at a fragment.
fn interpolate(fragment: &Fragment, corners: [u32; 3], value: impl Fn(usize) -> f64) -> f64 {
    (0..3)
        .map(|k| fragment.barycentrics[k] * value(corners[k] as usize))
        .sum()
}

/// The normalised vertex normal at a fragment, or 0 where the three cancel.
pub(crate) fn normal(mesh: &Mesh, fragment: &Fragment) -> DVec3 {
    let corners = mesh.triangles[fragment.triangle];
    let sum: DVec3 = (0..3)
        .map(|k| mesh.normals[corners[k] as usize] * fragment.barycentrics[k])
        .sum();
    sum.normalize_or_zero()
}
