//! C.5: the subsegments of a GOP in one Representation.

use super::init::{put_index, track_id};
use super::layout::Layout;
use super::{Clock, Options};
use crate::boxes::flags::{
    DATA_OFFSET, DEFAULT_BASE_IS_MOOF, DURATION_IS_EMPTY, SAMPLE_DURATION, SAMPLE_SIZE,
};
use crate::boxes::write::{put, put_full, u32s, u64};
use crate::division::{Gop, Piece, Tools};
use crate::representation::Representation;
use core::ops::Range;
use splatstream_format::{Error, ErrorKind, Limits, Result};

/// The largest `range_size` of `ssix`, bytes.
pub(crate) const MAX_RANGE: u32 = (1 << 24) - 1;
/// Bytes of `moof` and of the header of `mdat` without the entries of samples.
const FRAGMENT: usize = 96;
/// Bytes of an entry of `trun`.
const ENTRY: usize = 8;

/// A frame of a Representation.
#[derive(Debug, Clone)]
struct Sample<'a> {
    frame: u32,
    time: u64,
    /// Ticks to the next sample or to the end of the GOP.
    duration: u64,
    pieces: Vec<&'a Piece>,
}

/// All refinements of some frames: a subsegment.
#[derive(Debug, Clone)]
pub(crate) struct Subsegment {
    /// Display indices of its frames.
    pub(crate) frames: Vec<u32>,
    /// When the first frame is shown, ticks; of one without frames, when its GOP is.
    pub(crate) time: u64,
    /// When the last frame ends; of one without frames, when its GOP does.
    pub(crate) end: u64,
    /// Whether it starts with what decoding of a GOP starts with.
    pub(crate) is_access_point: bool,
    /// Its levels, lowest first.
    pub(crate) levels: Vec<Level>,
}

/// A refinement of some frames: `moof` and `mdat`.
#[derive(Debug, Clone)]
pub(crate) struct Level {
    /// `moof` and the header of `mdat`.
    pub(crate) header: Vec<u8>,
    /// What is in `mdat`: parts of the stream.
    pub(crate) parts: Vec<Range<u64>>,
    /// Bytes of all.
    pub(crate) size: u64,
    /// What the units are.
    pub(crate) tools: Tools,
}

impl Subsegment {
    /// Bytes.
    pub(crate) fn size(&self) -> u64 {
        self.levels.iter().map(|level| level.size).fold(0, u64::saturating_add)
    }
}

/// The subsegments of a GOP; one at least. `number` is that of the next fragment in the file.
pub(crate) fn subsegments(
    gop: &Gop,
    representation: Representation,
    refinements: u8,
    clock: Clock,
    options: &Options,
    number: &mut u32,
) -> Result<Vec<Subsegment>> {
    let samples = samples(gop, representation, clock);
    let whole = (clock.time(gop.first_frame), end_of(gop, clock));
    let mut groups: Vec<Vec<Sample<'_>>> = vec![Vec::new()];
    let mut bytes = 0_u64;
    for sample in samples {
        let size = sample_size(&sample, refinements);
        Limits::check(gop.start, "referenced_size", size, options.max_subsegment.into())
            .map_err(|error| Error { clause: "C.5.2", ..error })?;
        let joined = bytes.saturating_add(size);
        let last = groups.last().and_then(|group| group.last());
        let is_apart = last.is_some_and(|last| {
            options.layout == Layout::Frame
                || joined > options.max_subsegment.into()
                || last.duration > u32::MAX.into()
        });
        bytes = if is_apart { size } else { joined };
        match groups.last_mut() {
            Some(group) if !is_apart => group.push(sample),
            _ => groups.push(vec![sample]),
        }
    }
    let mut made = Vec::new();
    for group in groups {
        made.push(subsegment(&group, whole, refinements, number)?);
    }
    if let (Some(first), true) = (made.first_mut(), representation.is_intra()) {
        first.is_access_point = true;
    }
    Ok(made)
}

/// An upper bound of the bytes of a sample with its boxes.
fn sample_size(sample: &Sample<'_>, refinements: u8) -> u64 {
    let boxes = usize::from(refinements).saturating_mul(FRAGMENT.saturating_add(ENTRY));
    let pieces = sample.pieces.iter().map(|piece| piece.end.saturating_sub(piece.start));
    pieces.fold(u64::try_from(boxes).unwrap_or(u64::MAX), u64::saturating_add)
}

fn samples(gop: &Gop, representation: Representation, clock: Clock) -> Vec<Sample<'_>> {
    let mut samples: Vec<Sample<'_>> = Vec::new();
    for piece in gop.pieces.iter().filter(|piece| piece.place.representation == representation) {
        let frame = piece.place.frame;
        match samples.last_mut() {
            Some(last) if last.frame == frame => last.pieces.push(piece),
            _ => samples.push(Sample { frame, time: clock.time(frame), duration: 0, pieces: vec![piece] }),
        }
    }
    let mut next = samples.last().map_or(0, |last| clock.ticks(frame_after(gop, last.frame)));
    for sample in samples.iter_mut().rev() {
        sample.duration = next.saturating_sub(sample.time);
        next = sample.time;
    }
    samples
}

/// 6.5: the frame after one in the same Representation, or the first one after the GOP.
fn frame_after(gop: &Gop, frame: u32) -> u64 {
    let (header, index) = (&gop.header, frame.saturating_sub(gop.first_frame));
    let (role, depth) = (header.role(index), u32::from(header.temporal_depth));
    let step = match (header.is_predicted(), role.reference, role.temporal_layer) {
        (false, ..) => 1,
        (true, None, _) => header.gop_frame_count,
        (true, Some(_), 0) => 1_u32.wrapping_shl(depth),
        (true, Some(_), layer) => 2_u32.wrapping_shl(depth.saturating_sub(layer.into())),
    };
    let end = u64::from(gop.first_frame).saturating_add(header.gop_frame_count.into());
    u64::from(frame).saturating_add(step.into()).min(end)
}

/// When a GOP ends.
pub(crate) fn end_of(gop: &Gop, clock: Clock) -> u64 {
    clock.ticks(u64::from(gop.first_frame).saturating_add(gop.header.gop_frame_count.into()))
}

/// Samples, or none of a GOP with a start and an end, as a subsegment.
fn subsegment(
    samples: &[Sample<'_>],
    (start, end): (u64, u64),
    refinements: u8,
    number: &mut u32,
) -> Result<Subsegment> {
    let time = samples.first().map_or(start, |sample| sample.time);
    let end = samples.last().map_or(end, |sample| sample.time.saturating_add(sample.duration));
    let mut levels = Vec::new();
    for refinement in 0..refinements {
        levels.push(level(samples, time, refinement, *number)?);
        *number = number.wrapping_add(1);
    }
    let frames = samples.iter().map(|sample| sample.frame).collect();
    Ok(Subsegment { frames, time, end, is_access_point: false, levels })
}

fn level(samples: &[Sample<'_>], time: u64, refinement: u8, number: u32) -> Result<Level> {
    let (mut entries, mut parts, mut tools, mut length) = (Vec::new(), Vec::new(), Tools::default(), 8_u64);
    for sample in samples {
        let piece = sample.pieces.iter().find(|piece| piece.place.refinement == refinement);
        let part = piece.map_or(0..0, |piece| piece.start..piece.end);
        let size = part.end.saturating_sub(part.start);
        let duration = u32::try_from(sample.duration).unwrap_or(u32::MAX);
        entries.push((duration, u32::try_from(size).unwrap_or(u32::MAX)));
        length = length.saturating_add(size);
        parts.push(part);
        if let Some(piece) = piece {
            tools.add(&piece.tools);
        }
    }
    parts.retain(|part| !part.is_empty());
    let mut header = fragment(number, track_id(refinement), time, &entries);
    let too_long = ErrorKind::OverLimit { limit: "mdat", asked: length, allowed: u32::MAX.into() };
    let length = u32::try_from(length).map_err(|_| Error::new(0, "C.5.1", too_long))?;
    u32s(&mut header, &[length]);
    header.extend(b"mdat");
    let boxes = u64::try_from(header.len()).unwrap_or(u64::MAX).saturating_sub(8);
    Ok(Level { size: boxes.saturating_add(length.into()), header, parts, tools })
}

/// C.5.1: `moof` of one track; an entry is duration and size of a sample.
fn fragment(number: u32, track: u32, time: u64, entries: &[(u32, u32)]) -> Vec<u8> {
    let mut out = Vec::new();
    let data = ENTRY.saturating_mul(entries.len()).saturating_add(FRAGMENT);
    put(&mut out, *b"moof", |out| {
        put_full(out, *b"mfhd", 0, 0, |out| u32s(out, &[number]));
        put(out, *b"traf", |out| {
            let empty = if entries.is_empty() { DURATION_IS_EMPTY } else { 0 };
            put_full(out, *b"tfhd", 0, DEFAULT_BASE_IS_MOOF | empty, |out| u32s(out, &[track]));
            put_full(out, *b"tfdt", 1, 0, |out| u64(out, time));
            if entries.is_empty() {
                return;
            }
            put_full(out, *b"trun", 0, DATA_OFFSET | SAMPLE_DURATION | SAMPLE_SIZE, |out| {
                let count = u32::try_from(entries.len()).unwrap_or(u32::MAX);
                u32s(out, &[count, u32::try_from(data).unwrap_or(u32::MAX)]);
                entries.iter().for_each(|&(duration, size)| u32s(out, &[duration, size]));
            });
        });
    });
    out
}

/// C.5.2 and C.5.3: `sidx` and `ssix` of subsegments.
pub(crate) fn indices(subsegments: &[Subsegment], clock: Clock) -> Result<Vec<u8>> {
    let count = u64::try_from(subsegments.len()).unwrap_or(u64::MAX);
    Limits::check(0, "reference_count", count, u16::MAX.into())
        .map_err(|error| Error { clause: "C.5.2", ..error })?;
    let Some(first) = subsegments.first() else { return Ok(Vec::new()) };
    let levels = level_index(subsegments);
    let end = subsegments.last().map(|last| last.end);
    let next = subsegments.iter().skip(1).map(|subsegment| subsegment.time).chain(end);
    let references = subsegments.iter().zip(next).map(|(subsegment, next)| {
        let duration = u32::try_from(next.saturating_sub(subsegment.time)).unwrap_or(u32::MAX);
        (u32::try_from(subsegment.size()).unwrap_or(u32::MAX), duration, subsegment.is_access_point)
    });
    let mut out = Vec::new();
    let references: Vec<_> = references.collect();
    put_index(&mut out, clock, first.time, u64::try_from(levels.len()).unwrap_or(u64::MAX), &references);
    out.extend(levels);
    Ok(out)
}

/// C.5.3: the bytes of each level. A level that is longer than a range has several, one after the other.
fn level_index(subsegments: &[Subsegment]) -> Vec<u8> {
    let mut out = Vec::new();
    if subsegments.iter().any(|subsegment| subsegment.levels.len() < 2) {
        return out;
    }
    put_full(&mut out, *b"ssix", 0, 0, |out| {
        u32s(out, &[u32::try_from(subsegments.len()).unwrap_or(u32::MAX)]);
        for subsegment in subsegments {
            let sizes = (1_u32..).zip(&subsegment.levels);
            let ranges: Vec<u32> =
                sizes.flat_map(|(level, of)| ranges(of.size).map(move |size| level << 24 | size)).collect();
            u32s(out, &[u32::try_from(ranges.len()).unwrap_or(u32::MAX)]);
            u32s(out, &ranges);
        }
    });
    out
}

/// The sizes of the ranges of a level.
fn ranges(size: u64) -> impl Iterator<Item = u32> {
    let whole = size.checked_div(MAX_RANGE.into()).unwrap_or(0);
    let rest = size.checked_rem(MAX_RANGE.into()).unwrap_or(0);
    let rest = u32::try_from(rest).ok().filter(|rest| *rest > 0);
    (0..whole).map(|_| MAX_RANGE).chain(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_longer_than_a_range_has_several() {
        let all = |size| ranges(size).collect::<Vec<u32>>();
        assert_eq!(all(100), [100]);
        assert_eq!(all(16_777_215), [16_777_215]);
        assert_eq!(all(16_777_216), [16_777_215, 1]);
        assert_eq!(all(40_000_000).iter().sum::<u32>(), 40_000_000);
    }

    #[test]
    fn a_fragment_is_as_long_as_its_data_offset_says() {
        for count in 1..4 {
            let bytes = fragment(1, 1, 0, &vec![(1, 2); count]);
            assert_eq!(bytes.len(), FRAGMENT - 8 + count * ENTRY);
        }
    }
}
