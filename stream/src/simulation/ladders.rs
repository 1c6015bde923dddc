//! Presentations to simulate with: sizes as they were measured, which vary slowly by up to a third. Qualities follow the
//! course of table 2 of the paper over refinements; a frame that stands still in place of a B frame is taken to cost 1.5 dB
//! and, where only I frames are played, 8 dB.

use crate::control::{Description, Ladder, Layer, OperatingPoint, Piece, Representation};

/// Shares of the bytes of a frame that its refinements add, in hundredths: 10, 20, 30, 50 and 100 % of the Gaussians.
const SHARES: [u64; 5] = [12, 10, 10, 20, 48];

/// What is lost at each refinement, in dB.
const LOSSES: [f64; 5] = [9.5, 7.8, 6.4, 4.5, 0.0];

/// A room of 56,000 Gaussians as this codec codes it: two spatial layers, P and B frames, five refinements, a GOP of 30
/// frames a second, from 0.3 to 22 Mbit/s.
pub fn small(gops: usize) -> Ladder {
    nested(gops, 1, 20)
}

/// A scene of 1,120,000 Gaussians: all is twenty times as large, up to 440 Mbit/s.
pub fn large(gops: usize) -> Ladder {
    nested(gops, 20, 21)
}

fn nested(gops: usize, times: u64, seed: u64) -> Ladder {
    let needs = [vec![], vec![0], vec![0, 1], vec![0, 1, 2]];
    let bytes = [280_000, 160_000, 1_260_000, 1_050_000].map(|bytes: u64| bytes.saturating_mul(times));
    let gaussians = [40_000, 16_000, 56_000, 56_000].map(|count: u64| count.saturating_mul(times));
    let layers = [Layer::Spatial(0), Layer::Spatial(1), Layer::Temporal(0), Layer::Temporal(1)];
    let shape = Shape { bytes: &bytes, gaussians: &gaussians, frames: &[1, 0, 14, 15], whole_anchor: false };
    let quality: Vec<(OperatingPoint, f64)> = points(2)
        .map(|point| {
            let spatial = if point.spatial == 0 { 3.0 } else { 0.0 };
            (point, 36.0 - spatial - still(point.temporal) - loss(point.refinement))
        })
        .collect();
    build(gops, seed, &layers, &needs, &shape, &quality)
}

/// The paper's scene `bartender`, with its sizes: three spatial layers, of which P and B frames need all, I frames without
/// refinements, and GOPs of 30 frames a second: from 110 to 1,500 Mbit/s.
pub fn paper(gops: usize) -> Ladder {
    let needs = [vec![], vec![0], vec![0, 1], vec![0, 1, 2], vec![0, 1, 2, 3]];
    let layers =
        [Layer::Spatial(0), Layer::Spatial(1), Layer::Spatial(2), Layer::Temporal(0), Layer::Temporal(1)];
    let shape = Shape {
        bytes: &[13_800_000, 3_760_000, 4_190_000, 82_000_000, 84_000_000],
        gaussians: &[278_127, 14_453, 55_480, 421_000, 421_000],
        frames: &[1, 0, 0, 14, 15],
        whole_anchor: true,
    };
    let quality: Vec<(OperatingPoint, f64)> = points(3)
        .map(|point| {
            let intra = match point.spatial {
                0 => 30.45,
                1 => 33.15,
                _ => 34.12,
            };
            let moving = 32.34 - still(point.temporal) - loss(point.refinement);
            (point, if point.temporal.is_none() { intra - 12.0 } else { moving })
        })
        .collect();
    build(gops, 22, &layers, &needs, &shape, &quality)
}

/// Bytes, Gaussians and frames of the Representations of a GOP.
struct Shape<'a> {
    bytes: &'a [u64],
    gaussians: &'a [u64],
    frames: &'a [u32],
    /// Whether I frames have no refinements.
    whole_anchor: bool,
}

fn points(spatial: u8) -> impl Iterator<Item = OperatingPoint> {
    let temporal = [None, Some(0), Some(1)];
    let names = move |refinement| {
        (0..spatial).flat_map(move |spatial| {
            temporal.into_iter().map(move |temporal| OperatingPoint { spatial, temporal, refinement })
        })
    };
    (0..5).flat_map(names)
}

fn still(temporal: Option<u8>) -> f64 {
    match temporal {
        None => 8.0,
        Some(0) => 1.5,
        Some(_) => 0.0,
    }
}

fn loss(refinement: u8) -> f64 {
    LOSSES.get(usize::from(refinement)).copied().unwrap_or(0.0)
}

/// GOPs between two of which the course of sizes is straight.
const STRAIGHT: usize = 8;

/// From 0 to 666: where a GOP stands on its course.
fn course(seed: u64, index: usize) -> u64 {
    let turn = |number: usize| {
        let mut random = seed.wrapping_add(u64::try_from(number).unwrap_or(0));
        for _ in 0..3 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            random ^= random >> 29;
        }
        (random >> 40) % 667
    };
    let number = index.div_euclid(STRAIGHT);
    let part = u64::try_from(index.rem_euclid(STRAIGHT)).unwrap_or(0);
    let steps = u64::try_from(STRAIGHT).unwrap_or(1);
    let (from, to) = (turn(number), turn(number.saturating_add(1)));
    from.saturating_mul(steps.saturating_sub(part)).saturating_add(to.saturating_mul(part)).div_euclid(steps)
}

fn build(
    gops: usize,
    seed: u64,
    layers: &[Layer],
    needs: &[Vec<usize>],
    shape: &Shape<'_>,
    quality: &[(OperatingPoint, f64)],
) -> Ladder {
    let representations = layers.iter().zip(needs);
    let representations =
        representations.map(|(&layer, needs)| Representation { layer, needs: needs.clone() }).collect();
    let Ok(mut ladder) = Ladder::new(representations) else { unreachable!("dependencies are in order") };
    for index in 0..gops {
        // From 2/3 to 4/3 of the sizes, and up to 1.5 dB more or less, which change slowly.
        let scale = course(seed, index);
        let more = f64::from(u32::try_from(scale).unwrap_or(0)) / 333.0 - 1.0;
        let sized = |bytes: u64| bytes.saturating_mul(scale.saturating_add(667)) / 1000;
        let pieces =
            layers.iter().zip(shape.bytes).zip(shape.gaussians).map(|((layer, &bytes), &gaussians)| {
                let whole = shape.whole_anchor && matches!(layer, Layer::Spatial(_));
                let shares: &[u64] = if whole { &[100] } else { &SHARES };
                let part = |all: u64, share: u64| all.saturating_mul(share) / 100;
                let piece =
                    |&share| Piece { bytes: part(sized(bytes), share), gaussians: part(gaussians, share) };
                shares.iter().map(piece).collect()
            });
        let description = Description {
            duration_us: 1_000_000,
            frames: shape.frames.to_vec(),
            pieces: pieces.collect(),
            quality: quality.iter().map(|&(point, quality)| (point, quality - 1.5 * more)).collect(),
        };
        if ladder.push(description).is_err() {
            unreachable!("descriptions are complete");
        }
    }
    ladder
}
