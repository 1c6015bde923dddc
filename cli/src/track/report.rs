//! What `track` says about the sequence that it has made.

use crate::numbers::frames;
use serde::Serialize;
use splatstream_chart::numbers::grouped;
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
    /// How close the frame before comes to the source, and what was trained from it; null where nothing was.
    pub(super) psnr_before_db: Option<f64>,
    pub(super) psnr_db: Option<f64>,
    pub(super) seconds: f64,
}

/// Where the Gaussians of a frame come from.
#[derive(Serialize, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(super) enum Origin {
    /// The source, as it is.
    Source,
    /// The source as well, since tracking came too little close to it.
    Cut,
    /// The frame before.
    Tracked,
    /// A file that was there.
    Unknown,
}

impl TrackedFrame {
    pub(super) fn source() -> Self {
        Self { origin: Origin::Source, kept: false, psnr_before_db: None, psnr_db: None, seconds: 0.0 }
    }

    pub(super) fn kept() -> Self {
        Self { origin: Origin::Unknown, kept: true, ..Self::source() }
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
        let count = tracked().count();
        let mean = |of: fn(&TrackedFrame) -> Option<f64>| {
            (count > 0).then(|| tracked().filter_map(of).sum::<f64>() / count as f64)
        };
        (self.psnr_before_db, self.psnr_db) =
            (mean(|frame| frame.psnr_before_db), mean(|frame| frame.psnr_db));
        self.seconds = time.as_secs_f64();
    }

    pub(super) fn text(&self) -> String {
        let name = self.output.display();
        let lines: String = self.frames.iter().map(Numbered::text).collect();
        let of = |origin: Origin| self.frames.iter().filter(|frame| frame.tracked.origin == origin).count();
        let tracked = match (self.psnr_db, self.psnr_before_db) {
            (Some(after), Some(before)) => format!("; {after:.2} dB to their sources, {before:.2} before"),
            _ => String::new(),
        };
        let cuts = match of(Origin::Cut) {
            0 => String::new(),
            cuts => {
                format!("  cut          {} as they are, too far from the one before\n", frames(cuts as u32))
            }
        };
        let count = frames(of(Origin::Tracked) as u32);
        format!(
            "{name}\n{lines}  tracked      {count}{tracked}, in views that nothing was trained with\n{cuts}  \
             time         {:.1} seconds\n",
            self.seconds,
        )
    }
}

impl TrackedFrame {
    fn is_tracked(&self) -> bool {
        self.origin == Origin::Tracked
    }
}

impl Numbered {
    fn text(&self) -> String {
        let TrackedFrame { origin, psnr_before_db, psnr_db, seconds, .. } = &self.tracked;
        let decibels = |psnr: &Option<f64>| psnr.map_or("-".to_owned(), |psnr| format!("{psnr:.2} dB"));
        let close = || format!("{} to its source, {} before", decibels(psnr_db), decibels(psnr_before_db));
        let how = match origin {
            Origin::Source => "as it is".to_owned(),
            Origin::Unknown => "as it was".to_owned(),
            Origin::Cut => format!("as it is: only {}", close()),
            Origin::Tracked => format!("{}; {seconds:.1} seconds", close()),
        };
        format!("  frame {:<6} {} Gaussians, {how}\n", self.frame, grouped(self.gaussians as u64))
    }
}
