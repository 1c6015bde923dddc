//! Values that formats store in a byte: opacities, and anything on a scale of 0 to 255.

use splatstream_gaussians::activation::{logit, sigmoid};

/// The logit of an 8-bit opacity. 0 and 255 would be infinite: they count as half a step inside.
pub(crate) fn logit_of_byte(opacity: u8) -> f32 {
    const HALF_STEP: f64 = 0.5 / 255.0;
    logit((f64::from(opacity) / 255.0).clamp(HALF_STEP, 1.0 - HALF_STEP)) as f32
}

/// The nearest 8-bit opacity to a logit.
pub(crate) fn byte_of_logit(logit: f32) -> u8 {
    to_byte(sigmoid(f64::from(logit)) * 255.0)
}

/// The nearest byte, half away from zero; what lies outside is clamped.
pub(crate) fn to_byte(value: f64) -> u8 {
    // `as` saturates, and turns NaN into 0.
    value.round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_opacity_byte_comes_back_from_a_finite_logit() {
        for byte in 0..=255 {
            let logit = logit_of_byte(byte);
            assert!(logit.is_finite());
            let back = byte_of_logit(logit);
            // The two ends sit on the boundary between two codes and may go to either.
            assert!(back.abs_diff(byte) <= u8::from(byte == 0 || byte == 255), "{byte} {back}");
        }
    }
}
