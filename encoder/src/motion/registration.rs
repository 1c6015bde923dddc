//! The motion of a whole frame, found before pairs are sought: a camera that moved, a scene that was scaled.
//!
//! Two clouds of one scene have nearly the same median and spread. The cloud of the reference is brought onto that of
//! the target by these first; pairs that are hardly mistaken then correct the guess, as a similarity that few wrong
//! pairs do not disturb.

use super::pairs::{REACH_OF_SURE, largest, points};
use super::rigid::{Point, Rigid, Vector, median, minus, plus};
use crate::matching::{CLOSE, Cloud, Measure, Reach, features, links};

/// One in so many Gaussians is looked at.
const PART: usize = 8;

/// Rounds of pairs: how far they look, as a part of the scene's side.
const ROUNDS: [f32; 4] = [1.0 / 12.0, 1.0 / 24.0, 1.0 / 48.0, 1.0 / 96.0];

/// A guess is needed where fewer than this share of the Gaussians have a close partner without it.
const ENOUGH: f32 = 0.5;

/// Arms shorter than this part of the side say nothing about scale.
const ARM: f64 = 1.0 / 16.0;

/// The largest change of scale of one correction, and of the first guess.
const SCALES: core::ops::RangeInclusive<f64> = 0.5..=2.0;

/// Places of a reference's Gaussians, grid steps.
pub(super) type Places = [Vec<f32>; 3];

/// Where the reference's Gaussians are if the frame moves as a whole; none where that explains no more than that
/// nothing moves. `free` and `wanted` have no partner yet; `side` is that of the scene.
pub(super) fn registered(
    reference: &Cloud<'_>,
    target: &Cloud<'_>,
    (free, wanted): (&[u32], &[u32]),
    measure: &Measure,
    side: f32,
) -> Option<Places> {
    let (from, to) = (largest(reference, free, PART), largest(target, wanted, PART));
    let still: Places = reference.position.map(<[f32]>::to_vec);
    let pairs = |guess: &Places, reach: Reach| -> (f32, Vec<Point>) {
        let expected = Cloud { position: guess.each_ref().map(Vec::as_slice), ..*reference };
        let mut found = links(&features(&expected, &from, measure), &features(target, &to, measure), reach);
        found.retain(|link| link.cost <= CLOSE);
        (found.len() as f32 / from.len().max(1) as f32, points(&expected, target, &found))
    };
    let (at_rest, _) = pairs(&still, REACH_OF_SURE);
    if at_rest >= ENOUGH {
        return None;
    }
    let mut guess = overlaid(still, target, (&from, &to));
    for part in ROUNDS {
        let (_, found) = pairs(&guess, Reach { scales: 0.0, least: part * side });
        correct(&mut guess, &found, f64::from(side));
    }
    (pairs(&guess, REACH_OF_SURE).0 > at_rest).then_some(guess)
}

/// A reference shifted and scaled so that median and spread of these of its Gaussians are those of the target's.
#[expect(clippy::indexing_slicing, reason = "rows are those of the clouds; axes are constants")]
fn overlaid(mut places: Places, target: &Cloud<'_>, (from, to): (&[u32], &[u32])) -> Places {
    let shape = |planes: [&[f32]; 3], indices: &[u32]| -> (Vector, f64) {
        let at = |index: u32| planes.map(|plane| f64::from(plane[index as usize]));
        let middle = [0, 1, 2].map(|axis: usize| median(indices.iter().map(|&index| at(index)[axis])));
        (middle, median(indices.iter().map(|&index| length(minus(at(index), middle)))))
    };
    let (middle, spread) = shape(places.each_ref().map(Vec::as_slice), from);
    let (to_middle, to_spread) = shape(target.position, to);
    let scale = if spread > 0.0 { to_spread / spread } else { 1.0 };
    let scale = scale.clamp(*SCALES.start(), *SCALES.end());
    map(&mut places, |place| plus(to_middle, minus(place, middle).map(|part| scale * part)));
    places
}

/// Corrects places by a similarity that brings points to where they went.
#[expect(clippy::indexing_slicing, reason = "rows are those of the clouds; axes are constants")]
fn correct(places: &mut Places, points: &[Point], side: f64) {
    let motion = Rigid::STILL.refined(points, side);
    let middle = [0, 1, 2].map(|axis: usize| median(points.iter().map(|point| point.from[axis])));
    let moved = motion.apply(middle);
    let ratio = |point: &Point| {
        let arm = length(minus(point.from, middle));
        (arm > ARM * side).then(|| length(minus(point.to, moved)) / arm)
    };
    let ratios: Vec<f64> = points.iter().filter_map(ratio).collect();
    let scale = if ratios.is_empty() {
        1.0
    } else {
        median(ratios.into_iter()).clamp(*SCALES.start(), *SCALES.end())
    };
    map(places, |place| plus(moved, minus(motion.apply(place), moved).map(|part| scale * part)));
}

fn map(places: &mut Places, to: impl Fn(Vector) -> Vector) {
    let [xs, ys, zs] = places;
    for ((x, y), z) in xs.iter_mut().zip(ys).zip(zs) {
        let place = to([*x, *y, *z].map(f64::from));
        [*x, *y, *z] = place.map(|part| part as f32);
    }
}

fn length(d: Vector) -> f64 {
    d.iter().map(|part| part * part).sum::<f64>().sqrt()
}
