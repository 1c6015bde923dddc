//! What a client may change while a stream is decoded: where it starts, the operating point, the end; and the budget.

use super::Decoder;
use super::frame::{DividedUnit, Refused};
use super::phase::Phase;
use crate::budget::Shape;
use crate::buffers::BufferPool;
use crate::frame_memory::FrameMemory;
use crate::interrupt::Interrupt;
use crate::operating_point::OperatingPoint;
use splatstream_format::syntax::UnitType;

impl Decoder {
    /// Forgets all but the sequence, what was spent of the budget included: the next unit is a gop_header anywhere in the stream, as for
    /// [`Decoder::starting_inside`].
    pub fn restart(&mut self) {
        let sequence = self.sequence.take();
        let phase = if sequence.is_some() { Phase::Sequence } else { Phase::Start };
        let tally = self.tally.restarted();
        *self = Self {
            starts_inside: true,
            phase,
            sequence,
            tally,
            wanted_point: self.wanted_point,
            interrupt: self.interrupt.clone(),
            next_identity: self.next_identity,
            buffers: BufferPool::new(self.memory().clone()),
            ..Self::with(self.profile, self.options)
        };
    }

    /// Memory of frames: later ones are decoded to what is given back here.
    pub const fn memory(&self) -> &FrameMemory {
        &self.buffers.frames
    }

    /// Decodes to memory that others share.
    pub(crate) fn set_memory(&mut self, memory: FrameMemory) {
        self.buffers.frames = memory;
    }

    /// Takes the units of another operating point from the next GOP on. Where it is lower on some axis, it holds there from
    /// the next frame on that has not been decoded yet: one may be, if frames are decoded [ahead](super::Options::ahead).
    pub fn set_operating_point(&mut self, point: OperatingPoint) {
        self.wanted_point = point;
    }

    /// The operating point that was in force where the frame that has ended last started.
    pub const fn frame_point(&self) -> OperatingPoint {
        self.frame_point
    }

    /// Lets another thread end decoding: once it has been requested, no frame is given any more.
    pub fn set_interrupt(&mut self, interrupt: Interrupt) {
        self.interrupt = interrupt.of_decoder();
    }

    /// Changes the operating point where it may change.
    pub(super) fn follow_point(&mut self, unit_type: UnitType) {
        let point = &mut self.options.operating_point;
        match unit_type {
            UnitType::GopHeader => *point = self.wanted_point,
            UnitType::FrameHeader => *point = point.at_most(self.wanted_point),
            _ => {}
        }
    }

    /// Takes what a unit needs from the budget.
    pub(super) fn spend<'u>(
        &mut self,
        divided: Option<DividedUnit<'u>>,
        limit: u8,
    ) -> core::result::Result<Option<DividedUnit<'u>>, Refused> {
        let (Some(shape), Some(unit)) = (self.shape(), &divided) else { return Ok(divided) };
        match self.spent.unit(&unit.increment, &shape, &self.options.budget, unit.payload_at) {
            Ok(()) => Ok(divided),
            Err(error) => {
                self.is_exhausted = true;
                Err(Refused { error, limit })
            }
        }
    }

    /// What the budget needs to know of the GOP in progress.
    fn shape(&self) -> Option<Shape> {
        let ((sequence, _), gop) = (self.sequence.as_ref()?, self.gop.as_ref()?);
        Some(Shape::new(sequence, &gop.header, self.options.ahead))
    }
}
