//! What each unit needs to be decoded, beside the units of the whole stream: clauses 7.1 to 7.7.

mod dot;
mod text;

use super::Shown;
use crate::console::Console;
use crate::failure::{Failure, StreamFault};
use crate::stream_file::StreamFile;
use serde::Serialize;
use splatstream_format::Limits;
use splatstream_format::syntax::Profile;
use splatstream_stream::structure::{self, Frame, Gop, Increment, Structure, Tool};

/// What `--json` prints.
#[derive(Serialize)]
struct Dependencies {
    profile: Option<&'static str>,
    gops: Vec<GopRow>,
    error: Option<StreamFault>,
}

/// A group of pictures.
#[derive(Serialize)]
struct GopRow {
    gop: u32,
    unit: usize,
    at: u64,
    first_frame: u32,
    frame_count: u32,
    predicted: bool,
    temporal_depth: u8,
    tools: Vec<ToolRow>,
    frames: Vec<FrameRow>,
}

/// A transform, codebook or weights unit.
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
    damaged: bool,
    transforms: Vec<usize>,
    units: Vec<UnitRow>,
}

/// An increment.
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
        profile: structure.profile.map(Profile::name),
        gops: structure.gops.iter().map(|gop| GopRow::new(&structure, gop)).collect(),
        error: structure.error.map(StreamFault::from),
    };
    console.report(&dependencies, || {
        if as_dot { dot::graph(&dependencies) } else { text::list(&dependencies) }
    })?;
    Ok(structure.error)
}

impl GopRow {
    fn new(structure: &Structure, gop: &Gop) -> Self {
        Self {
            gop: gop.header.gop_index,
            unit: gop.span.unit,
            at: gop.span.at,
            first_frame: gop.first_frame,
            frame_count: gop.header.gop_frame_count,
            predicted: gop.header.is_predicted(),
            temporal_depth: gop.header.temporal_depth,
            tools: gop.tools.iter().map(ToolRow::from).collect(),
            frames: gop.frames.iter().map(|frame| FrameRow::new(structure, gop, frame)).collect(),
        }
    }
}

impl From<structure::Need> for Need {
    fn from(need: structure::Need) -> Self {
        let structure::Need { frame, spatial_layer, refinement, unit } = need;
        Self { frame, spatial_layer, refinement, unit }
    }
}

impl From<&Tool> for ToolRow {
    fn from(tool: &Tool) -> Self {
        Self {
            unit: tool.span.unit,
            kind: tool.unit_type.name(),
            at: tool.span.at,
            bytes: tool.span.bytes,
            temporal_layer: tool.temporal_layer,
            damaged: tool.span.damaged,
            frames_before: tool.frames_before,
        }
    }
}

impl FrameRow {
    fn new(structure: &Structure, gop: &Gop, frame: &Frame) -> Self {
        let reference = gop.reference(frame);
        let unit = |increment: &Increment| UnitRow {
            unit: increment.span.unit,
            at: increment.span.at,
            bytes: increment.span.bytes,
            spatial_layer: increment.header.spatial_layer,
            refinement: increment.header.refinement,
            damaged: increment.span.damaged,
            needs: structure.needs(gop, frame, increment).into_iter().map(Need::from).collect(),
            codebooks: increment.tools.codebooks.clone(),
            weights: increment.tools.weights,
        };
        Self {
            frame: frame.index,
            kind: frame.role.frame_type.name(),
            temporal_layer: frame.role.temporal_layer,
            reference,
            reference_present: reference.map(|index| gop.frame(index).is_some()),
            unit: frame.span.unit,
            damaged: frame.span.damaged,
            transforms: frame.transforms.clone(),
            units: frame.increments.iter().map(unit).collect(),
        }
    }
}
