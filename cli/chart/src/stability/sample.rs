//! A case at a strength: what is coded, and from where it is looked at.

use super::edits::zoomed;
use crate::picture_comparison::Judge;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, ring};
use splatstream_render::metrics::Comparison;
use std::ops::Range;

/// What is coded, and what is judged.
pub(super) struct Sample {
    /// The frames.
    pub(super) frames: Vec<GaussianFrame>,
    /// What the cameras of each frame look at: the scene without what spoils it.
    subjects: Vec<GaussianFrame>,
    /// The frames that are judged.
    judged: Range<usize>,
    /// The length that 1 stands for in frames and subjects; pictures are drawn with it taken out again, as renderers
    /// have limits of their own.
    unit: f64,
    /// Whether all frames are one GOP without temporal layers: then errors could add up.
    pub(super) one_chain: bool,
}

impl Sample {
    /// Frames that are judged from cameras around `subjects`, one each.
    pub(super) fn of(frames: Vec<GaussianFrame>, subjects: Vec<GaussianFrame>) -> Self {
        let judged = 0..frames.len();
        Self { frames, subjects, judged, unit: 1.0, one_chain: false }
    }

    /// One frame.
    pub(super) fn scene(frame: GaussianFrame, subject: &GaussianFrame) -> Self {
        Self::of(vec![frame], vec![subject.clone()])
    }

    /// Frames that spoil nothing of what is looked at.
    pub(super) fn plain(frames: Vec<GaussianFrame>) -> Self {
        let subjects = frames.clone();
        Self::of(frames, subjects)
    }

    /// The same, only some frames judged.
    pub(super) fn judging(self, judged: Range<usize>) -> Self {
        Self { judged, ..self }
    }

    /// The same in another unit.
    pub(super) fn in_unit(self, unit: f64) -> Self {
        Self { unit, ..self }
    }

    /// The same as one GOP in which each frame refers to the one before.
    pub(super) fn chained(self) -> Self {
        Self { one_chain: true, ..self }
    }

    /// Gaussians over all frames.
    pub(super) fn gaussians(&self) -> u64 {
        self.frames.iter().map(|frame| frame.len() as u64).sum()
    }

    /// The length that 1 stands for.
    pub(super) fn unit(&self) -> f64 {
        self.unit
    }

    /// The pictures of the source.
    pub(super) fn views(&self, cameras: u32, height: u32) -> Views<'static> {
        let of_frame = |number: usize| {
            let (frame, subject) = (self.frames.get(number)?, self.subjects.get(number)?);
            let cameras = ring(&drawn(subject, self.unit), Up::default(), cameras, height);
            Some((number, Judge::new(&[drawn(frame, self.unit)], cameras, None, || {})))
        };
        Views { judges: self.judged.clone().filter_map(of_frame).collect(), unit: self.unit }
    }
}

/// A frame in the unit of pictures.
fn drawn(frame: &GaussianFrame, unit: f64) -> GaussianFrame {
    if unit == 1.0 { frame.clone() } else { zoomed(frame, [0.0; 3], unit.recip()) }
}

/// The pictures of a sample, for all tools.
pub(super) struct Views<'a> {
    /// The frames that are judged, each with its cameras.
    judges: Vec<(usize, Judge<'a>)>,
    unit: f64,
}

impl Views<'_> {
    /// How good what a tool shows is, means of frames and cameras. In place of a frame that it lacks stands the one
    /// before, or nothing. None if it shows no frame.
    pub(super) fn judged(&self, shown: &[Option<GaussianFrame>]) -> Option<Quality> {
        shown.iter().flatten().next()?;
        let one = |(number, judge): &(usize, Judge<'_>)| {
            let upto = shown.get(..=*number).unwrap_or(shown);
            let frame = upto.iter().rev().flatten().next().cloned().unwrap_or_default();
            judge.views(0, &drawn(&frame, self.unit))
        };
        let figures: Vec<Comparison> = self.judges.iter().flat_map(one).collect();
        let mean = Comparison::mean(&figures)?;
        Some(Quality { psnr: mean.psnr_db, covered: mean.psnr_masked_db.unwrap_or(mean.psnr_db) })
    }
}

/// How good pictures are, decibels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Quality {
    /// PSNR.
    pub(super) psnr: f64,
    /// PSNR over the pixels that the scene covers.
    pub(super) covered: f64,
}

impl Quality {
    /// The mean of several; none of none.
    pub(super) fn mean(all: &[Self]) -> Option<Self> {
        let mean = |of: fn(&Self) -> f64| all.iter().map(of).sum::<f64>() / all.len().max(1) as f64;
        let mean = Self { psnr: mean(|quality| quality.psnr), covered: mean(|quality| quality.covered) };
        (!all.is_empty()).then_some(mean)
    }

    /// How far it is below another, by the measure that is nearer. A case may change how much of a picture the scene
    /// covers: what is not covered is without error and raises the PSNR of the whole, and a few pixels at the edges of
    /// what is covered lower that of the rest.
    pub(super) fn below(&self, wanted: &Self) -> f64 {
        (wanted.psnr - self.psnr).min(wanted.covered - self.covered)
    }
}
