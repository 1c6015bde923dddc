//! Whether streams are parts of one, and in which order.

use super::{ConcatError, StreamPart};
use splatstream_format::Limits;
use splatstream_format::payload::SceneDescription;
use splatstream_format::syntax::{FixedRecord, Row, SequenceParameters};

/// The order in which parts are joined.
///
/// # Errors
/// Parts that are not of one stream.
pub(super) fn check_all(parts: &[StreamPart], limits: &Limits) -> Result<Vec<usize>, ConcatError> {
    let first = parts.first().ok_or(ConcatError::NoParts)?;
    let shards = parts.iter().filter(|part| part.shard.is_some()).count();
    let order = match shards {
        0 => (0..parts.len()).collect(),
        _ => of_shards(parts)?,
    };
    for (part, other) in parts.iter().enumerate() {
        same(first, (part, other))?;
    }
    let total = |count: fn(&StreamPart) -> u32| parts.iter().map(|part| u64::from(count(part))).sum::<u64>();
    let most = [
        ("frames", total(|part| part.frames), u32::MAX),
        ("units", total(|part| part.units), limits.max_units),
    ];
    for (what, count, max) in most {
        if count > u64::from(max) {
            return Err(ConcatError::TooLong { what, count, max: max.into() });
        }
    }
    Ok(order)
}

/// Shards of one plan in the order of their frames, of which none is missing.
fn of_shards(parts: &[StreamPart]) -> Result<Vec<usize>, ConcatError> {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    let mut shards = Vec::new();
    for (part, stream) in parts.iter().enumerate() {
        match &stream.shard {
            Some(shard) => shards.push(shard),
            None => {
                let shard = parts.iter().position(|part| part.shard.is_some()).unwrap_or(0);
                return Err(ConcatError::NoShard { part: shard, other: part });
            }
        }
        let plans = shards
            .first()
            .zip(shards.last())
            .map(|(a, b)| (a.plan, a.sequence_frames) == (b.plan, b.sequence_frames));
        if plans == Some(false) {
            return Err(ConcatError::OtherPlan { part, other: 0 });
        }
    }
    order.sort_by_key(|&part| shards.get(part).map(|shard| (shard.frames.start, shard.frames.end)));
    let (mut next, mut before) = (0, 0);
    for &part in &order {
        let Some(shard) = shards.get(part) else { continue };
        let (sequence_frames, frames) = (shard.sequence_frames, shard.frames.clone());
        if frames.start > next {
            return Err(ConcatError::Missing { frames: next..frames.start, sequence_frames });
        }
        if frames.start < next {
            let both = frames.start..frames.end.min(next);
            return Err(ConcatError::Overlap { part, other: before, frames: both });
        }
        (next, before) = (frames.end, part);
    }
    let sequence_frames = shards.first().map_or(0, |shard| shard.sequence_frames);
    match next < sequence_frames {
        true => Err(ConcatError::Missing { frames: next..sequence_frames, sequence_frames }),
        false => Ok(order),
    }
}

/// A part has what the first one has.
fn same(first: &StreamPart, (part, other): (usize, &StreamPart)) -> Result<(), ConcatError> {
    let differs = |name, value: String, expected: String| {
        Err(ConcatError::Differs { part, other: 0, name, value, expected })
    };
    if other.profile != first.profile {
        return differs("profile", other.profile.code().to_string(), first.profile.code().to_string());
    }
    for row in SequenceParameters::ROWS.iter().filter(|row| row.name != "frame_count") {
        let [value, expected] = [other, first].map(|part| value_of(row, &part.sequence));
        if value != expected {
            return differs(row.name, value, expected);
        }
    }
    match (&other.description, &first.description) {
        (Some(a), Some(b)) => same_scene(a, b).map_or(Ok(()), |(name, a, b)| differs(name, a, b)),
        (None, None) => Ok(()),
        (a, b) => {
            let is_there = |there: bool| if there { "there" } else { "not there" }.to_owned();
            differs("scene_description", is_there(a.is_some()), is_there(b.is_some()))
        }
    }
}

/// What two scenes do not have in common although those of one stream do: its name and both values.
fn same_scene(a: &SceneDescription, b: &SceneDescription) -> Option<(&'static str, String, String)> {
    let names = |scene: &SceneDescription| {
        [
            ("up_axis", scene.up_axis.name().to_owned()),
            ("colour_space", scene.colour_space.name().to_owned()),
            ("sorting", scene.sorting.name().to_owned()),
            ("metres_per_unit", format!("{:?}", scene.metres_per_unit)),
            ("background", format!("{:?}", scene.background)),
        ]
    };
    let mut pairs = names(a).into_iter().zip(names(b));
    pairs.find(|(a, b)| a != b).map(|((name, a), (_, b))| (name, a, b))
}

/// An element of sequence parameters, in decimal.
fn value_of(row: &Row, sequence: &SequenceParameters) -> String {
    let mut bytes = Vec::new();
    sequence.put(&mut bytes);
    let start = SequenceParameters::TABLE.offset(row.name);
    let bytes = bytes.get(start..).and_then(|rest| rest.get(..row.bytes)).unwrap_or_default();
    let size = row.bytes.checked_div(row.count).unwrap_or(1).max(1);
    let number = |bytes: &[u8]| {
        let mut all = [0; 4];
        all.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        match row.type_name.get(..3) {
            Some("f32") => f32::from_le_bytes(all).to_string(),
            Some("i32") => i32::from_le_bytes(all).to_string(),
            _ => u32::from_le_bytes(all).to_string(),
        }
    };
    bytes.chunks(size).map(number).collect::<Vec<_>>().join(",")
}

/// What the stream says of its scene: the title and the cameras of the first part that has any, and bounds around all.
pub(super) fn description(order: &[usize], parts: &[StreamPart]) -> Option<SceneDescription> {
    let described = || order.iter().filter_map(|&part| parts.get(part)?.description.as_ref());
    let first = described().next()?;
    let bounds = described().map(|scene| scene.bounds).reduce(|a, b| Some(around(a?, b?))).flatten();
    let title = described().find_map(|scene| scene.title.clone());
    let cameras = described().map(|scene| &scene.cameras).find(|cameras| !cameras.is_empty());
    Some(SceneDescription { bounds, title, cameras: cameras.cloned().unwrap_or_default(), ..first.clone() })
}

/// The box around two, each by its smallest and its largest corner.
fn around([low_a, high_a]: [[f32; 3]; 2], [low_b, high_b]: [[f32; 3]; 2]) -> [[f32; 3]; 2] {
    let each = |a: [f32; 3], b: [f32; 3], pick: fn(f32, f32) -> f32| {
        let ([ax, ay, az], [bx, by, bz]) = (a, b);
        [pick(ax, bx), pick(ay, by), pick(az, bz)]
    };
    [each(low_a, low_b, f32::min), each(high_a, high_b, f32::max)]
}
