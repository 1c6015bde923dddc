//! Matching where things move further than their own size.

use super::pairs::{FEWEST, REACH_OF_SURE, largest, points};
use super::registration::registered;
use super::rigid::{Point, Vector};
use super::tree::Tree;
use crate::matching::{CLOSE, Cloud, LIMIT, Matching, Measure, Reach, by_index, features, links};
use crate::quantile::between_ends;

/// A round of guessing: the share of Gaussians that it looks at, one in so many, and how far it looks, as a part of
/// the scene's side. Few and large ones are hard to mistake for each other, even far from where they were.
const ROUNDS: [(usize, f32); 2] = [(32, 1.0 / 12.0), (8, 1.0 / 48.0)];

/// How often pairs that are hardly mistaken are sought, and improve the guess, before others are.
const SURE: usize = 2;

/// Pairs that a cell of a guess rests on, at least, on average.
const PAIRS_IN_CELL: usize = 16;

/// Pairs by row, then by place and attributes about where a guess of the motion expects them.
pub(crate) fn follow(
    reference: &Cloud<'_>,
    target: &Cloud<'_>,
    measure: &Measure,
    position_bits: u8,
) -> Matching {
    let mut matching = by_index(reference, target, measure);
    let (free, wanted) = (matching.free(), matching.wanted(target.len()));
    if free.is_empty() || wanted.is_empty() {
        return matching;
    }
    let mut guess = reference.position.map(<[f32]>::to_vec);
    if free.len().min(wanted.len()) >= FEWEST {
        let side = side(target);
        if let Some(places) = registered(reference, target, (&free, &wanted), measure, side) {
            guess = places;
        }
        for (part, reach) in ROUNDS {
            let expected = Cloud { position: guess.each_ref().map(Vec::as_slice), ..*reference };
            let reach = Reach { scales: 0.0, least: reach * side };
            let (from, to) = (largest(reference, &free, part), largest(target, &wanted, part));
            let found = links(&features(&expected, &from, measure), &features(target, &to, measure), reach);
            guess = expected_places(reference, &points(reference, target, &found), position_bits);
        }
        let mut found = Vec::new();
        for _ in 0..SURE {
            let expected = Cloud { position: guess.each_ref().map(Vec::as_slice), ..*reference };
            found.extend(matching.add_nearest(&expected, target, measure, REACH_OF_SURE, CLOSE));
            guess = expected_places(reference, &points(reference, target, &found), position_bits);
        }
    }
    let expected = Cloud { position: guess.each_ref().map(Vec::as_slice), ..*reference };
    matching.add_ordered(&expected, target, measure);
    let expected = Cloud { position: guess.each_ref().map(Vec::as_slice), ..*reference };
    matching.add_nearest(&expected, target, measure, REACH_OF_SURE, LIMIT);
    matching
}

/// Where the reference's Gaussians are if they move as the points about them.
#[expect(clippy::indexing_slicing, reason = "rows are those of the cloud; ranges of nodes lie in the list")]
#[expect(clippy::arithmetic_side_effects, reason = "counts of points; parts are constants")]
fn expected_places(reference: &Cloud<'_>, points: &[Point], position_bits: u8) -> [Vec<f32>; 3] {
    let all: Vec<Vector> =
        (0..reference.len() as u32).map(|index| reference.at(index).map(f64::from)).collect();
    let mut tree = Tree::new(points, &all, position_bits);
    while tree.cell_log2 > 0 && tree.nodes.len() * PAIRS_IN_CELL < points.len() {
        tree.split();
    }
    let mut indices = [0, 1, 2].map(|_: usize| vec![0.0; all.len()]);
    for node in &tree.nodes {
        for &(position, index) in &tree.others[node.others.clone()] {
            let moved = node.motion.apply(position);
            for (plane, value) in indices.iter_mut().zip(moved) {
                plane[index as usize] = value as f32;
            }
        }
    }
    indices
}

/// The largest side of the box that holds the inner 90 % on each axis, grid steps.
fn side(cloud: &Cloud<'_>) -> f32 {
    let of_axis = |plane: &[f32]| {
        let mut values = plane.to_vec();
        let mut at = |percent| between_ends(&mut values, percent, f32::total_cmp).unwrap_or_default();
        at(95) - at(5)
    };
    cloud.position.map(of_axis).into_iter().fold(0.0, f32::max)
}
