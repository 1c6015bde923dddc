//! Predicted frames: how far a Gaussian of the reference is from its partner, and what is sent of that.
#![expect(
    clippy::indexing_slicing,
    reason = "attributes are counted by what they index; stages are constants"
)]

use super::axis_matching::Pose;
use crate::vq;
use splatstream_format::payload::Codebook;

/// Where the opacity, the rotation and dc are among the attributes, after the log-scales.
pub(crate) const OPACITY: usize = 3;
pub(crate) const ROTATION: usize = 4;
pub(crate) const COLOUR: usize = 7;

/// How far a Gaussian is from its partner, in steps of the sequence.
pub(crate) struct Apart {
    pub(crate) position: [f32; 3],
    /// Log-scales, opacity, rotation, components of dc and of sh.
    pub(crate) attributes: Vec<f32>,
    /// Where the components of sh begin.
    pub(crate) colours: usize,
    /// The steps that each is coded with, nearly: those of a Gaussian of this size and opacity.
    pub(crate) steps: [f32; 5],
    /// The step of moves.
    pub(crate) move_step: f32,
    /// The partner, written like the Gaussian, and the Gaussian.
    pub(crate) pose: Pose,
    pub(crate) reference: Pose,
    /// The opacity of the partner.
    pub(crate) logit: f32,
}

impl Apart {
    /// Components of sh.
    pub(crate) fn sh(&self) -> &[f32] {
        &self.attributes[self.colours..]
    }

    /// Components of sh, in the steps that they are coded with.
    fn coded_sh(&self) -> Vec<f32> {
        self.sh().iter().map(|value| value / self.steps[4]).collect()
    }

    /// Whether some difference is larger than this, in the steps that it is coded with.
    pub(crate) fn is_beyond(&self, most: f32) -> bool {
        let mut moves = self.position.iter().map(|change| change / self.move_step);
        let mut attributes =
            (0..).zip(&self.attributes).map(|(attribute, change)| change / self.step_of(attribute));
        moves.any(|steps| steps.abs() > most) || attributes.any(|steps| steps.abs() > most)
    }

    /// All differences.
    pub(crate) fn all_kept(&self, book: Option<&Codebook>) -> Kept {
        Kept {
            moves: true,
            attributes: self.attributes.clone(),
            entry: book.map(|book| self.nearest_entry(book)),
        }
    }

    /// The entry of a codebook that is nearest to the components of sh.
    pub(crate) fn nearest_entry(&self, book: &Codebook) -> i32 {
        vq::nearest_entry(book, &self.coded_sh())
    }

    /// The step of an attribute.
    pub(crate) fn step_of(&self, attribute: usize) -> f32 {
        let stage = match attribute {
            0..OPACITY => 0,
            OPACITY => 1,
            ROTATION..COLOUR => 2,
            _ if attribute < self.colours => 3,
            _ => 4,
        };
        self.steps[stage]
    }
}

/// What is sent of the differences.
pub(crate) struct Kept {
    /// Whether the position is worth a move.
    pub(crate) moves: bool,
    /// What the attributes shall change by, steps of the sequence.
    pub(crate) attributes: Vec<f32>,
    /// The entry of the codebook of SH residuals, if there is one.
    pub(crate) entry: Option<i32>,
}
