//! The groups and frames of a stream and the units that they are made of, from headers alone. Works on damaged and on
//! cut streams.

use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_format::syntax::{
    CodebookHeader, FrameHeader, GopHeader, IncrementHeader, PlaceInGop, Profile, RefinementHeader,
    SequenceParameters, ShHeader, TransformHeader, TransformKind, UnitHeader, UnitType,
};
use splatstream_format::unit::{Delivery, Stream, Unit};
use splatstream_format::{Error, Limits};

/// What a stream is made of.
#[derive(Default)]
pub(crate) struct Structure {
    /// The profile, if there is a file header.
    pub(crate) profile: Option<Profile>,
    /// The sequence parameters, once they have come.
    pub(crate) sequence: Option<SequenceParameters>,
    /// The groups.
    pub(crate) groups: Vec<Group>,
    /// The first error of headers, check sums and lengths.
    pub(crate) error: Option<Error>,
    definitions: Definitions,
}

/// Where a unit is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UnitPlace {
    /// Counted from 0.
    pub(crate) unit: usize,
    /// Offset of its header.
    pub(crate) at: u64,
    /// Header and payload.
    pub(crate) bytes: u64,
    /// The payload has another check sum.
    pub(crate) damaged: bool,
}

/// A group of pictures.
pub(crate) struct Group {
    pub(crate) place: UnitPlace,
    pub(crate) header: GopHeader,
    /// Display index of the first frame.
    pub(crate) first_frame: u32,
    /// Transforms, codebooks and weights.
    pub(crate) tools: Vec<Tool>,
    pub(crate) frames: Vec<Frame>,
}

/// A transform, codebook or weights unit.
pub(crate) struct Tool {
    pub(crate) place: UnitPlace,
    pub(crate) unit_type: UnitType,
    pub(crate) temporal_layer: u8,
    /// Frames of the group that stand before it.
    pub(crate) frames_before: usize,
}

/// A frame.
pub(crate) struct Frame {
    /// Display index.
    pub(crate) number: u32,
    pub(crate) place: UnitPlace,
    /// Type, temporal layer and reference.
    pub(crate) coding: PlaceInGop,
    /// The transform units that its header names.
    pub(crate) transforms: Vec<usize>,
    /// Refinement units or increments.
    pub(crate) units: Vec<LayerUnit>,
    /// Whether another unit stands behind the frame, so that it has no more than these.
    pub(crate) ended: bool,
}

/// A refinement unit or increment.
pub(crate) struct LayerUnit {
    pub(crate) place: UnitPlace,
    pub(crate) header: UnitHeader,
    pub(crate) tools: UsedTools,
}

/// The tool units that a refinement unit or increment uses.
#[derive(Default)]
pub(crate) struct UsedTools {
    /// Codebook units.
    pub(crate) codebooks: Vec<usize>,
    /// The weights unit of the group, if new Gaussians have predictors.
    pub(crate) weights: Option<usize>,
}

/// The units that hold the definitions in force.
#[derive(Default)]
struct Definitions {
    dc: [Option<usize>; 16],
    sh: [Option<usize>; 16],
    codebooks: [Option<usize>; 16],
    weights: Option<usize>,
}

impl Group {
    /// Display index of the frame that a frame refers to.
    pub(crate) fn reference(&self, frame: &Frame) -> Option<u32> {
        frame.coding.reference.and_then(|place| self.first_frame.checked_add(place))
    }

    /// A frame by its display index.
    pub(crate) fn frame(&self, number: u32) -> Option<&Frame> {
        self.frames.iter().find(|frame| frame.number == number)
    }
}

impl Structure {
    /// Reads a stream up to the first error behind which units cannot be told apart or belong to no group.
    pub(crate) fn of(bytes: &[u8], limits: &Limits) -> Self {
        let mut structure = Self::default();
        let stream = match Stream::open(bytes, limits) {
            Ok(stream) => stream,
            Err(error) => return Self { error: Some(error), ..structure },
        };
        structure.profile = Some(stream.header().profile());
        let mut units = stream.units();
        let mut number = 0;
        while let Some(delivery) = units.next_unit() {
            let taken = match delivery {
                Ok(Delivery::Intact(unit)) => structure.take(&unit, number),
                Ok(Delivery::Damaged(damaged)) => {
                    let error = Some(damaged.error).filter(|_| !damaged.passed_over);
                    structure.error = structure.error.or(error);
                    structure.damaged(&damaged.unit, number)
                }
                Err(error) => Err(error),
            };
            if let Err(error) = taken {
                structure.error = structure.error.or(Some(error));
                break;
            }
            number += 1;
        }
        structure
    }

    /// The highest spatial layer, that of predicted frames.
    pub(crate) fn top(&self) -> u8 {
        self.sequence.map_or(0, |sequence| sequence.spatial_layer_count.saturating_sub(1))
    }

    /// Whether a frame is output at an operating point (7.19).
    pub(crate) fn belongs(&self, frame: &Frame, point: OperatingPoint) -> bool {
        let layer = if frame.coding.reference.is_some() { self.top() } else { 0 };
        frame.coding.temporal_layer <= point.temporal && layer <= point.spatial
    }

    /// Whether a unit of a frame, of a spatial layer and refinement, belongs to an operating point (7.19).
    pub(crate) fn takes(
        &self,
        point: OperatingPoint,
        group: &Group,
        frame: &Frame,
        (spatial, refinement): (u8, u8),
    ) -> bool {
        let anchor = group.header.is_predicted() && frame.number == group.first_frame;
        let whole = anchor && point.spatial >= self.top();
        spatial <= point.spatial && (whole || refinement <= point.refinement)
    }

    /// The spatial layers and refinements that a frame can have.
    pub(crate) fn possible_units(&self, frame: &Frame) -> Vec<(u8, u8)> {
        let refinements = self.sequence.map_or(0, |sequence| sequence.refinement_count);
        let top = self.top();
        let lowest = if frame.coding.reference.is_some() { top } else { 0 };
        (lowest..=top).flat_map(|layer| (0..refinements).map(move |refinement| (layer, refinement))).collect()
    }

    fn take(&mut self, unit: &Unit<'_>, number: usize) -> Result<(), Error> {
        let place = UnitPlace::new(number, unit.at, &unit.header, false);
        let (payload, at, profile) = (unit.payload, unit.payload_at, self.profile.unwrap_or(Profile::Intra));
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                self.sequence = Some(SequenceParameters::parse_payload(payload, at, profile)?);
            }
            UnitType::GopHeader => {
                self.end_frame();
                let header = GopHeader::parse_payload(payload, at, profile)?;
                let (tools, frames) = (Vec::new(), Vec::new());
                self.definitions = Definitions::default();
                self.groups.push(Group { place, header, first_frame: unit.header.frame, tools, frames });
            }
            UnitType::Transform | UnitType::Codebook | UnitType::Weights => self.tool(unit, place)?,
            UnitType::FrameHeader => {
                self.end_frame();
                let header = FrameHeader::parse_payload(payload, at, profile)?;
                let transforms = self.definitions.transforms(&header);
                self.frame(&unit.header, place, transforms);
            }
            unit_type if is_of_frame(unit_type, profile) => {
                let tools = self.tools_of(unit);
                self.layer_unit(unit.header, place, tools);
            }
            UnitType::OperatingPoints | UnitType::Index | UnitType::End => self.end_frame(),
            _ => {}
        }
        Ok(())
    }

    /// A unit with a damaged payload: what its header says. Behind a damaged group header nothing has a place.
    fn damaged(&mut self, unit: &Unit<'_>, number: usize) -> Result<(), Error> {
        let header = &unit.header;
        let place = UnitPlace::new(number, unit.at, header, true);
        match header.unit_type() {
            UnitType::GopHeader | UnitType::SequenceParameters => self.error.map_or(Ok(()), Err),
            UnitType::FrameHeader => {
                self.end_frame();
                self.frame(header, place, Vec::new());
                Ok(())
            }
            UnitType::Transform | UnitType::Codebook | UnitType::Weights => {
                self.add_tool(header, place);
                Ok(())
            }
            unit_type if is_of_frame(unit_type, self.profile.unwrap_or(Profile::Intra)) => {
                self.layer_unit(*header, place, UsedTools::default());
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn end_frame(&mut self) {
        if let Some(frame) = self.groups.last_mut().and_then(|group| group.frames.last_mut()) {
            frame.ended = true;
        }
    }

    fn tool(&mut self, unit: &Unit<'_>, place: UnitPlace) -> Result<(), Error> {
        let Some(sequence) = &self.sequence else { return Ok(()) };
        let Definitions { dc, sh, codebooks, weights } = &mut self.definitions;
        if unit.header.unit_type() == UnitType::Weights {
            *weights = Some(place.unit);
            self.add_tool(&unit.header, place);
            return Ok(());
        }
        let (slots, id) = if unit.header.unit_type() == UnitType::Transform {
            let (header, _) = TransformHeader::parse(unit.payload, unit.payload_at, sequence)?;
            (if header.kind() == Some(TransformKind::Sh) { sh } else { dc }, header.transform_id)
        } else {
            let (header, _) = CodebookHeader::parse(unit.payload, unit.payload_at)?;
            (codebooks, header.codebook_id)
        };
        if let Some(slot) = slots.get_mut(usize::from(id)) {
            *slot = Some(place.unit);
        }
        self.add_tool(&unit.header, place);
        Ok(())
    }

    fn add_tool(&mut self, header: &UnitHeader, place: UnitPlace) {
        let Some(group) = self.groups.last_mut() else { return };
        if let Some(frame) = group.frames.last_mut() {
            frame.ended = true;
        }
        group.tools.push(Tool {
            place,
            unit_type: header.unit_type(),
            temporal_layer: header.temporal_layer,
            frames_before: group.frames.len(),
        });
    }

    fn frame(&mut self, header: &UnitHeader, place: UnitPlace, transforms: Vec<usize>) {
        let Some(group) = self.groups.last_mut() else { return };
        let number = header.frame;
        let coding = group.header.place(number.saturating_sub(group.first_frame));
        group.frames.push(Frame { number, place, coding, transforms, units: Vec::new(), ended: false });
    }

    fn layer_unit(&mut self, header: UnitHeader, place: UnitPlace, tools: UsedTools) {
        let frame = self.groups.last_mut().and_then(|group| group.frames.last_mut());
        if let Some(frame) = frame.filter(|frame| frame.number == header.frame) {
            frame.units.push(LayerUnit { place, header, tools });
        }
    }

    /// The tools that a unit uses; none where its header cannot be read, which is no error in a unit that decoders pass
    /// over.
    fn tools_of(&self, unit: &Unit<'_>) -> UsedTools {
        let Some(sequence) = &self.sequence else { return UsedTools::default() };
        let (payload, at) = (unit.payload, unit.payload_at);
        let elements: Result<(ShHeader, bool), Error> = match unit.header.unit_type() {
            UnitType::Increment => IncrementHeader::parse(payload, at, sequence)
                .map(|(header, _)| (header.sh(), header.predictor_count() > 0)),
            _ => RefinementHeader::parse(payload, at, sequence).map(|(header, _)| (header.sh(), false)),
        };
        let Ok((sh, predicts)) = elements else { return UsedTools::default() };
        let mut codebooks: Vec<usize> = sh
            .codebooks()
            .filter_map(|id| self.definitions.codebooks.get(usize::from(id)).copied().flatten())
            .collect();
        codebooks.dedup();
        UsedTools { codebooks, weights: self.definitions.weights.filter(|_| predicts) }
    }
}

/// Whether units of a type make up the frames of a profile.
fn is_of_frame(unit_type: UnitType, profile: Profile) -> bool {
    match profile {
        Profile::Intra => unit_type == UnitType::Refinement,
        Profile::Dynamic => unit_type == UnitType::Increment,
    }
}

impl Definitions {
    fn transforms(&self, header: &FrameHeader) -> Vec<usize> {
        let unit = |slots: &[Option<usize>; 16], id: u8| slots.get(usize::from(id)).copied().flatten();
        let sh = header.sh_transform().and_then(|id| unit(&self.sh, id));
        unit(&self.dc, header.dc_transform_id).into_iter().chain(sh).collect()
    }
}

impl UnitPlace {
    fn new(unit: usize, at: u64, header: &UnitHeader, damaged: bool) -> Self {
        Self { unit, at, bytes: UnitHeader::SIZE as u64 + u64::from(header.payload_length), damaged }
    }

    /// Offset of the byte after it.
    pub(crate) fn end(&self) -> u64 {
        self.at.saturating_add(self.bytes)
    }
}
