//! Frames that were trained apart, as one sequence.
//!
//! Two trainings of one scene agree in pictures and in nothing else: not in the number of Gaussians, not in which stands for
//! what. A codec that predicts a frame from another finds nothing to predict from, and what stands still flickers. So the
//! Gaussians of one frame are trained on until they look like the next, in pictures drawn of it; each value stays exactly what
//! it was unless pictures agree that it must change (`hold` of the trainer's settings). Gaussian i stays Gaussian i, and
//! most of it need not be sent again.

use crate::photograph::{Photograph, SizeError};
use crate::trainer::{Settings, Step, TrainError, Trainer};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::PreparedFrame;
use splatstream_render::camera::{Camera, Scattered, Up, held_out};

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
