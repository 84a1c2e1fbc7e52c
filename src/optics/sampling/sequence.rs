//! Low-discrepancy sequences by irrational steps.

/// Step of the one-dimensional sequence: the reciprocal of the golden ratio.
pub const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Step alpha of the R2 sequence: (1/p, 1/p^2) for the plastic number p, the real root of p^3 =
/// p + 1.
///
/// Source: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences".
pub const R2: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// Point `n` of the [`R2`] sequence shifted by `start`, in [0, 1)^2: fract(start + n alpha).
pub fn r2(start: [f64; 2], n: u32) -> [f64; 2] {
    std::array::from_fn(|k| {
        let x = start[k] + f64::from(n) * R2[k];
        x - x.floor()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_powers_of_the_plastic_number() {
        let p = 1.0 / R2[0];
        assert!((p.powi(3) - p - 1.0).abs() < 1e-14);
        assert!((R2[1] - R2[0] * R2[0]).abs() < 1e-15);
        assert!((GOLDEN * GOLDEN + GOLDEN - 1.0).abs() < 1e-15);
    }

    #[test]
    fn points_fill_the_square_more_evenly_than_chance() {
        // Count 4096 points in 16 x 16 boxes. Independent points would give a variance of about
        // 16.
        let mut counts = [0.0_f64; 256];
        for n in 0..4096 {
            let [x, y] = r2([0.31, 0.74], n);
            counts[(y * 16.0) as usize * 16 + (x * 16.0) as usize] += 1.0;
        }
        let variance = counts.iter().map(|c| (c - 16.0).powi(2)).sum::<f64>() / 256.0;
        assert!(variance < 2.0, "{variance}");
    }
}
