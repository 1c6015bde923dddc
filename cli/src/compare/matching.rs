//! Which Gaussian of one frame is which of another.

use super::Match;
use super::errors::rotation_difference;
use super::grid::{Grid, inner_box};
use rayon::prelude::*;
use serde::Serialize;
use splatstream_chart::quantile::ranked;
use splatstream_gaussians::GaussianFrame;

/// How the Gaussians of a frame were matched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Matching {
    /// The first with the first, and so on.
    Order,
    /// By position.
    Nearest,
}

/// In order, half the Gaussians are closer than this share of the scene's longest side: well above any
/// quantiser step, well below the distance of two Gaussians drawn at random.
const CORRESPONDS: f32 = 1.0 / 256.0;

/// The partner in `large` of every Gaussian of `small`, which has no more Gaussians. Both in canonical form.
pub(super) fn partners(small: &GaussianFrame, large: &GaussianFrame, choice: Match) -> (Matching, Vec<u32>) {
    let in_order = match choice {
        Match::Order => true,
        Match::Nearest => false,
        Match::Auto => small.len() == large.len() && corresponds(small, large),
    };
    if in_order {
        return (Matching::Order, (0..small.len() as u32).collect());
    }
    (Matching::Nearest, nearest(small, large))
}

/// Whether two frames of equal counts have their Gaussians in the same order.
fn corresponds(a: &GaussianFrame, b: &GaussianFrame) -> bool {
    let [low, high] = inner_box(a.position().each_ref().map(Vec::as_slice));
    let longest = low.iter().zip(high).map(|(low, high)| high - low).fold(0.0, f32::max);
    let squared = |row: usize| -> f32 {
        let (a, b) = (position(a, row), position(b, row));
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
    };
    let mut distances: Vec<f32> = (0..a.len()).map(squared).collect();
    median(&mut distances).sqrt() <= longest * CORRESPONDS
}

/// Partners by position. Positions of a decoded frame are rounded, so that of several Gaussians about as near
/// as rounding would put the true one, the most alike is taken.
fn nearest(small: &GaussianFrame, large: &GaussianFrame) -> Vec<u32> {
    let grid = Grid::new(large.position().each_ref().map(Vec::as_slice));
    let closest: Vec<(u32, f32)> = (0..small.len())
        .into_par_iter()
        .map(|row| {
            grid.nearest(position(small, row)).map_or((0, 0.0), |found| (found.index, found.squared.sqrt()))
        })
        .collect();
    let mut distances: Vec<f32> = closest.iter().map(|&(_, distance)| distance).collect();
    // Rounding to a grid moves the median point by 0.48 of its step and no point by more than 0.87.
    let rounding = 2.0 * median(&mut distances);
    closest
        .into_par_iter()
        .enumerate()
        .map(|(row, (index, distance))| {
            let mut best = (f32::INFINITY, f32::INFINITY, index);
            grid.within(position(small, row), rounding.max(distance), &mut |found| {
                let unlike = dissimilarity(small, row, large, found.index as usize);
                let key = (unlike, found.squared, found.index);
                if key.partial_cmp(&best).is_some_and(std::cmp::Ordering::is_lt) {
                    best = key;
                }
            });
            best.2
        })
        .collect()
}

/// How dissimilar two Gaussians are apart from their positions: squared differences, in about the units in which
/// each attribute shows.
fn dissimilarity(a: &GaussianFrame, row: usize, b: &GaussianFrame, partner: usize) -> f32 {
    let planes = |a: &[Vec<f32>; 3], b: &[Vec<f32>; 3]| -> f32 {
        a.iter().zip(b).map(|(a, b)| (a[row] - b[partner]) * (a[row] - b[partner])).sum()
    };
    let opacity = a.opacity_logit()[row] - b.opacity_logit()[partner];
    let rotation = |frame: &GaussianFrame, row: usize| frame.rotation().each_ref().map(|plane| plane[row]);
    let between = rotation_difference(rotation(a, row), rotation(b, partner));
    planes(a.log_scale(), b.log_scale())
        + planes(a.dc(), b.dc())
        + opacity * opacity
        + between.iter().map(|part| part * part).sum::<f32>()
}

fn position(frame: &GaussianFrame, row: usize) -> [f32; 3] {
    frame.position().each_ref().map(|plane| plane[row])
}

/// 0 of nothing.
fn median(values: &mut [f32]) -> f32 {
    ranked(values, 50, f32::total_cmp).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    fn scene() -> GaussianFrame {
        BuiltinScene { gaussians: 500, sh_degree: 0, ..BuiltinScene::default() }.frame(0)
    }

    #[test]
    fn a_frame_in_another_order_finds_itself() {
        let frame = scene();
        let backwards: Vec<u32> = (0..frame.len() as u32).rev().collect();
        let (matching, found) = partners(&frame.select(&backwards), &frame, Match::Auto);
        assert_eq!((matching, found), (Matching::Nearest, backwards));
        assert_eq!(partners(&frame, &frame, Match::Auto).0, Matching::Order);
    }

    #[test]
    fn of_two_gaussians_in_one_place_the_like_one_is_the_partner() {
        let mut planes = scene().select(&[0, 1, 2]).into_planes();
        for plane in &mut planes.position {
            plane[1] = plane[0];
        }
        planes.opacity_logit = vec![3.0, -3.0, 0.0];
        let frame = GaussianFrame::from_planes(0, planes).unwrap();
        let (_, found) = partners(&frame.select(&[1, 0]), &frame, Match::Nearest);
        assert_eq!(found, [1, 0]);
    }

    #[test]
    fn frames_without_gaussians_have_no_partners() {
        let none = scene().select(&[]);
        assert_eq!(partners(&none, &scene(), Match::Auto).1, Vec::<u32>::new());
        assert_eq!(partners(&none, &none, Match::Auto).1, Vec::<u32>::new());
    }
}
