//! Cells of predicted frames: from the motion of Gaussians to the section of a frame header.

use super::Reference;
use super::deviation::Deviation;
use super::new_list::deltas;
use super::target::Target;
use super::unit::UnitCoder;
use crate::error::Error;
use crate::matching::{Cloud, Matching, Measure};
use crate::motion::follow::follow;
use crate::motion::stale_cells::{Held, stale_cells};
use crate::motion::{CellMotion, Pair, cell_motion};
use splatstream_decoder::displacement::CellField;
use splatstream_decoder::increment::field;
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::layout::Section;
use splatstream_decoder::list::{FINE, GaussianList};
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::payload::CellsBytes;
use splatstream_format::syntax::SequenceParameters;

/// The largest translation of a cell, steps / 8: the difference of two is below 2^16.
const MAX_TRANSLATION: i32 = (1 << 15) - 1;

/// The Gaussians of a reference as matching sees them.
pub(crate) struct ReferenceCloud {
    position: [Vec<f32>; 3],
    log_scale: [Vec<f32>; 3],
    opacity: Vec<f32>,
    dc: [Vec<f32>; 3],
    rows: Vec<u32>,
    row_count: u32,
    /// Fine positions.
    from: Vec<[i32; 3]>,
}

impl ReferenceCloud {
    #[expect(
        clippy::indexing_slicing,
        reason = "axes are constants; cells and Gaussians are counted by what they index"
    )]
    pub(crate) fn new(reference: &Reference, sequence: &SequenceParameters) -> Self {
        let lists = &reference.lists;
        let joined = |plane: &dyn Fn(&GaussianList) -> Vec<f32>| -> Vec<f32> {
            lists.iter().flat_map(plane).collect()
        };
        let axes = [0, 1, 2];
        let affine = |values: &[i32], offset: f32, step: f32| -> Vec<f32> {
            values.iter().map(|&q| offset + step * q as f32).collect()
        };
        let scale = (sequence.log_scale_offset(), sequence.log_scale_step());
        let from = |list: &GaussianList| {
            let [x, y, z] = &list.position_fine;
            x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z]).collect::<Vec<_>>()
        };
        Self {
            position: axes
                .map(|axis: usize| joined(&|list| affine(&list.position_fine[axis], 0.0, 1.0 / FINE as f32))),
            log_scale: axes
                .map(|axis: usize| joined(&|list| affine(&list.planes.log_scale[axis], scale.0, scale.1))),
            opacity: joined(&|list| {
                affine(&list.planes.opacity, sequence.opacity_offset(), sequence.opacity_step())
            }),
            dc: axes.map(|axis: usize| {
                joined(&|list| affine(&list.planes.dc[axis], 0.0, sequence.dc_step() / 64.0))
            }),
            rows: reference.rows.concat(),
            row_count: reference.row_count,
            from: lists.iter().flat_map(from).collect(),
        }
    }

    /// The same with the values of its source, as far as it is known what it differs by.
    pub(crate) fn of_source(reference: &Reference, sequence: &SequenceParameters) -> Self {
        let mut cloud = Self::new(reference, sequence);
        if let Some(Deviation { position, log_scale, opacity, colours, .. }) = &reference.deviation {
            let own = cloud.position.iter_mut().chain(&mut cloud.log_scale).chain([&mut cloud.opacity]);
            let off = position.iter().chain(log_scale).chain([opacity]).chain(colours);
            for (own, off) in own.chain(&mut cloud.dc).zip(off) {
                own.iter_mut().zip(off).for_each(|(value, off)| *value -= off);
            }
        }
        cloud
    }

    fn cloud<'a>(&'a self, position: &'a [Vec<f32>; 3]) -> Cloud<'a> {
        let slices = |planes: &'a [Vec<f32>; 3]| planes.each_ref().map(Vec::as_slice);
        Cloud {
            position: slices(position),
            log_scale: slices(&self.log_scale),
            opacity: &self.opacity,
            dc: slices(&self.dc),
            row: &self.rows,
            row_count: self.row_count,
        }
    }

    /// Which Gaussian of a target continues each.
    pub(crate) fn matching(&self, target: &Target, measure: &Measure, position_bits: u8) -> Matching {
        follow(&self.cloud(&self.position), &target.cloud(), measure, position_bits)
    }

    /// How cells move, and which are stale.
    #[expect(
        clippy::indexing_slicing,
        reason = "axes are constants; cells and Gaussians are counted by what they index"
    )]
    fn motion(
        &self,
        target: &Target,
        matching: &Matching,
        plan: &CellPlan<'_>,
        position_bits: u8,
    ) -> CellMotion {
        let mut pairs = Vec::new();
        let mut unmatched = Vec::new();
        for (&from, partner) in self.from.iter().zip(&matching.target_of) {
            match *partner {
                Some(index) => {
                    let to = target.position.each_ref().map(|plane| plane[index as usize]);
                    pairs.push(Pair { from, to });
                }
                None => unmatched.push(from),
            }
        }
        let motion = cell_motion(&pairs, &unmatched, position_bits);
        if !plan.marks_stale {
            return motion;
        }
        let mut displaced = [const { Vec::new() }; 3];
        for &from in &self.from {
            let to = motion.displaced(from);
            displaced.iter_mut().zip(to).for_each(|(plane, value): (&mut Vec<f32>, f32)| plane.push(value));
        }
        let held = Held { carried: self.cloud(&displaced), from: &self.from, matching };
        let stale = stale_cells(&motion, &held, &target.cloud(), plan.measure);
        motion.with_stale(&stale)
    }
}

/// How the cells of a frame are found.
pub(crate) struct CellPlan<'a> {
    pub(crate) measure: &'a Measure,
    /// Whether cells are marked in which what is carried shall not be shown.
    pub(crate) marks_stale: bool,
    /// Cells that a frame may have.
    pub(crate) max_cells: u32,
}

/// How the cells of a frame move the Gaussians of its reference, and the coded cells. `models`: those in force before
/// the frame, and after it.
///
/// # Errors
/// A value that no token codes.
pub(crate) fn code_cells(
    coder: &UnitCoder<'_>,
    (reference, target): (&Reference, &Target),
    matching: &Matching,
    plan: &CellPlan<'_>,
    models: &mut ModelsInForce,
) -> Result<(CellField, Option<CellsBytes>), Error> {
    let sequence = coder.sequence;
    let cloud = ReferenceCloud::new(reference, sequence);
    let mut motion = cloud.motion(target, matching, plan, sequence.position_bits);
    // What differs more from cell to cell, no token codes.
    motion.cells.retain(|cell| cell.translation.iter().all(|part| part.abs() <= MAX_TRANSLATION));
    motion.cells.truncate(plan.max_cells as usize);
    if motion.cells.is_empty() {
        return Ok((CellField::default(), None));
    }
    let values = cell_values(&motion, coder.block());
    let field = field(&values, motion.cell_log2, sequence, 0)?;
    let drafted = coder.section_draft(Section::Cells, &values, coder.steps([0; 5]), models);
    let section = drafted.code(Section::Cells, &values, &coder.plan, models)?;
    let (cell_count, cell_log2) = (motion.cells.len() as u32, motion.cell_log2);
    Ok((field, Some(CellsBytes { cell_count, cell_log2, section })))
}

#[expect(
    clippy::indexing_slicing,
    reason = "axes are constants; cells and Gaussians are counted by what they index"
)]
#[expect(clippy::arithmetic_side_effects, reason = "values of cells are within the ranges of clause 6")]
fn cell_values(motion: &CellMotion, block: usize) -> SectionValues {
    let codes: Vec<u64> = motion.cells.iter().map(|cell| cell.code).collect();
    let stale = motion.cells.iter().map(|cell| i32::from(cell.stale)).collect();
    let mut planes = vec![stale];
    for part in 0..6_usize {
        let of = |index: usize| {
            let cell = &motion.cells[index];
            if part < 3 { cell.translation[part] } else { cell.rotation[part - 3] }
        };
        let difference =
            |index: usize| of(index) - if index.is_multiple_of(block) { 0 } else { of(index - 1) };
        planes.push((0..codes.len()).map(difference).collect());
    }
    SectionValues { deltas: deltas(&codes, block), planes, block }
}
