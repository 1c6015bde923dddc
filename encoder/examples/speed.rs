//! Encodes and decodes a scene in memory whenever it is told to, and says what that took: what
//! `conformance/peers/speed.py` measures this codec with, in turn with others.
//!
//! `cargo run --release -p splatstream-encoder --example speed -- FRAME...` reads the frames, then requests, one a line:
//!
//! | request | what is done |
//! |---|---|
//! | `encode PRESET fitted THREADS` | the scene is encoded as `splatstream encode` does: steps fitted to 50 dB, and verified |
//! | `encode PRESET given THREADS` | the same with steps that are given |
//! | `decode PRESET verified THREADS` | the fitted stream is decoded to planes of f32, all digests compared |
//! | `decode PRESET unverified THREADS` | the same without digests |
//! | `write PRESET PATH` | the fitted stream is written to a file |
//!
//! Each is answered by a line of JSON: `bytes` of the stream, `gaussians` of all frames, `cpu_s` of all threads, `wall_s`.
//! More than one frame is a sequence: three spatial and two temporal layers, GOPs of 16 frames.
#![expect(clippy::print_stdout, reason = "answers go to standard output")]

mod measured;

use measured::{Result, Seconds, decoded, measured};
use rayon::{ThreadPool, ThreadPoolBuilder};
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_encoder::{Preset, Quality, Settings, Structure, encode};
use splatstream_files::{ReadLimits, read_scene};
use splatstream_gaussians::GaussianFrame;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;

fn main() -> Result<()> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    let mut scene = Scene::read(&paths)?;
    for line in std::io::stdin().lines() {
        let line = line?;
        let words: Vec<&str> = line.split_whitespace().collect();
        println!("{}", scene.answer(&words)?);
    }
    Ok(())
}

/// A scene, and what has been made of it.
struct Scene {
    frames: Vec<GaussianFrame>,
    /// The fitted stream of each preset, by its name.
    streams: BTreeMap<String, Vec<u8>>,
    /// Pools of threads, by their number.
    pools: BTreeMap<usize, ThreadPool>,
    /// What frames are decoded to.
    memory: FrameMemory,
}

impl Scene {
    fn read(paths: &[String]) -> Result<Self> {
        let limits = ReadLimits { max_memory: u64::MAX };
        let read = |path: &String| read_scene(Path::new(path), &limits);
        let frames = paths.iter().map(read).collect::<core::result::Result<Vec<_>, _>>()?;
        if frames.is_empty() {
            return Err("speed FRAME...".into());
        }
        Ok(Self { frames, streams: BTreeMap::new(), pools: BTreeMap::new(), memory: FrameMemory::default() })
    }

    /// Does what a request asks for.
    fn answer(&mut self, words: &[&str]) -> Result<String> {
        match *words {
            ["encode", preset, steps, threads] => self.encode(preset, steps, threads.parse()?),
            ["decode", preset, digests, threads] => self.decode(preset, digests, threads.parse()?),
            ["write", preset, path] => {
                let stream = self.fitted(preset)?;
                std::fs::write(path, stream)?;
                Ok(json(stream.len(), 0, Seconds { processor: 0.0, wall: 0.0 }))
            }
            _ => Err(format!("there is no request {}", words.join(" ")).into()),
        }
    }

    fn encode(&mut self, preset: &str, steps: &str, threads: usize) -> Result<String> {
        let is_fitted = is_first(steps, "fitted", "given")?;
        let settings = self.settings(preset, is_fitted)?;
        let mut stream = Vec::new();
        let (pools, frames) = (&mut self.pools, &mut self.frames);
        let work = || encode(frames, &settings, &mut stream, &mut |_, _| {});
        let (report, seconds) = in_threads(pools, threads, work)?;
        let answer = json(stream.len(), report?.gaussians, seconds);
        if is_fitted {
            self.streams.insert(preset.to_owned(), stream);
        }
        Ok(answer)
    }

    fn decode(&mut self, preset: &str, digests: &str, threads: usize) -> Result<String> {
        let verify = is_first(digests, "verified", "unverified")?;
        self.fitted(preset)?;
        let stream = self.streams.get(preset).map(Vec::as_slice).unwrap_or_default();
        let memory = &self.memory;
        let work = || decoded(stream, verify, memory).map_err(|error| error.to_string());
        let (gaussians, seconds) = in_threads(&mut self.pools, threads, work)?;
        Ok(json(stream.len(), gaussians?, seconds))
    }

    /// The fitted stream of a preset, made where it is not there yet.
    fn fitted(&mut self, preset: &str) -> Result<&[u8]> {
        if !self.streams.contains_key(preset) {
            self.encode(preset, "fitted", 2)?;
        }
        Ok(self.streams.get(preset).map(Vec::as_slice).unwrap_or_default())
    }

    /// What `splatstream encode` takes for such a scene.
    fn settings(&self, preset: &str, is_fitted: bool) -> Result<Settings> {
        let preset = match preset {
            "fast" => Preset::Fast,
            "balanced" => Preset::Balanced,
            "small" => Preset::Small,
            _ => return Err(format!("there is no preset {preset}").into()),
        };
        let quality = Quality::default();
        let (structure, spatial_layers) = match self.frames.len() {
            1 => (Structure::Intra, 1),
            _ => (Structure::Predicted { layers: 2 }, 3),
        };
        let psnr = is_fitted.then(|| quality.decibels());
        let steps = quality.steps();
        Ok(Settings {
            preset,
            steps,
            psnr,
            verify: is_fitted,
            structure,
            spatial_layers,
            ..Settings::of(preset)
        })
    }
}

/// Whether a word is the first of two that it may be.
fn is_first(word: &str, first: &str, second: &str) -> Result<bool> {
    match word {
        _ if word == first => Ok(true),
        _ if word == second => Ok(false),
        _ => Err(format!("{word} is neither {first} nor {second}").into()),
    }
}

/// Does some work in so many threads.
fn in_threads<T: Send>(
    pools: &mut BTreeMap<usize, ThreadPool>,
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> Result<(T, Seconds)> {
    let pool = match pools.entry(threads) {
        Entry::Occupied(entry) => entry.into_mut(),
        Entry::Vacant(entry) => entry.insert(ThreadPoolBuilder::new().num_threads(threads).build()?),
    };
    Ok(measured(|| pool.install(work)))
}

fn json(bytes: usize, gaussians: u64, seconds: Seconds) -> String {
    let Seconds { processor, wall } = seconds;
    format!(r#"{{"bytes": {bytes}, "gaussians": {gaussians}, "cpu_s": {processor:.6}, "wall_s": {wall:.6}}}"#)
}
