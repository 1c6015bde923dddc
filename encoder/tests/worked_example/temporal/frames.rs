//! What frames carry and show: clause 7.8.

use super::walk::{Common, Walked};
use super::{Names, gaussians, list, name_list, of};
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_format::Limits;
use std::fmt::Write as _;
use std::ops::ControlFlow;

/// The frames at an operating point.
fn decoded(bytes: &[u8], operating_point: OperatingPoint) -> Vec<DecodedFrame> {
    let mut frames = Vec::new();
    let options = Options { operating_point, ..Options::default() };
    let summary = decode_stream(bytes, &options, |_, frame| {
        frames.push(frame);
        ControlFlow::Continue(())
    });
    assert_eq!(summary.verdict(), None);
    frames
}

/// Clause 7.8.1 for a client of spatial layer 0.
pub(crate) fn carried(text: &mut String, bytes: &[u8], common: &Common, frames: &[Walked], names: &Names) {
    text.push_str(
        "\n## E.9 Carried lists\n\nA client of spatial layer 0 has no increments of frames 1 and 2. It shows the lists of \
         frame 0, displaced by the cells of each frame (7.8.1). None of its Gaussians is replaced, so that those in \
         stale cells stay.\n",
    );
    let point = OperatingPoint { spatial: 0, ..OperatingPoint::ALL };
    for (frame, shown) in frames.iter().zip(decoded(bytes, point)).skip(1) {
        let lists = common.carried(frames, frame.index, 0, false);
        for (h, carried) in lists.iter().enumerate() {
            write!(text, "\n`carried({}, {h})`:\n", frame.index).unwrap();
            gaussians(text, carried, name_list(names, (0, 0, h as u8)));
        }
        let position = lists.iter().flat_map(|list| &list.planes.position[0]);
        assert!(shown.planes.position[0].iter().eq(position), "carried lists are shown");
    }
}

/// Clauses 7.8.2 and 7.8.3.
pub(crate) fn shown(text: &mut String, bytes: &[u8]) {
    let point = OperatingPoint { spatial: 1, temporal: 1, refinement: 0 };
    let small = extract(bytes, point, &Limits::default()).unwrap();
    write!(
        text,
        "\n## E.10 The shown frames at refinement 0\n\nExtracted at {point}, the stream has {} of {} bytes. Every frame \
         shows its list 0, and q and o of all Gaussians are output with the compensation of unit (1, 0) of the frame \
         (7.8.3).\n\n| Frame | i | position | q | o | q for output | o for output |\n|---|---|---|---|---|---|---|\n",
        small.len(),
        bytes.len()
    )
    .unwrap();
    for frame in decoded(&small, point) {
        assert_eq!((frame.carried, frame.level), (0, 1));
        let (index, planes) = (frame.index, frame.planes.clone());
        let output = frame.into_shown();
        for i in 0..planes.len() {
            let cells = [
                list(of(&planes.position, i)),
                list(of(&planes.log_scale, i)),
                planes.opacity[i].to_string(),
                list(of(&output.log_scale, i)),
                output.opacity[i].to_string(),
            ];
            writeln!(text, "| {index} | {i} | {} |", cells.join(" | ")).unwrap();
        }
    }
}
