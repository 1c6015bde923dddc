//! Ways to play a stream: operating points by the bandwidth that they take.

use crate::columns::{Column, Row, Value, metrics};
use crate::measure::{Point, Run};
use crate::numbers::bits_per_gaussian;
use splatstream_render::metrics::Comparison;

/// A mode of playback.
#[derive(Debug, Clone)]
pub(crate) struct Mode {
    /// What it is for.
    pub(crate) name: String,
    /// The units it takes.
    pub(crate) units: String,
    /// Display indices of the frames that it shows.
    pub(crate) frames: Vec<u32>,
    /// How it plays.
    pub(crate) playback: &'static str,
    /// Share of the Gaussians, in a GOP with predicted frames of those, percent; none if it shows none of them.
    pub(crate) percent: Option<u8>,
    /// Bytes of a GOP.
    pub(crate) bytes: u64,
    /// Gaussians of a GOP received for the frames that are shown.
    pub(crate) gaussians: u64,
    /// How it is played; none of a scene that stands still.
    pub(crate) sequence: Option<Playback>,
    /// Means over cameras and the frames that are shown.
    pub(crate) figures: Comparison,
}

/// What playing a sequence takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Playback {
    /// Frames that there are to show.
    pub(crate) frames: usize,
    /// Frames per second.
    pub(crate) fps: f64,
    /// What the network must carry, Mbit/s.
    pub(crate) mbit_s: f64,
}

impl Playback {
    /// Of so many bytes, which last as long as some frames.
    pub(crate) fn new(bytes: u64, of_bytes: usize, (frames, fps): (usize, f64)) -> Self {
        Self { frames, fps, mbit_s: mbit_per_second(bytes, of_bytes, fps) }
    }
}

impl Mode {
    /// Bits per Gaussian received.
    pub(crate) fn bpg(&self) -> f64 {
        bits_per_gaussian(self.bytes, self.gaussians)
    }

    fn of_sequence(&self, value: impl Fn(&Playback) -> Value) -> Value {
        self.sequence.as_ref().map_or(Value::None, value)
    }

    fn frame_list(&self) -> String {
        self.frames.iter().map(u32::to_string).collect::<Vec<_>>().join(" ")
    }

    fn frame_count(&self, sequence: &Playback) -> Value {
        Value::words(format!("{} of {}", self.frames.len(), sequence.frames))
    }
}

impl Row for Mode {
    fn columns(_: &[Self]) -> Vec<Column<Self>> {
        let percent = |row: &Self| row.percent.map_or(Value::None, Value::Percent);
        let mut columns = vec![
            Column::new("mode", "Mode", |row: &Self| Value::words(&row.name)),
            Column::new("units", "Units", |row: &Self| Value::words(&row.units)),
            Column::of_file("frames", |row: &Self| Value::words(row.frame_list())),
            Column::of_people("Frames shown", |row: &Self| row.of_sequence(|all| row.frame_count(all)))
                .if_measured(),
            Column::of_file("playback", |row: &Self| Value::words(row.playback)),
            Column::of_people("Playback", |row: &Self| row.of_sequence(|_| Value::words(row.playback)))
                .if_measured(),
            Column::new("percent", "Refine\u{ad}ment", percent),
            Column::new("gop_bytes", "Size of a GOP", |row: &Self| Value::Bytes(row.bytes)),
            Column::new("mbit_s", "Mbit/s", |row: &Self| row.of_sequence(|all| Value::number(all.mbit_s, 2)))
                .if_measured(),
            Column::of_file("fps", |row: &Self| row.of_sequence(|all| Value::number(all.fps, 2))),
            Column::new("gaussians", "Gaussians", |row: &Self| Value::Count(row.gaussians)),
            Column::new("bpg_shown", "Bits per Gaussian", |row: &Self| Value::number(row.bpg(), 2)),
        ];
        columns.extend(metrics(|row: &Self| &row.figures));
        columns
    }
}

/// Mbit/s that frames of so many bytes take.
pub(crate) fn mbit_per_second(bytes: u64, frames: usize, fps: f64) -> f64 {
    bytes as f64 * 8.0 * fps / frames.max(1) as f64 / 1e6
}

/// A row for each way to play intra frames, least bandwidth first. `fps`: none of a scene that stands still.
pub(crate) fn intra_modes(run: &Run, fps: Option<f64>) -> Vec<Mode> {
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
fn first_frame(name: &str, point: &Point, run: &Run, frames: usize, fps: Option<f64>) -> Option<Mode> {
    let first = point.frames.first()?;
    let others: u64 = point.frames.iter().skip(1).map(|frame| frame.bytes).sum();
    let bytes = point.info.bytes - others;
    let of_gop = frames.div_ceil(run.gops.max(1) as usize);
    Some(Mode {
        name: name.to_owned(),
        units: units(point, 1),
        frames: vec![0],
        playback: "still",
        percent: Some(point.info.percent),
        bytes,
        sequence: fps.map(|fps| Playback::new(bytes, of_gop, (frames, fps))),
        gaussians: first.gaussians,
        figures: Comparison::mean(&first.views)?,
    })
}

fn all_frames(point: &Point, run: &Run, frames: usize, fps: Option<f64>) -> Mode {
    let percent = point.info.percent;
    let gops = u64::from(run.gops.max(1));
    Mode {
        name: if percent == 100 { "Full quality".to_owned() } else { format!("Refinement {percent} %") },
        units: units(point, frames),
        frames: (0..).take(frames).collect(),
        playback: if frames > 1 { "full frame rate" } else { "still" },
        percent: Some(percent),
        bytes: point.info.bytes / gops,
        sequence: fps.map(|fps| Playback::new(point.info.bytes, frames, (frames, fps))),
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
    use crate::columns::{csv, html};
    use crate::measure::samples::run;

    #[test]
    fn modes_come_by_bandwidth_and_the_startup_is_one_frame() {
        let rows = intra_modes(&run(), Some(30.0));
        let modes: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
        assert_eq!(modes, ["Startup", "Refinement 20 %", "Complete first frame", "Full quality"]);
        let startup = &rows[0];
        assert_eq!((startup.bytes, startup.gaussians, startup.figures.psnr_db), (740, 100, 30.0));
        assert_eq!(rows[3].sequence.unwrap().mbit_s, 4000.0 * 8.0 * 15.0 / 1e6);
        assert_eq!((rows[1].units.as_str(), rows[3].units.as_str()), ("I0 to I1, r0", "I0 to I1, r0 to r1"));
    }

    #[test]
    fn a_scene_that_stands_still_has_no_bandwidth() {
        let rows = intra_modes(&run(), None);
        let page = html(&rows).into_string();
        assert!(["Mbit/s", "Frames shown", "Playback"].iter().all(|heading| !page.contains(heading)));
        let file = String::from_utf8(csv([("a", rows)]).unwrap()).unwrap();
        assert!(
            file.contains(",mbit_s,fps,") && file.contains("a,Startup,\"I0, r0\",0,still,20,740,,,100,"),
            "{file}"
        );
    }
}
