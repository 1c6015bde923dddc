//! Codebooks of 256 values, which bytes choose from.

/// Entries that a byte can choose from.
const CODES: usize = 256;

/// Parts that sorted values are divided in: half of them have as many values each, half are as wide as each other.
const PARTS: usize = 2048;

/// Rounds of moving codes to the mean of what chooses them, after the best codes for parts have been found.
const ROUNDS: usize = 10;

/// 256 values, rising: those themselves if there are no more different ones, else such that the squares of the differences,
/// each times the weight of its value, are small. Values are finite, weights above 0.
///
/// In one dimension the values of a code lie side by side. So sorted values are cut into small parts, and dynamic programming finds
/// where runs of parts begin that are best shown by their means. Lloyd's method then moves each code to the mean of
/// the values that are nearest to it, wherever a part was cut.
pub(super) fn codebook(mut values: Vec<Weighed>) -> Vec<f32> {
    values.sort_unstable_by(|a, b| a.value.total_cmp(&b.value).then(a.weight.total_cmp(&b.weight)));
    let mut distinct: Vec<f32> = values.iter().map(|weighed| weighed.value).collect();
    distinct.dedup();
    let Some(&most) = distinct.last() else { return vec![0.0; CODES] };
    if distinct.len() <= CODES {
        distinct.resize(CODES, most);
        return distinct;
    }
    let sums = Sums::of(&values);
    let mut codes = best_of_parts(&Parts::of(&values, &sums));
    for _ in 0..ROUNDS {
        let ends: Vec<usize> = midpoints(&codes)
            .map(|middle| values.partition_point(|weighed| f64::from(weighed.value) < middle))
            .collect();
        let begins = std::iter::once(0).chain(ends.iter().copied());
        let ends = ends.iter().copied().chain([values.len()]);
        for ((code, begin), end) in codes.iter_mut().zip(begins).zip(ends) {
            // A code that nothing chooses stays where it is.
            if let Some(mean) = sums.between(begin, end).and_then(Moments::mean) {
                *code = mean;
            }
        }
    }
    codes.into_iter().map(|code| code as f32).collect()
}

/// A value, and what the square of its difference counts for.
#[derive(Clone, Copy)]
pub(super) struct Weighed {
    pub(super) value: f32,
    pub(super) weight: f64,
}

impl Weighed {
    /// A value that counts as much as any other.
    pub(super) fn alike(value: f32) -> Self {
        Self { value, weight: 1.0 }
    }
}

/// Sums over values: of their weights, and of their weights times them and their squares.
#[derive(Clone, Copy, Default)]
struct Moments {
    weight: f64,
    first: f64,
    second: f64,
}

impl Moments {
    fn mean(self) -> Option<f64> {
        (self.weight > 0.0).then(|| self.first / self.weight)
    }

    /// The weighed squares of the differences from the mean.
    fn cost(self) -> f64 {
        self.mean().map_or(0.0, |mean| self.second - mean * self.first)
    }
}

/// What the values before each place, and all, sum up to.
struct Sums(Vec<Moments>);

impl Sums {
    fn of(values: &[Weighed]) -> Self {
        let mut sum = Moments::default();
        let sums = values.iter().map(|&Weighed { value, weight }| {
            let value = f64::from(value);
            sum.weight += weight;
            sum.first += weight * value;
            sum.second += weight * value * value;
            sum
        });
        Self(std::iter::once(Moments::default()).chain(sums).collect())
    }

    /// Of the values from one place to another; none if there are none.
    fn between(&self, begin: usize, end: usize) -> Option<Moments> {
        let (before, after) = (self.0.get(begin)?, self.0.get(end).filter(|_| begin < end)?);
        Some(Moments {
            weight: after.weight - before.weight,
            first: after.first - before.first,
            second: after.second - before.second,
        })
    }
}

/// The nearest code of a codebook.
pub(super) fn nearest(codes: &[f32], value: f32) -> u8 {
    let after = codes.partition_point(|&code| code < value);
    let distance = |at: usize| codes.get(at).map_or(f32::INFINITY, |code| (code - value).abs());
    let before = after.saturating_sub(1);
    (if distance(after) < distance(before) { after } else { before }).min(CODES.saturating_sub(1)) as u8
}

/// Parts of sorted values: the sums of the values before each, and of all.
struct Parts(Sums);

impl Parts {
    fn of(values: &[Weighed], sums: &Sums) -> Self {
        let end = |at: Option<&Weighed>| at.map_or(0.0, |weighed| f64::from(weighed.value));
        let (least, most) = (end(values.first()), end(values.last()));
        let share = |part: usize| part as f64 / PARTS as f64;
        let of_count = (0..PARTS).map(|part| (share(part) * values.len() as f64) as usize);
        let of_width = (0..PARTS).map(|part| {
            let begin = least + share(part) * (most - least);
            values.partition_point(|weighed| f64::from(weighed.value) < begin)
        });
        let mut begins: Vec<usize> = of_count.chain(of_width).chain([values.len()]).collect();
        begins.sort_unstable();
        begins.dedup();
        Self(Sums(begins.iter().map(|&begin| sums.0.get(begin).copied().unwrap_or_default()).collect()))
    }

    /// How many parts.
    fn len(&self) -> usize {
        self.0.0.len().saturating_sub(1)
    }

    /// The weighed squares of the differences of the values of some parts from their mean.
    fn cost(&self, from: usize, to: usize) -> f64 {
        self.0.between(from, to).map_or(0.0, Moments::cost)
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
        codes.extend(parts.0.between(from, to).and_then(Moments::mean));
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
        let codes = codebook([3.0, -1.0, 3.0, 0.5].map(Weighed::alike).to_vec());
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
        let codes = codebook(values.iter().copied().map(Weighed::alike).collect());
        assert!(codes.is_sorted());
        assert!(squares(&codes, &values) < squares(&equal, &values) / 1.8);
    }

    #[test]
    fn values_that_count_more_are_nearer() {
        let weighed = |heavy: f64| {
            let weight = move |at: u32| if at < 1000 { heavy } else { 1.0 };
            let values = (0..100_000).map(|at| Weighed { value: at as f32, weight: weight(at) });
            let codes = codebook(values.collect());
            (0..1000)
                .map(|at| (codes[usize::from(nearest(&codes, at as f32))] - at as f32).powi(2))
                .sum::<f32>()
        };
        assert!(weighed(1e4) < weighed(1.0) / 4.0);
    }

    #[test]
    fn every_value_chooses_the_nearest_code() {
        let codes = codebook((0..1000).map(|at| Weighed::alike((at as f32).sin() * 3.0)).collect());
        for value in [-5.0, -2.9, 0.0, 0.013, 2.99, 7.0] {
            let chosen = codes[usize::from(nearest(&codes, value))];
            assert!(codes.iter().all(|code| (code - value).abs() >= (chosen - value).abs()));
        }
    }
}
