//! How far one picture is from another.
//!
//! Only pixels that the object covers count: background would dilute every figure.
//! **Covered** means fully covered, alpha above 0.999 in the reference, so that edges,
//! whose value depends on how coverage was sampled, stay out. A reference without alpha
//! counts everywhere.

use super::Image;
use crate::scene::color::linear_to_srgb;
use serde::Serialize;

/// Alpha above which a pixel counts as covered. Beyond it a 16-bit alpha of 1 - 1/65535
/// still counts, and an edge sampled 256 times with one miss does not.
const COVERED: f32 = 0.999;

/// Why two pictures cannot be compared. Each message is one line with its remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// The pictures have different sizes.
    #[error(
        "{reference} is {}x{} but {image} is {}x{}; render both at the same --size",
        .reference_size[0], .reference_size[1], .image_size[0], .image_size[1]
    )]
    Sizes {
        /// Name of the reference.
        reference: String,
        /// Its width and height.
        reference_size: [u32; 2],
        /// Name of the other picture.
        image: String,
        /// Its width and height.
        image_size: [u32; 2],
    },
    /// A channel is NaN or infinite.
    #[error("{image}: {channel} of pixel ({x}, {y}) is {value}; render it anew")]
    NotFinite {
        /// Name of the picture.
        image: String,
        /// Column, from 0 at the left.
        x: usize,
        /// Row, from 0 at the top.
        y: usize,
        /// red, green, blue or alpha.
        channel: &'static str,
        /// What was found.
        value: String,
    },
    /// The reference covers no pixel.
    #[error(
        "{reference}: no pixel is fully covered (alpha above 0.999), so nothing can be compared; \
         check its alpha channel"
    )]
    Uncovered {
        /// Name of the reference.
        reference: String,
    },
}

/// Which values RMSE, PSNR and the mean differences are taken over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Domain {
    /// Display-encoded values in [0, 1]: both pictures are PNG.
    Display,
    /// Linear radiance: at least one picture is EXR.
    Linear,
}

/// The figures, over covered pixels unless said otherwise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// How many pixels are covered.
    pub covered: usize,
    /// Relative RMSE on linear values: the root of the mean, over pixels and channels, of
    /// (difference / mean of the reference's channel)^2. Infinite (null in JSON) where the
    /// reference is black and the picture is not.
    pub rr: f64,
    /// What `rmse`, `psnr` and `mean_difference` are measured on.
    pub domain: Domain,
    /// Root of the mean squared difference over pixels and channels.
    pub rmse: f64,
    /// Peak signal-to-noise ratio, dB: 20 log10(peak / rmse). Infinite (null in JSON) for
    /// equal pictures.
    pub psnr: f64,
    /// The peak: 1 for display-encoded values, else the reference's largest value.
    pub peak: f64,
    /// Structural similarity in [-1, 1], 1 for equal pictures: mean over 8x8 windows of
    /// the whole picture, on display-encoded luma. The crate image-compare sums covariances
    /// over a window where Wang et al. 2004 average them, so its constant C2 weighs 1/64 of
    /// theirs and noise in flat regions counts for more. Compare only with its own figures.
    pub ssim: f64,
    /// FLIP at 67 pixels a degree in [0, 1], 0 for equal pictures: mean over the whole
    /// picture, display-encoded, on black.
    pub flip: f64,
    /// Mean of picture - reference per channel: shows bias, which squares hide.
    pub mean_difference: [f64; 3],
    /// Remarks on how the figures came about.
    pub notes: Vec<String>,
}

/// Compares `image` to `reference`.
///
/// SSIM and FLIP see the whole picture as a display shows it: exposure 1, clamped to
/// [0, 1], on black, 8-bit sRGB.
///
/// # Errors
/// The sizes differ, a value is not finite, or the reference covers no pixel.
pub fn compare(reference: &Image, image: &Image) -> Result<Comparison, Error> {
    let basis = Basis::new(reference, image)?;
    let domain = if reference.encoded && image.encoded {
        Domain::Display
    } else {
        Domain::Linear
    };
    let value = |linear: f32| match domain {
        Domain::Display => linear_to_srgb(linear.into()),
        Domain::Linear => f64::from(linear),
    };
    let mut relative = 0.0;
    let mut squares = 0.0;
    let mut differences = [0.0; 3];
    let mut largest = 0.0f64;
    for (expected, found) in basis.pairs() {
        relative += basis.squared_error(expected, found);
        for (channel, sum) in differences.iter_mut().enumerate() {
            let (expected, found) = (value(expected[channel]), value(found[channel]));
            let difference = found - expected;
            squares += difference * difference;
            *sum += difference;
            largest = largest.max(expected);
        }
    }
    let pixels = basis.covered as f64;
    let rmse = (squares / (3.0 * pixels)).sqrt();
    let peak = match domain {
        Domain::Display => 1.0,
        Domain::Linear => largest,
    };
    let mut notes = basis.notes.clone();
    if domain == Domain::Linear && largest == 0.0 {
        notes.push("the reference is black, so PSNR has no peak".to_owned());
    }
    let psnr = if rmse == 0.0 {
        f64::INFINITY
    } else {
        20.0 * (peak / rmse).log10()
    };
    let [expected, found] = [reference, image].map(display);
    Ok(Comparison {
        size: reference.size,
        covered: basis.covered,
        rr: (relative / pixels).sqrt(),
        domain,
        rmse,
        psnr,
        peak,
        ssim: ssim(reference.size, &expected, &found),
        flip: flip(reference.size, &expected, &found),
        mean_difference: differences.map(|sum| sum / pixels),
        notes,
    })
}

/// The relative error of each pixel, row-major; none where the reference does not cover.
/// The root of the mean of their squares is [`Comparison::rr`].
///
/// # Errors
/// As [`compare`].
pub fn relative_errors(reference: &Image, image: &Image) -> Result<Vec<Option<f64>>, Error> {
    let basis = Basis::new(reference, image)?;
    Ok(reference
        .pixels
        .iter()
        .zip(&image.pixels)
        .map(|(expected, found)| {
            is_covered(expected).then(|| basis.squared_error(expected, found).sqrt())
        })
        .collect())
}

/// Two pictures that can be compared, and what differences are divided by.
struct Basis<'a> {
    reference: &'a Image,
    image: &'a Image,
    covered: usize,
    /// Per channel; 0 only where the whole reference is black.
    scale: [f64; 3],
    notes: Vec<String>,
}

impl<'a> Basis<'a> {
    fn new(reference: &'a Image, image: &'a Image) -> Result<Self, Error> {
        if reference.size != image.size {
            return Err(Error::Sizes {
                reference: reference.name.clone(),
                reference_size: reference.size,
                image: image.name.clone(),
                image_size: image.size,
            });
        }
        finite(reference)?;
        finite(image)?;
        let mut covered = 0usize;
        let mut means = [0.0; 3];
        for pixel in reference.pixels.iter().filter(|pixel| is_covered(pixel)) {
            covered += 1;
            for (mean, &value) in means.iter_mut().zip(pixel) {
                *mean += f64::from(value);
            }
        }
        if covered == 0 {
            return Err(Error::Uncovered {
                reference: reference.name.clone(),
            });
        }
        let means = means.map(|sum| sum / covered as f64);
        let mut notes = Vec::new();
        let largest = means.iter().copied().fold(0.0, f64::max);
        let mut scale = means;
        for (scale, name) in scale.iter_mut().zip(CHANNELS) {
            // A mean that cancels is as useless as none; radiance has no negative values.
            if *scale <= 0.0 {
                *scale = largest;
                notes.push(format!(
                    "{name} of the reference has mean 0; its differences are divided by the \
                     largest channel mean, {largest}"
                ));
            }
        }
        if largest == 0.0 {
            notes = vec!["the reference is black; rr is 0 or infinite".to_owned()];
        }
        Ok(Basis {
            reference,
            image,
            covered,
            scale,
            notes,
        })
    }

    fn pairs(&self) -> impl Iterator<Item = (&'a [f32; 4], &'a [f32; 4])> {
        self.reference
            .pixels
            .iter()
            .zip(&self.image.pixels)
            .filter(|(expected, _)| is_covered(expected))
    }

    /// Mean over the channels of (difference / scale)^2.
    fn squared_error(&self, expected: &[f32; 4], found: &[f32; 4]) -> f64 {
        let mut sum = 0.0;
        for (channel, scale) in self.scale.iter().enumerate() {
            let difference = f64::from(found[channel]) - f64::from(expected[channel]);
            // 0 / 0 would make equal black pictures differ.
            if difference != 0.0 {
                sum += (difference / scale).powi(2);
            }
        }
        sum / 3.0
    }
}

const CHANNELS: [&str; 4] = ["red", "green", "blue", "alpha"];

/// Whether a pixel of a reference counts.
pub fn is_covered(pixel: &[f32; 4]) -> bool {
    pixel[3] > COVERED
}

fn finite(image: &Image) -> Result<(), Error> {
    let width = image.size[0].max(1) as usize;
    for (index, pixel) in image.pixels.iter().enumerate() {
        for (value, channel) in pixel.iter().zip(CHANNELS) {
            if !value.is_finite() {
                return Err(Error::NotFinite {
                    image: image.name.clone(),
                    x: index % width,
                    y: index / width,
                    channel,
                    value: value.to_string(),
                });
            }
        }
    }
    Ok(())
}

/// The picture as a display shows it on black: 8-bit sRGB, three bytes a pixel.
fn display(image: &Image) -> Vec<u8> {
    image
        .pixels
        .iter()
        .flat_map(|&[r, g, b, _]| [r, g, b])
        .map(|linear| (linear_to_srgb(f64::from(linear).clamp(0.0, 1.0)) * 255.0).round() as u8)
        .collect()
}

fn ssim([width, height]: [u32; 2], expected: &[u8], found: &[u8]) -> f64 {
    let luma = |rgb: &[u8]| {
        let luma = rgb
            .chunks_exact(3)
            .map(|c| {
                let luma =
                    0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
                luma.round() as u8
            })
            .collect();
        image::GrayImage::from_raw(width, height, luma).unwrap_or_default()
    };
    // The only error is a difference in size, which was excluded.
    image_compare::gray_similarity_structure(
        &image_compare::Algorithm::MSSIMSimple,
        &luma(expected),
        &luma(found),
    )
    .map_or(f64::NAN, |similarity| similarity.score)
}

fn flip([width, height]: [u32; 2], expected: &[u8], found: &[u8]) -> f64 {
    let image = |rgb| nv_flip::FlipImageRgb8::with_data(width, height, rgb);
    let errors = nv_flip::flip(
        image(expected),
        image(found),
        nv_flip::DEFAULT_PIXELS_PER_DEGREE,
    )
    .to_vec();
    errors.iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(size: [u32; 2], pixel: impl Fn(u32, u32) -> [f32; 4]) -> Image {
        let [width, height] = size;
        Image {
            name: "test".to_owned(),
            size,
            pixels: (0..height)
                .flat_map(|y| (0..width).map(move |x| (x, y)))
                .map(|(x, y)| pixel(x, y))
                .collect(),
            has_alpha: true,
            encoded: false,
        }
    }

    fn ramp(gain: f32) -> Image {
        linear([32, 16], |x, y| {
            let v = gain * (0.1 + 0.02 * x as f32);
            [v, 2.0 * v, 0.5 * v, f32::from(u8::from(y > 3))]
        })
    }

    #[test]
    fn a_common_factor_has_the_rr_that_algebra_gives() {
        // With image = (1 + e) reference, rr^2 = e^2 mean(v^2) / mean(v)^2 in every channel.
        let reference = ramp(1.0);
        let image = ramp(1.25);
        let values: Vec<f64> = (0..32).map(|x| 0.1 + 0.02 * f64::from(x)).collect();
        let mean = values.iter().sum::<f64>() / 32.0;
        let square = values.iter().map(|v| v * v).sum::<f64>() / 32.0;
        let expected = 0.25 * square.sqrt() / mean;
        let result = compare(&reference, &image).expect("comparable");
        assert!(
            (result.rr - expected).abs() < 1e-6,
            "{} {expected}",
            result.rr
        );
        assert_eq!(result.covered, 32 * 12);
        assert!(result.mean_difference.iter().all(|d| *d > 0.0));
    }

    #[test]
    fn rr_ignores_exposure_channel_gains_order_and_background() {
        let noisy = |image: &Image| {
            let mut noisy = image.clone();
            for (i, pixel) in noisy.pixels.iter_mut().enumerate() {
                pixel[i % 3] += 0.03 * ((i * 7919 % 101) as f32 / 50.0 - 1.0) * pixel[i % 3];
            }
            noisy
        };
        let reference = ramp(1.0);
        let image = noisy(&reference);
        let base = compare(&reference, &image).expect("comparable").rr;
        let map = |f: &dyn Fn(usize, [f32; 4]) -> [f32; 4]| {
            let apply = |image: &Image| Image {
                pixels: image
                    .pixels
                    .iter()
                    .enumerate()
                    .map(|(i, &p)| f(i, p))
                    .collect(),
                ..image.clone()
            };
            compare(&apply(&reference), &apply(&image))
                .expect("comparable")
                .rr
        };
        let exposed = map(&|_, [r, g, b, a]| [8.0 * r, 8.0 * g, 8.0 * b, a]);
        let tinted = map(&|_, [r, g, b, a]| [0.5 * r, 4.0 * g, 2.0 * b, a]);
        let swapped = map(&|_, [r, g, b, a]| [b, r, g, a]);
        let background = map(&|i, p| {
            if p[3] == 0.0 {
                [i as f32, 9.0, 9.0, 0.0]
            } else {
                p
            }
        });
        for changed in [exposed, tinted, swapped, background] {
            assert!((changed - base).abs() < 1e-9 * base, "{changed} {base}");
        }
        let mut reversed = (reference.clone(), image.clone());
        reversed.0.pixels.reverse();
        reversed.1.pixels.reverse();
        let reversed = compare(&reversed.0, &reversed.1).expect("comparable").rr;
        assert!((reversed - base).abs() < 1e-9 * base);
    }

    #[test]
    fn equal_pictures_are_perfect() {
        let image = ramp(1.0);
        let result = compare(&image, &image).expect("comparable");
        assert_eq!((result.rr, result.rmse, result.flip), (0.0, 0.0, 0.0));
        assert!((result.ssim - 1.0).abs() < 1e-12);
        assert_eq!(result.psnr, f64::INFINITY);
    }

    #[test]
    fn a_single_pixel_is_a_picture() {
        let white = linear([1, 1], |_, _| [1.0; 4]);
        let grey = linear([1, 1], |_, _| [0.5, 0.5, 0.5, 1.0]);
        let result = compare(&white, &grey).expect("comparable");
        assert!((result.rr - 0.5).abs() < 1e-12);
        assert!((result.psnr - 20.0 * 2f64.log10()).abs() < 1e-9);
        assert!(result.flip > 0.0 && result.flip <= 1.0);
    }

    #[test]
    fn a_black_channel_borrows_the_largest_mean_and_says_so() {
        let reference = linear([4, 4], |_, _| [2.0, 1.0, 0.0, 1.0]);
        let image = linear([4, 4], |_, _| [2.0, 1.0, 0.5, 1.0]);
        let result = compare(&reference, &image).expect("comparable");
        assert!((result.rr - (0.25f64.powi(2) / 3.0).sqrt()).abs() < 1e-12);
        assert!(result.notes.iter().any(|note| note.contains("blue")));
        let black = linear([4, 4], |_, _| [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(compare(&black, &black).map(|c| c.rr), Ok(0.0));
        assert_eq!(compare(&black, &image).map(|c| c.rr), Ok(f64::INFINITY));
    }

    #[test]
    fn edges_do_not_count_and_nothing_covered_is_an_error() {
        let edge = |value: f32| {
            linear([4, 1], |x, _| {
                if x == 0 {
                    [1.0; 4]
                } else {
                    [value, value, value, 0.9]
                }
            })
        };
        let result = compare(&edge(0.1), &edge(0.7)).expect("comparable");
        assert_eq!((result.rr, result.covered), (0.0, 1));
        let nothing = linear([2, 2], |_, _| [0.0; 4]);
        assert!(matches!(
            compare(&nothing, &nothing),
            Err(Error::Uncovered { .. })
        ));
    }

    #[test]
    fn a_value_that_is_not_finite_is_named_with_its_pixel() {
        let reference = ramp(1.0);
        let mut image = ramp(1.0);
        image.pixels[32 * 2 + 5][1] = f32::NAN;
        let message = compare(&reference, &image).expect_err("NaN").to_string();
        assert!(
            message.contains("green of pixel (5, 2) is NaN"),
            "{message}"
        );
    }

    #[test]
    fn pixel_errors_add_up_to_rr() {
        let (reference, image) = (ramp(1.0), ramp(0.8));
        let errors = relative_errors(&reference, &image).expect("comparable");
        let covered: Vec<f64> = errors.into_iter().flatten().collect();
        let mean = covered.iter().map(|e| e * e).sum::<f64>() / covered.len() as f64;
        let rr = compare(&reference, &image).expect("comparable").rr;
        assert!((mean.sqrt() - rr).abs() < 1e-12);
    }
}
