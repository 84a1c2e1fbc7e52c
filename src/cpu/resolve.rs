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
