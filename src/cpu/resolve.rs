//! The resolve pass: from accumulated linear radiance to the bytes that are displayed.

/// Radiance from which the tone curve bends.
const SHOULDER: f64 = 0.8;

/// Encodes one pixel for display.
///
/// `accumulated` is the mean over frames of (radiance, coverage), colour premultiplied by
/// coverage. The colour is divided by coverage, exposed and bent by [`tone`]; coverage becomes
/// alpha, as PNG wants it. A `background` (linear RGB) is put behind afterwards, so that it
/// shows as given, and the pixel becomes opaque. Then clamp, [`encode_srgb`], and 8 bits,
/// rounded to nearest.
pub fn resolve(accumulated: [f64; 4], exposure: f64, background: Option<[f64; 3]>) -> [u8; 4] {
    let alpha = accumulated[3];
    let shown = |c: usize| tone((exposure * accumulated[c]).max(0.0) / alpha.max(1e-6));
    let (rgb, alpha) = match background {
        Some(behind) => (
            [0, 1, 2].map(|c| shown(c) * alpha + behind[c] * (1.0 - alpha)),
            1.0,
        ),
        None => ([0, 1, 2].map(shown), alpha),
    };
    let [r, g, b] = rgb.map(|x| to_byte(encode_srgb(x)));
    [r, g, b, to_byte(alpha)]
}

/// How much of a picture for live display is the new frame, where history holds: `SHARE` of `history.glsl`, as those that
/// follow are of its other constants.
const SHARE: f64 = 0.1;
const SHARE_MOVING: f64 = 0.3;
const MOVING: f64 = 0.5;
const SHARE_NEW: f64 = 0.5;
const REACH: f64 = 1.0;
const ELSEWHERE: f64 = 2.0;

/// A frame that is to be joined with history, all row-major.
pub struct Live<'a> {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Radiance and coverage of the frame alone, colour premultiplied.
    pub radiance: &'a [[f64; 4]],
    /// Depth-buffer values of the nearest surface; 1 where there is none.
    pub depth: &'a [f64],
    /// Where the surface was in the frame before, minus where it is, pixels.
    pub motion: &'a [[f64; 2]],
    /// The history, as the frame before left it.
    pub history: &'a [[f64; 4]],
    /// Frames that it holds, at least 1.
    pub done: u32,
    /// Factor of radiance for display.
    pub exposure: f64,
}

impl Live<'_> {
    /// The texel nearest to pixel coordinates (x, y), of what has `size`, at its edge beyond it.
    fn at(&self, [x, y]: [f64; 2]) -> usize {
        let [width, height] = self.size;
        let index = |x: f64, side: usize| (x.floor().max(0.0) as usize).min(side - 1);
        index(y, height) * width + index(x, width)
    }

    /// The new history at pixel (column, row): the mean of the frame and of what history shows of the same surface, as far
    /// as the neighbourhood of the frame bears it out.
    pub fn joined(&self, column: usize, row: usize) -> [f64; 4] {
        let pixel = [column as f64 + 0.5, row as f64 + 0.5];
        let value = self.radiance[self.at(pixel)];
        let around = (0..9).map(|k| {
            [
                pixel[0] + (k % 3) as f64 - 1.0,
                pixel[1] + (k / 3) as f64 - 1.0,
            ]
        });
        let around: Vec<usize> = around.map(|place| self.at(place)).collect();

        let own = to_luma(value);
        let mean = |of: &dyn Fn([f64; 4]) -> [f64; 4]| {
            let sums = around.iter().map(|&i| of(to_luma(self.radiance[i])));
            sums.fold([0.0; 4], |sum, x| [0, 1, 2, 3].map(|c| sum[c] + x[c] / 9.0))
        };
        let middle = mean(&|x| x);
        let variance = mean(&|x| [0, 1, 2, 3].map(|c| (x[c] - middle[c]).powi(2)));
        let deviation = variance.map(f64::sqrt);

        // Beside a silhouette the motion is that of the nearest; of equals the first.
        let own_at = around[4];
        let nearer = |front: usize, i: usize| {
            if self.depth[i] < self.depth[front] {
                i
            } else {
                front
            }
        };
        let front = match self.depth[own_at] < 1.0 {
            true => own_at,
            false => around.iter().copied().fold(own_at, nearer),
        };
        let moved = self.motion[front];
        let place = [0, 1].map(|k| pixel[k] + moved[k]);
        let [width, height] = self.size.map(|side| side as f64);
        let inside = |x: f64, side: f64| (0.0..=side).contains(&x);
        if !inside(place[0], width) || !inside(place[1], height) {
            return value;
        }
        let place = [
            place[0].clamp(0.5, width - 0.5),
            place[1].clamp(0.5, height - 0.5),
        ];
        let old = to_luma(self.history_at(place));
        let kept = [0, 1, 2, 3].map(|c| {
            let reach = REACH * deviation[c];
            old[c].clamp(
                (middle[c] - reach).min(own[c]),
                (middle[c] + reach).max(own[c]),
            )
        });
        let beyond = |c: usize| (old[c] - kept[c]).abs() / deviation[c].max(1e-3 * own[0] + 1e-6);
        let elsewhere = (beyond(0).max(beyond(3)) / ELSEWHERE).clamp(0.0, 1.0);
        let speed = (moved[0].hypot(moved[1]) / MOVING).clamp(0.0, 1.0);
        let share = SHARE + (SHARE_MOVING - SHARE) * speed;
        let share = share + (SHARE_NEW - share) * elsewhere;
        let share = share.max(1.0 / (f64::from(self.done) + 1.0));
        let weight = |c: [f64; 4]| 1.0 / (1.0 + (self.exposure * c[0] - 1.0).max(0.0));
        let (fresh, stale) = (share * weight(own), (1.0 - share) * weight(kept));
        let mixed = [0, 1, 2, 3].map(|c| (own[c] * fresh + kept[c] * stale) / (fresh + stale));
        from_luma(mixed).map(|x| x.max(0.0))
    }

    /// History between pixels: Catmull and Rom's cubic over the 4x4 around, without the four corners.
    fn history_at(&self, place: [f64; 2]) -> [f64; 4] {
        let first = place.map(|x| (x - 0.5).floor());
        let weights = [0, 1].map(|k| {
            let f = place[k] - 0.5 - first[k];
            [
                f * (-0.5 + f * (1.0 - 0.5 * f)),
                1.0 + f * f * (-2.5 + 1.5 * f),
                f * (0.5 + f * (2.0 - 1.5 * f)),
                f * f * (0.5 * f - 0.5),
            ]
        });
        let (mut sum, mut total) = ([0.0; 4], 0.0);
        for j in 0..4 {
            for i in 0..4 {
                let outer = |k: usize| k == 0 || k == 3;
                if outer(i) && outer(j) {
                    continue;
                }
                let weight = weights[0][i] * weights[1][j];
                total += weight;
                let [x, y] = [first[0] + i as f64 - 0.5, first[1] + j as f64 - 0.5];
                let texel = self.history[self.at([x, y])];
                (0..4).for_each(|c| sum[c] += weight * texel[c]);
            }
        }
        sum.map(|x| x / total)
    }
}

/// Luminance, two differences of colour, and coverage.
fn to_luma([r, g, b, a]: [f64; 4]) -> [f64; 4] {
    [
        0.25 * r + 0.5 * g + 0.25 * b,
        0.5 * (r - b),
        0.5 * g - 0.25 * (r + b),
        a,
    ]
}

fn from_luma([x, y, z, a]: [f64; 4]) -> [f64; 4] {
    [x + y - z, x + z, x - y - z, a]
}

/// The tone curve: the identity up to 0.8, then a shoulder that reaches 1 only in the limit.
///
/// 0.8 + 0.2 (1 - e^(-(x - 0.8)/0.2)) continues the identity with the same slope.
pub fn tone(x: f64) -> f64 {
    let room = 1.0 - SHOULDER;
    if x <= SHOULDER {
        x
    } else {
        SHOULDER + room * (1.0 - (-(x - SHOULDER) / room).exp())
    }
}

/// The sRGB transfer function of a linear value, which is first clamped to [0, 1].
///
/// Source: IEC 61966-2-1:1999.
pub fn encode_srgb(linear: f64) -> f64 {
    let x = linear.clamp(0.0, 1.0);
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

/// [0, 1] to a byte, rounded to nearest; NaN becomes 0.
fn to_byte(x: f64) -> u8 {
    (255.0 * x).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_srgb_values() {
        assert_eq!(to_byte(encode_srgb(0.0)), 0);
        assert_eq!(to_byte(encode_srgb(1.0)), 255);
        // Middle grey of 18 % is byte 118, half is 188.
        assert_eq!(to_byte(encode_srgb(0.18)), 118);
        assert_eq!(to_byte(encode_srgb(0.5)), 188);
        // Both branches meet.
        let (low, high) = (encode_srgb(0.003_130_8), encode_srgb(0.003_130_801));
        assert!((low - high).abs() < 1e-6);
    }

    #[test]
    fn tone_curve_is_smooth_and_never_exceeds_one() {
        let step = 1e-7;
        let slope = (tone(SHOULDER + step) - tone(SHOULDER - step)) / (2.0 * step);
        assert!((slope - 1.0).abs() < 1e-6);
        let mut last = -1.0;
        for i in 0..1000 {
            let y = tone(f64::from(i) / 300.0);
            assert!(y > last && y < 1.0);
            last = y;
        }
        assert_eq!(tone(0.37), 0.37);
    }

    #[test]
    fn coverage_fades_between_object_and_background() {
        let half = [0.2, 0.1, 0.05, 0.5];
        let [r, g, b, a] = resolve(half, 1.0, Some([0.4, 0.0, 0.0]));
        assert_eq!(a, 255);
        let encoded = [0.4, 0.1, 0.05].map(|x| to_byte(encode_srgb(x)));
        assert_eq!([r, g, b], encoded);
        // Transparent: the object's own colour, half covered.
        let encoded = [0.4, 0.2, 0.1].map(|x| to_byte(encode_srgb(x)));
        assert_eq!(
            resolve(half, 1.0, None),
            [encoded[0], encoded[1], encoded[2], 128]
        );
    }

    #[test]
    fn exposure_leaves_the_background_alone() {
        let empty = [0.0; 4];
        let background = Some([0.1, 0.2, 0.3]);
        assert_eq!(
            resolve(empty, 1.0, background),
            resolve(empty, 8.0, background)
        );
        let grey = resolve([0.1, 0.1, 0.1, 1.0], 2.0, background);
        assert_eq!(grey[0], to_byte(encode_srgb(0.2)));
        assert_eq!(resolve(empty, 3.0, None), [0; 4]);
    }
}
