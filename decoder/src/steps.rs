//! Clause 7.6.2: the steps of attributes follow from what is known of a Gaussian already.
//!
//! A step is a power of the square root of two, nearly: its exponent counts half octaves. The increment announces one
//! for each attribute; Gaussians that are larger, fainter or rounder than the references of the sequence keep it, and
//! others get coarser or finer ones.
//!
//! Nothing overflows: sizes are below 2^34, weights below 2^13, so that a sum of three products stays below 2^49.

use crate::vector::{Task, vectorized};
use splatstream_format::entropy::machine::Machine;
use splatstream_format::syntax::{MAX_ATTRIBUTE_STEP, SequenceParameters};

pub use crate::stage::Stage;

/// Exponents of steps, one more than the largest.
const EXPONENTS: usize = MAX_ATTRIBUTE_STEP as usize + 1;

/// The step of each exponent: 1, 2, 3, 4, 6, 8, 12, 16, 24, and so on.
pub const STEPS: [i32; EXPONENTS] = [
    1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024, 1536, 2048, 3072, 4096,
    6144,
];

/// The step of an exponent, which is at most 24. Calculated, since vectors do that and tables keep them from it.
#[inline(always)]
pub fn step(exponent: u8) -> i32 {
    let exponent = u32::from(exponent.min(MAX_ATTRIBUTE_STEP));
    let odd = (exponent & 1).cast_signed();
    odd.wrapping_add(3).wrapping_shl(exponent >> 1) >> 1
}

/// The size of a Gaussian: the sum of its two largest log-scales.
#[inline(always)]
pub fn size(log_scale: [i32; 3]) -> i64 {
    let [a, b, c] = log_scale.map(i64::from);
    a.wrapping_add(b).wrapping_add(c).wrapping_sub(a.min(b).min(c))
}

/// The largest log-scale less the smallest.
#[inline(always)]
pub fn anisotropy(log_scale: [i32; 3]) -> i64 {
    let [a, b, c] = log_scale.map(i64::from);
    a.max(b).max(c).wrapping_sub(a.min(b).min(c))
}

/// How the exponents of the steps of a unit follow from what is known of a Gaussian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepRule {
    /// `attribute_step` of the unit: log_scale, opacity, rotation, dc, sh.
    announced: [u8; 5],
    /// Weights of the size, by attribute.
    size_weight: [i64; 5],
    /// Weights of the opacity, by attribute; 0 for log_scale and opacity.
    opacity_weight: [i64; 5],
    anisotropy_weight: i64,
    size_reference: i64,
    opacity_reference: i64,
    anisotropy_reference: i64,
}

/// The exponents of the steps of one attribute of some Gaussians.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Exponents {
    /// All have the same.
    Same(u8),
    /// One for each Gaussian.
    Each(Vec<u8>),
}

impl StepRule {
    /// The rule of a unit that announces `attribute_step`.
    pub fn new(sequence: &SequenceParameters, attribute_step: [u8; 5]) -> Self {
        let [rotation, dc, sh] = sequence.opacity_weight.map(i64::from);
        Self {
            announced: attribute_step,
            size_weight: sequence.size_weight.map(i64::from),
            opacity_weight: [0, 0, rotation, dc, sh],
            anisotropy_weight: sequence.anisotropy_weight.into(),
            size_reference: sequence.size_reference.into(),
            opacity_reference: sequence.opacity_reference.into(),
            anisotropy_reference: sequence.anisotropy_reference.into(),
        }
    }

    /// The exponent of the largest log-scale, which is the first value of a Gaussian.
    pub const fn of_largest(&self) -> u8 {
        let [exponent, ..] = self.announced;
        exponent
    }

    /// The exponent of the other log-scales of a Gaussian with this largest one.
    #[inline(always)]
    pub fn of_log_scale(&self, largest: i32) -> u8 {
        let [weight, ..] = self.size_weight;
        let below = self.size_reference.wrapping_sub(i64::from(largest).wrapping_mul(2));
        self.exponent(Stage::LogScale, weight.wrapping_mul(below))
    }

    /// The exponent of an attribute after log_scale. What comes after the attribute does not matter: to that of the
    /// opacity the opacity, to that of dc and sh the anisotropy.
    #[inline(always)]
    pub fn of(&self, stage: Stage, log_scale: [i32; 3], opacity: i32) -> u8 {
        let weight = |weights: &[i64; 5]| weights.get(stage as usize).copied().unwrap_or(0);
        let below = self.size_reference.wrapping_sub(size(log_scale));
        let mut sum = weight(&self.size_weight).wrapping_mul(below);
        let fainter = self.opacity_reference.wrapping_sub(opacity.into()).max(0);
        sum = sum.wrapping_add(weight(&self.opacity_weight).wrapping_mul(fainter));
        if stage == Stage::Rotation {
            let rounder = self.anisotropy_reference.wrapping_sub(anisotropy(log_scale)).max(0);
            sum = sum.wrapping_add(self.anisotropy_weight.wrapping_mul(rounder));
        }
        self.exponent(stage, sum)
    }

    /// Adds a weighted sum, Q14, to the announced exponent.
    #[inline(always)]
    fn exponent(&self, stage: Stage, sum: i64) -> u8 {
        let announced = self.announced.get(stage as usize).copied().unwrap_or(0);
        let finer = sum.wrapping_add(1 << 13).wrapping_shr(14);
        i64::from(announced).wrapping_add(finer).clamp(0, MAX_ATTRIBUTE_STEP.into()) as u8
    }

    /// The exponents of an attribute of Gaussians of which what comes before it is known; of log_scale, those of the
    /// two planes after the first. Planes that are not known yet may be empty.
    pub fn exponents(&self, stage: Stage, log_scale: [&[i32]; 3], opacity: &[i32]) -> Exponents {
        let sum = self.weighted(stage);
        if sum.is_zero() {
            return Exponents::Same(self.announced.get(stage as usize).copied().unwrap_or(0));
        }
        let [largest, middle, smallest] = log_scale;
        let Some(narrow) = sum.narrow(log_scale, opacity) else {
            return Exponents::Each(match stage {
                Stage::LogScale => largest.iter().map(|&largest| self.of_log_scale(largest)).collect(),
                Stage::Opacity => {
                    let shapes = largest.iter().zip(middle).zip(smallest);
                    shapes.map(|((&a, &b), &c)| self.of(stage, [a, b, c], 0)).collect()
                }
                _ => {
                    let known = largest.iter().zip(middle).zip(smallest).zip(opacity);
                    known.map(|(((&a, &b), &c), &opacity)| self.of(stage, [a, b, c], opacity)).collect()
                }
            });
        };
        let mut exponents = vec![0; largest.len()];
        let planes = match stage {
            // The size that matters is that of a disc of the largest log-scale, and nothing else is weighed.
            Stage::LogScale => [largest, largest, largest, largest],
            Stage::Opacity => [largest, middle, smallest, largest],
            _ => [largest, middle, smallest, opacity],
        };
        vectorized(EachExponent { sum: narrow, planes, out: &mut exponents });
        Exponents::Each(exponents)
    }

    /// The weighted sum of an attribute after log_scale.
    fn weighted(&self, stage: Stage) -> WeightedSum<i64> {
        let weight = |weights: &[i64; 5]| weights.get(stage as usize).copied().unwrap_or(0);
        WeightedSum {
            announced: self.announced.get(stage as usize).copied().unwrap_or(0).into(),
            weights: [
                weight(&self.size_weight),
                weight(&self.opacity_weight),
                if stage == Stage::Rotation { self.anisotropy_weight } else { 0 },
            ],
            references: [self.size_reference, self.opacity_reference, self.anisotropy_reference],
        }
    }
}

/// What is added to an exponent, Q14: of size, opacity and anisotropy how far each is below its reference, weighted.
#[derive(Debug, Clone, Copy)]
struct WeightedSum<T> {
    announced: T,
    weights: [T; 3],
    references: [T; 3],
}

impl WeightedSum<i64> {
    fn is_zero(&self) -> bool {
        self.weights == [0; 3]
    }

    /// The same in 32 bits, unless values of these planes might overflow it.
    fn narrow(&self, log_scale: [&[i32]; 3], opacity: &[i32]) -> Option<WeightedSum<i32>> {
        let greatest =
            |plane: &[i32]| plane.iter().fold(0, |greatest, value| value.unsigned_abs().max(greatest));
        let of_scales = log_scale.map(greatest).into_iter().fold(0, u32::max);
        // Sizes and anisotropies are of two log-scales.
        let reaches = [
            i64::from(of_scales).wrapping_mul(2),
            greatest(opacity).into(),
            i64::from(of_scales).wrapping_mul(2),
        ];
        let term = |((weight, reference), reach): ((i64, i64), i64)| {
            weight.saturating_mul(reference.saturating_abs().saturating_add(reach))
        };
        let terms = self.weights.into_iter().zip(self.references).zip(reaches).map(term);
        let most = terms.fold(1 << 14, i64::saturating_add);
        let half = |value: i64| i32::try_from(value).ok().filter(|value| value.unsigned_abs() < 1 << 30);
        let [a, b, c] = self.weights.map(half);
        let [d, e, f] = self.references.map(half);
        (most < 1 << 30 && of_scales < 1 << 28).then_some(())?;
        Some(WeightedSum {
            announced: half(self.announced)?,
            weights: [a?, b?, c?],
            references: [d?, e?, f?],
        })
    }
}

/// The exponents of some Gaussians, from largest, middle and smallest log-scale and opacity.
struct EachExponent<'p> {
    sum: WeightedSum<i32>,
    planes: [&'p [i32]; 4],
    out: &'p mut [u8],
}

impl Task for EachExponent<'_> {
    #[inline(always)]
    fn run(self, _: impl Machine) {
        let Self { sum: WeightedSum { announced, weights, references }, planes, out } = self;
        let ([of_size, of_opacity, of_anisotropy], [size, opacity, anisotropy]) = (weights, references);
        let [a, b, c, d] = planes;
        for ((((slot, &a), &b), &c), &d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            let (least, greatest) = (a.min(b).min(c), a.max(b).max(c));
            let below = size.wrapping_sub(a.wrapping_add(b).wrapping_add(c).wrapping_sub(least));
            let fainter = opacity.wrapping_sub(d).max(0);
            let rounder = anisotropy.wrapping_sub(greatest.wrapping_sub(least)).max(0);
            let sum = of_size.wrapping_mul(below).wrapping_add(of_opacity.wrapping_mul(fainter));
            let sum = sum.wrapping_add(of_anisotropy.wrapping_mul(rounder));
            let exponent = announced.wrapping_add(sum.wrapping_add(1 << 13) >> 14);
            *slot = exponent.clamp(0, MAX_ATTRIBUTE_STEP.into()) as u8;
        }
    }
}

impl Exponents {
    /// The exponent of a Gaussian.
    #[inline(always)]
    pub fn at(&self, row: usize) -> u8 {
        match self {
            Self::Same(exponent) => *exponent,
            Self::Each(exponents) => exponents.get(row).copied().unwrap_or(0),
        }
    }

    /// Adds a bias to coded values, and multiplies them by the steps. Values are below 2^17, so that products fit.
    pub fn scale(&self, values: &mut [i32], bias: i32) {
        match self {
            Self::Same(0) => values.iter_mut().for_each(|value| *value = value.wrapping_add(bias)),
            Self::Same(exponent) => {
                let step = step(*exponent);
                values.iter_mut().for_each(|value| *value = value.wrapping_add(bias).wrapping_mul(step));
            }
            Self::Each(exponents) => {
                for (value, &exponent) in values.iter_mut().zip(exponents) {
                    *value = value.wrapping_add(bias).wrapping_mul(step(exponent));
                }
            }
        }
    }

    /// Those of the Gaussians in a range.
    pub(crate) fn part(&self, range: core::ops::Range<usize>) -> Self {
        match self {
            Self::Same(exponent) => Self::Same(*exponent),
            Self::Each(exponents) => Self::Each(exponents.get(range).unwrap_or_default().to_vec()),
        }
    }

    /// Values times the steps.
    pub fn scaled(&self, values: &[i32]) -> Vec<i32> {
        let mut scaled = values.to_vec();
        self.scale(&mut scaled, 0);
        scaled
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_steps_are_those_of_their_formula() {
        assert_eq!(STEPS[0], 1);
        for (exponent, &step) in STEPS.iter().enumerate() {
            assert_eq!(super::step(exponent as u8), step);
        }
        for (exponent, &step) in STEPS.iter().enumerate().skip(1) {
            let thirds = i32::from((exponent + 1) % 2 == 1);
            assert_eq!(step, (2 + thirds) << ((exponent - 1) / 2), "{exponent}");
        }
    }

    #[test]
    fn from_an_odd_exponent_the_third_next_step_is_three_times_as_large() {
        for exponent in (1..EXPONENTS - 3).step_by(2) {
            assert_eq!(STEPS[exponent + 3], 3 * STEPS[exponent]);
        }
    }

    fn rule(weights: [i64; 2], announced: u8) -> StepRule {
        StepRule {
            announced: [announced; 5],
            size_weight: [weights[0]; 5],
            opacity_weight: [0, 0, weights[1], weights[1], weights[1]],
            anisotropy_weight: weights[1],
            size_reference: 100,
            opacity_reference: 50,
            anisotropy_reference: 10,
        }
    }

    #[test]
    fn smaller_fainter_and_rounder_gaussians_have_coarser_steps() {
        let rule = rule([1 << 13, 1 << 12], 4);
        // The size is 20, which is 80 below the reference; the opacity 30 below, and the anisotropy at it.
        assert_eq!(rule.of(Stage::Opacity, [10, 10, 0], 0), 24);
        assert_eq!(rule.of(Stage::Dc, [50, 50, 40], 20), 4 + 8);
        assert_eq!(rule.of(Stage::Rotation, [50, 50, 46], 20), 4 + 9);
        assert_eq!(rule.of(Stage::Sh, [60, 50, 40], 90), 0);
        assert_eq!([rule.of_log_scale(50), rule.of_log_scale(49), rule.of_log_scale(60)], [4, 5, 0]);
    }

    proptest! {
        #[test]
        fn planes_have_the_exponents_of_their_gaussians(
            gaussians in proptest::collection::vec(([-300..300, -300..300, -300..300], -300..300), 1..20),
            weights in [0_i64..8192, 0_i64..8192], announced in 0_u8..=24,
        ) {
            let rule = rule(weights, announced);
            let plane = |axis: usize| gaussians.iter().map(|(q, _)| q[axis]).collect::<Vec<i32>>();
            let (log_scale, opacity) = ([plane(0), plane(1), plane(2)], gaussians.iter().map(|&(_, o)| o).collect::<Vec<_>>());
            for stage in Stage::ALL {
                let exponents = rule.exponents(stage, log_scale.each_ref().map(Vec::as_slice), &opacity);
                for (row, &(q, o)) in gaussians.iter().enumerate() {
                    let expected = if stage == Stage::LogScale { rule.of_log_scale(q[0]) } else { rule.of(stage, q, o) };
                    prop_assert_eq!(exponents.at(row), expected);
                }
            }
        }
    }
}
