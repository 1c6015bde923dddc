//! What points up in a scene, if nobody says.
//!
//! Trainers write y downwards, and readers of formats with other axes convert to that. Avatars and meshes often have y
//! upwards. Both are told apart by what scenes stand on: a floor, a pot, shoulders. More of a scene lies at its lower end
//! than at its upper one.

use splatstream_chart::quantile::ranked;
use splatstream_format::payload::UpAxis;
use splatstream_gaussians::GaussianFrame;

/// A guess, and what speaks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UpGuess {
    pub(crate) axis: UpAxis,
    /// How many times more lies at the lower end; none if the ends are too much alike to tell.
    pub(crate) ratio: Option<f64>,
}

/// The ends are told apart from this ratio on.
const TELLING: f64 = 1.3;

/// The part of the extent at either end that is compared.
const END: f64 = 0.1;

impl UpGuess {
    /// A guess from the first frame of a sequence; y downwards where nothing speaks for another.
    pub(crate) fn of(frame: &GaussianFrame) -> Self {
        let (low, high) = ends(&weighted(frame));
        let (axis, heavy, light) = match low > high {
            true => (UpAxis::PlusY, low, high),
            false => (UpAxis::MinusY, high, low),
        };
        let ratio = heavy / light.max(f64::MIN_POSITIVE);
        match heavy > 0.0 && ratio >= TELLING {
            true => Self { axis, ratio: Some(ratio) },
            false => Self { axis: UpAxis::MinusY, ratio: None },
        }
    }

    /// Whether it is more than what is usual.
    pub(crate) fn is_told(self) -> bool {
        self.ratio.is_some()
    }

    /// As `--up` has it.
    pub(crate) fn name(self) -> &'static str {
        self.axis.name().trim_start_matches('+')
    }

    /// What speaks for it, in words.
    pub(crate) fn why(self) -> String {
        match self.ratio {
            Some(ratio) => format!(
                "guessed, since {:.1} times as much of the scene lies at its lower end as at its upper end",
                ratio.min(100.0)
            ),
            None => "guessed, since trainers use it, and both ends of the scene are alike".to_owned(),
        }
    }
}

/// The y of each Gaussian, in order, and how much it covers: opacity times area. What is not finite is left out.
fn weighted(frame: &GaussianFrame) -> Vec<(f64, f64)> {
    let [_, y, _] = frame.position();
    let [a, b, c] = frame.log_scale();
    let one = |row: usize| {
        let axes = [a[row], b[row], c[row]];
        let smallest = axes.iter().copied().fold(f32::INFINITY, f32::min);
        let area = f64::from(axes.iter().sum::<f32>() - smallest).min(200.0);
        let weight = libm::exp(area) / (1.0 + libm::exp(-f64::from(frame.opacity_logit()[row])));
        (f64::from(y[row]), weight)
    };
    let mut weighted: Vec<(f64, f64)> = (0..frame.len()).map(one).collect();
    weighted.retain(|(y, weight)| y.is_finite() && weight.is_finite());
    // Few huge Gaussians say nothing of where most are.
    let mut weights: Vec<f64> = weighted.iter().map(|(_, weight)| *weight).collect();
    let most = ranked(&mut weights, 99, f64::total_cmp).unwrap_or_default();
    weighted.iter_mut().for_each(|(_, weight)| *weight = weight.min(most));
    weighted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    weighted
}

/// How much lies at the end of low y, and at that of high y; strays are left out.
fn ends(weighted: &[(f64, f64)]) -> (f64, f64) {
    let all: f64 = weighted.iter().map(|(_, weight)| weight).sum();
    let quantile = |share: f64| {
        let mut sum = 0.0;
        let found = weighted.iter().find(|(_, weight)| {
            sum += weight;
            sum >= share * all
        });
        found.map_or(0.0, |(y, _)| *y)
    };
    let (first, last) = (quantile(0.02), quantile(0.98));
    let length = last - first;
    let within = |from: f64, to: f64| {
        let part = weighted.iter().filter(|(y, _)| (from..=to).contains(y));
        part.map(|(_, weight)| weight).sum::<f64>()
    };
    let (inside, outside) = (END * length, 0.5 * END * length);
    (within(first - outside, first + inside), within(last - inside, last + outside))
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;
    use splatstream_gaussians::Planes;

    #[test]
    fn a_scene_and_the_scene_upside_down_have_opposite_guesses() {
        let frame = BuiltinScene { gaussians: 2_000, ..BuiltinScene::default() }.frame(0);
        let guess = UpGuess::of(&frame);
        assert_eq!((guess.axis, guess.is_told()), (UpAxis::MinusY, true), "{guess:?}");
        let (degree, mut planes) = (frame.sh_degree(), frame.into_planes());
        planes.position[1].iter_mut().for_each(|y| *y = -*y);
        let turned = UpGuess::of(&GaussianFrame::from_planes(degree, planes).expect("planes that fit"));
        assert_eq!((turned.axis, turned.is_told()), (UpAxis::PlusY, true), "{turned:?}");
    }

    #[test]
    fn nothing_is_told_by_an_empty_frame() {
        let empty = GaussianFrame::from_planes(0, Planes::default()).expect("no planes");
        assert_eq!(UpGuess::of(&empty), UpGuess { axis: UpAxis::MinusY, ratio: None });
    }
}
