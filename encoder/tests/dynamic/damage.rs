//! Damaged streams of profile Dynamic: never a panic, never a wrong frame, and of what is cut off all that is there.

use crate::common::dynamic::{Arrival, Whole, predicted, range, scene};
use crate::common::remains::{assert_remains, remains};
use crate::common::{Random, decoded, encoded, strict};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::process::Options;
use splatstream_encoder::{Settings, ShChoice, Steps};
use splatstream_format::syntax::UnitHeader;
use splatstream_format::{Class, Limits};
use splatstream_scene::builtin::Tracking;

/// A small stream with every kind of unit: two GOPs, three temporal layers, codebooks.
fn small_stream(spatial_layers: u8) -> Vec<u8> {
    let steps = Steps { sh: 0.05, ..predicted(1).steps };
    let settings = Settings {
        gop: 3,
        spatial_layers,
        steps,
        sh: ShChoice::VectorQuantised,
        sh_degree: Some(1),
        refinements: vec![40, 100],
        ..predicted(2)
    };
    encoded(scene(24, 4, 1, Tracking::Tracked), &settings).0
}

fn tolerant() -> Options {
    Options { tolerant: true, ..strict() }
}

// covers: SS-BS-005, SS-LO-005
#[test]
fn every_truncation_shows_the_frames_before_it_and_an_advertised_part_of_the_one_in_progress() {
    for spatial_layers in [1, 2] {
        let bytes = small_stream(spatial_layers);
        let whole = Whole::new(&bytes);
        let ends: Vec<(UnitHeader, usize)> =
            whole.units.iter().map(|unit| (unit.header, range(unit).end)).collect();
        for length in 0..bytes.len() {
            let what = format!("{spatial_layers} layers, cut at {length} of {}", bytes.len());
            let arrival = |header: &UnitHeader| {
                let is_there = ends.iter().any(|(known, end)| known == header && *end <= length);
                if is_there { Arrival::Intact } else { Arrival::Missing }
            };
            let expected = remains(&whole, arrival, true);
            let (frames, summary) = decoded(&bytes[..length], &tolerant());
            assert_eq!(summary.end.map(|error| error.class()), Some(Class::Truncated), "{what}");
            assert_remains(&frames, &expected, &what);
            let (complete, summary) = decoded(&bytes[..length], &strict());
            assert_eq!(summary.end.map(|error| error.class()), Some(Class::Truncated), "{what}");
            assert!(
                complete.len() + 1 >= frames.len() && complete == whole.all()[..complete.len()],
                "{what}"
            );
        }
    }
}

/// Every picture that some receiver may see: of each frame at each point, and parts of intra frames.
fn advertised(whole: &Whole<'_>) -> Vec<QuantizedFrame> {
    let mut pictures = vec![QuantizedFrame::zeroed(0, whole.sequence.sh_dimension().into())];
    pictures.extend(whole.points.values().flatten().map(|frame| frame.planes.clone()));
    for (first, _) in &whole.gops {
        let planes = &whole.all()[*first as usize].planes;
        for refinement in 0..whole.sequence.refinement_count {
            let mut part = planes.clone();
            part.truncate(whole.sequence.prefix_length(refinement, planes.len() as u32) as usize);
            pictures.push(part);
        }
    }
    pictures
}

/// Decodes damaged bytes: a stream that is accepted is the original, and what is shown of another is advertised.
fn check(bytes: &[u8], whole: &Whole<'_>, pictures: &[QuantizedFrame], what: &str) {
    let (frames, summary) = decoded(bytes, &strict());
    if summary.end.is_none() {
        assert!(frames == whole.all(), "{what}: accepted, and not what was written");
    }
    let (shown, end) = decoded(bytes, &tolerant());
    for frame in &shown {
        assert!(pictures.contains(&frame.planes), "{what}: frame {} is no frame of the stream", frame.number);
    }
    let verdict = shown.iter().find_map(|frame| frame.lost).or(end.end);
    assert_eq!(summary.end, verdict, "{what}: one verdict, tolerant or not");
}

#[test]
fn random_damages_are_detected_or_harmless() {
    for (spatial_layers, seed) in [(1, 11), (2, 12)] {
        let bytes = small_stream(spatial_layers);
        let whole = Whole::new(&bytes);
        let pictures = advertised(&whole);
        let mut random = Random(seed);
        for round in 0..250 {
            let mut damaged = random.mutated(&bytes);
            if round % 2 == 1 && !damaged.is_empty() {
                damaged = random.mutated(&damaged);
            }
            check(&damaged, &whole, &pictures, &format!("{spatial_layers} layers, round {round}"));
        }
    }
}

/// Units whose check sums are right but whose payload or place is not: what an attacker writes.
#[test]
fn units_made_wrong_on_purpose_never_panic() {
    let limits = Limits { max_gaussians: 1 << 12, ..Limits::default() };
    let mut random = Random(13);
    for spatial_layers in [1, 2] {
        let bytes = small_stream(spatial_layers);
        let whole = Whole::new(&bytes);
        for _ in 0..500 {
            let damaged = with_right_check_sums(&bytes, &whole, &mut random);
            for verify in [true, false] {
                for tolerant in [true, false] {
                    let _ = decoded(&damaged, &Options { limits, verify, tolerant, ..strict() });
                }
            }
        }
    }
}

/// Some bits of one unit changed, most of them in front, where the elements are that decide anything.
fn with_right_check_sums(bytes: &[u8], whole: &Whole<'_>, random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let unit = &whole.units[random.below(whole.units.len())];
    let range = range(unit);
    let payload = range.start + UnitHeader::SIZE..range.end;
    for _ in 0..=random.below(3) {
        let place = random.below(payload.len()).min(random.below(payload.len()));
        bytes[payload.start + place] ^= 1 << random.below(8);
    }
    let mut id = unit.header.id();
    match random.below(12) {
        0 => id.frame ^= 1 << random.below(3),
        1 => id.spatial_layer ^= 1,
        2 => id.temporal_layer ^= 1 << random.below(2),
        3 => id.refinement ^= 1 << random.below(2),
        _ => {}
    }
    // An identifier that no unit can have stays what it was.
    let header = UnitHeader::new(id, &bytes[payload.clone()]);
    let header = header.or_else(|_| UnitHeader::new(unit.header.id(), &bytes[payload])).unwrap();
    bytes[range.start..range.start + UnitHeader::SIZE].copy_from_slice(&header.to_bytes().unwrap());
    bytes
}
