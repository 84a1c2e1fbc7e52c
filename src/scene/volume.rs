//! Volumes: the light on the surface, blurred by a Gaussian in space, on grids in light space.
//!
//! What level k of the mixture stands for is V_k(p) = sum over the map's texels of area a_t of
//! a_t w_t e^(-|p - x_t|^2 / (2 s_k^2)) / (2 pi s_k^2): a smooth function of three coordinates. Moments of the
//! depth guess it; a grid of cells about as wide as s_k holds it, and one trilinear tap reads it.
//!
//! The *base* grid is made of the light map: each texel's w goes to the eight cells around its point. Every
//! other grid halves the one before it. A volume is one of these grids blurred to the width of its level.
//! Tents, halving and taps blur, too, so the blur only adds what is missing: a tent over one cell, of a
//! deposit or, averaged over where it falls, of a tap, has variance 1/6 of a cell squared, and halving
//! takes v to (v + 3/4) / 4.
//!
//! Grids lie around the caster, not around the map: their middle is the map's. Cell (i, j, k) has its
//! centre at (i + 1/2, j + 1/2, k + 1/2), along the map's columns, its rows and the depth. There is one cell
//! more on each side than the caster fills; a tap from a point of the caster reads none beyond.

use super::LightFrame;
use glam::DVec3;

/// Width of a cell, over s, of the volumes that are blended with moments. Trilinear taps leave a ripple
/// of (cell / s)^2 / 24 of V where it is flat, and more in its tail; moments take over where there is one
/// surface, and would show it. At 1 a plane at 60 degrees is off by 1.8 %, at 0.8 by 1.1 %, for twice the
/// cells.
const CELL_BLENDED: f64 = 0.9;

/// The same of the other volumes, which are coarser and have few cells.
const CELL: f64 = 0.45;

/// How many volumes, the finest, are blended with moments.
pub const BLENDED: u32 = 2;

/// Cells that all volumes of a plan may have: 32 MiB of them, and as much for each of the two steps between
/// light and volume. It is what ends the fine levels, for each has eight times the cells of the next.
pub const CELLS_MAX: u64 = 1 << 23;

/// Cells along an axis of the image of all volumes, which devices but for the least have room for.
pub const SIDE_MAX: u32 = 1024;

/// The coarsest level whose width the base grid has. A column of cells sums (1.8 s / texel)^2 texels, and
/// llvmpipe ends every loop of a shader after 65535 iterations in all.
const BASE_MAX: u32 = 6;

/// Variance, in cells squared, of a deposit, and of a tap averaged over where it falls.
const TENT: f64 = 1.0 / 6.0;

/// Largest radius of a blur, in cells.
pub const RADIUS_MAX: usize = 9;

/// One grid of light.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Cells along each axis.
    pub size: [u32; 3],
    /// Cells a texel of the light map.
    pub scale: f64,
    /// Cell coordinates of the map's corner, in the middle of the depth range.
    pub shift: DVec3,
    /// Its first cell in the buffer of all grids, x before y before z.
    pub first: u32,
    /// Variance along an axis to which deposit and halving have spread the light, in cells squared.
    spread: f64,
}

/// A grid blurred to one level's width.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Which grid.
    pub grid: usize,
    /// Its first cell in the buffer of all volumes.
    pub first: u32,
    /// Its first cell in the image of all volumes.
    pub origin: [u32; 3],
    /// Weights of the blur along an axis, from the middle outwards; with both sides their sum is 1.
    pub weights: Vec<f64>,
    /// What makes V of blurred light.
    pub factor: f64,
}

/// The grids and volumes of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Volumes {
    /// The grids, from the base on.
    pub grids: Vec<Grid>,
    /// The volumes, from the finest on.
    pub volumes: Vec<Volume>,
    /// Columns, rows and slices of the image of all volumes.
    pub image: [u32; 3],
}

impl Grid {
    /// How many cells it has.
    pub fn cells(&self) -> u64 {
        self.size.iter().map(|&n| u64::from(n)).product()
    }

    /// The grid of cells twice as wide. The first inner cell of both begins at one place.
    fn halved(&self) -> Grid {
        Grid {
            size: self.size.map(|n| (n - 2).div_ceil(2) + 2),
            scale: 0.5 * self.scale,
            shift: 0.5 * (self.shift - 1.0) + 1.0,
            first: self.first + self.cells() as u32,
            spread: (self.spread + 0.75) / 4.0,
        }
    }

    /// How many texels of the map, in a row, may lie nearer than a cell to the middle of one.
    pub fn reach(&self) -> u32 {
        (2.0 / self.scale).floor() as u32 + 1
    }

    /// Cell coordinates of the point `at`: texel coordinates on the map, and its depth behind the middle of the
    /// range, in texels, too.
    pub fn place(&self, at: DVec3) -> DVec3 {
        at * self.scale + self.shift
    }
}

/// Weights, from the middle outwards, of a blur of variance `variance` (cells squared): samples of a Gaussian
/// as far as four deviations, whose variance is that to 1 % from 0.6 on.
fn blur(variance: f64) -> Vec<f64> {
    let radius = (4.0 * variance.sqrt()).ceil().min(RADIUS_MAX as f64) as usize;
    let raw = (0..=radius).map(|i| (-0.5 * (i * i) as f64 / variance).exp());
    let raw: Vec<f64> = raw.collect();
    let sum = 2.0 * raw.iter().sum::<f64>() - raw[0];
    raw.iter().map(|w| w / sum).collect()
}

impl Volumes {
    /// The volumes of standard deviations `widths` (mm, ascending) for a map in `frame`; the first is that of
    /// level `finest`, and the base has its cells, or finer ones where it is too coarse for a base.
    ///
    /// None, where there would be more than [`CELLS_MAX`] cells, or [`SIDE_MAX`] along an axis.
    pub fn new(frame: &LightFrame, widths: &[f64], finest: u32) -> Option<Volumes> {
        let too_fine = f64::from(finest.saturating_sub(BASE_MAX)).exp2();
        let cell = CELL_BLENDED * widths.first()? / too_fine;
        let half = frame.half.extend(frame.z_half);
        let inner = (2.0 * half / cell).ceil().max(DVec3::ONE);
        if inner.max_element() > f64::from(SIDE_MAX) {
            return None;
        }
        let scale = frame.texel / cell;
        let middle = DVec3::new(0.5, 0.5, 0.0) * f64::from(frame.size);
        let base = Grid {
            size: inner.to_array().map(|n| n as u32 + 2),
            scale,
            shift: 1.0 + 0.5 * inner - middle * scale,
            first: 0,
            spread: TENT,
        };
        let mut grids = vec![base];
        let (mut volumes, mut cells) = (Vec::new(), 0);
        for (i, s) in (0..).zip(widths) {
            let most = if i < BLENDED { CELL_BLENDED } else { CELL };
            // Widths are an octave apart but for a hundredth.
            let grid = (most * s / cell * 1.01).log2().floor().max(0.0) as usize;
            while grids.len() <= grid {
                grids.push(grids[grids.len() - 1].halved());
            }
            let width = s / cell / (grid as f64).exp2();
            volumes.push(Volume {
                grid,
                first: cells as u32,
                origin: [0; 3],
                weights: blur(width * width - grids[grid].spread - TENT),
                // Light is by the base's cell: its density in space is the light over cell^3.
                factor: (2.0 * std::f64::consts::PI).sqrt() * s * frame.texel_area() / cell.powi(3),
            });
            cells += grids[grid].cells();
            if cells > CELLS_MAX {
                return None;
            }
        }
        let light: u64 = grids.iter().map(Grid::cells).sum();
        let image = stack(&grids, &mut volumes);
        let fits = light <= CELLS_MAX && image.iter().all(|&n| n <= SIDE_MAX);
        fits.then_some(Volumes {
            grids,
            volumes,
            image,
        })
    }

    /// Cells of all volumes.
    pub fn cells(&self) -> u64 {
        let of = |volume: &Volume| self.grids[volume.grid].cells();
        self.volumes.iter().map(of).sum()
    }

    /// Cells of all grids.
    pub fn light_cells(&self) -> u64 {
        self.grids.iter().map(Grid::cells).sum()
    }
}

/// Stacks the volumes in one image, whose size it returns: the first on its first slices, the others in
/// rows behind it.
fn stack(grids: &[Grid], volumes: &mut [Volume]) -> [u32; 3] {
    let mut image = [0; 3];
    let (mut corner, mut row) = ([0; 3], 0);
    // Two of the second grid, if there are, or one of the first.
    let widths = volumes.iter().take(3).map(|v| grids[v.grid].size[0]);
    let wide = widths.clone().max().unwrap_or(0).max(widths.skip(1).sum());
    for (i, volume) in volumes.iter_mut().enumerate() {
        let size = grids[volume.grid].size;
        if corner[0] + size[0] > wide {
            corner = [0, corner[1] + row, corner[2]];
            row = 0;
        }
        volume.origin = corner;
        for axis in 0..3 {
            image[axis] = image[axis].max(corner[axis] + size[axis]);
        }
        match i {
            0 => corner = [0, 0, size[2]],
            _ => {
                corner[0] += size[0];
                row = row.max(size[1]);
            }
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::mixture::width;

    fn frame(size: u32, extent: DVec3) -> LightFrame {
        let corners = (0..8).map(|i| {
            let sign = |bit: i32| f64::from(i >> bit & 1) - 0.5;
            DVec3::new(sign(0), sign(1), sign(2)) * extent
        });
        LightFrame::fit(corners, DVec3::Z, size, glam::DVec2::new(0.5, -0.5))
    }

    fn volumes(frame: &LightFrame, levels: std::ops::Range<u32>, step: usize) -> Option<Volumes> {
        let widths = levels.clone().step_by(step).map(|l| width(l, frame.texel));
        Volumes::new(frame, &widths.collect::<Vec<_>>(), levels.start)
    }

    #[test]
    fn volumes_keep_apart_and_hold_the_caster() {
        for size in [16, 61, 300, 512, 1024, 8192] {
            for extent in [
                DVec3::splat(40.0),
                DVec3::new(42.0, 80.0, 70.0),
                DVec3::new(80.0, 3.0, 0.0),
                DVec3::new(0.1, 9.0, 300.0),
            ] {
                let frame = frame(size, extent);
                for (levels, step) in [(1..2, 1), (1..6, 1), (2..8, 1), (1..9, 2), (5..13, 1)] {
                    let what = format!("{size}, {extent}, {levels:?} by {step}");
                    let Some(found) = volumes(&frame, levels, step) else {
                        continue;
                    };
                    assert!(found.cells() <= CELLS_MAX, "{what}");
                    let reach = found.grids[0].reach();
                    let trips = reach * (reach + 1) + found.grids[0].size[2];
                    assert!(trips < 65535, "{what}: {trips} iterations");
                    // The caster's box, moved by the jitter of half a texel.
                    let half = (frame.half / frame.texel).extend(frame.z_half / frame.texel);
                    let middle = DVec3::new(0.5, 0.5, 0.0) * f64::from(size);
                    let jitter = DVec3::new(0.5, 0.5, 0.0);
                    for grid in &found.grids {
                        let low = grid.place(middle - half - jitter);
                        let high = grid.place(middle + half + jitter);
                        let end = DVec3::from_array(grid.size.map(f64::from)) - 0.5;
                        assert!(low.cmpge(DVec3::splat(0.5 - 1e-9)).all(), "{what}: {low}");
                        assert!(high.cmple(end + 1e-9).all(), "{what}: {high} of {end}");
                    }
                    let ends = |v: &Volume| {
                        let size = found.grids[v.grid].size;
                        [0, 1, 2].map(|axis| v.origin[axis] + size[axis])
                    };
                    for (i, a) in found.volumes.iter().enumerate() {
                        assert!(
                            (0..3).all(|axis| ends(a)[axis] <= found.image[axis]),
                            "{what}"
                        );
                        for b in &found.volumes[..i] {
                            let apart = |axis: usize| {
                                a.origin[axis] >= ends(b)[axis] || b.origin[axis] >= ends(a)[axis]
                            };
                            assert!((0..3).any(apart), "{what}: {a:?} and {b:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_volume_has_the_width_of_its_level() {
        let frame = frame(512, DVec3::new(42.0, 80.0, 70.0));
        for (levels, step) in [(1..6, 1), (2..8, 1), (2..8, 2)] {
            let found = volumes(&frame, levels.clone(), step).expect("volumes");
            for (level, volume) in levels.step_by(step).zip(&found.volumes) {
                let grid = &found.grids[volume.grid];
                let cell = frame.texel / grid.scale;
                let sides = volume.weights[1..].iter().sum::<f64>();
                assert!((volume.weights[0] + 2.0 * sides - 1.0).abs() < 1e-12);
                let squares = (1..).zip(&volume.weights[1..]);
                let blur: f64 = squares.map(|(i, w)| 2.0 * f64::from(i * i) * w).sum();
                let s = cell * (blur + grid.spread + TENT).sqrt();
                let ratio = s / width(level, frame.texel);
                assert!((ratio - 1.0).abs() < 3e-3, "level {level}: {ratio}");
                assert!(
                    (0.2..=CELL_BLENDED + 0.01).contains(&(cell / s)),
                    "level {level}"
                );
            }
        }
    }

    #[test]
    fn too_many_cells_are_refused() {
        let frame = frame(8192, DVec3::splat(40.0));
        assert!(volumes(&frame, 1..4, 1).is_none());
        // Few enough a side, but too many together; the next level has few enough.
        let dense = self::frame(1024, DVec3::splat(40.0));
        assert!(volumes(&dense, 1..4, 1).is_none());
        assert!(volumes(&dense, 2..4, 1).is_some());
        // Thin and far: few cells, but more in a row than an image has.
        let thin = self::frame(512, DVec3::new(0.1, 0.1, 1000.0));
        assert!(volumes(&thin, 1..2, 1).is_none());
    }
}
