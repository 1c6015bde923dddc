//! What encoding is said to take is what it takes at most: a program of its own, so that no other test takes memory meanwhile.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use peak_alloc::PeakAlloc;
use splatstream_decoder::predictor::Predictor;
use splatstream_encoder::{
    Encoder, Error, Finetune, FrameSource, Predictors, Preset, Settings, Size, Structure, encode,
};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_gaussians::GaussianFrame;
use std::sync::{Mutex, MutexGuard, PoisonError};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

static ALONE: Mutex<()> = Mutex::new(());

/// One test at a time, once the program has what it takes a single time: threads and tables.
fn alone() -> MutexGuard<'static, ()> {
    let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let mut frames = scene(100, 0, 1, Tracking::Tracked);
    encode(&mut frames, &of(Preset::Balanced), &mut std::io::sink(), &mut |_, _| ()).unwrap();
    alone
}

/// Frames that are in memory already, and what is taken at most when one of them is asked for.
struct There {
    frames: Vec<GaussianFrame>,
    taken: usize,
}

impl FrameSource for There {
    fn len(&self) -> u32 {
        self.frames.len() as u32
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        self.taken = self.taken.max(MEMORY.current_usage());
        Ok(self.frames[number as usize].clone())
    }
}

/// How a scene is encoded as the command line does it: to a PSNR, with one GOP at a time.
fn of(preset: Preset) -> Settings {
    Settings { preset, psnr: Some(50.0), verify: true, gop_memory: 1, ..Settings::default() }
}

fn scene(gaussians: u32, sh_degree: u8, frames: u32, tracking: Tracking) -> Vec<GaussianFrame> {
    let scene = BuiltinScene { gaussians, sh_degree, frames, tracking, ..BuiltinScene::default() };
    (0..frames).map(|number| scene.frame(number)).collect()
}

/// The same with Gaussians seven times as large.
fn enlarged(mut frames: Vec<GaussianFrame>) -> Vec<GaussianFrame> {
    for plane in frames.iter_mut().flat_map(|frame| frame.planes_mut().log_scale) {
        plane.iter_mut().for_each(|log_scale| *log_scale += 2.0);
    }
    frames
}

/// What is said, and what is taken beside the frames; in megabytes.
fn said_and_taken(name: &str, frames: Vec<GaussianFrame>, settings: &Settings) -> [f64; 2] {
    let largest = frames.iter().map(GaussianFrame::len).max().unwrap() as u64;
    let said = settings.memory(largest, frames[0].sh_degree(), frames.len() as u32);
    let mut source = There { frames, taken: 0 };
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    // Nothing less is enough, and this is.
    let allowed = Settings { max_memory: said, ..settings.clone() };
    encode(&mut source, &allowed, &mut std::io::sink(), &mut |_, _| ()).unwrap();
    let taken = (MEMORY.peak_usage() - before) as u64;
    assert!(taken <= said, "{name}: {said} said, {taken} taken");
    let frame: u64 = source.frames[0].planes().iter().map(|plane| size_of_val(plane.as_slice()) as u64).sum();
    let asking = (source.taken - before) as u64;
    let left = (said / 3).min(2 * frame);
    assert!(asking + left <= said, "{name}: {said} said, {asking} taken when a frame is asked for");
    let first = &source.frames[0];
    let needed = settings.memory(first.len() as u64, first.sh_degree(), source.len());
    let refused = Settings { max_memory: needed - 1, ..settings.clone() };
    MEMORY.reset_peak_usage();
    let error = encode(&mut source, &refused, &mut std::io::sink(), &mut |_, _| ()).unwrap_err();
    let Error::OverMemory { frame: 0, asked, allowed, .. } = error else { panic!("{name}: {error}") };
    assert_eq!((asked, allowed), (needed, needed - 1), "{name}");
    // Before anything but a frame is taken.
    let taken_at_once = (MEMORY.peak_usage() - before) as u64;
    assert!(taken_at_once < frame + (1 << 16), "{name}: {taken_at_once} taken to be refused");
    [said as f64 / 1e6, taken as f64 / 1e6]
}

#[test]
fn no_more_memory_is_taken_than_is_said() {
    let _alone = alone();
    let [fast, balanced] = [Preset::Fast, Preset::Balanced].map(of);
    let fitted = |settings: &Settings| {
        let finetune = Some(Finetune { iterations: 2, ..Finetune::default() });
        Settings { finetune, ..settings.clone() }
    };
    let predicted = |settings: &Settings, layers: u8| {
        let structure = Structure::Predicted { layers };
        Settings { structure, spatial_layers: 3, ..settings.clone() }
    };
    let with_network =
        |settings: Settings| Settings { predictors: Predictors::always(Predictor::Transformer), ..settings };
    let sized = Settings { size: Some(Size::BitsPerGaussian(90.0)), ..fast.clone() };
    let plain = Settings { psnr: None, verify: false, ..balanced.clone() };
    let pruned = Settings { prune: Some(45.0), ..balanced.clone() };
    let still = |gaussians, degree| scene(gaussians, degree, 1, Tracking::Tracked);
    let moving = |gaussians, degree, frames| scene(gaussians, degree, frames, Tracking::Tracked);
    let retrained = |gaussians, degree, frames| scene(gaussians, degree, frames, Tracking::Untracked);
    let cases = [
        ("hardly anything", still(100, 0), balanced.clone()),
        ("hardly anything, moving", moving(100, 0, 4), predicted(&balanced, 2)),
        ("fast", still(80_000, 0), fast.clone()),
        ("fast, degree 3", still(40_000, 3), fast.clone()),
        ("balanced", still(40_000, 0), balanced.clone()),
        ("balanced, degree 2", still(33_000, 2), balanced.clone()),
        ("large Gaussians", enlarged(still(33_000, 3)), balanced.clone()),
        ("steps that are given", still(33_000, 3), plain),
        ("pruned", still(33_000, 0), pruned),
        ("fitted", still(33_000, 0), fitted(&balanced)),
        ("fitted, degree 3", still(10_000, 3), fitted(&fast)),
        ("I frames", moving(33_000, 3, 3), fast.clone()),
        ("I frames of a size", moving(10_000, 1, 3), sized),
        ("predicted, fast", moving(33_000, 0, 3), predicted(&fast, 2)),
        ("predicted, fast, degree 3", moving(8_000, 3, 3), predicted(&fast, 1)),
        ("predicted", moving(5_000, 2, 3), predicted(&balanced, 3)),
        ("predicted, untracked", retrained(6_000, 0, 3), predicted(&fast, 2)),
        ("with a network", retrained(6_000, 1, 4), with_network(predicted(&fast, 2))),
    ];
    for (name, frames, settings) in cases {
        said_and_taken(name, frames, &settings);
    }
}

/// Where there are many Gaussians no more is asked for than twice what is taken.
#[test]
fn of_many_gaussians_not_much_more_is_said_than_is_taken() {
    let _alone = alone();
    for (gaussians, degree, preset) in
        [(300_000, 0, Preset::Fast), (150_000, 3, Preset::Fast), (60_000, 3, Preset::Balanced)]
    {
        let frames = scene(gaussians, degree, 1, Tracking::Tracked);
        let [said, taken] = said_and_taken("many", frames, &of(preset));
        assert!(said < 2.0 * taken, "{gaussians} of degree {degree}, {preset:?}: {said} said, {taken} taken");
    }
}

/// With more memory more GOPs are coded at once, within it and with the same bytes.
#[test]
fn gops_at_once_stay_within_the_memory() {
    let _alone = alone();
    let structure = Structure::Predicted { layers: 2 };
    let settings = Settings { psnr: None, verify: false, gop: 2, structure, ..of(Preset::Fast) };
    let settings = Settings { gop_memory: u64::MAX, ..settings };
    let mut source = There { frames: scene(20_000, 1, 6, Tracking::Tracked), taken: 0 };
    let said = settings.memory(20_000, 1, 6);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let mut encoded = |max_memory: u64| {
        let settings = Settings { max_memory, ..settings.clone() };
        let mut bytes = Vec::with_capacity(1 << 22);
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        pool.install(|| encode(&mut source, &settings, &mut bytes, &mut |_, _| ())).unwrap();
        let taken = (MEMORY.peak_usage() - before) as u64;
        assert!(taken <= max_memory, "{taken} taken of {max_memory}");
        (bytes, taken)
    };
    let [(one, of_one), (two, of_two), (many, _)] = [said, 2 * said, u64::MAX].map(&mut encoded);
    assert!(one == two && one == many);
    assert!(of_one < of_two, "{of_one} {of_two}");
}

/// Frames that wait count where they are pushed.
#[test]
fn frames_that_wait_count() {
    let _alone = alone();
    let settings = Settings {
        gop: 3,
        structure: Structure::Predicted { layers: 1 },
        ..Settings { psnr: None, verify: false, ..of(Preset::Fast) }
    };
    let frames = scene(2_000, 1, 7, Tracking::Tracked);
    let of_frame = 23 * 4 * 2_000;
    // Four wait: those of a GOP, and one more.
    let said = settings.memory(2_000, 1, 4) + 4 * of_frame;
    let push = |max_memory: u64| {
        let mut encoder = Encoder::new(std::io::sink(), Settings { max_memory, ..settings.clone() });
        frames.iter().try_for_each(|frame| encoder.push(frame.clone()))?;
        encoder.finish().map(|report| report.frames)
    };
    assert_eq!(push(said).unwrap(), 7);
    let Err(Error::OverMemory { frame: 3, gaussians: 2_000, .. }) = push(said - 1) else {
        panic!("a frame too many waits");
    };
}
