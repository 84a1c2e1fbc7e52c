//! The volume pass: grids of light, and volumes blurred from them.
//!
//! [`crate::scene::volume`] says where their cells lie.

use glam::DVec3;
use rayon::prelude::*;

use super::LightMap;
use super::reduce::HALVING;
use crate::scene::volume::{Grid, Volume, Volumes};

/// The cells of a grid, x before y before z: light, or a volume of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Where they lie.
    pub grid: Grid,
    /// What is in each of them.
    pub cells: Vec<f64>,
}

impl Light {
    /// Cell (x, y, z); 0 outside of the grid.
    pub fn at(&self, cell: [i64; 3]) -> f64 {
        let size = self.grid.size.map(i64::from);
        let inside = cell.iter().zip(size).all(|(c, n)| (0..n).contains(c));
        let [x, y, z] = cell;
        match inside {
            true => self.cells[((z * size[1] + y) * size[0] + x) as usize],
            false => 0.0,
        }
    }

    /// Fills a grid by cell.
    fn filled(grid: &Grid, cell: impl Fn([i64; 3]) -> f64 + Sync) -> Light {
        let [x, y, z] = grid.size.map(|n| n as usize);
        let cells = (0..x * y * z).into_par_iter();
        let at = |i: usize| [i % x, i / x % y, i / (x * y)].map(|c| c as i64);
        Light {
            grid: grid.clone(),
            cells: cells.map(|i| cell(at(i))).collect(),
        }
    }

    /// Trilinear tap at cell coordinates `at`.
    pub fn tap(&self, at: DVec3) -> f64 {
        let corner = (at - 0.5).floor();
        let f = at - 0.5 - corner;
        let share = |d: [i64; 3]| {
            let near = |axis: usize| if d[axis] == 0 { 1.0 - f[axis] } else { f[axis] };
            near(0) * near(1) * near(2)
        };
        (0..8)
            .map(|i| [i & 1, i >> 1 & 1, i >> 2])
            .map(|d| share(d) * self.at([0, 1, 2].map(|axis| corner[axis] as i64 + d[axis])))
            .sum()
    }

    /// Sum over all cells.
    pub fn total(&self) -> f64 {
        self.cells.iter().sum()
    }
}

/// The base grid: the light w of each texel of `map` goes to the eight cells around its point, by how near
/// they are.
pub fn deposit(map: &LightMap, grid: &Grid) -> Light {
    let [width, height, depth] = grid.size.map(|n| n as usize);
    let side = map.frame.size as i64;
    let reach = 1.0 / grid.scale;
    // Texels nearer than a cell to the middle of column or row `cell`, and how near they are.
    let near = |cell: usize, shift: f64| {
        let middle = (cell as f64 + 0.5 - shift) / grid.scale - 0.5;
        let texels = (middle - reach).ceil() as i64..=(middle + reach).floor() as i64;
        texels
            .filter(move |texel| (0..side).contains(texel))
            .map(move |texel| (texel, 1.0 - (texel as f64 - middle).abs() / reach))
    };
    let columns: Vec<Vec<f64>> = (0..width * height)
        .into_par_iter()
        .map(|column| {
            let mut slices = vec![0.0; depth];
            for (row, of_row) in near(column / width, grid.shift.y) {
                for (at, of_column) in near(column % width, grid.shift.x) {
                    let [w, wz, ..] = map.moments[(row * side + at) as usize];
                    if w <= 0.0 {
                        continue;
                    }
                    let z = wz / w * map.frame.z_half / map.frame.texel;
                    let slice = z * grid.scale + grid.shift.z - 0.5;
                    let lower = slice.floor().clamp(0.0, depth as f64 - 2.0);
                    let share = w * of_row * of_column;
                    slices[lower as usize] += share * (1.0 - (slice - lower));
                    slices[lower as usize + 1] += share * (slice - lower);
                }
            }
            slices
        })
        .collect();
    let slices = (0..depth).flat_map(|z| columns.iter().map(move |column| column[z]));
    Light {
        grid: grid.clone(),
        cells: slices.collect(),
    }
}

/// The grid after `light`: means of its cells, by [`HALVING`] along each axis.
pub fn halve(light: &Light, grid: &Grid) -> Light {
    Light::filled(grid, |[x, y, z]| {
        let along = |cell: i64| (2 * cell - 2..).zip(HALVING);
        let mut sum = 0.0;
        for (k, of_z) in along(z) {
            for (j, of_y) in along(y) {
                for (i, of_x) in along(x) {
                    sum += of_x * of_y * of_z * light.at([i, j, k]);
                }
            }
        }
        sum
    })
}

/// `light`, of the volume's grid, blurred along each axis to the volume.
pub fn blur(light: &Light, volume: &Volume) -> Light {
    let radius = volume.weights.len() as i64 - 1;
    let along = |light: &Light, axis: usize, factor: f64| {
        Light::filled(&light.grid, |cell| {
            let weighted = |d: i64| {
                let mut at = cell;
                at[axis] += d;
                volume.weights[d.unsigned_abs() as usize] * light.at(at)
            };
            factor * (-radius..=radius).map(weighted).sum::<f64>()
        })
    };
    let rows = along(&along(light, 0, 1.0), 1, 1.0);
    along(&rows, 2, volume.factor)
}

/// The volumes of `map`, from the finest on.
pub fn volumes(map: &LightMap, volumes: &Volumes) -> Vec<Light> {
    let mut grids: Vec<Light> = Vec::new();
    for grid in &volumes.grids {
        grids.push(match grids.last() {
            None => deposit(map, grid),
            Some(finer) => halve(finer, grid),
        });
    }
    let of = |volume: &Volume| blur(&grids[volume.grid], volume);
    volumes.volumes.iter().map(of).collect()
}
