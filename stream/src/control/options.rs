//! What can be done with one GOP: the operating points that are worth their bytes, and the order of their pieces.

use super::ladder::{Gop, Point};
use super::levels::Levels;
use super::number::{real, seconds};

/// What a device can take, besides what the network can carry. The base of a GOP is played whatever it needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Gaussians of a frame.
    pub gaussians: u64,
    /// Gaussians that can be decoded in a second, those of all frames together.
    pub gaussians_per_second: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { gaussians: u64::MAX, gaussians_per_second: u64::MAX }
    }
}

impl Limits {
    /// Whether a device with these limits plays a point of a GOP.
    pub fn allow(&self, point: &Point, gop: &Gop) -> bool {
        let decoded = real(point.gaussians) * f64::from(point.frames);
        point.gaussians <= self.gaussians
            && decoded <= real(self.gaussians_per_second) * seconds(gop.duration_us())
    }
}

/// One thing that can be done with a GOP.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The pieces that are there afterwards.
    pub levels: Levels,
    /// Bytes to fetch; 0 for leaving the GOP as it is.
    pub bytes: u64,
    /// Quality of the GOP afterwards, in dB.
    pub quality: f64,
}

/// The choices for a GOP of which some pieces have arrived: the upper convex hull of quality over missing bytes. The first
/// is to leave it or, if it cannot be played yet, to fetch its base; each further one costs more bytes, and its gain in
/// quality per byte is less than that of the one before.
pub fn choices(gop: &Gop, arrived: &Levels, limits: &Limits) -> Vec<Choice> {
    available_choices(gop, arrived, &Levels::all(gop.representations()), limits)
}

/// The same, where only some pieces can be had.
pub(crate) fn available_choices(
    gop: &Gop,
    arrived: &Levels,
    available: &Levels,
    limits: &Limits,
) -> Vec<Choice> {
    let allowed = |(index, point): &(usize, &Point)| {
        available.contains(&point.levels) && (*index == 0 || limits.allow(point, gop))
    };
    let there = gop.playable(arrived).map(|point| Choice {
        levels: arrived.clone(),
        bytes: 0,
        quality: point.quality,
    });
    let mut found: Vec<Choice> = there.into_iter().collect();
    found.extend(gop.points().iter().enumerate().filter(allowed).map(|(_, point)| Choice {
        levels: arrived.union(&point.levels),
        bytes: gop.missing_bytes(&point.levels, arrived),
        quality: point.quality,
    }));
    hull(found)
}

/// Those of some choices that lie on the upper convex hull of quality over bytes, from the one with fewest bytes.
pub(crate) fn hull(mut found: Vec<Choice>) -> Vec<Choice> {
    found.sort_by(|a, b| a.bytes.cmp(&b.bytes).then(b.quality.total_cmp(&a.quality)));
    let mut hull: Vec<Choice> = Vec::new();
    for choice in found {
        if hull.last().is_some_and(|last| choice.quality <= last.quality) {
            continue;
        }
        while let [.., before, last] = hull.as_slice() {
            if gain(before, last) > gain(last, &choice) {
                break;
            }
            hull.pop();
        }
        hull.push(choice);
    }
    hull
}

/// Quality per byte from one choice to one with more bytes.
pub(crate) fn gain(from: &Choice, to: &Choice) -> f64 {
    (to.quality - from.quality) / real(to.bytes.saturating_sub(from.bytes).max(1))
}

/// Refinements of one Representation of a GOP that lie together: one byte range.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Range {
    /// Index of the Representation.
    pub representation: usize,
    /// First refinement.
    pub from: u8,
    /// Refinement after the last.
    pub to: u8,
    /// Where it begins in the bytes that the Representation has for the GOP.
    pub offset: u64,
    /// Length.
    pub bytes: u64,
}

/// The order in which missing pieces are fetched: the base first, then always towards the point that gains most quality per
/// byte, each piece after those it needs. So whatever prefix arrives is worth as much as it can be.
pub fn order(gop: &Gop, arrived: &Levels, wanted: &Levels) -> Vec<Range> {
    let mut ranges = Vec::new();
    let mut levels = arrived.clone();
    while let Some(next) = best_step(gop, &levels, wanted) {
        append(gop, &mut levels, &next, &mut ranges);
    }
    append(gop, &mut levels, wanted, &mut ranges);
    ranges
}

/// The same pieces with one range for each Representation, in the order of Representations: fewer requests, where there is
/// time for all of them.
pub fn whole_ranges(gop: &Gop, arrived: &Levels, wanted: &Levels) -> Vec<Range> {
    let mut ranges = Vec::new();
    for representation in 0..gop.representations() {
        let mut levels = arrived.clone();
        let mut own = arrived.clone();
        own.raise(representation, wanted.of(representation));
        append(gop, &mut levels, &own, &mut ranges);
    }
    ranges
}

/// The pieces of the point that gains most per byte among those within what is wanted.
fn best_step(gop: &Gop, levels: &Levels, wanted: &Levels) -> Option<Levels> {
    let Some(current) = gop.playable(levels) else {
        return gop.points().first().map(|base| base.levels.clone()).filter(|base| wanted.contains(base));
    };
    let better = |point: &&Point| point.quality > current.quality && wanted.contains(&point.levels);
    let worth = |point: &Point| {
        (point.quality - current.quality) / real(gop.missing_bytes(&point.levels, levels).max(1))
    };
    let best = gop.points().iter().filter(better).max_by(|a, b| worth(a).total_cmp(&worth(b)))?;
    Some(best.levels.clone())
}

/// Appends what is missing of a point, refinement by refinement, so that each piece stands after those it needs.
fn append(gop: &Gop, levels: &mut Levels, wanted: &Levels, ranges: &mut Vec<Range>) {
    for refinement in 0..16_u8 {
        for representation in 0..gop.representations() {
            let missing = levels.of(representation) == refinement && wanted.of(representation) > refinement;
            let piece = gop.pieces(representation).get(usize::from(refinement));
            let Some(piece) = piece.filter(|_| missing) else { continue };
            let to = refinement.saturating_add(1);
            levels.raise(representation, to);
            match ranges.last_mut() {
                Some(last) if last.representation == representation && last.to == refinement => {
                    last.to = to;
                    last.bytes = last.bytes.saturating_add(piece.bytes);
                }
                _ => {
                    let before = gop.pieces(representation).iter().take(usize::from(refinement));
                    let offset = before.map(|piece| piece.bytes).fold(0, u64::saturating_add);
                    ranges.push(Range { representation, from: refinement, to, offset, bytes: piece.bytes });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ladder::{Description, Ladder, Layer, OperatingPoint, Piece, Representation};
    use super::*;

    /// I frames and P frames of two refinements; the qualities are those of s0,i,r0 to s0,t0,r1.
    fn gop(qualities: [f64; 4]) -> Gop {
        let representations = vec![
            Representation { layer: Layer::Spatial(0), needs: vec![] },
            Representation { layer: Layer::Temporal(0), needs: vec![0] },
        ];
        let pieces = |bytes: [u64; 2]| bytes.map(|bytes| Piece { bytes, gaussians: bytes }).to_vec();
        let names = [(None, 0), (Some(0), 0), (None, 1), (Some(0), 1)];
        let named = |((temporal, refinement), quality)| {
            (OperatingPoint { spatial: 0, temporal, refinement }, quality)
        };
        let mut ladder = Ladder::new(representations).expect("they are in order");
        let description = Description {
            duration_us: 1_000_000,
            frames: vec![1, 9],
            pieces: vec![pieces([100, 200]), pieces([400, 800])],
            quality: names.into_iter().zip(qualities).map(named).collect(),
        };
        ladder.push(description).expect("it is complete");
        ladder.gops()[0].clone()
    }

    #[test]
    fn choices_are_the_hull_of_what_is_missing() {
        let gop = gop([20.0, 30.0, 22.0, 36.0]);
        let costs = |choices: Vec<Choice>| {
            choices.iter().map(|choice| (choice.bytes, choice.quality)).collect::<Vec<_>>()
        };
        let none = Levels::none(2);
        // 300 bytes for 22 dB lie below the line from 100 to 500.
        assert_eq!(costs(choices(&gop, &none, &Limits::default())), [(100, 20.0), (500, 30.0), (1500, 36.0)]);
        let mut intra = none.clone();
        intra.raise(0, 2);
        assert_eq!(costs(choices(&gop, &intra, &Limits::default())), [(0, 22.0), (400, 30.0), (1200, 36.0)]);
        let limits = Limits { gaussians: 400, ..Limits::default() };
        assert_eq!(costs(choices(&gop, &none, &limits)), [(100, 20.0), (500, 30.0)]);
    }

    #[test]
    fn pieces_come_base_first_and_then_by_gain_per_byte() {
        let ranges = |gop: &Gop| {
            let mut all = Levels::none(2);
            all.raise(0, 2);
            all.raise(1, 2);
            let ranges = order(gop, &Levels::none(2), &all);
            ranges
                .iter()
                .map(|range| (range.representation, range.from, range.to, range.offset, range.bytes))
                .collect::<Vec<_>>()
        };
        let moving = [(0, 0, 1, 0, 100), (1, 0, 1, 0, 400), (0, 1, 2, 100, 200), (1, 1, 2, 400, 800)];
        assert_eq!(ranges(&gop([20.0, 30.0, 22.0, 36.0])), moving);
        // Here a better I frame is worth more than motion.
        let still = [(0, 0, 2, 0, 300), (1, 0, 2, 0, 1200)];
        assert_eq!(ranges(&gop([20.0, 22.0, 30.0, 36.0])), still);
    }

    #[test]
    fn whole_ranges_are_one_for_each_representation() {
        let gop = gop([20.0, 30.0, 22.0, 36.0]);
        let (mut arrived, mut wanted) = (Levels::none(2), Levels::none(2));
        arrived.raise(0, 1);
        wanted.raise(0, 2);
        wanted.raise(1, 2);
        let ranges = whole_ranges(&gop, &arrived, &wanted);
        let ranges: Vec<_> =
            ranges.iter().map(|range| (range.representation, range.offset, range.bytes)).collect();
        assert_eq!(ranges, [(0, 100, 200), (1, 0, 1200)]);
    }
}
