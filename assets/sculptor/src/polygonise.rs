//! From distance field to fine triangle mesh.

use fast_surface_nets::ndshape::{RuntimeShape, Shape};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use glam::{UVec3, Vec3};
use rayon::prelude::*;

use crate::mesh::Mesh;
use crate::sdf::gradient;

/// Samples per side of the blocks that are skipped when far from the surface.
const BLOCK: u32 = 8;

/// Samples per side of the cells within them that are skipped likewise.
const CELL: u32 = 2;

/// A regular lattice of distance samples.
struct Lattice {
    lo: Vec3,
    step: f32,
    size: UVec3,
    values: Vec<f32>,
}

impl Lattice {
    fn sample(field: &(impl Fn(Vec3) -> f32 + Sync), lo: Vec3, hi: Vec3, step: f32) -> Self {
        let blocks = ((hi - lo) / (step * BLOCK as f32)).ceil().as_uvec3() + UVec3::ONE;
        let size = blocks * BLOCK;
        let layer = (size.x * size.y) as usize;
        let mut values = vec![0.0; layer * size.z as usize];
        // Cells whose centre is well away from the surface take its distance
        // whole. The 1.6 allows for the fields that overstate distance.
        let clear = |side: u32| (side - 1) as f32 * 0.5 * step * 3f32.sqrt() * 1.6;
        let middle = |corner: UVec3, side: u32| {
            field(lo + (corner.as_vec3() + (side - 1) as f32 * 0.5) * step)
        };
        let cubes = |n: u32| (0..n * n * n).map(move |i| UVec3::new(i % n, i / n % n, i / (n * n)));
        values
            .par_chunks_mut(layer * BLOCK as usize)
            .enumerate()
            .for_each(|(bz, slab)| {
                let mut set = |at: UVec3, value: f32| {
                    let z = (at.z % BLOCK) as usize;
                    slab[(at.x + size.x * at.y) as usize + layer * z] = value;
                };
                let fill =
                    |corner: UVec3, side: u32, value: f32, set: &mut dyn FnMut(UVec3, f32)| {
                        for cell in cubes(side) {
                            set(corner + cell, value);
                        }
                    };
                for by in 0..blocks.y {
                    for bx in 0..blocks.x {
                        let block = UVec3::new(bx, by, bz as u32) * BLOCK;
                        let there = middle(block, BLOCK);
                        if there.abs() > clear(BLOCK) + 0.8 {
                            fill(block, BLOCK, there, &mut set);
                            continue;
                        }
                        for cell in cubes(BLOCK / CELL) {
                            let cell = block + cell * CELL;
                            let there = middle(cell, CELL);
                            if there.abs() > clear(CELL) + 0.3 {
                                fill(cell, CELL, there, &mut set);
                                continue;
                            }
                            for at in cubes(CELL) {
                                let at = cell + at;
                                set(at, field(lo + at.as_vec3() * step));
                            }
                        }
                    }
                }
            });
        Self {
            lo,
            step,
            size,
            values,
        }
    }

    fn strides(&self) -> [usize; 3] {
        let x = self.size.x as usize;
        [1, x, x * self.size.y as usize]
    }

    fn coordinate(&self, i: usize) -> [u32; 3] {
        let [_, y, z] = self.strides();
        [(i % y) as u32, (i % z / y) as u32, (i / z) as u32]
    }

    /// Keeps the largest piece of stone and lets no bubble stay inside it.
    fn keep_one_piece(&mut self) {
        for stone in [true, false] {
            let label = self.pieces(stone);
            let mut count = vec![0usize; 1];
            for &l in &label {
                if l as usize >= count.len() {
                    count.resize(l as usize + 1, 0);
                }
                count[l as usize] += 1;
            }
            let Some(largest) = (1..count.len()).max_by_key(|&l| count[l]) else {
                continue;
            };
            let flipped = if stone { 1.0 } else { -1.0 } * 0.05 * self.step;
            for (v, l) in self.values.iter_mut().zip(label) {
                if l != 0 && l as usize != largest {
                    *v = flipped;
                }
            }
        }
    }

    /// Labels the face-connected pieces of stone (or of air), from 1.
    fn pieces(&self, stone: bool) -> Vec<u32> {
        let mut label = vec![0u32; self.values.len()];
        let strides = self.strides();
        let mut named = 0;
        let mut stack = Vec::new();
        for seed in 0..label.len() {
            if label[seed] != 0 || (self.values[seed] < 0.0) != stone {
                continue;
            }
            named += 1;
            label[seed] = named;
            stack.push(seed);
            while let Some(i) = stack.pop() {
                let at = self.coordinate(i);
                for axis in 0..3 {
                    let mut visit = |j: usize| {
                        if label[j] == 0 && (self.values[j] < 0.0) == stone {
                            label[j] = named;
                            stack.push(j);
                        }
                    };
                    if at[axis] > 0 {
                        visit(i - strides[axis]);
                    }
                    if at[axis] + 1 < self.size[axis] {
                        visit(i + strides[axis]);
                    }
                }
            }
        }
        label
    }

    /// Makes the sample signs well-composed (Latecki, Eckhardt and Rosenfeld,
    /// "Well-composed sets"): wherever stone touches stone only across the
    /// diagonal of a lattice square or cube, an air sample of it becomes
    /// stone. Surface nets are then manifold, since no cell is crossed by two
    /// sheets. Returns whether anything changed.
    fn compose_well(&mut self) -> bool {
        let strides = self.strides();
        let set = -0.05 * self.step;
        let mut changed = false;
        for i in 0..self.values.len() {
            let at = self.coordinate(i);
            let room = |axis: usize| at[axis] + 1 < self.size[axis];
            for (a, b) in [(0, 1), (1, 2), (0, 2)] {
                if !room(a) || !room(b) {
                    continue;
                }
                let q = [
                    i,
                    i + strides[a],
                    i + strides[b],
                    i + strides[a] + strides[b],
                ];
                let s = q.map(|j| self.values[j] < 0.0);
                if s[0] == s[3] && s[1] == s[2] && s[0] != s[1] {
                    let j = if s[0] { q[1] } else { q[0] };
                    self.values[j] = set;
                    changed = true;
                }
            }
            if !(room(0) && room(1) && room(2)) {
                continue;
            }
            let corner = |c: usize| {
                i + (c & 1) * strides[0] + (c >> 1 & 1) * strides[1] + (c >> 2) * strides[2]
            };
            for c in 0..4 {
                let (p, q) = (corner(c), corner(7 - c));
                let sign = self.values[p] < 0.0;
                let alone = (0..8)
                    .filter(|&k| k != c && k != 7 - c)
                    .all(|k| (self.values[corner(k)] < 0.0) != sign);
                if (self.values[q] < 0.0) == sign && alone {
                    let fill = if sign { corner(c ^ 1) } else { p };
                    self.values[fill] = set;
                    changed = true;
                }
            }
        }
        changed
    }
}

/// Polygonises the zero set of `field` inside the box `lo..hi` on a lattice
/// of spacing `step` mm, keeping only its largest piece, and lays the
/// vertices on the surface.
pub fn polygonise(field: &(impl Fn(Vec3) -> f32 + Sync), lo: Vec3, hi: Vec3, step: f32) -> Mesh {
    let mut lattice = Lattice::sample(field, lo, hi, step);
    loop {
        lattice.keep_one_piece();
        if !lattice.compose_well() {
            break;
        }
    }
    let shape = RuntimeShape::<u32, 3>::new(lattice.size.to_array());
    assert_eq!(shape.size() as usize, lattice.values.len());
    let mut buffer = SurfaceNetsBuffer::default();
    surface_nets(
        &lattice.values,
        &shape,
        [0; 3],
        (lattice.size - UVec3::ONE).to_array(),
        &mut buffer,
    );
    let mut mesh = Mesh {
        positions: buffer
            .positions
            .iter()
            .map(|&p| lattice.lo + Vec3::from(p) * lattice.step)
            .collect(),
        triangles: buffer
            .indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]])
            .collect(),
    };
    if mesh.volume() < 0.0 {
        for t in &mut mesh.triangles {
            t.swap(1, 2);
        }
    }
    for _ in 0..2 {
        relax(&mut mesh);
        mesh.positions
            .par_iter_mut()
            .for_each(|p| *p = settle(field, *p, 0.6 * step));
    }
    mesh
}

/// Slides every vertex half way to the middle of its ring within its tangent
/// plane, which evens the mesh out along creases.
fn relax(mesh: &mut Mesh) {
    let mut sums = vec![(Vec3::ZERO, 0.0f32); mesh.positions.len()];
    for t in &mesh.triangles {
        for k in 0..3 {
            let sum = &mut sums[t[k] as usize];
            sum.0 += mesh.positions[t[(k + 1) % 3] as usize];
            sum.1 += 1.0;
        }
    }
    let normals = mesh.normals();
    for ((p, n), (sum, count)) in mesh.positions.iter_mut().zip(normals).zip(sums) {
        let pull = sum / count.max(1.0) - *p * count.min(1.0);
        *p += 0.5 * pull.reject_from_normalized(n);
    }
}

/// Moves `p` to the zero set of `field` by a few Newton steps, but no further
/// than `limit` mm.
pub fn settle(field: &impl Fn(Vec3) -> f32, p: Vec3, limit: f32) -> Vec3 {
    let mut q = p;
    let slope = gradient(field, q, 0.03);
    let along = slope / slope.length_squared().max(0.25);
    for _ in 0..2 {
        q -= along * field(q);
    }
    let moved = (q - p).clamp_length_max(limit);
    p + moved
}
