//! The sRGB transfer function and colours written as `#rrggbb`.

/// Display-encoded sRGB value in [0, 1] to linear light (IEC 61966-2-1, exact).
pub fn srgb_to_linear(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear light in [0, 1] to the display-encoded sRGB value (IEC 61966-2-1, exact).
pub fn linear_to_srgb(linear: f64) -> f64 {
    if linear <= 0.0031308 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Reads `#rrggbb` (display-encoded sRGB) as linear RGB.
///
/// # Errors
/// A phrase such as `must be #rrggbb, ...` that reads on from the name of what was given.
pub fn parse_hex(text: &str) -> Result<[f64; 3], String> {
    let wrong = || format!("must be #rrggbb, such as #203040, not \"{text}\"");
    let digits = text.strip_prefix('#').ok_or_else(wrong)?;
    // from_str_radix would also take a sign, so the digits are checked one by one.
    if digits.len() != 6 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
        return Err(wrong());
    }
    let packed = u32::from_str_radix(digits, 16).map_err(|_| wrong())?;
    let [_, red, green, blue] = packed.to_be_bytes();
    Ok([red, green, blue].map(|byte| srgb_to_linear(f64::from(byte) / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transfer_functions_are_inverse_to_each_other() {
        for code in 0..=255 {
            let encoded = f64::from(code) / 255.0;
            assert!((linear_to_srgb(srgb_to_linear(encoded)) - encoded).abs() < 1e-7);
        }
        // Half of the code range is 21.4 % of the light, a figure found in every text book.
        assert!((srgb_to_linear(0.5) - 0.21404).abs() < 1e-5);
    }

    #[test]
    fn hex_colours_parse_exactly_or_not_at_all() {
        assert_eq!(parse_hex("#ffffff"), Ok([1.0; 3]));
        assert_eq!(parse_hex("#000000"), Ok([0.0; 3]));
        for bad in ["ffffff", "#fff", "#+fffff", "#gggggg", "", "#", "#äää"] {
            assert!(parse_hex(bad).is_err(), "{bad}");
        }
    }
}
