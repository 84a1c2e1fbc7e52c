//! Quadric-error edge collapse (Garland and Heckbert, "Surface simplification
//! using quadric error metrics") that never leaves the closed manifolds.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{DMat3, DVec3, Vec3};

use crate::mesh::Mesh;

/// A symmetric quadratic form: squared distance to a bundle of planes.
#[derive(Clone, Copy, Default)]
struct Quadric {
    a: [f64; 6],
    b: DVec3,
    c: f64,
}

impl Quadric {
    fn plane(n: DVec3, through: DVec3, weight: f64) -> Self {
        let d = -n.dot(through);
        Self {
            a: [
                n.x * n.x,
                n.x * n.y,
                n.x * n.z,
                n.y * n.y,
                n.y * n.z,
                n.z * n.z,
            ]
            .map(|v| v * weight),
            b: n * (d * weight),
            c: d * d * weight,
        }
    }

    /// Squared distance to a point, the gentle pull that keeps triangles well
    /// shaped where the surface is flat.
    fn point(p: DVec3, weight: f64) -> Self {
        Self {
            a: [weight, 0.0, 0.0, weight, 0.0, weight],
            b: -p * weight,
            c: p.length_squared() * weight,
        }
    }

    fn add(&mut self, o: &Self) {
        for (x, y) in self.a.iter_mut().zip(o.a) {
            *x += y;
        }
        self.b += o.b;
        self.c += o.c;
    }

    fn matrix(&self) -> DMat3 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        DMat3::from_cols(
            DVec3::new(xx, xy, xz),
            DVec3::new(xy, yy, yz),
            DVec3::new(xz, yz, zz),
        )
    }

    fn error(&self, p: DVec3) -> f64 {
        (p.dot(self.matrix() * p) + 2.0 * self.b.dot(p) + self.c).max(0.0)
    }

    /// The point of least error, if it is well determined.
    fn least(&self) -> Option<DVec3> {
        let m = self.matrix();
        let size = self.a[0] + self.a[3] + self.a[5];
        (m.determinant().abs() > 1e-9 * size.powi(3)).then(|| -(m.inverse() * self.b))
    }
}

/// A possible collapse of the edge `u`-`v` to `to`.
struct Collapse {
    cost: f64,
    u: u32,
    v: u32,
    stamp: (u32, u32),
    to: DVec3,
}

impl Ord for Collapse {
    // Cheapest first out of the max-heap, ties by index so that every run is
    // the same.
    fn cmp(&self, o: &Self) -> Ordering {
        o.cost
            .total_cmp(&self.cost)
            .then_with(|| (o.u, o.v).cmp(&(self.u, self.v)))
    }
}

impl PartialOrd for Collapse {
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        Some(self.cmp(o))
    }
}

impl PartialEq for Collapse {
    fn eq(&self, o: &Self) -> bool {
        self.cmp(o) == Ordering::Equal
    }
}

impl Eq for Collapse {}

/// A mesh on its way down.
pub struct Decimator {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    faces_of: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    stamps: Vec<u32>,
    heap: BinaryHeap<Collapse>,
    refused: Vec<(u32, u32)>,
    count: usize,
}

impl Decimator {
    /// Starts from `mesh`. `importance` (1 for plain surface) says how dear
    /// an error at a point is; squared distances are multiplied by it.
    pub fn new(mesh: &Mesh, importance: impl Fn(Vec3) -> f32) -> Self {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
        let mut faces_of = vec![Vec::new(); positions.len()];
        let mut quadrics = vec![Quadric::default(); positions.len()];
        let weights: Vec<f64> = mesh
            .positions
            .iter()
            .map(|&p| f64::from(importance(p)))
            .collect();
        for (f, t) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = t.map(|i| positions[i as usize]);
            let n = (b - a).cross(c - a);
            let area = 0.5 * n.length();
            let Some(n) = n.try_normalize() else { continue };
            for &i in t {
                faces_of[i as usize].push(f as u32);
                let weight = area * weights[i as usize];
                quadrics[i as usize].add(&Quadric::plane(n, a, weight));
                quadrics[i as usize].add(&Quadric::point(positions[i as usize], weight * 2e-4));
            }
        }
        let mut this = Self {
            alive: vec![true; mesh.triangles.len()],
            triangles: mesh.triangles.clone(),
            stamps: vec![0; positions.len()],
            heap: BinaryHeap::new(),
            refused: Vec::new(),
            count: mesh.triangles.len(),
            positions,
            faces_of,
            quadrics,
        };
        for t in &mesh.triangles {
            for k in 0..3 {
                let (u, v) = (t[k], t[(k + 1) % 3]);
                if u < v {
                    this.propose(u, v);
                }
            }
        }
        this
    }

    fn propose(&mut self, u: u32, v: u32) {
        let (u, v) = (u.min(v), u.max(v));
        let (a, b) = (self.positions[u as usize], self.positions[v as usize]);
        let mut q = self.quadrics[u as usize];
        q.add(&self.quadrics[v as usize]);
        let reach = 1.5 * a.distance(b);
        let middle = (a + b) * 0.5;
        let to = q
            .least()
            .filter(|p| p.distance(middle) < reach)
            .unwrap_or_else(|| {
                [a, b, middle]
                    .into_iter()
                    .min_by(|x, y| q.error(*x).total_cmp(&q.error(*y)))
                    .unwrap_or(middle)
            });
        self.heap.push(Collapse {
            cost: q.error(to),
            u,
            v,
            stamp: (self.stamps[u as usize], self.stamps[v as usize]),
            to,
        });
    }

    fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut ring: Vec<u32> = self.faces_of[v as usize]
            .iter()
            .flat_map(|&f| self.triangles[f as usize])
            .filter(|&i| i != v)
            .collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    /// The link condition (Dey, Edelsbrunner, Guha and Nekhayev): the ends of
    /// the edge share exactly the two vertices opposite to it. Collapses that
    /// meet it keep the surface a manifold of the same genus.
    fn link_holds(&self, u: u32, v: u32) -> bool {
        let (a, b) = (self.neighbours(u), self.neighbours(v));
        let shared = a.iter().filter(|i| b.binary_search(i).is_ok()).count();
        shared == 2 && a.len() + b.len() > 7
    }

    /// Whether moving `v` to `to` turns over, or flattens to a needle, a face
    /// that does not also touch `other`.
    fn turns_over(&self, v: u32, other: u32, to: DVec3) -> bool {
        self.faces_of[v as usize].iter().any(|&f| {
            let t = self.triangles[f as usize];
            if t.contains(&other) {
                return false;
            }
            let before = t.map(|i| self.positions[i as usize]);
            let after = t.map(|i| {
                if i == v {
                    to
                } else {
                    self.positions[i as usize]
                }
            });
            let normal = |c: [DVec3; 3]| (c[1] - c[0]).cross(c[2] - c[0]);
            let (n0, n1) = (normal(before), normal(after));
            let longest = (0..3)
                .map(|k| after[k].distance_squared(after[(k + 1) % 3]))
                .fold(0.0, f64::max);
            n1.dot(n0) < 0.25 * n0.length() * n1.length() || n1.length() < 0.04 * longest
        })
    }

    /// Collapses edges, the cheapest first, until at most `target` triangles
    /// are left or nothing more can go.
    pub fn reduce(&mut self, target: usize) {
        while self.count > target {
            let Some(c) = self.heap.pop() else {
                if !self.retry() {
                    break;
                }
                continue;
            };
            let (u, v) = (c.u, c.v);
            if c.stamp != (self.stamps[u as usize], self.stamps[v as usize]) {
                continue;
            }
            if !self.link_holds(u, v) || self.turns_over(u, v, c.to) || self.turns_over(v, u, c.to)
            {
                self.refused.push((u, v));
                continue;
            }
            self.collapse(u, v, c.to);
        }
        self.retry();
        self.remove_needles();
    }

    /// Proposes again what was refused: its surroundings may have changed.
    /// Returns whether any of it is still an edge.
    fn retry(&mut self) -> bool {
        let mut any = false;
        for (u, v) in std::mem::take(&mut self.refused) {
            if self.neighbours(u).binary_search(&v).is_ok() {
                self.propose(u, v);
                any = true;
            }
        }
        any
    }

    /// Collapses an edge of every face without area to speak of or, where
    /// that would pinch the surface, eases its corners towards their rings.
    fn remove_needles(&mut self) {
        for _ in 0..12 {
            if !self.remove_needles_once() {
                break;
            }
        }
    }

    fn remove_needles_once(&mut self) -> bool {
        let mut found = false;
        for f in 0..self.triangles.len() {
            if !self.alive[f] {
                continue;
            }
            let t = self.triangles[f];
            let at = t.map(|i| self.positions[i as usize]);
            let mut edges = [0, 1, 2].map(|k| (at[k].distance(at[(k + 1) % 3]), k));
            edges.sort_by(|a, b| a.0.total_cmp(&b.0));
            let area = (at[1] - at[0]).cross(at[2] - at[0]).length();
            if area > 1e-3 * edges[2].0.max(0.05) {
                continue;
            }
            found = true;
            let before = self.count;
            for (_, k) in edges {
                let (u, v) = (t[k], t[(k + 1) % 3]);
                let to = (at[k] + at[(k + 1) % 3]) * 0.5;
                if self.link_holds(u, v) {
                    self.collapse(u, v, to);
                    break;
                }
            }
            if self.count == before {
                for i in t {
                    let ring = self.neighbours(i);
                    let sum: DVec3 = ring.iter().map(|&n| self.positions[n as usize]).sum();
                    let here = &mut self.positions[i as usize];
                    *here = here.lerp(sum / ring.len() as f64, 0.25);
                }
            }
        }
        found
    }

    fn collapse(&mut self, u: u32, v: u32, to: DVec3) {
        self.positions[u as usize] = to;
        let moved = self.quadrics[v as usize];
        self.quadrics[u as usize].add(&moved);
        for f in std::mem::take(&mut self.faces_of[v as usize]) {
            let t = &mut self.triangles[f as usize];
            if t.contains(&u) {
                self.alive[f as usize] = false;
                self.count -= 1;
                for i in *t {
                    self.faces_of[i as usize].retain(|&g| g != f);
                }
            } else {
                for i in t.iter_mut() {
                    if *i == v {
                        *i = u;
                    }
                }
                self.faces_of[u as usize].push(f);
            }
        }
        self.stamps[v as usize] = u32::MAX;
        self.stamps[u as usize] += 1;
        for n in self.neighbours(u) {
            self.propose(u, n);
        }
    }

    /// The mesh as it stands.
    pub fn mesh(&self) -> Mesh {
        let mut index = vec![u32::MAX; self.positions.len()];
        let mut mesh = Mesh::default();
        for (t, _) in self.triangles.iter().zip(&self.alive).filter(|(_, a)| **a) {
            let t = t.map(|i| {
                let slot = &mut index[i as usize];
                if *slot == u32::MAX {
                    *slot = mesh.positions.len() as u32;
                    // As written in the file, to 0.0001 mm.
                    let p = (self.positions[i as usize] * 1e4).round() * 1e-4;
                    mesh.positions.push(p.as_vec3());
                }
                *slot
            });
            mesh.triangles.push(t);
        }
        mesh
    }
}
