//! What is done when, over the course of a training.

#![expect(
    clippy::arithmetic_side_effects,
    reason = "vectors of floats; divisors above 0; steps within a training"
)]

use super::Settings;
use super::start::extent;
use crate::photograph::Photograph;
use glam::Vec3;
use splatstream_gaussians::MAX_SH_DEGREE;
use splatstream_render::gradient::Rates;

/// Shares of a training at which pictures become finer, and by what they are divided until then.
const COARSE: [(f32, u32); 2] = [(0.15, 4), (0.4, 2)];
/// Share of a training at which each SH degree comes.
const DEGREES: [f32; 4] = [0.0, 0.2, 0.35, 0.5];
/// Shares of a training between which Gaussians are added.
const GROWTH: [f32; 2] = [0.05, 0.6];
/// How often they are.
const ROUNDS: u32 = 24;
/// The least rows of a coarse picture: SSIM has a window of 11.
const MIN_ROWS: u32 = 32;

/// The course of a training.
pub(super) struct Schedule {
    iterations: u32,
    sh_degree: u8,
    densify: bool,
    pace: f32,
    /// Gaussians at the start and at most.
    count: [usize; 2],
    /// Rows of the smallest picture.
    rows: u32,
    scene: Scene,
}

/// Where the cameras of a scene stand.
pub(super) struct Scene {
    pub(super) extent: f32,
    pub(super) cameras: Vec<Vec3>,
}

impl Scene {
    fn of(photographs: &[Photograph]) -> Self {
        let cameras: Vec<Vec3> =
            photographs.iter().map(|photograph| photograph.camera().position.into()).collect();
        let extent = extent(cameras.iter().copied());
        Self { extent, cameras }
    }
}

impl Schedule {
    pub(super) fn new(settings: &Settings, photographs: &[Photograph], start: usize) -> Self {
        Self {
            iterations: settings.iterations,
            sh_degree: settings.sh_degree.min(MAX_SH_DEGREE),
            densify: settings.densify,
            pace: settings.pace,
            count: [start, settings.gaussians],
            rows: photographs.iter().map(|photograph| photograph.camera().height).min().unwrap_or_default(),
            scene: Scene::of(photographs),
        }
    }

    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The share of the training that lies behind, 0 to 1.
    fn share(&self, iteration: u32) -> f32 {
        iteration as f32 / self.iterations.max(1) as f32
    }

    /// By what the rows of pictures are divided. A start that is nearly right has nothing to learn from coarse ones.
    pub(super) fn divisor(&self, iteration: u32) -> u32 {
        let share = self.share(iteration);
        let due = COARSE.into_iter().find(|(until, _)| share < *until).map_or(1, |(_, divisor)| divisor);
        let fits = |divisor: &u32| *divisor <= due && self.rows / divisor >= MIN_ROWS;
        if self.densify { [4, 2].into_iter().find(fits).unwrap_or(1) } else { 1 }
    }

    pub(super) fn sh_degree(&self, iteration: u32) -> u8 {
        let share = self.share(iteration);
        let reached = DEGREES.iter().filter(|from| share >= **from).count().saturating_sub(1) as u8;
        if self.densify { reached.min(self.sh_degree) } else { self.sh_degree }
    }

    /// How many Gaussians there may be after this step, if it is one after which they are added.
    pub(super) fn growth(&self, iteration: u32) -> Option<usize> {
        let [first, last] = GROWTH.map(|share| (share * self.iterations as f32) as u32);
        let every = (last.saturating_sub(first) / ROUNDS).max(1);
        let since = iteration.checked_sub(first)?;
        if !self.densify || iteration > last || since == 0 || !since.is_multiple_of(every) {
            return None;
        }
        let [start, most] = self.count;
        let share = f64::from(since) / f64::from((last - first).max(1));
        Some(start.saturating_add((share * most.saturating_sub(start) as f64) as usize).min(most))
    }

    /// How far this step goes. All rates fall exponentially, those of centres most.
    pub(super) fn rates(&self, iteration: u32) -> Rates {
        let share = self.share(iteration);
        let falling = |first: f32, last: f32| last * libm::powf(self.pace * first / last, 1.0 - share);
        Rates {
            position: self.scene.extent * falling(3.2e-3, 8e-6),
            log_scale: falling(0.08, 0.004),
            rotation: falling(0.04, 0.002),
            opacity_logit: falling(0.24, 0.015),
            dc: falling(0.08, 0.0025),
            sh: falling(0.008, 0.000_25),
        }
    }
}
