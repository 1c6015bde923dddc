//! A trainer: pictures and cameras to Gaussians.
//!
//! Source: Kerbl et al., "3D Gaussian splatting for real-time radiance field rendering", 2023: L1 and SSIM of one picture at a
//! time, Adam, Gaussians cloned and split where the picture's slopes by their centres are steep, faint ones removed. What
//! differs, because pictures are few and drawn on a CPU: coarse pictures come first, rates fall over as many steps as
//! are asked for, the number of Gaussians grows evenly to a budget, the steepest first, and opacities are not reset
//! (rationale, 1.23).
//!
//! ```
//! use splatstream_capture::Photograph;
//! use splatstream_capture::simulator::{Rig, Simulation};
//! use splatstream_capture::trainer::{Settings, Trainer, start_of_points};
//!
//! let simulation = Simulation { samples: 1, ..Simulation::default() };
//! let cameras = Rig::Forward.cameras(3, [64, 36]);
//! let take = |camera| Photograph::new(camera, &simulation.picture(camera, 0.0), None);
//! let photographs = cameras.iter().map(take).collect::<Result<Vec<_>, _>>()?;
//! let start = start_of_points(&simulation.points(&cameras, 0.0, 500))?;
//! let mut trainer = Trainer::new(&photographs, start, Settings { iterations: 10, ..Settings::default() })?;
//! let mut losses = Vec::new();
//! while let Some(step) = trainer.step()? {
//!     losses.push(step.loss);
//! }
//! assert!(losses[9] < losses[0] && trainer.finish().len() > 400);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod density;
mod schedule;
mod start;

pub use start::{start_at_random, start_of_points};

use crate::photograph::{Photograph, SizeError};
use density::Density;
use schedule::Schedule;
use splatstream_gaussians::random::SplitMix64;
use splatstream_gaussians::{FrameError, GaussianFrame};
use splatstream_render::PreparedFrame;
use splatstream_render::gradient::{Adam, GradientError, Gradients, Loss};

/// How a scene is trained. Equal settings, pictures and starts give equal frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Steps, each on one picture.
    pub iterations: u32,
    /// Gaussians at most. A start that has more keeps its own, and none is added.
    pub gaussians: usize,
    /// SH degree, 0 to 3; clamped to that. Degrees come one after the other.
    pub sh_degree: u8,
    /// Whether Gaussians are added and removed. Otherwise Gaussian i of the start is Gaussian i of the result.
    pub densify: bool,
    /// How long the first steps are, of those for a start from points; the last are as long for every pace.
    pub pace: f32,
    /// How firmly each value stays what it is at the start, 0 to 1: the share of each step that is taken back
    /// ([`Adam::step_held`]). Not used where Gaussians are added and removed.
    pub hold: f32,
    /// What pictures are judged by.
    pub loss: Loss,
    /// Red, green and blue behind everything, 0 to 1.
    pub background: [f32; 3],
    /// Whether to train for renderers that make up for their low-pass filter.
    pub antialiased: bool,
    /// Chooses the order of pictures and where new Gaussians go.
    pub seed: u64,
}

impl Settings {
    /// The pace for a start that is nearly right.
    pub const NEAR: f32 = 0.1;
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            iterations: 3000,
            gaussians: 50_000,
            sh_degree: 2,
            densify: true,
            pace: 1.0,
            hold: 0.0,
            loss: Loss::default(),
            background: [0.0; 3],
            antialiased: false,
            seed: 1,
        }
    }
}

/// Why a scene cannot be trained.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TrainError {
    /// Nothing to learn from.
    #[error("there are no pictures to train with; give a capture with two or more")]
    Pictures,
    /// Nothing to start from.
    #[error("there are no points to start from; give a capture with points, or start at random")]
    Points,
    /// A fault of this program.
    #[error("{0}; please report this")]
    Gradient(#[from] GradientError),
    /// A fault of this program.
    #[error("{0}; please report this")]
    Frame(#[from] FrameError),
    /// A fault of this program.
    #[error("{0}; please report this")]
    Picture(#[from] SizeError),
}

/// What a step came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Steps so far, with this one.
    pub iteration: u32,
    /// The loss of its picture before the step.
    pub loss: f64,
    /// Gaussians after it.
    pub gaussians: usize,
}

/// A scene in training.
pub struct Trainer<'a> {
    photographs: &'a [Photograph],
    settings: Settings,
    schedule: Schedule,
    frame: GaussianFrame,
    /// The start, where values are held to it.
    anchor: Option<GaussianFrame>,
    adam: Adam,
    gradients: Gradients,
    density: Density,
    iteration: u32,
    /// Pictures that are still to come before all come again, the next one last.
    order: Vec<usize>,
    random: SplitMix64,
    /// Pictures at the size that is trained at, and by what they were divided; none where that is 1.
    coarse: (u32, Vec<Photograph>),
}

impl<'a> Trainer<'a> {
    /// Begins with the Gaussians of `start`, whose SH degree may be lower than that of the settings; a higher one is kept.
    ///
    /// # Errors
    /// No pictures, or no Gaussians.
    pub fn new(
        photographs: &'a [Photograph],
        start: GaussianFrame,
        settings: Settings,
    ) -> Result<Self, TrainError> {
        if photographs.is_empty() {
            return Err(TrainError::Pictures);
        }
        if start.is_empty() {
            return Err(TrainError::Points);
        }
        let frame = start.with_antialiased(settings.antialiased).with_unit_rotations();
        Ok(Self {
            photographs,
            schedule: Schedule::new(&settings, photographs, frame.len()),
            adam: Adam::new(&frame),
            gradients: Gradients::zero(&frame),
            density: Density::new(frame.len()),
            random: SplitMix64::new(settings.seed),
            anchor: (settings.hold > 0.0 && !settings.densify).then(|| frame.clone()),
            frame,
            settings,
            iteration: 0,
            order: Vec::new(),
            coarse: (1, Vec::new()),
        })
    }

    /// The Gaussians as they are now.
    #[must_use]
    pub fn frame(&self) -> &GaussianFrame {
        &self.frame
    }

    /// Takes the next step; none after the last.
    ///
    /// # Errors
    /// Faults of this program.
    pub fn step(&mut self) -> Result<Option<Step>, TrainError> {
        if self.iteration >= self.settings.iterations {
            return Ok(None);
        }
        self.raise_degree()?;
        let number = self.next_picture();
        let loss = self.descend(number)?;
        self.iteration = self.iteration.saturating_add(1);
        if let Some(most) = self.schedule.growth(self.iteration) {
            self.change_density(most);
        }
        Ok(Some(Step { iteration: self.iteration, loss, gaussians: self.frame.len() }))
    }

    /// The Gaussians, without those that no picture would show.
    #[must_use]
    pub fn finish(mut self) -> GaussianFrame {
        if self.settings.densify {
            let rows = density::visible(&self.frame);
            self.frame = self.frame.into_selected(&rows);
        }
        self.frame
    }

    /// One step of all values against the slopes of the loss of a picture; gives the loss.
    fn descend(&mut self, number: usize) -> Result<f64, TrainError> {
        let photograph = self.coarse.1.get(number).or_else(|| self.photographs.get(number));
        let photograph = photograph.ok_or(TrainError::Pictures)?;
        self.gradients.clear();
        let prepared = PreparedFrame::new(&self.frame);
        let drawing = prepared.draw(photograph.camera(), self.settings.background);
        let judged = self.settings.loss.between(&photograph.picture(), &drawing.rendering().colour)?;
        let footprints = drawing.backward_in_picture(&judged.slopes, &mut self.gradients)?;
        if self.settings.densify {
            self.density.see(&footprints, photograph.camera());
        }
        let rates = self.schedule.rates(self.iteration);
        let (frame, gradients) = (&mut self.frame, &self.gradients);
        match &self.anchor {
            Some(anchor) => {
                self.adam.step_held(frame, gradients, &rates, (anchor, self.settings.hold))?;
            }
            None => self.adam.step(frame, gradients, &rates)?,
        }
        self.frame = std::mem::take(&mut self.frame).with_unit_rotations();
        Ok(judged.value)
    }

    /// The next picture of those in any order, all before any comes again; at the size that it is time for.
    fn next_picture(&mut self) -> usize {
        let divisor = self.schedule.divisor(self.iteration);
        if divisor != self.coarse.0 {
            let rows = |photograph: &Photograph| photograph.camera().height.checked_div(divisor).unwrap_or(1);
            let smaller = |photograph: &Photograph| photograph.smaller(rows(photograph));
            let all = if divisor > 1 { self.photographs } else { &[] };
            self.coarse = (divisor, all.iter().map(smaller).collect());
        }
        if self.order.is_empty() {
            self.order = (0..self.photographs.len()).collect();
            self.random.shuffle(&mut self.order);
        }
        self.order.pop().unwrap_or_default()
    }

    /// Goes to a higher SH degree when it is time.
    fn raise_degree(&mut self) -> Result<(), TrainError> {
        let degree = self.schedule.sh_degree(self.iteration);
        if degree <= self.frame.sh_degree() {
            return Ok(());
        }
        self.frame = std::mem::take(&mut self.frame).with_sh_degree(degree)?;
        self.adam.raise_sh_degree(degree);
        // Without growth the degree rises before the first step: this is still the start.
        self.anchor = self.anchor.take().map(|_| self.frame.clone());
        self.gradients = Gradients::zero(&self.frame);
        Ok(())
    }

    /// Removes Gaussians that are of no use, and adds others up to a number.
    fn change_density(&mut self, most: usize) {
        let change = self.density.change(&self.frame, self.schedule.scene(), most, &mut self.random);
        let kept = std::mem::take(&mut self.frame).into_selected(&change.parents);
        self.adam.select(change.parents.get(..change.kept).unwrap_or_default());
        self.adam.grow(change.parents.len().saturating_sub(change.kept));
        self.frame = change.applied(kept);
        self.gradients = Gradients::zero(&self.frame);
        self.density = Density::new(self.frame.len());
    }
}
