//! Codes a section of an increment: values to models and blocks.

use crate::blocks::code_blocks;
use crate::error::Error;
use crate::models;
use crate::settings::{Preset, Tools};
use rayon::prelude::*;
use splatstream_decoder::block::CodedBlock;
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::layout::{Attribute, Layout, PlaneInfo, Section};
use splatstream_format::entropy::in_force::{ModelsInForce, SectionModels};
use splatstream_format::entropy::model::write_models;
use splatstream_format::entropy::token::Alphabet;
use splatstream_format::payload::SectionBytes;

/// How sections are coded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SectionPlan {
    /// log2 of the values of a plane in a block.
    pub(crate) block_log2: u8,
    /// How much to search.
    pub(crate) preset: Preset,
    /// What may be used.
    pub(crate) tools: Tools,
}

/// Codes the values of a section and puts its models in force.
///
/// # Errors
/// A value that no token codes.
pub(crate) fn code_section(
    section: Section,
    layout: &Layout,
    values: &SectionValues,
    plan: &SectionPlan,
    in_force: &mut ModelsInForce,
) -> Result<SectionBytes, Error> {
    let known = in_force.get(section).filter(|known| plan.tools.table_reuse && known.layout == *layout);
    let biases = biases(section, layout, values, known);
    let blocks = blocks(layout, values, &biases, 1 << plan.block_log2);
    let own = models::choose_all(layout.planes(), &blocks, &biases, plan.preset, plan.tools);
    let before = known.map(|known| known.models.as_slice());
    let chosen = models::cheapest(own, before, layout.planes(), &blocks);
    let model = write_models(&chosen, &layout.alphabets(), before);
    let (lanes_log2, blocks) = code_blocks(layout.planes(), &chosen, &blocks)?;
    in_force.replace(section, SectionModels { layout: layout.clone(), models: chosen });
    Ok(SectionBytes { lanes_log2, model, blocks })
}

/// What is taken off each plane: the mean for whole Gaussians, nothing for residuals. Those of the models in
/// force, so that they can be used again.
fn biases(
    section: Section,
    layout: &Layout,
    values: &SectionValues,
    known: Option<&SectionModels>,
) -> Vec<i32> {
    if let Some(known) = known {
        return known.models.iter().map(|model| model.bias).collect();
    }
    let first = value_plane(layout);
    let mean = |(plane, info): (usize, &PlaneInfo)| {
        let values = plane.checked_sub(first).and_then(|plane| values.planes.get(plane));
        let values = values.filter(|_| section == Section::New && info.alphabet == Alphabet::Attribute);
        values.map_or(0, |values| {
            let count = values.len().max(1) as i64;
            let sum: i64 = values.iter().map(|&value| i64::from(value)).sum();
            (2 * sum + count).div_euclid(2 * count) as i32
        })
    };
    layout.planes().iter().enumerate().map(mean).collect()
}

/// The first plane that is not of the position alphabet.
fn value_plane(layout: &Layout) -> usize {
    usize::from(layout.planes().first().is_some_and(PlaneInfo::is_position))
}

fn blocks(layout: &Layout, values: &SectionValues, biases: &[i32], size: usize) -> Vec<CodedBlock> {
    let first = value_plane(layout);
    let count = if first == 1 { values.deltas.len() } else { values.planes.first().map_or(0, Vec::len) };
    let starts: Vec<usize> = (0..count).step_by(size).collect();
    let of_start = |&start: &usize| {
        let end = count.min(start + size);
        let deltas = if first == 1 { values.deltas[start..end].to_vec() } else { vec![0; end - start] };
        let mut block = CodedBlock::new(deltas);
        for (plane, (&info, &bias)) in layout.planes().iter().zip(biases).enumerate() {
            let coded = match plane.checked_sub(first) {
                Some(plane) => values.planes[plane][start..end].iter().map(|value| value - bias).collect(),
                None => Vec::new(),
            };
            keep_for_contexts(&mut block, info, &coded, bias);
            block.push(info, coded);
        }
        block
    };
    starts.par_iter().map(of_start).collect()
}

/// Clause 8.5: log-scales and opacity as contexts see them, without prediction or shift.
fn keep_for_contexts(block: &mut CodedBlock, info: PlaneInfo, coded: &[i32], bias: i32) {
    let place = usize::from(info.place);
    let values = coded.iter().map(|value| value + bias);
    match info.attribute {
        Attribute::LogScale if place == 0 => block.log_scale[0] = values.collect(),
        Attribute::LogScale => {
            block.log_scale[place] =
                block.log_scale[place - 1].iter().zip(values).map(|(a, v)| a - v).collect();
        }
        Attribute::Opacity => block.opacity = values.collect(),
        _ => {}
    }
}
