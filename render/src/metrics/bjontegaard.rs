//! The mean difference of two rate-distortion curves.
//!
//! Source: Bjøntegaard, VCEG-M33, 2001, for the idea; the interpolation is the monotone piecewise cubic of
//! Fritsch and Carlson, 1980, with Butland's slopes, as in the later calculations of JCT-VC.

mod pchip;

use pchip::Pchip;

/// One measurement of a codec.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatePoint {
    /// Bits, bytes, or either per second: above 0, in one unit for both curves.
    pub rate: f64,
    /// Quality, higher is better: PSNR in dB, or another metric in its unit.
    pub quality: f64,
}

/// How much more rate `test` needs than `anchor` for the same quality, in per cent of the anchor's: negative
/// is better. The mean over the qualities that both reach of the difference in log10(rate), as a ratio.
///
/// Points that are not finite or without a rate, and points that another point of their curve dominates (at
/// most its rate, at least its quality), are left out first: what is left rises in both. None if fewer than two
/// points are left of a curve, or if the curves share no interval of quality. Four points or more are good
/// practice.
#[must_use]
pub fn bd_rate(anchor: &[RatePoint], test: &[RatePoint]) -> Option<f64> {
    let by_quality = |point: &RatePoint| (point.quality, libm::log10(point.rate));
    let exponent = mean_difference(anchor, test, by_quality)?;
    Some(100.0 * (libm::exp10(exponent) - 1.0))
}

/// How much more quality `test` has than `anchor` at the same rate, in the unit of the quality: positive is
/// better. The mean over log10(rate) where both curves have rates; points as in [`bd_rate`].
#[must_use]
pub fn bd_psnr(anchor: &[RatePoint], test: &[RatePoint]) -> Option<f64> {
    mean_difference(anchor, test, |point| (libm::log10(point.rate), point.quality))
}

/// The quality of a curve at a rate: the curve of [`bd_psnr`], of log10(rate). None outside its rates.
#[must_use]
pub fn quality_at_rate(curve: &[RatePoint], rate: f64) -> Option<f64> {
    let points: Vec<_> =
        undominated(curve).iter().map(|point| (libm::log10(point.rate), point.quality)).collect();
    Pchip::through(&points)?.at(libm::log10(rate))
}

/// The rate at which a curve reaches a quality: the curve of [`bd_rate`]. None outside its qualities.
#[must_use]
pub fn rate_at_quality(curve: &[RatePoint], quality: f64) -> Option<f64> {
    let points: Vec<_> =
        undominated(curve).iter().map(|point| (point.quality, libm::log10(point.rate))).collect();
    Pchip::through(&points)?.at(quality).map(libm::exp10)
}

/// The mean of test less anchor, where `axes` makes abscissa and ordinate of a point.
fn mean_difference(
    anchor: &[RatePoint],
    test: &[RatePoint],
    axes: impl Fn(&RatePoint) -> (f64, f64),
) -> Option<f64> {
    let curve = |points| Pchip::through(&undominated(points).iter().map(&axes).collect::<Vec<_>>());
    let (anchor, test) = (curve(anchor)?, curve(test)?);
    let (from, to) = (anchor.from().max(test.from()), anchor.to().min(test.to()));
    (from < to).then(|| (test.integral(from, to) - anchor.integral(from, to)) / (to - from))
}

/// The points no other point is better than, by rising rate and quality.
fn undominated(points: &[RatePoint]) -> Vec<RatePoint> {
    let usable = |point: &&RatePoint| point.rate.is_finite() && point.rate > 0.0 && point.quality.is_finite();
    let mut points: Vec<RatePoint> = points.iter().filter(usable).copied().collect();
    points.sort_by(|a, b| a.rate.total_cmp(&b.rate).then(b.quality.total_cmp(&a.quality)));
    let mut best = f64::NEG_INFINITY;
    points.retain(|point| {
        let better = point.quality > best;
        best = best.max(point.quality);
        better
    });
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dominated_points_are_left_out() {
        let point = |(rate, quality)| RatePoint { rate, quality };
        let points = [(4.0, 30.0), (1.0, 20.0), (2.0, 19.0), (4.0, 31.0), (5.0, 31.0), (6.0, f64::INFINITY)];
        assert_eq!(undominated(&points.map(point)), [(1.0, 20.0), (4.0, 31.0)].map(point));
    }

    #[test]
    fn a_curve_goes_through_its_points_and_ends_with_them() {
        let curve =
            [(1.0, 20.0), (2.0, 26.0), (8.0, 31.0)].map(|(rate, quality)| RatePoint { rate, quality });
        for point in curve {
            assert!((quality_at_rate(&curve, point.rate).unwrap() - point.quality).abs() < 1e-9);
            assert!((rate_at_quality(&curve, point.quality).unwrap() - point.rate).abs() < 1e-9);
        }
        let between = quality_at_rate(&curve, 4.0).unwrap();
        assert!(between > 26.0 && between < 31.0, "{between}");
        assert_eq!((quality_at_rate(&curve, 0.9), quality_at_rate(&curve, 8.1)), (None, None));
        assert_eq!((rate_at_quality(&curve, 19.0), rate_at_quality(&curve[..1], 20.0)), (None, None));
    }
}
