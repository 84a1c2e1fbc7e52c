//! Pictures as files: PNG (8-bit sRGB, straight alpha) and OpenEXR (linear f32,
//! premultiplied alpha).

use super::{Error, Output};
use crate::scene::color::srgb_to_linear;
use image::codecs::gif::{GifEncoder, Repeat};
use image::{
    Delay, ExtendedColorType, Frame, ImageEncoder, ImageError, ImageFormat, ImageReader, Limits,
    RgbaImage,
};
use std::io::BufReader;
use std::path::Path;

/// A file format for pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8-bit sRGB with straight alpha.
    Png,
    /// Linear f32 with premultiplied alpha.
    Exr,
}

impl Format {
    /// The format that the extension of `path` stands for.
    ///
    /// # Errors
    /// Any other extension than .png and .exr, or none.
    pub fn of(path: &Path) -> Result<Format, Error> {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("png") {
            Ok(Format::Png)
        } else if extension.eq_ignore_ascii_case("exr") {
            Ok(Format::Exr)
        } else {
            Err(Error::of(
                path.display(),
                "unknown picture format; the file must end in .png (for display) or .exr (linear)",
            ))
        }
    }
}

/// A picture in linear light.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Where it came from, for messages.
    pub name: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Linear RGB premultiplied by alpha, and alpha; row-major from the top left.
    pub pixels: Vec<[f32; 4]>,
    /// Whether the file had an alpha channel. Without one, alpha is 1.
    pub has_alpha: bool,
    /// Whether the file held display-encoded values (PNG) rather than linear ones (EXR).
    pub encoded: bool,
}

impl Image {
    /// Reads a .png (8 or 16 bit; taken as sRGB) or .exr file.
    ///
    /// # Errors
    /// The file is missing, has another extension, or does not decode.
    pub fn read(path: &Path) -> Result<Image, Error> {
        let fault = |problem: String| Error::of(path.display(), problem);
        let format = Format::of(path)?;
        let file = match std::fs::File::open(path) {
            Ok(file) if file.metadata().is_ok_and(|found| found.is_file()) => file,
            Ok(_) => return Err(fault("not a file; name a .png or .exr file".to_owned())),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Err(fault("no such file; check the path".to_owned()));
            }
            Err(error) => {
                return Err(fault(format!(
                    "cannot be read ({error}); check its permissions"
                )));
            }
        };
        let (kind, name) = match format {
            Format::Png => (ImageFormat::Png, "PNG"),
            Format::Exr => (ImageFormat::OpenExr, "EXR"),
        };
        let mut reader = ImageReader::with_format(BufReader::new(file), kind);
        // The largest picture that marmor writes is 16384 pixels square, 4 GiB as f32.
        // A header that claims much more than that is damaged.
        let mut limits = Limits::default();
        limits.max_image_width = Some(1 << 16);
        limits.max_image_height = Some(1 << 16);
        limits.max_alloc = Some(8 << 30);
        reader.limits(limits);
        let decoded = reader
            .decode()
            .map_err(|error| fault(format!("not a usable {name} ({error}); write it anew")))?;
        let has_alpha = decoded.color().has_alpha();
        let decoded = decoded.into_rgba32f();
        let size = [decoded.width(), decoded.height()];
        let encoded = format == Format::Png;
        let pixels = decoded
            .pixels()
            .map(|pixel| {
                let [r, g, b, a] = pixel.0;
                if encoded {
                    let linear = |v: f32| (srgb_to_linear(v.into()) * f64::from(a)) as f32;
                    [linear(r), linear(g), linear(b), a]
                } else {
                    [r, g, b, a]
                }
            })
            .collect();
        Ok(Image {
            name: path.display().to_string(),
            size,
            pixels,
            has_alpha,
            encoded,
        })
    }
}

/// Writes a PNG: row-major 8-bit sRGB with straight alpha.
///
/// # Errors
/// The pixels do not fill the size, or the disk does not take the file.
pub fn write_png(output: &Output, size: [u32; 2], pixels: &[[u8; 4]]) -> Result<(), Error> {
    fill(output.path().display(), size, pixels.len())?;
    output.write(|writer| {
        image::codecs::png::PngEncoder::new(writer).write_image(
            bytemuck::cast_slice(pixels),
            size[0],
            size[1],
            ExtendedColorType::Rgba8,
        )
    })
}

/// A PNG in memory: row-major 8-bit sRGB with straight alpha.
///
/// # Errors
/// The pixels do not fill the size.
pub fn encode_png(size: [u32; 2], pixels: &[[u8; 4]]) -> Result<Vec<u8>, Error> {
    fill("a picture in memory", size, pixels.len())?;
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(
            bytemuck::cast_slice(pixels),
            size[0],
            size[1],
            ExtendedColorType::Rgba8,
        )
        .map_err(|error| Error::of("a picture in memory", error.to_string()))?;
    Ok(bytes)
}

/// Writes an EXR: row-major linear f32 with premultiplied alpha.
///
/// # Errors
/// The pixels do not fill the size, or the disk does not take the file.
pub fn write_exr(output: &Output, size: [u32; 2], pixels: &[[f32; 4]]) -> Result<(), Error> {
    fill(output.path().display(), size, pixels.len())?;
    output.write(|writer| {
        image::codecs::openexr::OpenExrEncoder::new(writer).write_image(
            bytemuck::cast_slice(pixels),
            size[0],
            size[1],
            ExtendedColorType::Rgba32F,
        )
    })
}

/// A file format for animations that are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moving {
    /// GIF: 256 colours a frame, alpha 0 or 1.
    Gif,
    /// APNG: as PNG, for as many frames.
    Apng,
}

impl Moving {
    /// The format that the extension of `path` stands for: .gif or .apng.
    pub fn of(path: &Path) -> Option<Moving> {
        let extension = path.extension()?;
        if extension.eq_ignore_ascii_case("gif") {
            Some(Moving::Gif)
        } else if extension.eq_ignore_ascii_case("apng") {
            Some(Moving::Apng)
        } else {
            None
        }
    }
}

/// How hard is a GIF's palette sought, from 1 to 30? At 10 the encoder takes a tenth of the time of 1, and the eye sees
/// no difference.
const PALETTE_SPEED: i32 = 10;

/// Writes an animation that repeats for ever: frames of row-major 8-bit sRGB with straight alpha, `fps` a second.
///
/// # Errors
/// The pixels do not fill the size, or the disk does not take the file.
pub fn write_moving(
    output: &Output,
    format: Moving,
    size: [u32; 2],
    frames: &[Vec<[u8; 4]>],
    fps: f64,
) -> Result<(), Error> {
    for frame in frames {
        fill(output.path().display(), size, frame.len())?;
    }
    match format {
        Moving::Gif => output.write(|writer| {
            let mut encoder = GifEncoder::new_with_speed(writer, PALETTE_SPEED);
            encoder.set_repeat(Repeat::Infinite)?;
            // A frame begins at the hundredth of a second nearest to its instant, so that rounding adds up to nothing.
            let begins = |n: usize| (100.0 * n as f64 / fps).round() as u32;
            for (n, frame) in frames.iter().enumerate() {
                let delay = Delay::from_numer_denom_ms(10 * (begins(n + 1) - begins(n)), 1);
                let pixels = frame.as_flattened().to_vec();
                let Some(buffer) = RgbaImage::from_raw(size[0], size[1], pixels) else {
                    continue;
                };
                encoder.encode_frame(Frame::from_parts(buffer, 0, 0, delay))?;
            }
            Ok::<_, ImageError>(())
        }),
        Moving::Apng => output.write(|writer| {
            let mut encoder = png::Encoder::new(writer, size[0], size[1]);
            encoder.set_color(png::ColorType::Rgba);
            encoder.set_depth(png::BitDepth::Eight);
            encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
            encoder.set_animated(frames.len() as u32, 0)?;
            // The file's numbers have 16 bits.
            let denominator = (fps * 1000.0).round().clamp(1.0, 65535.0);
            encoder.set_frame_delay((denominator / fps).round() as u16, denominator as u16)?;
            let mut writer = encoder.write_header()?;
            for frame in frames {
                writer.write_image_data(frame.as_flattened())?;
            }
            writer.finish()
        }),
    }
}

/// The encoders panic on a buffer of the wrong length.
fn fill(
    place: impl std::fmt::Display,
    [width, height]: [u32; 2],
    pixels: usize,
) -> Result<(), Error> {
    if u64::from(width) * u64::from(height) == pixels as u64 {
        Ok(())
    } else {
        Err(Error::of(
            place,
            format!("{pixels} pixels do not fill {width}x{height}; this is a bug in marmor"),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exr_returns_every_bit_and_png_every_code() {
        let folder = tempfile::tempdir().expect("a folder");
        let linear: Vec<[f32; 4]> = (0..6)
            .map(|i| [i as f32 * 0.3, 1e-6, 1234.5, 1.0 - i as f32 * 0.1])
            .collect();
        let exr = folder.path().join("a.exr");
        let output = Output::check(&exr).expect("writable");
        write_exr(&output, [3, 2], &linear).expect("written");
        let read = Image::read(&exr).expect("read");
        assert_eq!((read.size, &read.pixels), ([3, 2], &linear));
        assert!(read.has_alpha && !read.encoded);

        let codes: Vec<[u8; 4]> = (0..=255).map(|i| [i, 255 - i, 7, 255]).collect();
        let png = folder.path().join("a.PNG");
        let output = Output::check(&png).expect("writable");
        write_png(&output, [16, 16], &codes).expect("written");
        let read = Image::read(&png).expect("read");
        assert!(read.has_alpha && read.encoded);
        for (code, pixel) in codes.iter().zip(&read.pixels) {
            let encoded = crate::scene::color::linear_to_srgb(pixel[0].into()) * 255.0;
            assert_eq!(encoded.round() as u8, code[0]);
        }
    }

    #[test]
    fn a_png_with_alpha_is_premultiplied_in_linear_light() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let output = Output::check(&path).expect("writable");
        write_png(&output, [1, 1], &[[255, 188, 0, 51]]).expect("written");
        let pixel = Image::read(&path).expect("read").pixels[0];
        assert!((pixel[0] - 0.2).abs() < 1e-6);
        assert!((f64::from(pixel[1]) - 0.2 * srgb_to_linear(188.0 / 255.0)).abs() < 1e-6);
    }

    #[test]
    fn a_picture_that_is_too_small_for_its_size_is_an_error() {
        let folder = tempfile::tempdir().expect("a folder");
        let output = Output::check(&folder.path().join("a.png")).expect("writable");
        assert!(write_png(&output, [2, 2], &[[0; 4]; 3]).is_err());
    }
}
