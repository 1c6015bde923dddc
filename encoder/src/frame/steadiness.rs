//! Keeps predicted frames about as good as the I frame that they follow.
//!
//! What a bit is worth decides how much of a difference is left, and errors that are left stay in later frames. How much
//! they show depends on the scene. So the pictures of each predicted frame are compared with its source, as those of the I
//! frame were, and the price of the next frame follows: nothing is coded twice. The same views of its source say of each
//! Gaussian what a difference of it shows, before the frame is coded.

use super::compensation::shown;
use super::rate_distortion::{finite_psnr, price_at_zero};
use super::survivors::BitPrice;
use super::update_decision::Judge;
use super::{CodedFrame, Target};
use crate::error::Error;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::{Camera, ReferencePictures};

/// Views that are looked at, and their lines: the mean of a few small ones is steady.
const VIEWS: usize = 3;
const LINES: u32 = 180;

/// How far the pictures of predicted frames may be below those of the I frame, dB: beyond the first of these a bit
/// becomes cheaper, up to the second dearer. A decibel would be seen as a pulse; what is left saves bits.
const FAR: f64 = 0.6;
const NEAR: f64 = 0.35;

/// How much of the mean of the frames so far a frame replaces: single frames are easier or harder than others.
const FRESH: f64 = 0.5;

/// The price of the first predicted frame, by how much it changes from frame to frame, and how far it may: below the least
/// nothing more is sent, above the most more bits are saved by coarser steps.
const FIRST: f32 = 1.0;
const CHEAPER: f32 = 0.6;
const DEARER: f32 = 1.25;
const LEVELS: core::ops::RangeInclusive<f32> = 0.125..=3.0;

/// What a bit is worth at level 1, of what it is where pictures decide about single frames: errors that are left stay, and
/// those of neighbours add up.
const OF_SINGLE: f32 = 0.03;

/// What a bit of a move is worth that pictures have found worth it, of what one is otherwise.
const OF_WEIGHED: f32 = 0.5;

/// The pictures of a GOP and the price that follows from them.
pub(crate) struct Steadiness {
    cameras: Vec<Camera>,
    /// PSNR of the I frame in each view, dB.
    of_intra: Vec<f64>,
    /// How far predicted frames have been below it, dB: a mean in which late ones count more.
    below: Option<f64>,
    level: f32,
}

impl Steadiness {
    /// Of a GOP that starts with this I frame, seen by some of the cameras.
    ///
    /// # Errors
    /// Lists whose planes make no frame.
    pub(crate) fn new(
        cameras: &[Camera],
        target: &Target,
        coded: &CodedFrame,
        sequence: &SequenceParameters,
    ) -> Result<Self, Error> {
        let stride = cameras.len().div_ceil(VIEWS).max(1);
        let small = |camera: &Camera| camera.scaled_to_height(LINES.min(camera.height));
        let cameras = cameras.iter().step_by(stride).map(small).collect();
        let mut steadiness = Self { cameras, of_intra: Vec::new(), below: None, level: FIRST };
        steadiness.of_intra = steadiness.psnr(target, coded, sequence)?;
        Ok(steadiness)
    }

    /// What a bit is worth in the next frame.
    pub(crate) fn price(&self) -> BitPrice {
        BitPrice::at(self.level)
    }

    /// The same where pictures have said which moves are worth it.
    pub(crate) fn weighed_price(&self) -> BitPrice {
        BitPrice { moves: OF_WEIGHED * self.price().moves, ..self.price() }
    }

    /// What pictures say of the differences of the next frame.
    pub(crate) fn weigher(&self, frame: &GaussianFrame) -> Judge {
        let price = OF_SINGLE * self.level * price_at_zero(self.cameras.len(), frame.len());
        Judge::of_rows(frame, (&self.cameras, &self.of_intra), price)
    }

    /// Looks at a predicted frame.
    ///
    /// # Errors
    /// Lists whose planes make no frame.
    pub(crate) fn follow(
        &mut self,
        target: &Target,
        coded: &CodedFrame,
        sequence: &SequenceParameters,
    ) -> Result<(), Error> {
        let now = mean(&self.of_intra) - mean(&self.psnr(target, coded, sequence)?);
        let below = self.below.map_or(now, |before| before + FRESH * (now - before));
        self.below = Some(below);
        if below > FAR {
            self.level *= CHEAPER;
        } else if below < NEAR {
            self.level *= DEARER;
        }
        self.level = self.level.clamp(*LEVELS.start(), *LEVELS.end());
        Ok(())
    }

    /// PSNR of the pictures of a frame, dB.
    fn psnr(
        &self,
        target: &Target,
        coded: &CodedFrame,
        sequence: &SequenceParameters,
    ) -> Result<Vec<f64>, Error> {
        let views = ReferencePictures::new(&target.frame, self.cameras.clone());
        let frame = shown(&coded.reference.lists, sequence)?;
        Ok(finite_psnr(&views, &frame).collect())
    }
}

/// The mean of some views, dB.
fn mean(decibels: &[f64]) -> f64 {
    decibels.iter().sum::<f64>() / decibels.len().max(1) as f64
}
