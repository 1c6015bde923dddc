//! What tracked frames depend on: a run that goes on must have the same.

use super::Track;
use crate::cameras::{UpName, Views};
use crate::failure::Failure;
use crate::frame_files::FrameFiles;
use crate::kept_settings::{InputName, KeptSettings};
use clap::ValueEnum;
use serde::Serialize;

/// Each key is an option of `track`, or its inputs.
#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
struct TrackSettings {
    gop: u32,
    cameras: Cameras,
    up: Option<String>,
    views: u32,
    height: u32,
    iterations: u32,
    hold: f64,
    cut: f64,
    all: bool,
    background: Option<[f32; 3]>,
    samples: u32,
    seed: u64,
    inputs: Vec<InputName>,
}

/// From where frames are looked at.
#[derive(Serialize)]
#[serde(untagged)]
enum Cameras {
    Made(String),
    Read(InputName),
}

impl Track {
    /// The settings of this run.
    pub(super) fn kept_settings(&self, files: &FrameFiles) -> Result<KeptSettings, Failure> {
        let name = |up: UpName| up.to_possible_value().map(|value| value.get_name().to_owned());
        let settings = TrackSettings {
            gop: self.gop,
            cameras: match &self.cameras {
                Views::File(path) => Cameras::Read(InputName::of(path)),
                made => Cameras::Made(made.to_string()),
            },
            up: self.up.and_then(name),
            views: self.views,
            height: self.height,
            iterations: self.iterations,
            hold: self.hold,
            cut: self.cut,
            all: self.all,
            background: self.background.background,
            samples: self.reading.sequence().samples,
            seed: self.seed,
            inputs: files.inputs().iter().map(InputName::of).collect(),
        };
        KeptSettings::new("track", &settings)
    }
}
