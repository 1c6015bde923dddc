//! Damaged streams: never a panic, never more memory than the stream may ask for, never a wrong frame.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{Random, builtin, decoded, encoded, planes, strict};
use peak_alloc::PeakAlloc;
use splatstream_decoder::process::Options;
use splatstream_encoder::{Settings, ShChoice};
use splatstream_format::{Class, Limits};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// A stream of about 5 KB with every kind of unit.
fn small_stream() -> Vec<u8> {
    let settings = Settings {
        refinements: vec![20, 100],
        sh: ShChoice::VectorQuantised,
        gop: 1,
        block_log2: 6,
        ..Settings::default()
    };
    encoded(vec![builtin(100, 1), builtin(101, 1)], &settings).0
}

/// Decodes damaged bytes; a stream that is accepted must be the original, frame by frame.
fn check(bytes: &[u8], original: &[splatstream_decoder::frame::QuantizedFrame], what: &str) -> Option<Class> {
    let (frames, summary) = decoded(bytes, &strict());
    let Some(error) = summary.end else {
        let same = frames.iter().map(|frame| &frame.planes).eq(original);
        assert!(same, "{what}: accepted, and not what was written");
        return None;
    };
    let tolerant = Options { tolerant: true, ..strict() };
    for frame in decoded(bytes, &tolerant).0 {
        let whole = &original[frame.number as usize];
        let mut shown = whole.clone();
        shown.truncate(frame.planes.len());
        assert_eq!(frame.planes, shown, "{what}: a frame that is shown is a prefix of the original");
    }
    Some(error.class())
}

// covers: SS-BS-005, SS-ER-008
#[test]
fn every_truncation_is_called_truncated_and_shows_whole_refinements() {
    let bytes = small_stream();
    let original = planes(&bytes);
    for length in 0..bytes.len() {
        let class = check(&bytes[..length], &original, &format!("cut at {length}"));
        assert_eq!(class, Some(Class::Truncated), "cut at {length}");
    }
}

#[test]
fn every_single_byte_corruption_is_detected_or_harmless() {
    let bytes = small_stream();
    let original = planes(&bytes);
    let mut damaged = bytes.clone();
    for place in 0..bytes.len() {
        for flip in [0x01, 0x02, 0x10, 0x80, 0xFF] {
            damaged[place] = bytes[place] ^ flip;
            check(&damaged, &original, &format!("byte {place} ^ {flip:#x}"));
        }
        damaged[place] = bytes[place];
    }
}

#[test]
fn a_thousand_random_damages_are_detected_or_harmless() {
    let bytes = small_stream();
    let original = planes(&bytes);
    let mut random = Random(1);
    for round in 0..1000 {
        let mut damaged = random.mutated(&bytes);
        if round % 2 == 1 && !damaged.is_empty() {
            damaged = random.mutated(&damaged);
        }
        check(&damaged, &original, &format!("round {round}"));
    }
}

/// Units whose check sums are right but whose payload is not: what an attacker writes.
#[test]
fn payloads_made_wrong_on_purpose_are_refused_within_bounded_memory() {
    let bytes = small_stream();
    let options = Options { limits: Limits { max_gaussians: 1 << 12, ..Limits::default() }, ..strict() };
    let mut random = Random(2);
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    for _ in 0..3000 {
        let damaged = with_right_check_sums(&bytes, &mut random);
        let (_, summary) = decoded(&damaged, &options);
        // A change that the digest does not see is a change of an informative element.
        let _ = summary.end;
    }
    // 4096 Gaussians of 58 planes of 4 bytes are 1 MB; blocks, contexts and tables take a few times that.
    let peak = MEMORY.peak_usage().saturating_sub(before);
    assert!(peak < 32 << 20, "{peak} bytes at the peak");
}

fn with_right_check_sums(stream: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = stream.to_vec();
    let mut units = Vec::new();
    let mut at = 16;
    while at < bytes.len() {
        let length = u32::from_le_bytes(bytes[at + 12..at + 16].try_into().unwrap()) as usize;
        units.push((at, length));
        at += 20 + length;
    }
    let (at, length) = units[random.below(units.len())];
    let payload = at + 20..at + 20 + length;
    for _ in 0..=random.below(3) {
        // Most elements that decide anything stand in front.
        let place = payload.start + random.below(length).min(random.below(length));
        bytes[place] ^= 1 << random.below(8);
    }
    let crc = crc32fast::hash(&bytes[payload]);
    bytes[at + 16..at + 20].copy_from_slice(&crc.to_le_bytes());
    let mut check = crc32fast::Hasher::new();
    check.update(&bytes[at..at + 6]);
    check.update(&bytes[at + 8..at + 20]);
    let low = (check.finalize() & 0xFFFF) as u16;
    bytes[at + 6..at + 8].copy_from_slice(&low.to_le_bytes());
    bytes
}
