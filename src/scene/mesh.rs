//! Triangle meshes.

use glam::DVec3;
use std::collections::HashMap;

/// An indexed triangle mesh, in mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, mm.
    pub positions: Vec<DVec3>,
    /// Unit vertex normals, as many as positions.
    pub normals: Vec<DVec3>,
    /// Texture coordinates, as many as positions (zeros where the file has none).
    pub uvs: Vec<[f32; 2]>,
    /// Counter-clockwise triangles as indices into the vertices.
    pub triangles: Vec<[u32; 3]>,
}

/// Twice the area of a triangle over the square of its longest edge, below which it
/// counts as degenerate: far under what the rounding of f32 positions can produce
/// from a triangle that someone meant.
const DEGENERATE: f64 = 1e-10;

/// How far from the middle, in radii, does a camera surely see no back face through its near plane?
pub(super) const OUTSIDE: f64 = 1.1;

impl Mesh {
    /// The corners of the axis-aligned bounding box, mm; none without vertices.
    pub fn bounding_box(&self) -> Option<(DVec3, DVec3)> {
        let mut points = self.positions.iter().copied();
        let first = points.next()?;
        Some(points.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p))))
    }

    /// Middle of the bounding box, mm; the origin without vertices.
    pub fn center(&self) -> DVec3 {
        self.bounding_box()
            .map_or(DVec3::ZERO, |(lo, hi)| 0.5 * (lo + hi))
    }

    /// Radius around [`center`](Mesh::center) that holds every vertex, mm.
    pub fn bounding_radius(&self) -> f64 {
        let center = self.center();
        self.positions
            .iter()
            .map(|p| p.distance_squared(center))
            .fold(0.0, f64::max)
            .sqrt()
    }

    /// The mesh with every length multiplied by `unit` (mm per mesh unit, above 0).
    #[must_use]
    pub fn scaled(mut self, unit: f64) -> Mesh {
        for p in &mut self.positions {
            *p *= unit;
        }
        self
    }

    /// The three corners of each triangle, mm. Triangles whose indices lie outside the
    /// vertices, which no loader here produces, are left out.
    pub fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles
            .iter()
            .filter_map(|triangle| corners(&self.positions, triangle))
    }

    /// Whether it bounds a solid: closed, and every part of it with its faces outward. From outside
    /// only front faces are then seen.
    ///
    /// A hollow, whose faces point into it, does not count as one.
    pub fn is_solid(&self) -> bool {
        let mut welded: HashMap<[u64; 3], u32> = HashMap::with_capacity(self.positions.len());
        let points: Vec<u32> = self
            .positions
            .iter()
            .map(|&p| {
                let next = welded.len() as u32;
                *welded.entry(weld_key(p)).or_insert(next)
            })
            .collect();
        // Closed: each edge runs once in either direction. Equal ones, by their lower end first, become neighbours.
        let mut edges = Vec::with_capacity(3 * self.triangles.len());
        let mut parts = Parts::new(welded.len());
        for triangle in &self.triangles {
            for corner in 0..3 {
                let (from, to) = (triangle[corner], triangle[(corner + 1) % 3]);
                let (Some(&from), Some(&to)) = (points.get(from as usize), points.get(to as usize))
                else {
                    return false;
                };
                parts.join(from, to);
                edges.push((from.min(to), from.max(to), from < to));
            }
        }
        edges.sort_unstable();
        let matched = edges.chunks(2).all(|pair| match pair {
            [a, b] => (a.0, a.1) == (b.0, b.1) && a.2 != b.2,
            _ => false,
        });
        if edges.is_empty() || !matched {
            return false;
        }
        // Outward: each part has a volume that is not negative.
        let center = self.center();
        let mut volumes: HashMap<u32, f64> = HashMap::new();
        for (triangle, [a, b, c]) in self.triangles.iter().zip(self.corners()) {
            let part = parts.of(points[triangle[0] as usize]);
            let six = (a - center).dot((b - center).cross(c - center));
            *volumes.entry(part).or_default() += six;
        }
        volumes.values().all(|&volume| volume > 0.0)
    }

    /// Whether from `eye` each back face lies behind a front face: the mesh encloses solids, and `eye` is
    /// outside the sphere around it, so that no near plane opens them.
    pub fn is_solid_from(&self, eye: DVec3) -> bool {
        self.is_outside(eye) && self.is_solid()
    }

    /// Whether `eye` is outside the sphere around the mesh, with a margin.
    pub fn is_outside(&self, eye: DVec3) -> bool {
        eye.distance(self.center()) > OUTSIDE * self.bounding_radius()
    }

    /// Removes triangles without area and then the vertices that nothing refers to, so
    /// that bounds and fits see only what is drawn. Returns how many triangles went.
    pub fn drop_degenerate(&mut self) -> usize {
        let before = self.triangles.len();
        let positions = &self.positions;
        self.triangles
            .retain(|triangle| corners(positions, triangle).is_some_and(|c| !is_degenerate(c)));
        self.drop_unused_vertices();
        before - self.triangles.len()
    }

    fn drop_unused_vertices(&mut self) {
        let mut used = vec![false; self.positions.len()];
        for &index in self.triangles.iter().flatten() {
            if let Some(used) = used.get_mut(index as usize) {
                *used = true;
            }
        }
        let mut next = 0;
        let renumbered: Vec<u32> = used
            .iter()
            .map(|&used| {
                let index = next;
                next += u32::from(used);
                index
            })
            .collect();
        fn keep<T>(values: &mut Vec<T>, used: &[bool]) {
            let mut used = used.iter();
            values.retain(|_| used.next().is_some_and(|&used| used));
        }
        keep(&mut self.positions, &used);
        keep(&mut self.normals, &used);
        keep(&mut self.uvs, &used);
        for index in self.triangles.iter_mut().flatten() {
            if let Some(&new) = renumbered.get(*index as usize) {
                *index = new;
            }
        }
    }

    /// Makes the normals unit vectors, as many as positions. A normal that is missing,
    /// zero or not finite is computed from the faces around its position, weighted by
    /// their area and by the angle they span there. Vertices at one position share it,
    /// so that texture seams stay smooth.
    pub fn complete_normals(&mut self) {
        self.normals.resize(self.positions.len(), DVec3::ZERO);
        let unusable = |n: &DVec3| n.try_normalize().is_none();
        if self.normals.iter().any(unusable) {
            let smooth = self.smooth_normals();
            for (normal, smooth) in self.normals.iter_mut().zip(smooth) {
                if unusable(normal) {
                    *normal = smooth;
                }
            }
        }
        for normal in &mut self.normals {
            *normal = normal.normalize_or(DVec3::Y);
        }
    }

    /// Normals computed from the faces alone, as many as positions.
    fn smooth_normals(&self) -> Vec<DVec3> {
        let mut own = vec![DVec3::ZERO; self.positions.len()];
        let mut welded: HashMap<[u64; 3], DVec3> = HashMap::with_capacity(self.positions.len());
        for triangle in &self.triangles {
            let Some(c) = corners(&self.positions, triangle) else {
                continue;
            };
            // The cross product carries the area as its length.
            let face = (c[1] - c[0]).cross(c[2] - c[0]);
            for (corner, &index) in triangle.iter().enumerate() {
                let here = c[corner];
                let to_next = c[(corner + 1) % 3] - here;
                let to_last = c[(corner + 2) % 3] - here;
                let weighted = face * to_next.angle_between(to_last);
                *welded.entry(weld_key(here)).or_default() += weighted;
                if let Some(own) = own.get_mut(index as usize) {
                    *own += weighted;
                }
            }
        }
        self.positions
            .iter()
            .zip(own)
            .map(|(&p, own)| {
                let sum = welded.get(&weld_key(p)).copied().unwrap_or_default();
                // The two faces of a sheet cancel where they are welded: there, a vertex
                // keeps to its own faces.
                if sum.length() > 1e-6 * own.length() {
                    sum
                } else {
                    own
                }
            })
            .map(|n| n.normalize_or(DVec3::Y))
            .collect()
    }
}

/// Which points hang together: each points to another of its part, and one of them to itself.
struct Parts(Vec<u32>);

impl Parts {
    fn new(points: usize) -> Self {
        Parts((0..points as u32).collect())
    }

    /// The one that stands for the part of `point`.
    fn of(&mut self, mut point: u32) -> u32 {
        while self.0[point as usize] != point {
            // Shortens the way for the next.
            let next = self.0[self.0[point as usize] as usize];
            self.0[point as usize] = next;
            point = next;
        }
        point
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[a as usize] = b;
    }
}

fn corners(positions: &[DVec3], triangle: &[u32; 3]) -> Option<[DVec3; 3]> {
    let at = |index: u32| positions.get(index as usize).copied();
    Some([at(triangle[0])?, at(triangle[1])?, at(triangle[2])?])
}

fn is_degenerate([a, b, c]: [DVec3; 3]) -> bool {
    let longest = (b - a)
        .length_squared()
        .max((c - b).length_squared())
        .max((a - c).length_squared());
    // Asked this way round, NaN and three equal corners have no area.
    let has_area = (b - a).cross(c - a).length() > DEGENERATE * longest;
    !has_area
}

/// Equal for equal positions; adding zero turns -0 into 0.
fn weld_key(p: DVec3) -> [u64; 3] {
    p.to_array().map(|v| (v + 0.0).to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Mesh {
        Mesh {
            positions: positions.iter().map(|&p| DVec3::from_array(p)).collect(),
            normals: vec![],
            uvs: vec![[0.0; 2]; positions.len()],
            triangles: triangles.to_vec(),
        }
    }

    /// A cube of side 2 around the origin.
    fn cube() -> Mesh {
        let positions: Vec<[f64; 3]> = (0..8)
            .map(|i| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|b| f64::from(2 * b - 1)))
            .collect();
        let quads = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let triangles: Vec<[u32; 3]> = quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        mesh(&positions, &triangles)
    }

    #[test]
    fn a_solid_is_closed_and_outward() {
        assert!(cube().is_solid());
        let changed = |change: &dyn Fn(&mut Mesh)| {
            let mut mesh = cube();
            change(&mut mesh);
            mesh.is_solid()
        };
        // A seam: vertices of their own at one position.
        assert!(changed(&|m| {
            m.positions.extend(m.positions.clone());
            m.triangles[3..].iter_mut().flatten().for_each(|i| *i += 8);
        }));
        // A hole, a face turned over, a face twice, a loose triangle.
        assert!(!changed(&|m| {
            m.triangles.pop();
        }));
        assert!(!changed(&|m| m.triangles[5].swap(0, 1)));
        assert!(!changed(&|m| m.triangles.push(m.triangles[0])));
        assert!(!changed(&|m| {
            let [a, b, c] = m.triangles[0];
            m.triangles.extend([[a, b, c], [c, b, a]]);
        }));
        // Inside out, and a second part that is: a hollow.
        assert!(!changed(&|m| m
            .triangles
            .iter_mut()
            .for_each(|t| t.swap(0, 1))));
        let twice = |turned: bool| {
            changed(&|m| {
                m.positions
                    .extend(cube().positions.iter().map(|p| *p * 0.5));
                let second = cube().triangles.into_iter().map(|t| t.map(|i| i + 8));
                m.triangles.extend(second.map(
                    |[a, b, c]| {
                        if turned { [b, a, c] } else { [a, b, c] }
                    },
                ));
            })
        };
        assert!(twice(false));
        assert!(!twice(true));
        // A sheet with two faces is closed, and holds nothing.
        let sheet = mesh(
            &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]],
            &[[0, 1, 2], [0, 2, 1]],
        );
        assert!(!sheet.is_solid());
        assert!(!Mesh::default().is_solid());
    }

    #[test]
    fn normals_of_a_cube_point_along_its_diagonals() {
        // Angle weights make the result independent of how the quads are cut; area weights
        // alone would lean towards the side with two triangles at a corner.
        let mut cube = cube();
        cube.complete_normals();
        for (p, n) in cube.positions.iter().zip(&cube.normals) {
            // A face's two triangles at a corner have half a right angle each.
            assert!(n.dot(p.normalize()) > 1.0 - 1e-12, "{p} {n}");
        }
    }

    #[test]
    fn seams_share_a_normal() {
        // Two triangles of a roof that meet at x = 0 with vertices of their own.
        let mut roof = mesh(
            &[
                [0., 1., 0.],
                [0., 1., 1.],
                [1., 0., 0.],
                [0., 1., 0.],
                [0., 1., 1.],
                [-1., 0., 0.],
            ],
            &[[0, 1, 2], [3, 5, 4]],
        );
        roof.complete_normals();
        assert_eq!(roof.normals[0], roof.normals[3]);
        assert!(roof.normals[0].y > 0.999_999);
    }

    #[test]
    fn the_faces_of_a_sheet_keep_their_sides() {
        let mut sheet = mesh(
            &[
                [0., 0., 0.],
                [1., 0., 0.],
                [0., 1., 0.],
                [0., 0., 0.],
                [1., 0., 0.],
                [0., 1., 0.],
            ],
            &[[0, 1, 2], [3, 5, 4]],
        );
        sheet.complete_normals();
        assert_eq!(sheet.normals[0], DVec3::Z);
        assert_eq!(sheet.normals[3], DVec3::NEG_Z);
    }

    #[test]
    fn good_normals_are_kept_and_bad_ones_replaced() {
        let mut one = mesh(&[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]], &[[0, 1, 2]]);
        one.normals = vec![DVec3::X * 5.0, DVec3::ZERO, DVec3::NAN];
        one.complete_normals();
        assert_eq!(one.normals, [DVec3::X, DVec3::Z, DVec3::Z]);
    }

    #[test]
    fn degenerate_triangles_and_their_vertices_go() {
        let mut m = mesh(
            &[
                [9., 9., 9.],
                [0., 0., 0.],
                [1., 0., 0.],
                [0., 1., 0.],
                [2., 0., 0.],
            ],
            &[[1, 2, 3], [1, 2, 4], [0, 0, 1]],
        );
        assert_eq!(m.drop_degenerate(), 2);
        assert_eq!(m.triangles, [[0, 1, 2]]);
        assert_eq!(m.positions.len(), 3);
        assert_eq!(m.uvs.len(), 3);
        assert_eq!(
            m.bounding_box(),
            Some((DVec3::ZERO, DVec3::new(1., 1., 0.)))
        );
    }

    #[test]
    fn a_solid_is_one_from_outside_alone() {
        let solid = cube();
        let outside = DVec3::X * (1.01 * OUTSIDE * 3f64.sqrt());
        assert!(solid.is_solid_from(outside));
        assert!(!solid.is_solid_from(outside * 0.95));
        let mut open = cube();
        open.triangles.pop();
        assert!(!open.is_solid_from(outside));
    }

    #[test]
    fn bounds_scale_with_the_unit() {
        let cube = cube();
        assert_eq!(cube.center(), DVec3::ZERO);
        let radius = cube.bounding_radius();
        assert!((radius - 3f64.sqrt()).abs() < 1e-12);
        assert!((cube.scaled(2.5).bounding_radius() - 2.5 * radius).abs() < 1e-12);
        assert_eq!(Mesh::default().bounding_box(), None);
    }
}
