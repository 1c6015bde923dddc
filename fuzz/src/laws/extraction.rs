//! Extraction and decoding at an operating point give the same frames.

use super::{Decoded, STRICT, is_less};
use crate::LIMITS;
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_format::syntax::SequenceParameters;

/// One of the operating points of a sequence.
pub fn chosen(sequence: &SequenceParameters, choice: u32) -> OperatingPoint {
    let one_of = |count: u8, shift: u32| (choice.rotate_right(shift) % u32::from(count)) as u8;
    OperatingPoint {
        spatial: one_of(sequence.spatial_layer_count, 8),
        temporal: one_of(sequence.temporal_layer_count, 16),
        refinement: one_of(sequence.refinement_count, 0),
    }
}

/// `strict` is what the whole stream decodes to. Gives the stream of the operating point.
pub fn holds_at(bytes: &[u8], strict: &Decoded, point: OperatingPoint) -> Vec<u8> {
    let part = extract(bytes, point, &LIMITS).expect("what decodes can be extracted");
    let from_part = Decoded::of(&part, &STRICT);
    let from_whole = Decoded::of(bytes, &Options { operating_point: point, ..STRICT });
    assert_eq!(from_part.end, None, "what is extracted decodes");
    assert_eq!(from_part.frames, from_whole.frames, "extraction changes a frame");
    let at_point = Decoded::of(&part, &Options { operating_point: point, ..STRICT });
    assert_eq!(
        at_point.frames, from_whole.frames,
        "at its own point an extracted stream shows something else"
    );
    is_less(&from_part.frames, &strict.frames);
    let Some(sequence) = strict.sequence.filter(|sequence| sequence.temporal_layer_count == 1) else {
        return part;
    };
    let is_top = point.spatial + 1 == sequence.spatial_layer_count;
    let has_part = |frame: &&DecodedFrame| from_part.frames.iter().any(|part| part.number == frame.number);
    let expected = strict.frames.iter().filter(|frame| is_top || has_part(frame));
    assert_eq!(expected.count(), from_part.frames.len(), "a frame is missing");
    part
}
