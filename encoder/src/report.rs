//! What was written, what was chosen, and why.

use crate::finetune::report::FinetuneReport;
use crate::isolated::Isolated;
use crate::laws::Laws;
use crate::savings::{Saving, Tool};
use crate::sequence::Analysis;
use crate::settings::{Importance, Settings};
use crate::steps::Steps;

use splatstream_format::syntax::{FrameType, IncrementHeader};
use splatstream_gaussians::Defect;

/// What was written, what was chosen, and why.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Bytes of the stream.
    pub bytes: u64,
    /// Frames.
    pub frames: u32,
    /// Gaussians coded, over all frames.
    pub gaussians: u64,
    /// Gaussians left out because they can never be seen.
    pub invisible: u64,
    /// Values that were too far out, by attribute.
    pub isolated: Vec<Isolated>,
    /// Level of the stream.
    pub level: u8,
    /// SH degree of the source and of the stream.
    pub sh_degree: (u8, u8),
    /// Bits of a position on one axis.
    pub position_bits: u8,
    /// Step of the position grid, scene units.
    pub position_step: f32,
    /// Whether axes are sorted, and bits per Gaussian of scale and rotation if they are and if not.
    pub canonical_axes: (bool, [f64; 2]),
    /// Components of the sh transform in the first GOP.
    pub sh_rank: u8,
    /// Entries of the SH codebook in the first GOP; 0: coefficients.
    pub sh_codebook_entries: u32,
    /// Bits per Gaussian and mean squared error in steps, of coefficients and of codebooks, if compared.
    pub sh_trial: Option<[(f64, f64); 2]>,
    /// What choices save, as far as that is known.
    pub savings: Vec<Saving>,
    /// Quantiser steps.
    pub steps: Option<Steps>,
    /// How steps follow from what is known of a Gaussian.
    pub laws: Option<Laws>,
    /// What ordered the Gaussians.
    pub importance: Option<Importance>,
    /// Reconstruction digest of each frame, all refinements.
    pub digests: Vec<u64>,
    /// What each frame is made of.
    pub coded: Vec<FrameReport>,
    /// The GOPs.
    pub gops: Vec<GopReport>,
    /// What pictures of the stream are worth; none if it was not verified.
    pub pictures: Option<PictureReport>,
    /// How the size or the quality that was asked for was found; none if none was.
    pub target: Option<TargetReport>,
    /// Gaussians left out because a value of theirs is not finite, by frame.
    pub dropped: Vec<Dropped>,
    /// Gaussians left out because pictures hardly miss them, by frame; none where it was not asked for.
    pub pruned: Vec<Pruned>,
    /// What fitting I frames to pictures has done, frame by frame; none where it was not asked for.
    pub finetuned: Vec<FinetuneReport>,
    /// Whether each frame stands for itself in one layer although frames might have been predicted: that is smaller.
    pub stands_alone: bool,
}

impl Report {
    /// What is known after the first pass.
    pub(crate) fn new(analysis: &Analysis, settings: &Settings, importance: Importance) -> Self {
        let sequence = &analysis.parameters;
        Self {
            frames: sequence.frame_count,
            level: analysis.level,
            sh_degree: (analysis.source_sh_degree, sequence.sh_degree),
            position_bits: sequence.position_bits,
            position_step: sequence.position_step(),
            canonical_axes: (sequence.canonical_axes(), analysis.axes_trial),
            savings: vec![worth_of_axes(sequence.canonical_axes(), analysis.axes_trial)],
            steps: Some(settings.steps),
            laws: Some(settings.laws),
            importance: Some(importance),
            ..Self::default()
        }
    }

    /// Adds what was coded after it. How spherical harmonics are coded is told of the first GOP.
    pub(crate) fn append(&mut self, later: Self) {
        if self.coded.is_empty() {
            (self.sh_rank, self.sh_trial) = (later.sh_rank, later.sh_trial);
            self.sh_codebook_entries = later.sh_codebook_entries;
            self.savings.extend(later.savings);
        }
        self.gaussians = self.gaussians.saturating_add(later.gaussians);
        self.invisible = self.invisible.saturating_add(later.invisible);
        later.isolated.into_iter().for_each(|found| Isolated::add(Some(found), &mut self.isolated));
        self.coded.extend(later.coded);
        self.digests.extend(later.digests);
        self.finetuned.extend(later.finetuned);
    }

    /// Adds Gaussians that were left out because of their values. They were counted as invisible, which left them out.
    pub(crate) fn leave_out(&mut self, dropped: impl IntoIterator<Item = Dropped>) {
        for dropped in dropped {
            self.invisible = self.invisible.saturating_sub(dropped.gaussians.into());
            self.dropped.push(dropped);
        }
    }

    /// The same of Gaussians that pictures hardly miss.
    pub(crate) fn leave_pruned_out(&mut self, pruned: Vec<Pruned>) {
        let gaussians: u64 = pruned.iter().map(|pruned| u64::from(pruned.gaussians)).sum();
        self.invisible = self.invisible.saturating_sub(gaussians);
        let of_frame = |pruned: Pruned| {
            let bits = self.coded.get(pruned.frame as usize).map_or(0.0, |frame| frame.least_bits);
            Pruned { bytes: (f64::from(pruned.gaussians) * bits / 8.0) as u64, ..pruned }
        };
        self.pruned = pruned.into_iter().map(of_frame).collect();
    }
}

/// What the order of axes saves, of bits per Gaussian if they are sorted and if not.
fn worth_of_axes(are_sorted: bool, [sorted, unsorted]: [f64; 2]) -> Saving {
    Saving::estimated(Tool::Axes, if are_sorted { unsorted - sorted } else { sorted - unsorted })
}

/// A GOP.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct GopReport {
    /// Display index of its first frame.
    pub first: u32,
    /// Its frames.
    pub frames: u32,
}

/// Pictures of the finished stream beside those of the source, in views that decide nothing.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct PictureReport {
    /// The frames that were looked at.
    pub frames: Vec<VerifiedFrame>,
    /// Views of each.
    pub views: u32,
    /// Rows of each picture. Of these a part is drawn, in strips over all of its height.
    pub height: u32,
}

/// A frame that was looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct VerifiedFrame {
    /// Display index.
    pub number: u32,
    /// How it is coded.
    pub frame_type: FrameType,
    /// Mean of the PSNR of its views, decibels; none if nothing can be seen in any of them.
    pub psnr: Option<f64>,
    /// The same of as many other views: those that decide how fine all steps together are. None where no PSNR is asked for.
    /// Where a decoder has of a single frame what was drawn when steps were fitted, it is what was measured then.
    pub fitted_psnr: Option<f64>,
}

impl PictureReport {
    /// Mean PSNR of all frames that were looked at, decibels.
    pub fn psnr(&self) -> Option<f64> {
        self.mean(|_| true, |frame| frame.psnr)
    }

    /// The same in the views that decide how fine all steps together are; none where no PSNR is asked for.
    pub fn fitted_psnr(&self) -> Option<f64> {
        self.mean(|_| true, |frame| frame.fitted_psnr)
    }

    /// The same of frames of a type.
    pub fn psnr_of(&self, frame_type: FrameType) -> Option<f64> {
        self.mean(|frame| frame.frame_type == frame_type, |frame| frame.psnr)
    }

    #[expect(clippy::arithmetic_side_effects, reason = "counts of what is in memory")]
    fn mean(
        &self,
        counts: impl Fn(&VerifiedFrame) -> bool,
        psnr: impl Fn(&VerifiedFrame) -> Option<f64>,
    ) -> Option<f64> {
        let values = self.frames.iter().filter(|frame| counts(frame)).filter_map(psnr);
        let (sum, count) = values.fold((0.0, 0), |(sum, count), decibels| (sum + decibels, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    }
}

/// How a size or a quality that was asked for was found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TargetReport {
    /// The PSNR that the steps were fitted for at last, decibels.
    pub fitted: f32,
    /// Times that the sequence was encoded for it.
    pub encodings: u32,
    /// Times that a part of it was encoded.
    pub trials: u32,
    /// Whether values are not fitted to pictures, although the settings say so: without, the stream takes fewer bytes at
    /// equal PSNR.
    pub without_finetune: bool,
    /// Whether SH has no codebook, although the settings leave it open: it would have cost pictures too much.
    pub without_codebook: bool,
}

/// Gaussians of a frame that were left out because of values that no frame may hold.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Dropped {
    /// The frame.
    pub frame: u32,
    /// Gaussians left out.
    pub gaussians: u32,
    /// The properties at fault by their PLY names, and the number of bad values of each.
    pub properties: Vec<(String, u32)>,
    /// One of the values.
    pub first: Defect,
}

/// Gaussians of a frame that were left out because pictures hardly miss them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Pruned {
    /// The frame.
    pub frame: u32,
    /// Gaussians left out.
    pub gaussians: u32,
    /// Bytes that they would take, estimated: those of as many Gaussians of the last refinement.
    pub bytes: u64,
    /// PSNR of pictures without them against pictures with them, in the view that misses them most, decibels; none if nothing
    /// was left out.
    pub psnr: Option<f64>,
}

/// What a frame is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct FrameReport {
    /// How it is coded.
    pub frame_type: FrameType,
    /// Bytes of its units, headers included.
    pub bytes: u64,
    /// Gaussians of the frame.
    pub gaussians: u32,
    /// Cells that move or are stale.
    pub cells: u32,
    /// Parents: Gaussians of the reference, or of lower spatial layers.
    pub parents: u32,
    /// Parents with a position residual.
    pub moved: u32,
    /// Parents with attribute residuals.
    pub updated: u32,
    /// Parents that are removed.
    pub removed: u32,
    /// Gaussians that are new.
    pub new: u32,
    /// New Gaussians by predictor: none, knn, bilateral, transformer.
    pub predicted: [u64; 4],
    /// Bits of a Gaussian of the last refinement that adds any; 0 if none does.
    pub least_bits: f64,
    /// Bytes that prediction of new Gaussians saves, as far as both were coded.
    pub prediction_saves: u64,
    /// Whether it is true to its pictures, not to its attributes.
    pub by_pictures: bool,
}

impl FrameReport {
    /// Of a frame without units.
    pub(crate) const fn new(frame_type: FrameType, gaussians: u32, cells: u32) -> Self {
        Self {
            frame_type,
            bytes: 0,
            gaussians,
            cells,
            parents: 0,
            moved: 0,
            updated: 0,
            removed: 0,
            new: 0,
            predicted: [0; 4],
            least_bits: 0.0,
            prediction_saves: 0,
            by_pictures: false,
        }
    }

    /// Adds a unit.
    #[expect(clippy::arithmetic_side_effects, reason = "counts of what is in memory")]
    pub(crate) fn add(&mut self, header: &IncrementHeader, predicted: [u64; 4]) {
        self.parents += header.parent_count;
        self.moved += header.move_count;
        self.updated += header.update_count;
        self.removed += header.remove_count;
        self.new += header.new_count;
        self.predicted.iter_mut().zip(predicted).for_each(|(sum, count)| *sum += count);
    }
}
