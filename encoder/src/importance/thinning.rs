//! Gaussians leave a frame one after the other, those first that pictures miss least.
//!
//! What pictures lose without a Gaussian says nothing of what they lose without its neighbours as well: where many overlap, each of
//! them is missed little, and all of them together would leave a hole. So what is lost without a Gaussian rises as its
//! neighbours go, from what is lost without it alone to what it would show before a background.

use super::volume;
use crate::quantile;
use rayon::prelude::*;
use splatstream_decoder::position::morton;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::contribution::Worth;

/// Neighbours are those so many places before and after on a Morton curve.
const REACH: usize = 4;
/// What is lost without a Gaussian none of whose neighbours is left, of its energy: the mean of what colours of three channels differ
/// by, squared, is of this order.
const ALONE: f64 = 1.5;
/// Bits of a score that make scores different: sixteen from one power of two to the next.
const DROPPED_BITS: u32 = 19;
/// Scores that can be told apart, which are positive.
const LEVELS: usize = 1 << (31 - DROPPED_BITS);

/// What is left of a frame, in the order of a curve through space.
pub(super) struct Thinning<'a> {
    frame: &'a GaussianFrame,
    along: Vec<u32>,
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
    /// Scores only rise, so that a queue with a line for each level of them is enough: whoever is next in the lowest line goes,
    /// unless neighbours have gone since and raised its score to another level. Lines are filled so that those that come one
    /// after the other lie far apart.
    #[expect(
        clippy::indexing_slicing,
        reason = "places are those of the Gaussians that are left, levels below the highest"
    )]
    pub(super) fn leave(&mut self, shown: &[Worth], count: usize) -> Vec<u32> {
        let mut left = Left::new(self.along.iter().map(|&row| shown[row as usize]).collect());
        let mut lines = self.queue(&left);
        let going = left.len().saturating_sub(count);
        let mut gone = Vec::with_capacity(going);
        for level in 0..LEVELS {
            if gone.len() == going {
                break;
            }
            for place in core::mem::take(&mut lines[level]) {
                let now = usize::from(left.level(place as usize));
                if now > level {
                    lines[now].push(place);
                } else if gone.len() < going {
                    left.remove(place as usize);
                    gone.push(self.along[place as usize]);
                }
            }
        }
        let mut places = 0..;
        self.along.retain(|_| places.next().is_some_and(|place| left.has(place)));
        gone.reverse();
        gone
    }

    /// A line of places for each level, those first that go first.
    #[expect(
        clippy::indexing_slicing,
        reason = "places are those of the Gaussians that are left, levels below the highest"
    )]
    fn queue(&self, left: &Left) -> Vec<Vec<u32>> {
        let mut lines = vec![Vec::new(); LEVELS];
        let unseen = (0..left.len() as u32).into_par_iter().filter(|&place| !left.is_seen(place as usize));
        let mut by_volume: Vec<(f64, u32)> =
            unseen.map(|place| (volume(self.frame, self.along[place as usize]), place)).collect();
        by_volume.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        lines[0].extend(by_volume.into_iter().map(|(_, place)| place));
        let levels: Vec<u16> = (0..left.len()).into_par_iter().map(|place| left.level(place)).collect();
        for place in far_apart(left.len()).filter(|&place| left.is_seen(place as usize)) {
            lines[usize::from(levels[place as usize])].push(place);
        }
        lines
    }
}

/// Gaussians along a curve, some of which have gone.
struct Left {
    worth: Vec<Worth>,
    /// What each gives, 0 if it has gone; with as many zeros at both ends as a neighbourhood reaches.
    given: Vec<f32>,
    /// What the neighbours of each gave when all were there.
    around: Vec<f32>,
    gone: Vec<bool>,
}

#[expect(
    clippy::indexing_slicing,
    reason = "places are those of the Gaussians, and neighbourhoods end within zeros"
)]
#[expect(clippy::arithmetic_side_effects, reason = "places of Gaussians in memory")]
impl Left {
    fn new(worth: Vec<Worth>) -> Self {
        let zeros = || [0.0; REACH].into_iter();
        let given: Vec<f32> =
            zeros().chain(worth.iter().map(|worth| worth.contribution as f32)).chain(zeros()).collect();
        let around = (0..worth.len()).into_par_iter().map(|place| sum_around(&given, place)).collect();
        let gone = vec![false; worth.len()];
        Self { worth, given, around, gone }
    }

    fn len(&self) -> usize {
        self.worth.len()
    }

    fn has(&self, place: usize) -> bool {
        !self.gone[place]
    }

    fn is_seen(&self, place: usize) -> bool {
        self.worth[place].contribution > 0.0
    }

    fn remove(&mut self, place: usize) {
        self.given[place + REACH] = 0.0;
        self.gone[place] = true;
    }

    /// The level of the score of a Gaussian: of the geometric mean of what it gives and of what is lost without it.
    ///
    /// Most neighbours must have gone until much of what is behind them shows, hence the third power of their share.
    fn level(&self, place: usize) -> u16 {
        let Worth { contribution, loss, energy } = self.worth[place];
        let around = self.around[place];
        let missing =
            if around > 0.0 { 1.0 - f64::from(sum_around(&self.given, place) / around) } else { 0.0 };
        let lost = loss + missing.powi(3) * (ALONE * energy - loss).max(0.0);
        // What is beyond numbers has no sign, and is the highest.
        (((contribution * lost).sqrt() as f32).abs().to_bits() >> DROPPED_BITS) as u16
    }
}

/// What the neighbours of a place give.
#[expect(clippy::indexing_slicing, reason = "neighbourhoods end within zeros")]
#[expect(clippy::arithmetic_side_effects, reason = "places of Gaussians in memory")]
fn sum_around(given: &[f32], place: usize) -> f32 {
    let window = &given[place..=place + 2 * REACH];
    let sum = |side: &[f32]| side.iter().sum::<f32>();
    sum(&window[..REACH]) + sum(&window[REACH + 1..])
}

/// All places, so that each next one is far from those before: by the bits of their numbers from the last to the first.
#[expect(clippy::arithmetic_side_effects, reason = "counts of Gaussians in memory")]
fn far_apart(count: usize) -> impl Iterator<Item = u32> {
    let bits = count.next_power_of_two().trailing_zeros().max(1);
    let places = (0..1_u32 << bits).map(move |number| number.reverse_bits() >> (32 - bits));
    places.filter(move |&place| (place as usize) < count)
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
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    /// Gaussians in a row, of which each shows as much.
    fn row(count: usize) -> (GaussianFrame, Vec<Worth>) {
        let scene = BuiltinScene { gaussians: 256, ..BuiltinScene::default() };
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
    fn places_come_once_each_and_halves_between_them() {
        assert_eq!(far_apart(5).collect::<Vec<_>>(), [0, 4, 2, 1, 3]);
        assert_eq!(far_apart(1).collect::<Vec<_>>(), [0]);
        assert_eq!(far_apart(0).count(), 0);
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
