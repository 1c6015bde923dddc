//! Clause 7.14: what a unit makes of its parents.

use super::prediction::{Predicting, Prediction};
use super::residual::{AttributeCoding, AttributeValues, Attributes};
use super::values::{SectionValues, UnitValues};
use crate::displacement::{Cell, CellField};
use crate::frame::QuantizedFrame;
use crate::home::{FINE, Home};
use crate::position::{collect, positions};
use crate::predictor::Predictor;
use core::ops::RangeInclusive;
use splatstream_format::entropy::layout::Section;
use splatstream_format::payload::Network;
use splatstream_format::syntax::{IncrementHeader, SequenceParameters};
use splatstream_format::{Error, ErrorKind, Limits, Result};

/// Modes of a parent, bit by bit; removal stands alone.
const HAS_MOVE: i32 = 1;
const HAS_UPDATE: i32 = 2;
const REMOVED: i32 = 4;

/// The values of a translation, lattice steps / 8, and of a turn, Q14.
const TRANSLATION_RANGE: RangeInclusive<i32> = -(1 << 20)..=1 << 20;
const TURN_RANGE: RangeInclusive<i32> = -(1 << 13)..=1 << 13;

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
    /// Whether the frame is an intra frame.
    pub intra: bool,
    /// The learned predictor of the GOP.
    pub network: Option<&'a Network>,
    /// New Gaussians that it may predict.
    pub most_learned: u32,
    /// Absolute offset of the payload, for errors.
    pub at: u64,
}

/// What stands around a unit.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// What the reference set holds besides the parents: before them and behind them.
    pub around: [&'a [&'a QuantizedFrame]; 2],
    /// Intra frames: the parents take part as the unit leaves them. Others: as they come.
    pub parents_follow: bool,
}

/// What a unit makes of its parents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Applied {
    /// The home after the unit: surviving parents, then new Gaussians.
    pub home: Home,
    /// The new ones by themselves: other units predict from them.
    pub added: QuantizedFrame,
}

/// Clause 7.15: the cells of a unit.
///
/// # Errors
/// Invalid if cells are out of order, outside the lattice, or move too far.
pub fn field(unit: &Unit<'_>, rotation_unit: i64) -> Result<CellField> {
    let values = unit.values.section(Section::Cells);
    let bits = unit.sequence.position_bits.saturating_sub(unit.header.cell_log2).max(1);
    let fault = |rule| Error::new(unit.at, "7.15", ErrorKind::Constraint { rule });
    let out_of_range = |element, value: i32, range: &RangeInclusive<i32>| {
        let (value, min, max) = (value.into(), (*range.start()).into(), (*range.end()).into());
        Error::new(unit.at, "7.15", ErrorKind::OutOfRange { element, value, min, max })
    };
    let value = |plane: usize, row: usize| {
        values.planes.get(plane).and_then(|plane| plane.get(row)).copied().unwrap_or(0)
    };
    let mut cells: Vec<(u64, Cell)> = Vec::with_capacity(values.deltas.len());
    let (mut code, mut motion) = (0_u64, [0_i64; 6]);
    for (row, &delta) in values.deltas.iter().enumerate() {
        if row.checked_rem(values.block).unwrap_or(0) == 0 {
            (code, motion) = (0, [0; 6]);
        }
        code = code.wrapping_add(delta);
        if code.wrapping_shr(u32::from(bits).wrapping_mul(3)) != 0 {
            return Err(fault("a cell lies outside the lattice"));
        }
        if cells.last().is_some_and(|(before, _)| *before >= code) {
            return Err(fault("cells are listed once, in Morton order"));
        }
        let stale = value(0, row);
        if !(0..=1).contains(&stale) {
            return Err(out_of_range("stale", stale, &(0..=1)));
        }
        for (plane, sum) in (1..).zip(&mut motion) {
            *sum = sum.wrapping_add(value(plane, row).into());
        }
        let moved = motion.map(|sum| i32::try_from(sum).unwrap_or(i32::MAX));
        let [tx, ty, tz, rx, ry, rz] = moved;
        let (translation, turn) = ([tx, ty, tz], [rx, ry, rz]);
        for (part, range, element) in
            [(translation, &TRANSLATION_RANGE, "translation"), (turn, &TURN_RANGE, "turn")]
        {
            if let Some(&outside) = part.iter().find(|value| !range.contains(value)) {
                return Err(out_of_range(element, outside, range));
            }
        }
        let coordinates = [collect(code), collect(code >> 1), collect(code >> 2)];
        cells.push((code, Cell { coordinates, stale: stale == 1, translation, turn }));
    }
    Ok(CellField::new(unit.header.cell_log2, unit.sequence.position_bits, rotation_unit, cells))
}

/// Applies a unit to its parents, which have been displaced.
///
/// # Errors
/// Invalid by clauses 7.14 to 7.17.
pub fn apply(unit: &Unit<'_>, parents: Home, situation: &Situation<'_>) -> Result<Applied> {
    let mut home = parents;
    let before =
        (!situation.parents_follow && unit.header.predictor_count() > 0).then(|| home.planes.clone());
    let keep = change_parents(unit, &mut home)?;
    let predictors = predictors(unit)?;
    home.retain(&keep);
    let set = match predictors.iter().any(|&predictor| predictor != Predictor::None) {
        true => reference_set(situation, before.as_ref().unwrap_or(&home.planes)),
        false => QuantizedFrame::default(),
    };
    if !set.is_empty() {
        check_learned(unit, &predictors)?;
    }
    let position = new_positions(unit)?;
    let added = new_gaussians(unit, position, &predictors, &set)?;
    home.append(&added);
    Ok(Applied { home, added: added.planes })
}

/// Clause 7.17: everything that new Gaussians may be predicted from, in order.
pub fn reference_set(situation: &Situation<'_>, parents: &QuantizedFrame) -> QuantizedFrame {
    let [before, behind] = situation.around;
    let mut set = QuantizedFrame::zeroed(0, parents.sh.len());
    for &part in before.iter().chain([&parents]).chain(behind) {
        set.append(part);
    }
    set
}

/// Moves and updates; gives which parents stay.
fn change_parents(unit: &Unit<'_>, home: &mut Home) -> Result<Vec<bool>> {
    let modes = unit.values.plane(Section::Modes, 0);
    check_modes(unit, modes)?;
    let rows = |bit: i32| -> Vec<u32> {
        (0_u32..).zip(modes).filter(|(_, mode)| *mode & bit != 0).map(|(row, _)| row).collect()
    };
    let (moved, updated) = (rows(HAS_MOVE), rows(HAS_UPDATE));
    move_parents(unit, home, &moved)?;
    if !updated.is_empty() {
        let mut attributes = Attributes::of_home(home, &updated);
        let values = AttributeValues(&unit.values.section(Section::Updates).planes);
        attributes.add(values, &unit.coding, unit.at)?;
        attributes.write_to(home, &updated);
    }
    if !moved.is_empty() || !updated.is_empty() {
        home.settle();
    }
    Ok(modes.iter().map(|&mode| mode != REMOVED).collect())
}

/// Clause 6.14: the modes are what the counts of the header say.
fn check_modes(unit: &Unit<'_>, modes: &[i32]) -> Result<()> {
    if let Some(&mode) = modes.iter().find(|mode| !(0..=REMOVED).contains(*mode)) {
        let (value, min, max) = (mode.into(), 0, REMOVED.into());
        let kind = ErrorKind::OutOfRange { element: "mode", value, min, max };
        return Err(Error::new(unit.at, "7.14", kind));
    }
    if unit.intra && modes.contains(&REMOVED) {
        let rule = "an intra frame removes no Gaussian";
        return Err(Error::new(unit.at, "7.14", ErrorKind::Constraint { rule }));
    }
    let header = unit.header;
    let counted = |holds: fn(i32) -> bool| modes.iter().filter(|&&mode| holds(mode)).count();
    let counts = [
        ("move_count", header.move_count, counted(|mode| mode & HAS_MOVE != 0)),
        ("update_count", header.update_count, counted(|mode| mode & HAS_UPDATE != 0)),
        ("remove_count", header.remove_count, counted(|mode| mode == REMOVED)),
    ];
    for (element, announced, found) in counts {
        let (value, expected) = (announced.into(), u64::try_from(found).unwrap_or(u64::MAX));
        if value != expected {
            let at = unit.at.wrapping_add(u64::try_from(IncrementHeader::TABLE.offset(element)).unwrap_or(0));
            return Err(Error::new(at, "6.14", ErrorKind::Mismatch { element, value, expected }));
        }
    }
    Ok(())
}

fn move_parents(unit: &Unit<'_>, home: &mut Home, moved: &[u32]) -> Result<()> {
    let last =
        1_i64.wrapping_shl(unit.sequence.position_bits.into()).wrapping_sub(1).wrapping_mul(FINE.into());
    let unit_step = i64::from(FINE).wrapping_shl(unit.header.position_shift.into());
    for (axis, plane) in home.position_fine.iter_mut().enumerate() {
        for (&row, &value) in moved.iter().zip(unit.values.plane(Section::Moves, axis)) {
            let Some(slot) = usize::try_from(row).ok().and_then(|row| plane.get_mut(row)) else { continue };
            let sum = i64::from(*slot).wrapping_add(i64::from(value).wrapping_mul(unit_step));
            if !(0..=last).contains(&sum) {
                let rule = "a position lies outside the lattice";
                return Err(Error::new(unit.at, "7.14", ErrorKind::Constraint { rule }));
            }
            *slot = i32::try_from(sum).unwrap_or(0);
        }
    }
    Ok(())
}

/// Clause 7.3, block by block.
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
            return Err(Error::new(unit.at, "7.17", kind));
        }
        Ok(predictor)
    };
    codes.iter().map(known).collect()
}

/// A.2: the new Gaussians that the network predicts are not more than agreed.
fn check_learned(unit: &Unit<'_>, predictors: &[Predictor]) -> Result<()> {
    let run = 1_u64.wrapping_shl(unit.header.predictor_block_log2.into());
    let mut left = u64::from(unit.header.new_count);
    let mut learned = 0_u64;
    for predictor in predictors {
        let count = run.min(left);
        left = left.wrapping_sub(count);
        if *predictor == Predictor::Transformer {
            learned = learned.wrapping_add(count);
        }
    }
    Limits::check(unit.at, "max_learned", learned, unit.most_learned.into())
}

fn new_gaussians(
    unit: &Unit<'_>,
    position: [Vec<u32>; 3],
    predictors: &[Predictor],
    set: &QuantizedFrame,
) -> Result<Home> {
    let count = position.first().map_or(0, Vec::len);
    let sh_planes = usize::from(unit.sequence.sh_dimension());
    let mut attributes = Attributes::unpredicted(count, &unit.coding.colour, sh_planes);
    let values = AttributeValues(&unit.values.section(Section::New).planes);
    let by = Predicting { header: unit.header, colour: unit.coding.colour, network: unit.network };
    let prediction = Prediction::new(set, position.each_ref().map(Vec::as_slice), predictors, &by);
    match prediction {
        Some(prediction) => prediction.reconstruct(&mut attributes, values, &unit.coding, unit.at)?,
        None => attributes.add(values, &unit.coding, unit.at)?,
    }
    let Attributes { log_scale, opacity, rotation_fine, dc, sh } = attributes;
    let rotation = [(); 3].map(|()| vec![0; count]);
    let mut home =
        Home::of_planes(QuantizedFrame { position, log_scale, opacity, rotation, dc, sh }, unit.intra);
    home.rotation_fine = rotation_fine;
    home.settle();
    Ok(home)
}
