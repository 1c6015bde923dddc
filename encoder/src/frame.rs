//! Codes one frame: importance, units, Morton order, blocks.

use crate::blocks::code_blocks;
use crate::error::Error;
use crate::lattice::Geometry;
use crate::models;
use crate::settings::{Preset, Tools};
use rayon::prelude::*;
use splatstream_decoder::block::{CodedBlock, UnitParameters, reconstruct};
use splatstream_decoder::digest::{UnitDigest, frame_digest, unit_digest};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::layout::{Attribute, PlaneInfo};
use splatstream_decoder::position::morton;
use splatstream_format::entropy::model::{PlaneModel, write_models};
use splatstream_format::entropy::token::Alphabet;
use splatstream_format::payload::write_refinement;
use splatstream_format::syntax::{RefinementHeader, SequenceParameters, ShHeader};

/// Gaussians of a unit above which tables of its own always pay.
const MANY: usize = 1 << 15;

/// A frame on the lattices, all colour components included, in the order of the source.
pub(crate) struct CodedFrame {
    /// Everything but colour.
    pub(crate) geometry: Geometry,
    /// Components of the dc transform.
    pub(crate) dc: Vec<Vec<i32>>,
    /// Components of the sh transform, or codebook indices.
    pub(crate) sh: Vec<Vec<i32>>,
    /// The Gaussians, most important first.
    pub(crate) order: Vec<u32>,
}

/// A frame's refinement units, ready to be wrapped.
pub(crate) struct FrameUnits {
    /// Payloads by refinement.
    pub(crate) payloads: Vec<Vec<u8>>,
    /// Digest of the whole frame.
    pub(crate) digest: u64,
}

/// How the units of a frame are coded.
pub(crate) struct UnitPlan<'a> {
    /// What the decoder will know of each unit; lanes_log2 is set for each unit.
    pub(crate) parameters: UnitParameters<'a>,
    /// How SH is coded.
    pub(crate) sh: ShHeader,
    /// The parameters of the sequence.
    pub(crate) sequence: &'a SequenceParameters,
    /// How much to search.
    pub(crate) preset: Preset,
    /// What may be used.
    pub(crate) tools: Tools,
}

/// Codes all refinement units of a frame.
///
/// # Errors
/// What the decoder's own checks refuse.
pub(crate) fn code_frame(frame: &CodedFrame, plan: &UnitPlan<'_>) -> Result<FrameUnits, Error> {
    let units = divided(frame, plan);
    let biases = biases(frame, plan.parameters.layout.planes());
    let coded: Vec<CodedUnit> = units
        .par_iter()
        .map(|indices| code_unit(frame, indices, &biases, plan))
        .collect::<Result<_, Error>>()?;
    let mut digests: Vec<UnitDigest> = Vec::new();
    let mut payloads = Vec::new();
    let mut previous: Option<Vec<PlaneModel>> = None;
    for CodedUnit { blocks, models: own, digest } in coded {
        digests.push(digest);
        let before = previous.as_deref().filter(|_| plan.tools.table_reuse);
        let tried = before.filter(|_| blocks.iter().map(CodedBlock::len).sum::<usize>() <= MANY);
        let models = models::cheapest(own, tried, plan.parameters.layout.planes(), &blocks);
        payloads.push(payload(&blocks, &models, before, plan, frame_digest(&digests))?);
        // A unit without Gaussians carries no models, and leaves those before it in force.
        if !blocks.is_empty() {
            previous = Some(models);
        }
    }
    Ok(FrameUnits { payloads, digest: frame_digest(&digests) })
}

/// The Gaussians of each refinement, in Morton order.
fn divided(frame: &CodedFrame, plan: &UnitPlan<'_>) -> Vec<Vec<(u64, u32)>> {
    let [x, y, z] = &frame.geometry.position;
    let shift = u32::from(plan.parameters.position_shift);
    let total = frame.order.len() as u32;
    let mut rest = frame.order.as_slice();
    let mut units = Vec::new();
    for refinement in 0..plan.sequence.refinement_count {
        let (unit, after) = rest.split_at(plan.sequence.refinement_length(refinement, total) as usize);
        rest = after;
        let code = |&index: &u32| {
            let place = index as usize;
            (morton(x[place] >> shift, y[place] >> shift, z[place] >> shift), index)
        };
        let mut sorted: Vec<(u64, u32)> = unit.par_iter().map(code).collect();
        sorted.par_sort_unstable();
        units.push(sorted);
    }
    units
}

struct CodedUnit {
    blocks: Vec<CodedBlock>,
    models: Vec<PlaneModel>,
    digest: UnitDigest,
}

fn code_unit(
    frame: &CodedFrame,
    indices: &[(u64, u32)],
    biases: &[i32],
    plan: &UnitPlan<'_>,
) -> Result<CodedUnit, Error> {
    let planes = plan.parameters.layout.planes();
    let blocks: Vec<CodedBlock> = indices
        .par_chunks(1 << plan.sequence.block_log2)
        .map(|part| gathered(frame, part, planes, biases))
        .collect();
    let models = if blocks.is_empty() {
        Vec::new()
    } else {
        models::choose_all(planes, &blocks, biases, plan.preset, plan.tools)
    };
    let sh_planes = usize::from(plan.sequence.sh_dimension());
    let mut reconstruction = QuantizedFrame::zeroed(indices.len(), sh_planes);
    let lengths: Vec<usize> = blocks.iter().map(CodedBlock::len).collect();
    let outputs = reconstruction.slices(&lengths);
    blocks
        .par_iter()
        .zip(outputs)
        .try_for_each(|(block, mut out)| reconstruct(block, &plan.parameters, biases, 0, &mut out))?;
    let digest = unit_digest(&reconstruction, 0..indices.len());
    Ok(CodedUnit { blocks, models, digest })
}

/// The values of a block, bias taken off.
fn gathered(frame: &CodedFrame, part: &[(u64, u32)], planes: &[PlaneInfo], biases: &[i32]) -> CodedBlock {
    let pick = |plane: &[i32]| -> Vec<i32> { part.iter().map(|&(_, index)| plane[index as usize]).collect() };
    let mut before = 0;
    let deltas = part
        .iter()
        .map(|&(code, _)| {
            let delta = code - before;
            before = code;
            delta
        })
        .collect();
    let geometry = &frame.geometry;
    let log_scale = geometry.log_scale.each_ref().map(|plane| pick(plane));
    let mut block = CodedBlock::new(deltas);
    for (&info, &bias) in planes.iter().zip(biases) {
        let place = usize::from(info.place);
        let mut values = match info.attribute {
            Attribute::Position => Vec::new(),
            Attribute::LogScale if place == 0 => log_scale[0].clone(),
            Attribute::LogScale => {
                log_scale[place - 1].iter().zip(&log_scale[place]).map(|(a, b)| a - b).collect()
            }
            Attribute::Opacity => pick(&geometry.opacity),
            Attribute::Rotation => pick(&geometry.rotation[place]),
            Attribute::Dc => pick(&frame.dc[place]),
            Attribute::Sh => pick(&frame.sh[place]),
            _ => Vec::new(),
        };
        values.iter_mut().for_each(|value| *value -= bias);
        block.push(info, values);
    }
    block.log_scale = log_scale;
    block.opacity = pick(&geometry.opacity);
    block
}

/// The mean of each plane over the frame, rounded; 0 for positions and indices.
///
/// One bias for all units of a frame: so that a unit may reuse the models of the one before.
fn biases(frame: &CodedFrame, planes: &[PlaneInfo]) -> Vec<i32> {
    let geometry = &frame.geometry;
    let sum = |plane: &[i32]| plane.iter().map(|&value| i64::from(value)).sum::<i64>();
    let count = geometry.opacity.len().max(1) as i64;
    let of_plane = |info: &PlaneInfo| {
        let place = usize::from(info.place);
        let total = match (info.alphabet, info.attribute) {
            (Alphabet::Position | Alphabet::Index, _) | (_, Attribute::Position) => 0,
            (_, Attribute::LogScale) if place == 0 => sum(&geometry.log_scale[0]),
            (_, Attribute::LogScale) => sum(&geometry.log_scale[place - 1]) - sum(&geometry.log_scale[place]),
            (_, Attribute::Opacity) => sum(&geometry.opacity),
            (_, Attribute::Rotation) => sum(&geometry.rotation[place]),
            (_, Attribute::Dc) => sum(&frame.dc[place]),
            (_, Attribute::Sh) => sum(&frame.sh[place]),
            _ => 0,
        };
        (2 * total + count).div_euclid(2 * count) as i32
    };
    planes.iter().map(of_plane).collect()
}

fn payload(
    blocks: &[CodedBlock],
    models: &[PlaneModel],
    previous: Option<&[PlaneModel]>,
    plan: &UnitPlan<'_>,
    digest: u64,
) -> Result<Vec<u8>, Error> {
    let layout = plan.parameters.layout;
    let count: usize = blocks.iter().map(CodedBlock::len).sum();
    let (lanes_log2, blocks) = code_blocks(layout.planes(), models, blocks)?;
    let section =
        if blocks.is_empty() { Vec::new() } else { write_models(models, &layout.alphabets(), previous) };
    let ShHeader { sh_mode, vq_stage_count, codebook_ids } = plan.sh;
    let header = RefinementHeader {
        refinement_digest: digest,
        gaussian_count: count as u32,
        position_shift: plan.parameters.position_shift,
        lanes_log2,
        sh_mode,
        vq_stage_count,
        codebook_ids,
    };
    Ok(write_refinement(&header, plan.sequence, &section, &blocks)?)
}
