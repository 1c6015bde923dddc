//! Steps that reach a rendered quality with the fewest bits.
//!
//! Quantising one attribute with step s costs a squared error of about k·s², and a halved step about n bits
//! more. The sum of errors that is allowed then costs least where every attribute's share of it is in proportion
//! to its n. Both are estimated on a sample of the Gaussians: k from what pictures [show](crate::sensitivity) of each, n
//! by counting symbols. From there k is measured, and in the end what all attributes together do to pictures: by drawing
//! [strips](crate::strips) of a few views.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame that all planes are of; parts and axes are constants"
)]

use crate::attribute::{ATTRIBUTES, Attribute};
use crate::error::Error;
use crate::frame::grain::Grains;
use crate::grid::{MAX_LOG_SCALE, MAX_OPACITY, USUAL};
use crate::importance::Ranked;
use crate::laws::Laws;
use crate::pca::Components;
use crate::quantised::{Grids, Trial};
use crate::refinements::parts;
use crate::savings::{Saving, Tool};
use crate::secant::Secant;
use crate::sensitivity::Sensitivity;
use crate::sequence::Scene;
use crate::settings::{Preset, Settings};
use crate::steps::Steps;
use crate::strips::{StripView, StripViews, mean};
use crate::verification::HEIGHT;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use splatstream_render::camera::spiral;

/// Views made for the scene where none are given; of given ones no more are taken.
const VIEWS: u32 = 4;
/// Of so many strips of a view one is drawn.
const EVERY: u32 = 8;
/// Views in which attributes are measured alone: shares need not be exact.
const ALONE: usize = 2;
/// Gaussians whose symbols are counted and whose errors are estimated; for the fast preset.
const SAMPLE: usize = 1 << 14;
const SAMPLE_FAST: usize = 1 << 12;
/// How often shares are estimated: the first steps are those of an average scene.
const ROUNDS: usize = 2;
/// How often pictures are measured, at most, and how near is near enough, dB: a stream that misses by more than half a decibel
/// costs another encoding.
const CORRECTIONS: usize = 6;
const NEAR: f64 = 0.2;
/// The same for the fast preset.
const NEAR_FAST: f64 = 0.3;
/// What pictures of most scenes gain where steps are fitted for a decibel more.
const SLOPE: f64 = 1.0;
/// What halving all steps brings.
const DECIBELS_AN_OCTAVE: f64 = 6.02;
/// The step of one attribute changes by no more than this factor at once: the model is local.
const LARGEST_CHANGE: f64 = 8.0;

/// All steps finer by one factor: as if pictures gained so many decibels.
pub(crate) fn finer(mut steps: Steps, decibels: f64) -> Steps {
    let factor = libm::exp2(-decibels / DECIBELS_AN_OCTAVE);
    ATTRIBUTES.into_iter().for_each(|attribute| attribute.scale(&mut steps, factor));
    steps
}

/// All steps finer or coarser as pictures need for so many decibels, if they have `now`; as they are where that is no number.
fn towards(decibels: f32, now: f64, steps: Steps) -> Steps {
    if now.is_finite() { finer(steps, f64::from(decibels) - now) } else { steps }
}

/// What is measured of a frame to fit steps to a quality.
pub(crate) struct Fit {
    pub(crate) scene: Scene,
    pub(crate) settings: Settings,
    /// The refinement of each Gaussian.
    pub(crate) refinement: Vec<u8>,
    /// Principal components of dc and of sh.
    pub(crate) bases: [Components; 2],
    /// The source as the views show it that quality is measured in.
    views: Vec<StripView>,
    /// The source as those views show it in which attributes are measured alone, if these are others.
    apart: Vec<StripView>,
    /// Whether these views hold their Gaussians.
    is_held: bool,
    /// Some of the Gaussians, and which these are.
    pub(crate) sample: (GaussianFrame, Vec<u32>),
    sensitivity: Sensitivity,
}

impl Fit {
    /// Measures a canonical frame; `whole` is what its pictures are compared with, if that has more Gaussians. `settings` have the quality that is wanted, or something near it; `views` are those that
    /// it is measured in.
    pub(crate) fn new(
        (frame, whole): (&GaussianFrame, Option<&GaussianFrame>),
        ranked: &Ranked,
        views: &StripViews,
        settings: &Settings,
    ) -> Self {
        let laws = match settings.tools.adaptive_steps {
            true => Laws::of(frame, &ranked.order, &ranked.shown, &settings.refinements),
            false => Laws::default(),
        };
        let cameras = cameras(frame, settings);
        let mut scene = Scene::new();
        scene.add(frame, &(0..frame.len() as u32).collect::<Vec<u32>>());
        let mut refinement = vec![0; frame.len()];
        for (number, part) in (0..).zip(parts(&settings.refinements, frame.len())) {
            ranked.order[part].iter().for_each(|&row| refinement[row as usize] = number);
        }
        let slices =
            |planes: &[Vec<f32>]| Components::of(&planes.iter().map(Vec::as_slice).collect::<Vec<_>>());
        let most = if settings.preset == Preset::Fast { SAMPLE_FAST } else { SAMPLE };
        let stride = frame.len().div_ceil(most).max(1);
        let rows: Vec<u32> = (0..frame.len() as u32).step_by(stride).collect();
        let shown = rows.iter().map(|&row| ranked.shown[row as usize]).collect();
        let sample = frame.select(&rows);
        Self {
            bases: [
                slices(frame.dc()),
                match settings.tools.sh_transform {
                    true => slices(frame.sh()),
                    false => Components::identity(frame.sh().len()),
                },
            ],
            scene,
            settings: Settings { laws, ..settings.clone() },
            refinement,
            sensitivity: Sensitivity::new(&sample, shown, &cameras),
            apart: match (settings.preset, whole) {
                (Preset::Fast, None) => Vec::new(),
                _ => apart(frame, cameras),
            },
            views: match whole {
                Some(whole) => views.beside(frame, whole),
                None => views.of(frame, 0..views.len()),
            },
            is_held: true,
            sample: (sample, rows),
        }
    }

    /// How steps follow from what is known of a Gaussian.
    pub(crate) fn laws(&self) -> Laws {
        self.settings.laws
    }

    /// What steps make of the scene with some laws.
    fn grids(&self, laws: Laws, steps: &Steps) -> Grids<'_> {
        let settings = Settings { steps: *steps, laws, spatial_layers: 1, ..self.settings.clone() };
        // Which Gaussians these are is no matter here.
        let (frame, _) = &self.sample;
        let flags = SequenceParameters::flags(true, frame.antialiased(), false);
        let sequence = self.scene.parameters(&settings, 1, frame.sh_degree(), flags);
        let grains = Grains::new(&laws, steps, &sequence);
        Grids::new(sequence, grains, &self.bases, &self.refinement)
    }

    /// What laws save against the same steps for all Gaussians, estimated; none where there are none.
    pub(crate) fn worth_of_laws(&self, steps: &Steps) -> Result<Option<Saving>, Error> {
        let (sample, rows) = &self.sample;
        if sample.is_empty() || self.laws() == Laws::default() {
            return Ok(None);
        }
        let cost = |laws: Laws| -> Result<(f64, f64), Error> {
            let grids = self.grids(laws, steps);
            let trial = Trial::new(&grids, sample, rows);
            let bits: f64 = ATTRIBUTES.into_iter().map(|attribute| trial.bits(attribute)).sum();
            let errors = self.sensitivity.errors(sample, &trial.decoded(&ATTRIBUTES)?);
            Ok((bits - trial.position_bits_left_out(), errors.iter().sum()))
        };
        let [(own, own_error), (other, other_error)] = [cost(self.laws())?, cost(Laws::default())?];
        let count = rows.len().max(1) as f64;
        // Other errors are brought to the same by steps that are finer or coarser.
        let octaves = 0.5 * libm::log2(other_error / own_error);
        let octave: f64 = self.bits_an_octave(steps).iter().sum();
        let bits = (other - own) / count + octaves * octave;
        Ok(bits.is_finite().then(|| Saving::estimated(Tool::AdaptiveSteps, bits)))
    }

    /// Bits per Gaussian that each attribute takes more where its steps are halved.
    fn bits_an_octave(&self, steps: &Steps) -> [f64; 6] {
        let (sample, rows) = &self.sample;
        let grids = [-0.25, 0.25].map(|octaves: f64| {
            let mut steps = *steps;
            ATTRIBUTES.into_iter().for_each(|attribute| attribute.scale(&mut steps, libm::exp2(octaves)));
            self.grids(self.laws(), &steps)
        });
        let [finer, coarser] = grids.each_ref().map(|grids| Trial::new(grids, sample, rows));
        ATTRIBUTES.map(|attribute| match attribute {
            // Every bit of a sorted position costs one bit an axis.
            Attribute::Position => 3.0,
            _ => {
                let bits = finer.bits(attribute) - coarser.bits(attribute);
                (bits / 0.5 / rows.len().max(1) as f64).max(0.0)
            }
        })
    }

    /// The steps with which renderings have a PSNR of about `decibels`, and the PSNR that they were seen to have; none if
    /// nothing can be seen.
    ///
    /// What the views show of the frame is let go after that: it would fill memory that coding needs. `again` gives the
    /// canonical frame where it is wanted once more.
    ///
    /// # Errors
    /// Those of `again`, and planes that make no frame.
    pub(crate) fn at(
        &mut self,
        decibels: f32,
        again: impl FnOnce() -> Result<GaussianFrame, Error>,
    ) -> Result<(Steps, Option<f64>), Error> {
        if !self.is_held {
            let frame = again()?;
            self.views.iter_mut().chain(&mut self.apart).for_each(|view| view.hold(&frame));
        }
        let found = self.found(decibels);
        self.views.iter_mut().chain(&mut self.apart).for_each(StripView::let_go);
        self.is_held = false;
        found
    }

    /// The same with what the views hold.
    fn found(&self, decibels: f32) -> Result<(Steps, Option<f64>), Error> {
        let mut steps = Steps::about(decibels);
        for _ in 0..ROUNDS {
            let errors = self.estimated(&steps)?;
            steps = self.allocated(&steps, errors);
        }
        // Shares are those of steps near the ones that are looked for: a few views tell that well enough.
        let now = self.psnr_in(self.alone(), &steps)?;
        steps = towards(decibels, now.unwrap_or(decibels.into()), steps);
        let errors = self.measured(&steps)?;
        steps = self.allocated(&steps, errors);
        self.levelled(steps, decibels.into())
    }

    /// All steps finer or coarser by one factor, so that renderings have a PSNR of about `decibels`.
    ///
    /// Values that lie on a grid already leap where steps pass its own: what is found is looked at before it is taken.
    fn levelled(&self, steps: Steps, decibels: f64) -> Result<(Steps, Option<f64>), Error> {
        let near = if self.settings.preset == Preset::Fast { NEAR_FAST } else { NEAR };
        let mut secant = Secant::new(decibels, near, SLOPE, CORRECTIONS);
        let mut best = (steps, None);
        let mut next = Some(decibels);
        while let Some(at) = next {
            let scaled = self.no_finer(finer(steps, at - decibels));
            let psnr = self.psnr_in(&self.views, &scaled)?;
            // Where nothing can be seen nothing is too bad.
            if secant.take(at, psnr.unwrap_or(decibels)) {
                best = (scaled, psnr);
            }
            next = secant.next();
        }
        Ok(best)
    }

    /// The same steps, but no finer than a stream can have them, whose values have 16 bits: a PSNR that needs finer ones is
    /// missed, and not refused. For values that are mistakes steps stay as fine as they are: these values are refused.
    pub(crate) fn no_finer(&self, mut steps: Steps) -> Steps {
        let ([scale, opacity], [scale_reach, opacity_reach, ..]) = (self.scene.origins, self.scene.reach);
        let least = |[usual, origin, reach]: [f32; 3], most: f32| usual.min(origin.abs() + reach) / most;
        steps.log_scale = steps.log_scale.max(least([USUAL[0], scale, scale_reach], MAX_LOG_SCALE));
        steps.opacity = steps.opacity.max(least([USUAL[1], opacity, opacity_reach], MAX_OPACITY));
        steps
    }

    /// PSNR of pictures with all attributes on their grids, dB.
    fn psnr_in(&self, views: &[StripView], steps: &Steps) -> Result<Option<f64>, Error> {
        let grids = self.grids(self.laws(), steps);
        mean(views.iter().map(|view| {
            let trial = Trial::new(&grids, &view.frame, &view.rows);
            Ok(view.psnr(&trial.decoded(&ATTRIBUTES)?))
        }))
    }

    /// The views that attributes are measured alone in: of those of the fit the one in the middle, if there are no others.
    fn alone(&self) -> &[StripView] {
        match self.apart.as_slice() {
            [] => self.views.chunks(1).nth(self.views.len() / 2).unwrap_or_default(),
            apart => apart,
        }
    }

    /// The squared error of pictures with each attribute alone on its grid, estimated.
    fn estimated(&self, steps: &Steps) -> Result<[f64; 6], Error> {
        let (sample, rows) = &self.sample;
        let grids = self.grids(self.laws(), steps);
        let decoded = Trial::new(&grids, sample, rows).decoded(&ATTRIBUTES)?;
        Ok(self.sensitivity.errors(sample, &decoded))
    }

    /// The same as strips of a few views show it.
    fn measured(&self, steps: &Steps) -> Result<[f64; 6], Error> {
        let grids = self.grids(self.laws(), steps);
        let views = self.alone();
        let trials: Vec<Trial<'_>> =
            views.iter().map(|view| Trial::new(&grids, &view.frame, &view.rows)).collect();
        let mut errors = [0.0; 6];
        for (error, attribute) in errors.iter_mut().zip(ATTRIBUTES) {
            if attribute == Attribute::Sh && self.sample.0.sh_degree() == 0 {
                continue;
            }
            let of_view =
                |(view, trial): (&StripView, &Trial<'_>)| Ok(view.psnr(&trial.decoded(&[attribute])?));
            let decibels = mean(views.iter().zip(&trials).map(of_view))?;
            *error = decibels.map_or(0.0, |decibels| libm::pow(10.0, -0.1 * decibels));
        }
        Ok(errors)
    }

    /// Steps with the same sum of errors as some, and with the shares in it that cost the fewest bits.
    fn allocated(&self, steps: &Steps, errors: [f64; 6]) -> Steps {
        let slopes = self.bits_an_octave(steps);
        let [error, slope]: [f64; 2] = [errors.iter().sum(), slopes.iter().sum()];
        let mut steps = *steps;
        for (attribute, (own, share)) in ATTRIBUTES.into_iter().zip(errors.into_iter().zip(slopes)) {
            // What costs nothing or cannot be seen keeps its step, and all do where errors are beyond numbers.
            let factor = (error * share / slope / own).sqrt();
            if own > 0.0 && share > 0.0 && factor.is_finite() {
                attribute.scale(&mut steps, factor.clamp(1.0 / LARGEST_CHANGE, LARGEST_CHANGE));
            }
        }
        steps
    }
}

/// Views that attributes are measured alone in.
fn apart(frame: &GaussianFrame, cameras: Vec<Camera>) -> Vec<StripView> {
    // Views made for a scene rise from below to above: not the first of them.
    let first = usize::from(cameras.len() > 1);
    let stride = cameras.len().div_ceil(ALONE).max(1);
    let places = (first..cameras.len()).step_by(stride).take(ALONE);
    StripViews::new(cameras, EVERY, frame).of(frame, places)
}

/// The views that shares are fitted in.
fn cameras(frame: &GaussianFrame, settings: &Settings) -> Vec<Camera> {
    match settings.cameras.as_slice() {
        [] => spiral(frame, settings.up(), VIEWS, HEIGHT),
        given => {
            let stride = given.len().div_ceil(VIEWS as usize).max(1);
            given.iter().step_by(stride).cloned().collect()
        }
    }
}
