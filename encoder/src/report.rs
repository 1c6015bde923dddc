//! What was written, what was chosen, and why.

use crate::sequence::Analysis;
use crate::settings::{Importance, Settings, Steps};
use splatstream_format::syntax::{FrameType, IncrementHeader};

/// What was written, what was chosen, and why.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// Bytes of the stream.
    pub bytes: u64,
    /// Frames.
    pub frames: u32,
    /// Gaussians coded, over all frames.
    pub gaussians: u64,
    /// Gaussians left out because they can never be seen.
    pub invisible: u64,
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
    /// Quantiser steps.
    pub steps: Option<Steps>,
    /// What ordered the Gaussians.
    pub importance: Option<Importance>,
    /// Reconstruction digest of each frame, all refinements.
    pub digests: Vec<u64>,
    /// What each frame is made of.
    pub coded: Vec<FrameReport>,
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
            steps: Some(settings.steps),
            importance: Some(importance),
            ..Self::default()
        }
    }
}

/// What a frame is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
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
            by_pictures: false,
        }
    }

    /// Adds a unit.
    pub(crate) fn add(&mut self, header: &IncrementHeader, predicted: [u64; 4]) {
        self.parents += header.parent_count;
        self.moved += header.move_count;
        self.updated += header.update_count;
        self.removed += header.remove_count;
        self.new += header.new_count;
        self.predicted.iter_mut().zip(predicted).for_each(|(sum, count)| *sum += count);
    }
}
