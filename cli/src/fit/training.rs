//! The training of one frame.

use super::Fit;
use super::report::{FittedFrame, View};
use crate::failure::Failure;
use crate::numbers::counted;
use crate::progress::Progress;
use splatstream_capture::trainer::{Settings, Trainer, start_at_random, start_of_points};
use splatstream_capture::{Photograph, load_photographs, load_points};
use splatstream_chart::Progress as _;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::PreparedFrame;
use splatstream_render::camera::{Capture, CapturedPoint};
use std::path::Path;
use std::time::{Duration, Instant};

/// Steps from one message to the next.
const STEPS: u32 = 25;

/// Pictures and points of a frame.
pub(super) struct Training<'a> {
    fit: &'a Fit,
    background: [f32; 3],
    photographs: Vec<Photograph>,
    held_out: Vec<Photograph>,
    points: Vec<CapturedPoint>,
    path: &'a Path,
}

impl<'a> Training<'a> {
    /// Reads the pictures, and the points if they will be needed.
    pub(super) fn open(
        capture: &Capture,
        path: &'a Path,
        fit: &'a Fit,
        background: [f32; 3],
    ) -> Result<Self, Failure> {
        let failed = |error: splatstream_capture::LoadError| Failure::other(error.to_string());
        let all = load_photographs(capture, fit.images.as_deref(), fit.height, background).map_err(failed)?;
        let mut points = load_points(capture).map_err(failed)?;
        if points.is_empty() {
            let cameras: Vec<_> = all.iter().map(Photograph::camera).collect();
            points = start_at_random(&cameras, fit.random_points as usize, fit.seed);
        }
        // The middle one of each group, so that ends of a row of cameras are trained with.
        let every = fit.hold_out as usize;
        let is_held_out = |at: usize| every > 1 && at % every == every / 2;
        let numbered = all.into_iter().enumerate();
        let (held_out, photographs): (Vec<_>, Vec<_>) = numbered.partition(|(at, _)| is_held_out(*at));
        let plain = |numbered: Vec<(usize, Photograph)>| {
            numbered.into_iter().map(|(_, photograph)| photograph).collect()
        };
        Ok(Self { fit, background, photographs: plain(photographs), held_out: plain(held_out), points, path })
    }

    /// Trains from a start that was given, from the frame before, or from points.
    pub(super) fn run(
        &self,
        start: Option<GaussianFrame>,
        before: Option<GaussianFrame>,
        budget: Option<Duration>,
    ) -> Result<(GaussianFrame, FittedFrame), Failure> {
        let failed = |error: splatstream_capture::trainer::TrainError| {
            Failure::other(format!("{}: {error}", self.path.display()))
        };
        let settings = self.settings(before.is_some(), start.is_some());
        let first = match (start, before) {
            (Some(start), _) => start,
            (None, Some(before)) => before,
            (None, None) => start_of_points(&self.fitting_points()).map_err(failed)?,
        };
        let mut trainer = Trainer::new(&self.photographs, first, settings).map_err(failed)?;
        let progress = Progress::steps(settings.iterations);
        let begin = Instant::now();
        let (mut losses, mut steps) = (Vec::new(), 0);
        while let Some(step) = trainer.step().map_err(failed)? {
            progress.advance();
            losses.push(step.loss);
            steps = step.iteration;
            if step.iteration.is_multiple_of(STEPS) {
                let gaussians = counted(step.gaussians as u64, "Gaussian");
                progress.step(format!("{gaussians}, loss {:.4}", mean(&losses)));
                losses.clear();
            }
            if budget.is_some_and(|budget| begin.elapsed() >= budget) {
                break;
            }
        }
        drop(progress);
        let seconds = begin.elapsed().as_secs_f64();
        let frame = if settings.iterations > 0 { trainer.finish() } else { trainer.frame().clone() };
        let fitted = FittedFrame::of(&frame, (steps, seconds), self.judge(&frame));
        Ok((frame, fitted))
    }

    /// No more points than there may be Gaussians.
    fn fitting_points(&self) -> Vec<CapturedPoint> {
        let every = self.points.len().div_ceil(self.fit.gaussians.max(1) as usize).max(1);
        self.points.iter().step_by(every).copied().collect()
    }

    fn settings(&self, is_warm: bool, is_given: bool) -> Settings {
        let Fit { iterations, warm_iterations, gaussians, sh_degree, antialiased, seed, hold, .. } =
            *self.fit;
        let settings = Settings {
            iterations,
            gaussians: gaussians as usize,
            sh_degree,
            background: self.background,
            antialiased,
            seed,
            ..Settings::default()
        };
        match (is_given, is_warm) {
            (false, false) => settings,
            (true, _) => Settings { densify: false, pace: Settings::NEAR, ..settings },
            (false, true) => Settings {
                densify: false,
                pace: Settings::NEAR,
                hold: hold as f32,
                iterations: warm_iterations,
                ..settings
            },
        }
    }

    /// What each picture is worth.
    fn judge(&self, frame: &GaussianFrame) -> Vec<View> {
        let prepared = PreparedFrame::new(frame);
        let view = |photograph: &Photograph, held_out: bool| View {
            name: photograph.camera().name.clone(),
            held_out,
            psnr_db: photograph.psnr(&prepared, self.background),
        };
        let trained = self.photographs.iter().map(|photograph| view(photograph, false));
        trained.chain(self.held_out.iter().map(|photograph| view(photograph, true))).collect()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
