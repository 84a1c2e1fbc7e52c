//! The reduce pass: the pyramid of a light map, and each of its levels smoothed.
//!
//! [`crate::scene::pyramid`] says which texels a level keeps.

use glam::DVec2;

use crate::scene::pyramid::{CONTENT_HIGH, CONTENT_LOW};

/// The halving filter: texel i takes texels 2i - 1 to 2i + 2 by these weights.
pub const HALVING: [f64; 4] = [0.125, 0.375, 0.375, 0.125];

/// The smoothing filter, [1 4 6 4 1]/16 applied twice: its variance is 2 texels squared.
pub const SMOOTHING: [f64; 9] = [
    1.0 / 256.0,
    8.0 / 256.0,
    28.0 / 256.0,
    56.0 / 256.0,
    70.0 / 256.0,
    56.0 / 256.0,
    28.0 / 256.0,
    8.0 / 256.0,
    1.0 / 256.0,
];

/// One level of a pyramid: its content, and 0 elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Level<const N: usize> {
    /// Columns and rows of the interior.
    pub size: [u32; 2],
    /// Texels kept before the interior's first column and row.
    pub low: u32,
    /// Texels kept after the interior's last column and row.
    pub high: u32,
    /// The content, row-major.
    pub texels: Vec<[f64; N]>,
}

impl<const N: usize> Level<N> {
    /// Level 0: row-major texels of `size` columns and rows.
    pub fn base(size: [u32; 2], texels: &[[f64; N]]) -> Self {
        debug_assert_eq!(texels.len(), size[0] as usize * size[1] as usize);
        Level {
            size,
            low: 0,
            high: 0,
            texels: texels.to_vec(),
        }
    }

    /// Fills a level by column and row of its texels.
    fn filled(size: [u32; 2], low: u32, high: u32, texel: impl Fn(i64, i64) -> [f64; N]) -> Self {
        let range = |n: u32| -i64::from(low)..i64::from(n) + i64::from(high);
        let texels = range(size[1])
            .flat_map(|j| range(size[0]).map(move |i| (i, j)))
            .map(|(i, j)| texel(i, j))
            .collect();
        Level {
            size,
            low,
            high,
            texels,
        }
    }

    /// Texel (i, j), counted from the interior's corner; 0 outside the content.
    pub fn at(&self, i: i64, j: i64) -> [f64; N] {
        let low = i64::from(self.low);
        let size = self.size.map(|n| n + self.low + self.high);
        texel_at(size, &self.texels, i + low, j + low)
    }

    /// Bilinear tap at texel coordinates `st`: texel (i, j) has its centre at (i + 1/2, j + 1/2).
    pub fn tap(&self, st: DVec2) -> [f64; N] {
        bilinear(st, |i, j| self.at(i, j))
    }

    /// Sum over all texels.
    pub fn total(&self) -> [f64; N] {
        weighted(self.texels.iter().map(|&texel| (1.0, texel)))
    }
}

/// Bilinear tap, as [`Level::tap`], of row-major `texels` of `size` columns and rows; 0 outside.
pub fn texels_tap<const N: usize>(size: [u32; 2], texels: &[[f64; N]], st: DVec2) -> [f64; N] {
    bilinear(st, |i, j| texel_at(size, texels, i, j))
}

/// Texel (i, j) of row-major `texels` of `size` columns and rows; 0 outside.
fn texel_at<const N: usize>(size: [u32; 2], texels: &[[f64; N]], i: i64, j: i64) -> [f64; N] {
    let [width, height] = size.map(i64::from);
    if (0..width).contains(&i) && (0..height).contains(&j) {
        texels[(j * width + i) as usize]
    } else {
        [0.0; N]
    }
}

fn bilinear<const N: usize>(st: DVec2, at: impl Fn(i64, i64) -> [f64; N]) -> [f64; N] {
    let corner = (st - 0.5).floor();
    let f = st - 0.5 - corner;
    let (i, j) = (corner.x as i64, corner.y as i64);
    let corners = [
        (0, 0, (1.0 - f.x) * (1.0 - f.y)),
        (1, 0, f.x * (1.0 - f.y)),
        (0, 1, (1.0 - f.x) * f.y),
        (1, 1, f.x * f.y),
    ];
    weighted(corners.map(|(di, dj, weight)| (weight, at(i + di, j + dj))))
}

/// Sum of texels times weights.
fn weighted<const N: usize>(terms: impl IntoIterator<Item = (f64, [f64; N])>) -> [f64; N] {
    let mut sum = [0.0; N];
    for (weight, texel) in terms {
        for (sum, value) in sum.iter_mut().zip(texel) {
            *sum += weight * value;
        }
    }
    sum
}

/// The level after `level`. Nothing that lies in `level` is lost.
pub fn decimate<const N: usize>(level: &Level<N>) -> Level<N> {
    let size = level.size.map(|n| (n >> 1).max(1));
    Level::filled(size, CONTENT_LOW, CONTENT_HIGH, |i, j| {
        let row = |j: i64| {
            let taps = (2 * i - 1..).zip(HALVING);
            weighted(taps.map(|(i, weight)| (weight, level.at(i, j))))
        };
        weighted(
            (2 * j - 1..)
                .zip(HALVING)
                .map(|(j, weight)| (weight, row(j))),
        )
    })
}

/// `level` smoothed, within the same texels: what spreads further is lost.
pub fn smooth<const N: usize>(level: &Level<N>) -> Level<N> {
    let rows = Level::filled(level.size, level.low, level.high, |i, j| {
        weighted(
            (i - 4..)
                .zip(SMOOTHING)
                .map(|(i, weight)| (weight, level.at(i, j))),
        )
    });
    Level::filled(level.size, level.low, level.high, |i, j| {
        weighted(
            (j - 4..)
                .zip(SMOOTHING)
                .map(|(j, weight)| (weight, rows.at(i, j))),
        )
    })
}

/// Levels 0 to `levels` - 1 over `base`.
pub fn pyramid<const N: usize>(base: Level<N>, levels: u32) -> Vec<Level<N>> {
    std::iter::successors(Some(base), |level| Some(decimate(level)))
        .take(levels.max(1) as usize)
        .collect()
}
