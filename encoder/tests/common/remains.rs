//! Clauses 7.13.3 and 7.20 written once more, for whole streams: what is shown of every frame when units are lost.

use super::dynamic::{Arrival, Whole, place};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::DecodedFrame;
use splatstream_format::syntax::{UnitHeader, UnitType};

/// What is left of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Remains {
    pub(crate) number: u32,
    /// Refinements that frames which refer to it can have.
    pub(crate) level: u8,
    /// Whether an error is reported.
    pub(crate) lost: bool,
    pub(crate) planes: QuantizedFrame,
}

/// What is left of every frame whose frame_header arrives. `cut`: the data ends behind what arrives.
pub(crate) fn remains(
    whole: &Whole<'_>,
    arrival: impl Fn(&UnitHeader) -> Arrival,
    cut: bool,
) -> Vec<Remains> {
    let mut frames: Vec<Remains> = Vec::new();
    for number in whole.all().iter().map(|frame| frame.number) {
        let of_frame = |unit_type: UnitType| {
            let units = whole.units.iter().map(|unit| unit.header);
            units.filter(move |header| header.unit_type() == unit_type && header.frame == number)
        };
        if of_frame(UnitType::FrameHeader).all(|header| arrival(&header) == Arrival::Missing) {
            continue;
        }
        let units: Vec<(UnitHeader, Arrival)> = of_frame(UnitType::Increment)
            .map(|header| (header, arrival(&header)))
            .filter(|(_, arrival)| *arrival != Arrival::Missing)
            .collect();
        let (first, gop) = whole.gop_of(number);
        let left = match place(&gop, number - first).1 {
            None => intra(whole, number, &units),
            Some(reference) => {
                let reference = frames.iter().find(|frame| frame.number == first + reference);
                predicted(whole, number, &units, reference)
            }
        };
        frames.push(left);
    }
    if let Some(last) = frames.last_mut().filter(|_| cut) {
        last.lost = false;
    }
    frames
}

/// Decodes the units of a frame in order: those decoded, and whether an error is found.
fn decode(
    units: &[(UnitHeader, Arrival)],
    follows: impl Fn(&[(u8, u8)], (u8, u8)) -> bool,
) -> (Vec<(u8, u8)>, bool) {
    let mut done: Vec<(u8, u8)> = Vec::new();
    for (header, arrival) in units {
        let unit = (header.spatial_layer, header.refinement);
        if *arrival == Arrival::Damaged || !follows(&done, unit) {
            return (done, true);
        }
        done.push(unit);
    }
    (done, units.is_empty())
}

fn intra(whole: &Whole<'_>, number: u32, units: &[(UnitHeader, Arrival)]) -> Remains {
    let follows = |done: &[(u8, u8)], (s, r): (u8, u8)| {
        let next = match done.last() {
            None => (s, r) == (0, 0),
            Some(&(layer, refinement)) => (s, r) == (layer, refinement + 1) || (s, r) == (layer + 1, 0),
        };
        next && (s == 0 || done.contains(&(s - 1, r)))
    };
    let (done, lost) = decode(units, follows);
    let count = |layer: u8| done.iter().filter(|(s, _)| *s == layer).count();
    let refinements = whole.sequence.refinement_count;
    let complete = done.len() == usize::from(whole.sequence.spatial_layer_count * refinements);
    let level = if complete { refinements } else { 0 };
    let planes = match (count(0), (0..=whole.top()).rev().find(|&layer| count(layer) == count(0))) {
        (0, _) | (_, None) => empty(whole),
        (count, Some(layer)) => intra_at(whole, number, layer, count as u8 - 1),
    };
    Remains { number, level, lost, planes }
}

/// An I frame at a spatial layer and refinement. Of a predicted GOP the highest layer is only ever decoded whole.
fn intra_at(whole: &Whole<'_>, number: u32, layer: u8, refinement: u8) -> QuantizedFrame {
    let (_, gop) = whole.gop_of(number);
    if gop.gop_structure == 1 && layer == whole.top() {
        let mut planes = shown(whole, number, layer, whole.sequence.refinement_count - 1);
        let count = whole.sequence.prefix_length(refinement, planes.len() as u32);
        planes.truncate(count as usize);
        return planes;
    }
    shown(whole, number, layer, refinement)
}

fn predicted(
    whole: &Whole<'_>,
    number: u32,
    units: &[(UnitHeader, Arrival)],
    reference: Option<&Remains>,
) -> Remains {
    let level = reference.map_or(0, |reference| reference.level);
    let looked_at: Vec<_> = units.iter().copied().filter(|(header, _)| header.refinement < level).collect();
    let (done, own) =
        decode(&looked_at, |done, (_, r)| done.last().map_or(r == 0, |&(_, before)| r == before + 1));
    let own = if looked_at.is_empty() { units.is_empty() } else { own };
    let level = done.len() as u8;
    let planes = match (level, reference) {
        (0, None) => empty(whole),
        (0, Some(reference)) => reference.planes.clone(),
        _ => shown(whole, number, whole.top(), level - 1),
    };
    Remains { number, level, lost: own || level == 0, planes }
}

/// What is shown of a frame at the lowest point that has its temporal layer and these.
fn shown(whole: &Whole<'_>, number: u32, layer: u8, refinement: u8) -> QuantizedFrame {
    let at = |temporal| whole.points.get(&OperatingPoint { spatial: layer, temporal, refinement });
    let find = |frames: &Vec<DecodedFrame>| frames.iter().find(|frame| frame.number == number).cloned();
    (0..4).filter_map(at).find_map(find).unwrap().planes
}

fn empty(whole: &Whole<'_>) -> QuantizedFrame {
    QuantizedFrame::zeroed(0, whole.sequence.sh_dimension().into())
}

/// Compares frames with what shall be left.
pub(crate) fn assert_remains(frames: &[DecodedFrame], expected: &[Remains], what: &str) {
    let numbers = |frames: &[DecodedFrame]| frames.iter().map(|frame| frame.number).collect::<Vec<_>>();
    assert_eq!(numbers(frames), expected.iter().map(|left| left.number).collect::<Vec<_>>(), "{what}");
    for (frame, left) in frames.iter().zip(expected) {
        let number = frame.number;
        assert_eq!(frame.lost.is_some(), left.lost, "{what}: frame {number} is lost by {:?}", frame.lost);
        let counts = (frame.planes.len(), left.planes.len());
        assert!(frame.planes == left.planes, "{what}: frame {number} shows something else {counts:?}");
    }
}
