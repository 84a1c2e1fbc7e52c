//! The compose pass: a picture in its place in a window, and a panel over it.
//!
//! Colours are sRGB as bytes where they are stored, linear where they are mixed.

use super::resolve::encode_srgb;
use crate::scene::color::srgb_to_linear as decode_srgb;

/// A picture in a window.
pub struct Composed<'a> {
    /// Columns and rows of the picture.
    pub size: [usize; 2],
    /// sRGB with straight alpha, row-major.
    pub picture: &'a [[u8; 4]],
    /// Columns and rows of the window that it fills: x, y, width, height.
    pub place: [i32; 4],
    /// Linear RGB behind it, and around it.
    pub backdrop: [f64; 3],
}

impl Composed<'_> {
    /// Linear RGB of the window at column and row `pixel`. A picture of another size than its place is read between its
    /// pixels, straight alpha and all.
    pub fn at(&self, pixel: [usize; 2]) -> [f64; 3] {
        let inside = [0, 1].map(|i| pixel[i] as f64 + 0.5 - f64::from(self.place[i]));
        let place = [self.place[2], self.place[3]].map(f64::from);
        if (0..2).any(|i| inside[i] <= 0.0 || inside[i] >= place[i]) {
            return self.backdrop;
        }
        let texel = |at: [usize; 2]| {
            self.picture[at[1] * self.size[0] + at[0]].map(|byte| f64::from(byte) / 255.0)
        };
        // Texel coordinates of the tap, and the texel and the share of its neighbour on each axis.
        let tap = [0, 1].map(|i| {
            let side = self.size[i] as f64;
            let at = (inside[i] * side / place[i]).clamp(0.5, side - 0.5) - 0.5;
            let first = at.floor() as usize;
            (first, (first + 1).min(self.size[i] - 1), at - at.floor())
        });
        let [(left, right, x), (top, bottom, y)] = tap;
        let mix = |a: [f64; 4], b: [f64; 4], share: f64| {
            [0, 1, 2, 3].map(|c| a[c] + (b[c] - a[c]) * share)
        };
        let value = mix(
            mix(texel([left, top]), texel([right, top]), x),
            mix(texel([left, bottom]), texel([right, bottom]), x),
            y,
        );
        [0, 1, 2].map(|c| self.backdrop[c] + (decode_srgb(value[c]) - self.backdrop[c]) * value[3])
    }
}

/// Linear RGB of the window where the panel draws `color` (sRGB and premultiplied, each in [0, 1]) over `below`: mixed as
/// light where the window's format `encodes`, else as the bytes that it stores.
pub fn panel(below: [f64; 3], color: [f64; 4], encodes: bool) -> [f64; 3] {
    [0, 1, 2].map(|c| match encodes {
        true => decode_srgb(color[c]) + below[c] * (1.0 - color[3]),
        false => decode_srgb(color[c] + encode_srgb(below[c]) * (1.0 - color[3])),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_in_its_own_size_is_itself() {
        let picture: Vec<[u8; 4]> = (0..6).map(|i| [40 * i, 255 - 40 * i, 7, 255]).collect();
        let composed = Composed {
            size: [3, 2],
            picture: &picture,
            place: [4, 5, 3, 2],
            backdrop: [0.5; 3],
        };
        for (i, pixel) in picture.iter().enumerate() {
            let at = composed.at([4 + i % 3, 5 + i / 3]);
            let bytes = at.map(|x| (255.0 * encode_srgb(x)).round() as u8);
            assert_eq!(bytes[..], pixel[..3]);
        }
        for outside in [[3, 5], [7, 5], [4, 4], [4, 7]] {
            assert_eq!(composed.at(outside), [0.5; 3]);
        }
    }

    #[test]
    fn what_is_not_covered_shows_the_backdrop() {
        let composed = Composed {
            size: [1, 1],
            picture: &[[255, 0, 0, 0]],
            place: [0, 0, 8, 8],
            backdrop: [0.1, 0.2, 0.3],
        };
        assert_eq!(composed.at([3, 3]), [0.1, 0.2, 0.3]);
    }

    #[test]
    fn an_opaque_panel_hides_all() {
        for encodes in [true, false] {
            let shown = panel([0.9; 3], [0.2, 0.4, 0.6, 1.0], encodes);
            for (x, encoded) in shown.into_iter().zip([0.2, 0.4, 0.6]) {
                assert!((encode_srgb(x) - encoded).abs() < 1e-12);
            }
            assert_eq!(panel([0.25; 3], [0.0; 4], true), [0.25; 3]);
        }
    }
}
