//! Pairs by order: rows that come and go between others that stay.
//!
//! A capture that leaves out what cannot be seen writes the same Gaussians in the same order in every frame, and no row
//! keeps its number. Whether a file is of that kind is seen from pairs that are hardly mistaken: the longest run of
//! them whose rows grow in both files holds nearly all of them, while of rows in another order it holds few. What lies
//! between two of the run is then aligned as texts are: in order, for the fewest bits.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "places in the two lists, whose product is at most MOST_PAIRS"
)]
#![expect(clippy::indexing_slicing, reason = "places in the two lists and in the table of their lengths")]

use super::nearest::{Feature, apart_bits, features};
use super::{Cloud, Kind, Matching, Measure};

/// Share of pairs, in quarters, that must be in order for all rows to be.
const ORDER_QUARTERS: usize = 3;

/// Below this many pairs order is chance.
const FEWEST: usize = 64;

/// A pair is no pair where its differences take more bits than this, nearly: about half of what a new Gaussian takes.
const MOST_BITS: f32 = 36.0;

/// Gaps with more possible pairs than this are left to the search by place.
const MOST_PAIRS: usize = 1 << 14;

impl Matching {
    /// Pairs what is left by order, if rows keep theirs; pairs that are out of order are parted before. `reference` is where
    /// its Gaussians are expected.
    pub(crate) fn add_ordered(&mut self, reference: &Cloud<'_>, target: &Cloud<'_>, measure: &Measure) {
        let (from, to) = (by_row(reference), by_row(target));
        let Some(anchors) = self.anchors(&from, &to) else { return };
        let larger = reference.len().max(target.len()).max(1) as f32;
        if self.kind == Kind::Untracked {
            self.kind = Kind::Partly;
        }
        self.target_of.fill(None);
        anchors.iter().for_each(|&(a, b)| self.target_of[from[a] as usize] = Some(to[b]));
        let mut start = (0, 0);
        let mut added = 0;
        for (a, b) in anchors.into_iter().chain([(from.len(), to.len())]) {
            let (gap, other) = (&from[start.0..a], &to[start.1..b]);
            if gap.len() * other.len() <= MOST_PAIRS {
                let [gap, other] = [features(reference, gap, measure), features(target, other, measure)];
                for (a, b) in aligned(&gap, &other) {
                    self.target_of[gap[a].index as usize] = Some(other[b].index);
                    added += 1;
                }
            }
            start = (a + 1, b + 1);
        }
        self.by_index += added as f32 / larger;
    }

    /// Places of pairs in the order of rows, of which both grow; none if too few do.
    fn anchors(&self, from: &[u32], to: &[u32]) -> Option<Vec<(usize, usize)>> {
        let mut place = vec![0; to.len()];
        to.iter().enumerate().for_each(|(at, &index)| place[index as usize] = at);
        let of = |(at, &index): (usize, &u32)| Some((at, place[self.target_of[index as usize]? as usize]));
        let pairs: Vec<(usize, usize)> = from.iter().enumerate().filter_map(of).collect();
        let kept = growing(&pairs);
        let is_order = kept.len() >= FEWEST && 4 * kept.len() >= ORDER_QUARTERS * pairs.len();
        is_order.then_some(kept)
    }
}

/// Indices in the order of rows.
fn by_row(cloud: &Cloud<'_>) -> Vec<u32> {
    cloud.by_row().into_iter().map(|(_, index)| index).collect()
}

/// The most pairs of which the second grows with the first: the longest increasing subsequence.
fn growing(pairs: &[(usize, usize)]) -> Vec<(usize, usize)> {
    // For each length the pair that ends such a run lowest, and for each pair the one before it.
    let mut ends: Vec<usize> = Vec::new();
    let mut before = vec![usize::MAX; pairs.len()];
    for (at, &(_, to)) in pairs.iter().enumerate() {
        let length = ends.partition_point(|&end| pairs[end].1 < to);
        if length > 0 {
            before[at] = ends[length - 1];
        }
        match ends.get_mut(length) {
            Some(end) => *end = at,
            None => ends.push(at),
        }
    }
    let mut kept = Vec::with_capacity(ends.len());
    let mut at = ends.last().copied().unwrap_or(usize::MAX);
    while let Some(&pair) = pairs.get(at) {
        kept.push(pair);
        at = before[at];
    }
    kept.reverse();
    kept
}

/// Pairs of two short runs, in order: those that save the most bits beside two Gaussians that have no partner.
fn aligned(from: &[Feature], to: &[Feature]) -> Vec<(usize, usize)> {
    if from.is_empty() || to.is_empty() {
        return Vec::new();
    }
    let width = to.len() + 1;
    // What pairs of the first of both save, at most.
    let mut saved = vec![0.0_f32; (from.len() + 1) * width];
    let gain = |a: usize, b: usize| MOST_BITS - apart_bits(&from[a], &to[b]);
    for a in 0..from.len() {
        for b in 0..to.len() {
            let paired = saved[a * width + b] + gain(a, b);
            let alone = saved[a * width + b + 1].max(saved[(a + 1) * width + b]);
            saved[(a + 1) * width + b + 1] = paired.max(alone);
        }
    }
    let mut pairs = Vec::new();
    let (mut a, mut b) = (from.len(), to.len());
    while a > 0 && b > 0 {
        let now = saved[a * width + b];
        if now == saved[(a - 1) * width + b] {
            a -= 1;
        } else if now == saved[a * width + b - 1] {
            b -= 1;
        } else {
            (a, b) = (a - 1, b - 1);
            pairs.push((a, b));
        }
    }
    pairs.reverse();
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_pairs_in_order_are_kept() {
        let pairs = [(0, 3), (1, 0), (2, 1), (3, 9), (4, 2), (5, 4)];
        assert_eq!(growing(&pairs), [(1, 0), (2, 1), (4, 2), (5, 4)]);
        assert_eq!(growing(&[]), []);
    }
}
