//! However bytes arrive, the frames are the same, and so is what is said of damage.

use super::vectors;
use proptest::prelude::*;
use splatstream::{Decoder, Error, Frame, Limits, Position};
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::Frames;
use splatstream_format::Class;
use std::collections::BTreeSet;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Everything that a decoder says.
#[derive(Debug, PartialEq)]
pub(super) struct Said {
    frames: Vec<(u32, splatstream::Integers, Vec<u32>, Vec<String>)>,
    end: Option<String>,
}

impl Said {
    fn frame(&mut self, frame: Frame) {
        let warnings = frame.warnings().iter().map(ToString::to_string).collect();
        let identities = frame.identities().to_vec();
        self.frames.push((frame.index(), frame.into_integers(), identities, warnings));
    }

    pub(super) fn of(decoder: Decoder) -> Self {
        let mut said = Self { frames: Vec::new(), end: None };
        for frame in decoder.with_limits(Limits::UNLIMITED) {
            match frame {
                Ok(frame) => said.frame(frame),
                Err(error) => said.end = Some(error.to_string()),
            }
        }
        said
    }

    /// The same of bytes that come in chunks, whose sizes repeat.
    fn of_chunks(bytes: &[u8], sizes: &[usize]) -> Self {
        Self::of_pushed(Decoder::new(), bytes, sizes)
    }

    /// What a decoder says that chunks are pushed to.
    pub(super) fn of_pushed(decoder: Decoder, bytes: &[u8], sizes: &[usize]) -> Self {
        let mut said = Self { frames: Vec::new(), end: None };
        let mut decoder = decoder.with_limits(Limits::UNLIMITED);
        let mut rest = bytes;
        for &size in sizes.iter().cycle() {
            let (chunk, after) = rest.split_at(size.clamp(1, rest.len().max(1)).min(rest.len()));
            rest = after;
            decoder.push(chunk).unwrap();
            if rest.is_empty() {
                decoder.end();
            }
            loop {
                match decoder.next_frame() {
                    Ok(Some(frame)) => said.frame(frame),
                    Ok(None) => break,
                    Err(error) => {
                        said.end = Some(error.to_string());
                        break;
                    }
                }
            }
            if rest.is_empty() || decoder.is_finished() {
                return said;
            }
        }
        said
    }
}

fn expected(bytes: &Arc<[u8]>) -> Said {
    Said::of(Decoder::from_bytes(bytes.clone()))
}

#[test]
fn pieces_of_every_vector_give_the_frames_of_the_whole() {
    for (number, (path, bytes)) in vectors::all().into_iter().enumerate() {
        let whole = expected(&bytes);
        let sizes = [1 + number % 37, 1 + number % 1009, 1 + number % 5];
        assert_eq!(Said::of_chunks(&bytes, &sizes), whole, "{}", path.display());
        let read = Decoder::from_reader(Cursor::new(bytes.to_vec()));
        assert_eq!(Said::of(read), whole, "{}", path.display());
    }
}

/// A frame is shown as soon as its last unit has come, not when the next frame begins.
#[test]
fn a_frame_is_given_with_the_last_byte_that_it_needs() {
    let bytes = vectors::talk();
    let limits = splatstream_format::Limits::of_level(4);
    let units: Vec<_> = splatstream_format::unit::Stream::open(&bytes, &limits)
        .unwrap()
        .units()
        .map(Result::unwrap)
        .collect();
    for refinements in 1..=3 {
        let point = format!("s3,t3,r{}", refinements - 1).parse().unwrap();
        let mut decoder = Decoder::new().with_operating_point(point);
        let (mut given, mut pushed) = (0, 0);
        for unit in &units {
            let end = unit.payload_at as usize + unit.payload.len();
            decoder.push(&bytes[pushed..end]).unwrap();
            pushed = end;
            let is_last = unit.header.unit_type() == splatstream_format::syntax::UnitType::Increment
                && u32::from(unit.header.refinement) + 1 == refinements;
            let frame = decoder.next_frame().unwrap();
            assert_eq!(frame.map(|frame| frame.index()), is_last.then_some(unit.header.frame));
            given += u32::from(is_last);
        }
        assert_eq!(given, 12);
    }
}

#[test]
fn every_vector_gives_the_frames_and_the_errors_of_the_decoder_below() {
    let limits = splatstream_format::Limits::of_level(4);
    for (path, bytes) in vectors::all() {
        let said = expected(&bytes);
        let Ok(mut frames) = Frames::open(&bytes, &Options { limits, ..Options::default() }) else {
            assert!(said.frames.is_empty() && said.end.is_some(), "{}", path.display());
            continue;
        };
        let below: Vec<_> = std::iter::from_fn(|| frames.next_frame()).collect();
        let shown: Vec<_> =
            below.into_iter().filter(|frame| !frame.is_lost).map(|frame| frame.index).collect();
        let given: Vec<u32> = said.frames.iter().map(|frame| frame.0).collect();
        let errors = frames.summary().errors;
        // A stream that breaks a limit is not decoded further.
        if errors.iter().any(|error| error.class() == Class::OverLimit) {
            assert!(shown.starts_with(&given) && said.end.is_some(), "{}", path.display());
            continue;
        }
        assert_eq!(given, shown, "{}", path.display());
        let warnings: Vec<&String> = said.frames.iter().flat_map(|frame| &frame.3).collect();
        for error in errors {
            let text = error.to_string();
            let is_said =
                warnings.contains(&&text) || said.end.as_ref().is_some_and(|end| end.contains(&text));
            assert!(is_said, "{}: {text}", path.display());
        }
    }
}

/// Display index, refinements and whether it is reduced, of each frame of a stream that is there as a whole, and of the
/// same in pieces.
fn told(bytes: &[u8]) -> [Vec<(u32, u8, bool)>; 2] {
    let tell = |frame: Frame| (frame.index(), frame.refinements(), frame.is_reduced());
    let opened = Decoder::from_bytes(bytes).map_while(Result::ok).map(tell).collect();
    let (mut decoder, mut pushed) = (Decoder::new(), Vec::new());
    for piece in bytes.chunks(997) {
        decoder.push(piece).unwrap();
        pushed.extend(decoder.by_ref().map_while(Result::ok).map(tell));
    }
    decoder.end();
    pushed.extend(decoder.map_while(Result::ok).map(tell));
    [opened, pushed]
}

#[test]
fn a_frame_that_a_cut_has_reduced_says_so_however_its_bytes_come() {
    let bytes = vectors::talk();
    let [whole, _] = told(&bytes);
    assert!(whole.iter().all(|&(.., is_reduced)| !is_reduced));
    let mut reduced = BTreeSet::new();
    for cut in (1..bytes.len()).step_by(bytes.len() / 150) {
        let [opened, pushed] = told(&bytes[..cut]);
        assert_eq!(opened, pushed, "{cut}");
        for (cut, whole) in opened.iter().zip(&whole) {
            assert_eq!(cut.2, cut.1 < whole.1, "{cut:?}");
            reduced.extend(cut.2.then_some(cut.0));
        }
    }
    // The I frame, before there was any other, and later ones.
    assert!(reduced.contains(&0) && reduced.len() > 2, "{reduced:?}");
}

/// The moving scene with up to three bytes changed, whole or cut.
pub(super) fn damaged_talk() -> impl Strategy<Value = Vec<u8>> {
    let damage = prop::collection::vec((any::<prop::sample::Index>(), 1_u8..), 0..4);
    (damage, any::<Option<prop::sample::Index>>()).prop_map(|(damage, cut)| {
        let mut bytes = vectors::talk().to_vec();
        for (at, change) in damage {
            let at = at.index(bytes.len());
            bytes[at] ^= change;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        bytes
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn pieces_of_a_damaged_stream_give_the_frames_of_the_whole(
        bytes in damaged_talk(),
        sizes in prop::collection::vec(1_usize..3000, 1..8),
    ) {
        let whole = expected(&bytes.clone().into());
        prop_assert_eq!(Said::of_chunks(&bytes, &sizes), whole);
    }

    #[test]
    fn a_seek_gives_the_frames_from_there_on(to in 0_u32..14, before in 0_usize..14) {
        let bytes = vectors::talk();
        let all: Vec<_> = Decoder::from_bytes(bytes.clone()).map(|frame| frame.unwrap().into_integers()).collect();
        for mut decoder in [Decoder::from_bytes(bytes.clone()), Decoder::from_reader(Cursor::new(bytes.to_vec()))] {
            decoder.by_ref().take(before).for_each(|frame| drop(frame.unwrap()));
            decoder.seek(Position::Frame(to)).unwrap();
            let rest: Vec<_> = decoder.map(|frame| frame.unwrap().into_integers()).collect();
            prop_assert_eq!(&rest, &all[all.len().min(to as usize)..]);
        }
    }
}

#[test]
fn a_seek_before_the_first_frame_keeps_the_description() {
    let bytes = include_bytes!("../../conformance/vectors/valid/loss/resync-parent/in.gss").as_slice();
    let damaged =
        include_bytes!("../../conformance/vectors/invalid/loss/resync-scene-description-damaged/in.gss")
            .as_slice();
    let mut from_start = Decoder::from_bytes(bytes);
    drop(from_start.next_frame().unwrap());
    for (bytes, expected) in [(bytes, from_start.description()), (damaged, None)] {
        let mut decoder = Decoder::from_bytes(bytes);
        decoder.seek(Position::Frame(2)).unwrap();
        assert_eq!(decoder.next_frame().unwrap().map(|frame| frame.index()), Some(2));
        assert_eq!(decoder.description(), expected);
        assert!(decoder.all(|frame| frame.unwrap().warnings().is_empty()));
    }
    assert!(from_start.description().is_some());
}

#[test]
fn a_time_is_the_frame_that_is_shown_then() {
    let mut decoder = Decoder::from_bytes(vectors::talk());
    decoder.seek(Position::Time(std::time::Duration::from_millis(170))).unwrap();
    let frame = decoder.next_frame().unwrap().unwrap();
    assert_eq!(frame.index(), 5);
    assert!(frame.time() <= std::time::Duration::from_millis(170));
}

#[test]
fn what_follows_the_last_frame_is_told_once() {
    let bytes = vectors::talk();
    let mut decoder = Decoder::from_bytes(&bytes[..bytes.len() - 5]);
    let given: Vec<_> = decoder.by_ref().collect();
    assert_eq!(given.iter().filter(|frame| frame.is_ok()).count(), 12);
    assert!(matches!(given.last(), Some(Err(Error::Incomplete(warnings))) if warnings.len() == 1));
    assert!(decoder.next_frame().unwrap().is_none() && decoder.is_finished());
}

#[test]
fn other_files_are_refused_with_their_first_bytes() {
    let mut decoder = Decoder::new();
    decoder.push(b"ply\n").unwrap();
    let error = decoder.next_frame().unwrap_err();
    assert!(matches!(error, Error::Stream(_)), "{error}");
    assert!(decoder.is_finished());
}

#[test]
fn bytes_go_only_where_they_are_expected() {
    let mut decoder = Decoder::from_bytes(vectors::talk());
    assert!(matches!(decoder.push(&[1]), Err(Error::NotPushed)));
    let mut decoder = Decoder::new();
    assert!(matches!(decoder.seek(Position::Frame(1)), Err(Error::NotSeekable)));
    decoder.end();
    assert!(matches!(decoder.push(&[1]), Err(Error::NotPushed)));
    let mut decoder = Decoder::new().with_limits(Limits { max_memory: 10, ..Limits::default() });
    assert!(matches!(decoder.push(&[0; 11]), Err(Error::TooMuchInput { waiting: 11, allowed: 10 })));
}

/// A file of which some bytes are there.
struct Partial {
    bytes: Vec<u8>,
    there: Arc<AtomicUsize>,
    at: usize,
}

impl Read for Partial {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let there = self.there.load(Ordering::Relaxed);
        let rest = self.bytes[..there].get(self.at..).unwrap_or_default();
        let count = rest.len().min(to.len());
        if count == 0 && there < self.bytes.len() {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        to[..count].copy_from_slice(&rest[..count]);
        self.at += count;
        Ok(count)
    }
}

impl Seek for Partial {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = match to {
            SeekFrom::Start(at) => at as usize,
            _ => self.there.load(Ordering::Relaxed),
        };
        Ok(self.at as u64)
    }
}

#[test]
fn a_file_that_is_still_coming_gives_what_is_there_and_can_be_sought_in() {
    let bytes = vectors::talk();
    let there = Arc::new(AtomicUsize::new(0));
    let mut decoder = Decoder::from_reader(Partial { bytes: bytes.to_vec(), there: there.clone(), at: 0 });
    let mut indices = Vec::new();
    for end in (0..=bytes.len()).step_by(700).chain([bytes.len()]) {
        there.store(end, Ordering::Relaxed);
        indices.extend(decoder.by_ref().map(|frame| frame.unwrap().index()));
        if indices.len() == 3 {
            decoder.seek(Position::Frame(1)).unwrap();
            assert_eq!(decoder.next_frame().unwrap().map(|frame| frame.index()), Some(1));
            decoder.seek(Position::Frame(3)).unwrap();
        }
    }
    assert_eq!(indices, (0..12).collect::<Vec<u32>>());
    assert!(decoder.is_finished());
}

#[test]
fn a_stream_says_how_large_it_is_and_how_fast() {
    let mut decoder = Decoder::from_bytes(vectors::talk());
    assert_eq!((decoder.highest_point(), decoder.frame_duration()), (None, None));
    let frame = decoder.next_frame().unwrap().unwrap();
    assert_eq!(decoder.highest_point(), "s0,t1,r2".parse().ok());
    assert_eq!(decoder.frame_duration(), Some(std::time::Duration::from_nanos(33_333_333)));
    assert!(frame.digest().is_some() && frame.bytes() > 0);
}
