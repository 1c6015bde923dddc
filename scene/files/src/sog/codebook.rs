//! Codebooks of 256 values, which bytes choose from.

/// Entries that a byte can choose from.
const CODES: usize = 256;

/// Parts of the range in which values are counted, to find where codes are needed.
const BINS: usize = 4096;

/// Rounds of moving codes to the mean of what chooses them: a few tens reach a state that hardly changes.
const ROUNDS: usize = 40;

/// 256 values, rising: those themselves if there are no more different ones, else such that the squares of the differences are
/// small. Values are finite.
///
/// Codes start where the cube root of the density of values says, which is the best for many codes (Panter and Dite, "Quantization
/// distortion in pulse-count modulation with nonuniform spacing of levels", 1951). Lloyd's method then moves each to the
/// mean of the values that are nearest to it; in one dimension these lie side by side.
pub(super) fn codebook(mut values: Vec<f32>) -> Vec<f32> {
    values.sort_unstable_by(f32::total_cmp);
    let mut distinct = values.clone();
    distinct.dedup();
    let (Some(&least), Some(&most)) = (values.first(), values.last()) else { return vec![0.0; CODES] };
    if distinct.len() <= CODES {
        distinct.resize(CODES, most);
        return distinct;
    }
    let mut codes = starts(&values, least.into(), most.into());
    let sums = running_sums(&values);
    for _ in 0..ROUNDS {
        let ends: Vec<usize> = midpoints(&codes)
            .map(|middle| values.partition_point(|&value| f64::from(value) < middle))
            .collect();
        let begins = std::iter::once(0).chain(ends.iter().copied());
        let ends = ends.iter().copied().chain([values.len()]);
        for ((code, begin), end) in codes.iter_mut().zip(begins).zip(ends) {
            let (Some(before), Some(after)) = (sums.get(begin), sums.get(end)) else { continue };
            // A code that nothing chooses stays where it is.
            if begin < end {
                *code = (after - before) / end.saturating_sub(begin) as f64;
            }
        }
    }
    codes.into_iter().map(|code| code as f32).collect()
}

/// The nearest code of a codebook.
pub(super) fn nearest(codes: &[f32], value: f32) -> u8 {
    let after = codes.partition_point(|&code| code < value);
    let distance = |at: usize| codes.get(at).map_or(f32::INFINITY, |code| (code - value).abs());
    let before = after.saturating_sub(1);
    (if distance(after) < distance(before) { after } else { before }).min(CODES.saturating_sub(1)) as u8
}

/// Codes at equal shares of the cube root of the density of sorted values.
fn starts(values: &[f32], least: f64, most: f64) -> Vec<f64> {
    let mut counts = vec![0.0_f64; BINS];
    let scale = BINS as f64 / (most - least);
    for &value in values {
        // `as` saturates.
        let bin = (((f64::from(value) - least) * scale) as usize).min(BINS.saturating_sub(1));
        counts.get_mut(bin).into_iter().for_each(|count| *count += 1.0);
    }
    let weights: Vec<f64> = counts.into_iter().map(libm::cbrt).collect();
    let total: f64 = weights.iter().sum();
    let (mut codes, mut before) = (Vec::with_capacity(CODES), 0.0);
    for (bin, weight) in weights.into_iter().enumerate() {
        let target = |code: usize| (code as f64 + 0.5) / CODES as f64 * total;
        while codes.len() < CODES && target(codes.len()) <= before + weight {
            let part = if weight > 0.0 { (target(codes.len()) - before) / weight } else { 0.0 };
            codes.push(least + (bin as f64 + part) / scale);
        }
        before += weight;
    }
    codes.resize(CODES, most);
    codes
}

/// The sum of the values before each place, and of all.
fn running_sums(values: &[f32]) -> Vec<f64> {
    let mut sum = 0.0;
    let sums = values.iter().map(|&value| {
        sum += f64::from(value);
        sum
    });
    std::iter::once(0.0).chain(sums).collect()
}

fn midpoints(codes: &[f64]) -> impl Iterator<Item = f64> + '_ {
    codes.iter().zip(codes.iter().skip(1)).map(|(a, b)| (a + b) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squares(codes: &[f32], values: &[f32]) -> f64 {
        values.iter().map(|&value| f64::from(codes[usize::from(nearest(codes, value))] - value).powi(2)).sum()
    }

    /// The value of a normal distribution below which a share of it lies, nearly: Tukey's lambda.
    fn bell(share: f64) -> f64 {
        (libm::pow(share, 0.135) - libm::pow(1.0 - share, 0.135)) / 0.1975
    }

    #[test]
    fn few_values_are_kept() {
        let codes = codebook(vec![3.0, -1.0, 3.0, 0.5]);
        assert_eq!(codes.len(), 256);
        for value in [3.0, -1.0, 0.5] {
            assert_eq!(codes[usize::from(nearest(&codes, value))], value);
        }
    }

    #[test]
    fn many_values_are_nearer_than_to_equal_steps() {
        // A bell curve: theory says 2.02 times for many codes over 8 standard deviations.
        let values: Vec<f32> = (1..100_000).map(|at| bell(f64::from(at) / 100_000.0) as f32).collect();
        let equal: Vec<f32> = (0..256).map(|at| at as f32 / 255.0 * 8.0 - 4.0).collect();
        let codes = codebook(values.clone());
        assert!(codes.is_sorted());
        assert!(squares(&codes, &values) < squares(&equal, &values) / 1.8);
    }

    #[test]
    fn every_value_chooses_the_nearest_code() {
        let codes = codebook((0..1000).map(|at| (at as f32).sin() * 3.0).collect());
        for value in [-5.0, -2.9, 0.0, 0.013, 2.99, 7.0] {
            let chosen = codes[usize::from(nearest(&codes, value))];
            assert!(codes.iter().all(|code| (code - value).abs() >= (chosen - value).abs()));
        }
    }
}
