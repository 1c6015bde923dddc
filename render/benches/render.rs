//! Speed of drawing and of what Gaussians contribute, per picture.
//!
//! `cargo bench -p splatstream-render` runs the built-in scene, and a real one where `../shared/data` has it.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed benchmark")]

use divan::{Bencher, black_box};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::{ReadLimits, read_scene};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, ring};
use splatstream_render::contribution::{contribution, removal};
use splatstream_render::{Camera, render};
use std::path::Path;

fn main() {
    divan::main();
}

const SCENES: [&str; 2] = ["builtin", "playbot"];
const HEIGHTS: [u32; 3] = [540, 720, 1080];

/// 100,000 Gaussians, or 500,000 of a real scene if it is there; and views of it.
fn scene(name: &str, views: u32, height: u32) -> Option<(GaussianFrame, Vec<Camera>)> {
    let frame = if name == "builtin" {
        BuiltinScene { gaussians: 100_000, frames: 1, ..BuiltinScene::default() }.frame(0)
    } else {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/static/playbot/0_0");
        read_scene(&folder, &ReadLimits::default()).ok()?
    };
    let cameras = ring(&frame, Up::default(), views, height);
    Some((frame, cameras))
}

#[divan::bench(args = SCENES, consts = HEIGHTS, sample_count = 10, sample_size = 1)]
fn picture<const HEIGHT: u32>(bencher: Bencher, name: &str) {
    let Some((frame, cameras)) = scene(name, 1, HEIGHT) else { return };
    bencher.bench(|| render(black_box(&frame), &cameras[0], [0.0; 3]));
}

/// Four views at 540 lines.
#[divan::bench(args = SCENES, sample_count = 5, sample_size = 1)]
fn contribution_to_four(bencher: Bencher, name: &str) {
    let Some((frame, cameras)) = scene(name, 4, 540) else { return };
    bencher.bench(|| contribution(black_box(&frame), &cameras));
}

/// Four views at 540 lines.
#[divan::bench(args = SCENES, sample_count = 5, sample_size = 1)]
fn removal_from_four(bencher: Bencher, name: &str) {
    let Some((frame, cameras)) = scene(name, 4, 540) else { return };
    bencher.bench(|| removal(black_box(&frame), &cameras));
}
