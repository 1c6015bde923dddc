//! The GOPs and frames of a stream, the units that they are made of, and what these need of each other, from headers alone.
//! Works on damaged and on cut streams, in time linear in the number of units.

use splatstream_format::follower::{Content, Follower, Standing};
use splatstream_format::syntax::{
    EndOfStream, FrameHeader, FrameRole, GopHeader, OperatingPointEntry, Profile, SequenceParameters,
    TransformKind, UnitHeader, UnitType,
};
use splatstream_format::unit::{Landmark, Stream, Unit};
use splatstream_format::{Error, Limits, Result};
use std::collections::{BTreeMap, BTreeSet};

/// What a stream is made of.
#[derive(Debug, Default)]
pub struct Structure {
    /// The profile, if there is a file header.
    pub profile: Option<Profile>,
    /// The sequence parameters, if they have come.
    pub sequence: Option<SequenceParameters>,
    /// The GOPs.
    pub gops: Vec<Gop>,
    /// The operating points that it lists.
    pub points: Vec<Listed>,
    /// How many units the end unit counts before it, and how many there are; none before the end unit.
    units: Option<(u32, usize)>,
    /// The first error of headers, checksums and lengths.
    pub error: Option<Error>,
    /// Whether units belong to the last GOP: not after a damaged gop_header.
    in_gop: bool,
    definitions: Definitions,
}

/// An operating point as the stream lists it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Listed {
    /// Its highest spatial layer, temporal layer and refinement, each counted from 0.
    pub point: (u8, u8, u8),
    /// Frames of the stream at the point.
    pub frames: u32,
    /// Bytes of their units and of those of their GOPs.
    pub bytes: u64,
}

/// Where a unit is.
#[derive(Debug, Clone, Copy)]
pub struct UnitSpan {
    /// Counted from 0.
    pub unit: usize,
    /// Offset of its header.
    pub at: u64,
    /// Header and payload.
    pub bytes: u64,
    /// Whether its header or its payload is not the one that was written.
    pub damaged: bool,
}

/// A group of pictures.
#[derive(Debug)]
pub struct Gop {
    /// Its gop_header.
    pub span: UnitSpan,
    /// What that says.
    pub header: GopHeader,
    /// Display index of the first frame.
    pub first_frame: u32,
    /// Transforms, codebooks and weights.
    pub tools: Vec<Tool>,
    /// The frames whose headers came, in the order of the stream.
    pub frames: Vec<Frame>,
    /// Where in `frames` the frame with a display index is.
    by_index: BTreeMap<u32, usize>,
}

/// A transform, codebook or weights unit.
#[derive(Debug)]
pub struct Tool {
    /// Where it is.
    pub span: UnitSpan,
    /// What it is.
    pub unit_type: UnitType,
    /// The temporal layer from which on it is needed.
    pub temporal_layer: u8,
    /// Frames of the GOP that stand before it.
    pub frames_before: usize,
}

/// A frame.
#[derive(Debug)]
pub struct Frame {
    /// Display index.
    pub index: u32,
    /// Its frame_header.
    pub span: UnitSpan,
    /// Type, temporal layer and reference.
    pub role: FrameRole,
    /// The transform units that its header names.
    pub transforms: Vec<usize>,
    /// Increments.
    pub increments: Vec<Increment>,
    /// The number of the unit of each spatial layer and refinement.
    by_layer: BTreeMap<(u8, u8), usize>,
}

/// An increment.
#[derive(Debug)]
pub struct Increment {
    /// Where it is.
    pub span: UnitSpan,
    /// Its unit_header.
    pub header: UnitHeader,
    /// The tools that it uses.
    pub tools: UsedTools,
}

/// An increment that another needs; those that this one needs are needed too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Need {
    /// Display index of its frame.
    pub frame: u32,
    /// Its spatial layer.
    pub spatial_layer: u8,
    /// Its refinement.
    pub refinement: u8,
    /// The number of its unit; none if it is not in the stream.
    pub unit: Option<usize>,
}

/// The tool units that an increment uses.
#[derive(Debug, Default)]
pub struct UsedTools {
    /// Codebook units.
    pub codebooks: Vec<usize>,
    /// The weights unit of the GOP, if new Gaussians have predictors.
    pub weights: Option<usize>,
}

/// The units that hold the definitions in force.
#[derive(Debug, Default)]
struct Definitions {
    dc: [Option<usize>; 16],
    sh: [Option<usize>; 16],
    codebooks: [Option<usize>; 16],
    weights: Option<usize>,
}

impl Gop {
    /// Display index of the frame that a frame refers to.
    pub fn reference(&self, frame: &Frame) -> Option<u32> {
        frame.role.reference.and_then(|index| self.first_frame.checked_add(index))
    }

    /// A frame by its display index.
    pub fn frame(&self, index: u32) -> Option<&Frame> {
        self.by_index.get(&index).and_then(|&at| self.frames.get(at))
    }

    /// The display index after those that it announces.
    pub fn end(&self) -> u32 {
        self.first_frame.saturating_add(self.header.gop_frame_count)
    }
}

impl Frame {
    /// The number of the unit of a spatial layer and refinement.
    pub fn unit(&self, spatial_layer: u8, refinement: u8) -> Option<usize> {
        self.by_layer.get(&(spatial_layer, refinement)).copied()
    }
}

impl Structure {
    /// Reads a stream. Where the end of a unit is not known it goes on at the next intact gop_header.
    pub fn of(bytes: &[u8], limits: &Limits) -> Self {
        let mut structure = Self::default();
        let stream = match Stream::open(bytes, limits) {
            Ok(stream) => stream,
            Err(error) => return Self { error: Some(error), ..structure },
        };
        let profile = stream.header().profile();
        structure.profile = Some(profile);
        let mut follower = Follower::new(profile);
        let mut units = stream.units();
        let mut number = 0;
        while let Some(unit) = units.next_unit() {
            match unit {
                Ok(unit) => {
                    structure.unit(&unit, number, &mut follower);
                    number = number.saturating_add(1);
                }
                Err(error) => {
                    structure.note(Err(error));
                    structure.in_gop = false;
                    units.scan_for(Landmark::GopHeader);
                }
            }
        }
        structure.sequence = follower.sequence().copied();
        structure
    }

    /// The highest spatial layer, that of predicted frames.
    pub fn top(&self) -> u8 {
        self.sequence.map_or(0, |sequence| sequence.spatial_layer_count.saturating_sub(1))
    }

    /// What an increment of a frame of a GOP needs at once, by clauses 7.1 to 7.7: the refinement before it; in an I frame its
    /// parents, one layer below; in other frames the same refinement of the reference frame, or all units of a whole anchor,
    /// which the last of them stands for.
    pub fn needs(&self, gop: &Gop, frame: &Frame, increment: &Increment) -> Vec<Need> {
        let (spatial, refinement) = (increment.header.spatial_layer, increment.header.refinement);
        let mut needs = Vec::new();
        let mut add = |index: u32, spatial_layer: u8, refinement: u8| {
            let unit = gop.frame(index).and_then(|frame| frame.unit(spatial_layer, refinement));
            needs.push(Need { frame: index, spatial_layer, refinement, unit });
        };
        if let Some(before) = refinement.checked_sub(1) {
            add(frame.index, spatial, before);
        }
        let whole_anchor = self.sequence.filter(SequenceParameters::whole_anchor);
        match (gop.reference(frame), whole_anchor) {
            (None, _) => {
                if let Some(below) = spatial.checked_sub(1) {
                    add(frame.index, below, refinement);
                }
            }
            (Some(index), Some(sequence)) if index == gop.first_frame => {
                add(index, self.top(), sequence.refinement_count.saturating_sub(1));
            }
            (Some(index), _) => add(index, self.top(), refinement),
        }
        needs
    }

    /// Whether there are as many units as the end unit counts.
    pub fn has_all_units(&self) -> bool {
        self.units.is_some_and(|(counted, there)| usize::try_from(counted) == Ok(there))
    }

    /// The listed points up to `point`: its highest spatial layer, temporal layer and refinement.
    pub fn points_up_to(&self, point: (u8, u8, u8)) -> impl Iterator<Item = Listed> {
        let (spatial, temporal, refinement) = point;
        self.points.iter().copied().filter(move |Listed { point: listed, .. }| {
            listed.0 <= spatial && listed.1 <= temporal && listed.2 <= refinement
        })
    }

    /// First and last display index of each run of frames that the stream says it has at a point and that are not
    /// `there`. Where it does not say how many it has (`announced`), none is missing after the last one.
    pub fn missing(
        &self,
        there: &BTreeSet<u32>,
        announced: Option<u32>,
        point: (u8, u8, u8),
    ) -> Vec<(u32, u32)> {
        let end = announced.unwrap_or_else(|| there.last().map_or(0, |last| last.saturating_add(1)));
        let layer = self.temporal_layer(point);
        let mut missing = Vec::new();
        // All indices from `next` on that are not there. Their number may be anything: only those that are there are visited.
        let mut between = |next: u32, end: u32| {
            let mut next = next;
            for &index in there.range(next.min(end)..end).chain([&end]) {
                if index > next {
                    add_run(&mut missing, next, index.saturating_sub(1));
                }
                next = index.saturating_add(1);
            }
        };
        let mut next = 0;
        for gop in self.gops.iter().filter(|gop| gop.header.is_predicted()) {
            between(next, gop.first_frame.min(end));
            for index in next.max(gop.first_frame)..gop.end().min(end) {
                let is_of_point =
                    gop.header.role(index.saturating_sub(gop.first_frame)).temporal_layer <= layer;
                if is_of_point && !there.contains(&index) {
                    between(index, index.saturating_add(1));
                }
            }
            next = next.max(gop.end());
        }
        between(next, end);
        missing
    }

    /// The highest temporal layer of which the stream has frames at a point. Points of an extracted stream are listed with
    /// temporal layers that are no longer there, but not with their frames.
    fn temporal_layer(&self, point: (u8, u8, u8)) -> u8 {
        match self.points_up_to(point).max_by_key(|listed| listed.point) {
            Some(Listed { frames, .. }) => {
                let as_many = self.points_up_to(point).filter(|listed| listed.frames == frames);
                as_many.map(|listed| listed.point.1).min().unwrap_or(0)
            }
            None => {
                let frames = self.gops.iter().flat_map(|gop| &gop.frames);
                frames.map(|frame| frame.role.temporal_layer).max().unwrap_or(0).min(point.1)
            }
        }
    }

    fn note(&mut self, checked: Result<()>) {
        self.error = self.error.or(checked.err());
    }

    fn unit(&mut self, unit: &Unit<'_>, number: usize, follower: &mut Follower) {
        let standing = follower.take(unit);
        let span = UnitSpan::new(number, unit, standing.is_err());
        let taken = match standing {
            Ok(Standing::Taken) => self.take(unit, span, follower),
            // What decoders discard may hold anything.
            Ok(Standing::Discarded) => {
                self.add_increment(unit.header, span, UsedTools::default());
                Ok(())
            }
            Err(error) => {
                self.damaged(unit, span);
                Err(error)
            }
        };
        self.note(taken);
    }

    /// A unit that is intact.
    fn take(&mut self, unit: &Unit<'_>, span: UnitSpan, follower: &Follower) -> Result<()> {
        match unit.header.unit_type() {
            UnitType::GopHeader => self.in_gop = false,
            UnitType::Transform | UnitType::Codebook | UnitType::Weights => {
                self.add_tool(&unit.header, span);
                if follower.sequence().is_none() {
                    return Ok(());
                }
            }
            // Payloads that say nothing about the structure are not looked at. That of an increment may be one that
            // decoders discard.
            UnitType::Increment => {
                let content = follower.content(unit).ok();
                let tools = content.map(|content| self.tools_of(&content)).unwrap_or_default();
                self.add_increment(unit.header, span, tools);
                return Ok(());
            }
            UnitType::FrameHeader | UnitType::SequenceParameters | UnitType::OperatingPoints => {}
            UnitType::End => {
                let end = EndOfStream::parse_payload(unit.payload, unit.payload_at)?;
                self.units = Some((end.unit_count, span.unit));
                return Ok(());
            }
            _ => return Ok(()),
        }
        match follower.content(unit)? {
            Content::GopHeader(header) => {
                self.definitions = Definitions::default();
                self.gops.push(Gop::new(span, header, unit.header.frame));
                self.in_gop = true;
            }
            Content::FrameHeader(header) => {
                self.add_frame(&unit.header, span, self.definitions.transforms(&header));
            }
            Content::OperatingPoints(points) => {
                let point = |entry: &OperatingPointEntry| Listed {
                    point: entry.key(),
                    frames: entry.frame_count,
                    bytes: entry.byte_count,
                };
                self.points = points.entries.iter().map(point).collect();
            }
            content => self.definitions.define(&content, span.unit),
        }
        Ok(())
    }

    /// A unit that is not intact: what its header says.
    fn damaged(&mut self, unit: &Unit<'_>, span: UnitSpan) {
        match unit.header.unit_type() {
            UnitType::GopHeader => self.in_gop = false,
            UnitType::Transform | UnitType::Codebook | UnitType::Weights => self.add_tool(&unit.header, span),
            UnitType::FrameHeader => self.add_frame(&unit.header, span, Vec::new()),
            UnitType::Increment => self.add_increment(unit.header, span, UsedTools::default()),
            _ => {}
        }
    }

    fn gop(&mut self) -> Option<&mut Gop> {
        self.gops.last_mut().filter(|_| self.in_gop)
    }

    fn add_tool(&mut self, header: &UnitHeader, span: UnitSpan) {
        let (unit_type, temporal_layer) = (header.unit_type(), header.temporal_layer);
        if let Some(gop) = self.gop() {
            let frames_before = gop.frames.len();
            gop.tools.push(Tool { span, unit_type, temporal_layer, frames_before });
        }
    }

    fn add_frame(&mut self, header: &UnitHeader, span: UnitSpan, transforms: Vec<usize>) {
        let Some(gop) = self.gop() else { return };
        let index = header.frame;
        let role = gop.header.role(index.saturating_sub(gop.first_frame));
        gop.by_index.entry(index).or_insert(gop.frames.len());
        let (increments, by_layer) = (Vec::new(), BTreeMap::new());
        gop.frames.push(Frame { index, span, role, transforms, increments, by_layer });
    }

    fn add_increment(&mut self, header: UnitHeader, span: UnitSpan, tools: UsedTools) {
        let frame = self.gop().and_then(|gop| gop.frames.last_mut());
        if let Some(frame) = frame.filter(|frame| frame.index == header.frame) {
            frame.by_layer.entry((header.spatial_layer, header.refinement)).or_insert(span.unit);
            frame.increments.push(Increment { span, header, tools });
        }
    }

    /// The tools that an increment uses.
    fn tools_of(&self, content: &Content) -> UsedTools {
        let Content::Increment(header) = content else { return UsedTools::default() };
        let defined = |id| self.definitions.codebooks.get(usize::from(id)).copied().flatten();
        let mut codebooks: Vec<usize> = header.sh().codebooks().filter_map(defined).collect();
        codebooks.dedup();
        let predicts = header.predictor_count() > 0;
        UsedTools { codebooks, weights: self.definitions.weights.filter(|_| predicts) }
    }
}

/// Adds a run of indices to runs, of which those that touch are joined.
pub fn add_run(runs: &mut Vec<(u32, u32)>, first: u32, last: u32) {
    match runs.last_mut() {
        Some((_, end)) if end.saturating_add(1) >= first => *end = last.max(*end),
        _ => runs.push((first, last)),
    }
}

impl Gop {
    fn new(span: UnitSpan, header: GopHeader, first_frame: u32) -> Self {
        let (tools, frames, by_index) = (Vec::new(), Vec::new(), BTreeMap::new());
        Self { span, header, first_frame, tools, frames, by_index }
    }
}

impl Definitions {
    /// Takes note of what a tool unit defines.
    fn define(&mut self, content: &Content, unit: usize) {
        let slot = match content {
            Content::Transform(header) if header.kind() == Some(TransformKind::Sh) => {
                self.sh.get_mut(usize::from(header.transform_id))
            }
            Content::Transform(header) => self.dc.get_mut(usize::from(header.transform_id)),
            Content::Codebook(header) => self.codebooks.get_mut(usize::from(header.codebook_id)),
            Content::Weights(_) => Some(&mut self.weights),
            _ => None,
        };
        slot.into_iter().for_each(|slot| *slot = Some(unit));
    }

    fn transforms(&self, header: &FrameHeader) -> Vec<usize> {
        let unit = |slots: &[Option<usize>; 16], id: u8| slots.get(usize::from(id)).copied().flatten();
        let sh = header.sh_transform().and_then(|id| unit(&self.sh, id));
        unit(&self.dc, header.dc_transform_id).into_iter().chain(sh).collect()
    }
}

impl UnitSpan {
    fn new(unit: usize, of: &Unit<'_>, damaged: bool) -> Self {
        let bytes = u64::try_from(UnitHeader::SIZE.saturating_add(of.payload.len())).unwrap_or(u64::MAX);
        Self { unit, at: of.at, bytes, damaged }
    }
}
