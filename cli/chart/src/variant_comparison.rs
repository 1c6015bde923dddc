//! How variants stand: speed, and quality at the rate of the baseline.

use super::measure::{Point, Run};
use super::sweep::Group;
use splatstream_render::metrics::{RatePoint, bd_rate, quality_at_rate, rate_at_quality};

/// A variant beside the baseline.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Standing {
    /// Its name.
    pub(crate) name: String,
    /// What it is one of.
    pub(crate) group: Group,
    /// Gaussians per second.
    pub(crate) encode_speed: f64,
    /// Gaussians per second.
    pub(crate) decode_speed: f64,
    /// PSNR at the rate of the baseline, dB; none if its rates do not reach there.
    pub(crate) psnr_at_rate: Option<f64>,
    /// Rate against the baseline at equal PSNR, per cent; none if the curves share no quality.
    pub(crate) bd_rate: Option<f64>,
}

/// A rate in bits per Gaussian of the source and a PSNR.
pub(crate) fn rate_point(point: &Point, source_gaussians: u64) -> RatePoint {
    let rate = point.info.bytes as f64 * 8.0 / source_gaussians.max(1) as f64;
    RatePoint { rate, quality: point.figures.psnr_db }
}

/// The curve of a variant over its qualities, everything decoded.
pub(crate) fn curve(runs: &[Run], variant: &str, source_gaussians: u64) -> Vec<RatePoint> {
    let of_variant = runs.iter().filter(|run| run.variant == variant);
    of_variant.filter_map(Run::full).map(|point| rate_point(point, source_gaussians)).collect()
}

/// Every variant at `quality`, the baseline first.
pub(crate) fn standings(runs: &[Run], quality: &str, source_gaussians: u64) -> Vec<Standing> {
    let Some(baseline) = runs.iter().find(|run| run.group == Group::Baseline && run.quality == quality)
    else {
        return Vec::new();
    };
    let anchor = curve(runs, &baseline.variant, source_gaussians);
    let rate = baseline.full().map_or(0.0, |point| rate_point(point, source_gaussians).rate);
    let at_quality = runs.iter().filter(|run| run.quality == quality);
    let standing = |run: &Run| {
        let test = curve(runs, &run.variant, source_gaussians);
        let speed = |seconds: f64| run.gaussians as f64 / seconds.max(f64::MIN_POSITIVE);
        Standing {
            name: run.variant.clone(),
            group: run.group,
            encode_speed: speed(run.encode.median),
            decode_speed: speed(run.decode.median),
            psnr_at_rate: quality_at_rate(&test, rate),
            bd_rate: if run.group == Group::Baseline { Some(0.0) } else { bd_rate(&anchor, &test) },
        }
    };
    at_quality.map(standing).collect()
}

/// Bytes that the baseline needs for the PSNR of a point, in per cent of the point's bytes.
pub(crate) fn bytes_for_the_same(anchor: &[RatePoint], point: RatePoint) -> Option<f64> {
    Some(100.0 * rate_at_quality(anchor, point.quality)? / point.rate)
}

/// The places of the points that no other point beats in both coordinates, by rising x. More is better.
pub(crate) fn pareto_front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..points.len()).collect();
    places.sort_by(|&a, &b| {
        let ((ax, ay), (bx, by)) = (points[a], points[b]);
        bx.total_cmp(&ax).then(by.total_cmp(&ay))
    });
    let mut best = f64::NEG_INFINITY;
    places.retain(|&place| {
        let better = points[place].1 > best;
        best = best.max(points[place].1);
        better
    });
    places.reverse();
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points = [(1.0, 5.0), (2.0, 4.0), (2.0, 3.0), (3.0, 4.5), (4.0, 1.0), (0.5, 5.0)];
        assert_eq!(pareto_front(&points), [0, 3, 4]);
        assert_eq!(pareto_front(&[]), [0_usize; 0]);
        assert_eq!(pareto_front(&[(1.0, 1.0), (1.0, 1.0)]).len(), 1);
    }

    #[test]
    fn a_curve_at_half_the_rate_needs_half_the_bytes() {
        let anchor: Vec<RatePoint> =
            (0..4).map(|i| RatePoint { rate: f64::from(1 << i), quality: f64::from(i) }).collect();
        let twice = RatePoint { rate: 4.0, quality: 1.0 };
        assert!((bytes_for_the_same(&anchor, twice).unwrap() - 50.0).abs() < 1e-9);
        assert_eq!(bytes_for_the_same(&anchor, RatePoint { rate: 1.0, quality: 9.0 }), None);
    }
}
