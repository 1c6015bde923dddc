//! Damaged streams of profile Dynamic: never a panic, never a wrong frame that is accepted.

use crate::common::dynamic::{Whole, predicted, range, scene};
use crate::common::{Random, decoded, encoded, strict};
use splatstream_decoder::process::Options;
use splatstream_encoder::{Settings, ShChoice, Steps};
use splatstream_files::builtin::Tracking;
use splatstream_format::Limits;
use splatstream_format::syntax::UnitHeader;

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

/// Decodes damaged bytes: a stream that is accepted is the original, and decoding ends with the same verdict whether it
/// goes on after errors or not.
fn check(bytes: &[u8], whole: &Whole<'_>, what: &str) {
    let (frames, summary) = decoded(bytes, &strict());
    if summary.verdict().is_none() {
        assert!(frames == whole.all(), "{what}: accepted, and not what was written");
    }
    let (_, all) = decoded(bytes, &Options { stop_at_first_error: false, ..strict() });
    assert_eq!(all.verdict(), summary.verdict(), "{what}");
}

#[test]
fn random_damages_are_detected_or_harmless() {
    for (spatial_layers, seed) in [(1, 11), (2, 12)] {
        let bytes = small_stream(spatial_layers);
        let whole = Whole::new(&bytes);
        let mut random = Random::new(seed);
        for round in 0..250 {
            let mut damaged = random.mutated(&bytes);
            if round % 2 == 1 && !damaged.is_empty() {
                damaged = random.mutated(&damaged);
            }
            check(&damaged, &whole, &format!("{spatial_layers} layers, round {round}"));
        }
    }
}

/// Units whose checksums are right but whose payload or header is not: what an attacker writes.
#[test]
fn units_made_wrong_on_purpose_never_panic() {
    let limits = Limits { max_gaussians: 1 << 12, ..Limits::default() };
    let mut random = Random::new(13);
    for spatial_layers in [1, 2] {
        let bytes = small_stream(spatial_layers);
        let whole = Whole::new(&bytes);
        for _ in 0..500 {
            let damaged = with_right_checksums(&bytes, &whole, &mut random);
            for verify in [true, false] {
                for stop_at_first_error in [true, false] {
                    let _ = decoded(&damaged, &Options { limits, verify, stop_at_first_error, ..strict() });
                }
            }
        }
    }
}

/// Some bits of one unit changed, most of them in front, where the elements are that decide anything.
fn with_right_checksums(bytes: &[u8], whole: &Whole<'_>, random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let unit = &whole.units[random.below(whole.units.len())];
    let range = range(unit);
    let payload = range.start + UnitHeader::SIZE..range.end;
    for _ in 0..=random.below(3) {
        let index = random.below(payload.len()).min(random.below(payload.len()));
        bytes[payload.start + index] ^= 1 << random.below(8);
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
