//! The uniforms of one frame: `shared.glsl`'s block, field by field.

use bytemuck::Zeroable;
use glam::{DVec2, DVec3, Vec3};

use crate::optics::Dipole;
use crate::optics::single::{self, PathFit, edge_variance};
use crate::scene::limits::RINGS;
use crate::scene::plan::LEVELS_MAX;
use crate::scene::pyramid::Atlas;
use crate::scene::{LightFrame, Plan, Taps, View};

/// Fraction of clip depth that the caster's range fills: `LIGHT_DEPTH_MARGIN` of `shared.glsl`.
pub const LIGHT_DEPTH_MARGIN: f64 = 1.001;

/// How many rings there may be.
const RINGS_MAX: usize = *RINGS.end() as usize;

/// Smallest effective transport coefficient, mm^-1. Without absorption the sampling of the
/// radius would divide by 0; this floor changes R_d by less than 1e-6 within 100 mm.
const SIGMA_TR_MIN: f64 = 1e-5;

/// The block `Frame` of `shared.glsl`, in its order. Lengths in mm, coefficients in mm^-1.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Uniforms {
    /// Scene to clip space of the camera, by columns.
    pub view_proj: [f32; 16],
    /// Scene to clip space of the light, by columns.
    pub light_proj: [f32; 16],
    /// Camera position; w: near * far.
    pub eye: [f32; 4],
    /// Ray through pixel coordinates (0, 0); w: far.
    pub ray_0: [f32; 4],
    /// Change of the ray by one pixel right; w: far - near.
    pub ray_x: [f32; 4],
    /// Change of the ray by one pixel down.
    pub ray_y: [f32; 4],
    /// Axis of the light map's columns; w: minus the map's corner.
    pub light_u: [f32; 4],
    /// Axis of the light map's rows; w: minus the map's corner.
    pub light_v: [f32; 4],
    /// Axis away from the light; w: minus the middle depth.
    pub light_z: [f32; 4],
    /// Texel, 1 / texel, half depth range, 1 / half depth range.
    pub light_scale: [f32; 4],
    /// Side of the light map in texels, 1 / columns and 1 / rows of its image; w: [`Taps::kept`].
    pub map: [f32; 4],
    /// E0 per channel; w: area of a light texel, mm^2.
    pub irradiance: [f32; 4],
    /// Effective transport coefficient per channel; w: eta.
    pub sigma_tr: [f32; 4],
    /// Depth of the real source per channel; w: GGX alpha.
    pub z_r: [f32; 4],
    /// Height of the virtual source per channel; w: exposure.
    pub z_v: [f32; 4],
    /// Reduced albedo per channel.
    pub alpha_prime: [f32; 4],
    /// Total diffuse reflectance per channel.
    pub r_tot: [f32; 4],
    /// Offsets of radius and angle of the frame's samples; z: 1 / (frames so far + 1).
    pub sequence: [f32; 4],
    /// Linear rgb; w: 1 where it is put behind the picture.
    pub background: [f32; 4],
    /// Scattering coefficient, not reduced, per channel.
    pub sigma_s: [f32; 4],
    /// Extinction per channel; w: mean cosine g of the phase function.
    pub sigma_t: [f32; 4],
    /// Coefficients of [`PathFit`].
    pub path: [f32; 4],
    /// First step and deepest sample of the march, mm; transmittance at normal incidence; variance from which depths
    /// under a tap are those of two surfaces, over the half depth range squared.
    pub march: [f32; 4],
    /// What the mixture taps.
    pub levels: LevelTable,
    /// The volumes among it.
    pub volumes: VolumeTable,
    /// Of each ring E0 times the area of a texel times R_d at the ring's radius; w: 1 / side of its level of the pyramid.
    pub rings: [[f32; 4]; RINGS_MAX],
}

/// Mean distance of a square's points from its middle, in half sides, and of a ring's between squares of half sides
/// 1/2 and 1: (4 D - D/2) / 3, D = (sqrt 2 + asinh 1) / 3.
const RADII: [f64; 2] = [0.765_195_716, 0.892_728_336];

/// What the rings of a map in `light` weigh: E0 a R_d, with R_d at the mean radius of the ring.
fn rings(dipoles: &[Dipole; 3], light: &LightFrame, irradiance: DVec3) -> [[f32; 4]; RINGS_MAX] {
    std::array::from_fn(|k| {
        let side = (k as f64).exp2();
        let radius = RADII[k.min(1)] * 0.5 * side * light.texel;
        let r_d = DVec3::from_array(dipoles.map(|d| d.r_d_squared(radius * radius)));
        let texels = (light.size >> k).max(1);
        vec4(
            irradiance * light.texel_area() * r_d,
            1.0 / f64::from(texels),
        )
    })
}

/// The block `Before` of `motion.glsl`: what a pixel's motion is made of.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Reprojection {
    /// Scene to clip space of the camera, without jitter, by columns.
    pub now: [f32; 16],
    /// The same of the frame before.
    pub before: [f32; 16],
    /// Columns and rows of the picture.
    pub picture: [f32; 4],
}

impl Reprojection {
    /// Of a picture of `size` pixels, seen by `now` and by `before` in the frame before; neither is jittered.
    pub fn new(size: [u32; 2], now: &View, before: &View) -> Self {
        let [width, height] = size.map(|side| side as f32);
        Reprojection {
            now: now.view_proj.as_mat4().to_cols_array(),
            before: before.view_proj.as_mat4().to_cols_array(),
            picture: [width, height, 0.0, 0.0],
        }
    }
}

/// The levels that the mixture taps, `level_weights` and `level_places` of `shared.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct LevelTable {
    /// Of each level: W per channel; w: s^2, s over the half depth range.
    pub weights: [[f32; 4]; LEVELS_MAX as usize],
    /// 2^-level, and the level's corner in the atlas, texels; w: s.
    pub places: [[f32; 4]; LEVELS_MAX as usize],
}

impl LevelTable {
    /// What `taps` say of a map whose half depth range is `z_half` mm, and whose pyramid lies in
    /// `atlas`.
    pub fn new(taps: &Taps, z_half: f64, atlas: &Atlas) -> Self {
        let mut table = LevelTable::zeroed();
        for (i, level) in taps.levels.iter().enumerate() {
            let s = taps.widths[i] / z_half;
            // Those that read a volume alone have none.
            let [x, y] = atlas
                .places
                .get(level as usize)
                .map_or([0; 2], |p| p.origin);
            table.weights[i] = vec4(taps.weights[i], s * s);
            table.places[i] = [
                (-f64::from(level)).exp2() as f32,
                x as f32,
                y as f32,
                s as f32,
            ];
        }
        table
    }
}

/// The volumes that the mixture taps, `volume_scale` and `volume_places` of `shared.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct VolumeTable {
    /// 1 / columns, 1 / rows and 1 / slices of their image; w: half depth range in texels.
    pub scale: [f32; 4],
    /// Of each level that has one: its cell at the map's corner, in the middle of the depths; w: cells a texel.
    pub places: [[f32; 4]; LEVELS_MAX as usize],
}

impl VolumeTable {
    /// What `taps` say of a map in `frame`.
    pub fn new(taps: &Taps, frame: &LightFrame) -> Self {
        let mut table = VolumeTable::zeroed();
        let Some(volumes) = &taps.volumes else {
            return table;
        };
        let image = DVec3::from_array(volumes.image.map(f64::from));
        table.scale = vec4(1.0 / image, frame.z_half / frame.texel);
        let places = &mut table.places[taps.first_volume as usize..];
        for (place, volume) in places.iter_mut().zip(&volumes.volumes) {
            let grid = &volumes.grids[volume.grid];
            let origin = DVec3::from_array(volume.origin.map(f64::from));
            *place = vec4(origin + grid.shift, grid.scale);
        }
        table
    }
}

fn vec4(v: DVec3, w: f64) -> [f32; 4] {
    v.as_vec3().extend(w as f32).to_array()
}

impl Uniforms {
    /// The uniforms of the frame after `done` others of the plan, as seen by `view` and lit through `light`.
    ///
    /// Both are relative to the scene's centre. `map` is the size of the image that the light map
    /// lies in. `path` is the fit of the material's index. `sequence` offsets the samples' radius and angle.
    pub fn new(
        plan: &Plan,
        view: &View,
        light: &LightFrame,
        atlas: [u32; 2],
        (levels, volumes, kept, path): (&LevelTable, &VolumeTable, f64, &PathFit),
        done: u32,
        sequence: DVec2,
    ) -> Self {
        let material = &plan.scene.material;
        let dipoles = material.dipoles();
        // `brdf` sums over no texels: it keeps the total of the medium itself.
        let totals = DVec3::from_array(dipoles.map(|d| d.total()));
        let dipoles = dipoles.map(|d| d.resolved(light.texel));
        let rgb = |f: fn(&Dipole) -> f64| DVec3::from_array([0, 1, 2].map(|c| f(&dipoles[c])));
        let sigma_s = material.unreduced_sigma_s();
        let sigma_t = sigma_s + material.sigma_a;
        let background = plan
            .background
            .map_or([0.0; 4], |b| vec4(DVec3::from_array(b), 1.0));
        Uniforms {
            view_proj: view.view_proj.as_mat4().to_cols_array(),
            light_proj: light_projection(light),
            eye: vec4(view.eye, view.near * view.far),
            ray_0: vec4(view.ray_0, view.far),
            ray_x: vec4(view.ray_x, view.far - view.near),
            ray_y: vec4(view.ray_y, 0.0),
            light_u: vec4(light.u, -light.origin.x),
            light_v: vec4(light.v, -light.origin.y),
            light_z: vec4(-light.to_light, -light.z_center),
            light_scale: vec4(
                DVec3::new(light.texel, 1.0 / light.texel, light.z_half),
                1.0 / light.z_half,
            ),
            map: [
                light.size as f32,
                1.0 / atlas[0] as f32,
                1.0 / atlas[1] as f32,
                kept as f32,
            ],
            irradiance: vec4(
                plan.scene.light.perpendicular_irradiance(),
                light.texel_area(),
            ),
            sigma_tr: vec4(
                rgb(|d| d.sigma_tr).max(DVec3::splat(SIGMA_TR_MIN)),
                material.eta,
            ),
            z_r: vec4(rgb(|d| d.z_r), material.roughness),
            z_v: vec4(rgb(|d| d.z_v), plan.exposure),
            alpha_prime: vec4(rgb(|d| d.alpha_prime), 0.0),
            r_tot: vec4(totals, 0.0),
            sequence: vec4(sequence.extend(1.0 / (f64::from(done) + 1.0)), 0.0),
            background,
            sigma_s: vec4(sigma_s, 0.0),
            sigma_t: vec4(sigma_t, material.g),
            path: path.c.map(|c| c as f32),
            march: [
                (single::FIRST_STEP / sigma_t.max_element()) as f32,
                (single::LAST_STEP / sigma_t.min_element()) as f32,
                path.normal as f32,
                edge_variance(light.texel / light.z_half) as f32,
            ],
            levels: *levels,
            volumes: *volumes,
            rings: rings(&dipoles, light, plan.scene.light.perpendicular_irradiance()),
        }
    }
}

/// Scene to clip space of the light: columns of the map along x, rows along y, depth
/// along z, with the margin of `to_light_depth` in `shared.glsl`.
fn light_projection(light: &LightFrame) -> [f32; 16] {
    let scale = 2.0 / (light.texel * f64::from(light.size));
    let depth = 0.5 / (light.z_half * LIGHT_DEPTH_MARGIN);
    let x = light.u * scale;
    let y = light.v * scale;
    let z = -light.to_light * depth;
    let column = |i: usize| Vec3::new(x[i] as f32, y[i] as f32, z[i] as f32).extend(0.0);
    let last = DVec3::new(
        -light.origin.x * scale - 1.0,
        -light.origin.y * scale - 1.0,
        0.5 - light.z_center * depth,
    );
    glam::Mat4::from_cols(column(0), column(1), column(2), last.as_vec3().extend(1.0))
        .to_cols_array()
}
