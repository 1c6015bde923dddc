//! What a decoder makes of the log-scales and the opacity of a Gaussian that is not predicted: the steps of its other
//! attributes follow from that.
#![expect(clippy::arithmetic_side_effects, reason = "values on the grid are below 2^26, units are 1 or more")]

use splatstream_decoder::steps::{Stage, StepRule, step};

/// Parts of a step in which attributes are kept, as an integer.
pub(crate) const PARTS: i32 = crate::grid::PARTS as i32;

/// The nearest multiple of a step, halves up, in steps; `parts` of the finest step.
#[inline]
pub(crate) fn nearest_multiple(parts: i32, exponent: u8) -> i32 {
    let unit = PARTS * step(exponent);
    (parts + unit / 2).div_euclid(unit)
}

/// Log-scales and opacity of a Gaussian as they are coded.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shape {
    /// Coded values: the largest log-scale, two differences, the opacity.
    pub(crate) values: [i32; 4],
    /// What they become.
    pub(crate) log_scale: [i32; 3],
    pub(crate) opacity: i32,
}

impl Shape {
    /// The values that bring a Gaussian nearest to what it is, parts of a step. `sorted`: differences are not negative.
    pub(crate) fn new(wanted: [i32; 3], opacity: i32, rule: &StepRule, sorted: bool) -> Self {
        let [first, second, third] = scale_residuals([0; 3], wanted, rule, sorted);
        let largest = first * step(rule.of_largest());
        let of_others = step(rule.of_log_scale(largest));
        let middle = largest - second * of_others;
        let log_scale = [largest, middle, middle - third * of_others];
        let exponent = rule.of(Stage::Opacity, log_scale, 0);
        let value = nearest_multiple(opacity, exponent);
        Self { values: [first, second, third, value], log_scale, opacity: value * step(exponent) }
    }

    /// The exponent of the steps of another attribute.
    pub(crate) fn exponent(&self, stage: Stage, rule: &StepRule) -> u8 {
        rule.of(stage, self.log_scale, self.opacity)
    }

    /// Whether all axes are alike, so that there is nothing to turn.
    pub(crate) fn is_sphere(&self) -> bool {
        self.log_scale[0] == self.log_scale[1] && self.log_scale[1] == self.log_scale[2]
    }
}

/// What brings log-scales near those wanted, parts of a step: of the largest, and of the two differences (7.6.2).
#[expect(clippy::indexing_slicing, reason = "axes are constants")]
pub(crate) fn scale_residuals(now: [i32; 3], wanted: [i32; 3], rule: &StepRule, sorted: bool) -> [i32; 3] {
    let exponent = rule.of_largest();
    let first = nearest_multiple(wanted[0] - PARTS * now[0], exponent);
    let mut before = now[0] + first * step(exponent);
    let exponent = rule.of_log_scale(before);
    let mut difference = |axis: usize| {
        let predicted = now[axis - 1] - now[axis];
        let missing = PARTS * (before - predicted) - wanted[axis];
        // The least value with which the difference is not negative.
        let least = if sorted { -predicted.div_euclid(step(exponent)) } else { i32::MIN };
        // Halves down: what was rounded up together stays together.
        let value = (-nearest_multiple(-missing, exponent)).max(least);
        before -= predicted + value * step(exponent);
        value
    };
    [first, difference(1), difference(2)]
}

/// What brings the log-scales of a parent near those wanted, parts of a step (7.6.2). `sorted`: none becomes larger than
/// the one before it.
#[expect(clippy::indexing_slicing, reason = "axes are constants")]
pub(crate) fn scale_updates(now: [i32; 3], wanted: [i32; 3], rule: &StepRule, sorted: bool) -> [i32; 3] {
    let of_others = rule.of_log_scale(now[0]);
    let exponents = [rule.of_largest(), of_others, of_others];
    let mut limit = i32::MAX;
    [0, 1, 2].map(|axis: usize| {
        let step = step(exponents[axis]);
        let nearest = nearest_multiple(wanted[axis] - PARTS * now[axis], exponents[axis]);
        let value =
            if axis > 0 && sorted { nearest.min((limit - now[axis]).div_euclid(step)) } else { nearest };
        limit = now[axis] + value * step;
        value
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use splatstream_format::syntax::SequenceParameters;

    fn rule(announced: u8) -> StepRule {
        let sequence =
            SequenceParameters { size_weight: [300; 5], size_reference: -200, ..SequenceParameters::PLAIN };
        StepRule::new(&sequence, [announced; 5])
    }

    proptest! {
        #[test]
        fn shapes_are_nearest_to_what_is_wanted(
            wanted in proptest::array::uniform3(-30_000_i32..30_000), opacity in -30_000..30_000, announced in 0_u8..12,
        ) {
            let mut wanted: [i32; 3] = wanted;
            wanted.sort_unstable_by(|a, b| b.cmp(a));
            let rule = rule(announced);
            let shape = Shape::new(wanted, opacity, &rule, true);
            let within = |now: i32, wanted: i32, exponent: u8| (PARTS * now - wanted).abs() <= PARTS * step(exponent) / 2;
            prop_assert!(within(shape.log_scale[0], wanted[0], announced));
            prop_assert!(within(shape.opacity, opacity, shape.exponent(Stage::Opacity, &rule)));
            let others = rule.of_log_scale(shape.log_scale[0]);
            for axis in [1, 2] {
                let is_at_limit = shape.log_scale[axis] == shape.log_scale[axis - 1];
                prop_assert!(within(shape.log_scale[axis], wanted[axis], others) || is_at_limit);
                prop_assert!(shape.log_scale[axis] <= shape.log_scale[axis - 1]);
            }
        }

        #[test]
        fn updates_bring_log_scales_nearest_to_what_is_wanted(
            now in proptest::array::uniform3(-500_i32..500), wanted in proptest::array::uniform3(-30_000_i32..30_000),
            announced in 0_u8..12,
        ) {
            let (mut now, mut wanted): ([i32; 3], [i32; 3]) = (now, wanted);
            now.sort_unstable_by(|a, b| b.cmp(a));
            wanted.sort_unstable_by(|a, b| b.cmp(a));
            let rule = rule(announced);
            let steps = [rule.of_largest(), rule.of_log_scale(now[0]), rule.of_log_scale(now[0])].map(step);
            let values = scale_updates(now, wanted, &rule, true);
            let after = [0, 1, 2].map(|axis: usize| now[axis] + values[axis] * steps[axis]);
            for axis in 0..3 {
                let is_near = (PARTS * after[axis] - wanted[axis]).abs() <= PARTS * steps[axis] / 2;
                let is_at_limit = axis > 0 && after[axis] + steps[axis] > after[axis - 1];
                prop_assert!(is_near || is_at_limit);
                prop_assert!(axis == 0 || after[axis] <= after[axis - 1]);
            }
        }
    }
}
