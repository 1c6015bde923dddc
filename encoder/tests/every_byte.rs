//! Every value of every byte of a small stream, as it is and with check sums made to fit: no panic, an error or the
//! original, and memory that the stream accounts for. One test, for the counter sees all threads.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "a panic is a failed test")]

mod common;

use common::{decoded, encoded, frame_of, planes, strict};
use peak_alloc::PeakAlloc;
use splatstream_decoder::process::Options;
use splatstream_encoder::{Settings, ShChoice};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The stream has fewer than 2 KB and 18 Gaussians. What it may ask for is tables: 64 contexts a plane,
/// 4096 slots and 256 tokens of 5 bytes each, for 1 + 3 + 1 + 3 + 3 + 9 planes are 7 MB. Nothing else comes near.
const MOST_BYTES: usize = 8 << 20;

/// Offset and payload length of every unit.
fn units(bytes: &[u8]) -> Vec<(usize, usize)> {
    let mut units = Vec::new();
    let mut at = 16;
    while at < bytes.len() {
        let length = u32::from_le_bytes(bytes[at + 12..at + 16].try_into().unwrap()) as usize;
        units.push((at, length));
        at += 20 + length;
    }
    units
}

/// Makes the check sums of a unit fit.
fn seal(bytes: &mut [u8], (at, length): (usize, usize)) {
    let crc = crc32fast::hash(&bytes[at + 20..at + 20 + length]);
    bytes[at + 16..at + 20].copy_from_slice(&crc.to_le_bytes());
    let covered = [&bytes[at..at + 6], &bytes[at + 8..at + 20]].concat();
    bytes[at + 6..at + 8].copy_from_slice(&crc32fast::hash(&covered).to_le_bytes()[..2]);
}

// covers: SS-UH-001, SS-UH-002, SS-FH-002, SS-RU-005
#[test]
fn every_value_of_every_byte_is_refused_or_harmless_in_bounded_memory() {
    let settings = Settings {
        refinements: vec![50, 100],
        sh: ShChoice::Coefficients,
        gop: 1,
        block_log2: 6,
        ..Settings::default()
    };
    let numbers: Vec<f32> = (0..61_u16).map(|place| f32::from(place * 37 % 61) / 61.0 - 0.4).collect();
    let (bytes, _) = encoded(vec![frame_of(&numbers, 18, 1)], &settings);
    assert!((1000..2000).contains(&bytes.len()), "{} bytes", bytes.len());
    let original = planes(&bytes);
    // One thread: what is counted is the work of one decoder.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        let mut changed = bytes.clone();
        for place in 0..bytes.len() {
            for change in 1..=u8::MAX {
                changed[place] = bytes[place] ^ change;
                let (frames, summary) = decoded(&changed, &strict());
                if summary.end.is_none() {
                    let same = frames.iter().map(|frame| &frame.planes).eq(&original);
                    assert!(same, "byte {place} ^ {change:#x} is accepted and decodes to something else");
                }
            }
            changed[place] = bytes[place];
        }
        let tolerant = Options { tolerant: true, ..strict() };
        for unit in units(&bytes) {
            for place in unit.0..unit.0 + 20 + unit.1 {
                for change in [1, 2, 4, 8, 0x10, 0x40, 0x80, 0xFF] {
                    let mut changed = bytes.clone();
                    changed[place] ^= change;
                    seal_within(&mut changed, unit);
                    let strict = decoded(&changed, &strict());
                    let (frames, end) = decoded(&changed, &tolerant);
                    let verdict = frames.iter().find_map(|frame| frame.lost).or(end.end);
                    assert_eq!(
                        strict.1.end, verdict,
                        "byte {place} ^ {change:#x}: one verdict, tolerant or not"
                    );
                }
            }
        }
        let peak = MEMORY.peak_usage().saturating_sub(before);
        assert!(peak < MOST_BYTES, "{peak} bytes at the peak");
    });
}

/// Seals a unit whose length may have been changed beyond the end of the stream.
fn seal_within(bytes: &mut [u8], (at, length): (usize, usize)) {
    let room = bytes.len() - at - 20;
    seal(bytes, (at, length.min(room)));
}
