//! The boxes pass: the plain MIP pyramid, each texel the mean of 2x2 of the level above it.

use crate::cpu::reduce::Level;

/// The pyramid over `base`, which is `size` texels, row-major; element k is level k, and level 0
/// is `base` itself.
///
/// Each level has half the texels a side, rounded down but never below 1, so that an odd last
/// column or row is dropped, and along a side of one texel nothing is averaged. The last level is
/// 1x1. There is always a level 1: that of a base of 1x1 is the base again.
pub fn boxes<const N: usize>(size: [u32; 2], base: &[[f64; N]]) -> Vec<Level<N>> {
    debug_assert_eq!(base.len(), size[0] as usize * size[1] as usize);
    let mut levels = vec![Level::base(size, base)];
    loop {
        let next = half(&levels[levels.len() - 1]);
        let done = next.size == [1, 1];
        levels.push(next);
        if done {
            return levels;
        }
    }
}

fn half<const N: usize>(above: &Level<N>) -> Level<N> {
    let size = above.size.map(|side| (side / 2).max(1));
    // The texels of `above` below texel `i` along `axis`.
    let below = |i: u32, axis: usize| {
        let first = i64::from(2 * i);
        let count = if above.size[axis] == 1 { 1 } else { 2 };
        first..first + count
    };
    let mean = |i: u32, j: u32| {
        let mut sum = [0.0; N];
        let mut count = 0.0;
        for y in below(j, 1) {
            for x in below(i, 0) {
                let texel = above.at(x, y);
                sum = std::array::from_fn(|c| sum[c] + texel[c]);
                count += 1.0;
            }
        }
        sum.map(|s| s / count)
    };
    let texels: Vec<_> = (0..size[1])
        .flat_map(|j| (0..size[0]).map(move |i| (i, j)))
        .map(|(i, j)| mean(i, j))
        .collect();
    Level::base(size, &texels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn counted(size: [u32; 2]) -> Vec<[f64; 1]> {
        (0..size[0] * size[1]).map(|k| [f64::from(k)]).collect()
    }

    fn sizes(size: [u32; 2]) -> Vec<[u32; 2]> {
        let levels = boxes(size, &counted(size));
        levels.iter().map(|l| l.size).collect()
    }

    #[test]
    fn sides_are_halved_rounded_down_and_never_zero() {
        assert_eq!(sizes([8, 2]), [[8, 2], [4, 1], [2, 1], [1, 1]]);
        assert_eq!(sizes([7, 5]), [[7, 5], [3, 2], [1, 1]]);
        assert_eq!(sizes([1, 3]), [[1, 3], [1, 1]]);
        assert_eq!(sizes([1, 1]), [[1, 1], [1, 1]]);
        assert_eq!(boxes([512, 512], &counted([512, 512])).len(), 10);
    }

    #[test]
    fn a_texel_is_the_mean_of_those_below_it() {
        // 0 1 2 3 4
        // 5 6 7 8 9
        // 10 ...     the odd last row and column are dropped.
        let levels = boxes([5, 3], &counted([5, 3]));
        assert_eq!(levels[1].texels, [[3.0], [5.0]]);
        assert_eq!(levels[2].texels, [[4.0]]);
        // A column of one texel is averaged along its length alone.
        assert_eq!(boxes([1, 4], &counted([1, 4]))[1].texels, [[0.5], [2.5]]);
    }

    #[test]
    fn a_tap_meets_texels_at_their_centres_and_the_border_outside() {
        let level = &boxes([4, 4], &counted([4, 4]))[0];
        assert_eq!(level.tap(DVec2::new(1.5, 2.5)), [9.0]);
        assert_eq!(level.tap(DVec2::new(2.0, 2.0)), [7.5]);
        assert_eq!(level.tap(DVec2::new(3.75, 0.25)), [0.75 * 0.75 * 3.0]);
        assert_eq!(level.tap(DVec2::new(-1.0, 9.0)), [0.0]);
        // A tap in the middle of 2x2 texels is the texel of the next level.
        let next = &boxes([4, 4], &counted([4, 4]))[1];
        assert_eq!(level.tap(DVec2::new(3.0, 1.0)), next.at(1, 0));
    }
}
