//! Clause 7.10: from codes of positions to points of the position grid.
//!
//! Near the middle of the grid a step of the code is a step of the grid. Outside, a step doubles from segment to
//! segment, so that far Gaussians take few bits. Everything in the decoding process but its output works on codes.
//!
//! No point that a code stands for leaves its type (annex F.7).

use splatstream_format::syntax::SequenceParameters;

/// The piecewise linear map of one axis; it is the same on all axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Companding {
    /// The code in the middle, which stands for itself.
    middle: i64,
    /// Half the length of the linear part.
    linear: i64,
    segment_log2: u32,
}

impl Companding {
    /// The map of a sequence.
    pub fn new(sequence: &SequenceParameters) -> Self {
        let bits = u32::from(sequence.position_bits).saturating_sub(1);
        Self {
            middle: 1_i64.wrapping_shl(bits),
            linear: 1_i64.wrapping_shl(sequence.linear_log2.into()),
            segment_log2: sequence.segment_log2.into(),
        }
    }

    /// Whether every code stands for itself.
    pub const fn is_linear(&self) -> bool {
        self.linear >= self.middle
    }

    /// The point of the grid that a code stands for; below 2^45 in magnitude.
    pub fn expand(&self, code: u32) -> i64 {
        let apart = i64::from(code).wrapping_sub(self.middle);
        let outside = apart.abs().wrapping_sub(self.linear);
        if outside <= 0 {
            return code.into();
        }
        // A sequence has at most 24 segments on a side.
        let segment = outside.wrapping_shr(self.segment_log2).wrapping_add(1).min(25) as u32;
        let rest = outside & 1_i64.wrapping_shl(self.segment_log2).wrapping_sub(1);
        let whole = 1_i64.wrapping_shl(segment).wrapping_sub(2).wrapping_shl(self.segment_log2);
        let far = self.linear.wrapping_add(whole).wrapping_add(rest.wrapping_shl(segment));
        self.middle.wrapping_add(if apart < 0 { far.wrapping_neg() } else { far })
    }
}

#[cfg(test)]
#[expect(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
mod tests {
    use super::*;

    fn map(bits: u32, linear_log2: u32, segment_log2: u32) -> Companding {
        Companding { middle: 1 << (bits - 1), linear: 1 << linear_log2, segment_log2 }
    }

    #[test]
    fn steps_double_from_segment_to_segment() {
        let map = map(6, 2, 1);
        let points: Vec<i64> = (32..=45).map(|code| map.expand(code) - 32).collect();
        assert_eq!(points, [0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96]);
    }

    #[test]
    fn the_map_rises_and_is_symmetric_about_the_middle() {
        for map in [map(20, 16, 15), map(20, 15, 15), map(10, 3, 5), map(1, 0, 0)] {
            let codes = 2 * map.middle as u32;
            assert!((1..codes).all(|code| map.expand(code - 1) < map.expand(code)));
            assert!((1..codes).all(|code| map.expand(code) + map.expand(codes - code) == i64::from(codes)));
        }
    }

    #[test]
    fn a_map_that_is_linear_everywhere_changes_nothing() {
        let map = map(12, 11, 0);
        assert!(map.is_linear());
        assert!((0..1 << 12).all(|code| map.expand(code) == i64::from(code)));
    }

    #[test]
    fn the_farthest_point_is_below_2_to_the_45() {
        let map = map(20, 15, 15);
        assert!(map.expand(0).abs() < 1 << 45 && map.expand((1 << 20) - 1) < 1 << 45);
    }
}
