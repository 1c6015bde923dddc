//! Frames that lack increments which were there once.

use splatstream_decoder::operating_point::{OperatingPoint, operating_points};
use splatstream_format::Limits;
use splatstream_format::syntax::SequenceParameters;
use splatstream_stream::structure::{Frame, Structure};
use std::collections::BTreeSet;

/// Display indices of frames that lack increments of an operating point, as far as the stream tells.
///
/// 1. It is asked whether any are missing. Frames of an extracted stream have fewer than the sequence announces, and nothing is
///    missing: the end unit counts the units before it, and the list of operating points has the bytes of each.
/// 2. Where some are, a frame lacks what the list says there is at the point; without a list, what some frame has. If that
///    tells of no frame and none is lost (`has_lost`), all of them lack the same, and what the sequence announces is what
///    was there.
pub(crate) fn short_frames(
    bytes: &[u8],
    structure: &Structure,
    point: OperatingPoint,
    has_lost: bool,
    limits: &Limits,
) -> BTreeSet<u32> {
    let Some(sequence) = &structure.sequence else { return BTreeSet::new() };
    let listed = structure.points_up_to(layers_of(point)).max_by_key(|listed| listed.point);
    let is_whole = match listed {
        Some(listed) => operating_points(bytes, limits).is_ok_and(|points| {
            let found = points.iter().find(|info| layers_of(info.point) == listed.point);
            found.is_some_and(|info| (info.bytes, info.frames) == (listed.bytes, listed.frames))
        }),
        None => structure.has_all_units(),
    };
    if is_whole {
        return BTreeSet::new();
    }
    let announced = point.at_most(OperatingPoint {
        spatial: structure.top(),
        temporal: sequence.temporal_layer_count.saturating_sub(1),
        refinement: sequence.refinement_count.saturating_sub(1),
    });
    let known = listed.map_or_else(|| fullest(structure, announced), |listed| point_of(listed.point));
    let found = lacking(structure, sequence, known);
    match found.is_empty() && listed.is_none() && !has_lost {
        true => lacking(structure, sequence, announced),
        false => found,
    }
}

/// A point as its highest spatial layer, temporal layer and refinement, by which the structure of a stream lists it.
pub(crate) const fn layers_of(point: OperatingPoint) -> (u8, u8, u8) {
    let OperatingPoint { spatial, temporal, refinement } = point;
    (spatial, temporal, refinement)
}

/// The point that is listed so.
pub(crate) const fn point_of((spatial, temporal, refinement): (u8, u8, u8)) -> OperatingPoint {
    OperatingPoint { spatial, temporal, refinement }
}

/// The frames up to the temporal layer of a point.
fn frames_of(structure: &Structure, point: OperatingPoint) -> impl Iterator<Item = &Frame> {
    let frames = structure.gops.iter().flat_map(|gop| &gop.frames);
    frames.filter(move |frame| frame.role.temporal_layer <= point.temporal)
}

/// The most that frames have, up to a point.
fn fullest(structure: &Structure, point: OperatingPoint) -> OperatingPoint {
    let headers = || frames_of(structure, point).flat_map(|frame| &frame.increments).map(|unit| &unit.header);
    let spatial = headers().map(|header| header.spatial_layer).max().unwrap_or(0);
    let refinement = headers().map(|header| header.refinement).max().unwrap_or(0);
    point.at_most(OperatingPoint { spatial, refinement, ..OperatingPoint::ALL })
}

/// The frames that lack an increment of a point. Predicted frames have those of the highest spatial layer alone.
fn lacking(structure: &Structure, sequence: &SequenceParameters, point: OperatingPoint) -> BTreeSet<u32> {
    let top = structure.top();
    let is_short = |frame: &&Frame| {
        let is_intra = frame.role.reference.is_none();
        let layers = if is_intra { 0..=point.spatial } else { top..=point.spatial };
        let takes_all = is_intra && sequence.whole_anchor() && point.spatial >= top;
        let last = if takes_all { sequence.refinement_count.saturating_sub(1) } else { point.refinement };
        layers.into_iter().any(|layer| (0..=last).any(|refinement| frame.unit(layer, refinement).is_none()))
    };
    frames_of(structure, point).filter(is_short).map(|frame| frame.index).collect()
}
