//! What a bit may cost in pictures, so that a frame is as good as it must be and no better.

use super::compensation::shown;
use super::predicted::Predicted;
use super::update_decision::Judge;
use crate::error::Error;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::{ReferencePictures, metrics};

/// The levels of prices: each is the square root of two times the one before. At the lowest nothing is left that
/// shows; at the highest nothing is sent.
const LEVELS: core::ops::RangeInclusive<i32> = -16..=16;

/// Bits per Gaussian that the error allowed in all views buys at level 0.
const BITS: f32 = 10.0;

/// The search ends where pictures are better than they must be by less than this, dB.
const NEAR: f64 = 0.1;

/// The first step of the search, levels.
const STRIDE: i32 = 4;

/// PSNR of each picture of a frame, dB, at most [`metrics::LOSSLESS_DB`].
pub(crate) fn finite_psnr(pictures: &ReferencePictures, frame: &GaussianFrame) -> impl Iterator<Item = f64> {
    pictures.psnr(frame).map(|decibels| decibels.min(metrics::LOSSLESS_DB))
}

/// The share of the error of a view that a bit is worth at level 0, of so many views and Gaussians.
pub(crate) fn price_at_zero(views: usize, gaussians: usize) -> f32 {
    views as f32 / (BITS * gaussians.max(1) as f32)
}

/// How good pictures must be.
pub(crate) struct Goal {
    /// Those of the source.
    pub(crate) pictures: ReferencePictures,
    /// How far they may be below those of a frame of which every difference is sent, dB.
    pub(crate) tolerance: f64,
    /// PSNR of each view, dB; from the tolerance.
    pub(crate) least: Vec<f64>,
    /// The level of the price that the last frame was coded at.
    pub(crate) level: i32,
}

impl Goal {
    /// The share of the error of a view that a bit is worth at a level, of a frame of so many Gaussians.
    fn price(&self, level: i32, gaussians: usize) -> f32 {
        price_at_zero(self.least.len(), gaussians) * libm::exp2f(0.5 * level as f32)
    }

    /// By how much pictures are better than they must be, dB, on average over the views.
    fn margin(&self, frame: &GaussianFrame) -> f64 {
        let margins = finite_psnr(&self.pictures, frame).zip(&self.least).map(|(psnr, least)| psnr - least);
        margins.sum::<f64>() / self.least.len().max(1) as f64
    }
}

/// What a bit of a move is worth that pictures have asked for, of what one is otherwise: it brings its Gaussian near.
const OF_JUDGED: f32 = 0.1;

impl Predicted<'_> {
    /// Sets the judge, at the highest price at which pictures are good enough, or the lowest.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn set_judge(&mut self, goal: &mut Goal) -> Result<(), Error> {
        self.from.survivors.price.moves *= OF_JUDGED;
        self.from.survivors.judge = Some(Judge::default());
        let everything = self.shown()?;
        let decibels = finite_psnr(&goal.pictures, &everything);
        goal.least = decibels.map(|psnr| psnr - goal.tolerance).collect();
        let carried = shown(&self.displaced, self.from.coder.sequence)?;
        self.from.survivors.judge =
            Some(Judge::new(&self.from.target.frame, &carried, (&goal.pictures, &goal.least)));
        goal.level = self.level(goal)?;
        self.price_at(goal, goal.level);
        Ok(())
    }

    /// The highest level at which pictures are good enough, nearly; or the lowest.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "levels are -17 to 17, and a stride doubles at most as often as it takes to leave them"
    )]
    fn level(&mut self, goal: &Goal) -> Result<i32, Error> {
        let (low, high) = (*LEVELS.start(), *LEVELS.end());
        let (mut best, mut worst) = (low - 1, high + 1);
        let mut level = goal.level.clamp(low, high);
        let mut stride = STRIDE;
        while worst - best > 1 {
            self.price_at(goal, level);
            let margin = goal.margin(&self.shown()?);
            match margin >= 0.0 {
                true => best = level,
                false => worst = level,
            }
            if (0.0..NEAR).contains(&margin) {
                break;
            }
            // Outwards until the goal is between two levels, then halving what is between.
            level = match (best >= low, worst <= high) {
                (true, false) => (best + stride).min(high),
                (false, true) => (worst - stride).max(low),
                _ => best + (worst - best) / 2,
            };
            stride *= 2;
        }
        Ok(best.max(low))
    }

    fn price_at(&mut self, goal: &Goal, level: i32) {
        let gaussians = self.from.target.frame.len();
        if let Some(judge) = &mut self.from.survivors.judge {
            judge.price = goal.price(level, gaussians);
        }
    }

    /// The frame as the judge would have it.
    fn shown(&self) -> Result<GaussianFrame, Error> {
        shown(&self.lists()?, self.from.coder.sequence)
    }
}
