//! Values as formats store them: opacities and anything else on a scale of 0 to 255, and semi-axes, not their logs.

use splatstream_gaussians::activation::{logit, sigmoid};

/// The logit of an 8-bit opacity. 0 and 255 would be infinite: they count as half a step inside.
pub(crate) fn logit_of_byte(opacity: u8) -> f32 {
    logit_within(f64::from(opacity) / 255.0, 0.5 / 255.0)
}

/// The logit of an opacity, which is taken to be this far from 0 and 1 at least: there it would be infinite.
pub(crate) fn logit_within(opacity: f64, margin: f64) -> f32 {
    logit(opacity.clamp(margin, 1.0 - margin)) as f32
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

/// The smallest semi-axis told from zero: smaller ones, zero among them, have no finite log.
const SMALLEST_SCALE: f32 = 1e-10;

/// The natural log of a semi-axis; one of zero length, or less, counts as the smallest.
pub(crate) fn log_scale_of(scale: f32) -> f32 {
    // Not `max`, which would hide a NaN.
    let scale = if scale < SMALLEST_SCALE { SMALLEST_SCALE } else { scale };
    libm::log(f64::from(scale)) as f32
}

/// The semi-axis of a log; one beyond the largest float is that.
pub(crate) fn scale_of_log(log: f32) -> f32 {
    // `as` gives infinity beyond the largest float: the largest is nearer.
    (libm::exp(f64::from(log)) as f32).min(f32::MAX)
}

/// Whether [`scale_of_log`] cannot keep a log.
pub(crate) fn is_beyond_scales(log: f32) -> bool {
    f64::from(log) > libm::log(f64::from(f32::MAX))
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
