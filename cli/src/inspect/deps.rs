//! What each unit needs to be decoded, beside the units of the whole stream: clauses 7.13 to 7.17.

mod dot;
mod text;

use super::Shown;
use crate::console::Console;
use crate::failure::{Failure, StreamFault};
use crate::stream_file::StreamFile;
use crate::structure::{Frame, Group, LayerUnit, Structure, Tool};
use serde::Serialize;
use splatstream_format::Limits;

/// What `--json` prints.
#[derive(Serialize)]
struct Dependencies {
    profile: Option<&'static str>,
    groups: Vec<GroupRow>,
    error: Option<StreamFault>,
}

/// A group of pictures.
#[derive(Serialize)]
struct GroupRow {
    group: u32,
    unit: usize,
    at: u64,
    first_frame: u32,
    frame_count: u32,
    predicted: bool,
    temporal_depth: u8,
    tools: Vec<ToolRow>,
    frames: Vec<FrameRow>,
}

/// A transform or codebook.
#[derive(Serialize)]
struct ToolRow {
    unit: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    at: u64,
    bytes: u64,
    temporal_layer: u8,
    damaged: bool,
    #[serde(skip)]
    frames_before: usize,
}

/// A frame.
#[derive(Serialize)]
struct FrameRow {
    frame: u32,
    #[serde(rename = "type")]
    kind: &'static str,
    temporal_layer: u8,
    reference: Option<u32>,
    /// Whether the frame it refers to is in the stream.
    reference_present: Option<bool>,
    unit: usize,
    transforms: Vec<usize>,
    units: Vec<UnitRow>,
}

/// A refinement unit or increment.
#[derive(Serialize)]
struct UnitRow {
    unit: usize,
    at: u64,
    bytes: u64,
    spatial_layer: u8,
    refinement: u8,
    damaged: bool,
    needs: Vec<Need>,
    codebooks: Vec<usize>,
    weights: Option<usize>,
}

/// A unit that another needs; those that this one needs are needed too.
#[derive(Serialize)]
struct Need {
    frame: u32,
    spatial_layer: u8,
    refinement: u8,
    /// Its number; none if it is not in the stream.
    unit: Option<usize>,
}

/// Shows the dependencies as far as the stream can be divided.
pub(super) fn show(stream: &StreamFile, as_dot: bool, limits: &Limits, console: &Console) -> Shown {
    if as_dot && console.is_json() {
        return Err(Failure::Usage("--dot and --json are two forms of the same: give one".to_owned()));
    }
    let structure = Structure::of(&stream.bytes, limits);
    let dependencies = Dependencies {
        profile: structure.profile.map(splatstream_format::syntax::Profile::name),
        groups: structure.groups.iter().map(|group| GroupRow::new(&structure, group)).collect(),
        error: structure.error.map(StreamFault::from),
    };
    console.report(&dependencies, || {
        if as_dot { dot::graph(&dependencies) } else { text::list(&dependencies) }
    })?;
    Ok(structure.error)
}

impl GroupRow {
    fn new(structure: &Structure, group: &Group) -> Self {
        Self {
            group: group.header.gop_index,
            unit: group.place.unit,
            at: group.place.at,
            first_frame: group.first_frame,
            frame_count: group.header.gop_frame_count,
            predicted: group.header.is_predicted(),
            temporal_depth: group.header.temporal_depth,
            tools: group.tools.iter().map(ToolRow::from).collect(),
            frames: group.frames.iter().map(|frame| FrameRow::new(structure, group, frame)).collect(),
        }
    }
}

impl From<&Tool> for ToolRow {
    fn from(tool: &Tool) -> Self {
        Self {
            unit: tool.place.unit,
            kind: tool.unit_type.name(),
            at: tool.place.at,
            bytes: tool.place.bytes,
            temporal_layer: tool.temporal_layer,
            damaged: tool.place.damaged,
            frames_before: tool.frames_before,
        }
    }
}

impl FrameRow {
    fn new(structure: &Structure, group: &Group, frame: &Frame) -> Self {
        let reference = group.reference(frame);
        let unit = |unit: &LayerUnit| UnitRow {
            unit: unit.place.unit,
            at: unit.place.at,
            bytes: unit.place.bytes,
            spatial_layer: unit.header.spatial_layer,
            refinement: unit.header.refinement,
            damaged: unit.place.damaged,
            needs: needs(structure, group, frame, unit),
            codebooks: unit.tools.codebooks.clone(),
            weights: unit.tools.weights,
        };
        Self {
            frame: frame.number,
            kind: frame.coding.frame_type.name(),
            temporal_layer: frame.coding.temporal_layer,
            reference,
            reference_present: reference.map(|number| group.frame(number).is_some()),
            unit: frame.place.unit,
            transforms: frame.transforms.clone(),
            units: frame.units.iter().map(unit).collect(),
        }
    }
}

/// What a unit needs at once. In an intra frame the refinement before it and its parents, one layer below; in other
/// frames the refinement before it and the same refinement of the reference frame, of an intra frame all units,
/// which the last of them stands for.
fn needs(structure: &Structure, group: &Group, frame: &Frame, unit: &LayerUnit) -> Vec<Need> {
    let (spatial, refinement) = (unit.header.spatial_layer, unit.header.refinement);
    let mut needs = Vec::new();
    let mut add = |number: u32, spatial_layer: u8, refinement: u8| {
        let same = |unit: &&LayerUnit| {
            (unit.header.spatial_layer, unit.header.refinement) == (spatial_layer, refinement)
        };
        let found = group.frame(number).and_then(|frame| frame.units.iter().find(same));
        let unit = found.map(|unit| unit.place.unit);
        needs.push(Need { frame: number, spatial_layer, refinement, unit });
    };
    if let Some(before) = refinement.checked_sub(1) {
        add(frame.number, spatial, before);
    }
    match group.reference(frame) {
        None => {
            if let Some(below) = spatial.checked_sub(1) {
                add(frame.number, below, refinement);
            }
        }
        Some(number) if number == group.first_frame => {
            let refinements = structure.sequence.map_or(1, |sequence| sequence.refinement_count);
            add(number, structure.top(), refinements.saturating_sub(1));
        }
        Some(number) => add(number, structure.top(), refinement),
    }
    needs
}
