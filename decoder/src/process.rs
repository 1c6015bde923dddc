//! Clause 7.1: the state of a decoder and what each unit does to it; clause 9: what errors cost.
//!
//! For each unit: its header is checked; a unit that does not belong to the operating point is discarded; the table of
//! `phase` says whether it may come now; it may end the frame and the GOP in progress; then its payload takes effect.
//! What an error costs follows from the unit alone: its list, the unit, or the rest of the GOP. After the last kind units
//! are discarded up to a gop_header from which decoding can go on.

use crate::budget::Spent;
use crate::buffers::BufferPool;
use crate::interrupt::Interrupt;
use crate::operating_point::{OperatingPoint, Tally};
use ahead::Ready;
use core::ops::RangeInclusive;
use frame::{Context, FrameInProgress, Refused};
use phase::{Phase, ends_frame, ends_gop, is_layered, unexpected};
use references::References;
use report::Report;
use spares::Spares;
use splatstream_format::payload::SceneDescription;
use splatstream_format::syntax::{
    ErrorScope, FileHeader, GopHeader, Profile, SequenceParameters, UnitHeader, UnitType,
};
use splatstream_format::unit::{Landmark, Unit};
use splatstream_format::{Class, Error, Limits, Result};
use std::collections::VecDeque;

mod ahead;
mod applying;
mod closing;
mod control;
mod decoded;
mod decoding;
mod ending;
mod frame;
mod gops;
mod lists;
mod options;
mod phase;
mod references;
mod report;
mod spares;
mod trailer;

pub use crate::budget::Budget;
pub use crate::entropy_state::UnitEntropy;
pub use crate::gop::{Gop, Transforms};
pub use crate::shift::Shift;
pub use decoded::{Compensation, DecodedFrame};
pub use options::Options;

/// What ends a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FrameEnd {
    /// A unit that may end it, at this offset.
    Unit(u64),
    /// Its last unit.
    Complete,
    /// An error, or the end of the bytes.
    Cut,
}

/// What has been counted of the stream, to be compared with what it says about itself.
#[derive(Default)]
struct Counted {
    units: u32,
    frame_headers: u32,
    /// First frame and offset of every gop_header.
    gops: Vec<(u32, u64)>,
    index_offset: Option<u64>,
}

/// Decodes a stream unit by unit.
pub struct Decoder {
    options: Options,
    /// The operating point that is wanted from the next GOP on, and in this one if it is lower.
    wanted_point: OperatingPoint,
    /// That of the frame that has ended last.
    frame_point: OperatingPoint,
    interrupt: Interrupt,
    /// Memory of tasks that decode blocks.
    buffers: BufferPool,
    spent: Spent,
    /// Whether the budget does not suffice.
    is_exhausted: bool,
    /// The identity of the next new Gaussian.
    next_identity: u32,
    profile: Profile,
    /// Whether the units before the first gop_header are not known (B.3).
    starts_inside: bool,
    phase: Phase,
    /// The first sequence parameters, and their bytes: copies are the same.
    sequence: Option<(SequenceParameters, Vec<u8>)>,
    gop: Option<Gop>,
    frame: Option<FrameInProgress>,
    /// A frame that has all its units and waits to be decoded beside the one after it.
    waiting: Option<FrameInProgress>,
    /// Frames that have ended and are to be handed out.
    ready: VecDeque<Ready>,
    references: References,
    /// Of the frames that have ended, one for each that is decoded at a time.
    spares: Vec<Spares>,
    /// The least `gop_index` of the next GOP.
    next_gop: u64,
    /// The least display index of the next frame.
    next_frame: u64,
    /// Display indices of this GOP from `next_frame` on.
    frames_left: u64,
    report: Report,
    has_stopped: bool,
    counted: Counted,
    /// Whether a scene_description came in phase SEQUENCE, with a fault or without.
    has_scene: bool,
    /// The scene description, if one has come without a fault.
    scene: Option<Box<SceneDescription>>,
    /// Whether some unit did not belong to the operating point.
    has_discarded: bool,
    tally: Tally,
}

impl Decoder {
    /// A decoder for the stream with this file header.
    pub fn new(file: &FileHeader, options: Options) -> Self {
        let limits = options.limits.at_most(Limits::of_level(file.level));
        Self::with(file.profile(), Options { limits, ..options })
    }

    fn with(profile: Profile, options: Options) -> Self {
        Self {
            wanted_point: options.operating_point,
            frame_point: options.operating_point,
            interrupt: Interrupt::default(),
            buffers: BufferPool::default(),
            spent: Spent::default(),
            is_exhausted: false,
            next_identity: 0,
            options,
            profile,
            starts_inside: false,
            phase: Phase::Start,
            sequence: None,
            gop: None,
            frame: None,
            waiting: None,
            ready: VecDeque::new(),
            references: References::default(),
            spares: Vec::new(),
            next_gop: 0,
            next_frame: 0,
            frames_left: 0,
            report: Report::default(),
            has_stopped: false,
            counted: Counted::default(),
            has_scene: false,
            scene: None,
            has_discarded: false,
            tally: Tally::new(profile),
        }
    }

    /// Clause B.3: a decoder that is given the sequence parameters and then the units from any gop_header on.
    /// What relates to the start of the stream is not checked.
    pub fn starting_inside(file: &FileHeader, options: Options) -> Self {
        Self { starts_inside: true, ..Self::new(file, options) }
    }

    /// The sequence parameters, once they have come.
    pub fn sequence(&self) -> Option<&SequenceParameters> {
        self.sequence.as_ref().map(|(sequence, _)| sequence)
    }

    /// The transforms and codebooks of the current GOP.
    pub fn gop(&self) -> Option<&Gop> {
        self.gop.as_ref()
    }

    /// The errors so far, in stream order: the first is the verdict.
    pub fn errors(&self) -> &[Error] {
        &self.report.errors
    }

    /// Display indices of frames that were lost and are not output.
    pub fn lost(&self) -> &[RangeInclusive<u32>] {
        &self.report.lost
    }

    /// Takes the errors and the lost frames since the last call: what a stream of any length leaves need not be kept.
    pub fn take_report(&mut self) -> (Vec<Error>, Vec<RangeInclusive<u32>>) {
        self.report.take()
    }

    /// Whether units change nothing any more.
    pub fn has_stopped(&self) -> bool {
        self.has_stopped || self.interrupt.is_requested() || self.phase == Phase::Ended
    }

    /// Whether an error that ends decoding has been found: the first one of all if decoding stops there, one of the budget, or
    /// a [fault](Error::is_fault) of the decoder, whose state is worth nothing then.
    pub const fn has_failed(&self) -> bool {
        self.has_stopped
    }

    /// What to look for where the end of a unit is not known.
    pub const fn wanted(&self) -> Landmark {
        if self.sequence.is_none() { Landmark::SequenceParameters } else { Landmark::GopHeader }
    }

    /// Takes the next unit; gives the frame that it ends or completes, if it does. More may be [ready](Self::next_ready) then.
    pub fn unit(&mut self, unit: &Unit<'_>) -> Option<DecodedFrame> {
        let done = self.taken(unit);
        self.in_order(done)
    }

    fn taken(&mut self, unit: &Unit<'_>) -> Option<DecodedFrame> {
        self.counted.units = self.counted.units.saturating_add(1);
        if self.has_stopped() || self.phase == Phase::Lost && !self.wants(unit) {
            return None;
        }
        self.follow_point(unit.header.unit_type());
        let scope = unit.header.error_scope();
        if scope == ErrorScope::List {
            self.increment(unit);
            return self.finish_complete();
        }
        let (done, taken) = self.take(unit);
        self.has_scene |=
            self.phase == Phase::Sequence && unit.header.unit_type() == UnitType::SceneDescription;
        match taken {
            Ok(()) => done,
            Err(error) => self.fail(error, scope).or(done),
        }
    }

    /// Takes the error of bytes in which no unit could be delimited; gives the frame that this ends, if it does.
    pub fn unreadable(&mut self, error: Error) -> Option<DecodedFrame> {
        let done = match self.phase {
            Phase::Lost => None,
            Phase::Ended => {
                self.report(error);
                None
            }
            _ => self.fail(error, ErrorScope::Gop),
        };
        self.in_order(done)
    }

    /// Ends the frame in progress: no more units will come.
    pub fn finish(&mut self) -> Option<DecodedFrame> {
        let done = self.close_frame(FrameEnd::Cut);
        self.in_order(done)
    }

    /// A unit that is no increment: the frame that it ends, and whether it took effect.
    fn take(&mut self, unit: &Unit<'_>) -> (Option<DecodedFrame>, Result<()>) {
        let unit_type = unit.header.unit_type();
        let header = unit.check_header(self.profile);
        if header.is_err() || !unit_type.is_known() {
            return (None, header);
        }
        if is_layered(unit_type) && self.phase.is_in_gop() && !self.belongs(&unit.header) {
            self.discard(unit_type);
            return (None, Ok(()));
        }
        let is_surplus = match unit_type {
            UnitType::FrameHeader => self.frames_left == 0,
            UnitType::SceneDescription => self.has_scene,
            _ => false,
        };
        if is_surplus || !self.phase.allows(unit_type) {
            return (None, Err(unexpected(unit)));
        }
        let goes_beside = unit_type == UnitType::FrameHeader && self.is_waiting();
        let done = match ends_frame(unit_type) && !goes_beside {
            true => self.close_frame(FrameEnd::Unit(unit.at)),
            false => None,
        };
        if ends_gop(unit_type) {
            self.close_gop(unit.at);
        }
        if self.has_stopped {
            return (done, Ok(()));
        }
        let was_lost = self.phase == Phase::Lost;
        self.phase = self.phase.after(unit_type);
        self.tally.unit(unit);
        (done, self.content(unit, was_lost))
    }

    /// The payload of a unit that may come.
    fn content(&mut self, unit: &Unit<'_>, was_lost: bool) -> Result<()> {
        if let Some((sequence, _)) = &self.sequence {
            unit.header.validate_layers(unit.at, sequence)?;
        }
        unit.check_payload()?;
        match unit.header.unit_type() {
            UnitType::SequenceParameters => self.sequence_parameters(unit),
            UnitType::SceneDescription => self.scene_description(unit),
            UnitType::GopHeader => self.gop_header(unit, was_lost),
            UnitType::Transform | UnitType::Codebook | UnitType::Weights => self.gop_tool(unit),
            UnitType::FrameHeader => {
                self.counted.frame_headers = self.counted.frame_headers.saturating_add(1);
                self.frame_header(unit)
            }
            UnitType::OperatingPoints => self.operating_points(unit),
            UnitType::Index => self.index(unit),
            UnitType::End => self.end(unit),
            UnitType::Increment | UnitType::Reserved(_) | UnitType::User(_) => Ok(()),
        }
    }

    /// An increment. An error costs its list, or nothing if it is not of the frame in progress.
    fn increment(&mut self, unit: &Unit<'_>) {
        if let Some(frame) = self.frame.as_mut().filter(|frame| frame.index == unit.header.frame) {
            frame.seen = true;
        }
        if let Err(error) = unit.check_header(self.profile) {
            self.report(error);
            return;
        }
        if self.phase.is_in_gop() && !self.belongs(&unit.header) {
            self.discard(UnitType::Increment);
            return;
        }
        if self.is_waiting() {
            // The unit is of no frame, or one too many.
            self.settle();
        }
        if self.phase != Phase::Frame {
            self.report(unexpected(unit));
            return;
        }
        self.tally.unit(unit);
        // The state may include units that are still to be decoded: an error counts if it remains once they have been.
        if self.accept(unit).is_ok() {
            return;
        }
        self.settle();
        if let Err(refused) = self.accept(unit) {
            if let Some(frame) = &mut self.frame {
                frame.fail(&refused);
            }
            self.report(refused.error);
        }
    }

    fn accept(&mut self, unit: &Unit<'_>) -> core::result::Result<(), Refused> {
        let Some(mut frame) = self.frame.take() else { return Ok(()) };
        let accepted = match self.context(frame.reference) {
            Some(context) => frame.accept(unit, &context),
            None => Ok(None),
        };
        let accepted = accepted.and_then(|divided| self.spend(divided, frame.expected.limit));
        let accepted =
            accepted.map(|divided| divided.iter().for_each(|divided| frame.push(divided, unit.payload)));
        self.frame = Some(frame);
        accepted
    }

    /// What stands around a frame whose reference frame is kept in a temporal layer.
    fn context(&self, reference: Option<usize>) -> Option<Context<'_>> {
        let (Some((sequence, _)), Some(gop)) = (&self.sequence, &self.gop) else { return None };
        let reference = reference.and_then(|layer| self.references.get(layer));
        let Self { options, interrupt, buffers, profile, .. } = self;
        Some(Context { options, interrupt, buffers, profile: *profile, sequence, gop, reference })
    }

    /// Whether a unit belongs to the operating point (7.2).
    fn belongs(&self, header: &UnitHeader) -> bool {
        self.tally.takes(self.options.operating_point, header)
    }

    /// Counts a unit that does not belong to the operating point.
    fn discard(&mut self, unit_type: UnitType) {
        self.has_discarded = true;
        let is_frame = unit_type == UnitType::FrameHeader;
        self.counted.frame_headers = self.counted.frame_headers.saturating_add(is_frame.into());
    }

    /// Reports an error, after those of the units before it.
    fn report(&mut self, error: Error) {
        self.settle();
        self.add(error);
    }

    fn add(&mut self, error: Error) {
        self.has_stopped |= self.interrupt.is_requested();
        if self.has_stopped {
            return;
        }
        if let Some(frame) = &mut self.frame {
            frame.error.get_or_insert(error);
        }
        self.report.errors.push(error);
        let is_limit = error.class() == Class::OverLimit;
        self.has_stopped =
            self.options.stop_at_first_error || self.is_exhausted && is_limit || error.is_fault();
    }

    /// Reports the error of a unit that is no increment, and takes what it costs; gives the frame that it ends, if it does.
    fn fail(&mut self, error: Error, scope: ErrorScope) -> Option<DecodedFrame> {
        if scope != ErrorScope::Gop {
            self.report(error);
            return None;
        }
        let frame = self.close_frame(FrameEnd::Cut);
        self.add(error);
        let end = self.next_frame.saturating_add(self.frames_left);
        self.report.lose(self.next_frame, end);
        (self.next_frame, self.frames_left) = (end, 0);
        self.phase = Phase::Lost;
        frame.filter(|_| !self.has_stopped)
    }

    /// In the lost state: whether a unit is not discarded (7.1.6).
    fn wants(&self, unit: &Unit<'_>) -> bool {
        let has_reserved = unit.header.unit_flags > 1 || unit.header.reserved_zero != 0;
        let is_intact = |size| !has_reserved && unit.payload.len() == size && unit.check_payload().is_ok();
        match (unit.header.unit_type(), self.sequence.is_some()) {
            (UnitType::SequenceParameters, false) => is_intact(SequenceParameters::SIZE),
            (UnitType::GopHeader, true) => is_intact(GopHeader::SIZE) && self.is_acceptable(unit),
            (UnitType::OperatingPoints | UnitType::Index | UnitType::End, has_sequence) => has_sequence,
            _ => false,
        }
    }

    /// Whether a gop_header starts nothing that was there before.
    fn is_acceptable(&self, unit: &Unit<'_>) -> bool {
        let gop_index = unit.payload.first_chunk().copied().map_or(0, u32::from_le_bytes);
        u64::from(gop_index) >= self.next_gop && u64::from(unit.header.frame) >= self.next_frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_format::ErrorKind;

    #[test]
    fn a_fault_of_the_decoder_ends_decoding_and_an_error_of_the_stream_does_not() {
        let decoder = || Decoder::with(Profile::Dynamic, Options::default());
        let (mut wrong, mut faulty) = (decoder(), decoder());
        wrong.add(Error::new(0, "6.5", ErrorKind::Signature));
        faulty.add(Error::fault("one length"));
        assert_eq!((wrong.has_failed(), faulty.has_failed()), (false, true));
        assert!(faulty.errors()[0].is_fault());
    }
}
