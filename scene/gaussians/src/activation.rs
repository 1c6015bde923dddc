//! Between stored values and what they stand for: opacity and its logit, colour and its DC coefficient.
//!
//! `f64` and `libm` throughout, so that the same values give the same frame on every machine.

use crate::sh::SH_C0;

/// Opacity, 0 to 1, of a logit.
pub fn sigmoid(logit: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-logit))
}

/// The logit of an opacity strictly between 0 and 1; infinite at 0 and 1.
pub fn logit(opacity: f64) -> f64 {
    libm::log(opacity / (1.0 - opacity))
}

/// The DC coefficient of a colour, where 0 to 1 is black to full.
pub fn dc_of_colour(colour: f64) -> f32 {
    ((colour - 0.5) / SH_C0) as f32
}

/// The colour, usually 0 to 1, that a DC coefficient stands for.
pub fn colour_of_dc(dc: f32) -> f64 {
    f64::from(dc) * SH_C0 + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logit_inverts_sigmoid_and_colour_inverts_dc() {
        for opacity in [0.001, 0.25, 0.5, 0.999] {
            assert!((sigmoid(logit(opacity)) - opacity).abs() < 1e-12, "{opacity}");
            assert!((colour_of_dc(dc_of_colour(opacity)) - opacity).abs() < 1e-6, "{opacity}");
        }
    }
}
