#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a panic is a failed test")]

use super::follow::follow;
use super::stale_cells::{Held, stale_cells};
use super::*;
use crate::grid::PositionGrid;
use crate::matching::tests::{Scene, measure, shuffled};
use crate::matching::{Cloud, Kind, Matching, Measure, shares_little};
use crate::settings::{Quality, Settings};
use splatstream_files::{ReadLimits, read_scene};
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::random::SplitMix64;
use std::path::Path;

const BITS: u8 = 12;

/// Pairs on the walls of a box of 2,000 steps, moved by `motion`.
fn pairs(count: usize, motion: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<Pair> {
    let mut random = SplitMix64::new(1);
    (0..count)
        .map(|index| {
            let mut from = [0; 3].map(|_: i32| ((1000.0 + 2000.0 * random.unit()) * 64.0) as i32);
            from[index % 3] = 64_000;
            Pair { from, to: motion(grid_position(from)).map(|value| value as f32) }
        })
        .collect()
}

/// Turned about the middle of the box, around y.
fn twisted(angle: f64) -> impl Fn([f64; 3]) -> [f64; 3] {
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    move |[x, y, z]: [f64; 3]| {
        let (x, z) = (x - 2000.0, z - 2000.0);
        [2000.0 + cos * x + sin * z, y, 2000.0 - sin * x + cos * z]
    }
}

/// Root mean square distance from the targets, steps.
fn rms(pairs: &[Pair], at: impl Fn([i32; 3]) -> [f32; 3]) -> f64 {
    let square = |pair: &Pair| {
        let index = at(pair.from);
        (0..3).map(|axis| f64::from(index[axis] - pair.to[axis])).map(|d| d * d).sum::<f64>()
    };
    (pairs.iter().map(square).sum::<f64>() / pairs.len().max(1) as f64).sqrt()
}

fn undisplaced(fine: [i32; 3]) -> [f32; 3] {
    grid_position(fine).map(|value| value as f32)
}

#[test]
fn one_shift_is_one_value_for_all_cells() {
    let pairs = pairs(20_000, |[x, y, z]| [x + 40.0, y - 7.5, z + 0.25]);
    let motion = cell_motion(&pairs, &[], BITS);
    assert!(rms(&pairs, |fine| motion.displaced(fine)) < 0.1);
    assert!(motion.cells.iter().all(|cell| cell.translation == motion.cells[0].translation));
    assert!(motion.bits[0] + motion.bits[1] < 400.0, "{:?}", motion.bits);
}

#[test]
fn a_twist_is_followed_by_turning_cells() {
    let pairs = pairs(20_000, twisted(0.2));
    let motion = cell_motion(&pairs, &[], BITS);
    assert!(rms(&pairs, undisplaced) > 150.0);
    assert!(rms(&pairs, |fine| motion.displaced(fine)) < 0.5);
    assert!(motion.cells.len() < 100 && motion.cells.iter().all(|cell| cell.rotation[1] != 0));
}

#[test]
fn what_stands_still_is_not_listed() {
    let bodies = |[x, y, z]: [f64; 3]| if x < 2000.0 { [x, y, z] } else { [x + 30.0, y, z + 9.0] };
    let pairs = pairs(20_000, bodies);
    let motion = cell_motion(&pairs, &[], BITS);
    assert!(rms(&pairs, |fine| motion.displaced(fine)) < 4.0);
    for pair in &pairs {
        if pair.from[0] < 1900 * 64 && motion.displaced(pair.from) != undisplaced(pair.from) {
            panic!("{pair:?} moves");
        }
    }
}

#[test]
fn noise_is_no_motion() {
    let mut random = SplitMix64::new(2);
    let mut pairs = pairs(10_000, |index| index);
    pairs.iter_mut().flat_map(|pair| &mut pair.to).for_each(|value| *value += 0.4 * random.signed());
    assert_eq!(cell_motion(&pairs, &[], BITS).cells, []);
}

#[test]
fn mistaken_pairs_do_not_pull() {
    let mut random = SplitMix64::new(3);
    let mut pairs = pairs(10_000, |[x, y, z]| [x + 12.0, y, z]);
    for pair in pairs.iter_mut().step_by(10) {
        pair.to = pair.to.map(|value| value + 100.0 * random.signed());
    }
    let motion = cell_motion(&pairs, &[], BITS);
    let right: Vec<Pair> =
        pairs.iter().enumerate().filter(|(index, _)| index % 10 != 0).map(|(_, &pair)| pair).collect();
    assert!(rms(&right, |fine| motion.displaced(fine)) < 0.5);
}

#[test]
fn what_has_no_pair_moves_with_what_is_around_it() {
    let whole = pairs(20_000, twisted(0.1));
    let (known, hidden): (Vec<Pair>, Vec<Pair>) =
        whole.iter().partition(|pair| pair.from[1] < 2000 * 64 || pair.from[0] < 1500 * 64);
    let unmatched: Vec<[i32; 3]> = hidden.iter().map(|pair| pair.from).collect();
    let motion = cell_motion(&known, &unmatched, BITS);
    assert!(rms(&hidden, |fine| motion.displaced(fine)) < 0.1 * rms(&hidden, undisplaced));
    assert_eq!(cell_motion(&[], &unmatched, BITS).cells, []);
    assert_eq!(cell_motion(&[], &[], 1).cells, []);
}

/// The integer formula of the decoder.
fn exact(cell: &Cell, index: [u32; 3], cell_log2: u8, fine: [i32; 3]) -> [i64; 3] {
    let [v0, v1, v2] = cell.rotation.map(i64::from);
    let w = ((1_i64 << 28) - v0 * v0 - v1 * v1 - v2 * v2).isqrt();
    let centre = index.map(|index| (i64::from(index) << (cell_log2 + 6)) + (1 << (i64::from(cell_log2) + 5)));
    let cross = |[a0, a1, a2]: [i64; 3]| [v1 * a2 - v2 * a1, v2 * a0 - v0 * a2, v0 * a1 - v1 * a0];
    let t = cross([0, 1, 2].map(|axis: usize| i64::from(fine[axis]) - centre[axis]));
    let u = cross(t);
    [0, 1, 2].map(|axis: usize| {
        let rotated = (w * t[axis] + u[axis] + (1 << 26)) >> 27;
        i64::from(fine[axis]) + rotated + i64::from(cell.translation[axis]) * 8
    })
}

#[test]
fn displacement_is_that_of_the_decoder() {
    let pairs = pairs(5000, twisted(0.3));
    let motion = cell_motion(&pairs, &[], BITS);
    for pair in &pairs {
        let (index, code) = motion.cell(pair.from);
        let Some(cell) = motion.cells.iter().find(|cell| cell.code == code) else { continue };
        let exact = exact(cell, index, motion.cell_log2, pair.from);
        let near = motion.displaced(pair.from);
        assert!(
            (0..3).all(|axis| (f64::from(near[axis]) * 64.0 - exact[axis] as f64).abs() < 1.5),
            "{pair:?}"
        );
    }
}

fn fine(cloud: &Cloud<'_>) -> Vec<[i32; 3]> {
    (0..cloud.len() as u32).map(|index| cloud.at(index).map(|value| (value * 64.0) as i32)).collect()
}

/// Pairs, and what has none.
fn parted(matching: &Matching, from: &[[i32; 3]], target: &Cloud<'_>) -> (Vec<Pair>, Vec<[i32; 3]>) {
    let pair = |(&from, to): (&[i32; 3], &Option<u32>)| to.map(|to| Pair { from, to: target.at(to) });
    let pairs = from.iter().zip(&matching.target_of).filter_map(pair).collect();
    (pairs, matching.free().iter().map(|&index| from[index as usize]).collect())
}

#[test]
fn what_moves_far_is_found_and_what_is_gone_is_stale() {
    let reference = Scene::random(12_000, 4);
    let mut rows = shuffled(0, 12_000, 5);
    rows.retain(|&row| reference.position[0][row] < 1800.0);
    let mut target = reference.select(&rows).noisy(0, 6).moved([20.0, -60.0, 10.0]);
    for index in 0..rows.len() {
        target.position[2][index] += 0.1 * (target.position[0][index] - 1500.0);
    }
    let (reference, target) = (reference.cloud(), target.cloud());
    let matching = follow(&reference, &target, &measure(), BITS);
    let right = rows.iter().zip(0..).filter(|&(&row, to)| matching.target_of[row] == Some(to)).count();
    assert!(right * 100 > 97 * rows.len(), "{right} of {}", rows.len());
    let from = fine(&reference);
    let (pairs, unmatched) = parted(&matching, &from, &target);
    let motion = cell_motion(&pairs, &unmatched, BITS);
    let carried = [0, 1, 2]
        .map(|axis: usize| from.iter().map(|&fine| motion.displaced(fine)[axis]).collect::<Vec<f32>>());
    let carried = Cloud { position: carried.each_ref().map(Vec::as_slice), ..reference };
    let held = Held { carried, from: &from, matching: &matching };
    let stale = stale_cells(&motion, &held, &target, &measure());
    let mistaken = |&&fine: &&[i32; 3]| {
        let is_stale = stale.binary_search(&motion.cell(fine).1).is_ok();
        is_stale != (fine[0] >= 1800 * 64)
    };
    // Cells at the border hold both.
    let mistaken = from.iter().filter(mistaken).count();
    assert!(mistaken * 100 < 5 * from.len(), "{mistaken} of {}", from.len());
    let marked = motion.with_stale(&stale);
    assert!(marked.cells.is_sorted_by(|a, b| a.code < b.code));
    assert_eq!(marked.cells.iter().filter(|cell| cell.stale).count(), stale.len());
}

fn real(number: u32) -> Option<GaussianFrame> {
    let file = format!("../../shared/data/dynamic/lam_p2/frame_{number:04}.ply");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    Some(read_scene(&path, &ReadLimits::default()).unwrap())
}

/// A head that turns and speaks, rows kept and rows shuffled.
#[test]
fn a_real_head() {
    let (Some(first), Some(second)) = (real(0), real(8)) else { return };
    let steps = Quality::High.steps();
    let all = |frame: &GaussianFrame| (0..frame.len() as u32).collect::<Vec<_>>();
    let mut found = crate::sequence::Scene::new();
    [&first, &second].into_iter().for_each(|frame| found.add(frame, &all(frame)));
    let sequence = found.parameters(&Settings { steps, ..Settings::default() }, 2, 0, 0);
    let (grid, bits) = (PositionGrid::of(&sequence), sequence.position_bits);
    let step = sequence.position_step();
    let scene = |frame: &GaussianFrame| {
        let plane =
            |axis: usize| frame.position()[axis].iter().map(|&value| grid.steps(axis, value)).collect();
        Scene {
            position: [0, 1, 2].map(plane),
            log_scale: frame.log_scale().clone(),
            opacity: frame.opacity_logit().to_vec(),
            dc: frame.dc().clone(),
            row: Vec::new(),
        }
    };
    let (reference, kept) = (scene(&first), scene(&second));
    let rows = shuffled(0, second.len(), 7);
    for (target, kind) in [(kept.select(&rows), Kind::Untracked), (kept, Kind::Tracked)] {
        let (reference, target) = (reference.cloud(), target.cloud());
        let matching = follow(&reference, &target, &Measure { position_step: step, ..measure() }, bits);
        assert_eq!((matching.kind, shares_little(&matching)), (kind, false));
        assert!(matching.by_index + matching.by_nearest > 0.9, "{matching:?}");
        let (pairs, unmatched) = parted(&matching, &fine(&reference), &target);
        let motion = cell_motion(&pairs, &unmatched, bits);
        let (before, after) = (rms(&pairs, undisplaced), rms(&pairs, |fine| motion.displaced(fine)));
        println!(
            "{kind:?}: {} pairs, {before:.2} to {after:.2} steps, {} cells",
            pairs.len(),
            motion.cells.len()
        );
        assert!(after < 0.2 * before, "{before} {after}");
    }
}
