//! Steps that reach a rendered quality with the fewest bits.
//!
//! Quantising one attribute with step s costs a squared error of about k·s², and a halved step about n bits
//! more. The sum of errors that is allowed then costs least where every attribute's share of it is in proportion
//! to its n. k is measured by rendering, n by counting symbols, both on the scene at hand.

use crate::colour;
use crate::entropy_cost::entropy_of;
use crate::grid::{Spacing, inner_side, nearest_integer};
use crate::pca::Components;
use crate::settings::{Settings, Steps};
use splatstream_format::syntax::TransformKind;
use splatstream_render::camera::{Up, ring};
use splatstream_render::metrics::psnr;
use splatstream_render::{Camera, Rendering, render};
use splatstream_scene::GaussianFrame;

/// Views made for the scene, and their height, where none are given.
const VIEWS: (u32, u32) = (4, 540);
/// Gaussians whose symbols are counted.
const SAMPLE: usize = 1 << 14;
/// How often every attribute is measured; a last look at all together follows.
const ROUNDS: usize = 2;
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

/// The steps with which renderings of a canonical frame have a PSNR of about `decibels`.
pub(crate) fn fit(frame: GaussianFrame, spacing: Spacing, settings: &Settings, decibels: f32) -> Steps {
    let scene = Scene::new(frame, spacing, settings);
    let allowed = libm::pow(10.0, -0.1 * f64::from(decibels));
    let mut steps = settings.steps;
    for _ in 0..ROUNDS {
        let measured = ATTRIBUTES.map(|attribute| {
            let slope = scene.bits_an_octave(attribute, &steps);
            (scene.error(&[attribute], &steps), if slope > 0.0 { slope } else { 0.0 })
        });
        let all: f64 = measured.iter().map(|(_, slope)| slope).sum();
        for (attribute, (error, slope)) in ATTRIBUTES.into_iter().zip(measured) {
            // What costs nothing or cannot be seen keeps its step.
            if error > 0.0 && slope > 0.0 {
                attribute.scale(&mut steps, (allowed * slope / all / error).sqrt());
            }
        }
    }
    let change = (allowed / scene.error(&ATTRIBUTES, &steps).max(f64::MIN_POSITIVE)).sqrt();
    ATTRIBUTES.into_iter().for_each(|attribute| attribute.scale(&mut steps, change));
    steps
}

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

/// A frame with its pictures.
struct Scene {
    frame: GaussianFrame,
    spacing: Spacing,
    views: Vec<(Camera, Rendering)>,
    inner_side: f32,
}

impl Scene {
    fn new(frame: GaussianFrame, spacing: Spacing, settings: &Settings) -> Self {
        let (count, height) = VIEWS;
        let cameras = match settings.cameras.as_slice() {
            [] => ring(&frame, Up::default(), count, height),
            given => given.to_vec(),
        };
        let views = cameras.into_iter().map(|camera| {
            let picture = render(&frame, &camera, [0.0; 3]);
            (camera, picture)
        });
        let inner_side = inner_side(&frame);
        Self { views: views.collect(), inner_side, spacing, frame }
    }

    /// Mean squared error of the pictures with these attributes on their grids, by the mean of decibels.
    fn error(&self, attributes: &[Attribute], steps: &Steps) -> f64 {
        let mut frame = self.frame.clone();
        for &attribute in attributes {
            frame = self.quantised(frame, attribute, steps);
        }
        let decibels = |(camera, picture): &(Camera, Rendering)| {
            psnr(&picture.colour, &render(&frame, camera, [0.0; 3]).colour).min(120.0)
        };
        let mean = self.views.iter().map(decibels).sum::<f64>() / self.views.len().max(1) as f64;
        libm::pow(10.0, -0.1 * mean)
    }

    /// The frame with one attribute as a decoder would have it.
    fn quantised(&self, frame: GaussianFrame, attribute: Attribute, steps: &Steps) -> GaussianFrame {
        let (degree, antialiased) = (frame.sh_degree(), frame.antialiased());
        let mut planes = frame.into_planes();
        let rounded = |planes: &mut [Vec<f32>], step: f32| {
            for plane in planes {
                for (row, value) in plane.iter_mut().enumerate() {
                    *value = self.spacing.nearest(row, (*value / step).clamp(-1e6, 1e6)) as f32 * step;
                }
            }
        };
        let evenly = |planes: &mut [Vec<f32>], step: f32| {
            for value in planes.iter_mut().flatten() {
                *value = libm::rintf(*value / step) * step;
            }
        };
        match attribute {
            Attribute::Position => evenly(&mut planes.position, self.position_step(steps)),
            Attribute::LogScale => rounded(&mut planes.log_scale, steps.log_scale),
            Attribute::Opacity => evenly(std::slice::from_mut(&mut planes.opacity_logit), steps.opacity),
            Attribute::Dc => rounded(&mut planes.dc, steps.dc),
            Attribute::Sh => planes.sh = rounded_components(&planes.sh, steps.sh, &self.spacing),
            Attribute::Rotation => {
                let [w, parts @ ..] = &mut planes.rotation;
                rounded(parts, steps.rotation);
                for (row, w) in w.iter_mut().enumerate() {
                    let squares: f32 = parts.iter().map(|plane| plane[row] * plane[row]).sum();
                    *w = (1.0 - squares).max(0.0).sqrt();
                }
            }
        }
        let frame = GaussianFrame::from_planes(degree, planes).unwrap_or_default();
        frame.with_antialiased(antialiased)
    }

    fn position_step(&self, steps: &Steps) -> f32 {
        (self.inner_side / libm::exp2f(steps.position_bits)).max(f32::MIN_POSITIVE)
    }

    /// Bits per Gaussian that halving the step costs.
    fn bits_an_octave(&self, attribute: Attribute, steps: &Steps) -> f64 {
        // Every bit of a sorted position costs one bit an axis.
        if attribute == Attribute::Position {
            return 3.0;
        }
        let [finer, coarser] = [-0.25, 0.25].map(|octaves| {
            let mut steps = *steps;
            attribute.scale(&mut steps, libm::exp2(octaves));
            self.bits(attribute, &steps)
        });
        (finer - coarser) / 0.5
    }

    /// Zero-order bits per Gaussian of an attribute, on a sample.
    fn bits(&self, attribute: Attribute, steps: &Steps) -> f64 {
        let stride = self.frame.len().div_ceil(SAMPLE).max(1);
        let rows: Vec<u32> = (0..self.frame.len() as u32).step_by(stride).collect();
        let sample = self.frame.select(&rows);
        let bits = |planes: &[Vec<f32>], step: f32| -> f64 {
            let plane = |plane: &Vec<f32>| -> Vec<i32> {
                plane.iter().map(|&value| nearest_integer((value / step).clamp(-1e6, 1e6))).collect()
            };
            planes.iter().map(|values| entropy_of(&plane(values))).sum()
        };
        let total = match attribute {
            Attribute::Position => 0.0,
            Attribute::LogScale => {
                let [a, b, c] = sample.log_scale();
                let less = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a - b).collect();
                bits(&[a.clone(), less(a, b), less(b, c)], steps.log_scale)
            }
            Attribute::Rotation => bits(&sample.rotation()[1..], steps.rotation),
            Attribute::Opacity => bits(&[sample.opacity_logit().to_vec()], steps.opacity),
            Attribute::Dc => bits(sample.dc(), steps.dc),
            Attribute::Sh => {
                let planes: Vec<&[f32]> = sample.sh().iter().map(Vec::as_slice).collect();
                let basis = Components::of(&planes);
                let transform = colour::transform(TransformKind::Sh, &basis, steps.sh);
                colour::components(&transform, &planes, steps.sh, &Spacing::default())
                    .iter()
                    .map(|plane| entropy_of(plane))
                    .sum()
            }
        };
        total / rows.len().max(1) as f64
    }
}

/// SH planes whose principal components are on a grid.
fn rounded_components(planes: &[Vec<f32>], step: f32, spacing: &Spacing) -> Vec<Vec<f32>> {
    let slices: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    let basis = Components::of(&slices);
    let transform = colour::transform(TransformKind::Sh, &basis, step);
    let components = colour::components(&transform, &slices, step, spacing);
    let plane = |index: usize| {
        let mut plane = vec![basis.mean[index] as f32; slices[index].len()];
        for (row, component) in basis.rows.iter().zip(&components) {
            let weight = row[index] as f32 * step;
            for (value, &component) in plane.iter_mut().zip(component) {
                *value += weight * component as f32;
            }
        }
        plane
    };
    (0..planes.len()).map(plane).collect()
}
