//! What `track` says about the sequence that it has made.

use crate::numbers::{counted, frames, mean};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Duration;

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Tracked {
    output: PathBuf,
    frames: Vec<Numbered>,
    /// Means over all frames that were tracked; null if none was.
    psnr_before_db: Option<f64>,
    psnr_db: Option<f64>,
    seconds: f64,
}

/// A frame and where it is.
#[derive(Serialize)]
struct Numbered {
    frame: u32,
    file: PathBuf,
    gaussians: usize,
    #[serde(flatten)]
    tracked: TrackedFrame,
}

/// A frame of the sequence.
#[derive(Serialize)]
pub(super) struct TrackedFrame {
    pub(super) origin: Origin,
    /// Whether an earlier run has left it.
    pub(super) kept: bool,
    /// The share of its Gaussians that the frame before has too, 0 to 1; null where nobody looked.
    pub(super) in_common: Option<f64>,
    /// How close the frame before comes to the source, and what was trained from it; null where nothing was.
    pub(super) psnr_before_db: Option<f64>,
    pub(super) psnr_db: Option<f64>,
    pub(super) seconds: f64,
}

/// Where the Gaussians of a frame come from.
#[derive(Serialize, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(super) enum Origin {
    /// The source, as it is: the first of a GOP.
    Source,
    /// The source as well, since it has most of its Gaussians in common with the frame before.
    Alike,
    /// The source as well, since tracking came too little close to it.
    Cut,
    /// The frame before.
    Tracked,
    /// A file that was there.
    Unknown,
}

impl TrackedFrame {
    /// A frame in which nothing was trained.
    pub(super) fn source(origin: Origin, in_common: Option<f64>) -> Self {
        Self { origin, kept: false, in_common, psnr_before_db: None, psnr_db: None, seconds: 0.0 }
    }

    pub(super) fn kept() -> Self {
        Self { kept: true, ..Self::source(Origin::Unknown, None) }
    }
}

impl Tracked {
    pub(super) fn new(output: PathBuf) -> Self {
        Self { output, frames: Vec::new(), psnr_before_db: None, psnr_db: None, seconds: 0.0 }
    }

    pub(super) fn add(&mut self, frame: u32, file: PathBuf, gaussians: usize, tracked: TrackedFrame) {
        self.frames.push(Numbered { frame, file, gaussians, tracked });
    }

    pub(super) fn finish(&mut self, time: Duration) {
        let tracked = || self.frames.iter().map(|frame| &frame.tracked).filter(|frame| frame.is_tracked());
        self.psnr_before_db = mean(tracked().filter_map(|frame| frame.psnr_before_db));
        self.psnr_db = mean(tracked().filter_map(|frame| frame.psnr_db));
        self.seconds = time.as_secs_f64();
    }

    pub(super) fn text(&self) -> String {
        let name = self.output.display();
        let lines: String = self.frames.iter().map(Numbered::text).collect();
        let of = |origin: Origin| self.frames.iter().filter(|frame| frame.tracked.origin == origin).count();
        let count = frames(of(Origin::Tracked) as u32);
        let tracked = match (self.psnr_db, self.psnr_before_db) {
            (Some(after), Some(before)) => format!(
                "  tracked      {count}; {after:.2} dB to their sources, {before:.2} before, in views that nothing was trained with\n"
            ),
            _ => String::new(),
        };
        let as_they_are = |origin: Origin, name: &str, why: &str| match of(origin) {
            0 => String::new(),
            count => format!("  {name:<12} {} as they are: {why}\n", frames(count as u32)),
        };
        let alike = "most of their Gaussians are in the one before, so that encode predicts them";
        let kept = as_they_are(Origin::Alike, "alike", alike)
            + &as_they_are(Origin::Cut, "cut", "they come too little close to what was before");
        format!("{name}\n{lines}{tracked}{kept}  time         {:.1} seconds\n", self.seconds)
    }
}

impl TrackedFrame {
    fn is_tracked(&self) -> bool {
        self.origin == Origin::Tracked
    }
}

impl Numbered {
    fn text(&self) -> String {
        let TrackedFrame { origin, in_common, psnr_before_db, psnr_db, seconds, .. } = &self.tracked;
        let decibels = |psnr: &Option<f64>| psnr.map_or("-".to_owned(), |psnr| format!("{psnr:.2} dB"));
        let close = || format!("{} to its source, {} before", decibels(psnr_db), decibels(psnr_before_db));
        let how = match origin {
            Origin::Source => "as it is".to_owned(),
            Origin::Unknown => "as it was".to_owned(),
            Origin::Alike => {
                format!("as it is: {:.0} % are in the frame before", 100.0 * in_common.unwrap_or_default())
            }
            Origin::Cut => format!("as it is: only {}", close()),
            Origin::Tracked => format!("{}; {seconds:.1} seconds", close()),
        };
        format!("  frame {:<6} {}, {how}\n", self.frame, counted(self.gaussians as u64, "Gaussian"))
    }
}
