//! What the inspector says of a stream.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

mod sample;

use splatstream_format::inspect::{Element, inspect};
use splatstream_format::syntax::Profile;
use splatstream_format::{Error, Limits};

fn elements(bytes: &[u8]) -> (Vec<Element>, Option<Error>) {
    let mut elements = Vec::new();
    let error = inspect(bytes, &Limits::default(), &mut |element| elements.push(element));
    (elements, error)
}

/// The values of an element wherever it occurs.
fn values(elements: &[Element], record: &str, name: &str) -> Vec<String> {
    let found = elements.iter().filter(|element| element.record == record && element.name == name);
    found.map(|element| element.value.to_string()).collect()
}

#[test]
fn codes_are_shown_with_what_they_stand_for() {
    let units = sample::units();
    let (elements, error) = elements(&sample::stream(&units));
    assert_eq!(error, None);
    let one = |record, name| values(&elements, record, name).join("; ");
    assert_eq!(one("file_header", "signature"), "[89, 47, 53, 53, 0D, 0A, 1A, 0A]");
    assert_eq!(one("file_header", "profile"), "0 (Intra)");
    assert_eq!(values(&elements, "unit_header", "unit_type")[sample::INCREMENT], "6 (increment)");
    assert_eq!(values(&elements, "unit_header", "unit_flags")[sample::END], "1 (critical)");
    assert_eq!(one("sequence_parameters", "sequence_flags"), "1 (canonical_axes)");
    assert_eq!(one("sequence_parameters", "position_offset"), "[-1, 0, 1]");
    assert_eq!(one("sequence_parameters", "log_scale_step"), "0.0625");
    assert_eq!(one("transform", "transform_kind"), "0 (dc); 1 (sh)");
    assert_eq!(one("transform", "mean"), "3 values, -1 to 1999; 9 values, -1 to 7999");
    assert_eq!(one("codebook", "entries"), "4 values, -128 to 127");
    assert_eq!(one("frame_header", "frame_type"), "0 (I)");
    let present = "880 (has_new, has_position_shift, has_attribute_step, has_sh, has_compensation)";
    assert_eq!(one("increment", "increment_flags"), present);
    assert_eq!(one("increment", "refinement_digest"), "0x0123456789abcdef");
    assert_eq!(one("increment", "new_count"), "100");
    assert_eq!(one("increment", "attribute_step"), "[1, 2, 3, 4, 24]");
    assert_eq!(one("increment", "sh_mode"), "2 (vector quantised)");
    assert_eq!(one("increment", "codebook_ids"), "[7]");
    assert_eq!(one("increment", "compensation_log_scale"), "-1");
    assert_eq!(one("section", "lanes_log2"), "3 (new)");
    assert!(one("section", "models").starts_with("3 bytes, not readable: "));
    assert_eq!(one("section", "block_length[1]"), "5");
    assert_eq!(one("section", "blocks[1]"), "5 bytes");
    assert_eq!(one("scene_description", "up_axis"), "4 (-y)");
    assert_eq!(one("scene_description", "bounds_min"), "[-1, 0, 0]");
    assert_eq!(one("scene_description", "title"), "\"Kö\"");
    assert_eq!(one("camera", "vertical_field_of_view"), "1");
    assert_eq!(one("index_entry", "offset"), sample::unit_at(&units, sample::GOP).to_string());
}

#[test]
fn an_element_has_its_offset_its_clause_and_a_meaning() {
    let units = sample::units();
    let (elements, _) = elements(&sample::stream(&units));
    let rank = elements.iter().find(|element| element.name == "rank").unwrap();
    assert_eq!(rank.at_bit, 8 * (sample::unit_at(&units, sample::DC) + 20 + 3));
    assert_eq!((rank.bits, rank.clause), (8, "5.7"));
    assert!(elements.iter().all(|element| !element.meaning.is_empty()));
}

#[test]
fn networks_and_cells_are_shown() {
    let units = sample::dynamic_units();
    let bytes = sample::stream_of(Profile::Dynamic, &units);
    let (elements, error) = elements(&bytes);
    assert_eq!(error, None);
    assert_eq!(values(&elements, "weights", "model_source"), ["0"]);
    assert_eq!(values(&elements, "network", "feed_forward_width"), ["2"]);
    let parameters = units[sample::WEIGHTS].1.len() - 19;
    assert_eq!(values(&elements, "network", "parameters"), [format!("{parameters} bytes")]);
    let shown: u64 = elements.iter().map(|element| element.bits).sum();
    assert_eq!(shown, 8 * u64::try_from(bytes.len()).unwrap());
    assert_eq!(values(&elements, "frame_header", "carried_digest"), ["0x000000000000fedc"]);
    assert_eq!(values(&elements, "frame_header", "cell_count"), ["5"]);
    assert_eq!(values(&elements, "section", "lanes_log2"), ["0 (cells)"]);
}

#[test]
fn a_cut_stream_shows_what_is_there() {
    let bytes = sample::stream(&sample::units());
    let (whole, _) = elements(&bytes);
    for length in 0..bytes.len() {
        let (part, error) = elements(&bytes[..length]);
        assert!(error.is_some());
        assert_eq!(part, whole[..part.len()], "{length} bytes");
        let end = part.last().map_or(0, |element| (element.at_bit + element.bits) / 8);
        assert!(end <= u64::try_from(length).unwrap());
    }
}

#[test]
fn units_after_a_broken_payload_are_still_shown() {
    let mut units = sample::units();
    units[sample::INCREMENT].1[23] = 200;
    let (elements, error) = elements(&sample::stream(&units));
    assert_eq!(error.unwrap().kind.code(), "SHORT_SECTION");
    assert_eq!(values(&elements, "increment", "new_count"), ["100"]);
    assert_eq!(values(&elements, "end", "unit_count"), ["9"]);
}

#[test]
fn parameters_of_frames_need_those_of_the_sequence() {
    let mut units = sample::units();
    units.remove(sample::SEQUENCE);
    let (elements, error) = elements(&sample::stream(&units));
    assert_eq!(error.unwrap().kind.code(), "UNEXPECTED_UNIT");
    assert_eq!(values(&elements, "increment", "increment_flags").len(), 1);
}
