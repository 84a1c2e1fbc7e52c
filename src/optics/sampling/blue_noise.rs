//! Blue noise by void and cluster.

use std::sync::LazyLock;

/// Width of the Gaussian that measures crowding, texels. Ulichney recommends 1.5, and 1.9
/// spreads the ranks of a small texture more evenly.
const SIGMA: f64 = 1.9;

/// Reach of that Gaussian, texels: beyond it a contribution is lost in the rounding of the
/// texel's own.
const REACH: usize = 16;

/// Texels along a side of [`noise`]: enough that its repetition does not show.
pub const NOISE_SIZE: usize = 64;

/// The tile that shifts the sample sequence from pixel to pixel, [`NOISE_SIZE`] x [`NOISE_SIZE`] (row-major): two channels
/// of [`blue_noise`], of seeds 1 and 2. Made when it is first asked for.
pub fn noise() -> &'static [[f32; 2]] {
    static TILE: LazyLock<Vec<[f32; 2]>> = LazyLock::new(|| {
        let [x, y] = [1, 2].map(|seed| blue_noise(NOISE_SIZE, seed));
        x.into_iter().zip(y).map(|(x, y)| [x, y]).collect()
    });
    &TILE
}

/// A tile of `size` x `size` values (row-major) whose neighbours differ as much as they can.
///
/// The values are (rank + 1/2) / size^2, each rank once, and the tile wraps around. `size` >=
/// 1. The same `seed` gives the same tile, another an unrelated one. 64 x 64 takes about 30 ms.
///
/// Source: Ulichney 1993, "The void-and-cluster method for dither array generation".
pub fn blue_noise(size: usize, seed: u64) -> Vec<f32> {
    let mut crowd = Crowd::new(size);
    let start = initial_pattern(&mut crowd, seed);

    // Phase 1: take the initial points out, the most crowded first, ranking them downwards.
    let mut rank = vec![0_usize; size * size];
    let mut drained = crowd.clone();
    for r in (0..start).rev() {
        let texel = drained.tightest_cluster();
        drained.toggle(texel);
        rank[texel] = r;
    }
    // Phases 2 and 3: fill the largest void until nothing is empty. Where points are the
    // majority, Ulichney looks for the tightest cluster of holes, which is the same texel, for
    // the crowding by holes and by points add up to a constant.
    for r in start..size * size {
        let texel = crowd.largest_void();
        crowd.toggle(texel);
        rank[texel] = r;
    }
    let scale = 1.0 / (size * size) as f64;
    rank.iter()
        .map(|&r| ((r as f64 + 0.5) * scale) as f32)
        .collect()
}

/// Sets a tenth of the texels, evened out until moving the most crowded one no longer helps.
/// Returns how many are set.
fn initial_pattern(crowd: &mut Crowd, seed: u64) -> usize {
    let texels = crowd.set.len();
    let wanted = (texels / 10).max(1);
    let mut random = SplitMix(seed);
    let mut count = 0;
    while count < wanted {
        let texel = (random.next() % texels as u64) as usize;
        if !crowd.set[texel] {
            crowd.toggle(texel);
            count += 1;
        }
    }
    // Each move lowers the crowding, so this ends; the bound only guards against rounding
    // making two arrangements look better than each other.
    for _ in 0..texels {
        let cluster = crowd.tightest_cluster();
        crowd.toggle(cluster);
        let void = crowd.largest_void();
        crowd.toggle(void);
        if void == cluster {
            break;
        }
    }
    count
}

/// A set of texels on a torus and how crowded each texel is by it.
#[derive(Clone)]
struct Crowd {
    size: usize,
    set: Vec<bool>,
    crowding: Vec<f64>,
    /// One period of the one-dimensional Gaussian; the two-dimensional one is its product.
    gaussian: Vec<f64>,
}

impl Crowd {
    fn new(size: usize) -> Self {
        let gaussian = (0..size)
            .map(|d| {
                let distance = d.min(size - d);
                let x = distance as f64 / SIGMA;
                if distance <= REACH {
                    (-0.5 * x * x).exp()
                } else {
                    0.0
                }
            })
            .collect();
        Crowd {
            size,
            set: vec![false; size * size],
            crowding: vec![0.0; size * size],
            gaussian,
        }
    }

    /// Adds the texel if it is absent, removes it if it is present.
    fn toggle(&mut self, texel: usize) {
        self.set[texel] = !self.set[texel];
        let sign = if self.set[texel] { 1.0 } else { -1.0 };
        let (x, y) = (texel % self.size, texel / self.size);
        for (row, crowding) in self.crowding.chunks_exact_mut(self.size).enumerate() {
            let weight = sign * self.gaussian[(row + self.size - y) % self.size];
            if weight == 0.0 {
                continue;
            }
            // The wrapped row in two runs, so that the inner loops stay plain.
            let (left, right) = crowding.split_at_mut(x);
            for (c, g) in right.iter_mut().zip(&self.gaussian) {
                *c += weight * g;
            }
            for (c, g) in left.iter_mut().zip(&self.gaussian[self.size - x..]) {
                *c += weight * g;
            }
        }
    }

    /// The present texel that is crowded most.
    fn tightest_cluster(&self) -> usize {
        self.extreme(true, |c| -c)
    }

    /// The absent texel that is crowded least.
    fn largest_void(&self) -> usize {
        self.extreme(false, |c| c)
    }

    /// The texel of the given state with the least `key`; the first one if several have it.
    fn extreme(&self, state: bool, key: impl Fn(f64) -> f64) -> usize {
        let mut best = (f64::INFINITY, 0);
        for (i, (&set, &c)) in self.set.iter().zip(&self.crowding).enumerate() {
            if set == state && key(c) < best.0 {
                best = (key(c), i);
            }
        }
        best.1
    }
}

/// The SplitMix64 generator (Steele, Lea and Flood 2014).
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Mean power of `tile`, mean removed, over the frequencies with `low` <= |f| < `high`
    /// cycles a tile, relative to white noise of the same variance.
    fn power(tile: &[f32], size: usize, low: f64, high: f64) -> f64 {
        let n = size as i32;
        let (mut sum, mut count) = (0.0, 0.0);
        for fy in -high as i32..=high as i32 {
            for fx in 0..=high as i32 {
                let f = f64::from(fx * fx + fy * fy).sqrt();
                if f < low || f >= high {
                    continue;
                }
                let (mut re, mut im) = (0.0, 0.0);
                for y in 0..n {
                    for x in 0..n {
                        let phase = TAU * f64::from(fx * x + fy * y) / f64::from(n);
                        let value = f64::from(tile[(y * n + x) as usize]) - 0.5;
                        re += value * phase.cos();
                        im += value * phase.sin();
                    }
                }
                sum += re * re + im * im;
                count += 1.0;
            }
        }
        let texels = (size * size) as f64;
        sum / count / (texels / 12.0)
    }

    #[test]
    fn every_rank_appears_once() {
        for size in [1, 2, 7, 32] {
            let mut tile = blue_noise(size, 1);
            tile.sort_by(f32::total_cmp);
            for (r, value) in tile.iter().enumerate() {
                let expected = (r as f64 + 0.5) / (size * size) as f64;
                assert!((f64::from(*value) - expected).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn low_frequencies_are_missing() {
        let tile = blue_noise(64, 1);
        let (low, middle) = (power(&tile, 64, 1.0, 8.0), power(&tile, 64, 24.0, 26.0));
        assert!(low < 0.02, "{low}");
        assert!(middle > 0.5, "{middle}");
        // Shuffled, the same values are white: the measure itself can tell.
        let mut random = SplitMix(7);
        let mut white = tile.clone();
        for i in (1..white.len()).rev() {
            white.swap(i, (random.next() % (i as u64 + 1)) as usize);
        }
        let low = power(&white, 64, 1.0, 8.0);
        assert!(low > 0.6, "{low}");
    }

    #[test]
    fn tiles_of_two_seeds_are_unrelated() {
        let (a, b) = (blue_noise(64, 1), blue_noise(64, 2));
        let covariance: f64 = a
            .iter()
            .zip(&b)
            .map(|(a, b)| (f64::from(*a) - 0.5) * (f64::from(*b) - 0.5))
            .sum::<f64>()
            / 4096.0;
        assert!((covariance * 12.0).abs() < 0.05, "{covariance}");
        assert_eq!(a, blue_noise(64, 1));
    }
}
