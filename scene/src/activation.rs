//! Between stored values and what they stand for: opacity and its logit, colour and its DC coefficient.
//!
//! `f64` and `libm` throughout, so that the same bytes give the same frame on every machine.

/// The constant SH basis function, 1 / (2 √π).
pub(crate) const SH_C0: f64 = 0.282_094_791_773_878_14;

/// Opacity, 0 to 1, of a logit.
pub(crate) fn sigmoid(logit: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-logit))
}

/// The logit of an opacity strictly between 0 and 1.
pub(crate) fn logit(opacity: f64) -> f64 {
    libm::log(opacity / (1.0 - opacity))
}

/// The logit of an 8-bit opacity. 0 and 255 would be infinite: they count as half a step inside.
pub(crate) fn logit_of_byte(opacity: u8) -> f32 {
    const HALF_STEP: f64 = 0.5 / 255.0;
    logit((f64::from(opacity) / 255.0).clamp(HALF_STEP, 1.0 - HALF_STEP)) as f32
}

/// The nearest 8-bit opacity to a logit.
pub(crate) fn byte_of_logit(logit: f32) -> u8 {
    to_byte(sigmoid(f64::from(logit)) * 255.0)
}

/// The DC coefficient of a colour, where 0 to 1 is black to full.
pub(crate) fn dc_of_colour(colour: f64) -> f32 {
    ((colour - 0.5) / SH_C0) as f32
}

/// The colour, usually 0 to 1, that a DC coefficient stands for.
pub(crate) fn colour_of_dc(dc: f32) -> f64 {
    f64::from(dc) * SH_C0 + 0.5
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
