//! What the frames of a sequence depend on: a run that goes on must have the same.

use super::Fit;
use super::captures::Captures;
use crate::failure::Failure;
use crate::kept_settings::{InputName, KeptSettings};
use serde::Serialize;

/// Each key is an option of `fit`, or its inputs.
#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
struct FitSettings {
    iterations: u32,
    gaussians: u32,
    sh_degree: u8,
    height: Option<u32>,
    images: Option<InputName>,
    hold_out: u32,
    start: Option<InputName>,
    samples: u32,
    random_points: u32,
    warm: bool,
    warm_iterations: u32,
    hold: f64,
    antialiased: bool,
    background: Option<[f32; 3]>,
    time_budget: Option<u32>,
    seed: u64,
    inputs: Vec<InputName>,
}

impl Fit {
    /// The settings of this run.
    pub(super) fn kept_settings(&self, captures: &Captures) -> Result<KeptSettings, Failure> {
        let settings = FitSettings {
            iterations: self.iterations,
            gaussians: self.gaussians,
            sh_degree: self.sh_degree,
            height: self.height,
            images: self.images.as_ref().map(InputName::of),
            hold_out: self.hold_out,
            start: self.start.as_ref().map(InputName::of),
            samples: self.reading.sequence().samples,
            random_points: self.random_points,
            warm: self.warm,
            warm_iterations: self.warm_iterations,
            hold: self.hold,
            antialiased: self.antialiased,
            background: self.background.background,
            time_budget: self.time_budget,
            seed: self.seed,
            inputs: (0..captures.len()).map(|number| InputName::of(captures.path(number))).collect(),
        };
        KeptSettings::new("fit", &settings)
    }
}
