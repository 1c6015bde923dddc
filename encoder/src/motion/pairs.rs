//! The pairs that a guess of a motion rests on.

use super::rigid::Point;
use crate::matching::{Cloud, Link, Reach};

/// Below this many Gaussians on either side a guess rests on nothing.
pub(super) const FEWEST: usize = 256;

/// How far from where it is expected a Gaussian may be: three times its size, or as far as rounding alone may put it.
pub(super) const REACH_OF_SURE: Reach = Reach { scales: 3.0, least: 4.0 };

/// Where Gaussians were and where they are now.
pub(super) fn points(reference: &Cloud<'_>, target: &Cloud<'_>, links: &[Link]) -> Vec<Point> {
    let point = |link: &Link| Point {
        from: reference.at(link.from).map(f64::from),
        to: target.at(link.to).map(f64::from),
    };
    links.iter().map(point).collect()
}

/// One in `part` of these, those that cover most.
#[expect(clippy::indexing_slicing, reason = "rows are those of the cloud; ranges of nodes lie in the list")]
#[expect(clippy::arithmetic_side_effects, reason = "counts of points; parts are constants")]
pub(super) fn largest(cloud: &Cloud<'_>, indices: &[u32], part: usize) -> Vec<u32> {
    let mut ranked: Vec<(f32, u32)> = indices.iter().map(|&index| (-cloud.coverage(index), index)).collect();
    ranked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let kept = (indices.len() / part).max(FEWEST).min(indices.len());
    ranked[..kept].iter().map(|&(_, index)| index).collect()
}
