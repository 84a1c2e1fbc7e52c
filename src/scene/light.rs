//! The directional light and the orthographic frame its map is drawn in.

use glam::{DVec2, DVec3};

/// A directional light.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Azimuth in degrees around +Y, counted from +Z (the viewer's side) towards +X.
    pub azimuth: f64,
    /// Elevation above the horizon in degrees, in [-90, 90].
    pub elevation: f64,
    /// Irradiance E0 on a surface perpendicular to the light; dimensionless
    /// (radiance comes out in the same unit per steradian).
    pub irradiance: f64,
    /// Linear RGB colour that scales the irradiance.
    pub color: DVec3,
}

impl Light {
    /// Unit vector from the scene to the light.
    pub fn to_light(&self) -> DVec3 {
        let (sin_a, cos_a) = self.azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = self.elevation.to_radians().sin_cos();
        DVec3::new(sin_a * cos_e, sin_e, cos_a * cos_e)
    }

    /// E0 per channel.
    pub fn perpendicular_irradiance(&self) -> DVec3 {
        self.color * self.irradiance
    }
}

/// Empty texels kept on each side of the caster, so that a bilinear tap at its
/// rim still reads a border of zeros.
pub const LIGHT_MAP_PAD: u32 = 2;

/// The orthographic frame of one light map: where its texels lie in the scene.
///
/// Light space is (u, v, z) in mm: u and v span the map, z = -to_light . x grows
/// away from the light. Texel (i, j) has its centre at
/// origin + (i + 1/2, j + 1/2) * texel, and stores z as z_n = (z - z_center) / z_half.
#[derive(Clone, Debug, PartialEq)]
pub struct LightFrame {
    /// Unit vector from the scene to the light.
    pub to_light: DVec3,
    /// Unit axis of the map's columns, perpendicular to the light.
    pub u: DVec3,
    /// Unit axis of the map's rows; (u, v, to_light) is right-handed.
    pub v: DVec3,
    /// Light-plane coordinates of the outer corner of texel (0, 0), mm.
    pub origin: DVec2,
    /// Side of a texel, mm. Texels are square.
    pub texel: f64,
    /// Texels along a side of the map.
    pub size: u32,
    /// Half of the caster's extent along u and v, mm; its middle is the map's but for the jitter.
    pub half: DVec2,
    /// Middle of the casters' depth range, mm.
    pub z_center: f64,
    /// Half of the casters' depth range, mm; never 0.
    pub z_half: f64,
}

impl LightFrame {
    /// Fits the frame tightly around `positions` (mm), seen from `to_light`.
    ///
    /// `jitter` shifts the grid by a fraction of a texel, in [-1/2, 1/2]^2, so that
    /// averaged frames see the caster through different texels.
    pub fn fit(
        positions: impl IntoIterator<Item = DVec3>,
        to_light: DVec3,
        size: u32,
        jitter: DVec2,
    ) -> Self {
        let (u, v) = tangent_frame(to_light);
        let [middle, half] = LightFrame::extents(positions, to_light);
        let extent = (2.0 * half.truncate()).max_element().max(1e-6);
        // One texel of the pad is spent on the jitter.
        let inner = f64::from(size.saturating_sub(2 * LIGHT_MAP_PAD).max(1));
        let texel = extent / inner;
        let origin =
            middle.truncate() - DVec2::splat(0.5 * texel * f64::from(size)) + jitter * texel;
        LightFrame {
            to_light,
            u,
            v,
            origin,
            texel,
            size,
            half: half.truncate(),
            z_center: middle.z,
            z_half: half.z.max(1e-3 * extent),
        }
    }

    /// Middle and half extents (u, v, z) of `positions` seen from `to_light`, mm.
    pub fn extents(positions: impl IntoIterator<Item = DVec3>, to_light: DVec3) -> [DVec3; 2] {
        let (u, v) = tangent_frame(to_light);
        let mut lo = DVec3::INFINITY;
        let mut hi = DVec3::NEG_INFINITY;
        for p in positions {
            let q = DVec3::new(u.dot(p), v.dot(p), -to_light.dot(p));
            lo = lo.min(q);
            hi = hi.max(q);
        }
        [0.5 * (lo + hi), 0.5 * (hi - lo)]
    }

    /// The frame of one of several maps of one scale, that of a caster with half extents `reach` (u, v, z; mm), around
    /// `positions` (mm), which reach no further.
    ///
    /// Its corner lies on a grid of texels that the origin is on, and its middle depth on one of the same step: as
    /// the caster moves, texels stay where they are, and others come into use.
    pub fn place(
        positions: impl IntoIterator<Item = DVec3>,
        to_light: DVec3,
        reach: DVec3,
        size: u32,
    ) -> Self {
        let (u, v) = tangent_frame(to_light);
        let [middle, _] = LightFrame::extents(positions, to_light);
        let extent = 2.0 * reach.truncate().max_element().max(5e-7);
        // The pad keeps its texel for the jitter, and one more makes room for the grid.
        let inner = f64::from(size.saturating_sub(2 * LIGHT_MAP_PAD + 1).max(1));
        let texel = extent / inner;
        let corner = middle.truncate() - DVec2::splat(0.5 * texel * f64::from(size));
        let snapped = (middle.z / texel).round() * texel;
        let room = 0.5 * texel;
        LightFrame {
            to_light,
            u,
            v,
            origin: (corner / texel).round() * texel,
            texel,
            size,
            half: reach.truncate() + room,
            z_center: snapped,
            z_half: (reach.z + room).max(1e-3 * extent),
        }
    }

    /// Scene position to (u, v, z), mm.
    pub fn to_light_space(&self, p: DVec3) -> DVec3 {
        DVec3::new(self.u.dot(p), self.v.dot(p), -self.to_light.dot(p))
    }

    /// Light-plane position (mm) to texel coordinates: texel (i, j) spans [i, i+1) x [j, j+1).
    pub fn to_texel(&self, uv: DVec2) -> DVec2 {
        (uv - self.origin) / self.texel
    }

    /// Centre of texel (i, j) in the light plane, mm.
    pub fn texel_center(&self, i: u32, j: u32) -> DVec2 {
        self.origin + DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5) * self.texel
    }

    /// Area of a texel, mm^2.
    pub fn texel_area(&self) -> f64 {
        self.texel * self.texel
    }
}

/// Two unit vectors that complete `n` to a right-handed orthonormal basis.
///
/// u is horizontal unless `n` is vertical, so that the map turns smoothly with the azimuth.
fn tangent_frame(n: DVec3) -> (DVec3, DVec3) {
    let up = if n.y.abs() > 0.9999 {
        DVec3::Z
    } else {
        DVec3::Y
    };
    let u = up.cross(n).normalize();
    (u, n.cross(u))
}
