//! Damaged streams: never a panic, never more memory than the stream may ask for, never a wrong frame.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{Random, builtin, decoded, encoded, planes, strict};
use peak_alloc::PeakAlloc;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::process::Options;
use splatstream_encoder::{Settings, ShChoice};
use splatstream_format::Limits;

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

/// Decodes damaged bytes: a stream that is accepted is the original, and of another each frame is a prefix of one.
fn check(bytes: &[u8], original: &[QuantizedFrame], what: &str) {
    let (frames, summary) = decoded(bytes, &strict());
    if summary.verdict().is_none() {
        let same = frames.iter().map(|frame| &frame.planes).eq(original);
        assert!(same, "{what}: accepted, and not what was written");
        return;
    }
    let (frames, all) = decoded(bytes, &Options { stop_at_first_error: false, ..strict() });
    assert_eq!(all.verdict(), summary.verdict(), "{what}: one verdict, whether decoding goes on or not");
    for frame in frames.iter().filter(|frame| !frame.is_lost) {
        let whole = &original[frame.index as usize];
        let mut shown = whole.clone();
        shown.truncate(frame.planes.len());
        assert_eq!(frame.planes, shown, "{what}: a frame that is shown is a prefix of the original");
    }
}

#[test]
fn every_single_byte_corruption_is_detected_or_harmless() {
    let bytes = small_stream();
    let original = planes(&bytes);
    let mut damaged = bytes.clone();
    for index in 0..bytes.len() {
        for flip in [0x01, 0x02, 0x10, 0x80, 0xFF] {
            damaged[index] = bytes[index] ^ flip;
            check(&damaged, &original, &format!("byte {index} ^ {flip:#x}"));
        }
        damaged[index] = bytes[index];
    }
}

#[test]
fn a_thousand_random_damages_are_detected_or_harmless() {
    let bytes = small_stream();
    let original = planes(&bytes);
    let mut random = Random::new(1);
    for round in 0..1000 {
        let mut damaged = random.mutated(&bytes);
        if round % 2 == 1 && !damaged.is_empty() {
            damaged = random.mutated(&damaged);
        }
        check(&damaged, &original, &format!("round {round}"));
    }
}

/// Units whose checksums are right but whose payload is not: what an attacker writes.
#[test]
fn payloads_made_wrong_on_purpose_are_refused_within_bounded_memory() {
    let bytes = small_stream();
    let options = Options { limits: Limits { max_gaussians: 1 << 12, ..Limits::default() }, ..strict() };
    let mut random = Random::new(2);
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    for _ in 0..3000 {
        let damaged = with_right_checksums(&bytes, &mut random);
        let (_, summary) = decoded(&damaged, &options);
        // A change that the digest does not see is a change of an informative element.
        let _ = summary.verdict();
    }
    // 4096 Gaussians of 58 planes of 4 bytes are 1 MB; blocks, contexts and tables take a few times that.
    let peak = MEMORY.peak_usage().saturating_sub(before);
    assert!(peak < 32 << 20, "{peak} bytes at the peak");
}

fn with_right_checksums(stream: &[u8], random: &mut Random) -> Vec<u8> {
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
        let index = payload.start + random.below(length).min(random.below(length));
        bytes[index] ^= 1 << random.below(8);
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
