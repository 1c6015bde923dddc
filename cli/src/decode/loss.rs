//! What is wrong with a stream, and which frames that costs.

use crate::failure::StreamFault;
use crate::numbers::FrameRange;
use crate::stream_file::StreamFile;
use crate::structure::{Gop, Structure};
use serde::Serialize;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::Summary;

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
}

impl Loss {
    /// What decoding found of the frames that were asked for.
    pub(super) fn new(
        stream: &StreamFile,
        announced: u32,
        options: &Options,
        summary: &Summary,
        frames: FrameRange,
    ) -> Self {
        let mut lost: Vec<(u32, u32)> =
            summary.lost.iter().map(|range| (*range.start(), *range.end())).collect();
        let mut listed = None;
        if !summary.errors.is_empty() {
            let Structure { gops, points, .. } = Structure::of(&stream.bytes, &options.limits);
            let asked = options.operating_point;
            let is_asked = |point: &OperatingPoint| {
                point.spatial <= asked.spatial
                    && point.temporal <= asked.temporal
                    && point.refinement <= asked.refinement
            };
            listed = points.into_iter().filter(is_asked).max();
            let end = gops.iter().map(Gop::end).max().unwrap_or(0);
            // GOPs of which not even a header is left.
            match lost.last_mut() {
                Some((_, last)) if last.saturating_add(1) == end && end < announced => *last = announced - 1,
                _ if end < announced => lost.push((end, announced - 1)),
                _ => {}
            }
        }
        let asked = |(first, last): (u32, u32)| {
            let last = frames.end.map_or(last, |end| last.min(end.saturating_sub(1)));
            Some((first.max(frames.first), last)).filter(|(first, last)| first <= last)
        };
        Self {
            errors: summary.errors.iter().copied().map(StreamFault::from).collect(),
            lost: lost.into_iter().filter_map(asked).collect(),
            listed,
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
