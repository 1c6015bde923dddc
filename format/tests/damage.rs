//! What damage to a stream does: it is found, and what can be delimited is still given out.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

mod sample;

use sample::{DC, FRAME, GOP, REFINEMENT};
use splatstream_format::syntax::{UnitId, UnitType};
use splatstream_format::unit::{Damaged, Delivery, Stream, write_unit};
use splatstream_format::{Class, ErrorKind, Limits};

// covers: SS-UH-001, SS-UH-002, SS-FH-002
#[test]
fn one_changed_byte_is_always_found() {
    let bytes = sample::stream(&sample::units());
    for place in 0..bytes.len() {
        for change in 1..=u8::MAX {
            let mut changed = bytes.clone();
            changed[place] ^= change;
            let error = sample::verdict(&changed);
            assert!(error.is_some(), "byte {place} changed by {change:#04x} is not found");
        }
    }
}

// covers: SS-ER-004, SS-ER-006
#[test]
fn every_truncation_is_of_class_truncated() {
    let bytes = sample::stream(&sample::units());
    for length in 0..bytes.len() {
        let error = sample::verdict(&bytes[..length]).unwrap();
        assert_eq!(error.class(), Class::Truncated, "{length} bytes: {error}");
        assert_eq!(error.class().exit_code(), 14);
        assert!(error.at <= u64::try_from(length).unwrap(), "{length} bytes: {error}");
    }
}

// covers: SS-EN-002, SS-BS-007
#[test]
fn nothing_may_follow_the_end_unit() {
    let bytes = sample::stream(&sample::units());
    for tail in [vec![0], bytes[16..].to_vec()] {
        let error = sample::verdict(&[bytes.clone(), tail.clone()].concat()).unwrap();
        let (element, left) = ("stream", u64::try_from(tail.len()).unwrap());
        assert_eq!(error.kind, ErrorKind::TrailingBytes { element, bytes: left });
        assert_eq!(error.at, u64::try_from(bytes.len()).unwrap());
    }
}

// covers: SS-BS-007
#[test]
fn a_stream_without_end_unit_is_truncated_where_the_next_unit_should_start() {
    let mut units = sample::units();
    units.pop();
    let bytes = sample::stream(&units);
    let error = sample::verdict(&bytes).unwrap();
    assert_eq!(error.kind, ErrorKind::Truncated { element: "unit_header" });
    assert_eq!(error.at, u64::try_from(bytes.len()).unwrap());
}

// covers: SS-UH-002
#[test]
fn units_behind_a_damaged_payload_are_given_out() {
    let units = sample::units();
    let mut bytes = sample::stream(&units);
    for damaged in [DC, REFINEMENT] {
        let payload = usize::try_from(sample::unit_at(&units, damaged)).unwrap() + 20;
        bytes[payload] ^= 1;
    }
    let mut given = Stream::open(&bytes, &Limits::default()).unwrap().units();
    for (place, (id, payload)) in units.iter().enumerate() {
        match given.next_unit().unwrap().unwrap() {
            Delivery::Intact(unit) => assert_eq!((unit.header.id(), unit.payload), (*id, payload.as_slice())),
            Delivery::Damaged(Damaged { unit, error, passed_over }) => {
                assert!(place == DC || place == REFINEMENT);
                assert_eq!((unit.header.id(), unit.at), (*id, sample::unit_at(&units, place)));
                assert_eq!((error.at, passed_over), (unit.at + 16, false));
            }
        }
    }
    assert!(given.next_unit().is_none());
    let strict = Stream::open(&bytes, &Limits::default()).unwrap().units();
    assert_eq!(strict.filter(Result::is_err).count(), 2);
}

// covers: SS-UH-001
#[test]
fn nothing_is_given_out_behind_a_damaged_header() {
    let units = sample::units();
    let mut bytes = sample::stream(&units);
    bytes[usize::try_from(sample::unit_at(&units, FRAME)).unwrap() + 13] ^= 1;
    let given: Vec<_> = Stream::open(&bytes, &Limits::default()).unwrap().units().collect();
    assert_eq!(given.len(), FRAME + 1);
    assert_eq!(given.iter().filter(|unit| unit.is_err()).count(), 1);
    assert!(given.last().unwrap().is_err());
}

// covers: SS-UH-004
#[test]
fn an_unknown_unit_that_is_not_critical_is_passed_over_unread() {
    let units = sample::units();
    // Weights and increments are units of profile Dynamic.
    for unit_type in [9, 10, 12, 127, 128, 255] {
        let mut private = Vec::new();
        let id = UnitId {
            unit_type: UnitType::User(200),
            spatial_layer: 1,
            temporal_layer: 2,
            refinement: 200,
            frame: 77,
        };
        write_unit(&mut private, id, b"anything").unwrap();
        private[0] = unit_type;
        sample::seal_unit_header(&mut private, 0);
        // Its check sum is not looked at.
        private[25] ^= 1;
        for place in 0..units.len() {
            let mut bytes = sample::stream(&units);
            let at = usize::try_from(sample::unit_at(&units, place)).unwrap();
            bytes.splice(at..at, private.iter().copied());
            assert_eq!(sample::verdict(&bytes), None, "type {unit_type} before unit {place}");
        }
    }
}

#[test]
fn units_are_given_out_from_an_offset_of_the_index() {
    let units = sample::units();
    let bytes = sample::stream(&units);
    let stream = Stream::open(&bytes, &Limits::default()).unwrap();
    let given = stream.units_from(sample::unit_at(&units, GOP)).count();
    assert_eq!(given, units.len() - GOP);
    let past_the_end = stream.units_from(u64::MAX).next().unwrap().unwrap_err();
    assert_eq!(past_the_end.class(), Class::Truncated);
}

#[test]
fn a_unit_that_a_reader_refuses_is_not_written() {
    let mut out = vec![1, 2, 3];
    let kept = out.clone();
    for id in [
        UnitId::stream(UnitType::Reserved(0)),
        UnitId::stream(UnitType::Reserved(3)),
        UnitId::stream(UnitType::User(1)),
        UnitId::of_frame(UnitType::End, 1),
        UnitId::of_refinement(0, 10),
        UnitId { spatial_layer: 4, ..UnitId::of_frame(UnitType::FrameHeader, 0) },
        UnitId { temporal_layer: 4, ..UnitId::of_frame(UnitType::Increment, 0) },
        UnitId { spatial_layer: 1, ..UnitId::of_frame(UnitType::Codebook, 0) },
        UnitId { temporal_layer: 1, ..UnitId::of_frame(UnitType::GopHeader, 0) },
        UnitId { refinement: 1, ..UnitId::of_frame(UnitType::FrameHeader, 0) },
    ] {
        assert!(write_unit(&mut out, id, &[]).is_err(), "{id:?}");
        assert_eq!(out, kept);
    }
}
