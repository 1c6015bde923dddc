//! Removes the Gaussians of a frame one after the other, those first that pictures miss least.
//!
//! What pictures lose without a Gaussian says nothing of what they lose without its neighbours as well: where many overlap,
//! pictures miss each of them little, but all of them together would leave a hole. So what is lost without a Gaussian rises as
//! its neighbours are removed, from what is lost without it alone to what it would show before a background.
//!
//! Neighbours are near each other on a Morton curve. The curve is cut into parts that fit into the cache of a core, and all
//! parts are thinned in parallel, each as if its neighbours in other parts stayed. The results are merged by the level of the
//! score at removal; within a level, the parts take turns.

mod part;

use super::volume;
use crate::quantile;
use part::{PART, Part};
use rayon::prelude::*;
use splatstream_decoder::position::morton;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::contribution::Worth;

/// What is left of a frame, in the order of a curve through space.
pub(super) struct Thinning<'a> {
    frame: &'a GaussianFrame,
    along: Vec<u32>,
}

/// The removal of a Gaussian. Removals happen in ascending order.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Removal {
    /// The level of its score at that time.
    level: u16,
    /// How many Gaussians of its part are removed before it at this level.
    turn: u16,
    /// The number of its part with the bits reversed, so that parts which take turns lie far apart.
    part: u32,
    /// Its index on the curve.
    index: u32,
}

impl<'a> Thinning<'a> {
    /// All Gaussians of a frame.
    pub(super) fn new(frame: &'a GaussianFrame) -> Self {
        Self { frame, along: along_curve(frame) }
    }

    /// The rows that are left, rising.
    pub(super) fn rows(&self) -> Vec<u32> {
        let mut rows = self.along.clone();
        rows.par_sort_unstable();
        rows
    }

    /// Takes Gaussians away until `count` are left, and gives their rows, the last first. `shown` is what pictures show of
    /// each row of the frame if none but those that are left are there. What they show nothing of goes before all else, the least
    /// opacity times volume first.
    ///
    /// Equal on every machine and for any number of threads.
    #[expect(clippy::indexing_slicing, reason = "rows are those of the frame, indices those of what is left")]
    pub(super) fn leave(&mut self, shown: &[Worth], count: usize) -> Vec<u32> {
        let worth: Vec<Worth> = self.along.par_iter().map(|&row| shown[row as usize]).collect();
        let mut indices = self.unseen(&worth);
        indices.extend(seen(&worth).into_iter().map(|removal| removal.index));
        indices.truncate(worth.len().saturating_sub(count));
        let gone = indices.iter().rev().map(|&index| self.along[index as usize]).collect();
        let mut stays = vec![true; worth.len()];
        indices.into_iter().for_each(|index| stays[index as usize] = false);
        let mut stays = stays.into_iter();
        self.along.retain(|_| stays.next().unwrap_or(true));
        gone
    }

    /// The indices of the Gaussians that no picture shows, in ascending order of opacity times volume.
    fn unseen(&self, worth: &[Worth]) -> Vec<u32> {
        let unseen = worth.par_iter().zip(&self.along).zip(0..worth.len() as u32);
        let unseen = unseen.filter(|((worth, _), _)| !is_seen(worth));
        let mut by_volume: Vec<(f64, u32)> =
            unseen.map(|((_, &row), index)| (volume(self.frame, row), index)).collect();
        by_volume.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        by_volume.into_iter().map(|(_, index)| index).collect()
    }
}

/// Whether pictures show anything of a Gaussian.
fn is_seen(worth: &Worth) -> bool {
    worth.contribution > 0.0
}

/// The removals of all Gaussians that pictures show, in order.
#[expect(clippy::arithmetic_side_effects, reason = "indices of Gaussians in memory")]
fn seen(worth: &[Worth]) -> Vec<Removal> {
    let of_part = |(number, worth): (usize, &[Worth])| -> Vec<Removal> {
        let (number, first) = (number as u32, (number * PART) as u32);
        let removal = |(level, turn, index): (u16, u16, u16)| Removal {
            level,
            turn,
            part: number.reverse_bits(),
            index: first + u32::from(index),
        };
        Part::new(worth).removals().into_iter().map(removal).collect()
    };
    let mut all: Vec<Removal> = worth.par_chunks(PART).enumerate().flat_map_iter(of_part).collect();
    all.par_sort_unstable();
    all
}

/// The rows of a frame along a Morton curve. Space far from most of the Gaussians is drawn together, so that few of them
/// do not take the curve from all others.
#[expect(clippy::indexing_slicing, reason = "rows are those of the frame; axes are constants")]
fn along_curve(frame: &GaussianFrame) -> Vec<u32> {
    /// Values that medians are taken of.
    const SAMPLE: usize = 1 << 12;
    /// Half of the cells along an axis.
    const HALF: f32 = (1 << 17) as f32;
    let stride = (frame.len() / SAMPLE).max(1);
    let median = |mut values: Vec<f32>| quantile::ranked(&mut values, 50, f32::total_cmp).unwrap_or(0.0);
    let axis = |plane: &[f32]| {
        let middle = median(plane.iter().step_by(stride).copied().collect());
        (middle, median(plane.iter().step_by(stride).map(|value| (value - middle).abs()).collect()))
    };
    let axes = frame.position().each_ref().map(|plane| axis(plane));
    let spread = axes.iter().fold(f32::MIN_POSITIVE, |most, axis| most.max(axis.1));
    let cell = |axis: usize, row: u32| {
        let from_middle = frame.position()[axis][row as usize] - axes[axis].0;
        let drawn_together = from_middle / (spread + from_middle.abs());
        (HALF + HALF * drawn_together) as u32
    };
    let code = |row: u32| morton(cell(0, row), cell(1, row), cell(2, row));
    let mut coded: Vec<(u64, u32)> =
        (0..frame.len() as u32).into_par_iter().map(|row| (code(row), row)).collect();
    coded.par_sort_unstable();
    coded.into_iter().map(|(_, row)| row).collect()
}

#[cfg(test)]
mod tests {
    use super::part::REACH;
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    /// Gaussians in a row, of which each shows as much.
    fn row(count: usize) -> (GaussianFrame, Vec<Worth>) {
        let scene = BuiltinScene { gaussians: count.max(256) as u32, ..BuiltinScene::default() };
        let mut frame = scene.frame(0).select(&(0..count as u32).collect::<Vec<_>>());
        for (axis, plane) in frame.planes_mut().position.into_iter().enumerate() {
            plane.iter_mut().zip(0..).for_each(|(x, row)| *x = if axis == 0 { row as f32 } else { 0.0 });
        }
        (frame, vec![Worth { contribution: 1.0, loss: 0.01, energy: 1.0 }; count])
    }

    #[test]
    fn gaussians_that_show_as_much_leave_no_holes() {
        let (frame, shown) = row(256);
        let mut left = Thinning::new(&frame);
        let mut gone = left.leave(&shown, 64);
        let kept = left.rows();
        assert_eq!((gone.len(), kept.len()), (192, 64));
        let widest = kept.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert!(widest <= Some(2 * REACH as u32), "{kept:?}");
        gone.extend(kept);
        gone.sort_unstable();
        assert!(gone.into_iter().eq(0..256));
    }

    #[test]
    fn parts_of_the_curve_take_turns() {
        let count = 2 * PART + 1000;
        let (frame, shown) = row(count);
        let mut left = Thinning::new(&frame);
        left.leave(&shown, count / 4);
        let kept = left.rows();
        let widest = kept.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert!(widest <= Some(2 * REACH as u32), "{widest:?}");
        let of_part = |part: usize| kept.iter().filter(|&&row| row as usize / PART == part).count();
        assert!(of_part(0).abs_diff(of_part(1)) <= 1, "{} {}", of_part(0), of_part(1));
    }

    #[test]
    fn what_shows_more_stays() {
        let (frame, mut shown) = row(8);
        shown.iter_mut().step_by(2).for_each(|worth| worth.contribution = 4.0);
        let mut left = Thinning::new(&frame);
        left.leave(&shown, 4);
        assert_eq!(left.rows(), [0, 2, 4, 6]);
    }

    #[test]
    fn the_unseen_go_first_and_of_them_the_smallest() {
        let (mut frame, mut shown) = row(6);
        let splatstream_gaussians::PlanesMut { log_scale, opacity_logit, .. } = frame.planes_mut();
        opacity_logit.fill(0.0);
        log_scale.into_iter().for_each(|plane| plane.copy_from_slice(&[0.0, -3.0, 1.0, 0.0, -2.0, 9.0]));
        shown[1..5].fill(Worth::default());
        shown[5].loss = 0.0;
        let order = Thinning::new(&frame).leave(&shown, 0);
        assert_eq!(order[2..], [2, 3, 4, 1]);
    }

    #[test]
    fn few_that_are_far_away_leave_the_curve_to_the_others() {
        let (mut frame, _) = row(64);
        let near = along_curve(&frame);
        frame.planes_mut().position[0][63] = 1e9;
        frame.planes_mut().position[1][62] = -1e9;
        let far = along_curve(&frame);
        let apart = |order: &[u32]| {
            let steps = order.windows(2).filter(|pair| pair.iter().all(|&row| row < 62));
            steps.map(|pair| pair[0].abs_diff(pair[1])).sum::<u32>()
        };
        assert_eq!((apart(&near), apart(&far)), (61, 61));
    }
}
