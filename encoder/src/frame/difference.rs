//! Predicted frames: how far a Gaussian of the reference is from its partner, and what is sent of that.
#![expect(
    clippy::indexing_slicing,
    reason = "attributes are counted by what they index; stages are constants"
)]

use super::axis_matching::Pose;
use crate::vq;
use splatstream_format::payload::{Codebook, Transform};

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

    /// Whether it is farther away than this on some axis, in steps of moves, from where the partner was before something stayed.
    pub(crate) fn is_far(&self, stays: &Stays, most: f32) -> bool {
        let mut changes = self.position.iter().zip(stays.position).map(|(change, stays)| change - stays);
        changes.any(|change| (change / self.move_step).abs() > most)
    }

    /// Whether some attribute differs by more than this, in the steps that it is coded with, from what the partner had before
    /// something stayed.
    pub(crate) fn is_unlike(&self, stays: &Stays, most: f32) -> bool {
        let stays = stays.attributes.iter().copied().chain(core::iter::repeat(0.0));
        let changes = self.attributes.iter().zip(stays).map(|(change, stays)| change - stays);
        (0..).zip(changes).any(|(attribute, change)| (change / self.step_of(attribute)).abs() > most)
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

/// What stays of a difference of an earlier frame, in steps of the sequence: as in [`Apart`], but for sh, of which nothing does.
#[derive(Default)]
pub(crate) struct Stays {
    pub(crate) position: [f32; 3],
    pub(crate) attributes: Vec<f32>,
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

/// Differences in steps as components of a transform.
pub(crate) fn projected<'t>(
    transform: &'t Transform,
    differences: &'t [f32],
) -> impl Iterator<Item = f32> + 't {
    const UNIT: f32 = 4096.0;
    transform.rows().map(move |row| {
        row.iter().zip(differences).map(|(&weight, difference)| f32::from(weight) / UNIT * difference).sum()
    })
}
