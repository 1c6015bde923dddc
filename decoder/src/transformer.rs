//! Clause 7.7.6: the learned predictor, a network over the neighbours of a new Gaussian.
//!
//! A [`Batch`] holds what the network sees of [`LANES`] Gaussians, one a lane. [`scalar`] is the text line by line for
//! one of them; [`LaneNetwork`] computes all at once and gives the same integers.
//!
//! No sum overflows (annex F.6).

mod batch;
mod lanes;
pub mod scalar;

pub use batch::{Batch, LANES, Seen};
pub(crate) use lanes::{Columns, Lane, packed};
pub use lanes::{LaneNetwork, Machine};

/// Outputs of a network, at most: 3 components of dc and 16 of sh.
pub const OUTPUTS_MAX: usize = 19;

/// Inputs of a token, at most.
pub const INPUTS_MAX: usize = OUTPUTS_MAX + 8;

/// Neighbours, at most.
pub(crate) const RANKS: usize = crate::predictor::NEIGHBOURS_MAX;

/// 127 sin(pi x / 256), rounded. Clause 7.7.7.
pub const SINE: [i8; 129] = [
    0, 2, 3, 5, 6, 8, 9, 11, 12, 14, 16, 17, 19, 20, 22, 23, 25, 26, 28, 29, 31, 32, 34, 35, 37, 38, 40, 41,
    43, 44, 46, 47, 49, 50, 51, 53, 54, 56, 57, 58, 60, 61, 63, 64, 65, 67, 68, 69, 71, 72, 73, 74, 76, 77,
    78, 79, 81, 82, 83, 84, 85, 86, 88, 89, 90, 91, 92, 93, 94, 95, 96, 97, 98, 99, 100, 101, 102, 103, 104,
    105, 106, 106, 107, 108, 109, 110, 111, 111, 112, 113, 113, 114, 115, 115, 116, 117, 117, 118, 118, 119,
    120, 120, 121, 121, 122, 122, 122, 123, 123, 124, 124, 124, 125, 125, 125, 125, 126, 126, 126, 126, 126,
    127, 127, 127, 127, 127, 127, 127, 127,
];

/// 127 times the sine of `x` of 512 parts of a circle, rounded. Clause 7.7.7.
pub fn sine(x: i32) -> i32 {
    let place = x.rem_euclid(128).unsigned_abs();
    let quarter = x.rem_euclid(512) >> 7;
    let place = if quarter & 1 == 0 { place } else { 128_u32.wrapping_sub(place) };
    let value = SINE.get(place as usize).copied().unwrap_or(0).into();
    if quarter < 2 { value } else { 0_i32.wrapping_sub(value) }
}

/// Round(x, shift) of clause 4.2.
pub(crate) fn round(x: i32, shift: u32) -> i32 {
    x.wrapping_add(1_i32.wrapping_shl(shift.wrapping_sub(1))).wrapping_shr(shift)
}

/// An activation: rounded and clamped. Clause 7.7.6.
pub(crate) fn act(x: i32, shift: u32) -> i32 {
    round(x, shift).clamp(-127, 127)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_that_of_its_formula() {
        for (x, &value) in (0_u8..).zip(&SINE) {
            let exact = 127.0 * (f64::from(x) * core::f64::consts::PI / 256.0).sin();
            assert_eq!(f64::from(value), (exact + 0.5).floor(), "{x}");
        }
    }

    #[test]
    fn the_sine_goes_round() {
        for x in -2000..2000 {
            let exact = 127.0 * (f64::from(x) * core::f64::consts::PI / 256.0).sin();
            assert!((f64::from(sine(x)) - exact).abs() <= 0.5 + 1e-9, "{x}");
            assert_eq!(sine(x + 512), sine(x));
            assert_eq!(sine(-x), -sine(x));
        }
    }
}
