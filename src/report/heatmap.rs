//! A value of every pixel as a picture, with its scale drawn below: relative errors, fetches.

use super::compare::{self, relative_errors};
use super::{Image, glyphs};

/// What is not covered has no error, and a colour that the scale does not contain.
const UNCOVERED: [u8; 4] = [64, 72, 80, 255];
const PAPER: [u8; 4] = [16, 16, 16, 255];
const INK: [u8; 4] = [235, 235, 235, 255];

/// The share of pixels that the scale spans. A few fireflies beyond it are drawn in the
/// brightest colour rather than made to darken all the rest.
const SPAN: f64 = 0.999;

/// A picture for display.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heatmap {
    /// Width and height, pixels: the compared picture, and the legend below it.
    pub size: [u32; 2],
    /// sRGB with straight alpha, row-major from the top left.
    pub pixels: Vec<[u8; 4]>,
}

/// Draws the relative error of each pixel of `image` (see [`relative_errors`]).
///
/// Dark is the smallest error and bright the 99.9th percentile; the legend gives both,
/// and the largest error and rr beneath.
///
/// # Errors
/// As [`compare::compare`].
pub fn draw(reference: &Image, image: &Image) -> Result<Heatmap, compare::Error> {
    let errors = relative_errors(reference, image)?;
    let mut sorted: Vec<f64> = errors.iter().copied().flatten().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * sorted.len().saturating_sub(1) as f64).ceil() as usize;
        sorted.get(index).copied().unwrap_or(0.0)
    };
    let (low, high, largest) = (at(0.0), at(SPAN), at(1.0));
    let rr = (sorted.iter().map(|e| e * e).sum::<f64>() / sorted.len().max(1) as f64).sqrt();
    let labels = [low, high].map(|end| format!("{end:.2e}"));
    let summary = format!("rr {rr:.2e}  max {largest:.2e}");
    Ok(paint(reference.size, &errors, [low, high], labels, summary))
}

/// Draws the fetches of each pixel, from none to the declared number or, where one exceeds it, the largest; a pixel in
/// which nothing ran is grey.
pub fn fetches(size: [u32; 2], fetches: &[u32], declared: u32) -> Heatmap {
    let values: Vec<_> = fetches
        .iter()
        .map(|&n| (n > 0).then_some(f64::from(n)))
        .collect();
    let most = fetches.iter().copied().max().unwrap_or(0);
    let read: Vec<f64> = values.iter().copied().flatten().collect();
    let mean = read.iter().sum::<f64>() / read.len().max(1) as f64;
    let high = most.max(declared);
    let labels = ["0".to_owned(), high.to_string()];
    let summary = format!("fetches  mean {mean:.2}  max {most}");
    paint(size, &values, [0.0, f64::from(high)], labels, summary)
}

/// Draws `values` from dark at `low` to bright at `high`, and below them the legend.
fn paint(
    size: [u32; 2],
    values: &[Option<f64>],
    [low, high]: [f64; 2],
    labels: [String; 2],
    summary: String,
) -> Heatmap {
    let colors = magma();
    let color = |share: f64| {
        let index = (share.clamp(0.0, 1.0) * 255.0).round() as usize;
        colors.get(index).copied().unwrap_or(INK)
    };
    let [width, height] = size.map(|side| side as usize);
    let legend = Legend::new(width, labels, summary);
    let mut canvas = Canvas::new(legend.width, height + legend.height);
    for (index, value) in values.iter().enumerate() {
        let painted = match value {
            // Where all values are alike the scale has no length.
            Some(value) if high > low => color((value - low) / (high - low)),
            Some(_) => color(0.0),
            None => UNCOVERED,
        };
        canvas.plot(index % width.max(1), index / width.max(1), painted);
    }
    legend.draw(&mut canvas, height, color);
    Heatmap {
        size: [canvas.width as u32, canvas.height as u32],
        pixels: canvas.pixels,
    }
}

struct Legend {
    width: usize,
    height: usize,
    magnification: usize,
    labels: [String; 2],
    summary: String,
}

impl Legend {
    fn new(picture: usize, labels: [String; 2], summary: String) -> Legend {
        let needed = |magnification| {
            let ends = glyphs::width(&labels[0], magnification)
                + glyphs::width(&labels[1], magnification)
                + 4 * glyphs::ADVANCE * magnification;
            ends.max(glyphs::width(&summary, magnification)) + 8 * magnification
        };
        let magnification = if picture >= needed(2) { 2 } else { 1 };
        Legend {
            width: picture.max(needed(magnification)),
            height: (4 + 8 + 4 + glyphs::HEIGHT + 4 + glyphs::HEIGHT + 4) * magnification,
            magnification,
            labels,
            summary,
        }
    }

    fn draw(&self, canvas: &mut Canvas, top: usize, color: impl Fn(f64) -> [u8; 4]) {
        let m = self.magnification;
        let margin = 4 * m;
        let length = self.width.saturating_sub(2 * margin).max(1);
        for x in 0..length {
            let painted = color(x as f64 / length.saturating_sub(1).max(1) as f64);
            for y in 0..8 * m {
                canvas.plot(margin + x, top + margin + y, painted);
            }
        }
        let first = top + 16 * m;
        let second = first + (glyphs::HEIGHT + 4) * m;
        let right = (self.width - margin).saturating_sub(glyphs::width(&self.labels[1], m));
        for (text, at) in [
            (&self.labels[0], [margin, first]),
            (&self.labels[1], [right, first]),
            (&self.summary, [margin, second]),
        ] {
            glyphs::draw(text, at, m, |x, y| canvas.plot(x, y, INK));
        }
    }
}

struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 4]>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Canvas {
        Canvas {
            width,
            height,
            pixels: vec![PAPER; width * height],
        }
    }

    fn plot(&mut self, x: usize, y: usize, color: [u8; 4]) {
        if x < self.width
            && let Some(pixel) = self.pixels.get_mut(y * self.width + x)
        {
            *pixel = color;
        }
    }
}

/// The colour map of the FLIP paper, dark to bright, 256 entries.
pub fn magma() -> Vec<[u8; 4]> {
    nv_flip::magma_lut()
        .to_vec()
        .chunks_exact(3)
        .map(|c| [c[0], c[1], c[2], 255])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(values: &[f32], width: u32) -> Image {
        Image {
            name: "test".to_owned(),
            size: [width, values.len() as u32 / width],
            pixels: values
                .iter()
                .map(|&v| [v, v, v, f32::from(u8::from(v > 0.0))])
                .collect(),
            has_alpha: true,
            encoded: false,
        }
    }

    #[test]
    fn errors_run_from_dark_to_bright_and_background_is_neither() {
        let reference = image(&[1.0, 1.0, 1.0, 0.0], 2);
        let other = image(&[1.0, 1.1, 1.2, 0.0], 2);
        let map = draw(&reference, &other).expect("comparable");
        let colors = magma();
        let at = |x: usize, y: usize| map.pixels[y * map.size[0] as usize + x];
        assert_eq!(colors.len(), 256);
        assert_eq!(at(0, 0), colors[0]);
        assert_eq!(at(0, 1), colors[255]);
        assert_eq!(at(1, 1), UNCOVERED);
        // The legend needs more room than two pixels.
        assert!(map.size[0] > 60 && map.size[1] > 20);
        assert_eq!(map.pixels.len(), (map.size[0] * map.size[1]) as usize);
        assert!(map.pixels.contains(&INK));
    }

    #[test]
    fn fetches_run_from_none_to_what_is_declared() {
        let colors = magma();
        let map = fetches([2, 2], &[0, 1, 10, 20], 20);
        let at = |x: usize, y: usize| map.pixels[y * map.size[0] as usize + x];
        assert_eq!((at(0, 0), at(1, 1)), (UNCOVERED, colors[255]));
        assert_eq!((at(1, 0), at(0, 1)), (colors[13], colors[128]));
        // One that exceeds what is declared stretches the scale.
        let map = fetches([2, 1], &[20, 40], 20);
        assert_eq!((map.pixels[0], map.pixels[1]), (colors[128], colors[255]));
    }

    #[test]
    fn a_large_picture_keeps_its_width() {
        let values = vec![1.0; 640 * 4];
        let map = draw(&image(&values, 640), &image(&values, 640)).expect("comparable");
        assert_eq!(map.size[0], 640);
    }

    #[test]
    fn every_character_of_a_legend_has_a_glyph() {
        for character in "0123456789.-e rrmaxinfNaN fetches mean"
            .chars()
            .filter(|c| *c != ' ')
        {
            assert_ne!(glyphs::rows(character), [0; glyphs::HEIGHT], "{character}");
        }
    }
}
