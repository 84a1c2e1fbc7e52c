//! Single scattering by ray casting on the mesh itself: the reference of the march.
//!
//! No GPU stage has this as its twin. What the march of [`crate::cpu::shade`] reads from maps, this
//! asks the triangles: where the refracted view ray leaves the object, and how far the light came.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::{BHShape, BoundingHierarchy as _};
use bvh::bvh::Bvh;
use bvh::ray::Ray;
use glam::DVec3;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::cpu::shade::{MIN_COS_OUT, Receiver, receiver};
use crate::cpu::view;
use crate::optics::fresnel;
use crate::optics::single::{self, Steps};
use crate::scene::{Material, Mesh, Multiple, Plan};

/// Steps along the refracted ray, each taken at its middle.
const STEPS: u32 = 1024;

/// Thickness of the first step, in mean free paths of the densest channel.
const FIRST_STEP: f64 = 0.02;

/// Depth at which the integral ends, in mean free paths of the thinnest channel: e^-40 is 4e-18.
const LAST_STEP: f64 = 40.0;

/// Rays against a mesh.
pub struct Tracer<'a> {
    mesh: &'a Mesh,
    bvh: Bvh<f64, 3>,
    shapes: Vec<Shape>,
}

/// Where a line meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, mm.
    pub t: f64,
    /// Whether the ray leaves the object there: it runs with the triangle's own normal.
    pub leaves: bool,
    /// Interpolated unit vertex normal.
    pub normal: DVec3,
}

/// A triangle as the hierarchy wants it.
struct Shape {
    corners: [DVec3; 3],
    triangle: usize,
    node: usize,
}

fn point(p: DVec3) -> Point3<f64> {
    Point3::new(p.x, p.y, p.z)
}

impl Bounded<f64, 3> for Shape {
    fn aabb(&self) -> Aabb<f64, 3> {
        let [a, b, c] = self.corners;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // Flat boxes have their place in the hierarchy, but a ray in their plane would miss them.
        let margin = DVec3::splat(1e-9 * (1.0 + low.abs().max(high.abs()).max_element()));
        Aabb::with_bounds(point(low - margin), point(high + margin))
    }
}

impl BHShape<f64, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl<'a> Tracer<'a> {
    /// Builds the hierarchy over the triangles of `mesh`.
    pub fn new(mesh: &'a Mesh) -> Self {
        let mut shapes: Vec<Shape> = (0..)
            .zip(&mesh.triangles)
            .map(|(triangle, corners)| Shape {
                corners: corners.map(|i| mesh.positions[i as usize]),
                triangle,
                node: 0,
            })
            .collect();
        let bvh = Bvh::build_par(&mut shapes);
        Tracer { mesh, bvh, shapes }
    }

    /// Every triangle that the ray from `origin` along the unit vector `direction` meets beyond it,
    /// from near to far.
    pub fn hits(&self, origin: DVec3, direction: DVec3) -> Vec<Hit> {
        let ray = Ray::new(
            point(origin),
            Vector3::new(direction.x, direction.y, direction.z),
        );
        let mut hits: Vec<Hit> = self
            .bvh
            .traverse_iterator(&ray, &self.shapes)
            .filter_map(|shape| self.hit(shape, origin, direction))
            .collect();
        hits.sort_by(|a, b| a.t.total_cmp(&b.t));
        hits
    }

    /// Möller and Trumbore 1997.
    fn hit(&self, shape: &Shape, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let [a, b, c] = shape.corners;
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let det = ab.dot(p);
        if det == 0.0 {
            return None;
        }
        let s = origin - a;
        let u = s.dot(p) / det;
        let q = s.cross(ab);
        let v = direction.dot(q) / det;
        let t = ac.dot(q) / det;
        // A hair of overlap, so that a line through a shared edge meets one of the two.
        const EDGE: f64 = -1e-9;
        if u < EDGE || v < EDGE || u + v > 1.0 - EDGE || t <= 0.0 {
            return None;
        }
        let [i, j, k] = self.mesh.triangles[shape.triangle].map(|i| self.mesh.normals[i as usize]);
        Some(Hit {
            t,
            leaves: det < 0.0,
            normal: (i * (1.0 - u - v) + j * u + k * v).normalize_or_zero(),
        })
    }
}

/// What a point of the surface is lit by, and made of.
pub struct Medium<'a> {
    /// Rays against the object.
    pub tracer: &'a Tracer<'a>,
    /// The medium.
    pub material: &'a Material,
    /// Unit vector to the light.
    pub to_light: DVec3,
    /// Irradiance E0 on a surface perpendicular to the light, per channel.
    pub irradiance: DVec3,
}

/// Radiance that is scattered once towards the viewer of `receiver`, per channel.
///
/// The refracted ray is followed to where it first leaves the object. At each of 1024 steps a line is
/// drawn to the light; the path through the medium is taken from the outermost surface that it crosses, at whose
/// interpolated normal the light enters, with Jensen's correction for its refraction (2001, section 2.3). So the gaps
/// between surfaces count as medium, as they do in a light map.
pub fn single(medium: &Medium, receiver: &Receiver) -> DVec3 {
    let material = medium.material;
    let sigma_s = material.unreduced_sigma_s();
    let sigma_t = sigma_s + material.sigma_a;
    let inward = single::refract(receiver.wo, receiver.n, material.eta);
    let exit = medium
        .tracer
        .hits(receiver.p, inward)
        .iter()
        .find(|hit| hit.leaves)
        .map_or(f64::INFINITY, |hit| hit.t);
    let far = exit.min(LAST_STEP / sigma_t.min_element());
    let steps = Steps::new(FIRST_STEP / sigma_t.max_element(), far, STEPS);
    let sum: DVec3 = (0..STEPS)
        .map(|i| {
            let (from, to) = (steps.depth(i), steps.depth(i + 1));
            let x = 0.5 * (from + to);
            let hits = medium.tracer.hits(receiver.p + inward * x, medium.to_light);
            let Some(lit) = hits.last() else {
                return DVec3::ZERO;
            };
            // An open sheet seen from behind is lit there, too, as in the light map.
            let normal = if lit.leaves { lit.normal } else { -lit.normal };
            let cos = normal.dot(medium.to_light).max(0.0);
            let path = x + lit.t * single::path_factor(cos, material.eta);
            let entering = fresnel::transmittance(cos, material.eta);
            (sigma_t * -path).exp() * (entering * (to - from))
        })
        .sum();
    let cos_out = receiver.n.dot(receiver.wo).max(MIN_COS_OUT);
    let leaving = fresnel::transmittance(cos_out, material.eta);
    let phase = single::henyey_greenstein(medium.to_light.dot(inward), material.g);
    medium.irradiance * sigma_s * sum * (leaving * phase)
}

/// The term of single scattering of `plan`'s picture, row-major, as a mean over its frames, premultiplied by
/// coverage; 0 in the columns of [`Multiple::Brdf`]. After each row `progress` hears of one more of
/// [`rows`].
pub fn picture(plan: &Plan, progress: &(dyn Fn() + Sync)) -> Vec<[f32; 3]> {
    let mesh = &plan.scene.mesh;
    let (center, radius) = (plan.center(), plan.radius());
    let mut centered = mesh.clone();
    centered.positions.iter_mut().for_each(|p| *p -= center);
    let tracer = Tracer::new(&centered);
    let medium = Medium {
        tracer: &tracer,
        material: &plan.scene.material,
        to_light: plan.scene.light.to_light(),
        irradiance: plan.scene.light.perpendicular_irradiance(),
    };
    let [width, height] = plan.size.map(|side| side as usize);
    let opaque = |column: usize| {
        plan.parts().any(|([first, end], method)| {
            method == Multiple::Brdf && (first as usize..end as usize).contains(&column)
        })
    };
    let mut sum = vec![[0.0_f64; 3]; width * height];
    for frame in 0..plan.frames_averaged {
        let view = plan.view_at(center, radius, frame);
        let gbuffer = view::draw(&centered, &view, width, height);
        sum.par_chunks_mut(width)
            .enumerate()
            .for_each(|(row, line)| {
                for (column, sum) in line.iter_mut().enumerate() {
                    if opaque(column) {
                        continue;
                    }
                    if let Some(receiver) = receiver(&gbuffer, &view, row * width + column) {
                        let radiance = single(&medium, &receiver);
                        *sum = [0, 1, 2].map(|c| sum[c] + radiance[c]);
                    }
                }
                progress();
            });
    }
    let share = 1.0 / f64::from(plan.frames_averaged);
    sum.iter().map(|s| s.map(|x| (x * share) as f32)).collect()
}

/// Rows that [`picture`] goes through, over all frames.
pub fn rows(plan: &Plan) -> u64 {
    u64::from(plan.size[1]) * u64::from(plan.frames_averaged)
}
