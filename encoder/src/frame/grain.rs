//! How finely units code.

use crate::laws::Laws;
use crate::steps::Steps;
use splatstream_format::syntax::{MAX_ATTRIBUTE_STEP, MAX_REFINEMENTS, SequenceParameters};

/// How finely a unit codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Grain {
    /// Low bits of positions that are left out.
    pub(crate) position_shift: u8,
    /// Exponents of the steps of log_scale, opacity, rotation, dc, sh.
    pub(crate) attribute_step: [u8; 5],
}

impl Grain {
    /// How finely changes are coded of what is coded like this: moves with half of the step, since what moves a little is seen to move, and
    /// rotations half an octave finer.
    pub(crate) fn of_changes(mut self) -> Self {
        let [_, _, rotation, ..] = &mut self.attribute_step;
        *rotation = rotation.saturating_sub(1);
        Self { position_shift: self.position_shift.saturating_sub(1), ..self }
    }

    /// With steps twice as long, as far as a stream has them.
    pub(crate) fn an_octave_coarser(self, position_bits: u8) -> Self {
        Self {
            position_shift: self.position_shift.saturating_add(1).min(position_bits.saturating_sub(1)),
            attribute_step: self.attribute_step.map(|step| step.saturating_add(2).min(MAX_ATTRIBUTE_STEP)),
        }
    }
}

/// How finely the refinements of a sequence are coded.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Grains([Grain; MAX_REFINEMENTS as usize]);

impl Grains {
    /// As laws and steps ask for.
    pub(crate) fn new(laws: &Laws, steps: &Steps, sequence: &SequenceParameters) -> Self {
        let mut grains = Self::default();
        for (refinement, grain) in (0..).zip(&mut grains.0) {
            *grain = Grain {
                position_shift: laws.position_shift(sequence, refinement),
                attribute_step: laws.attribute_step(steps, sequence, refinement),
            };
        }
        grains
    }

    /// Of a refinement.
    #[expect(clippy::indexing_slicing, reason = "settings have at most MAX_REFINEMENTS refinements")]
    pub(crate) fn of(&self, refinement: u8) -> Grain {
        self.0[usize::from(refinement)]
    }
}
