//! Codebooks of 256 values, which bytes choose from.

/// Entries that a byte can choose from.
const CODES: usize = 256;

/// Parts that sorted values are divided in: half of them have as many values each, half are as wide as each other.
const PARTS: usize = 2048;

/// Rounds of moving codes to the mean of what chooses them, after the best codes for parts have been found.
const ROUNDS: usize = 10;

/// 256 values, rising: those themselves if there are no more different ones, else such that the squares of the differences are
/// small. Values are finite.
///
/// In one dimension the values of a code lie side by side. So sorted values are cut into small parts, and dynamic programming finds
/// where runs of parts begin that are best shown by their means. Lloyd's method then moves each code to the mean of
/// the values that are nearest to it, wherever a part was cut.
pub(super) fn codebook(mut values: Vec<f32>) -> Vec<f32> {
    values.sort_unstable_by(f32::total_cmp);
    let mut distinct = values.clone();
    distinct.dedup();
    let Some(&most) = values.last() else { return vec![0.0; CODES] };
    if distinct.len() <= CODES {
        distinct.resize(CODES, most);
        return distinct;
    }
    let sums = running_sums(&values);
    let mut codes = best_of_parts(&Parts::of(&values, &sums));
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

/// Parts of sorted values: where each begins, and the end; the sums of the values and of their squares before each.
struct Parts {
    begins: Vec<usize>,
    sums: Vec<f64>,
    squares: Vec<f64>,
}

impl Parts {
    fn of(values: &[f32], sums: &[f64]) -> Self {
        let (least, most) = (values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(0.0));
        let share = |part: usize| part as f64 / PARTS as f64;
        let of_count = (0..PARTS).map(|part| (share(part) * values.len() as f64) as usize);
        let of_width = (0..PARTS).map(|part| {
            let begin = f64::from(least) + share(part) * (f64::from(most) - f64::from(least));
            values.partition_point(|&value| f64::from(value) < begin)
        });
        let mut begins: Vec<usize> = of_count.chain(of_width).chain([values.len()]).collect();
        begins.sort_unstable();
        begins.dedup();
        let at = |all: &[f64]| begins.iter().map(|&begin| all.get(begin).copied().unwrap_or(0.0)).collect();
        let mut square = 0.0;
        let squares = values.iter().map(|&value| {
            square += f64::from(value) * f64::from(value);
            square
        });
        let squares: Vec<f64> = std::iter::once(0.0).chain(squares).collect();
        Self { sums: at(sums), squares: at(&squares), begins }
    }

    /// How many parts.
    fn len(&self) -> usize {
        self.begins.len().saturating_sub(1)
    }

    /// The number of values of some parts, their sum, and the sum of their squares.
    fn run(&self, from: usize, to: usize) -> Option<(f64, f64, f64)> {
        let count = self.begins.get(to)?.saturating_sub(*self.begins.get(from)?) as f64;
        let (sum, square) =
            (self.sums.get(to)? - self.sums.get(from)?, self.squares.get(to)? - self.squares.get(from)?);
        Some((count, sum, square))
    }

    /// The squares of the differences of the values of some parts from their mean.
    fn cost(&self, from: usize, to: usize) -> f64 {
        self.run(from, to)
            .filter(|&(count, ..)| count > 0.0)
            .map_or(0.0, |(count, sum, square)| square - sum * sum / count)
    }
}

/// The means of the runs of parts that cost the least.
fn best_of_parts(parts: &Parts) -> Vec<f64> {
    let count = parts.len();
    // The least cost of the first parts with so many runs, and where the last of these runs begins.
    let mut costs: Vec<f64> = (0..=count).map(|to| parts.cost(0, to)).collect();
    let mut begins: Vec<Vec<u16>> = vec![vec![0; count.saturating_add(1)]];
    for _ in 1..CODES {
        let (next, begin) = one_run_more(parts, &costs);
        costs = next;
        begins.push(begin);
    }
    let mut codes = Vec::with_capacity(CODES);
    let mut to = count;
    for begin in begins.iter().rev() {
        let from = begin.get(to).map_or(0, |&from| usize::from(from));
        let mean = parts.run(from, to).filter(|&(count, ..)| count > 0.0).map(|(count, sum, _)| sum / count);
        codes.extend(mean);
        to = from;
    }
    codes.reverse();
    let last = codes.last().copied().unwrap_or(0.0);
    codes.resize(CODES, last);
    codes
}

/// The least costs with one run more than those of `before`. The best begin of the last run does not fall as parts are added, so
/// that what is found for the middle bounds the search on both sides of it.
fn one_run_more(parts: &Parts, before: &[f64]) -> (Vec<f64>, Vec<u16>) {
    let count = parts.len();
    let (mut costs, mut begins) = (vec![0.0; before.len()], vec![0; before.len()]);
    // Ranges of ends that are open, each with the range of begins.
    let mut open: Vec<(usize, usize, usize, usize)> = vec![(0, count, 0, count)];
    while let Some((first, last, low, high)) = open.pop() {
        let middle = first.midpoint(last);
        let mut best = (f64::INFINITY, low);
        for begin in low..=high.min(middle) {
            let cost = before.get(begin).copied().unwrap_or(0.0) + parts.cost(begin, middle);
            if cost < best.0 {
                best = (cost, begin);
            }
        }
        if let (Some(cost), Some(begin)) = (costs.get_mut(middle), begins.get_mut(middle)) {
            (*cost, *begin) = (best.0, best.1 as u16);
        }
        if let Some(below) = middle.checked_sub(1).filter(|&below| below >= first) {
            open.push((first, below, low, best.1));
        }
        if middle < last {
            open.push((middle.saturating_add(1), last, best.1, high));
        }
    }
    (costs, begins)
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
