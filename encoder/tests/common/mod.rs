//! Small frames, and streams decoded to what a test compares.
#![allow(dead_code, reason = "each test binary uses a part of it")]

pub(crate) mod closeness;
pub(crate) mod dynamic;

use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::process::{DecodedFrame, Decoder, Options};
use splatstream_decoder::stream::{Summary, decode_stream};
use splatstream_encoder::{Report, Settings, encode};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_format::Limits;
use splatstream_format::syntax::SequenceParameters;
use splatstream_format::unit::Stream;
use splatstream_gaussians::random::SplitMix64;
use splatstream_gaussians::{GaussianFrame, Planes, sh_coefficients};
use std::ops::ControlFlow;

/// A frame of the built-in scene.
pub(crate) fn builtin(gaussians: u32, sh_degree: u8) -> GaussianFrame {
    BuiltinScene { gaussians, frames: 1, seed: 3, tracking: Tracking::Untracked, sh_degree }.frame(0)
}

/// A frame from a list of numbers: every attribute takes the next ones, so that any list is a frame.
pub(crate) fn frame_of(numbers: &[f32], count: usize, sh_degree: u8) -> GaussianFrame {
    let mut next = numbers.iter().copied().cycle();
    let mut plane =
        |scale: f32| -> Vec<f32> { (0..count).map(|_| next.next().unwrap_or(0.0) * scale).collect() };
    let planes = Planes {
        position: [plane(1.0), plane(2.0), plane(0.5)],
        log_scale: [plane(3.0), plane(3.0), plane(3.0)],
        rotation: [plane(1.0).into_iter().map(|w| w + 2.0).collect(), plane(1.0), plane(1.0), plane(1.0)],
        opacity_logit: plane(4.0),
        dc: [plane(1.0), plane(1.0), plane(1.0)],
        sh: (0..3 * sh_coefficients(sh_degree)).map(|_| plane(0.5)).collect(),
    };
    GaussianFrame::from_planes(sh_degree, planes).unwrap()
}

/// The stream of some frames and what the encoder says of it.
pub(crate) fn encoded(mut frames: Vec<GaussianFrame>, settings: &Settings) -> (Vec<u8>, Report) {
    let mut bytes = Vec::new();
    let report = encode(&mut frames, settings, &mut bytes, &mut |_, _| {}).unwrap();
    (bytes, report)
}

/// The frames of a stream and how it ended.
pub(crate) fn decoded(bytes: &[u8], options: &Options) -> (Vec<DecodedFrame>, Summary) {
    let mut frames = Vec::new();
    let summary = decode_stream(bytes, options, |_, frame| {
        frames.push(frame);
        ControlFlow::Continue(())
    });
    (frames, summary)
}

/// The parameters of a stream.
pub(crate) fn sequence(bytes: &[u8]) -> SequenceParameters {
    let limits = Limits::default();
    let stream = Stream::open(bytes, &limits).unwrap();
    let mut decoder = Decoder::new(stream.header(), Options { limits, ..Options::default() });
    let mut units = stream.units();
    while decoder.sequence().is_none() {
        let _frame = decoder.unit(&units.next_unit().unwrap().unwrap());
    }
    *decoder.sequence().unwrap()
}

/// Options with limits that suit small streams, to stop at the first error.
pub(crate) fn strict() -> Options {
    let limits = Limits { max_gaussians: 1 << 20, ..Limits::default() };
    Options { limits, stop_at_first_error: true, ..Options::default() }
}

/// The planes of every frame of a stream that must be right.
pub(crate) fn planes(bytes: &[u8]) -> Vec<QuantizedFrame> {
    let (frames, summary) = decoded(bytes, &strict());
    assert_eq!(summary.verdict(), None);
    frames.into_iter().map(|frame| frame.planes).collect()
}

/// The same mutations on every machine.
pub(crate) struct Random(SplitMix64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0.bits()
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }

    /// One damage: a bit, a byte, a run deleted, inserted, zeroed or copied elsewhere, or the end cut off.
    pub(crate) fn mutated(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        let at = self.below(bytes.len());
        let length = self.below(64).min(bytes.len() - at);
        match self.below(7) {
            0 => bytes[at] ^= 1 << self.below(8),
            1 => bytes[at] = bytes[at].wrapping_add(1 + self.below(255) as u8),
            2 => drop(bytes.drain(at..at + length)),
            3 => drop(bytes.splice(at..at, (0..length).map(|index| index as u8))),
            4 => bytes[at..at + length].fill(0),
            5 => {
                let to = self.below(bytes.len() - length);
                bytes.copy_within(at..at + length, to);
            }
            _ => bytes.truncate(at),
        }
        bytes
    }
}
