//! An indexed triangle mesh and the proof that it is a closed surface.

use std::collections::HashMap;

use glam::Vec3;

/// Triangles that share vertices by index.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions, mm.
    pub positions: Vec<Vec3>,
    /// Vertex indices of the triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The corners of triangle `t`.
    pub fn corners(&self, t: [u32; 3]) -> [Vec3; 3] {
        t.map(|i| self.positions[i as usize])
    }

    /// Enclosed volume in mm³, positive when the triangles face outward.
    pub fn volume(&self) -> f64 {
        self.triangles
            .iter()
            .map(|&t| {
                let [a, b, c] = self.corners(t).map(|p| p.as_dvec3());
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    /// Area-weighted vertex normals.
    pub fn normals(&self) -> Vec<Vec3> {
        let mut normals = vec![Vec3::ZERO; self.positions.len()];
        for &t in &self.triangles {
            let [a, b, c] = self.corners(t);
            let n = (b - a).cross(c - a);
            for i in t {
                normals[i as usize] += n;
            }
        }
        normals
            .into_iter()
            .map(|n| n.normalize_or(Vec3::Y))
            .collect()
    }

    /// The vertices round each vertex of a closed mesh.
    pub fn rings(&self) -> Vec<Vec<u32>> {
        let mut rings = vec![Vec::new(); self.positions.len()];
        for t in &self.triangles {
            for k in 0..3 {
                rings[t[k] as usize].push(t[(k + 1) % 3]);
            }
        }
        rings
    }

    /// Checks that the mesh is one closed, connected, manifold surface that
    /// faces outward, and says what is wrong otherwise.
    ///
    /// On top of [`Mesh::check_closed`] no face is degenerate.
    pub fn check(&self) -> Result<(), String> {
        for (f, &t) in self.triangles.iter().enumerate() {
            let [a, b, c] = self.corners(t);
            if (b - a).cross(c - a).length() < 1e-6 {
                return Err(format!("face {f} has no area"));
            }
        }
        self.check_closed()
    }

    /// The topological part of [`Mesh::check`], and the volume's sign.
    ///
    /// Every directed edge occurs once and so does its opposite (each edge
    /// borders two faces that agree on orientation), the faces round every
    /// vertex form a single fan, every vertex is used, and the volume is positive.
    pub fn check_closed(&self) -> Result<(), String> {
        let mut next = HashMap::with_capacity(self.triangles.len() * 3);
        for (f, &t) in self.triangles.iter().enumerate() {
            if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
                return Err(format!("face {f} names a vertex twice"));
            }
            for k in 0..3 {
                let (i, j) = (t[k], t[(k + 1) % 3]);
                if next.insert((i, j), t[(k + 2) % 3]).is_some() {
                    return Err(format!("edge {i}-{j} is used twice in one direction"));
                }
            }
        }
        for &(i, j) in next.keys() {
            if !next.contains_key(&(j, i)) {
                return Err(format!("edge {i}-{j} is open"));
            }
        }
        self.check_fans(&next)?;
        if self.components() != 1 {
            return Err(format!("{} separate pieces", self.components()));
        }
        if self.volume() <= 0.0 {
            return Err("inside out".into());
        }
        Ok(())
    }

    /// Walks round every vertex: its faces must close into one fan.
    fn check_fans(&self, next: &HashMap<(u32, u32), u32>) -> Result<(), String> {
        let mut valence = vec![0usize; self.positions.len()];
        let mut start = vec![None; self.positions.len()];
        for t in &self.triangles {
            for k in 0..3 {
                valence[t[k] as usize] += 1;
                start[t[k] as usize] = Some(t[(k + 1) % 3]);
            }
        }
        for (v, first) in start.iter().enumerate() {
            let Some(first) = *first else {
                return Err(format!("vertex {v} is unused"));
            };
            let mut spoke = first;
            for step in 1..=valence[v] {
                spoke = next[&(v as u32, spoke)];
                if (spoke == first) != (step == valence[v]) {
                    return Err(format!("the faces at vertex {v} form several fans"));
                }
            }
        }
        Ok(())
    }

    /// The number of connected pieces.
    pub fn components(&self) -> usize {
        fn root(parent: &mut [u32], mut i: u32) -> u32 {
            while parent[i as usize] != i {
                parent[i as usize] = parent[parent[i as usize] as usize];
                i = parent[i as usize];
            }
            i
        }
        let mut parent: Vec<u32> = (0..self.positions.len() as u32).collect();
        for t in &self.triangles {
            for k in 1..3 {
                let (a, b) = (root(&mut parent, t[0]), root(&mut parent, t[k]));
                parent[a as usize] = b;
            }
        }
        (0..parent.len() as u32)
            .filter(|&i| parent[i as usize] == i)
            .count()
    }

    /// The number of tunnels: the genus of a single closed surface.
    pub fn genus(&self) -> i64 {
        let euler = self.positions.len() as i64 - self.triangles.len() as i64 / 2;
        (2 - euler) / 2
    }
}
