//! Payloads whose extent depends on their elements, divided into sections: clauses 5.6 to 5.10 and 5.14 to 5.17.
//!
//! The fixed records are deku's ([`crate::syntax`]); what follows them is read element by element. A section cannot
//! be read past its end, and what is left over is an error.

use crate::Result;
use crate::syntax::reader::Reader;
use crate::syntax::{Table, after};

mod codebook;
mod frame;
mod increment;
mod index;
mod operating_points;
mod scene_description;
mod section;
mod transform;
mod weights;

pub use crate::syntax::reader::{leb128, write_leb128};
pub use codebook::Codebook;
pub use frame::{Cells, CellsBytes, FramePayload, write_frame};
pub use increment::{Increment, write_increment};
pub use index::Index;
pub use operating_points::OperatingPoints;
pub use scene_description::{ColourSpace, SceneDescription, Sorting, UpAxis};
pub use section::{CodedSection, SectionBytes};
pub use transform::Transform;
pub use weights::{Layer, Network, Part, REGISTRY, Weights};

/// A row of a syntax table whose extent or presence depends on other elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VariableRow {
    /// The record it belongs to.
    pub record: &'static str,
    /// The syntax element, as the specification spells it.
    pub name: &'static str,
    /// Its type, as the specification spells it.
    pub type_name: &'static str,
    /// What it is, in a line.
    pub meaning: &'static str,
    /// The clause of its syntax table.
    pub clause: &'static str,
}

const fn row(
    clause: &'static str,
    record: &'static str,
    name: &'static str,
    type_name: &'static str,
    meaning: &'static str,
) -> VariableRow {
    VariableRow { record, name, type_name, meaning, clause }
}

/// The rows after the fixed part of the records, in the order of clause 5.
pub const VARIABLE_ROWS: [VariableRow; 42] = [
    row("5.6", "frame_header", "carried_digest", "u64", "digest of the carried lists"),
    row("5.6", "frame_header", "cell_count", "leb128", "cells that move or are stale"),
    row("5.6", "frame_header", "cell_log2", "u8", "log2 of the side of a cell in grid steps"),
    row("5.6", "frame_header", "cells", "section", "how cells move"),
    row("5.7", "transform", "mean", "i32[dimension]", "output of components 0, step/64"),
    row("5.7", "transform", "basis", "i16[rank*dimension]", "weights, Q12, component by component"),
    row(
        "5.8",
        "codebook",
        "entries",
        "u8[(entry_count_minus1 + 1) * component_count * value_bytes]",
        "values, entry by entry",
    ),
    row("5.9", "scene_description", "metres_per_unit", "f32", "metres of a scene unit"),
    row("5.9", "scene_description", "background", "f32[3]", "red, green, blue, 0 to 1"),
    row("5.9", "scene_description", "bounds_min", "f32[3]", "smallest position"),
    row("5.9", "scene_description", "bounds_max", "f32[3]", "largest position"),
    row("5.9", "scene_description", "title_length", "leb128", "bytes of the title, 1 to 1024"),
    row("5.9", "scene_description", "title", "u8[title_length]", "UTF-8"),
    row("5.9", "scene_description", "camera_count", "leb128", "cameras, 1 to 64"),
    row("5.9", "scene_description", "cameras", "camera[camera_count]", "from where the scene may be viewed"),
    row("5.10", "index", "entries", "index_entry[entry_count]", "one for each GOP"),
    row("5.14", "increment", "parent_count", "leb128", "Gaussians that the unit may change"),
    row("5.14", "increment", "move_count", "leb128", "parents with a position residual"),
    row("5.14", "increment", "update_count", "leb128", "parents with attribute residuals"),
    row("5.14", "increment", "remove_count", "leb128", "parents that are removed"),
    row("5.14", "increment", "new_count", "leb128", "Gaussians that the unit adds"),
    row("5.14", "increment", "position_shift", "u8", "low bits of positions that are not coded"),
    row(
        "5.14",
        "increment",
        "attribute_step",
        "u8[5]",
        "exponents of the steps of log_scale, opacity, rotation, dc and sh",
    ),
    row(
        "5.14",
        "increment",
        "predictor_block_log2",
        "u8",
        "log2 of the new Gaussians that share a predictor",
    ),
    row("5.14", "increment", "neighbour_count", "u8", "neighbours of a prediction, 1 to 16"),
    row("5.14", "increment", "bilateral_spatial", "u8", "weight of distance in the bilateral predictor"),
    row("5.14", "increment", "bilateral_feature", "u8", "weight of differences in the bilateral predictor"),
    row("5.14", "increment", "sh_mode", "u8", "1 is coefficients, 2 is vector quantised"),
    row("5.14", "increment", "vq_stage_count", "u8", "stages of vector quantisation, 1 to 4"),
    row("5.14", "increment", "codebook_ids", "u8[vq_stage_count]", "codebooks of the stages, 0 to 15"),
    row(
        "5.14",
        "increment",
        "compensation_log_scale",
        "i8",
        "added to log-scales of an incomplete frame, steps",
    ),
    row(
        "5.14",
        "increment",
        "compensation_opacity",
        "i8",
        "added to opacities of an incomplete frame, steps",
    ),
    row("5.14", "increment", "move_block_log2", "u8", "log2 of the moves that share a predictor"),
    row("5.14", "increment", "sections", "section[...]", "sections with a count above 0"),
    row("5.15", "section", "lanes_log2", "u8", "log2 of the entropy states of a block, 0 to 5"),
    row("5.15", "section", "model_length", "leb128", "bytes of models"),
    row("5.15", "section", "models", "u8[model_length]", "the models of the planes"),
    row("5.15", "section", "block_length", "leb128[block_count]", "bytes of each block"),
    row("5.15", "section", "blocks", "u8[...]", "entropy-coded values"),
    row("5.16", "operating_points", "entries", "operating_point[point_count]", "one for each point"),
    row("5.17", "weights", "model", "u8[...]", "a network, or the SHA-256 of one"),
    row("5.17.1", "network", "parameters", "u8[...]", "weights and biases, part by part"),
];

/// A reader of what follows the fixed part of a record; `at` is the offset of the record.
fn after_fixed_part<'a, 't>(table: &Table, rest: &'a [u8], at: u64) -> Reader<'a, 't> {
    let mut reader = Reader::new(rest, after(at, table.size()));
    reader.record(table.name, table.syntax);
    reader
}

/// The one element, of `length` bytes, that follows the fixed part of a record.
fn only<'a>(
    table: &Table,
    rest: &'a [u8],
    at: u64,
    element: &'static str,
    length: usize,
) -> Result<&'a [u8]> {
    let mut reader = after_fixed_part(table, rest, at);
    let bytes = reader.take(element, length)?;
    reader.end()?;
    Ok(bytes)
}

/// `usize` of a number that the bytes present bound anyway: too large a one does not fit there either.
fn length(value: u32) -> usize {
    usize::try_from(value).unwrap_or(usize::MAX)
}
