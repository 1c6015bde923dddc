//! What pushing frames takes: a program of its own, so that no other test takes memory meanwhile.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use peak_alloc::PeakAlloc;
use splatstream_encoder::{Encoder, Preset, Settings, Structure};
use splatstream_files::builtin::BuiltinScene;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Frames that are there at the same time are those of a GOP, whatever the length of the sequence.
#[test]
fn memory_does_not_grow_with_the_number_of_frames() {
    let structure = Structure::Predicted { layers: 2 };
    let settings = Settings { preset: Preset::Fast, gop: 4, structure, ..Settings::default() };
    let peak = |count: u32| {
        let scene = BuiltinScene { gaussians: 2_000, frames: 60, sh_degree: 1, ..BuiltinScene::default() };
        let mut encoder = Encoder::new(std::io::sink(), settings.clone());
        MEMORY.reset_peak_usage();
        (0..count).for_each(|number| encoder.push(scene.frame(number)).unwrap());
        encoder.finish().unwrap();
        MEMORY.peak_usage()
    };
    let (short, long) = (peak(10), peak(60));
    assert!(long as f64 <= 1.15 * short as f64 + 60.0 * 300.0, "{short} {long}");
}
