//! Speed of pictures forwards and backwards and of losses, per view, on one and on two threads.
//!
//! `cargo bench -p splatstream-render --bench gradient` takes plant (113,187 Gaussians) where `../shared/data` has it, and
//! as many of the built-in scene otherwise.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed benchmark")]

use divan::{Bencher, black_box};
use rayon::{ThreadPool, ThreadPoolBuilder};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::{ReadLimits, read_scene};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, ring};
use splatstream_render::gradient::{Gradients, Loss, MultiResolution, Target};
use splatstream_render::{Camera, PreparedFrame};
use std::path::Path;

fn main() {
    divan::main();
}

const HEIGHTS: [u32; 2] = [540, 1080];
const THREADS: [usize; 2] = [1, 2];

fn scene(height: u32) -> (GaussianFrame, Camera) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/static/plant.splat");
    let built_in = || BuiltinScene { gaussians: 113_187, frames: 1, ..BuiltinScene::default() }.frame(0);
    let frame = read_scene(&file, &ReadLimits::default()).unwrap_or_else(|_| built_in());
    let camera = ring(&frame, Up::default(), 1, height).remove(0);
    (frame, camera)
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// A view with what it needs to go back.
#[divan::bench(args = THREADS, consts = HEIGHTS, sample_count = 10, sample_size = 1)]
fn forward<const HEIGHT: u32>(bencher: Bencher, threads: usize) {
    let ((frame, camera), pool) = (scene(HEIGHT), pool(threads));
    let prepared = PreparedFrame::new(&frame);
    bencher.bench_local(|| pool.install(|| prepared.draw(black_box(&camera), [0.0; 3]).gaussians()));
}

#[divan::bench(args = THREADS, consts = HEIGHTS, sample_count = 10, sample_size = 1)]
fn backward<const HEIGHT: u32>(bencher: Bencher, threads: usize) {
    let ((frame, camera), pool) = (scene(HEIGHT), pool(threads));
    let prepared = PreparedFrame::new(&frame);
    let drawing = prepared.draw(&camera, [0.0; 3]);
    let mut gradients = Gradients::zero(&frame);
    // Any slopes do, unless they are 0.
    let slopes = &drawing.rendering().colour;
    bencher.bench_local(|| pool.install(|| drawing.backward(black_box(slopes), &mut gradients).unwrap()));
}

/// L1 and SSIM with their slopes.
#[divan::bench(args = THREADS, consts = HEIGHTS, sample_count = 10, sample_size = 1)]
fn loss<const HEIGHT: u32>(bencher: Bencher, threads: usize) {
    let ((frame, camera), pool) = (scene(HEIGHT), pool(threads));
    let prepared = PreparedFrame::new(&frame);
    let picture = |black| prepared.draw(&camera, [black; 3]).rendering().colour.clone();
    let [reference, picture] = [0.0, 0.1].map(picture);
    let between = || Loss::default().between(&reference, black_box(&picture)).unwrap();
    bencher.bench_local(|| pool.install(between));
}

/// One view at 540, 720 and 1080 lines: drawn, judged, gone back through.
#[divan::bench(args = THREADS, sample_count = 5, sample_size = 1)]
fn three_resolutions(bencher: Bencher, threads: usize) {
    let ((frame, camera), pool) = (scene(1080), pool(threads));
    let loss = MultiResolution::default();
    let picture = PreparedFrame::new(&frame).draw(&camera, [0.1; 3]).rendering().colour.clone();
    let targets: Vec<Target> = loss.targets(&camera, &picture).unwrap();
    let mut gradients = Gradients::zero(&frame);
    bencher.bench_local(|| {
        pool.install(|| {
            let prepared = PreparedFrame::new(black_box(&frame));
            loss.add(&prepared, [0.0; 3], &targets, &mut gradients).unwrap()
        })
    });
}
