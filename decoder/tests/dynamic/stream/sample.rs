//! Scenes that tests change: a small one, value by value, and one by dice with every kind of frame.

use super::cells::Cell;
use super::draw::{Plan, codebooks, morton, transforms};
use super::scene::{Frame, Gop, Scene, Unit};
use crate::crafted::sample;
use crate::crafted::scene::Gaussian;
use splatstream_format::syntax::{GopHeader, IncrementHeader, SequenceParameters};

/// A Gaussian `delta` behind the one before it; everything else follows from a number.
pub(crate) fn gaussian(delta: u64, number: i64) -> Gaussian {
    Gaussian {
        delta,
        log_scale: [number, 2, 1],
        opacity: 3 * number,
        rotation: [number, -2, 5],
        dc: vec![number, 20, -number],
        sh: Vec::new(),
    }
}

/// Gaussians at these places, which are in Morton order.
pub(crate) fn placed(places: &[[i64; 3]]) -> Vec<Gaussian> {
    let codes: Vec<u64> = places.iter().map(|&place| morton(place, 20)).collect();
    let before = [0].into_iter().chain(codes.iter().copied());
    let deltas = codes.iter().zip(before).map(|(code, before)| code.checked_sub(before).unwrap());
    deltas.zip(1..).map(|(delta, number)| gaussian(delta, number)).collect()
}

/// A header with a predictor for each Gaussian.
pub(crate) fn predicting(neighbour_count: u8) -> IncrementHeader {
    IncrementHeader { predictor_block_log2: 0, neighbour_count, ..IncrementHeader::PLAIN }
}

/// A frame with the sh transform.
pub(crate) fn frame(place: u32, units: Vec<Unit>) -> Frame {
    let codebooks = if place == 0 { codebooks(2) } else { Vec::new() };
    Frame { place, codebooks, dc_transform: 3, sh_transform: 4, count: None, units }
}

/// One predicted GOP of depth 0 with these frames, in one layer; refinements of these shares.
pub(crate) fn gop(percents: &[u8], frames: Vec<Frame>) -> Scene {
    let mut refinement_percent = [0; 10];
    refinement_percent[..percents.len()].copy_from_slice(percents);
    let count = frames.last().unwrap().place + 1;
    let sequence = SequenceParameters {
        refinement_count: percents.len() as u8,
        refinement_percent,
        frame_count: count,
        ..sample::sequence()
    };
    let header = GopHeader::predicted(0, count, 0);
    let gop = Gop { header, transforms: transforms(true), network: None, frames };
    Scene { level: 2, sequence, gops: vec![gop], points: None, index: false }
}

/// Eight Gaussians in two homes; then a frame whose unit 0 has every section and every mode.
///
/// Increments: 0 and 1 are those of the intra frame, 2 and 3 those of the predicted one.
pub(crate) fn small() -> Scene {
    let new = |first: i64| (first..first + 4).map(|number| gaussian(40, number)).collect();
    let intra =
        [0, 1].map(|refinement| Unit { refinement, new: new(4 * i64::from(refinement)), ..Unit::default() });
    let first = Unit {
        header: IncrementHeader {
            cell_log2: 2,
            predictor_block_log2: 1,
            neighbour_count: 2,
            ..IncrementHeader::PLAIN
        },
        cells: vec![
            Cell { code: 0, stale: 0, translation: [8, 9, 10], turn: [100, -200, 300] },
            Cell { code: 1, stale: 1, translation: [-1, 0, 80], turn: [0, 0, 8000] },
        ],
        modes: vec![1, 2, 3, 4],
        moves: vec![[1, 2, 3], [4, 0, 0]],
        updates: vec![gaussian(0, 2), gaussian(0, 1)],
        predictors: vec![1, 2],
        new: vec![gaussian(30, 1), gaussian(20, 2), gaussian(10, 3)],
        ..Unit::default()
    };
    let second = Unit { refinement: 1, modes: vec![0; 4], ..Unit::default() };
    gop(&[50, 100], vec![frame(0, intra.to_vec()), frame(1, vec![first, second])])
}

/// The unit with every section.
pub(crate) fn unit(scene: &mut Scene) -> &mut Unit {
    &mut scene.gops[0].frames[1].units[0]
}

/// A GOP of depth 2, in which frame 3 is absent, and one of an intra frame.
///
/// Increments: 0 to 5 are of frame 0, two layers of three; then three of each of the frames 1, 2, 4, 5; 18 to 23 of
/// frame 6.
pub(crate) fn large() -> Scene {
    let gops = vec![
        (GopHeader::predicted(0, 6, 2), vec![0, 1, 2, 4, 5]),
        (GopHeader { gop_index: 1, ..GopHeader::intra(0, 1) }, vec![0]),
    ];
    let percents = vec![20, 50, 100];
    Plan { seed: 21, layers: (2, 3), percents, sh: true, gaussians: 30, gops, short: false, learned: false }
        .scene()
}
