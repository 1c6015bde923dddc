//! What is wrong with a stream, and which frames that costs.

use crate::failure::StreamFault;
use crate::numbers::FrameRange;
use crate::short_frames::{layers_of, point_of, short_frames};
use crate::stream_file::StreamFile;
use serde::Serialize;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::Summary;
use splatstream_stream::structure::{Gop, Structure, add_run};
use std::collections::BTreeSet;

/// Errors, and frames that were never output.
#[derive(Serialize)]
pub(super) struct Loss {
    /// Every error, in the order of the stream.
    pub(super) errors: Vec<StreamFault>,
    /// First and last display index of frames that are lost.
    pub(super) lost: Vec<(u32, u32)>,
    /// The highest point that the stream lists, of those up to the one asked for.
    #[serde(skip)]
    pub(super) listed: Option<OperatingPoint>,
    /// Frames that lack increments of the point asked for.
    #[serde(skip)]
    pub(super) short: BTreeSet<u32>,
}

impl Loss {
    /// What decoding found of the frames that were asked for, of which those of `shown` were output.
    pub(super) fn new(
        stream: &StreamFile,
        announced: u32,
        options: &Options,
        summary: &Summary,
        frames: FrameRange,
        shown: &BTreeSet<u32>,
    ) -> Self {
        let mut found: Vec<(u32, u32)> =
            summary.lost.iter().map(|range| (*range.start(), *range.end())).collect();
        let (mut listed, mut short) = (None, BTreeSet::new());
        if !summary.errors.is_empty() {
            let structure = Structure::of(&stream.bytes, &options.limits);
            let point = options.operating_point;
            listed = structure.points_up_to(layers_of(point)).map(|listed| point_of(listed.point)).max();
            // Frames of which not even a header is left, and, where decoding did not go on after the first error, only those
            // after the last GOP that there is.
            let after = match options.stop_at_first_error {
                true => structure.gops.iter().map(Gop::end).max().unwrap_or(0),
                false => frames.first,
            };
            let missing = structure.missing(shown, (announced > 0).then_some(announced), layers_of(point));
            let later = |(first, last): (u32, u32)| Some((first.max(after), last)).filter(|_| last >= after);
            found.extend(missing.into_iter().filter_map(later));
            found.sort_unstable();
            short = short_frames(&stream.bytes, &structure, point, !found.is_empty(), &options.limits);
        }
        let mut lost = Vec::new();
        found.into_iter().for_each(|(first, last)| add_run(&mut lost, first, last));
        let asked = |(first, last): (u32, u32)| {
            let last = frames.end.map_or(last, |end| last.min(end.saturating_sub(1)));
            Some((first.max(frames.first), last)).filter(|(first, last)| first <= last)
        };
        Self {
            errors: summary.errors.iter().copied().map(StreamFault::from).collect(),
            lost: lost.into_iter().filter_map(asked).collect(),
            listed,
            short,
        }
    }

    /// The frames that are lost, in words.
    pub(super) fn frames(&self) -> Option<String> {
        let range = |&(first, last): &(u32, u32)| {
            if first == last { first.to_string() } else { format!("{first}..={last}") }
        };
        let ranges: Vec<String> = self.lost.iter().map(range).collect();
        match self.lost.as_slice() {
            [] => None,
            [(first, last)] if first == last => Some(format!("frame {first}")),
            _ => Some(format!("frames {}", ranges.join(", "))),
        }
    }
}
