//! Steps that reach a rendered quality with the fewest bits.
//!
//! Quantising one attribute with step s costs a squared error of about k·s², and a halved step about n bits
//! more. The sum of errors that is allowed then costs least where every attribute's share of it is in proportion
//! to its n. Both are estimated on a sample of the Gaussians: k from what pictures [show](crate::sensitivity) of each, n
//! by counting symbols. From there k is measured, but for the fast preset, and in the end what all attributes together do
//! to pictures: by drawing [strips](crate::strips) of a few views.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame that all planes are of; parts and axes are constants"
)]

use crate::error::Error;
use crate::importance::Ranked;
use crate::laws::Laws;
use crate::pca::Components;
use crate::quantised::Trial;
use crate::refinements::parts;
use crate::sensitivity::Sensitivity;
use crate::sequence::Scene;
use crate::settings::{Preset, Settings};
use crate::steps::Steps;
use crate::strips::{StripView, mean};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use splatstream_render::camera::{Up, spiral};

/// Views made for the scene, and their height, where none are given; of given ones no more are taken.
const VIEWS: u32 = 4;
const HEIGHT: u32 = 540;
/// Of so many strips of a view one is drawn.
const EVERY: u32 = 8;
const EVERY_FAST: u32 = 16;
/// Views in which attributes are measured alone: shares need not be exact.
const ALONE: usize = 2;
/// Frames of fewer Gaussians are measured so for the fast preset too.
const FEW: usize = 1 << 12;
/// Gaussians whose symbols are counted and whose errors are estimated.
const SAMPLE: usize = 1 << 14;
/// How often shares are estimated: the first steps are those of an average scene.
const ROUNDS: usize = 2;
/// How often pictures are measured, at most, and how near is near enough, dB.
const CORRECTIONS: usize = 3;
const NEAR: f64 = 0.1;
/// By halving all steps pictures gain so much, dB, as long as nothing better is known.
const OCTAVE: f64 = 5.8;
/// Steps change by no more than this factor at once: the model is local.
const LARGEST_CHANGE: f64 = 8.0;

/// What has a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Attribute {
    Position,
    LogScale,
    Rotation,
    Opacity,
    Dc,
    Sh,
}

/// All of them, in the order of their discriminants.
pub(crate) const ATTRIBUTES: [Attribute; 6] = [
    Attribute::Position,
    Attribute::LogScale,
    Attribute::Rotation,
    Attribute::Opacity,
    Attribute::Dc,
    Attribute::Sh,
];

impl Attribute {
    /// Makes a step coarser by `factor`, within what is sensible.
    fn scale(self, steps: &mut Steps, factor: f64) {
        let factor = factor.clamp(1.0 / LARGEST_CHANGE, LARGEST_CHANGE);
        let scaled =
            |step: f32, most: f32| ((f64::from(step) * factor) as f32).clamp(2.0_f32.powi(-20), most);
        match self {
            Self::Position => {
                steps.position_bits = (steps.position_bits - libm::log2(factor) as f32).clamp(1.0, 20.0);
            }
            Self::LogScale => steps.log_scale = scaled(steps.log_scale, 2.0),
            Self::Rotation => steps.rotation = scaled(steps.rotation, 0.5),
            Self::Opacity => steps.opacity = scaled(steps.opacity, 4.0),
            Self::Dc => steps.dc = scaled(steps.dc, 4.0),
            Self::Sh => steps.sh = scaled(steps.sh, 4.0),
        }
    }
}

/// What is measured of a frame to fit steps to a quality.
pub(crate) struct Fit {
    pub(crate) scene: Scene,
    pub(crate) settings: Settings,
    /// The refinement of each Gaussian.
    pub(crate) refinement: Vec<u8>,
    /// Principal components of dc and of sh.
    pub(crate) bases: [Components; 2],
    /// The source as some views show it, and by which of them attributes are measured alone.
    views: Vec<StripView>,
    alone: Vec<usize>,
    /// Some of the Gaussians, and which these are.
    sample: (GaussianFrame, Vec<u32>),
    sensitivity: Sensitivity,
}

impl Fit {
    /// Measures a canonical frame. `settings` have the quality that is wanted, or something near it.
    pub(crate) fn new(frame: &GaussianFrame, ranked: &Ranked, settings: &Settings) -> Self {
        let laws = match settings.tools.adaptive_steps {
            true => Laws::of(frame, &ranked.order, &ranked.shown, &settings.refinements),
            false => Laws::default(),
        };
        let is_fast = settings.preset == Preset::Fast;
        let cameras = cameras(frame, settings);
        // Of few Gaussians the estimates are poor, and pictures cost little.
        let alone = if is_fast && frame.len() >= FEW { 0 } else { ALONE };
        // Views made for a scene rise from below to above: not the first of them.
        let apart = cameras.len().div_ceil(ALONE).max(1);
        let alone =
            (0..cameras.len()).skip(usize::from(cameras.len() > 1)).step_by(apart).take(alone).collect();
        let every = if is_fast { EVERY_FAST } else { EVERY };
        let mut scene = Scene::new();
        scene.add(frame, &(0..frame.len() as u32).collect::<Vec<u32>>());
        let mut refinement = vec![0; frame.len()];
        for (number, part) in (0..).zip(parts(&settings.refinements, frame.len())) {
            ranked.order[part].iter().for_each(|&row| refinement[row as usize] = number);
        }
        let slices =
            |planes: &[Vec<f32>]| Components::of(&planes.iter().map(Vec::as_slice).collect::<Vec<_>>());
        let stride = frame.len().div_ceil(SAMPLE).max(1);
        let rows: Vec<u32> = (0..frame.len() as u32).step_by(stride).collect();
        let shown = rows.iter().map(|&row| ranked.shown[row as usize]).collect();
        let sample = frame.select(&rows);
        Self {
            bases: [slices(frame.dc()), slices(frame.sh())],
            scene,
            settings: Settings { laws, ..settings.clone() },
            refinement,
            sensitivity: Sensitivity::new(&sample, shown, &cameras),
            views: StripView::all(frame, &cameras, every),
            alone,
            sample: (sample, rows),
        }
    }

    /// How steps follow from what is known of a Gaussian.
    pub(crate) fn laws(&self) -> Laws {
        self.settings.laws
    }

    /// The steps with which renderings have a PSNR of about `decibels`.
    ///
    /// # Errors
    /// Planes that make no frame.
    pub(crate) fn at(&self, decibels: f32) -> Result<Steps, Error> {
        let mut steps = Steps::about(decibels);
        for _ in 0..ROUNDS {
            let errors = self.estimated(&steps)?;
            steps = self.allocated(&steps, errors);
        }
        if !self.alone.is_empty() {
            // Shares are those of steps near the ones that are looked for.
            steps = self.levelled(steps, decibels, 1)?;
            let errors = self.measured(&steps)?;
            steps = self.allocated(&steps, errors);
        }
        self.levelled(steps, decibels, CORRECTIONS)
    }

    /// All steps finer or coarser by one factor, so that renderings have a PSNR of about `decibels`.
    fn levelled(&self, mut steps: Steps, decibels: f32, corrections: usize) -> Result<Steps, Error> {
        // log2 of the last factor of all steps, and the PSNR before it.
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..corrections {
            // Where nothing can be seen nothing is too bad.
            let now = self.psnr(&steps)?.unwrap_or(decibels.into());
            let missing = f64::from(decibels) - now;
            if missing.abs() < NEAR {
                break;
            }
            // An octave is 6 dB where quantisers are fine, and less where they are coarse.
            let slope = match before {
                Some((log, was)) if log != 0.0 => ((was - now) / log).clamp(4.0, 7.0),
                _ => OCTAVE,
            };
            let log = -missing / slope;
            before = Some((log, now));
            ATTRIBUTES.into_iter().for_each(|attribute| attribute.scale(&mut steps, libm::exp2(log)));
        }
        Ok(steps)
    }

    /// PSNR of pictures with all attributes on their grids, dB.
    fn psnr(&self, steps: &Steps) -> Result<Option<f64>, Error> {
        mean(self.views.iter().map(|view| {
            let trial = Trial::new(self, &view.frame, Some(&view.rows), steps);
            Ok(view.psnr(&trial.decoded(&ATTRIBUTES)?))
        }))
    }

    /// The squared error of pictures with each attribute alone on its grid, estimated, in any unit.
    fn estimated(&self, steps: &Steps) -> Result<[f64; 6], Error> {
        let (sample, rows) = &self.sample;
        let decoded = Trial::new(self, sample, Some(rows), steps).decoded(&ATTRIBUTES)?;
        Ok(self.sensitivity.errors(sample, &decoded))
    }

    /// The same as strips of a few views show it.
    fn measured(&self, steps: &Steps) -> Result<[f64; 6], Error> {
        let views = || self.alone.iter().map(|&view| &self.views[view]);
        let trials: Vec<Trial<'_>> =
            views().map(|view| Trial::new(self, &view.frame, Some(&view.rows), steps)).collect();
        let mut errors = [0.0; 6];
        for (error, attribute) in errors.iter_mut().zip(ATTRIBUTES) {
            if attribute == Attribute::Sh && self.sample.0.sh_degree() == 0 {
                continue;
            }
            let of_view =
                |(view, trial): (&StripView, &Trial<'_>)| Ok(view.psnr(&trial.decoded(&[attribute])?));
            let decibels = mean(views().zip(&trials).map(of_view))?;
            *error = decibels.map_or(0.0, |decibels| libm::pow(10.0, -0.1 * decibels));
        }
        Ok(errors)
    }

    /// Steps with the same sum of errors as some, and with the shares in it that cost the fewest bits.
    fn allocated(&self, steps: &Steps, errors: [f64; 6]) -> Steps {
        let (sample, rows) = &self.sample;
        let trial = |octaves: f64| {
            let mut steps = *steps;
            ATTRIBUTES.into_iter().for_each(|attribute| attribute.scale(&mut steps, libm::exp2(octaves)));
            Trial::new(self, sample, Some(rows), &steps)
        };
        let [finer, coarser] = [trial(-0.25), trial(0.25)];
        let slopes = ATTRIBUTES.map(|attribute| match attribute {
            // Every bit of a sorted position costs one bit an axis.
            Attribute::Position => 3.0,
            _ => {
                let bits = finer.bits(attribute) - coarser.bits(attribute);
                (bits / 0.5 / rows.len().max(1) as f64).max(0.0)
            }
        });
        let [error, slope]: [f64; 2] = [errors.iter().sum(), slopes.iter().sum()];
        let mut steps = *steps;
        for (attribute, (own, share)) in ATTRIBUTES.into_iter().zip(errors.into_iter().zip(slopes)) {
            // What costs nothing or cannot be seen keeps its step, and all do where errors are beyond numbers.
            let factor = (error * share / slope / own).sqrt();
            if own > 0.0 && share > 0.0 && factor.is_finite() {
                attribute.scale(&mut steps, factor);
            }
        }
        steps
    }
}

/// The views that a fit goes by.
fn cameras(frame: &GaussianFrame, settings: &Settings) -> Vec<Camera> {
    match settings.cameras.as_slice() {
        [] => spiral(frame, Up::default(), VIEWS, HEIGHT),
        given => {
            let stride = given.len().div_ceil(VIEWS as usize).max(1);
            given.iter().step_by(stride).cloned().collect()
        }
    }
}
