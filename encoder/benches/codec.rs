//! Encode and decode speed, Gaussians per second, memory to memory.
//!
//! `cargo bench -p splatstream-encoder` runs the built-in scene, and real scenes where `../shared/data` has them.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed benchmark")]

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::{Preset, Settings, encode};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::{ReadLimits, read_scene};
use splatstream_gaussians::GaussianFrame;
use std::ops::ControlFlow;
use std::path::Path;

fn main() {
    divan::main();
}

const SCENES: [&str; 4] = ["builtin", "playbot", "plant", "biker"];
const PRESETS: [Preset; 2] = [Preset::Fast, Preset::Balanced];

/// 100 k Gaussians of SH degree 3, or a real scene if it is there.
fn scene(name: &str) -> Option<GaussianFrame> {
    let file = match name {
        "builtin" => {
            return Some(BuiltinScene { gaussians: 100_000, frames: 1, ..BuiltinScene::default() }.frame(0));
        }
        "playbot" => "playbot/0_0",
        "plant" => "plant.splat",
        _ => "biker.compressed.ply",
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/static");
    read_scene(&folder.join(file), &ReadLimits::default()).ok()
}

fn stream(frame: &GaussianFrame, preset: Preset) -> Vec<u8> {
    let mut bytes = Vec::new();
    let settings = Settings { preset, ..Settings::default() };
    encode(&mut vec![frame.clone()], &settings, &mut bytes, &mut |_, _| {}).unwrap();
    bytes
}

#[divan::bench(args = SCENES, consts = [0, 1], sample_count = 5, sample_size = 1)]
fn encode_preset<const PRESET: usize>(bencher: Bencher, name: &str) {
    let Some(frame) = scene(name) else { return };
    bencher.counter(ItemsCount::new(frame.len())).bench(|| stream(black_box(&frame), PRESETS[PRESET]));
}

/// To `f32` planes; with the digest verified (1) and without (0).
#[divan::bench(args = SCENES, consts = [0, 1], sample_count = 15, sample_size = 1)]
fn decode_verify<const VERIFY: usize>(bencher: Bencher, name: &str) {
    let Some(frame) = scene(name) else { return };
    let bytes = stream(&frame, Preset::Balanced);
    let options = Options { verify: VERIFY == 1, ..Options::default() };
    bencher.counter(ItemsCount::new(frame.len())).bench(|| {
        let summary = decode_stream(black_box(&bytes), &options, |sequence, frame| {
            black_box(to_gaussians(frame.into_shown(), sequence).unwrap());
            ControlFlow::Continue(())
        });
        assert_eq!(summary.verdict(), None);
    });
}
