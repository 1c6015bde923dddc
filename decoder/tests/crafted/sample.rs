//! A small scene that uses every tool, and Gaussians by the dozen.

use super::scene::{Frame, Gaussian, Gop, Scene, Unit, codebook, diagonal};
use splatstream_format::syntax::{NO_TRANSFORM, SequenceParameters};

/// A generator of numbers that are the same everywhere.
#[derive(Debug, Clone)]
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        // The finaliser of splitmix64.
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    pub(crate) fn within(&mut self, low: i64, high: i64) -> i64 {
        low + self.below((high - low + 1) as u64) as i64
    }
}

/// 10 bits an axis, three refinements, blocks of 64, sorted axes, SH degree 1.
pub(crate) fn sequence() -> SequenceParameters {
    SequenceParameters {
        sh_degree: 1,
        spatial_layer_count: 1,
        temporal_layer_count: 1,
        refinement_count: 3,
        refinement_percent: [20, 50, 100, 0, 0, 0, 0, 0, 0, 0],
        position_bits: 10,
        block_log2: 6,
        sequence_flags: SequenceParameters::flags(true, false),
        rotation_threshold: [12, 8, 4],
        frame_count: 3,
        ticks_per_second: 30,
        ticks_per_frame: 1,
        position_offset: [(-1.0_f32).to_bits(), 0, 1.5_f32.to_bits()],
        position_step: 0.01_f32.to_bits(),
        log_scale_offset: (-8.0_f32).to_bits(),
        log_scale_step: 0.1_f32.to_bits(),
        rotation_step: 0.01_f32.to_bits(),
        opacity_offset: 0.5_f32.to_bits(),
        opacity_step: 0.2_f32.to_bits(),
        dc_step: 0.03_f32.to_bits(),
        sh_step: 0.07_f32.to_bits(),
    }
}

/// Gaussians that obey every rule, for transforms of these ranks.
pub(crate) fn gaussians(count: usize, seed: u64, dc_rank: usize, sh_rank: usize) -> Vec<Gaussian> {
    let mut dice = Dice::new(seed);
    let make = |_| Gaussian {
        delta: dice.below(3000),
        log_scale: [dice.within(-20, 30), dice.within(0, 9), dice.within(0, 9)],
        opacity: dice.within(-25, 25),
        rotation: [(); 3].map(|()| dice.within(-9, 9)),
        dc: (0..dc_rank).map(|_| dice.within(-60, 60)).collect(),
        sh: (0..sh_rank).map(|_| dice.within(-5, 5)).collect(),
    };
    (0..count).map(make).collect()
}

/// Gives Gaussians indices of the codebooks 7 and 1 in the place of sh components.
fn indexed(gaussians: &mut [Gaussian], seed: u64) {
    let mut dice = Dice::new(seed);
    gaussians.iter_mut().for_each(|gaussian| gaussian.sh = vec![dice.within(0, 2), dice.within(0, 1)]);
}

/// A frame of 10 Gaussians: 2 with sh coefficients, 3 vector-quantised, 5 without sh.
pub(crate) fn frame(seed: u64) -> Frame {
    let mut all = gaussians(10, seed, 3, 2);
    let last = all.split_off(5);
    let mut middle = all.split_off(2);
    indexed(&mut middle, seed);
    let bare = last.into_iter().map(|gaussian| Gaussian { sh: Vec::new(), ..gaussian }).collect();
    let units = vec![
        Unit { gaussians: all, sh_mode: 1, ..Unit::default() },
        Unit { gaussians: middle, sh_mode: 2, codebook_ids: vec![7, 1], lanes_log2: 1, ..Unit::default() },
        Unit { gaussians: bare, position_shift: 1, lanes_log2: 2, ..Unit::default() },
    ];
    Frame { dc_transform: 3, sh_transform: 4, count: None, units }
}

/// Transforms 3 of both kinds and 4 of kind sh, codebooks 7 and 1.
pub(crate) fn tools() -> Gop {
    Gop {
        transforms: vec![
            diagonal(3, 0, 3, 3, 4096, -70),
            diagonal(4, 1, 9, 2, 1234, 9),
            diagonal(3, 1, 9, 9, 4096, 0),
        ],
        codebooks: vec![
            codebook(7, 2, 1, vec![1, -2, 30, 40, -128, 127]),
            codebook(1, 2, 2, vec![0, 5, -8191, 8191]),
        ],
        frames: Vec::new(),
    }
}

/// Two GOPs, of two frames and of one, and an index.
pub(crate) fn scene() -> Scene {
    let first = Gop { frames: vec![frame(1), frame(2)], ..tools() };
    let second = Gop { frames: vec![frame(3)], ..tools() };
    Scene { level: 2, sequence: sequence(), gops: vec![first, second], index: true }
}

/// One frame of these Gaussians in one refinement, SH degree 0: the least that a value test needs.
pub(crate) fn plain(gaussians: Vec<Gaussian>) -> Scene {
    let sequence = SequenceParameters {
        sh_degree: 0,
        refinement_count: 1,
        refinement_percent: [100, 0, 0, 0, 0, 0, 0, 0, 0, 0],
        frame_count: 1,
        ..sequence()
    };
    let unit = Unit { gaussians, ..Unit::default() };
    let frame = Frame { dc_transform: 3, sh_transform: NO_TRANSFORM, count: None, units: vec![unit] };
    let gop = Gop { transforms: vec![diagonal(3, 0, 3, 3, 4096, 0)], frames: vec![frame], ..Gop::default() };
    Scene { level: 1, sequence, gops: vec![gop], index: false }
}
