//! What is taken to point up in a scene, if nobody says.
//!
//! Trainers write y downwards, and readers of formats with other axes convert to that, so -y points up. Some avatars and
//! meshes have y upwards. What scenes stand on, a floor, a pot, shoulders, often makes their lower end the heavier one. That is
//! wrong for captured rooms and for what floats, so that it is a hint and decides nothing.

use splatstream_chart::quantile::ranked;
use splatstream_gaussians::GaussianFrame;

/// That -y points up, and what speaks against it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AssumedUp {
    /// How many times more of the scene lies at the upper end than at the lower one, where that can be told.
    pub(crate) top_heavy: Option<f64>,
}

/// The ends are told apart from this ratio on.
const TELLING: f64 = 1.3;

/// The part of the extent at either end that is compared.
const END: f64 = 0.1;

impl AssumedUp {
    /// As `--up` has it.
    pub(crate) const NAME: &str = "-y";

    /// By the first frame of a sequence.
    pub(crate) fn of(frame: &GaussianFrame) -> Self {
        let (upper, lower) = ends(&weighted(frame));
        let ratio = upper / lower.max(f64::MIN_POSITIVE);
        Self { top_heavy: (upper > 0.0 && ratio >= TELLING).then_some(ratio) }
    }

    /// Why, and what to do if it is wrong, in words.
    pub(crate) fn why(self) -> String {
        let hint = self.top_heavy.map_or_else(String::new, |ratio| {
            let ratio = ratio.min(100.0);
            format!(
                ", though {ratio:.1} times as much of this scene lies at its upper end as at its lower end"
            )
        });
        format!("as trainers write it{hint}; give --up y if that is upside down")
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
    fn a_scene_that_is_upside_down_is_heavier_at_its_upper_end() {
        let frame = BuiltinScene { gaussians: 2_000, ..BuiltinScene::default() }.frame(0);
        assert_eq!(AssumedUp::of(&frame).top_heavy, None);
        let (degree, mut planes) = (frame.sh_degree(), frame.into_planes());
        planes.position[1].iter_mut().for_each(|y| *y = -*y);
        let turned = AssumedUp::of(&GaussianFrame::from_planes(degree, planes).expect("planes that fit"));
        assert!(turned.top_heavy.is_some_and(|ratio| ratio > TELLING), "{turned:?}");
        assert!(turned.why().contains("as much of this scene lies at its upper end"), "{}", turned.why());
    }

    #[test]
    fn nothing_speaks_against_it_in_an_empty_frame() {
        let empty = GaussianFrame::from_planes(0, Planes::default()).expect("no planes");
        assert_eq!(AssumedUp::of(&empty).top_heavy, None);
    }
}
