//! Steps that reach a rendered quality with the fewest bits.
//!
//! Quantising one attribute with step s costs a squared error of about k·s², and a halved step about n bits
//! more. The sum of errors that is allowed then costs least where every attribute's share of it is in proportion
//! to its n. k is measured by rendering, n by counting symbols, both on the scene at hand.
#![expect(
    clippy::indexing_slicing,
    reason = "rows are those of the frame that all planes are of; parts and axes are constants"
)]

use crate::colour;
use crate::entropy_cost::entropy_of;
use crate::error::Error;
use crate::frame::unit::Grains;
use crate::grid::{Geometry, geometry, nearest_integer};
use crate::importance::Ranked;
use crate::laws::Laws;
use crate::pca::Components;
use crate::refinements::parts;
use crate::sequence::Scene;
use crate::settings::{Preset, Settings};
use crate::shape::{Shape, nearest_multiple};
use crate::steps::Steps;
use rayon::prelude::*;
use splatstream_decoder::companding::Companding;
use splatstream_decoder::position::refine;
use splatstream_decoder::stage::Stage;
use splatstream_decoder::steps::{StepRule, step};
use splatstream_format::syntax::{SequenceParameters, TransformKind};
use splatstream_gaussians::{GaussianFrame, Planes};
use splatstream_render::camera::{Up, spiral};
use splatstream_render::metrics::psnr;
use splatstream_render::{Camera, Rendering, render};

/// Views made for the scene, and their height, where none are given.
const VIEWS: (u32, u32) = (3, 540);
/// Attributes are measured alone in so many of them; for the fast preset in smaller pictures, and once.
const ALONE: usize = 2;
const FAST_HEIGHT: u32 = 360;
/// Gaussians whose symbols are counted.
const SAMPLE: usize = 1 << 13;
/// How often every attribute is measured alone.
const ROUNDS: usize = 2;
/// How often all are measured together, at most, and how near is near enough, dB.
const CORRECTIONS: usize = 4;
const NEAR: f64 = 0.05;
/// Steps change by no more than this factor at once: the model is local.
const LARGEST_CHANGE: f64 = 8.0;

/// What has a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Attribute {
    Position,
    LogScale,
    Rotation,
    Opacity,
    Dc,
    Sh,
}

const ATTRIBUTES: [Attribute; 6] = [
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
    frame: GaussianFrame,
    scene: Scene,
    settings: Settings,
    /// The refinement of each Gaussian.
    refinement: Vec<u8>,
    /// Principal components of dc and of sh.
    bases: [Components; 2],
    /// Pictures in which all attributes are measured together.
    together: Vec<View>,
    /// Pictures in which each is measured alone.
    alone: Vec<View>,
    /// Steps at which attributes were measured alone, the squared error of each in pictures, and the bits of an octave.
    measured: (Steps, [(f64, f64); 6]),
}

impl Fit {
    /// Measures a canonical frame. `settings` have the quality that is wanted, or something near it.
    ///
    /// # Errors
    /// Planes that make no frame.
    pub(crate) fn new(frame: GaussianFrame, ranked: &Ranked, settings: &Settings) -> Result<Self, Error> {
        let laws = match settings.tools.adaptive_steps {
            true => Laws::of(&frame, &ranked.order, &ranked.energy, &settings.refinements),
            false => Laws::default(),
        };
        let decibels = settings.psnr.unwrap_or(50.0);
        let steps = Steps::about(decibels);
        let cameras = match settings.cameras.as_slice() {
            [] => spiral(&frame, Up::default(), VIEWS.0, VIEWS.1),
            given => given.to_vec(),
        };
        let (count, height) = (ALONE, if settings.preset == Preset::Fast { FAST_HEIGHT } else { u32::MAX });
        let stride = cameras.len().div_ceil(count).max(1);
        let smaller = |camera: &Camera| camera.scaled_to_height(camera.height.min(height));
        let alone = cameras.iter().step_by(stride).map(|camera| view(&frame, smaller(camera))).collect();
        let together = cameras.into_iter().map(|camera| view(&frame, camera)).collect();
        let all: Vec<u32> = (0..frame.len() as u32).collect();
        let mut scene = Scene::new();
        scene.add(&frame, &all);
        let mut refinement = vec![0; frame.len()];
        for (number, part) in (0..).zip(parts(&settings.refinements, frame.len())) {
            ranked.order[part].iter().for_each(|&row| refinement[row as usize] = number);
        }
        let slices =
            |planes: &[Vec<f32>]| Components::of(&planes.iter().map(Vec::as_slice).collect::<Vec<_>>());
        let bases = [slices(frame.dc()), slices(frame.sh())];
        let rounds = if settings.preset == Preset::Fast { 1 } else { ROUNDS };
        let settings = Settings { laws, ..settings.clone() };
        let measured = (steps, [(0.0, 0.0); 6]);
        let mut fit = Self { frame, scene, settings, refinement, bases, together, alone, measured };
        for round in 0..rounds {
            let steps = if round == 0 { steps } else { fit.allocated(decibels) };
            let sample = fit.sample();
            let mut measured = [(0.0, 0.0); 6];
            for (of_one, attribute) in measured.iter_mut().zip(ATTRIBUTES) {
                let slope = fit.bits_an_octave(&sample, attribute, &steps);
                *of_one = (fit.error(&[attribute], &steps, &fit.alone)?, slope.max(0.0));
            }
            fit.measured = (steps, measured);
        }
        Ok(fit)
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
        let mut steps = self.allocated(decibels);
        // log2 of the last factor of all steps, and the PSNR before it.
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..CORRECTIONS {
            let error = self.error(&ATTRIBUTES, &steps, &self.together)?;
            let now = -10.0 * libm::log10(error.max(f64::MIN_POSITIVE));
            let missing = f64::from(decibels) - now;
            if missing.abs() < NEAR {
                break;
            }
            // An octave is 6 dB where quantisers are fine, and less where they are coarse.
            let slope = match before {
                Some((log, was)) if log != 0.0 => ((was - now) / log).clamp(2.0, 7.0),
                _ => 6.02,
            };
            let log = -missing / slope;
            before = Some((log, now));
            ATTRIBUTES.into_iter().for_each(|attribute| attribute.scale(&mut steps, libm::exp2(log)));
        }
        Ok(steps)
    }

    /// Steps that share the error that is allowed.
    fn allocated(&self, decibels: f32) -> Steps {
        let allowed = libm::pow(10.0, -0.1 * f64::from(decibels));
        let (mut steps, measured) = self.measured;
        let all: f64 = measured.iter().map(|(_, slope)| slope).sum();
        for (attribute, (error, slope)) in ATTRIBUTES.into_iter().zip(measured) {
            // What costs nothing or cannot be seen keeps its step.
            if error > 0.0 && slope > 0.0 {
                attribute.scale(&mut steps, (allowed * slope / all / error).sqrt());
            }
        }
        steps
    }

    /// Mean squared error of pictures with these attributes on their grids, by the mean of decibels.
    fn error(&self, attributes: &[Attribute], steps: &Steps, views: &[View]) -> Result<f64, Error> {
        let frame = Trial::new(self, &self.frame, None, steps).decoded(attributes)?;
        let decibels = |(camera, picture): &View| {
            psnr(&picture.colour, &render(&frame, camera, [0.0; 3]).colour).min(120.0)
        };
        let sum: f64 = views.iter().map(decibels).sum();
        Ok(libm::pow(10.0, -0.1 * sum / views.len().max(1) as f64))
    }

    /// Some of the Gaussians.
    fn sample(&self) -> (GaussianFrame, Vec<u32>) {
        let stride = self.frame.len().div_ceil(SAMPLE).max(1);
        let rows: Vec<u32> = (0..self.frame.len() as u32).step_by(stride).collect();
        (self.frame.select(&rows), rows)
    }

    /// Bits per Gaussian that halving the step costs.
    fn bits_an_octave(
        &self,
        (sample, rows): &(GaussianFrame, Vec<u32>),
        attribute: Attribute,
        steps: &Steps,
    ) -> f64 {
        // Every bit of a sorted position costs one bit an axis.
        if attribute == Attribute::Position {
            return 3.0;
        }
        let [finer, coarser] = [-0.25, 0.25].map(|octaves| {
            let mut steps = *steps;
            attribute.scale(&mut steps, libm::exp2(octaves));
            Trial::new(self, sample, Some(rows), &steps).bits(attribute)
        });
        (finer - coarser) / 0.5 / rows.len().max(1) as f64
    }
}

/// A camera and what it sees of the source.
type View = (Camera, Rendering);

fn view(frame: &GaussianFrame, camera: Camera) -> View {
    let picture = render(frame, &camera, [0.0; 3]);
    (camera, picture)
}

/// A frame with some steps.
struct Trial<'a> {
    frame: &'a GaussianFrame,
    bases: &'a [Components; 2],
    sequence: SequenceParameters,
    geometry: Geometry,
    /// How each Gaussian is coded.
    coded: Vec<Coded>,
}

/// What the values of a Gaussian depend on.
struct Coded {
    shape: Shape,
    position_shift: u8,
    /// Of rotation, dc and sh.
    exponents: [u8; 3],
}

impl<'a> Trial<'a> {
    /// `rows`: which Gaussians of the fit these are; none: all.
    fn new(fit: &'a Fit, frame: &'a GaussianFrame, rows: Option<&[u32]>, steps: &Steps) -> Self {
        let settings = Settings { steps: *steps, spatial_layers: 1, ..fit.settings.clone() };
        let flags = SequenceParameters::flags(true, frame.antialiased(), false);
        let sequence = fit.scene.parameters(&settings, 1, frame.sh_degree(), flags);
        let grains = Grains::new(&settings, &sequence);
        let geometry = geometry(frame, &sequence);
        let rules: Vec<StepRule> = (0..sequence.refinement_count)
            .map(|refinement| StepRule::new(&sequence, grains.of(refinement).attribute_step))
            .collect();
        let code = |row: usize| {
            let refinement = fit.refinement[rows.map_or(row, |rows| rows[row] as usize)];
            let rule = &rules[usize::from(refinement)];
            let wanted = geometry.log_scale.each_ref().map(|plane| plane[row]);
            let shape = Shape::new(wanted, geometry.opacity[row], rule, true);
            let exponents = [Stage::Rotation, Stage::Dc, Stage::Sh].map(|stage| shape.exponent(stage, rule));
            Coded { shape, position_shift: grains.of(refinement).position_shift, exponents }
        };
        let coded = (0..frame.len()).into_par_iter().map(code).collect();
        Self { frame, bases: &fit.bases, sequence, geometry, coded }
    }

    /// The frame with some attributes as a decoder would have them.
    fn decoded(&self, attributes: &[Attribute]) -> Result<GaussianFrame, Error> {
        let mut planes = self.frame.planes().clone();
        for attribute in attributes {
            match attribute {
                Attribute::Position => self.positions(&mut planes),
                Attribute::LogScale => {
                    let (offset, step) = (self.sequence.log_scale_offset(), self.sequence.log_scale_step());
                    for (axis, plane) in planes.log_scale.iter_mut().enumerate() {
                        let value = |coded: &Coded| offset + step * coded.shape.log_scale[axis] as f32;
                        *plane = self.coded.iter().map(value).collect();
                    }
                }
                Attribute::Opacity => {
                    let (offset, step) = (self.sequence.opacity_offset(), self.sequence.opacity_step());
                    let value = |coded: &Coded| offset + step * coded.shape.opacity as f32;
                    planes.opacity_logit = self.coded.iter().map(value).collect();
                }
                Attribute::Rotation => self.rotations(&mut planes),
                Attribute::Dc => {
                    for (slot, plane) in planes.dc.iter_mut().zip(self.colours(0)) {
                        *slot = plane;
                    }
                }
                Attribute::Sh => planes.sh = self.colours(1),
            }
        }
        let frame = GaussianFrame::from_planes(self.frame.sh_degree(), planes)?;
        Ok(frame.with_antialiased(self.frame.antialiased()))
    }

    fn positions(&self, planes: &mut Planes) {
        let companding = Companding::new(&self.sequence);
        let (offset, step) = (self.sequence.position_offset(), self.sequence.position_step());
        for (axis, plane) in planes.position.iter_mut().enumerate() {
            let value = |(coded, &code): (&Coded, &u32)| {
                let code = refine(code >> coded.position_shift, coded.position_shift);
                offset[axis] + step * companding.expand(code) as f32
            };
            *plane = self.coded.iter().zip(&self.geometry.position[axis]).map(value).collect();
        }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "values on a grid times its steps, both clamped")]
    fn rotations(&self, planes: &mut Planes) {
        let finest = self.sequence.rotation_step();
        let [w, parts @ ..] = &mut planes.rotation;
        for (part, values) in parts.iter_mut().zip(self.turns()) {
            let value = |(value, coded): (&i32, &Coded)| finest * (value * step(coded.exponents[0])) as f32;
            *part = values.iter().zip(&self.coded).map(value).collect();
        }
        for (row, w) in w.iter_mut().enumerate() {
            let squares: f32 = parts.iter().map(|plane| plane[row] * plane[row]).sum();
            *w = (1.0 - squares).max(0.0).sqrt();
        }
    }

    /// Coded values of the rotation.
    fn turns(&self) -> [Vec<i32>; 3] {
        self.geometry.rotation.each_ref().map(|plane| {
            let value = |(&parts, coded): (&i32, &Coded)| nearest_multiple(parts, coded.exponents[0]);
            plane.iter().zip(&self.coded).map(value).collect()
        })
    }

    fn colour_step(&self, which: usize) -> f32 {
        if which == 0 { self.sequence.dc_step() } else { self.sequence.sh_step() }
    }

    /// Coded values of dc, 0, or sh, 1.
    #[expect(clippy::arithmetic_side_effects, reason = "values on a grid times its steps, both clamped")]
    fn components(&self, which: usize) -> Vec<Vec<i32>> {
        let step_of = self.colour_step(which);
        let kind = [TransformKind::Dc, TransformKind::Sh][which];
        let transform = colour::transform(kind, &self.bases[which], step_of);
        let planes: Vec<&[f32]> = match which {
            0 => self.frame.dc().iter().map(Vec::as_slice).collect(),
            _ => self.frame.sh().iter().map(Vec::as_slice).collect(),
        };
        let value = |(&component, coded): (&f32, &Coded)| {
            let steps = component / step(coded.exponents[1 + which]) as f32;
            nearest_integer(steps.clamp(-1e6, 1e6))
        };
        let components = colour::components(&transform, &planes, step_of);
        components.par_iter().map(|plane| plane.iter().zip(&self.coded).map(value).collect()).collect()
    }

    /// Planes of dc, 0, or sh, 1, from their coded values.
    #[expect(clippy::arithmetic_side_effects, reason = "values on a grid times its steps, both clamped")]
    fn colours(&self, which: usize) -> Vec<Vec<f32>> {
        let (basis, finest) = (&self.bases[which], self.colour_step(which));
        let components = self.components(which);
        let plane = |index: usize| {
            let mut plane = vec![basis.mean[index] as f32; self.coded.len()];
            for (row, component) in basis.rows.iter().zip(&components) {
                let weight = row[index] as f32 * finest;
                for ((value, &component), coded) in plane.iter_mut().zip(component).zip(&self.coded) {
                    *value += weight * (component * step(coded.exponents[1 + which])) as f32;
                }
            }
            plane
        };
        (0..components.len()).into_par_iter().map(plane).collect()
    }

    /// Zero-order bits of an attribute.
    fn bits(&self, attribute: Attribute) -> f64 {
        let shapes =
            |part: usize| -> Vec<i32> { self.coded.iter().map(|coded| coded.shape.values[part]).collect() };
        let of_all = |planes: &[Vec<i32>]| planes.iter().map(|plane| entropy_of(plane)).sum();
        match attribute {
            Attribute::Position => 0.0,
            Attribute::LogScale => of_all(&[0, 1, 2].map(shapes)),
            Attribute::Opacity => of_all(&[shapes(3)]),
            Attribute::Rotation => of_all(&self.turns()),
            Attribute::Dc => of_all(&self.components(0)),
            Attribute::Sh => of_all(&self.components(1)),
        }
    }
}
