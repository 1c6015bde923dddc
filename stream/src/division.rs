//! C.3: the units of a stream, divided by Representation, frame and refinement.
//!
//! Pieces are runs of neighbouring units, and their places increase through the stream. So the bytes of all pieces, put in
//! the order of their places, are the stream again: nothing but the pieces has to be carried.

use crate::representation::Representation;
use splatstream_format::follower::{Content, Follower, Standing};
use splatstream_format::syntax::{
    EndOfStream, FileHeader, FrameType, GopHeader, IncrementHeader, MAX_NEIGHBOURS, SequenceParameters,
    UnitHeader, UnitType,
};
use splatstream_format::unit::Unit;
use splatstream_format::{Error, ErrorKind, Result};

/// The clause that the order of units breaks.
const ORDER: &str = "B.1";

/// Where a piece belongs. The order is that of the stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place {
    /// Display index of the frame.
    pub frame: u32,
    /// The Representation.
    pub representation: Representation,
    /// The refinement, from 0; increments of another one are in another piece.
    pub refinement: u8,
}

/// Units that follow each other and belong to one place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Piece {
    /// Where it belongs.
    pub place: Place,
    /// Absolute offset of the first byte.
    pub start: u64,
    /// Absolute offset after the last byte.
    pub end: u64,
    /// What its units are.
    pub tools: Tools,
}

/// What the units of a piece, or of several, are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tools {
    /// Units of each type, in the order of [`Tools::TYPES`].
    pub units: [u32; 7],
    /// Gaussians of the lists after the increments.
    pub gaussians: u64,
    /// New Gaussians that are predicted from neighbours.
    pub predicted: u64,
    /// The most neighbours of such a prediction; 0 without one.
    pub neighbours: u8,
    /// Increments whose moves are predicted.
    pub move_predictors: u32,
    /// Increments that extrapolate opacities.
    pub extrapolations: u32,
}

impl Tools {
    /// The names of the types that [`Tools::units`] counts; the last stands for all others.
    pub const TYPES: [&'static str; 7] =
        ["gop_header", "frame_header", "increment", "transform", "codebook", "weights", "other"];

    fn count(&mut self, unit_type: UnitType) {
        let name = unit_type.name();
        let slot = Self::TYPES.iter().position(|known| *known == name);
        let slot = slot.unwrap_or(Self::TYPES.len().saturating_sub(1));
        if let Some(count) = self.units.get_mut(slot) {
            *count = count.saturating_add(1);
        }
    }

    fn increment(&mut self, header: &IncrementHeader) {
        self.gaussians = self.gaussians.saturating_add(header.list_size().into());
        if header.increment_flags & IncrementHeader::PREDICTORS != 0 {
            self.predicted = self.predicted.saturating_add(header.new_count.into());
            self.neighbours = self.neighbours.max(header.neighbour_count.min(MAX_NEIGHBOURS));
        }
        let moves = header.increment_flags & IncrementHeader::MOVE_PREDICTORS != 0;
        self.move_predictors = self.move_predictors.saturating_add(moves.into());
        self.extrapolations = self.extrapolations.saturating_add(header.extrapolates_opacity.into());
    }

    /// Adds what other units are.
    pub fn add(&mut self, other: &Self) {
        for (count, more) in self.units.iter_mut().zip(other.units) {
            *count = count.saturating_add(more);
        }
        self.gaussians = self.gaussians.saturating_add(other.gaussians);
        self.predicted = self.predicted.saturating_add(other.predicted);
        self.neighbours = self.neighbours.max(other.neighbours);
        self.move_predictors = self.move_predictors.saturating_add(other.move_predictors);
        self.extrapolations = self.extrapolations.saturating_add(other.extrapolations);
    }
}

/// The pieces of a GOP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gop {
    /// Its header.
    pub header: GopHeader,
    /// Display index of its first frame.
    pub first_frame: u32,
    /// Absolute offset of its first byte.
    pub start: u64,
    /// Its pieces in order.
    pub pieces: Vec<Piece>,
}

/// Divides the units of a stream as they come.
#[derive(Debug)]
pub struct Divider {
    follower: Follower,
    phase: Phase,
    /// Units whose place depends on what follows.
    pending: Vec<Pending>,
    /// Offset after the units of the stream before the first GOP.
    head_end: u64,
    /// Offset of the units after the last GOP.
    tail_start: Option<u64>,
    gop: Option<Gop>,
    /// Units and frames so far.
    units: u32,
    frames: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Before the first GOP.
    Head,
    /// After a GOP header: all up to the first frame belongs to the GOP.
    Opening,
    /// In a frame of a Representation.
    Frame(u32, Representation),
    /// After the last GOP.
    Tail,
}

#[derive(Debug, Clone, Copy)]
struct Pending {
    start: u64,
    end: u64,
    unit_type: UnitType,
    /// Of a codebook.
    temporal_layer: Option<u8>,
}

impl Divider {
    /// Before the first unit of a stream.
    pub fn new(header: &FileHeader) -> Self {
        let head_end = u64::try_from(FileHeader::SIZE).unwrap_or(u64::MAX);
        Self {
            follower: Follower::new(header.profile()),
            phase: Phase::Head,
            pending: Vec::new(),
            head_end,
            tail_start: None,
            gop: None,
            units: 0,
            frames: 0,
        }
    }

    /// The sequence parameters, once they have come.
    pub fn sequence(&self) -> Option<&SequenceParameters> {
        self.follower.sequence()
    }

    /// Offset after the file header and the units before the first GOP.
    pub const fn head_end(&self) -> u64 {
        self.head_end
    }

    /// The GOP in progress: its pieces so far, of which the last may grow.
    pub const fn open_gop(&self) -> Option<&Gop> {
        self.gop.as_ref()
    }

    /// Offset of the units after the last GOP, once the first of them has come.
    pub const fn tail_start(&self) -> Option<u64> {
        self.tail_start
    }

    /// Takes the next unit; gives the GOP that it ends, if it ends one.
    ///
    /// # Errors
    /// A unit that is damaged, breaks its syntax, or stands where annex B allows none.
    pub fn take(&mut self, unit: &Unit<'_>) -> Result<Option<Gop>> {
        let standing = self.follower.take(unit)?;
        let content = match standing {
            Standing::Taken => Some(self.follower.content(unit)?),
            Standing::Discarded => None,
        };
        let unit_type = unit.header.unit_type();
        if let Some(Content::End(end)) = &content {
            self.check_end(end, unit.payload_at)?;
        }
        self.units = self.units.saturating_add(1);
        self.frames = self.frames.saturating_add((unit_type == UnitType::FrameHeader).into());
        match unit_type {
            UnitType::Increment => self.increment(unit, content.as_ref()).map(|()| None),
            UnitType::FrameHeader => self.frame(unit).map(|()| None),
            UnitType::GopHeader => self.gop(unit, content),
            UnitType::Transform | UnitType::Weights => self.definition(unit).map(|()| None),
            UnitType::Codebook => self.codebook(unit).map(|()| None),
            UnitType::OperatingPoints | UnitType::Index | UnitType::End => Ok(self.tail(unit)),
            UnitType::SceneDescription if self.phase != Phase::Head || self.sequence().is_none() => {
                Err(misplaced(unit))
            }
            UnitType::SequenceParameters
            | UnitType::SceneDescription
            | UnitType::Reserved(_)
            | UnitType::User(_) => self.any_place(unit).map(|()| None),
        }
    }

    /// SS-EN-001: the end unit counts what came. So nothing is missing where it is right.
    fn check_end(&self, end: &EndOfStream, at: u64) -> Result<()> {
        let counts =
            [("frame_count", end.frame_count, self.frames), ("unit_count", end.unit_count, self.units)];
        for (element, value, expected) in counts {
            if value != expected {
                let kind = ErrorKind::Mismatch { element, value: value.into(), expected: expected.into() };
                return Err(Error::new(at, EndOfStream::TABLE.semantics, kind));
            }
        }
        Ok(())
    }

    /// A unit that may stand anywhere goes with what follows it.
    fn any_place(&mut self, unit: &Unit<'_>) -> Result<()> {
        match (self.phase, self.gop.as_ref().map(|gop| gop.first_frame)) {
            (Phase::Head, _) => self.head_end = end_of(unit),
            (Phase::Opening, Some(frame)) => self.put(opening(frame), unit, None)?,
            (Phase::Tail, _) => {}
            _ => self.pending.push(Pending::new(unit, None)),
        }
        Ok(())
    }

    fn definition(&mut self, unit: &Unit<'_>) -> Result<()> {
        match (self.phase, &self.gop) {
            (Phase::Opening, Some(gop)) => self.put(opening(gop.first_frame), unit, None),
            _ => Err(misplaced(unit)),
        }
    }

    fn codebook(&mut self, unit: &Unit<'_>) -> Result<()> {
        match self.phase {
            Phase::Opening => self.definition(unit),
            Phase::Frame(..) => {
                self.pending.push(Pending::new(unit, Some(unit.header.temporal_layer)));
                Ok(())
            }
            _ => Err(misplaced(unit)),
        }
    }

    fn gop(&mut self, unit: &Unit<'_>, content: Option<Content>) -> Result<Option<Gop>> {
        let (Some(Content::GopHeader(header)), Some(sequence)) = (content, self.sequence()) else {
            return Err(misplaced(unit));
        };
        header.validate_layers(unit.payload_at, sequence.temporal_layer_count)?;
        let last = self
            .gop
            .as_ref()
            .map(|gop| gop.first_frame.saturating_add(gop.header.gop_frame_count.saturating_sub(1)));
        let frame = unit.header.frame;
        if self.phase == Phase::Tail || last.is_some_and(|last| frame <= last) {
            return Err(misplaced(unit));
        }
        header.validate_from(unit.payload_at, frame)?;
        let start = self.pending.first().map_or(unit.at, |first| first.start);
        let done = self.gop.replace(Gop { header, first_frame: frame, start, pieces: Vec::new() });
        self.phase = Phase::Opening;
        self.place_pending(|_| opening(frame))?;
        self.put(opening(frame), unit, None)?;
        Ok(done)
    }

    fn frame(&mut self, unit: &Unit<'_>) -> Result<()> {
        let (frame, layer) = (unit.header.frame, unit.header.temporal_layer);
        let Some(gop) = &self.gop else { return Err(misplaced(unit)) };
        let index = frame.checked_sub(gop.first_frame).filter(|&index| index < gop.header.gop_frame_count);
        let Some(role) = index.map(|index| gop.header.role(index)) else { return Err(misplaced(unit)) };
        if self.phase == Phase::Tail || role.temporal_layer != layer {
            return Err(misplaced(unit));
        }
        let representation = match role.frame_type {
            FrameType::Intra => Representation::Spatial(0),
            _ => Representation::Temporal(layer),
        };
        let at = |representation| Place { frame, representation, refinement: 0 };
        let mut least = layer;
        let mut lowest = Vec::new();
        for pending in self.pending.iter().rev() {
            least = pending.temporal_layer.map_or(least, |of_codebook| of_codebook.min(least));
            let lower = (least < layer).then_some(Representation::Temporal(least));
            lowest.push(at(lower.unwrap_or(representation)));
        }
        self.place_pending(|left| lowest.get(left).copied().unwrap_or(at(representation)))?;
        self.phase = Phase::Frame(frame, representation);
        self.put(at(representation), unit, None)
    }

    fn increment(&mut self, unit: &Unit<'_>, content: Option<&Content>) -> Result<()> {
        let Phase::Frame(frame, of_frame) = self.phase else { return Err(misplaced(unit)) };
        let (layer, refinement) = (unit.header.spatial_layer, unit.header.refinement);
        let sequence = self.follower.sequence_at(unit.at)?;
        let refinements = sequence.refinement_count;
        // Decoders discard the others whatever their layers are, and there are none in I frames.
        if content.is_some() {
            unit.header.validate_layers(unit.at, sequence)?;
        }
        let codebooks = self.pending.iter().any(|pending| pending.temporal_layer.is_some());
        let of_role = match of_frame {
            Representation::Spatial(_) => unit.header.temporal_layer == 0,
            Representation::Temporal(layer) => content.is_none() || unit.header.temporal_layer == layer,
        };
        if unit.header.frame != frame || refinement >= refinements || codebooks || !of_role {
            return Err(misplaced(unit));
        }
        let representation = if of_frame.is_intra() { Representation::Spatial(layer) } else { of_frame };
        let place = Place { frame, representation, refinement };
        self.place_pending(|_| place)?;
        let header = match content {
            Some(Content::Increment(header)) => Some(header),
            _ => None,
        };
        self.put(place, unit, header)
    }

    /// What stands after the last GOP belongs to the whole stream.
    fn tail(&mut self, unit: &Unit<'_>) -> Option<Gop> {
        self.phase = Phase::Tail;
        let start = self.pending.first().map_or(unit.at, |first| first.start);
        self.pending.clear();
        self.tail_start.get_or_insert(start);
        self.gop.take()
    }

    /// Puts what waited where `place` says, by the number of units that waited after it.
    fn place_pending(&mut self, place: impl Fn(usize) -> Place) -> Result<()> {
        let pending = core::mem::take(&mut self.pending);
        for (left, waiting) in (0..pending.len()).rev().zip(&pending) {
            self.append(place(left), waiting)?.tools.count(waiting.unit_type);
        }
        Ok(())
    }

    fn put(&mut self, place: Place, unit: &Unit<'_>, increment: Option<&IncrementHeader>) -> Result<()> {
        let piece = self.append(place, &Pending::new(unit, None))?;
        piece.tools.count(unit.header.unit_type());
        if let Some(header) = increment {
            piece.tools.increment(header);
        }
        Ok(())
    }

    /// The piece at a place, with a unit more. Places never decrease.
    fn append(&mut self, place: Place, unit: &Pending) -> Result<&mut Piece> {
        let misplaced =
            Error::new(unit.start, ORDER, ErrorKind::UnexpectedUnit { unit: unit.unit_type.name() });
        let pieces = &mut self.gop.as_mut().ok_or(misplaced)?.pieces;
        match pieces.last().map(|last| last.place) {
            Some(last) if last > place => return Err(misplaced),
            Some(last) if last == place => {}
            _ => {
                let (start, end) = (unit.start, unit.end);
                pieces.push(Piece { place, start, end, tools: Tools::default() });
            }
        }
        let piece = pieces.last_mut().ok_or(misplaced)?;
        piece.end = unit.end;
        Ok(piece)
    }
}

impl Pending {
    fn new(unit: &Unit<'_>, temporal_layer: Option<u8>) -> Self {
        Self { start: unit.at, end: end_of(unit), unit_type: unit.header.unit_type(), temporal_layer }
    }
}

/// Where what belongs to a whole GOP is.
const fn opening(frame: u32) -> Place {
    Place { frame, representation: Representation::Spatial(0), refinement: 0 }
}

fn end_of(unit: &Unit<'_>) -> u64 {
    let length = UnitHeader::SIZE.saturating_add(unit.payload.len());
    unit.at.saturating_add(u64::try_from(length).unwrap_or(u64::MAX))
}

fn misplaced(unit: &Unit<'_>) -> Error {
    Error::new(unit.at, ORDER, ErrorKind::UnexpectedUnit { unit: unit.header.unit_type().name() })
}

/// A stream, divided.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Division {
    /// The file header.
    pub header: FileHeader,
    /// The sequence parameters.
    pub sequence: SequenceParameters,
    /// Offset after the file header and the units before the first GOP.
    pub head_end: u64,
    /// The GOPs in order.
    pub gops: Vec<Gop>,
    /// Offset of the units after the last GOP.
    pub tail_start: u64,
    /// Bytes of the stream.
    pub end: u64,
}

impl Division {
    /// Divides a whole stream.
    ///
    /// # Errors
    /// As [`Divider::take`]; a stream that does not end with its end unit.
    pub fn of(bytes: &[u8], limits: &splatstream_format::Limits) -> Result<Self> {
        let stream = splatstream_format::unit::Stream::open(bytes, limits)?;
        let (mut divider, mut gops) = (Divider::new(stream.header()), Vec::new());
        let mut units = stream.units();
        while let Some(unit) = units.next_unit() {
            gops.extend(divider.take(&unit?)?);
        }
        let end = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        let truncated = Error::new(end, ORDER, ErrorKind::Truncated { element: "unit_header" });
        let tail_start = divider.tail_start().ok_or(truncated)?;
        let sequence = *divider.follower.sequence_at(tail_start)?;
        Ok(Self { header: *stream.header(), sequence, head_end: divider.head_end(), gops, tail_start, end })
    }

    /// The Representations that have pieces, and the base, in order.
    pub fn representations(&self) -> Vec<Representation> {
        let pieces = self.gops.iter().flat_map(|gop| &gop.pieces);
        let mut found: Vec<_> = pieces.map(|piece| piece.place.representation).collect();
        found.push(Representation::Spatial(0));
        found.sort_unstable();
        found.dedup();
        found
    }
}
