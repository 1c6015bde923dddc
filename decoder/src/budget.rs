//! How much of a machine a decoder may take, whatever the level of the stream allows.
//!
//! What a frame takes follows from its header and from the headers of its units. It is compared with the budget before
//! anything is allocated. A budget that is exhausted ends decoding.

use splatstream_format::payload::Increment;
use splatstream_format::syntax::{GopHeader, SequenceParameters};
use splatstream_format::{Limits, Result};

/// What a decoder may take. By default there is no bound but those of [`Limits`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Bytes that decoding holds at the same time, the frame that it hands out and its conversion to f32 included.
    pub memory: u64,
    /// Gaussians of all frames together.
    pub gaussians: u64,
    /// Bytes of all frames together as planes of f32.
    pub output: u64,
    /// Work on all frames together: values decoded, displaced, hashed or predicted. A core does some 10^8 in a second.
    pub work: u64,
}

impl Budget {
    /// No bound.
    pub const UNLIMITED: Self =
        Self { memory: u64::MAX, gaussians: u64::MAX, output: u64::MAX, work: u64::MAX };
}

impl Default for Budget {
    fn default() -> Self {
        Self::UNLIMITED
    }
}

/// What has been taken so far.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Spent {
    gaussians: u64,
    output: u64,
    work: u64,
    /// Gaussians of the largest frame of the GOP.
    largest: u32,
}

/// Bytes of a value.
const VALUE: u64 = 4;
/// Planes of a Gaussian that are not of spherical harmonics.
const PLANES: u64 = 13;
/// Bytes that a list keeps of a Gaussian besides its planes: fine positions and rotations, motion and fade, `anchor` and
/// identity.
const FRACTIONS: u64 = 24 + 16 + 1 + 4;
/// Bytes that a carried list keeps of a Gaussian by itself.
const CARRIED: u64 = 32;
/// Planes of modes, moves and predictors that a unit has besides those of its attributes.
const UNIT_PLANES: u64 = 5;
/// What buffers of blocks, tables and models may take: it does not grow with the frame.
const FIXED: u64 = 32 << 20;
/// Asking whether the memory is there is worth it above this: what Gaussians of small frames take besides is soon there, and
/// asking costs as much as decoding them.
const PROBED: u64 = FIXED + (16 << 20);

/// What the budget knows of a sequence.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape {
    planes: u64,
    layers: u64,
    /// Frames that are held besides those in progress.
    kept: u64,
    /// Frames that are in progress at the same time.
    at_once: u64,
    is_predicted: bool,
}

impl Shape {
    pub(crate) fn new(sequence: &SequenceParameters, gop: &GopHeader, ahead: bool) -> Self {
        let is_predicted = gop.is_predicted();
        let anchor = u64::from(sequence.whole_anchor());
        let kept = if is_predicted { u64::from(gop.temporal_depth).max(1).saturating_add(anchor) } else { 0 };
        let planes = PLANES.saturating_add(sequence.sh_dimension().into());
        let at_once = if ahead && is_predicted { 2 } else { 1 };
        Self { planes, layers: sequence.spatial_layer_count.into(), kept, at_once, is_predicted }
    }

    /// Bytes that decoding a frame takes at most, where the largest frame of its GOP has so many Gaussians.
    fn memory(&self, gaussians: u64) -> u64 {
        let of_planes = self.planes.saturating_mul(VALUE);
        let of_list = of_planes.saturating_add(FRACTIONS);
        let of_values = self.planes.saturating_add(UNIT_PLANES).saturating_mul(VALUE);
        let output = of_planes.saturating_add(VALUE);
        let shown = if self.is_predicted { self.at_once.saturating_add(1) } else { 1 };
        let held = match (self.is_predicted, self.layers) {
            (true, _) => {
                let frames = self.kept.saturating_add(self.at_once);
                let reference_set = of_planes.saturating_mul(3);
                let in_progress = of_values.saturating_add(reference_set).saturating_mul(self.at_once);
                frames.saturating_mul(of_list.saturating_add(CARRIED)).saturating_add(in_progress)
            }
            // Blocks go straight into planes.
            (false, 1) => 0,
            (false, _) => of_list.saturating_mul(3).saturating_add(of_values),
        };
        // What is shown is copied once, and becomes the output plane by plane.
        let shown = of_planes.saturating_mul(shown).saturating_add(output.saturating_mul(shown));
        held.saturating_add(shown).saturating_mul(gaussians).saturating_add(FIXED)
    }
}

impl Spent {
    /// A GOP begins.
    pub(crate) fn start_gop(&mut self) {
        self.largest = 0;
    }

    /// Takes what a frame of so many Gaussians needs; `at` is the offset of that number.
    ///
    /// # Errors
    /// Over the limit if the budget, or the machine, does not have it.
    pub(crate) fn frame(&mut self, gaussians: u32, shape: &Shape, budget: &Budget, at: u64) -> Result<()> {
        self.largest = self.largest.max(gaussians);
        let memory = shape.memory(self.largest.into());
        Limits::check(at, "memory in bytes", memory, budget.memory)?;
        let shown = u64::from(gaussians);
        self.gaussians = self.gaussians.saturating_add(shown);
        Limits::check(at, "Gaussians of the stream", self.gaussians, budget.gaussians)?;
        let bytes = shape.planes.saturating_add(1).saturating_mul(VALUE).saturating_mul(shown);
        self.output = self.output.saturating_add(bytes);
        Limits::check(at, "output in bytes", self.output, budget.output)?;
        let carried =
            if shape.is_predicted { u64::from(self.largest).saturating_mul(shape.planes) } else { 0 };
        self.work(carried, budget, at)?;
        // Without a bound the most that a frame may take says little about what it will.
        if budget.memory == u64::MAX { Ok(()) } else { probe(memory, at) }
    }

    /// Takes what a unit needs; `at` is the offset of its payload.
    ///
    /// # Errors
    /// As [`Spent::frame`].
    pub(crate) fn unit(
        &mut self,
        increment: &Increment<'_>,
        shape: &Shape,
        budget: &Budget,
        at: u64,
    ) -> Result<()> {
        let header = &increment.header;
        let [parents, new] = [header.parent_count, header.new_count].map(u64::from);
        let values = parents.saturating_add(new).saturating_mul(shape.planes.saturating_add(UNIT_PLANES));
        let neighbours = match header.predictor_count() {
            0 => 0,
            _ => u64::from(header.neighbour_count).saturating_mul(shape.planes),
        };
        self.work(values.saturating_add(new.saturating_mul(neighbours)), budget, at)
    }

    fn work(&mut self, work: u64, budget: &Budget, at: u64) -> Result<()> {
        self.work = self.work.saturating_add(work);
        Limits::check(at, "work in values", self.work, budget.work)
    }
}

/// Asks the machine for memory and gives it back: what it does not have is an error then, and no end of the process. Where a
/// program never gives memory back, asking would take it.
fn probe(bytes: u64, at: u64) -> Result<()> {
    if bytes < PROBED || cfg!(target_family = "wasm") {
        return Ok(());
    }
    let is_there =
        usize::try_from(bytes).is_ok_and(|bytes| Vec::<u8>::new().try_reserve_exact(bytes).is_ok());
    Limits::check(at, "memory of this machine", if is_there { 0 } else { bytes }, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATIC: Shape = Shape { planes: 58, layers: 1, kept: 0, at_once: 1, is_predicted: false };

    #[test]
    fn memory_is_refused_before_it_is_taken() {
        let budget = Budget { memory: 1 << 30, ..Budget::default() };
        let mut spent = Spent::default();
        assert_eq!(spent.frame(1 << 20, &STATIC, &budget, 7), Ok(()));
        let error = spent.frame(1 << 22, &STATIC, &budget, 7).unwrap_err();
        assert_eq!((error.at, error.kind.code()), (7, "OVER_LIMIT"));
        // The sizes of frames that refer to each other count together, those of other GOPs do not.
        assert!(spent.frame(1, &STATIC, &budget, 7).is_err());
        spent.start_gop();
        assert_eq!(spent.frame(1, &STATIC, &budget, 7), Ok(()));
    }

    #[test]
    fn what_frames_take_together_is_bounded() {
        let by_gaussians = Budget { gaussians: 100, ..Budget::default() };
        let by_output = Budget { output: 100 * 59 * 4, ..Budget::default() };
        for budget in [by_gaussians, by_output] {
            let mut spent = Spent::default();
            assert_eq!(spent.frame(99, &STATIC, &budget, 0), Ok(()));
            assert_eq!(spent.frame(1, &STATIC, &budget, 0), Ok(()));
            assert!(spent.frame(1, &STATIC, &budget, 0).is_err());
        }
    }

    #[test]
    fn memory_that_no_machine_has_is_an_error() {
        assert!(probe(u64::MAX, 0).is_err());
        assert_eq!(probe(0, 0), Ok(()));
    }
}
