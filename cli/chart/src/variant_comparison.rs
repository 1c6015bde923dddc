//! How variants stand: speed, and quality at the rate of the baseline.

use super::measure::{Point, Run};
use super::sweep::Group;
use super::timing::Timing;
use crate::columns::{Column, Medium, PROGRAMS, Row, Value};
use splatstream_render::metrics::{RatePoint, bd_rate, quality_at_rate, rate_at_quality};

/// All media but files, which have seconds.
const NOT_IN_FILES: &[Medium] = &[Medium::Json, Medium::Terminal, Medium::Page];

/// A run of a variant, beside the baseline.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Standing {
    /// Its name.
    pub(crate) name: String,
    /// What it is one of.
    pub(crate) group: Group,
    /// The quality as the command line spells it.
    pub(crate) quality: String,
    /// Gaussians coded, over all frames.
    pub(crate) gaussians: u64,
    /// Seconds to encode and to decode.
    pub(crate) encode: Timing,
    pub(crate) decode: Timing,
    /// PSNR at the rate of the baseline, dB; none if its rates do not reach there, or at another quality.
    pub(crate) psnr_at_rate: Option<f64>,
    /// PSNR at that rate above that of the baseline, dB.
    pub(crate) gain_db: Option<f64>,
    /// Rate against the baseline at equal PSNR, percent; none if the curves share no quality, or at another quality.
    pub(crate) bd_rate: Option<f64>,
}

impl Standing {
    /// Gaussians per second.
    pub(crate) fn encode_speed(&self) -> f64 {
        self.speed(self.encode)
    }

    /// Gaussians per second.
    pub(crate) fn decode_speed(&self) -> f64 {
        self.speed(self.decode)
    }

    fn speed(&self, timing: Timing) -> f64 {
        self.gaussians as f64 / timing.median.max(f64::MIN_POSITIVE)
    }

    fn is_baseline(&self) -> bool {
        self.group == Group::Baseline
    }

    fn label(&self) -> String {
        if self.is_baseline() { format!("{} (baseline)", self.name) } else { self.name.clone() }
    }
}

impl Row for Standing {
    fn columns(_: &[Self]) -> Vec<Column<Self>> {
        let seconds = |name, value: fn(&Self) -> f64| {
            Column::of_file(name, move |row: &Self| Value::number(value(row), 6))
        };
        let psnr = |row: &Self| Value::number(row.psnr_at_rate, 2);
        vec![
            Column::of_people("Variant", |row: &Self| Value::words(row.label())),
            Column::new("group", "", |row: &Self| Value::words(row.group.name())).on(PROGRAMS),
            Column::new("variant", "", |row: &Self| Value::words(&row.name)).on(PROGRAMS),
            Column::of_file("quality", |row: &Self| Value::words(&row.quality)),
            Column::of_file("gaussians", |row: &Self| Value::Count(row.gaussians)),
            seconds("encode_s", |row| row.encode.median),
            seconds("encode_s_min", |row| row.encode.least),
            seconds("encode_s_max", |row| row.encode.most),
            seconds("decode_s", |row| row.decode.median),
            seconds("decode_s_min", |row| row.decode.least),
            seconds("decode_s_max", |row| row.decode.most),
            Column::new("encode_gaussians_per_second", "Encoding", |row: &Self| {
                Value::Speed(row.encode_speed())
            })
            .on(NOT_IN_FILES),
            Column::new("decode_gaussians_per_second", "Decoding", |row: &Self| {
                Value::Speed(row.decode_speed())
            })
            .on(NOT_IN_FILES),
            Column::new("psnr_db_at_baseline_rate", "PSNR at the baseline's rate, dB", psnr),
            Column::of_people("Against the baseline", |row: &Self| Value::difference(row.gain_db, " dB")),
            Column::new("bd_rate_percent", "BD-rate", |row: &Self| Value::difference(row.bd_rate, " %")),
        ]
    }

    fn stands_out(&self) -> bool {
        self.is_baseline()
    }
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

/// Every run, in its order. Those at `quality` are compared with the baseline at that quality.
pub(crate) fn standings(runs: &[Run], quality: &str, source_gaussians: u64) -> Vec<Standing> {
    let baseline = runs.iter().find(|run| run.group == Group::Baseline && run.quality == quality);
    let anchor = baseline.map_or_else(Vec::new, |run| curve(runs, &run.variant, source_gaussians));
    let rate = baseline.and_then(Run::full).map_or(0.0, |point| rate_point(point, source_gaussians).rate);
    let of_baseline = quality_at_rate(&anchor, rate);
    let standing = |run: &Run| {
        let is_compared = baseline.is_some() && run.quality == quality;
        let test = if is_compared { curve(runs, &run.variant, source_gaussians) } else { Vec::new() };
        let psnr_at_rate = if is_compared { quality_at_rate(&test, rate) } else { None };
        Standing {
            name: run.variant.clone(),
            group: run.group,
            quality: run.quality.clone(),
            gaussians: run.gaussians,
            encode: run.encode,
            decode: run.decode,
            psnr_at_rate,
            gain_db: psnr_at_rate.zip(of_baseline).map(|(own, other)| own - other),
            bd_rate: match run.group {
                _ if !is_compared => None,
                Group::Baseline => Some(0.0),
                _ => bd_rate(&anchor, &test),
            },
        }
    };
    runs.iter().map(standing).collect()
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
