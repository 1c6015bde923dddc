//! Clause 7.7: the predictors of new Gaussians, and what their neighbours weigh.
//!
//! No sum overflows (annex F.5), and a weight is at least 1, so that none is divided by 0.

use crate::neighbours::Neighbour;
use splatstream_format::{Error, ErrorKind, Result};

/// Neighbours of a Gaussian, at most. Clause 7.7.
pub const NEIGHBOURS_MAX: usize = 16;

/// round(4096 exp(-x / 32)): the weight of a neighbour at a distance x of 0 to 255. Clause 7.7.
pub const EXP: [u16; 256] = [
    4096, 3970, 3848, 3729, 3615, 3503, 3396, 3291, 3190, 3092, 2997, 2904, 2815, 2729, 2645, 2563, 2484,
    2408, 2334, 2262, 2192, 2125, 2060, 1996, 1935, 1875, 1818, 1762, 1707, 1655, 1604, 1555, 1507, 1460,
    1416, 1372, 1330, 1289, 1249, 1211, 1174, 1137, 1102, 1069, 1036, 1004, 973, 943, 914, 886, 859, 832,
    807, 782, 758, 734, 712, 690, 669, 648, 628, 609, 590, 572, 554, 537, 521, 505, 489, 474, 460, 445, 432,
    418, 406, 393, 381, 369, 358, 347, 336, 326, 316, 306, 297, 288, 279, 270, 262, 254, 246, 238, 231, 224,
    217, 210, 204, 198, 192, 186, 180, 174, 169, 164, 159, 154, 149, 145, 140, 136, 132, 128, 124, 120, 116,
    113, 109, 106, 103, 99, 96, 93, 90, 88, 85, 82, 80, 77, 75, 73, 70, 68, 66, 64, 62, 60, 58, 57, 55, 53,
    52, 50, 48, 47, 46, 44, 43, 41, 40, 39, 38, 37, 35, 34, 33, 32, 31, 30, 29, 28, 28, 27, 26, 25, 24, 24,
    23, 22, 21, 21, 20, 20, 19, 18, 18, 17, 17, 16, 16, 15, 15, 14, 14, 13, 13, 13, 12, 12, 12, 11, 11, 10,
    10, 10, 10, 9, 9, 9, 8, 8, 8, 8, 7, 7, 7, 7, 7, 6, 6, 6, 6, 6, 5, 5, 5, 5, 5, 5, 5, 4, 4, 4, 4, 4, 4, 4,
    4, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 1, 1,
];

/// How a block of new Gaussians is predicted: the element predictor. Clause 7.7.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Predictor {
    /// Not at all.
    #[default]
    None,
    /// By neighbours, weighted by distance.
    Knn,
    /// By neighbours, weighted by distance and by the attributes known already.
    Bilateral,
    /// As bilateral, colour by the network of the GOP.
    Transformer,
}

impl Predictor {
    /// Every predictor, in the order of the codes.
    pub const ALL: [Self; 4] = [Self::None, Self::Knn, Self::Bilateral, Self::Transformer];

    /// The predictor of a code; `at` goes into the error.
    ///
    /// # Errors
    /// Invalid if the code is not in 0..=3.
    pub fn from_code(code: i32, at: u64) -> Result<Self> {
        let kind = ErrorKind::OutOfRange { element: "predictor", value: code.into(), min: 0, max: 3 };
        let known = usize::try_from(code).ok().and_then(|code| Self::ALL.get(code)).copied();
        known.ok_or(Error::new(at, "7.7", kind))
    }

    /// The code of the predictor, 0 to 3.
    pub fn code(self) -> i32 {
        match self {
            Self::None => 0,
            Self::Knn => 1,
            Self::Bilateral => 2,
            Self::Transformer => 3,
        }
    }
}

/// Weights of neighbours by the inverse of their squared distance; 1 to 2^16. Clause 7.7.
///
/// A nearest neighbour at distance 0 has all the weight. Neighbours that are not there have weight 0.
pub fn knn_weights(neighbours: &[Neighbour]) -> [i64; NEIGHBOURS_MAX] {
    let mut weights = [0; NEIGHBOURS_MAX];
    let nearest = neighbours.first().map_or(0, |neighbour| neighbour.distance);
    let weighed = neighbours.get(..if nearest == 0 { 1 } else { NEIGHBOURS_MAX }).unwrap_or(neighbours);
    let scale = nearest.saturating_add(1).saturating_mul(1 << 16);
    for (weight, neighbour) in weights.iter_mut().zip(weighed) {
        *weight = scale.checked_div(neighbour.distance.saturating_add(1)).unwrap_or(0).max(1) as i64;
    }
    weights
}

/// Weights of neighbours by distance and by squared difference of attributes; 1 to 4096. Clause 7.7.
///
/// `features` are the differences summed so far, in squared steps, one a neighbour. Neighbours that are not
/// there have weight 0.
pub fn bilateral_weights(
    neighbours: &[Neighbour],
    spatial: u8,
    feature: u8,
    features: &[u64],
) -> [i64; NEIGHBOURS_MAX] {
    let near = spatial_terms(neighbours, spatial);
    let mut weights = [0; NEIGHBOURS_MAX];
    for (((weight, _), near), &difference) in weights.iter_mut().zip(neighbours).zip(near).zip(features) {
        *weight = bilateral_weight(near, difference, feature);
    }
    weights
}

/// What distance adds to the index in [`EXP`] of each neighbour; 0 to 255.
pub(crate) fn spatial_terms(neighbours: &[Neighbour], spatial: u8) -> [u64; NEIGHBOURS_MAX] {
    let mut terms = [0; NEIGHBOURS_MAX];
    let last = neighbours.last().map_or(0, |neighbour| neighbour.distance).saturating_add(1);
    for (term, neighbour) in terms.iter_mut().zip(neighbours) {
        *term = neighbour.distance.saturating_mul(spatial.into()).checked_div(last).unwrap_or(0);
    }
    terms
}

/// The weight of a neighbour from its spatial term and its difference in squared steps.
#[inline(always)]
pub(crate) fn bilateral_weight(near: u64, difference: u64, feature: u8) -> i64 {
    let like = (difference.saturating_mul(feature.into()) >> 6).min(255);
    let index = near.saturating_add(like).min(255) as usize;
    EXP.get(index).copied().unwrap_or(1).into()
}

/// Means with the same weights. Clause 7.7.
///
/// Values have 2^31 added while they are summed: unsigned products of 32 bits are what every machine has in vectors. With
/// weights up to 2^16 and at most 16 values all sums stay below 2^54.
#[derive(Debug, Clone, Copy)]
pub struct WeightedMean {
    weights: [u32; NEIGHBOURS_MAX],
    /// Twice the sum of the weights.
    divisor: u64,
    /// floor(2^62 / `divisor`).
    reciprocal: u64,
}

/// The sign bit, which adds 2^31 to an `i32` if it is flipped and the value read as unsigned.
const SIGN: u32 = 1 << 31;

/// Planes of an attribute, at most: those of SH of degree 3.
const COLUMNS_MAX: usize = 45;

impl WeightedMean {
    /// Means with some weights, at most 16; each is 0 to 2^16.
    pub fn new(of_values: &[i64]) -> Self {
        let mut weights = [0; NEIGHBOURS_MAX];
        weights.iter_mut().zip(of_values).for_each(|(slot, &weight)| *slot = weight as u32);
        let total = weights.iter().map(|&weight| u64::from(weight)).fold(0, u64::wrapping_add);
        let divisor = total.wrapping_mul(2);
        Self { weights, divisor, reciprocal: (1_u64 << 62).checked_div(divisor).unwrap_or(0) }
    }

    /// floor((2 sum of w x + W) / (2 W)), W the sum of the weights: the mean, halves towards positive infinity. Without
    /// weight it is 0.
    pub fn of(&self, values: impl Iterator<Item = i32>) -> i32 {
        let terms = self.weights.iter().zip(values).map(|(&weight, value)| product(weight, value));
        self.mean(terms.fold(0, u64::wrapping_add))
    }

    /// The means of the columns of some rows, as far as `out` goes. One row for each weight.
    pub(crate) fn of_rows<'r>(&self, rows: impl Iterator<Item = &'r [i32]>, out: &mut [i32]) {
        let mut sums = [0; COLUMNS_MAX];
        for (&weight, row) in self.weights.iter().zip(rows) {
            for (sum, &value) in sums.iter_mut().zip(row) {
                *sum = product(weight, value).wrapping_add(*sum);
            }
        }
        out.iter_mut().zip(sums).for_each(|(mean, sum)| *mean = self.mean(sum));
    }

    /// The mean that belongs to a sum of products.
    #[inline]
    fn mean(&self, sum: u64) -> i32 {
        let numerator = sum.wrapping_mul(2).wrapping_add(self.divisor >> 1);
        // The reciprocal is less than 1 too small, so that the quotient is at most 1 too small.
        let product = u128::from(numerator).wrapping_mul(self.reciprocal.into());
        let quotient = (product >> 62) as u64;
        let left = numerator.wrapping_sub(quotient.wrapping_mul(self.divisor));
        let quotient = quotient.wrapping_add(u64::from(left >= self.divisor));
        if self.divisor == 0 { 0 } else { (quotient as u32 ^ SIGN).cast_signed() }
    }
}

/// A weight times a value that has 2^31 added.
#[inline]
fn product(weight: u32, value: i32) -> u64 {
    u64::from(weight).wrapping_mul((value.cast_unsigned() ^ SIGN).into())
}

#[cfg(test)]
#[allow(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(distances: &[u64]) -> Vec<Neighbour> {
        distances.iter().zip(0..).map(|(&distance, index)| Neighbour { distance, index }).collect()
    }

    fn mean(weights: &[i64], values: &[i32]) -> i32 {
        WeightedMean::new(weights).of(values.iter().copied())
    }

    #[test]
    fn the_table_is_that_of_its_formula() {
        for (x, &weight) in (0_u8..=255).zip(&EXP) {
            assert_eq!(f64::from(weight), (4096.0 * (-f64::from(x) / 32.0).exp()).round(), "{x}");
        }
    }

    #[test]
    fn a_code_reads_as_it_is_written() {
        for code in 0..4 {
            assert_eq!(Predictor::from_code(code, 0).map(Predictor::code), Ok(code));
        }
        let kind = |code| Predictor::from_code(code, 0).map_err(|error| error.kind);
        assert!(matches!(kind(4), Err(ErrorKind::OutOfRange { value: 4, .. })));
        assert!(matches!(kind(-1), Err(ErrorKind::OutOfRange { value: -1, .. })));
    }

    #[test]
    fn a_mean_is_rounded_to_the_nearest_and_up_at_halves() {
        let two = |values: [i32; 2]| mean(&[1, 1], &values);
        assert_eq!([two([1, 2]), two([-1, -2]), two([-1, 0]), two([-3, -3])], [2, -1, 0, -3]);
        assert_eq!(mean(&[2, 1], &[-4, -5]), -4);
        assert_eq!(mean(&[1, 2], &[-4, -5]), -5);
        assert_eq!(mean(&[], &[]), 0);
    }

    #[test]
    fn near_neighbours_weigh_more() {
        assert_eq!(knn_weights(&at(&[1, 3, 1 << 40]))[..4], [1 << 16, 1 << 15, 1, 0]);
        assert_eq!(bilateral_weights(&at(&[0, 9]), 32, 0, &[0; 2])[..3], [4096, EXP[28].into(), 0]);
    }

    #[test]
    fn a_neighbour_at_the_point_itself_has_all_the_weight() {
        assert_eq!(knn_weights(&at(&[0, 0, 1]))[..3], [1 << 16, 0, 0]);
        assert_eq!(knn_weights(&[]), [0; NEIGHBOURS_MAX]);
    }

    #[test]
    fn a_neighbour_that_is_far_or_unlike_still_has_weight_1() {
        let unlike = bilateral_weights(&at(&[0, 3 << 40]), 255, 255, &[u64::MAX, 0]);
        assert_eq!(unlike[..2], [1, 1]);
    }

    proptest! {
        #[test]
        fn a_mean_is_the_quotient_of_its_clause(
            terms in proptest::collection::vec((1_i64..=65_536, any::<i32>()), 1..=16),
        ) {
            let (weights, values): (Vec<i64>, Vec<i32>) = terms.into_iter().unzip();
            let total: i64 = weights.iter().sum();
            let sum: i64 = weights.iter().zip(&values).map(|(weight, &value)| weight * i64::from(value)).sum();
            prop_assert_eq!(i64::from(mean(&weights, &values)), (2 * sum + total).div_euclid(2 * total));
        }
    }
}
