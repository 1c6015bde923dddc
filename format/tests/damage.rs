//! What damage to a stream does: it is found, and what can be delimited is still given out.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

mod sample;

use sample::{DC, FRAME, GOP, INCREMENT, SEQUENCE};
use splatstream_format::syntax::{UnitId, UnitType};
use splatstream_format::unit::{Landmark, Stream, write_unit};
use splatstream_format::{Class, ErrorKind, Limits};

// covers: SS-UH-001, SS-UH-009, SS-FH-002
#[test]
fn one_changed_byte_is_always_found() {
    let bytes = sample::stream(&sample::units());
    for byte in 0..bytes.len() {
        for change in 1..=u8::MAX {
            let mut changed = bytes.clone();
            changed[byte] ^= change;
            let error = sample::verdict(&changed);
            assert!(error.is_some(), "byte {byte} changed by {change:#04x} is not found");
        }
    }
}

// covers: SS-ER-006
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

// covers: SS-EN-002, SS-BS-011
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

// covers: SS-BS-011
#[test]
fn a_stream_without_end_unit_is_truncated_where_the_next_unit_should_start() {
    let mut units = sample::units();
    units.pop();
    let bytes = sample::stream(&units);
    let error = sample::verdict(&bytes).unwrap();
    assert_eq!(error.kind, ErrorKind::Truncated { element: "unit_header" });
    assert_eq!(error.at, u64::try_from(bytes.len()).unwrap());
}

// covers: SS-UH-009
#[test]
fn units_after_a_damaged_payload_are_given_out() {
    let units = sample::units();
    let mut bytes = sample::stream(&units);
    for damaged in [DC, INCREMENT] {
        let payload = usize::try_from(sample::unit_at(&units, damaged)).unwrap() + 20;
        bytes[payload] ^= 1;
    }
    let mut given = Stream::open(&bytes, &Limits::default()).unwrap().units();
    for (index, (id, payload)) in units.iter().enumerate() {
        let unit = given.next_unit().unwrap().unwrap();
        assert_eq!((unit.header.id(), unit.at), (*id, sample::unit_at(&units, index)));
        match unit.check_payload() {
            Ok(()) => assert_eq!(unit.payload, payload),
            Err(error) => {
                assert!(index == DC || index == INCREMENT);
                assert_eq!(error.at, unit.at + 16);
            }
        }
    }
    assert!(given.next_unit().is_none());
    let strict = Stream::open(&bytes, &Limits::default()).unwrap().units();
    assert_eq!(strict.filter(Result::is_err).count(), 2);
}

// covers: SS-UH-001
#[test]
fn nothing_is_given_out_after_a_damaged_header() {
    let units = sample::units();
    let mut bytes = sample::stream(&units);
    bytes[usize::try_from(sample::unit_at(&units, FRAME)).unwrap() + 13] ^= 1;
    let given: Vec<_> = Stream::open(&bytes, &Limits::default()).unwrap().units().collect();
    assert_eq!(given.len(), FRAME + 1);
    assert_eq!(given.iter().filter(|unit| unit.is_err()).count(), 1);
    assert!(given.last().unwrap().is_err());
}

#[test]
fn a_scan_finds_the_next_intact_landmark() {
    let once = sample::units();
    // The first GOP twice: units 0 to 7, then units 2 to 9.
    let units: sample::Units = once[..=INCREMENT].iter().chain(&once[GOP..]).cloned().collect();
    let bytes = sample::stream(&units);
    let offset = |index| usize::try_from(sample::unit_at(&units, index)).unwrap();
    let second = INCREMENT + 1;
    for damaged in 0..=INCREMENT {
        let mut bytes = bytes.clone();
        bytes[offset(damaged) + 7] ^= 1;
        let mut given = Stream::open(&bytes, &Limits::default()).unwrap().units();
        let intact = (0..damaged).filter(|_| given.next_unit().unwrap().is_ok()).count();
        assert_eq!(intact, damaged);
        assert_eq!(given.next_unit().unwrap().unwrap_err().kind.code(), "CHECKSUM");
        assert!(given.next_unit().is_none() && !given.is_open());
        assert!(given.scan_for(Landmark::GopHeader));
        let expected = if damaged < GOP { GOP } else { second };
        assert_eq!(given.position(), sample::unit_at(&units, expected));
        assert_eq!(given.next_unit().unwrap().unwrap().header.id(), units[expected].0);
        // A scan starts after the first byte of the unit that was given last.
        assert_eq!(given.scan_for(Landmark::GopHeader), expected == GOP);
    }
    // A landmark whose payload is damaged is none.
    let mut damaged = bytes.clone();
    damaged[offset(GOP) + 20] ^= 1;
    assert_eq!(Landmark::GopHeader.find(&damaged, 0), Some(offset(second)));
    assert_eq!(Landmark::GopHeader.find(&damaged, offset(second) + 1), None);
    assert_eq!(Landmark::GopHeader.find(&damaged, usize::MAX), None);
    assert_eq!(Landmark::SequenceParameters.find(&bytes, 1), Some(offset(SEQUENCE)));
    assert_eq!(Landmark::SequenceParameters.find(&bytes, offset(SEQUENCE) + 1), None);
}

// covers: SS-UH-004
#[test]
fn an_unknown_unit_that_is_not_critical_is_skipped_unread() {
    let units = sample::units();
    for unit_type in [12, 127, 128, 255] {
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
        // Its checksum is not looked at.
        private[25] ^= 1;
        for index in 0..units.len() {
            let mut bytes = sample::stream(&units);
            let at = usize::try_from(sample::unit_at(&units, index)).unwrap();
            bytes.splice(at..at, private.iter().copied());
            assert_eq!(sample::verdict(&bytes), None, "type {unit_type} before unit {index}");
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
        UnitId::of_increment(0, 10),
        UnitId { spatial_layer: 1, ..UnitId::of_frame(UnitType::FrameHeader, 0) },
        UnitId { temporal_layer: 4, ..UnitId::of_frame(UnitType::Increment, 0) },
        UnitId { spatial_layer: 1, ..UnitId::of_frame(UnitType::Codebook, 0) },
        UnitId { temporal_layer: 1, ..UnitId::of_frame(UnitType::GopHeader, 0) },
        UnitId { refinement: 1, ..UnitId::of_frame(UnitType::FrameHeader, 0) },
    ] {
        assert!(write_unit(&mut out, id, &[]).is_err(), "{id:?}");
        assert_eq!(out, kept);
    }
}
