//! The two tables of the paper for intra frames: refinements, and modes of playback by bandwidth.

use super::measure::{Point, Run};
use crate::numbers::bits_per_gaussian;
use splatstream_render::metrics::Comparison;

/// A refinement level.
#[derive(Debug, Clone)]
pub(crate) struct RefinementRow {
    /// Share of the Gaussians, percent.
    pub(crate) percent: u8,
    /// Bytes of each frame's refinement units up to the level.
    pub(crate) unit_bytes: Vec<u64>,
    /// Their sum.
    pub(crate) added_bytes: u64,
    /// Bytes of the whole stream up to the level.
    pub(crate) total_bytes: u64,
    /// Gaussians shown, over all frames.
    pub(crate) gaussians: u64,
    /// Bits per Gaussian shown.
    pub(crate) bpg: f64,
    /// Means over cameras and frames.
    pub(crate) figures: Comparison,
}

/// A mode of playback.
#[derive(Debug, Clone)]
pub(crate) struct Mode {
    /// What it is for.
    pub(crate) name: String,
    /// The units it takes.
    pub(crate) units: String,
    /// Frames that it shows, counted from 0.
    pub(crate) frames: String,
    /// How it plays.
    pub(crate) playback: &'static str,
    /// Share of the Gaussians, in a GOP with predicted frames of those, percent; none if it shows none of them.
    pub(crate) percent: Option<u8>,
    /// Bytes of a GOP.
    pub(crate) bytes: u64,
    /// What the network must carry, Mbit/s.
    pub(crate) mbit_s: f64,
    /// Gaussians of a GOP received for the frames that are shown.
    pub(crate) gaussians: u64,
    /// Means over cameras and the frames that are shown.
    pub(crate) figures: Comparison,
}

impl Mode {
    /// Bits per Gaussian received.
    pub(crate) fn bpg(&self) -> f64 {
        bits_per_gaussian(self.bytes, self.gaussians)
    }
}

/// Mbit/s that frames of so many bytes take.
pub(crate) fn mbit_per_second(bytes: u64, frames: usize, fps: f64) -> f64 {
    bytes as f64 * 8.0 * fps / frames.max(1) as f64 / 1e6
}

/// A row for each refinement level of a run.
pub(crate) fn refinement_rows(run: &Run) -> Vec<RefinementRow> {
    let row = |point: &Point| {
        let unit_bytes: Vec<u64> = point.frames.iter().map(|frame| frame.increment_bytes).collect();
        RefinementRow {
            percent: point.info.percent,
            added_bytes: unit_bytes.iter().sum(),
            unit_bytes,
            total_bytes: point.info.bytes,
            gaussians: point.info.gaussians,
            bpg: bits_per_gaussian(point.info.bytes, point.info.gaussians),
            figures: point.figures,
        }
    };
    run.points.iter().map(row).collect()
}

/// A row for each way to play the stream, least bandwidth first. Layers add rows when a stream has them.
pub(crate) fn bandwidth_rows(run: &Run, fps: f64) -> Vec<Mode> {
    let frames = run.points.first().map_or(0, |point| point.frames.len());
    let mut rows = Vec::new();
    if frames > 1 {
        let ends = [run.points.first(), run.points.last()];
        let names = ["Startup", "Complete first frame"];
        let start = |(name, point): (&str, Option<&Point>)| first_frame(name, point?, run, frames, fps);
        rows.extend(names.into_iter().zip(ends).filter_map(start));
    }
    rows.extend(run.points.iter().map(|point| all_frames(point, run, frames, fps)));
    rows.sort_by_key(|row| row.bytes);
    rows
}

/// The first frame of a GOP alone: what a client needs to show anything.
fn first_frame(name: &str, point: &Point, run: &Run, frames: usize, fps: f64) -> Option<Mode> {
    let first = point.frames.first()?;
    let others: u64 = point.frames.iter().skip(1).map(|frame| frame.bytes).sum();
    let bytes = point.info.bytes - others;
    Some(Mode {
        name: name.to_owned(),
        units: units(point, 1),
        frames: "0".to_owned(),
        playback: "still",
        percent: Some(point.info.percent),
        bytes,
        mbit_s: mbit_per_second(bytes, frames.div_ceil(run.gops.max(1) as usize), fps),
        gaussians: first.gaussians,
        figures: Comparison::mean(&first.views)?,
    })
}

fn all_frames(point: &Point, run: &Run, frames: usize, fps: f64) -> Mode {
    let percent = point.info.percent;
    let gops = u64::from(run.gops.max(1));
    Mode {
        name: if percent == 100 { "Full quality".to_owned() } else { format!("Refinement {percent} %") },
        units: units(point, frames),
        frames: if frames > 1 { format!("0 to {}", frames - 1) } else { "0".to_owned() },
        playback: if frames > 1 { "full frame rate" } else { "still" },
        percent: Some(percent),
        bytes: point.info.bytes / gops,
        mbit_s: mbit_per_second(point.info.bytes, frames, fps),
        gaussians: point.info.gaussians / gops,
        figures: point.figures,
    }
}

/// The units in words: I0 to I3, refinements 0 to 2.
fn units(point: &Point, frames: usize) -> String {
    let intra = if frames > 1 { format!("I0 to I{}", frames - 1) } else { "I0".to_owned() };
    match point.info.point.refinement {
        0 => format!("{intra}, r0"),
        last => format!("{intra}, r0 to r{last}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::costs::Costs;
    use crate::measure::{FramePoint, Timing};
    use crate::sweep::Group;
    use splatstream_decoder::operating_point::{OperatingPoint, OperatingPointInfo};

    fn figures(psnr_db: f64) -> Comparison {
        Comparison {
            psnr_db,
            psnr_masked_db: None,
            yuv_psnr_db: psnr_db,
            ssim: Some(0.9),
            ssim_masked: None,
            st_lpips: None,
        }
    }

    fn point(refinement: u8, percent: u8, bytes: u64) -> Point {
        let frame = |psnr| FramePoint {
            gaussians: 100,
            increment_bytes: bytes / 4,
            bytes: bytes / 4 + 10,
            views: vec![figures(psnr)],
        };
        Point {
            info: OperatingPointInfo {
                point: OperatingPoint { spatial: 0, temporal: 0, refinement },
                bytes,
                gaussians: 200,
                frames: 2,
                percent,
            },
            frames: vec![frame(30.0), frame(20.0)],
            figures: figures(25.0),
        }
    }

    fn run() -> Run {
        let costs = Costs {
            bytes: 0,
            gaussians: 0,
            bpg: 0.0,
            attributes: Vec::new(),
            sections: Vec::new(),
            frame_types: Vec::new(),
            units: Vec::new(),
        };
        let timing = Timing { median: 1.0, least: 1.0, most: 1.0 };
        Run {
            variant: "balanced".to_owned(),
            group: Group::Baseline,
            quality: "high".to_owned(),
            stream: Vec::new(),
            gops: 1,
            gaussians: 200,
            encode: timing,
            decode: timing,
            points: vec![point(0, 20, 1000), point(1, 100, 4000)],
            costs,
        }
    }

    #[test]
    fn a_refinement_row_adds_up_the_units_of_its_frames() {
        let rows = refinement_rows(&run());
        assert_eq!((rows.len(), rows[0].percent, rows[0].added_bytes), (2, 20, 500));
        assert_eq!((rows[1].unit_bytes.as_slice(), rows[1].bpg), (&[1000, 1000][..], 160.0));
    }

    #[test]
    fn modes_come_by_bandwidth_and_the_startup_is_one_frame() {
        let rows = bandwidth_rows(&run(), 30.0);
        let modes: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
        assert_eq!(modes, ["Startup", "Refinement 20 %", "Complete first frame", "Full quality"]);
        let startup = &rows[0];
        assert_eq!((startup.bytes, startup.gaussians, startup.figures.psnr_db), (740, 100, 30.0));
        assert_eq!(rows[3].mbit_s, 4000.0 * 8.0 * 15.0 / 1e6);
        assert_eq!((rows[1].units.as_str(), rows[3].units.as_str()), ("I0 to I1, r0", "I0 to I1, r0 to r1"));
    }
}
