//! Frames that were trained apart, as one sequence.
//!
//! Two trainings of one scene agree in pictures and in nothing else: not in the number of Gaussians, not in which stands for
//! what. A codec that predicts a frame from another finds nothing to predict from, and what stands still flickers. So the
//! Gaussians of one frame are trained on until they look like the next, in pictures drawn of it; each value stays exactly what
//! it was unless pictures agree that it must change (`hold` of the trainer's settings). Gaussian i stays Gaussian i, and
//! most of it need not be sent again.

use crate::photograph::{Photograph, SizeError};
use crate::trainer::{Settings, Step, TrainError, Trainer};
use glam::Vec3;
use rayon::prelude::*;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Camera, Scattered, Up, held_out};
use splatstream_render::{PreparedFrame, gradient::Loss};

/// Views that a frame is judged in. No slope is taken in them.
const JUDGES: u32 = 8;

/// How a frame is made to look like another. Equal settings and frames give equal results.
#[derive(Clone, Debug, PartialEq)]
pub struct Following {
    /// Steps, each on one picture of the source.
    pub iterations: u32,
    /// Pictures that are drawn of the source.
    pub views: u32,
    /// Their rows, 32 or more for a loss that has structure in it.
    pub height: u32,
    /// How firmly each value stays what it was, 0 to 1.
    pub hold: f32,
    /// How long the first steps are, of those of a training from points.
    pub pace: f32,
    /// From where the scene is looked at: pictures are drawn near these cameras, or from all around if there are none.
    pub cameras: Vec<Camera>,
    /// What points up, where there are no cameras.
    pub up: Up,
    /// Red, green and blue behind everything, 0 to 1.
    pub background: [f32; 3],
    /// Chooses the cameras and the order of pictures.
    pub seed: u64,
}

impl Default for Following {
    fn default() -> Self {
        Self {
            iterations: 150,
            views: 100,
            height: 180,
            hold: 0.3,
            pace: 2.0 * Settings::NEAR,
            cameras: Vec::new(),
            up: Up::default(),
            background: [0.0; 3],
            seed: 1,
        }
    }
}

/// A frame that looks like another.
#[derive(Clone, Debug, PartialEq)]
pub struct Followed {
    /// As many Gaussians as the one before had, in the same order.
    pub frame: GaussianFrame,
    /// How close the one before comes to the source, in pictures that nothing was trained with: mean PSNR, dB.
    pub psnr_before_db: f64,
    /// How close this one does.
    pub psnr_db: f64,
}

/// Gaussians of a frame that are looked for in another.
const SAMPLE: usize = 1000;
/// How far two that stand for the same may differ: log-scales by length, logits of opacity, colours of degree 0.
const ALIKE: [f32; 3] = [0.15, 0.25, 0.1];
/// And how far apart they may be, as a share of the diagonal of the inner 90 % of the scene: what moves moves less in a frame.
const NEAR: f32 = 0.05;

/// The share of the Gaussians of a frame that another has too, near where they are, 0 to 1: of some that are spread over its
/// rows. Where it is most of them the frames need not be followed: they can be predicted as they are.
///
/// Gaussians are known by their semi-axes, opacity and colour, seven values: of two trainings of one scene hardly any agree
/// in all of them, of two frames that were tracked, or copied with noise, nearly all.
#[must_use]
pub fn in_common(frame: &GaussianFrame, other: &GaussianFrame) -> f64 {
    let near = NEAR * diagonal(frame);
    let others: Vec<Likeness> = (0..other.len()).filter_map(|row| Likeness::of(other, row)).collect();
    let every = frame.len().div_ceil(SAMPLE).max(1);
    let sample: Vec<Likeness> =
        (0..frame.len()).step_by(every).filter_map(|row| Likeness::of(frame, row)).collect();
    let found = sample.par_iter().filter(|one| others.iter().any(|other| one.is_like(other, near))).count();
    found as f64 / sample.len().max(1) as f64
}

/// What a Gaussian is known by.
struct Likeness {
    position: Vec3,
    /// Sorted, since axes have no order.
    log_scales: Vec3,
    opacity_logit: f32,
    dc: Vec3,
}

impl Likeness {
    fn of(frame: &GaussianFrame, row: usize) -> Option<Self> {
        let planes = frame.planes();
        let at = |planes: &[Vec<f32>; 3]| {
            let values = planes.each_ref().map(|plane| plane.get(row).copied());
            let [Some(x), Some(y), Some(z)] = values else { return None };
            Some([x, y, z])
        };
        let mut log_scales = at(&planes.log_scale)?;
        log_scales.sort_unstable_by(f32::total_cmp);
        Some(Self {
            position: at(&planes.position)?.into(),
            log_scales: log_scales.into(),
            opacity_logit: planes.opacity_logit.get(row).copied()?,
            dc: at(&planes.dc)?.into(),
        })
    }

    fn is_like(&self, other: &Self, near: f32) -> bool {
        let [scales, opacity, colour] = ALIKE;
        (self.opacity_logit - other.opacity_logit).abs() <= opacity
            && self.dc.distance_squared(other.dc) <= colour * colour
            && self.log_scales.distance_squared(other.log_scales) <= scales * scales
            && self.position.distance_squared(other.position) <= near * near
    }
}

/// The diagonal of the box of a frame without the outer 5 % at either end of each axis.
fn diagonal(frame: &GaussianFrame) -> f32 {
    let side = |plane: &Vec<f32>| {
        let mut values = plane.clone();
        let mut at = |place: usize| {
            let (_, value, _) = values.select_nth_unstable_by(place, f32::total_cmp);
            *value
        };
        let (last, cut) = (plane.len().saturating_sub(1), plane.len() / 20);
        if plane.is_empty() { 0.0 } else { at(last.saturating_sub(cut)) - at(cut) }
    };
    Vec3::from(frame.position().each_ref().map(side)).length()
}

/// Trains `before` until it looks like `source`, and says how well it does. `seen` is told of every step.
///
/// ```
/// use splatstream_capture::{Following, follow};
/// use splatstream_files::builtin::{BuiltinScene, Tracking};
///
/// let scene = BuiltinScene { gaussians: 200, tracking: Tracking::Untracked, ..BuiltinScene::default() };
/// let [before, source] = [0, 1].map(|number| scene.frame(number));
/// let settings = Following { iterations: 20, views: 10, height: 48, ..Following::default() };
/// let followed = follow(before, &source, &settings, &mut |_| ())?;
/// assert!(followed.psnr_db > followed.psnr_before_db);
/// # Ok::<(), splatstream_capture::trainer::TrainError>(())
/// ```
///
/// # Errors
/// A frame without Gaussians; no views; faults of this program.
pub fn follow(
    before: GaussianFrame,
    source: &GaussianFrame,
    settings: &Following,
    seen: &mut dyn FnMut(Step),
) -> Result<Followed, TrainError> {
    if before.is_empty() || source.is_empty() {
        return Err(TrainError::Points);
    }
    let Following { iterations, views, height, up, background, ref cameras, .. } = *settings;
    let drawn = Drawn { frame: PreparedFrame::new(source), background };
    let scattered = Scattered::new(source, up, cameras, settings.seed, height);
    let photographs = drawn.from(scattered.take(views as usize))?;
    let judges = drawn.from(held_out(source, up, cameras, JUDGES, height).into_iter())?;
    let psnr_before_db = judged(&before, &judges, background);
    let training = Settings {
        iterations,
        sh_degree: source.sh_degree(),
        densify: false,
        pace: settings.pace,
        hold: settings.hold,
        loss: Loss::default(),
        background,
        antialiased: source.antialiased(),
        seed: settings.seed,
        ..Settings::default()
    };
    let mut trainer = Trainer::new(&photographs, before, training)?;
    while let Some(step) = trainer.step()? {
        seen(step);
    }
    let frame = trainer.finish();
    let psnr_db = judged(&frame, &judges, background);
    Ok(Followed { frame, psnr_before_db, psnr_db })
}

/// A frame that pictures are drawn of.
struct Drawn<'a> {
    frame: PreparedFrame<'a>,
    background: [f32; 3],
}

impl Drawn<'_> {
    fn from(&self, cameras: impl Iterator<Item = Camera>) -> Result<Vec<Photograph>, SizeError> {
        let draw = |camera: Camera| {
            let picture = self.frame.draw(&camera, self.background);
            Photograph::new(&camera, &picture.rendering().colour, None)
        };
        cameras.map(draw).collect()
    }
}

/// Mean PSNR in pictures, dB.
fn judged(frame: &GaussianFrame, pictures: &[Photograph], background: [f32; 3]) -> f64 {
    let prepared = PreparedFrame::new(frame);
    let sum: f64 = pictures.iter().map(|picture| picture.psnr(&prepared, background)).sum();
    sum / f64::from(JUDGES)
}
