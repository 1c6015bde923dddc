//! What encoding takes, from counts alone, and how much of it fits into a time.
//!
//! What is chosen must not depend on how busy a machine is, or the same command would write other bytes tomorrow. So nothing is
//! timed: a cost model says what presets and iterations take. Its constants were fitted once to measurements (rationale, 1.26); its
//! seconds are processor time of that machine, of all threads together.

use crate::finetune::request::Finetune;
use crate::settings::{Preset, Settings};

/// What the time to encode follows from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Work {
    /// Gaussians of the first frame.
    pub gaussians: u64,
    /// Degree of their spherical harmonics, 0 to 3.
    pub sh_degree: u8,
    /// Frames, 1 or more.
    pub frames: u32,
    /// Whether frames may refer to others; then none is fitted to pictures.
    pub is_predicted: bool,
}

/// How much is done for a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// How much is searched.
    pub preset: Preset,
    /// Iterations of [fitting values to pictures](crate::Finetune) of each frame; 0: none.
    pub iterations: u32,
}

/// Iterations that make fitting worth its start, at least, and beyond which hardly anything is gained.
const LEAST: u32 = 5;
const MOST: u32 = 200;

/// What some work takes: seconds of one processor whatever the scene, and microseconds for each Gaussian without and with SH
/// of degree 3. Between them it goes by the number of coefficients.
#[derive(Debug, Clone, Copy)]
struct Cost(f64, f64, f64);

impl Cost {
    /// Seconds for a frame.
    fn seconds(self, work: &Work) -> f64 {
        let Self(fixed, plain, degree_3) = self;
        let share = match work.sh_degree {
            0 => 0.0,
            1 => 0.2,
            2 => 8.0 / 15.0,
            _ => 1.0,
        };
        fixed + (plain + (degree_3 - plain) * share) * 1e-6 * work.gaussians as f64
    }
}

/// What a preset takes.
struct Costs {
    /// Once: steps that are fitted, pictures of the finished stream, and of sequences the frames that are tried.
    once: Cost,
    /// Each frame.
    each: Cost,
}

impl Costs {
    fn of(preset: Preset, is_predicted: bool) -> Self {
        let (once, each) = match (preset, is_predicted) {
            (Preset::Fast, false) => (Cost(0.55, 0.5, 2.5), Cost(0.05, 0.6, 2.5)),
            (Preset::Balanced, false) => (Cost(1.0, 3.0, 8.0), Cost(0.7, 5.0, 14.0)),
            (Preset::Small, false) => (Cost(1.0, 3.0, 8.0), Cost(1.0, 9.0, 28.0)),
            (Preset::Fast, true) => (Cost(0.0, 105.0, 210.0), Cost(0.0, 5.0, 12.0)),
            (Preset::Balanced, true) => (Cost(0.3, 136.0, 270.0), Cost(0.0, 6.5, 16.0)),
            (Preset::Small, true) => (Cost(0.3, 150.0, 300.0), Cost(0.0, 9.0, 22.0)),
        };
        Self { once, each }
    }
}

/// Of fitting a frame to pictures: models and views to judge by at its start, at its end and every 20 iterations, and an
/// iteration with its part of those in between.
const START_AND_END: Cost = Cost(1.2, 10.0, 35.0);
const ITERATION: Cost = Cost(0.42, 2.6, 3.0);

/// Times that a frame is fitted until its pictures have the PSNR that is asked for, about.
const FITS: f64 = 1.5;

impl Effort {
    /// The settings that stand for it.
    pub fn settings(self) -> Settings {
        let Self { preset, iterations } = self;
        let finetune = (iterations > 0).then(|| Finetune { iterations, ..Finetune::default() });
        Settings { preset, finetune, ..Settings::default() }
    }

    /// What it is expected to take, seconds of one processor of the machine that the model was fitted on.
    pub fn seconds(self, work: &Work) -> f64 {
        let Costs { once, each } = Costs::of(self.preset, work.is_predicted);
        let fits = if work.is_predicted || self.iterations == 0 { 0.0 } else { FITS };
        let iterations = f64::from(self.iterations) * ITERATION.seconds(work);
        let fitting = fits * (START_AND_END.seconds(work) + iterations);
        once.seconds(work) + f64::from(work.frames) * (each.seconds(work) + fitting)
    }

    /// The most that is expected to be done in a time; the fast preset where nothing is. For sequences with predicted frames
    /// that is at most the balanced preset: what the small one adds there seldom pays.
    pub fn within(seconds: f64, work: &Work) -> Self {
        let of = |preset: Preset, iterations: u32| Self { preset, iterations };
        let fits = |effort: &Self| effort.seconds(work) <= seconds;
        let small = (!work.is_predicted).then(|| of(Preset::Small, Self::most_iterations(seconds, work)));
        small
            .filter(|small| small.iterations >= LEAST && fits(small))
            .or_else(|| Some(of(Preset::Balanced, 0)).filter(fits))
            .unwrap_or_else(|| of(Preset::Fast, 0))
    }

    /// The iterations of the small preset that fit into a time.
    fn most_iterations(seconds: f64, work: &Work) -> u32 {
        let with = |iterations| Self { preset: Preset::Small, iterations }.seconds(work);
        let each = with(2) - with(1);
        // Floats saturate where they become integers, and what is no number becomes 0.
        ((1.0 + (seconds - with(1)) / each) as u32).min(MOST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: Work = Work { gaussians: 100_000, sh_degree: 0, frames: 1, is_predicted: false };

    #[test]
    fn more_time_is_never_spent_on_less() {
        for work in [
            STILL,
            Work { sh_degree: 3, frames: 5, ..STILL },
            Work { frames: 30, is_predicted: true, ..STILL },
        ] {
            let budgets = (0..60).map(|step| 0.01 * libm::exp2(f64::from(step) * 0.4));
            let efforts: Vec<(f64, Effort)> =
                budgets.map(|budget| (budget, Effort::within(budget, &work))).collect();
            let seconds: Vec<f64> = efforts.iter().map(|(_, effort)| effort.seconds(&work)).collect();
            assert!(seconds.is_sorted(), "{seconds:?}");
            for ((budget, effort), seconds) in efforts.iter().zip(&seconds) {
                assert!(seconds <= budget || effort.preset == Preset::Fast, "{budget} {effort:?} {seconds}");
                assert!(effort.iterations == 0 || effort.preset == Preset::Small);
            }
            let [first, last] = [efforts.first(), efforts.last()].map(|effort| effort.unwrap().1);
            let most = if work.is_predicted { (Preset::Balanced, 0) } else { (Preset::Small, MOST) };
            assert_eq!((first.preset, (last.preset, last.iterations)), (Preset::Fast, most));
        }
    }

    #[test]
    fn presets_span_ten_times_in_speed() {
        let [fast, small] = [Settings::of(Preset::Fast), Settings::of(Preset::Small)].map(|settings| {
            let iterations = settings.finetune.map_or(0, |finetune| finetune.iterations);
            Effort { preset: settings.preset, iterations }.seconds(&STILL)
        });
        assert!(small > 10.0 * fast, "{small} {fast}");
    }

    #[test]
    fn nothing_and_everything_are_budgets() {
        for (gaussians, frames) in [(0, 0), (0, 1), (u64::MAX, u32::MAX)] {
            let work = Work { gaussians, frames, ..STILL };
            for seconds in [0.0, 1.0, f64::INFINITY] {
                assert!(Effort::within(seconds, &work).iterations <= MOST);
            }
        }
    }
}
