//! Encode and decode speed, Gaussians per second, memory to memory; of sequences by the kind of frame.
//!
//! `cargo bench -p splatstream-encoder` runs the built-in scene, and real scenes where `../shared/data` has them.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed benchmark")]

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::{decode_stream, decode_stream_to};
use splatstream_encoder::{Preset, Settings, Structure, encode};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::{ReadLimits, read_scene};
use splatstream_format::Limits;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, ring};
use splatstream_render::render;
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
    bencher.counter(ItemsCount::new(frame.len())).bench(|| decode(black_box(&bytes), VERIFY == 1));
}

fn decode(bytes: &[u8], verify: bool) {
    let options = Options { verify, ..Options::default() };
    let memory = FrameMemory::default();
    let summary = decode_stream_to(&memory, bytes, None, &options, |sequence, frame| {
        memory.recycle(black_box(to_gaussians(frame.into_shown(), sequence).unwrap()));
        ControlFlow::Continue(())
    });
    assert_eq!(summary.verdict(), None);
}

/// Frames after the first.
const LATER: u32 = 8;

/// What the frames of a sequence do.
#[derive(Clone, Copy, Debug)]
enum Motion {
    /// There is one frame, an I frame, which may predict its later refinements.
    None,
    /// P frames follow in which nothing moves.
    Still,
    /// P frames follow in which a third of the Gaussians move.
    Moving,
}

/// All frames to `f32` planes, digests not verified, on one thread. Items are Gaussians of all frames: what P frames take
/// is what the I frame alone does not.
#[divan::bench(args = [Motion::None, Motion::Still, Motion::Moving], sample_count = 15, sample_size = 1)]
fn decode_frames(bencher: Bencher, motion: Motion) {
    let scene = BuiltinScene { gaussians: 50_000, sh_degree: 1, ..BuiltinScene::default() };
    let count = if matches!(motion, Motion::None) { 1 } else { 1 + LATER };
    let time = |number| if matches!(motion, Motion::Moving) { number } else { 0 };
    let mut frames: Vec<GaussianFrame> = (0..count).map(|number| scene.frame(time(number))).collect();
    let structure = Structure::Predicted { layers: 1 };
    let settings = Settings { preset: Preset::Fast, structure, ..Settings::default() };
    let mut bytes = Vec::new();
    encode(&mut frames, &settings, &mut bytes, &mut |_, _| {}).unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let items = ItemsCount::new(scene.gaussians as usize * count as usize);
    bencher.counter(items).bench_local(|| one.install(|| decode(black_box(&bytes), false)));
}

/// From bytes in memory to the first picture, 540 lines: the least that shows a scene of two spatial layers, which is the
/// first refinement of the lower one.
#[divan::bench(args = SCENES, sample_count = 15, sample_size = 1)]
fn first_picture(bencher: Bencher, name: &str) {
    let Some(frame) = scene(name) else { return };
    let camera = ring(&frame, Up::default(), 1, 540).remove(0);
    let settings = Settings { preset: Preset::Fast, spatial_layers: 2, ..Settings::default() };
    let mut bytes = Vec::new();
    encode(&mut vec![frame], &settings, &mut bytes, &mut |_, _| {}).unwrap();
    let least = OperatingPoint { spatial: 0, temporal: 0, refinement: 0 };
    let prefix = extract(&bytes, least, &Limits::default()).unwrap();
    bencher.bench(|| {
        let mut picture = None;
        let summary = decode_stream(black_box(&prefix), &Options::default(), |sequence, frame| {
            let shown = to_gaussians(frame.into_shown(), sequence).unwrap();
            picture = Some(render(&shown, &camera, [0.0; 3]));
            ControlFlow::Continue(())
        });
        assert_eq!(summary.verdict(), None);
        picture
    });
}
