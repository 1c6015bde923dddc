//! Clause 7.1: the state of a decoder and what each unit does to it.

use crate::gop::Gop;
use crate::operating_point::{OperatingPoint, Tally};
use expected::{element_at, frame_at, same, unexpected};
use layered::{LayeredFrame, References};
use refined::RefinedFrame;
use splatstream_format::syntax::{
    FileHeader, FrameHeader, GopHeader, PlaceInGop, Profile, SequenceParameters, UnitHeader, UnitType,
};
use splatstream_format::unit::{Damaged, Unit};
use splatstream_format::{Error, ErrorKind, Limits, Result};

mod assembly;
mod decoded;
mod expected;
mod layered;
mod lists;
mod refined;

pub use decoded::{Compensation, DecodedFrame};

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
    /// Show only what the units of the operating point hold, not what is carried over from the intra frame: the
    /// paper's subset. Makes no difference in profile Intra.
    pub subset: bool,
    /// Tell the entropy states of units, in [`DecodedFrame::entropy`].
    pub entropy: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            limits: Limits::default(),
            verify: true,
            operating_point: OperatingPoint::ALL,
            tolerant: false,
            subset: false,
            entropy: false,
        }
    }
}

/// A frame whose units are still arriving.
struct PendingFrame<'a> {
    /// Absolute offset of the frame_header unit.
    at: u64,
    number: u32,
    header: FrameHeader,
    place: PlaceInGop,
    units: FrameUnits<'a>,
    bytes: u64,
    lost: Option<Error>,
    /// Whether a refinement unit stood in the stream, decoded or not.
    has_unit: bool,
}

/// The units of a frame by profile.
enum FrameUnits<'a> {
    Refined(RefinedFrame<'a>),
    Layered(LayeredFrame<'a>),
}

/// Decodes a stream unit by unit.
pub struct Decoder<'a> {
    options: Options,
    profile: Profile,
    level: u8,
    /// Whether the units before the first GOP header are not known (B.3).
    starts_inside: bool,
    sequence: Option<(SequenceParameters, &'a [u8])>,
    gop: Option<Gop>,
    frame: Option<PendingFrame<'a>>,
    /// A frame that was complete when the unit after it turned out wrong.
    finished: Option<DecodedFrame>,
    /// Frames of this GOP that later ones refer to, profile Dynamic.
    references: References,
    /// The least display index of the next frame.
    frames: u32,
    /// Frame headers so far.
    frame_headers: u32,
    units: u32,
    /// First frame and offset of every GOP header so far: what an index shall hold.
    gops: Vec<(u32, u64)>,
    index_offset: Option<u64>,
    /// Whether operating_points have come.
    listed: bool,
    /// Whether some frame has lost a unit.
    has_lost_any: bool,
    /// Whether some unit did not belong to the operating point.
    has_passed_over: bool,
    /// What the units so far add to the operating points, and which belong to one.
    tally: Tally,
    ended: bool,
}

impl<'a> Decoder<'a> {
    /// A decoder for the stream with this file header.
    pub fn new(file: &FileHeader, options: Options) -> Self {
        Self {
            options,
            profile: file.profile(),
            level: file.level,
            starts_inside: false,
            sequence: None,
            gop: None,
            frame: None,
            finished: None,
            references: References::default(),
            frames: 0,
            frame_headers: 0,
            units: 0,
            gops: Vec::new(),
            index_offset: None,
            listed: false,
            has_lost_any: false,
            has_passed_over: false,
            tally: Tally::new(file.profile()),
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
        if !unit_type.is_known_in(self.profile) {
            self.units = self.units.wrapping_add(1);
            return Ok(None);
        }
        if self.is_passed_over(header) {
            self.pass_over(header);
            return Ok(None);
        }
        self.check_phase(unit)?;
        self.tally.unit(unit);
        let done = match unit_type {
            UnitType::SequenceParameters => self.sequence_parameters(unit).map(|()| None),
            UnitType::GopHeader => self.closing(unit, Self::gop_header),
            UnitType::Codebook if self.profile == Profile::Dynamic => self.closing(unit, Self::gop_tool),
            UnitType::Transform | UnitType::Codebook | UnitType::Weights => {
                self.gop_tool(unit).map(|()| None)
            }
            UnitType::FrameHeader => self.closing(unit, Self::frame_header),
            UnitType::Refinement => self.refinement(unit).map(|()| None),
            UnitType::Increment => self.increment(unit).map(|()| None),
            UnitType::OperatingPoints => self.closing(unit, Self::operating_points),
            UnitType::Index => self.closing(unit, Self::index),
            UnitType::End => self.closing(unit, Self::end),
            UnitType::Reserved(_) | UnitType::User(_) => Ok(None),
        };
        self.units = self.units.wrapping_add(1);
        done
    }

    /// Clause 7.1.2: whether the unit may stand here.
    fn check_phase(&self, unit: &Unit<'a>) -> Result<()> {
        let unit_type = unit.header.unit_type();
        let repeatable = unit_type == UnitType::SequenceParameters;
        let indexed = self.index_offset.is_some() && unit_type != UnitType::End;
        let listed = self.listed && !matches!(unit_type, UnitType::Index | UnitType::End);
        let surplus = unit_type == UnitType::FrameHeader && self.frames_left() == 0;
        let of_gop = matches!(unit_type, UnitType::Transform | UnitType::Codebook | UnitType::Weights);
        let orphan = of_gop && self.gop.is_none();
        let early = self.sequence.is_none() || indexed || listed || orphan;
        let foreign = self.profile == Profile::Dynamic && unit_type == UnitType::Refinement;
        if self.ended || surplus || foreign || !repeatable && early {
            return Err(unexpected(unit));
        }
        if unit_type == UnitType::Increment { Ok(()) } else { self.check_layers(unit) }
    }

    /// 6.3: the layers of a unit against those of the sequence.
    fn check_layers(&self, unit: &Unit<'a>) -> Result<()> {
        let Some((sequence, _)) = &self.sequence else { return Ok(()) };
        unit.header.validate_layers(unit.at, sequence)
    }

    /// Whether a unit belongs to the operating point (7.11, 7.19).
    fn belongs(&self, header: &UnitHeader) -> bool {
        self.tally.takes(self.options.operating_point, header)
    }

    /// 7.13.2: whether a unit is passed over before its payload and its place are looked at. In profile Intra a unit
    /// that does not belong to the operating point still has to stand in its place.
    fn is_passed_over(&self, header: &UnitHeader) -> bool {
        let layered =
            matches!(header.unit_type(), UnitType::FrameHeader | UnitType::Codebook | UnitType::Increment);
        let in_gops = self.gop.is_some() && !self.listed && self.index_offset.is_none() && !self.ended;
        self.profile == Profile::Dynamic && layered && in_gops && !self.belongs(header)
    }

    /// Counts a unit of profile Dynamic that does not belong to the operating point.
    fn pass_over(&mut self, header: &UnitHeader) {
        self.has_passed_over = true;
        self.units = self.units.wrapping_add(1);
        let headers = u32::from(header.unit_type() == UnitType::FrameHeader);
        self.frame_headers = self.frame_headers.wrapping_add(headers);
        if let Some(frame) = self.frame.as_mut().filter(|frame| frame.number == header.frame) {
            frame.has_unit |= header.unit_type() == UnitType::Increment;
        }
    }

    /// Whether units of a type make up the frames of the profile.
    fn is_of_frame(&self, unit_type: UnitType) -> bool {
        unit_type
            == match self.profile {
                Profile::Intra => UnitType::Refinement,
                Profile::Dynamic => UnitType::Increment,
            }
    }

    /// Takes note of a unit whose payload is damaged.
    ///
    /// # Errors
    /// The damage itself, unless the decoder is tolerant and the unit is of a frame; what a unit of a frame contradicts
    /// in its header.
    pub fn damaged(&mut self, Damaged { unit, error, .. }: &Damaged<'a>) -> Result<()> {
        if self.is_passed_over(&unit.header) {
            self.pass_over(&unit.header);
            return Ok(());
        }
        self.units = self.units.wrapping_add(1);
        if self.frame.is_none() || !self.is_of_frame(unit.header.unit_type()) {
            return Err(*error);
        }
        // Its bytes count; if it is not passed over, nothing that counts them is compared.
        self.tally.unit(unit);
        let arrives = self.arrives(unit)?;
        match &mut self.frame {
            Some(frame) if arrives => frame.lost = Some(*error),
            _ => return Ok(()),
        }
        if self.options.tolerant { Ok(()) } else { Err(*error) }
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
        let sequence = SequenceParameters::parse_payload(unit.payload, unit.payload_at, self.profile)?;
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
        // A GOP took the last index there is: no frame can follow.
        let is_full = self.gop.is_some() && self.frames == 0;
        let next = if is_full { 1 << 32 } else { u64::from(self.frames) };
        same(frame_at(unit), "6.5", "frame", unit.header.frame.into(), next)?;
        let (header, rest) = GopHeader::parse(unit.payload, unit.payload_at, self.profile)?;
        let layers = self.sequence().map_or(1, |sequence| sequence.temporal_layer_count);
        header.validate_layers(unit.payload_at, layers)?;
        let expected = self.gop.as_ref().map_or(0, |gop| gop.header.gop_index.wrapping_add(1));
        let expected = if starts_here { header.gop_index } else { expected };
        same(unit.payload_at, "6.5", "gop_index", header.gop_index, expected)?;
        header.validate_from(unit.payload_at, self.frames)?;
        GopHeader::TABLE.ends(rest, unit.payload_at)?;
        self.references = References::default();
        self.gops.push((self.frames, unit.at));
        self.gop = Some(Gop::new(header, self.frames));
        Ok(())
    }

    /// Frames of the GOP still to come.
    fn frames_left(&self) -> u32 {
        let Some(gop) = &self.gop else { return 0 };
        gop.header.gop_frame_count.wrapping_sub(self.frames.wrapping_sub(gop.first_frame))
    }

    /// Checks that the GOP has the frames it announced: all of them, or of a predicted one the first.
    fn close_gop(&mut self, at: u64) -> Result<()> {
        let Some(gop) = &self.gop else { return Ok(()) };
        let frames = self.frames.wrapping_sub(gop.first_frame);
        let announced = gop.header.gop_frame_count;
        if gop.header.is_predicted() && frames > 0 {
            self.frames = gop.first_frame.wrapping_add(announced);
            return Ok(());
        }
        same(at, "6.5", "gop_frame_count", announced, frames)
    }

    fn gop_tool(&mut self, unit: &Unit<'a>) -> Result<()> {
        let (Some(gop), Some((sequence, _)), None) = (&mut self.gop, &self.sequence, &self.frame) else {
            return Err(unexpected(unit));
        };
        if unit.header.unit_type() != UnitType::Codebook && self.frames != gop.first_frame {
            return Err(unexpected(unit));
        }
        same(frame_at(unit), "6.3", "frame", unit.header.frame, gop.first_frame)?;
        gop.tool(unit, sequence, self.profile, &self.options.limits)
    }

    fn frame_header(&mut self, unit: &Unit<'a>) -> Result<()> {
        let (Some(gop), Some((sequence, _))) = (&self.gop, &self.sequence) else {
            return Err(unexpected(unit));
        };
        let number = unit.header.frame;
        let place = gop.header.place(number.wrapping_sub(gop.first_frame));
        let first = place.reference.is_none() || self.frames == gop.first_frame;
        if first || number < self.frames || number.wrapping_sub(self.frames) >= self.frames_left() {
            same(frame_at(unit), "6.6", "frame", number, self.frames)?;
        }
        let temporal = element_at(&UnitHeader::TABLE, unit.at, "temporal_layer");
        same(temporal, "6.6", "temporal_layer", unit.header.temporal_layer, place.temporal_layer)?;
        let spatial_layer =
            if place.reference.is_some() { sequence.spatial_layer_count.wrapping_sub(1) } else { 0 };
        let spatial = element_at(&UnitHeader::TABLE, unit.at, "spatial_layer");
        same(spatial, "6.6", "spatial_layer", unit.header.spatial_layer, spatial_layer)?;
        let (header, rest) = FrameHeader::parse(unit.payload, unit.payload_at, self.profile)?;
        header.validate_place(unit.payload_at, &place)?;
        gop.transforms(&header, unit.payload_at)?;
        header.within(unit.payload_at, &self.limits())?;
        FrameHeader::TABLE.ends(rest, unit.payload_at)?;
        let units = match self.profile {
            Profile::Intra => FrameUnits::Refined(RefinedFrame::new()),
            Profile::Dynamic => {
                let reference = place.reference.and_then(|place| gop.first_frame.checked_add(place));
                FrameUnits::Layered(LayeredFrame::new(reference, &self.references, sequence))
            }
        };
        let bytes = unit_bytes(unit);
        let (at, lost) = (unit.at, None);
        self.frame = Some(PendingFrame { at, number, header, place, units, bytes, lost, has_unit: false });
        self.frames = number.wrapping_add(1);
        self.frame_headers = self.frame_headers.wrapping_add(1);
        Ok(())
    }

    /// A.2: what was agreed, and no more than the level of the stream has.
    fn limits(&self) -> Limits {
        let limits = self.options.limits;
        let max_gaussians = limits.max_gaussians.min(Limits::gaussians_of_level(self.level));
        let max_learned = limits.max_learned.min(Limits::learned_of_level(self.level));
        Limits { max_gaussians, max_learned, ..limits }
    }

    /// Steps 1 and 2 of clauses 7.1.3 and 7.13.3: whether the payload of a unit of the frame is looked at. Without a frame it is, as its check sum comes before its place.
    fn arrives(&mut self, unit: &Unit<'a>) -> Result<bool> {
        let takes = self.belongs(&unit.header);
        self.has_passed_over |= !takes;
        if takes {
            self.check_stand(unit)?;
        }
        let Some(frame) = &mut self.frame else { return Ok(true) };
        frame.has_unit = true;
        Ok(takes && frame.lost.is_none() && !frame.is_beyond(&unit.header))
    }

    /// Step 1.
    fn check_stand(&self, unit: &Unit<'a>) -> Result<()> {
        let (Some(frame), Some((sequence, _))) = (&self.frame, &self.sequence) else { return Ok(()) };
        self.check_layers(unit)?;
        let header = &unit.header;
        let at = |element| element_at(&UnitHeader::TABLE, unit.at, element);
        let clause = if self.profile == Profile::Intra { "6.9" } else { "7.1" };
        same(at("frame"), clause, "frame", header.frame, frame.number)?;
        let (place, layer) = (&frame.place, header.temporal_layer);
        same(at("temporal_layer"), "7.13", "temporal_layer", layer, place.temporal_layer)?;
        if place.reference.is_some() {
            let top = sequence.spatial_layer_count.wrapping_sub(1);
            same(at("spatial_layer"), "7.13", "spatial_layer", header.spatial_layer, top)?;
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
        let decoded = match &frame.units {
            FrameUnits::Refined(refined) => self.decode_refined(&frame, refined),
            FrameUnits::Layered(layered) => self.close_layered(&frame, layered, at),
        }?;
        self.has_lost_any |= decoded.as_ref().is_some_and(|decoded| decoded.lost.is_some());
        Ok(decoded)
    }
}

impl PendingFrame<'_> {
    /// Whether a unit is passed over because the reference frame is shown at a lower refinement.
    fn is_beyond(&self, header: &UnitHeader) -> bool {
        match &self.units {
            FrameUnits::Refined(_) => false,
            FrameUnits::Layered(layered) => layered.is_beyond(header.refinement),
        }
    }
}

/// Keeps a unit of a frame with those before; a tolerant decoder takes note of one that is wrong.
fn keep<U>(parsed: Result<U>, units: &mut Vec<U>, lost: &mut Option<Error>, tolerant: bool) -> Result<()> {
    match parsed {
        Ok(unit) => units.push(unit),
        Err(error) if tolerant => *lost = Some(error),
        Err(error) => return Err(error),
    }
    Ok(())
}

fn unit_bytes(unit: &Unit<'_>) -> u64 {
    let header = u64::try_from(UnitHeader::SIZE).unwrap_or(0);
    u64::try_from(unit.payload.len()).unwrap_or(0).wrapping_add(header)
}
