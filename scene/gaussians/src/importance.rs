//! How much each Gaussian matters, and the order that follows.

use crate::activation::sigmoid;
use crate::frame::GaussianFrame;

/// Opacity times volume of each Gaussian, as [`opacity_volume_of`] has it.
pub fn opacity_volume(frame: &GaussianFrame) -> Vec<f64> {
    let [a, b, c] = frame.log_scale();
    let scales = a.iter().zip(b).zip(c);
    let rows = frame.opacity_logit().iter().zip(scales);
    rows.map(|(&logit, ((&a, &b), &c))| opacity_volume_of([a, b, c], logit)).collect()
}

/// Opacity times volume of a Gaussian: sigmoid(logit) × exp(Σ log scale), at least 0, in the cube of the
/// scene's length unit. Equal on every machine for equal input.
///
/// Source: the paper's importance score, ρ = σ(α) · exp(Σ s).
pub fn opacity_volume_of([a, b, c]: [f32; 3], logit: f32) -> f64 {
    let volume = libm::exp(f64::from(a) + f64::from(b) + f64::from(c));
    sigmoid(f64::from(logit)) * volume
}

/// The indices of `scores`, highest score first; equal scores in index order. A total order: NaN counts as
/// lowest.
#[expect(clippy::indexing_slicing, reason = "the indices are those of the scores")]
pub fn order(scores: &[f64]) -> Vec<u32> {
    let key = |index: u32| {
        let score = scores[index as usize];
        // Adding zero makes one zero of the two.
        if score.is_nan() { f64::NEG_INFINITY } else { score + 0.0 }
    };
    let mut indices: Vec<u32> = (0..scores.len() as u32).collect();
    indices.sort_unstable_by(|&a, &b| key(b).total_cmp(&key(a)).then(a.cmp(&b)));
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_score_comes_first_and_ties_keep_their_order() {
        assert_eq!(order(&[1.0, 3.0, f64::NAN, 3.0, -0.0, 0.0]), [1, 3, 0, 4, 5, 2]);
    }
}
