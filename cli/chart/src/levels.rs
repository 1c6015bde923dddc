//! Refinement levels: what each adds, and what pictures gain.

use crate::columns::{Column, Row, Value, metrics, other_metrics};
use crate::measure::{Point, Run};
use crate::numbers::bits_per_gaussian;
use splatstream_render::metrics::Comparison;

/// Frames whose units have columns of their own, for people.
pub(crate) const COLUMNS: usize = 4;

/// A refinement level.
#[derive(Debug, Clone)]
pub(crate) struct Level {
    /// Share of the Gaussians of the frames that the level is of, percent.
    pub(crate) percent: u8,
    /// Each of these frames in the order of the stream, and the bytes of its units up to the level.
    pub(crate) units: Vec<(String, u64)>,
    /// Bytes of the stream, or of the GOP, up to the level.
    pub(crate) total_bytes: u64,
    /// Gaussians received, over all frames.
    pub(crate) gaussians: u64,
    /// Means over cameras and all frames.
    pub(crate) figures: Comparison,
    /// Of a GOP with predicted frames: what these look like.
    pub(crate) predicted: Option<PredictedLevel>,
}

/// Predicted frames at a refinement level.
#[derive(Debug, Clone)]
pub(crate) struct PredictedLevel {
    /// Means over predicted frames.
    pub(crate) figures: Comparison,
    /// The same frames without anything that is carried.
    pub(crate) subset: Subset,
}

/// What the paper shows at a refinement level: each predicted frame by itself.
#[derive(Debug, Clone)]
pub(crate) struct Subset {
    /// Bytes of these frames coded so, up to the level.
    pub(crate) bytes: u64,
    /// Their Gaussians up to the level.
    pub(crate) gaussians: u64,
    /// Means over these frames.
    pub(crate) figures: Comparison,
}

impl Level {
    /// Bytes of the units that the level is of.
    pub(crate) fn added_bytes(&self) -> u64 {
        self.units.iter().map(|(_, bytes)| bytes).sum()
    }

    /// Bits per Gaussian received.
    pub(crate) fn bpg(&self) -> f64 {
        bits_per_gaussian(self.total_bytes, self.gaussians)
    }

    fn names(&self) -> String {
        self.units.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(" ")
    }

    fn unit_bytes(&self) -> String {
        self.units.iter().map(|(_, bytes)| bytes.to_string()).collect::<Vec<_>>().join(" ")
    }

    fn of_subset(&self, value: fn(&Subset) -> u64) -> Value {
        self.predicted.as_ref().map_or(Value::None, |predicted| Value::Count(value(&predicted.subset)))
    }
}

impl Row for Level {
    fn columns(rows: &[Self]) -> Vec<Column<Self>> {
        let coded = |row: &Self| Value::words(if row.predicted.is_some() { "predicted" } else { "intra" });
        let mut columns = vec![
            Column::of_file("frames_coded", coded),
            Column::new("percent", "Level", |row: &Self| Value::Percent(row.percent)),
            Column::of_file("units", |row: &Self| Value::words(row.names())),
            Column::of_file("unit_bytes", |row: &Self| Value::words(row.unit_bytes())),
        ];
        let units = rows.first().map_or(&[][..], |row| row.units.as_slice());
        columns.extend(units.iter().take(COLUMNS).enumerate().map(|(index, (name, _))| {
            let of_frame =
                move |row: &Self| row.units.get(index).map_or(Value::None, |unit| Value::Bytes(unit.1));
            Column::of_people(format!("{name} size"), of_frame)
        }));
        columns.extend([
            Column::new("added_bytes", "Added size", |row: &Self| Value::Bytes(row.added_bytes())),
            Column::new("total_bytes", "Total size", |row: &Self| Value::Bytes(row.total_bytes)),
            Column::new("gaussians", "Gaussians", |row: &Self| Value::Count(row.gaussians)),
            Column::new("bpg_shown", "Bits per Gaussian", |row: &Self| Value::number(row.bpg(), 2)),
        ]);
        columns.extend(metrics(|row: &Self| &row.figures));
        columns.extend(other_metrics("inter", "predicted, carried", |row: &Self| {
            row.predicted.as_ref().map(|predicted| &predicted.figures)
        }));
        columns.extend([
            Column::of_file("subset_bytes", |row: &Self| row.of_subset(|subset| subset.bytes)),
            Column::of_file("subset_gaussians", |row: &Self| row.of_subset(|subset| subset.gaussians)),
        ]);
        columns.extend(other_metrics("subset", "predicted, subset", |row: &Self| {
            row.predicted.as_ref().map(|predicted| &predicted.subset.figures)
        }));
        columns
    }
}

/// A row for each refinement level of a run of intra frames.
pub(crate) fn intra_levels(run: &Run) -> Vec<Level> {
    let row = |point: &Point| Level {
        percent: point.info.percent,
        units: (0..)
            .zip(&point.frames)
            .map(|(index, frame)| (format!("I{index}"), frame.increment_bytes))
            .collect(),
        total_bytes: point.info.bytes,
        gaussians: point.info.gaussians,
        figures: point.figures,
        predicted: None,
    };
    run.points.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::samples::run;

    #[test]
    fn a_level_adds_up_the_units_of_its_frames() {
        let rows = intra_levels(&run());
        assert_eq!((rows.len(), rows[0].percent, rows[0].added_bytes()), (2, 20, 500));
        assert_eq!((rows[1].unit_bytes().as_str(), rows[1].bpg()), ("1000 1000", 160.0));
    }
}
