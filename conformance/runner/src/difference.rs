//! The first value that differs in wrong planes, and what the error resembles.
//!
//! A vector has digests instead of values, so the right values come from the reference decoder, provided that its digest
//! is that of the vector.

use crate::attribute::{Attribute, from_bytes, to_bytes};
use crate::case::{Case, states_of};
use crate::digest;
use crate::files::Files;
use crate::output::Output;
use crate::reference::Decoded;
use crate::resemblance;
use crate::source_unit::{SourceUnit, SourceUnits};
use crate::symptom::Symptom;
use crate::vector::{Point, State};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The first value that differs: in the first wrong frame in coding order, since errors spread from there, the first
/// attribute, and in that the first Gaussian.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Difference {
    /// Display index of the frame.
    pub frame: u32,
    /// I, P or B.
    #[serde(rename = "type", default, skip_serializing_if = "Option::is_none")]
    pub frame_type: Option<String>,
    /// The attribute.
    pub attribute: Attribute,
    /// Gaussians of the frame.
    pub gaussians: u64,
    /// Size of the decoder's file, if it is wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bytes_found: Option<u64>,
    /// The value, if the reference decoder gives the right one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<Value>,
    /// The unit from which the Gaussian was decoded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<SourceUnit>,
    /// Clauses to read: those that define the attribute, then those of the vector.
    pub read: Vec<String>,
}

/// A value that differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Value {
    /// Index of the Gaussian in the frame, from 0.
    pub gaussian: u64,
    /// Plane of the attribute, from 0.
    pub component: u64,
    /// The right value.
    pub expected: i32,
    /// The decoder's.
    pub found: i32,
    /// Number of values of the attribute in this frame that differ.
    pub differing: u64,
}

/// Explains a failure by the files of a case.
pub(crate) fn explain(case: &Case<'_>, output: &Output) -> (Option<Symptom>, Option<Difference>) {
    let files = Files::compare(case, output);
    let whole = symptom_of_files(case, output, &files);
    let Ok(stream) = case.input() else { return (whole, None) };
    let units = SourceUnits::of(&stream);
    let Some(&(state, attribute)) = files
        .wrong
        .iter()
        .min_by_key(|(state, attribute)| (units.coding_order(state.frame), state.frame, *attribute))
    else {
        return (whole, None);
    };
    let found =
        output.planes.get(&(state.frame, attribute)).and_then(|planes| std::fs::read(&planes.path).ok());
    let Some(found) = found else { return (whole, None) };
    let mut difference = Difference {
        frame: state.frame,
        frame_type: state.frame_type.clone(),
        attribute,
        gaussians: state.gaussians,
        bytes_found: None,
        value: None,
        unit: None,
        read: Vec::new(),
    };
    let decoded = case.op().parse().map(|point| Decoded::of(&stream, point, case.mode())).unwrap_or_default();
    let symptom = difference.compare(&decoded, state, &found, &units);
    let more = case.vector.clauses.iter().filter(|clause| !difference.read.contains(clause)).cloned();
    let more: Vec<String> = more.collect();
    difference.read.extend(more);
    let of_values = symptom.filter(|&symptom| symptom != Symptom::Unrelated || files.wrong.len() > 1);
    // Values before compensation are also those of a higher point, if that has the same Gaussians; the other mode differs
    // in more than compensation.
    let is_other_mode = whole == Some(Symptom::OtherMode);
    let uncompensated = of_values.filter(|&symptom| symptom == Symptom::Uncompensated && !is_other_mode);
    let best = uncompensated.or(whole).or(of_values);
    (best, Some(difference))
}

impl Difference {
    /// Finds the first value that differs; returns what the file resembles.
    fn compare(
        &mut self,
        decoded: &Decoded,
        state: &State,
        found: &[u8],
        units: &SourceUnits,
    ) -> Option<Symptom> {
        let frame = decoded.frames.iter().find(|frame| frame.index == state.frame)?;
        let shown = frame.clone().into_shown();
        let expected = self.attribute.values(&shown);
        // Values of a reference that is wrong itself would mislead.
        if state.planes.get(&self.attribute) != Some(&digest::sha256(&to_bytes(&expected))) {
            return None;
        }
        let symptom =
            resemblance::of_file(&expected, found, shown.len(), &self.attribute.values(&frame.planes));
        if found.len() != expected.len().saturating_mul(4) {
            self.bytes_found = Some(found.len() as u64);
            self.read.extend(["7.9.1", "7.8.2"].map(str::to_owned));
            return symptom;
        }
        self.value = first(&expected, &from_bytes(found), shown.len());
        let gaussian = self.value.map_or(0, |value| value.gaussian);
        let (unit, clauses) = units.find(frame, gaussian, self.attribute);
        self.unit = unit;
        let first = match symptom {
            Some(Symptom::Uncompensated) => &["7.8.3"][..],
            Some(Symptom::OtherOrder) => &["7.9.1", "7.8.2"],
            Some(Symptom::OtherPlanes | Symptom::Interleaved | Symptom::BigEndian) => &["7.9.1"],
            _ => clauses,
        };
        self.read.extend(first.iter().map(|&clause| clause.to_owned()));
        symptom
    }
}

/// The first Gaussian with a value that differs.
fn first(expected: &[i32], found: &[i32], gaussians: usize) -> Option<Value> {
    let gaussians = gaussians.max(1);
    let differing =
        || expected.iter().zip(found).enumerate().filter(|(_, (expected, found))| expected != found);
    let (index, (&expected, &found)) = differing().min_by_key(|(index, _)| index % gaussians)?;
    Some(Value {
        gaussian: (index % gaussians) as u64,
        component: (index / gaussians) as u64,
        expected,
        found,
        differing: differing().count() as u64,
    })
}

/// What the files resemble as a whole.
fn symptom_of_files(case: &Case<'_>, output: &Output, files: &Files<'_>) -> Option<Symptom> {
    let states = case.states()?;
    if is_output(&states, output) {
        return None;
    }
    if output.planes.is_empty() && !files.missing.is_empty() {
        return output.extra.is_empty().then_some(Symptom::NothingWritten);
    }
    let shows = |point: &&Point| {
        states_of(case.vector, Some(*point)).is_some_and(|states| is_output(&states, output))
    };
    let others = || {
        case.vector.points.iter().filter(|point| (point.op.as_str(), point.mode) != (case.op(), case.mode()))
    };
    if others().filter(|point| point.op == case.op()).any(|point| shows(&point)) {
        return Some(Symptom::OtherMode);
    }
    if are_renumbered(&states, output) {
        return Some(Symptom::OtherNumbers);
    }
    if is_a_type_missing(&states, files) {
        return Some(Symptom::TypeMissing);
    }
    others().any(|point| shows(&point)).then_some(Symptom::OtherPoint)
}

/// Whether the planes that were written are those of these frames under other indices.
fn are_renumbered(states: &[&State], output: &Output) -> bool {
    let mut found: BTreeMap<u32, BTreeMap<Attribute, &String>> = BTreeMap::new();
    for (&(frame, attribute), planes) in &output.planes {
        found.entry(frame).or_default().insert(attribute, &planes.sha256);
    }
    let mut found: Vec<_> = found.into_values().collect();
    let mut wanted: Vec<BTreeMap<Attribute, &String>> = states
        .iter()
        .map(|state| state.planes.iter().map(|(&attribute, sha256)| (attribute, sha256)).collect())
        .collect();
    found.sort_unstable();
    wanted.sort_unstable();
    found == wanted
}

/// Whether the missing frames are all those of a type and no others.
fn is_a_type_missing(states: &[&State], files: &Files<'_>) -> bool {
    let is_missing = |state: &State| files.missing.iter().any(|(missing, _)| missing.frame == state.frame);
    let (missing, there): (Vec<&State>, Vec<&State>) = states.iter().partition(|state| is_missing(state));
    let Some(first) = missing.first() else { return false };
    let of_kind = |state: &&State| state.frame_type == first.frame_type;
    missing.iter().all(of_kind) && !there.iter().any(of_kind)
}

/// Whether the planes that were written are exactly those of these frames.
fn is_output(states: &[&State], output: &Output) -> bool {
    let wanted = states
        .iter()
        .flat_map(|state| state.planes.iter().map(|(&attribute, sha256)| ((state.frame, attribute), sha256)));
    let mut count = 0_usize;
    let all = wanted
        .inspect(|_| count = count.saturating_add(1))
        .all(|(key, sha256)| output.planes.get(&key).is_some_and(|planes| planes.sha256 == *sha256));
    all && count == output.planes.len()
}
