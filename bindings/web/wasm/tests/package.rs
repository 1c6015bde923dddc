//! A package gives the frames of its stream.
#![cfg(feature = "packages")]
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use splatstream::Decoder;
use splatstream_format::syntax::{UnitId, UnitType};
use splatstream_format::unit::{Stream, write_unit};
use splatstream_format::{Limits, payload};
use splatstream_stream::package::{Options, Package as Packaged};
use splatstream_stream::playback::{Command, Fault};
use splatstream_wasm::package::Package;
use splatstream_wasm::session::{Session, Status};

const STREAM: &[u8] = include_bytes!("../../../../examples/talk.gss");

/// A session of the package of a stream, and its files.
fn open(stream: &[u8]) -> (Session, Packaged<'_>) {
    let packaged = Packaged::of(stream, &Options::default(), &Limits::default()).unwrap();
    let package = Package::open(packaged.manifest.to_json().as_bytes(), 0).unwrap();
    let mut session = Session::default();
    session.package = Some(package);
    (session, packaged)
}

/// Fetches what is wanted until there is nothing to do; every byte takes a microsecond.
fn fetch(session: &mut Session, packaged: &Packaged<'_>, now_us: &mut u64) {
    let package = session.package.as_mut().unwrap();
    loop {
        package.clock(*now_us);
        let Command::Fetch(requests) = package.decide() else { return };
        for request in requests {
            let mut file = Vec::new();
            packaged.write(&request.file, &mut file).unwrap();
            let start = usize::try_from(request.offset).unwrap();
            let bytes = &file[start..start + usize::try_from(request.size).unwrap()];
            package.sent();
            package.begun();
            *now_us += request.size;
            package.clock(*now_us);
            assert!(package.received(bytes));
        }
    }
}

/// Index, digest and the end of a frame that has been decoded.
fn frame(session: &Session) -> (u32, u64, u32) {
    let number = |at: usize| session.numbers[at] as u32;
    (number(0), u64::from(number(10)) << 32 | u64::from(number(11)), number(13))
}

/// The next frame, for which is fetched what is needed.
fn next(session: &mut Session, packaged: &Packaged<'_>, now_us: &mut u64) -> Option<(u32, u64, u32)> {
    for _ in 0..1000 {
        fetch(session, packaged, now_us);
        match session.decode() {
            Status::Done => return Some(frame(session)),
            Status::NeedBytes => *now_us += 10_000,
            Status::End => return None,
            other => panic!("{other:?}: {}", session.text),
        }
    }
    panic!("no frame has come");
}

#[test]
fn frames_of_a_package_have_the_digests_of_the_stream() {
    let native: Vec<(u32, u64)> = Decoder::from_bytes(STREAM)
        .map(|one| one.unwrap())
        .map(|one| (one.index(), one.digest().unwrap()))
        .collect();
    let (mut session, packaged) = open(STREAM);
    session.set_point([9, 9, 9]);
    let mut now_us = 0;
    let mut found = Vec::new();
    while let Some((index, digest, until)) = next(&mut session, &packaged, &mut now_us) {
        assert_eq!(until, index + 1);
        assert_eq!(session.show(), Status::Done);
        found.push((index, digest));
    }
    assert_eq!(found, native);
    for &(index, digest) in native.iter().rev() {
        assert_eq!(session.seek(index), Status::Done);
        assert_eq!(
            next(&mut session, &packaged, &mut now_us).map(|one| (one.0, one.1)),
            Some((index, digest))
        );
    }
}

/// The stream, with a description that says which way is up: that of the stream leaves it open.
fn upright() -> Vec<u8> {
    let mut units = Stream::open(STREAM, &Limits::default()).unwrap().units().map(|unit| unit.unwrap());
    let unit = units.find(|unit| unit.header.unit_type() == UnitType::SceneDescription).unwrap();
    let mut scene = payload::SceneDescription::parse(unit.payload, unit.payload_at).unwrap();
    scene.up_axis = payload::UpAxis::MinusZ;
    let id = UnitId {
        unit_type: UnitType::SceneDescription,
        spatial_layer: 0,
        temporal_layer: 0,
        refinement: 0,
        frame: 0,
    };
    let mut stream = STREAM[..usize::try_from(unit.at).unwrap()].to_vec();
    write_unit(&mut stream, id, &scene.to_bytes().unwrap()).unwrap();
    // Offsets of the index hold: the unit is as long as before.
    stream.extend_from_slice(&STREAM[stream.len()..]);
    stream
}

#[test]
fn a_description_is_that_of_the_stream_from_the_frame_on_that_comes_first() {
    let stream = upright();
    let mut whole = Session::default();
    assert!(whole.push(&stream));
    assert_eq!((whole.decode(), whole.describe()), (Status::Done, Status::Done));
    for first in [0, 5] {
        let (mut session, packaged) = open(&stream);
        assert_eq!(session.describe(), Status::NeedBytes);
        session.seek(first);
        next(&mut session, &packaged, &mut 0);
        assert_eq!(session.describe(), Status::Done);
        assert_eq!((&session.numbers, session.numbers[5]), (&whole.numbers, 6.0));
    }
}

#[test]
fn what_cannot_be_had_is_said() {
    let (mut session, _) = open(STREAM);
    let mut now_us = 0;
    loop {
        now_us += 100_000;
        let package = session.package.as_mut().unwrap();
        package.clock(now_us);
        if matches!(package.decide(), Command::Fetch(_)) {
            package.failed(&Fault::Status(404));
        }
        match session.decode() {
            Status::NeedBytes => {}
            status => break assert_eq!(status, Status::Incomplete),
        }
        assert!(now_us < 1_000_000_000);
    }
    assert!(session.text.contains("GOP 0: s0") && session.text.contains("404"), "{}", session.text);
}

#[test]
fn manifests_that_are_none_are_refused_with_a_reason() {
    let refused = Package::open(b"{}", 0).err().unwrap();
    assert!(refused.contains("the manifest is refused"), "{refused}");
}
