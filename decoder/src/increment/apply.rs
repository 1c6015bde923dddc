//! Clause 7.4: how a unit changes its parents and adds to them.
//!
//! 1. The modes say which parents are moved, updated, both, removed or skipped. Moves and updates are applied.
//! 2. The predictors of the new Gaussians are read, and the reference set is collected if one of them needs it.
//! 3. Removed parents go, and the new Gaussians, predicted and corrected by their residuals, are appended.
//!
//! Before the first step it is established that every section has a value for each Gaussian that it is of, and there is a
//! mode for each parent. Sums do not wrap (annex F.4).

use super::prediction::{Predicting, Prediction};
use super::residual::{AttributeCoding, AttributeValues, Attributes};
use super::values::{SectionValues, UnitValues};
use crate::attribute::{ATTRIBUTE_RANGE, in_range};
use crate::cell::{Cell, rotation_unit};
use crate::cores;
use crate::displacement::CellField;
use crate::fault;
use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use crate::list::{FINE, GaussianList};
use crate::moves::{MovePredictor, MoveSpace, Moves, SpanRatio};
use crate::position::{collect, positions};
use crate::predictor::Predictor;
use crate::stage::Stage;
use core::ops::RangeInclusive;
use splatstream_format::entropy::layout::Section;
use splatstream_format::payload::Network;
use splatstream_format::syntax::{IncrementHeader, SequenceParameters};
use splatstream_format::{Error, ErrorKind, Limits, Result};

/// Bits of the mode of a parent; a removal has no other bit.
const HAS_MOVE: i32 = 1;
const HAS_UPDATE: i32 = 2;
const REMOVED: i32 = 4;

/// The values of a translation, in eighths of a grid step, and of a cell rotation, Q14.
const TRANSLATION_RANGE: RangeInclusive<i32> = -(1 << 20)..=1 << 20;
const CELL_ROTATION_RANGE: RangeInclusive<i32> = -(1 << 13)..=1 << 13;

/// New Gaussians reconstructed by one task.
const RUN: usize = 4096;

/// A unit to apply.
#[derive(Debug, Clone, Copy)]
pub struct Unit<'a> {
    /// The fixed part.
    pub header: &'a IncrementHeader,
    /// The sections.
    pub values: &'a UnitValues,
    /// How attributes are coded.
    pub coding: AttributeCoding<'a>,
    /// The sequence.
    pub sequence: &'a SequenceParameters,
    /// The learned predictor of the GOP.
    pub network: Option<&'a Network>,
    /// How many new Gaussians the network may predict (A.2).
    pub max_learned: u32,
    /// Absolute offset of the payload, for errors.
    pub at: u64,
}

/// What a unit predicts from besides its parents.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// What the reference set holds besides the parents: before them and after them.
    pub around: [&'a [&'a QuantizedFrame]; 2],
    /// What the parents come from in a P or B frame, where they take part as they come; none in an I frame, where they
    /// take part as the unit leaves them.
    pub temporal: Option<Temporal<'a>>,
}

/// What the parents of a unit of a P or B frame come from.
#[derive(Debug, Clone, Copy)]
pub struct Temporal<'a> {
    /// The parents in the reference frame, before displacement.
    pub reference: &'a GaussianList,
    /// How changes over the span of the reference frame are scaled.
    pub ratio: SpanRatio,
    /// The parents of the units up to this one, which come last; needed if the unit has move predictors.
    pub moves: Option<&'a MoveSpace>,
}

/// The result of a unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Applied {
    /// The list after the unit: surviving parents, then new Gaussians.
    pub list: GaussianList,
    /// The new Gaussians by themselves: other units predict from them.
    pub added: QuantizedFrame,
    /// Which parents stay; empty: all.
    pub keep: Vec<bool>,
}

/// Clause 7.5: the cells of a frame, from the values of the section of its header; `at` goes into errors.
///
/// # Errors
/// Invalid if cells are out of order, outside the grid, or move too far. A fault: a plane lacks values of a cell.
pub fn field(
    values: &SectionValues,
    cell_log2: u8,
    sequence: &SequenceParameters,
    at: u64,
) -> Result<CellField> {
    let bits = sequence.position_bits.saturating_sub(cell_log2).max(1);
    let fault = |rule| Error::new(at, "7.5", ErrorKind::Constraint { rule });
    let value = |plane: usize, row: usize| {
        let value = values.planes.get(plane).and_then(|plane| plane.get(row));
        value.copied().ok_or(Error::fault("as many values of each plane as there are cells"))
    };
    let mut cells: Vec<(u64, Cell)> = Vec::with_capacity(values.deltas.len());
    let (mut code, mut motion) = (0_u64, [0_i64; 6]);
    for (row, &delta) in values.deltas.iter().enumerate() {
        // Every block starts again from 0, and so do values that are none of a block.
        if values.block == 0 || row.is_multiple_of(values.block) {
            (code, motion) = (0, [0; 6]);
        }
        code = code.wrapping_add(delta);
        if code.wrapping_shr(u32::from(bits).wrapping_mul(3)) != 0 {
            return Err(fault("a cell lies outside the grid"));
        }
        if cells.last().is_some_and(|(before, _)| *before >= code) {
            return Err(fault("cells are listed once, in Morton order"));
        }
        for (plane, sum) in (1..).zip(&mut motion) {
            *sum = sum.wrapping_add(value(plane, row)?.into());
        }
        cells.push((code, cell(code, value(0, row)?, motion, at)?));
    }
    Ok(CellField::new(cell_log2, sequence.position_bits, rotation_unit(sequence.rotation_step), cells))
}

/// A cell, its values in range. A sum that 32 bits do not hold is outside of every range, whatever takes its place.
fn cell(code: u64, stale: i32, motion: [i64; 6], at: u64) -> Result<Cell> {
    let [tx, ty, tz, rx, ry, rz] = motion.map(|sum| i32::try_from(sum).unwrap_or(i32::MAX));
    let (translation, rotation) = ([tx, ty, tz], [rx, ry, rz]);
    let checks: [(&[i32], _, _); 3] = [
        (&[stale], 0..=1, "stale"),
        (&translation, TRANSLATION_RANGE, "translation"),
        (&rotation, CELL_ROTATION_RANGE, "cell_rotation"),
    ];
    for (values, range, element) in &checks {
        in_range(values, range, element, "7.5", at)?;
    }
    let coordinates = [collect(code), collect(code >> 1), collect(code >> 2)];
    Ok(Cell { coordinates, stale: stale == 1, translation, rotation })
}

/// Applies a unit to its parents, which have been displaced.
///
/// # Errors
/// Invalid by clauses 7.4 to 7.7. A fault: values or parents are not as many as the header of the unit counts.
pub fn apply(unit: &Unit<'_>, parents: GaussianList, situation: &Situation<'_>) -> Result<Applied> {
    let (mut list, mut set) = (parents, QuantizedFrame::default());
    match apply_to(&mut list, &mut set, unit, situation) {
        Ok((added, keep)) => Ok(Applied { list, added, keep }),
        Err(error) => {
            unit.coding.interrupt.leave((list, set));
            Err(error)
        }
    }
}

/// Applies a unit to a list, with room for the reference set; gives the new Gaussians, and which parents stay.
fn apply_to(
    list: &mut GaussianList,
    set: &mut QuantizedFrame,
    unit: &Unit<'_>,
    situation: &Situation<'_>,
) -> Result<(QuantizedFrame, Vec<bool>)> {
    let interrupt = unit.coding.interrupt;
    unit.values.check(unit.header)?;
    if unit.header.has_modes() && list.len() != unit.header.parent_count as usize {
        return Err(Error::fault("as many parents as a unit counts"));
    }
    let codes = unit.values.plane(Section::Predictors, 0);
    let is_predicted = codes.iter().any(|&code| code != Predictor::None.code());
    if situation.temporal.is_some() && is_predicted {
        *set = reference_set_unless(interrupt, situation, &list.planes);
    }
    if let Some(temporal) = situation.temporal.as_ref().filter(|_| unit.header.extrapolates_opacity) {
        extrapolate(list, temporal);
    }
    interrupt.check()?;
    let keep = change_parents(unit, list, situation.temporal.as_ref())?;
    interrupt.check()?;
    let predictors = predictors(unit)?;
    if let Some(temporal) = &situation.temporal {
        list.follow_change(temporal.reference, interrupt);
    }
    list.retain_unless(interrupt, &keep);
    if situation.temporal.is_none() && is_predicted {
        *set = reference_set_unless(interrupt, situation, &list.planes);
    }
    interrupt.check()?;
    if !set.is_empty() {
        check_learned(unit, &predictors)?;
    }
    let position = new_positions(unit)?;
    let added = new_gaussians(unit, situation.temporal.is_none(), position, &predictors, set)?;
    interrupt.check()?;
    list.append_unless(interrupt, &added);
    Ok((added.planes, keep))
}

/// Clause 7.7: everything that new Gaussians may be predicted from, in order.
pub fn reference_set(situation: &Situation<'_>, parents: &QuantizedFrame) -> QuantizedFrame {
    reference_set_unless(Interrupt::NEVER, situation, parents)
}

/// The same; where an interrupt is requested, the set means nothing.
fn reference_set_unless(
    interrupt: &Interrupt,
    situation: &Situation<'_>,
    parents: &QuantizedFrame,
) -> QuantizedFrame {
    let [before, after] = situation.around;
    let parts: Vec<&QuantizedFrame> =
        before.iter().copied().chain([parents]).chain(after.iter().copied()).collect();
    QuantizedFrame::joined(QuantizedFrame::zeroed(0, parents.sh.len()), &parts, interrupt)
}

/// Whether a unit leaves its parents as they come and adds nothing.
pub(crate) fn is_idle(header: &IncrementHeader, reference: &GaussianList) -> bool {
    let fades = header.extrapolates_opacity && !reference.change.fade.is_empty();
    !header.has_modes() && header.new_count == 0 && !fades
}

/// Applies moves and updates; returns which parents stay.
fn change_parents(
    unit: &Unit<'_>,
    list: &mut GaussianList,
    temporal: Option<&Temporal<'_>>,
) -> Result<Vec<bool>> {
    if !unit.header.has_modes() {
        return Ok(Vec::new());
    }
    let modes = unit.values.plane(Section::Modes, 0);
    check_modes(unit, modes, temporal.is_none())?;
    let rows = |bit: i32| -> Vec<u32> {
        (0_u32..).zip(modes).filter(|(_, mode)| *mode & bit != 0).map(|(row, _)| row).collect()
    };
    let (moved, updated) = (rows(HAS_MOVE), rows(HAS_UPDATE));
    match temporal.and_then(|temporal| temporal.moves).filter(|_| unit.header.move_predictor_count() > 0) {
        Some(space) => move_predicted(unit, list, space, modes)?,
        None => move_parents(unit, list, &moved)?,
    }
    if !updated.is_empty() {
        let mut attributes = Attributes::of_list_unless(unit.coding.interrupt, list, &updated);
        let values = AttributeValues(&unit.values.section(Section::Updates).planes);
        for stage in Stage::ALL {
            unit.coding.interrupt.check()?;
            attributes.add_stage(stage, values, &unit.coding, unit.at)?;
        }
        unit.coding.interrupt.check()?;
        attributes.write_to(list, &updated, unit.coding.interrupt);
    }
    unit.coding.interrupt.check()?;
    list.settle_rows(&[&moved, &updated], unit.coding.interrupt);
    Ok(modes.iter().map(|&mode| mode != REMOVED).collect())
}

/// Clause 6.14: the modes are what the counts of the header say.
fn check_modes(unit: &Unit<'_>, modes: &[i32], intra: bool) -> Result<()> {
    if let Some(&mode) = modes.iter().find(|mode| !(0..=REMOVED).contains(*mode)) {
        let (value, min, max) = (mode.into(), 0, REMOVED.into());
        let kind = ErrorKind::OutOfRange { element: "mode", value, min, max };
        return Err(Error::new(unit.at, "7.4", kind));
    }
    if intra && modes.contains(&REMOVED) {
        let rule = "an intra frame removes no Gaussian";
        return Err(Error::new(unit.at, "7.4", ErrorKind::Constraint { rule }));
    }
    let header = unit.header;
    let counted = |holds: fn(i32) -> bool| modes.iter().filter(|&&mode| holds(mode)).count();
    let counts = [
        ("move_count", header.move_count, counted(|mode| mode & HAS_MOVE != 0)),
        ("update_count", header.update_count, counted(|mode| mode & HAS_UPDATE != 0)),
        ("remove_count", header.remove_count, counted(|mode| mode == REMOVED)),
    ];
    for (element, announced, found) in counts {
        let (value, expected) = (announced.into(), fault::count(found)?.into());
        if value != expected {
            return Err(Error::new(
                header.at(unit.at, element),
                "6.14",
                ErrorKind::Mismatch { element, value, expected },
            ));
        }
    }
    Ok(())
}

/// Moves without predictors: residuals on top of displaced positions.
fn move_parents(unit: &Unit<'_>, list: &mut GaussianList, moved: &[u32]) -> Result<()> {
    let grid = MoveGrid::new(unit);
    for (axis, plane) in list.position_fine.iter_mut().enumerate() {
        for (&row, &value) in moved.iter().zip(unit.values.plane(Section::Moves, axis)) {
            let slot = plane.get_mut(row as usize).ok_or(Error::fault("a position for each parent"))?;
            *slot = grid.moved(*slot, value)?;
        }
    }
    Ok(())
}

/// What fine coordinates are moved on.
struct MoveGrid {
    /// The largest fine coordinate.
    last: i64,
    /// The step of a move, in fine units.
    step: i64,
    /// Of the unit, for errors.
    at: u64,
}

impl MoveGrid {
    fn new(unit: &Unit<'_>) -> Self {
        let size = 1_i64.wrapping_shl(unit.sequence.position_bits.into());
        let last = size.wrapping_sub(1).wrapping_mul(FINE.into());
        let step = i64::from(FINE).wrapping_shl(unit.header.position_shift.into());
        Self { last, step, at: unit.at }
    }

    /// A fine coordinate after a move by so many steps.
    fn moved(&self, from: i32, steps: i32) -> Result<i32> {
        let sum = i64::from(from).wrapping_add(i64::from(steps).wrapping_mul(self.step));
        let within = i32::try_from(sum).ok().filter(|_| (0..=self.last).contains(&sum));
        let rule = "a position lies outside the grid";
        within.ok_or(Error::new(self.at, "7.4", ErrorKind::Constraint { rule }))
    }
}

/// Moves with predictors: residuals on top of predictions, one parent after the other.
fn move_predicted(unit: &Unit<'_>, list: &mut GaussianList, space: &MoveSpace, modes: &[i32]) -> Result<()> {
    let codes = unit.values.plane(Section::MovePredictors, 0);
    let predictors: Vec<MovePredictor> =
        codes.iter().map(|&code| MovePredictor::from_code(code, unit.at)).collect::<Result<_>>()?;
    // There is a predictor for each run, and a value for each move.
    let run_log2 = u32::from(unit.header.move_block_log2);
    let predictor_of =
        |number: usize| predictors.get(number.wrapping_shr(run_log2)).copied().unwrap_or_default();
    let mut moves: Moves<'_> = space.moves(modes, |number| predictor_of(number).has_neighbours());
    let planes = [0, 1, 2].map(|axis| unit.values.plane(Section::Moves, axis));
    let grid = MoveGrid::new(unit);
    for number in 0..moves.rows().len() {
        if number.is_multiple_of(RUN) {
            unit.coding.interrupt.check()?;
        }
        let mut position = moves.predicted(number, predictor_of(number));
        for (coordinate, values) in position.iter_mut().zip(planes) {
            *coordinate = grid.moved(*coordinate, values.get(number).copied().unwrap_or(0))?;
        }
        moves.set(number, position);
        let row = moves.rows().get(number).map_or(usize::MAX, |&row| row as usize);
        for (plane, coordinate) in list.position_fine.iter_mut().zip(position) {
            plane.get_mut(row).into_iter().for_each(|slot| *slot = coordinate);
        }
    }
    Ok(())
}

/// Opacities of parents go on changing as they did to the reference frame, before anything is said of them.
fn extrapolate(list: &mut GaussianList, temporal: &Temporal<'_>) {
    for (opacity, &fade) in list.planes.opacity.iter_mut().zip(&temporal.reference.change.fade) {
        let gone_on = opacity.wrapping_add(temporal.ratio.scaled(fade));
        *opacity = gone_on.clamp(*ATTRIBUTE_RANGE.start(), *ATTRIBUTE_RANGE.end());
    }
}

/// Clause 7.6.4, block by block.
fn new_positions(unit: &Unit<'_>) -> Result<[Vec<u32>; 3]> {
    let SectionValues { deltas, block, .. } = unit.values.section(Section::New);
    let mut position = [(); 3].map(|()| vec![0; deltas.len()]);
    let (bits, shift) = (unit.sequence.position_bits, unit.header.position_shift);
    let [x, y, z] = &mut position;
    let size = (*block).max(1);
    let planes = x.chunks_mut(size).zip(y.chunks_mut(size)).zip(z.chunks_mut(size));
    for (deltas, ((x, y), z)) in deltas.chunks(size).zip(planes) {
        positions(deltas, bits, shift, &mut [x, y, z], unit.at)?;
    }
    Ok(position)
}

fn predictors(unit: &Unit<'_>) -> Result<Vec<Predictor>> {
    let codes = unit.values.plane(Section::Predictors, 0);
    let known = |&code: &i32| {
        let predictor = Predictor::from_code(code, unit.at)?;
        if predictor == Predictor::Transformer && unit.network.is_none() {
            let kind = ErrorKind::Undefined { element: "network", id: 0 };
            return Err(Error::new(unit.at, "7.7", kind));
        }
        Ok(predictor)
    };
    codes.iter().map(known).collect()
}

/// A.2: the network predicts no more new Gaussians than the limit allows.
fn check_learned(unit: &Unit<'_>, predictors: &[Predictor]) -> Result<()> {
    let run = 1_u64.wrapping_shl(unit.header.predictor_block_log2.into());
    let mut left = u64::from(unit.header.new_count);
    let mut learned = 0_u64;
    for predictor in predictors {
        let count = run.min(left);
        left = left.saturating_sub(count);
        if *predictor == Predictor::Transformer {
            learned = learned.saturating_add(count);
        }
    }
    Limits::check(unit.at, "max_learned", learned, unit.max_learned.into())
}

fn new_gaussians(
    unit: &Unit<'_>,
    anchor: bool,
    position: [Vec<u32>; 3],
    predictors: &[Predictor],
    set: &QuantizedFrame,
) -> Result<GaussianList> {
    let count = unit.header.new_count as usize;
    let sh_planes = usize::from(unit.sequence.sh_dimension());
    let values = &unit.values.section(Section::New).planes;
    let by = Predicting {
        header: unit.header,
        colour: unit.coding.colour,
        network: unit.network,
        feature_shift: unit.sequence.feature_shift,
        interrupt: unit.coding.interrupt,
    };
    let prediction = Prediction::new(set, position.each_ref().map(Vec::as_slice), predictors, &by);
    let attributes = match prediction {
        Some(prediction) => {
            let mut attributes = Attributes::unpredicted(count, &unit.coding.colour, sh_planes);
            match prediction.reconstruct(&mut attributes, AttributeValues(values), &unit.coding, unit.at) {
                Ok(()) => attributes,
                Err(error) => {
                    by.interrupt.leave(attributes);
                    return Err(error);
                }
            }
        }
        None => unpredicted(count, sh_planes, values, unit)?,
    };
    let Attributes { log_scale, opacity, rotation_fine, dc, sh, parents: _ } = attributes;
    let rotation = [(); 3].map(|()| vec![0; count]);
    let planes = QuantizedFrame { position, log_scale, opacity, rotation, dc, sh };
    let mut list = GaussianList::of_planes_unless(unit.coding.interrupt, planes, anchor);
    list.rotation_fine = rotation_fine;
    list.settle_unless(unit.coding.interrupt);
    Ok(list)
}

/// The attributes of new Gaussians without predictors. They do not depend on each other, so that runs of them are
/// reconstructed on all cores.
fn unpredicted(count: usize, sh_planes: usize, values: &[Vec<i32>], unit: &Unit<'_>) -> Result<Attributes> {
    let run = |start: usize| {
        unit.coding.interrupt.check()?;
        let range = start..count.min(start.saturating_add(RUN));
        let part: Option<Vec<Vec<i32>>> =
            values.iter().map(|plane| plane.get(range.clone()).map(<[i32]>::to_vec)).collect();
        let part = part.ok_or(Error::fault("a value of each plane for each new Gaussian"))?;
        let mut attributes = Attributes::unpredicted(range.len(), &unit.coding.colour, sh_planes);
        attributes.add(AttributeValues(&part), &unit.coding, unit.at)?;
        Ok(attributes)
    };
    let starts: Vec<usize> = (0..count).step_by(RUN).collect();
    let runs: Vec<Result<Attributes>> = cores::map(count.saturating_mul(values.len()), starts, run);
    let mut all = Attributes::unpredicted(0, &unit.coding.colour, sh_planes);
    for attributes in runs {
        let attributes = attributes?;
        unit.coding.interrupt.check()?;
        for stage in Stage::ALL {
            for (plane, part) in all.stage_mut(stage).iter_mut().zip(attributes.stage(stage)) {
                plane.extend_from_slice(part);
            }
        }
    }
    Ok(all)
}
