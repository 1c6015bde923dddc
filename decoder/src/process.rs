//! Clause 7.1: the state of a decoder and what each unit does to it.

use crate::digest::{UnitDigest, frame_digest, unit_digest};
use crate::frame::QuantizedFrame;
use crate::gop::Gop;
use crate::operating_point::OperatingPoint;
use crate::unit::{CodedUnit, decode_units};
use splatstream_format::payload::{Index, Refinement};
use splatstream_format::syntax::{
    EndOfStream, FileHeader, FrameHeader, GopHeader, IndexEntry, IndexHeader, RefinementHeader,
    SequenceParameters, Table, UnitHeader, UnitType,
};
use splatstream_format::unit::Unit;
use splatstream_format::{Error, ErrorKind, Limits, Result};

/// How to decode.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// What is accepted at most.
    pub limits: Limits,
    /// Compare every frame with the digest in the stream.
    pub verify: bool,
    /// The units to take.
    pub operating_point: OperatingPoint,
    /// Show a frame of which a refinement unit is damaged at the refinement before, instead of giving up.
    pub tolerant: bool,
}

impl Default for Options {
    fn default() -> Self {
        let operating_point = OperatingPoint::ALL;
        Self { limits: Limits::default(), verify: true, operating_point, tolerant: false }
    }
}

/// One frame as far as its units were there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecodedFrame {
    /// Display index.
    pub number: u32,
    /// The integer planes.
    pub planes: QuantizedFrame,
    /// Refinement units decoded.
    pub refinements: u8,
    /// Digest of the planes, clause 7.9; none if it was not asked for.
    pub digest: Option<u64>,
    /// Bytes of the frame's units that were decoded, headers included.
    pub bytes: u64,
    /// Why the refinement after the last decoded one was lost, if it was.
    pub lost: Option<Error>,
}

/// A frame whose units are still arriving.
struct PendingFrame<'a> {
    number: u32,
    header: FrameHeader,
    units: Vec<PendingUnit<'a>>,
    bytes: u64,
    lost: Option<Error>,
    /// Whether a refinement unit stood in the stream, decoded or not.
    has_unit: bool,
}

struct PendingUnit<'a> {
    refinement: Refinement<'a>,
    payload_at: u64,
    bytes: u64,
}

/// Decodes a stream unit by unit.
pub struct Decoder<'a> {
    options: Options,
    level: u8,
    /// Whether the units before the first GOP header are not known (B.3).
    starts_inside: bool,
    sequence: Option<(SequenceParameters, &'a [u8])>,
    gop: Option<Gop>,
    frame: Option<PendingFrame<'a>>,
    /// A frame that was complete when the unit after it turned out wrong.
    finished: Option<DecodedFrame>,
    frames: u32,
    units: u32,
    /// First frame and offset of every GOP header so far: what an index shall hold.
    gops: Vec<(u32, u64)>,
    index_offset: Option<u64>,
    ended: bool,
}

impl<'a> Decoder<'a> {
    /// A decoder for the stream with this file header.
    pub fn new(file: &FileHeader, options: Options) -> Self {
        Self {
            options,
            level: file.level,
            starts_inside: false,
            sequence: None,
            gop: None,
            frame: None,
            finished: None,
            frames: 0,
            units: 0,
            gops: Vec::new(),
            index_offset: None,
            ended: false,
        }
    }

    /// Clause B.3: a decoder that is given the sequence parameters and then the units from any GOP header on.
    /// What relates to the start of the stream is not checked.
    pub fn starting_inside(file: &FileHeader, options: Options) -> Self {
        Self { starts_inside: true, ..Self::new(file, options) }
    }

    /// The sequence parameters, once they have arrived.
    pub fn sequence(&self) -> Option<&SequenceParameters> {
        self.sequence.as_ref().map(|(sequence, _)| sequence)
    }

    /// The transforms and codebooks of the current GOP.
    pub fn gop(&self) -> Option<&Gop> {
        self.gop.as_ref()
    }

    /// Takes the next unit; gives the frame that it completes, if it does.
    ///
    /// # Errors
    /// What the clause of the unit says; the decoder is of no further use then, unless it is tolerant and the
    /// unit was a refinement, which is not an error then.
    pub fn unit(&mut self, unit: &Unit<'a>) -> Result<Option<DecodedFrame>> {
        let header = &unit.header;
        let unit_type = header.unit_type();
        if !unit_type.is_known() {
            self.units = self.units.wrapping_add(1);
            return Ok(None);
        }
        let repeatable = unit_type == UnitType::SequenceParameters;
        let indexed = self.index_offset.is_some() && unit_type != UnitType::End;
        let surplus = unit_type == UnitType::FrameHeader && self.frames_left() == 0;
        if self.ended || surplus || !repeatable && (self.sequence.is_none() || indexed) {
            return Err(unexpected(unit));
        }
        let done = match unit_type {
            UnitType::SequenceParameters => self.sequence_parameters(unit).map(|()| None),
            UnitType::GopHeader => self.closing(unit, Self::gop_header),
            UnitType::Transform | UnitType::Codebook => self.gop_tool(unit).map(|()| None),
            UnitType::FrameHeader => self.closing(unit, Self::frame_header),
            UnitType::Refinement => self.refinement(unit).map(|()| None),
            UnitType::Index => self.closing(unit, Self::index),
            UnitType::End => self.closing(unit, Self::end),
            UnitType::Reserved(_) | UnitType::User(_) => Ok(None),
        };
        self.units = self.units.wrapping_add(1);
        done
    }

    /// Takes note of a unit whose payload is damaged.
    ///
    /// # Errors
    /// The damage itself, unless the decoder is tolerant and the unit is a refinement.
    pub fn damaged(&mut self, header: &UnitHeader, error: Error) -> Result<()> {
        self.units = self.units.wrapping_add(1);
        match &mut self.frame {
            Some(frame) if header.unit_type() == UnitType::Refinement => {
                frame.has_unit = true;
                if !self.options.operating_point.takes(header) || frame.lost.is_some() {
                    return Ok(());
                }
                frame.lost = Some(error);
                if self.options.tolerant { Ok(()) } else { Err(error) }
            }
            _ => Err(error),
        }
    }

    /// The frame before an error if it was complete; if the decoder is tolerant, also one that was still arriving.
    ///
    /// # Errors
    /// As [`Decoder::unit`].
    pub fn cut(&mut self) -> Result<Option<DecodedFrame>> {
        match self.finished.take() {
            Some(frame) => Ok(Some(frame)),
            None => {
                let frame = self.close_frame(None)?;
                Ok(frame.filter(|_| self.options.tolerant))
            }
        }
    }

    /// Decodes the pending frame, then lets the unit that follows it act.
    fn closing(
        &mut self,
        unit: &Unit<'a>,
        act: impl FnOnce(&mut Self, &Unit<'a>) -> Result<()>,
    ) -> Result<Option<DecodedFrame>> {
        let done = self.close_frame(Some(unit.at))?;
        match act(self, unit) {
            Ok(()) => Ok(done),
            Err(error) => {
                self.finished = done;
                Err(error)
            }
        }
    }

    fn sequence_parameters(&mut self, unit: &Unit<'a>) -> Result<()> {
        let sequence = SequenceParameters::parse_payload(unit.payload, unit.payload_at)?;
        match &self.sequence {
            None => {
                self.sequence = Some((sequence, unit.payload));
                Ok(())
            }
            Some((_, first)) if *first == unit.payload => Ok(()),
            Some(_) => {
                let rule = "a stream has one set of sequence parameters";
                Err(Error::new(unit.payload_at, "6.4", ErrorKind::Constraint { rule }))
            }
        }
    }

    fn gop_header(&mut self, unit: &Unit<'a>) -> Result<()> {
        self.close_gop(unit.at)?;
        let starts_here = self.starts_inside && self.gop.is_none();
        if starts_here {
            self.frames = unit.header.frame;
        }
        same(frame_at(unit), "6.5", "frame", unit.header.frame, self.frames)?;
        let header = GopHeader::parse_payload(unit.payload, unit.payload_at)?;
        let expected = self.gop.as_ref().map_or(0, |gop| gop.header.gop_index.wrapping_add(1));
        let expected = if starts_here { header.gop_index } else { expected };
        same(unit.payload_at, "6.5", "gop_index", header.gop_index, expected)?;
        header.validate_from(unit.payload_at, self.frames)?;
        self.gops.push((self.frames, unit.at));
        self.gop = Some(Gop::new(header, self.frames));
        Ok(())
    }

    /// Frames of the GOP still to come.
    fn frames_left(&self) -> u32 {
        let Some(gop) = &self.gop else { return 0 };
        gop.header.gop_frame_count.wrapping_sub(self.frames.wrapping_sub(gop.first_frame))
    }

    /// Checks that the GOP has the frames it announced.
    fn close_gop(&self, at: u64) -> Result<()> {
        let Some(gop) = &self.gop else { return Ok(()) };
        let frames = self.frames.wrapping_sub(gop.first_frame);
        same(at, "6.5", "gop_frame_count", gop.header.gop_frame_count, frames)
    }

    fn gop_tool(&mut self, unit: &Unit<'a>) -> Result<()> {
        let (Some(gop), Some((sequence, _)), None) = (&mut self.gop, &self.sequence, &self.frame) else {
            return Err(unexpected(unit));
        };
        same(frame_at(unit), "6.3", "frame", unit.header.frame, gop.first_frame)?;
        gop.tool(unit, sequence, &self.options.limits)
    }

    fn frame_header(&mut self, unit: &Unit<'a>) -> Result<()> {
        let Some(gop) = &self.gop else { return Err(unexpected(unit)) };
        same(frame_at(unit), "6.6", "frame", unit.header.frame, self.frames)?;
        let header = FrameHeader::parse_payload(unit.payload, unit.payload_at)?;
        gop.transforms(&header, unit.payload_at)?;
        let most = self.options.limits.max_gaussians.min(Limits::gaussians_of_level(self.level));
        header.within(unit.payload_at, &Limits { max_gaussians: most, ..self.options.limits })?;
        let bytes = unit_bytes(unit);
        let number = unit.header.frame;
        let units = Vec::new();
        self.frame = Some(PendingFrame { number, header, units, bytes, lost: None, has_unit: false });
        self.frames = self.frames.wrapping_add(1);
        Ok(())
    }

    fn refinement(&mut self, unit: &Unit<'a>) -> Result<()> {
        let takes = self.options.operating_point.takes(&unit.header);
        let Some(frame) = &mut self.frame else { return Err(unexpected(unit)) };
        frame.has_unit = true;
        if !takes || frame.lost.is_some() {
            return Ok(());
        }
        let number = frame.number;
        if unit.header.frame != number && self.has_lost()? {
            return Ok(());
        }
        same(frame_at(unit), "6.9", "frame", unit.header.frame, number)?;
        let (Some(frame), Some((sequence, _)), Some(gop)) = (&mut self.frame, &self.sequence, &self.gop)
        else {
            return Err(unexpected(unit));
        };
        let expected = frame.units.len();
        let parsed = if usize::from(unit.header.refinement) != expected
            || unit.header.refinement >= sequence.refinement_count
        {
            Err(unexpected(unit))
        } else {
            parse_refinement(unit, sequence, &frame.header, gop)
        };
        match parsed {
            Ok(refinement) => {
                let bytes = unit_bytes(unit);
                frame.units.push(PendingUnit { refinement, payload_at: unit.payload_at, bytes });
                Ok(())
            }
            Err(error) if self.options.tolerant => {
                frame.lost = Some(error);
                Ok(())
            }
            Err(error) => Err(error),
        }
    }

    fn index(&mut self, unit: &Unit<'a>) -> Result<()> {
        self.close_gop(unit.at)?;
        if !self.starts_inside {
            let (header, _) = IndexHeader::parse(unit.payload, unit.payload_at)?;
            let gops = u32::try_from(self.gops.len()).unwrap_or(u32::MAX);
            same(unit.payload_at, "6.10", "entry_count", header.entry_count, gops)?;
        }
        let index = Index::parse(unit.payload, unit.payload_at)?;
        let mut at = after(unit.payload_at, IndexHeader::SIZE);
        for (entry, &(frame, offset)) in index.entries.iter().zip(&self.gops) {
            if self.starts_inside {
                break;
            }
            same(at, "6.10", "frame", entry.frame, frame)?;
            same(element_at(&IndexEntry::TABLE, at, "offset"), "6.10", "offset", entry.offset, offset)?;
            at = after(at, IndexEntry::SIZE);
        }
        self.index_offset = Some(unit.at);
        Ok(())
    }

    fn end(&mut self, unit: &Unit<'a>) -> Result<()> {
        self.close_gop(unit.at)?;
        let end = EndOfStream::parse_payload(unit.payload, unit.payload_at)?;
        let expected = EndOfStream {
            frame_count: self.frames,
            unit_count: self.units,
            index_offset: self.index_offset.unwrap_or(0),
        };
        self.ended = true;
        if self.starts_inside {
            return Ok(());
        }
        end.validate_against(unit.payload_at, &expected)?;
        let announced = self.sequence().map_or(0, |sequence| sequence.frame_count);
        if announced != 0 {
            same(unit.payload_at, "6.4", "frame_count", self.frames, announced)?;
        }
        Ok(())
    }

    /// Ends the pending frame; `at` is the offset of the unit that ends it, if a unit does.
    fn close_frame(&mut self, at: Option<u64>) -> Result<Option<DecodedFrame>> {
        let Some(mut frame) = self.frame.take() else { return Ok(None) };
        if let (Some(at), false) = (at, frame.has_unit) {
            let rule = "a frame has a refinement unit";
            let error = Error::new(at, "7.1", ErrorKind::Constraint { rule });
            if !self.options.tolerant {
                return Err(error);
            }
            frame.lost = Some(error);
        }
        self.decode(&frame)
    }

    /// Decodes the pending frame as far as it is there: whether a unit of it is lost, so that later ones are not
    /// looked at. Blocks are not decoded when they arrive; an error that ends decoding asks for it.
    fn has_lost(&mut self) -> Result<bool> {
        let decoded = self.frame.as_ref().map_or(Ok(None), |frame| self.decode(frame))?;
        if let (Some(frame), Some(decoded)) = (&mut self.frame, decoded) {
            frame.units.truncate(usize::from(decoded.refinements));
            frame.lost = decoded.lost;
        }
        Ok(self.frame.as_ref().is_some_and(|frame| frame.lost.is_some()))
    }

    fn decode(&self, frame: &PendingFrame<'a>) -> Result<Option<DecodedFrame>> {
        let (Some(gop), Some((sequence, _))) = (&self.gop, &self.sequence) else { return Ok(None) };
        let coded: Vec<CodedUnit<'_, '_>> = frame
            .units
            .iter()
            .map(|unit| CodedUnit { refinement: &unit.refinement, payload_at: unit.payload_at })
            .collect();
        let tools = gop.transforms(&frame.header, 0)?;
        let (planes, results) = decode_units(&coded, gop, tools, sequence);
        self.assemble(frame, planes, results).map(Some)
    }

    /// Checks the units of a frame, and cuts the planes before the first that failed.
    fn assemble(
        &self,
        frame: &PendingFrame<'a>,
        planes: QuantizedFrame,
        results: Vec<Result<usize>>,
    ) -> Result<DecodedFrame> {
        let mut decoded = DecodedFrame {
            number: frame.number,
            planes,
            refinements: 0,
            digest: None,
            bytes: frame.bytes,
            lost: frame.lost,
        };
        let mut digests: Vec<UnitDigest> = Vec::new();
        let mut gaussians = 0_usize;
        for (unit, result) in frame.units.iter().zip(results) {
            let checked = result.and_then(|count| {
                let end = gaussians.wrapping_add(count);
                let digest = self.check_digest(unit, &decoded.planes, gaussians..end, &mut digests)?;
                Ok((end, digest))
            });
            match checked {
                Ok((end, digest)) => {
                    gaussians = end;
                    decoded.digest = digest;
                    decoded.refinements = decoded.refinements.wrapping_add(1);
                    decoded.bytes = decoded.bytes.wrapping_add(unit.bytes);
                }
                Err(error) if self.options.tolerant => {
                    decoded.lost = Some(error);
                    break;
                }
                Err(error) => return Err(error),
            }
        }
        decoded.planes.truncate(gaussians);
        Ok(decoded)
    }

    fn check_digest(
        &self,
        unit: &PendingUnit<'_>,
        planes: &QuantizedFrame,
        gaussians: core::ops::Range<usize>,
        digests: &mut Vec<UnitDigest>,
    ) -> Result<Option<u64>> {
        if !self.options.verify {
            return Ok(None);
        }
        digests.push(unit_digest(planes, gaussians));
        let computed = frame_digest(digests);
        let stored = unit.refinement.header.refinement_digest;
        if computed != stored {
            return Err(Error::new(unit.payload_at, "7.9", ErrorKind::Digest { stored, computed }));
        }
        Ok(Some(computed))
    }
}

fn parse_refinement<'a>(
    unit: &Unit<'a>,
    sequence: &SequenceParameters,
    frame: &FrameHeader,
    gop: &Gop,
) -> Result<Refinement<'a>> {
    let at = unit.payload_at;
    let (header, rest) = RefinementHeader::parse(unit.payload, at, sequence)?;
    let expected = sequence.refinement_length(unit.header.refinement, frame.gaussian_count);
    let count_at = element_at(&RefinementHeader::TABLE, at, "gaussian_count");
    same(count_at, "6.9", "gaussian_count", header.gaussian_count, expected)?;
    gop.colour(gop.transforms(frame, at)?, &header, at)?;
    Refinement::parse_behind(header, rest, at, sequence)
}

fn unexpected(unit: &Unit<'_>) -> Error {
    let name = unit.header.unit_type().name();
    Error::new(unit.at, "7.1", ErrorKind::UnexpectedUnit { unit: name })
}

fn same<T: Into<u64>>(
    at: u64,
    clause: &'static str,
    element: &'static str,
    value: T,
    expected: T,
) -> Result<()> {
    let (value, expected) = (value.into(), expected.into());
    if value == expected {
        return Ok(());
    }
    Err(Error::new(at, clause, ErrorKind::Mismatch { element, value, expected }))
}

/// Absolute offset of an element of a record that starts at `at`.
fn element_at(table: &Table, at: u64, element: &str) -> u64 {
    after(at, table.offset(element))
}

/// Absolute offset of `frame` in the header of a unit.
fn frame_at(unit: &Unit<'_>) -> u64 {
    element_at(&UnitHeader::TABLE, unit.at, "frame")
}

fn after(at: u64, bytes: usize) -> u64 {
    at.saturating_add(u64::try_from(bytes).unwrap_or(u64::MAX))
}

fn unit_bytes(unit: &Unit<'_>) -> u64 {
    let header = u64::try_from(UnitHeader::SIZE).unwrap_or(0);
    u64::try_from(unit.payload.len()).unwrap_or(0).wrapping_add(header)
}
