//! What encoding a sequence takes: a program of its own, so that no other test takes memory meanwhile.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use peak_alloc::PeakAlloc;
use splatstream_encoder::{FrameSource, Preset, Settings, Structure, encode};
use splatstream_files::builtin::BuiltinScene;
use splatstream_gaussians::GaussianFrame;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Frames that are made when they are asked for.
struct Made(BuiltinScene, u32);

impl FrameSource for Made {
    fn len(&self) -> u32 {
        self.1
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        Ok(self.0.frame(number))
    }
}

/// No pictures are drawn, which take more than this: GOPs are coded two at a time, whatever the length of the sequence; with less memory, one at a time.
#[test]
fn memory_follows_from_the_gops_that_are_coded_at_once() {
    let structure = Structure::Predicted { layers: 2 };
    let settings = Settings { preset: Preset::Fast, gop: 8, structure, ..Settings::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let peak = |count: u32, gop_memory: u64| {
        let scene = BuiltinScene { gaussians: 3_000, frames: 96, sh_degree: 1, ..BuiltinScene::default() };
        let settings = Settings { gop_memory, ..settings.clone() };
        MEMORY.reset_peak_usage();
        pool.install(|| encode(&mut Made(scene, count), &settings, &mut std::io::sink(), &mut |_, _| ()))
            .unwrap();
        MEMORY.peak_usage() as f64
    };
    let [one, long] = [24, 96].map(|count| peak(count, 1));
    assert!(long <= 1.05 * one + 96.0 * 300.0, "{one} {long}");
    // Two at once, and what the next waits with: how far their peaks meet is chance.
    let [short, long] = [24, 96].map(|count| peak(count, 1 << 30));
    assert!(short.max(long) <= 3.0 * one + 96.0 * 300.0, "{one} {short} {long}");
    assert!(one < 0.8 * short, "{one} {short}");
}
