//! Finds the distribution of clause 8.3 that codes counted tokens in the fewest bits.
//!
//! The search works with real numbers, which rank distributions nearly as the integers of the clause do; what is
//! taken in the end is compared by the integers.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "codes of tokens rise, scale and shape are small numbers of the syntax"
)]

use pulp::{Arch, Simd, WithSimd};
use splatstream_format::entropy::parametric::Parametric;
use splatstream_format::entropy::token::{Alphabet, join, unzigzag};

/// Tokens have eight bits, and an edge more.
const MOST_EDGES: usize = 257;

/// A token that occurs.
struct Counted {
    number: usize,
    /// Codes of its values: from the first to before the second.
    codes: [u64; 2],
    count: f64,
}

/// What a distribution is fitted to.
struct Sample {
    tokens: Vec<Counted>,
    alphabet: Alphabet,
    direct_log2: u8,
    last: u8,
}

/// The best distribution for `counts` of tokens, of which there is at least one.
pub(crate) fn fitted(counts: &[u64], alphabet: Alphabet, direct_log2: u8) -> Option<Parametric> {
    let first_code = |token: usize| join(u8::try_from(token).unwrap_or(u8::MAX), direct_log2).0;
    let occurring = counts.iter().enumerate().filter(|&(_, &count)| count > 0);
    let tokens: Vec<Counted> = occurring
        .map(|(token, &count)| Counted {
            number: token,
            codes: [first_code(token), first_code(token + 1)],
            count: count as f64,
        })
        .collect();
    let last = u8::try_from(counts.iter().rposition(|&count| count > 0)?).ok()?;
    let sample = Sample { tokens, alphabet, direct_log2, last };
    Some(sample.best())
}

/// Values that stand for a token, each half of its count: codes of many values have both signs.
fn values_of(token: &Counted, alphabet: Alphabet) -> [f64; 2] {
    let [first, end] = token.codes;
    let middle = first + (end - first) / 2;
    if alphabet != Alphabet::Attribute {
        return [middle as f64; 2];
    }
    let other = if end - first == 1 { middle } else { middle + 1 };
    [middle, other].map(|code| f64::from(unzigzag(code as u32)))
}

impl Sample {
    /// The best of the distributions around the mean, the median, the most frequent value and 0.
    fn best(&self) -> Parametric {
        let centre_bits = |centre: i32| 2.0 * libm::log2(1.0 + 2.0 * f64::from(centre.unsigned_abs()));
        let of_centre = |centre: i32| {
            let (bits, found) = self.descended(Parametric { shape: 2, ..self.start(centre) });
            (bits + centre_bits(centre), found)
        };
        let fewer =
            |one: (f64, Parametric), other: (f64, Parametric)| if other.0 < one.0 { other } else { one };
        let Some(mut best) = self.centres().into_iter().map(of_centre).reduce(fewer) else {
            return self.start(0);
        };
        // The centre is nearly the same for every shape.
        let mut from = best.1;
        for shape in [3, 1, 0] {
            let (bits, found) = self.descended(Parametric { shape, ..from });
            from = found;
            best = fewer(best, (bits + centre_bits(found.centre), found));
        }
        best.1
    }

    fn centres(&self) -> Vec<i32> {
        if self.alphabet != Alphabet::Attribute {
            return vec![0];
        }
        let halves =
            |token: &Counted| values_of(token, self.alphabet).map(|value| (value, token.count / 2.0));
        let mut values: Vec<(f64, f64)> = self.tokens.iter().flat_map(halves).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = values.iter().map(|(_, count)| count).sum();
        let mean = values.iter().map(|(value, count)| value * count).sum::<f64>() / total;
        let mut below = 0.0;
        let median = values.iter().find(|(_, count)| {
            below += count;
            2.0 * below >= total
        });
        let density = |token: &&Counted| token.count / (token.codes[1] - token.codes[0]) as f64;
        let densest = self.tokens.iter().max_by(|a, b| density(a).total_cmp(&density(b)));
        let mode = densest.map(|token| (values_of(token, self.alphabet)[0], 0.0));
        let mut centres: Vec<i32> = [Some(&(mean, 0.0)), median, mode.as_ref(), Some(&(0.0, 0.0))]
            .into_iter()
            .flatten()
            .map(|(value, _)| value.round().clamp(-32768.0, 32767.0) as i32)
            .collect();
        centres.sort_unstable();
        centres.dedup();
        centres
    }

    /// A distribution whose width is the mean distance from the centre.
    fn start(&self, centre: i32) -> Parametric {
        let total: f64 = self.tokens.iter().map(|token| token.count).sum();
        let distance = |token: &Counted| {
            let [one, other] = values_of(token, self.alphabet).map(|value| (value - f64::from(centre)).abs());
            (one + other) * token.count / 2.0
        };
        let mean = (self.tokens.iter().map(distance).sum::<f64>() / total).max(0.125);
        let scale = (2.0 * libm::log2(8.0 * mean)).round().clamp(0.0, f64::from(Parametric::MAX_SCALE)) as u8;
        Parametric { last: self.last, shape: 0, zero_level: 0, scale, centre }
    }

    /// Changes scale and zero level by steps that save bits, until none does.
    fn descended(&self, from: Parametric) -> (f64, Parametric) {
        let edges = Edges::new(self, from.centre);
        let natural = descended_at(&edges, Parametric { zero_level: 0, ..from });
        let observed = Parametric { zero_level: self.observed_level(from.centre), ..from };
        let given = descended_at(&edges, observed);
        if given.0 < natural.0 { given } else { natural }
    }

    /// The zero level of the share that the centre has.
    fn observed_level(&self, centre: i32) -> u8 {
        let total: f64 = self.tokens.iter().map(|token| token.count).sum();
        let at = |token: &&Counted| {
            let [first, end] = token.codes;
            end - first == 1 && values_of(token, self.alphabet).contains(&f64::from(centre))
        };
        let share = self.tokens.iter().find(at).map_or(0.0, |token| token.count) / total;
        (8.0 + libm::log2((share + 1e-3) / (1.0 - share + 1e-3))).round().clamp(1.0, 15.0) as u8
    }
}

/// As [`Sample::descended`], a zero level of 0 staying 0.
fn descended_at(edges: &Edges, from: Parametric) -> (f64, Parametric) {
    let mut best = (edges.bits(&from), from);
    loop {
        let before = best.0;
        for (scale, level) in [(2, 0), (-2, 0), (1, 0), (-1, 0), (0, 1), (0, -1)] {
            let here = best.1;
            let zero_level = match here.zero_level {
                0 => 0,
                old => old.saturating_add_signed(level).clamp(1, 15),
            };
            let scale = here.scale.saturating_add_signed(scale).min(Parametric::MAX_SCALE);
            let next = Parametric { scale, zero_level, ..here };
            let bits = if next == here { best.0 } else { edges.bits(&next) };
            if bits < best.0 {
                best = (bits, next);
            }
        }
        if best.0 >= before {
            return best;
        }
    }
}

/// Where tokens begin and end, as distances from a centre: what is the same for all distributions around it. Vectors of the
/// machine go through them.
#[derive(Debug)]
struct Edges {
    /// Of each token up to the last.
    counts: Vec<f64>,
    /// By edge, one more than tokens: the mass below it is `base + of_above·tail(above) + of_below·tail(below)`.
    base: Vec<f64>,
    above: Vec<[f64; 2]>,
    below: Vec<[f64; 2]>,
}

impl Edges {
    fn new(sample: &Sample, centre: i32) -> Self {
        let first_code = |token: usize| join(u8::try_from(token).unwrap_or(u8::MAX), sample.direct_log2).0;
        let tokens = usize::from(sample.last) + 1;
        let mut counts = vec![0.0; tokens];
        for token in &sample.tokens {
            counts.iter_mut().skip(token.number).take(1).for_each(|count| *count = token.count);
        }
        let mut edges = Self { counts, base: Vec::new(), above: Vec::new(), below: Vec::new() };
        for code in (0..=tokens).map(first_code) {
            let [above, below] = sides(code, f64::from(centre), sample.alphabet);
            edges.base.push(above[0] - below[0]);
            edges.above.push([above[1], above[2]]);
            edges.below.push([-below[1], below[2]]);
        }
        edges
    }

    /// Bits of all symbols under a distribution around the centre, without raw bits.
    fn bits(&self, parameters: &Parametric) -> f64 {
        Arch::new().dispatch(Bits { edges: self, real: Real::new(parameters) })
    }
}

/// The mass of the values before a code as the difference of two sides, each `base + sign·tail(distance)`; distances are in
/// sixteenths.
fn sides(code: u64, centre: f64, alphabet: Alphabet) -> [[f64; 3]; 2] {
    let side = |value: f64| match value - centre {
        beyond if beyond > 0.0 => [2.0, -1.0, 16.0 * (beyond - 1.0)],
        beyond => [0.0, 1.0, -16.0 * beyond],
    };
    match (alphabet, code) {
        (Alphabet::Attribute, _) => {
            let half = (code >> 1) as f64;
            [side(half + (code & 1) as f64), side(-half)]
        }
        (_, 0) => [[0.0; 3]; 2],
        (_, code) => [[1.0, -1.0, 16.0 * (code as f64 - 1.0)], [0.0; 3]],
    }
}

/// Values that go through the vectors of a machine side by side.
const LANES: usize = 8;

/// Counts the bits of all symbols.
struct Bits<'a> {
    edges: &'a Edges,
    real: Real,
}

impl WithSimd for Bits<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        match self.real.squarings {
            0 => self.with_squarings::<0>(),
            2 => self.with_squarings::<2>(),
            4 => self.with_squarings::<4>(),
            _ => self.with_squarings::<6>(),
        }
    }
}

impl Bits<'_> {
    #[inline(always)]
    fn with_squarings<const SQUARINGS: u8>(self) -> f64 {
        let Self { edges: Edges { counts, base, above, below }, real } = self;
        let mut masses = [0.0; MOST_EDGES];
        let edges = base.iter().zip(above).zip(below);
        for (mass, ((base, above), below)) in masses.iter_mut().zip(edges) {
            let [one, other] = [above, below].map(|side| side[0] * real.survival::<SQUARINGS>(side[1]));
            *mass = base + real.weight * (one + other);
        }
        let tokens = counts.len();
        let shared = 4096.0 - tokens as f64;
        let whole = masses.get(tokens).copied().unwrap_or(0.0);
        let scale = shared / whole.max(1e-9);
        let mut sums = [0.0; LANES];
        let ends = masses.get(1..).unwrap_or_default();
        for (counts, (starts, ends)) in counts.chunks(LANES).zip(masses.chunks(LANES).zip(ends.chunks(LANES)))
        {
            for (sum, (count, (start, end))) in
                sums.iter_mut().zip(counts.iter().zip(starts.iter().zip(ends)))
            {
                *sum += count * (12.0 - fast_log2(1.0 + scale * (end - start).max(0.0)));
            }
        }
        sums.iter().sum()
    }
}

/// The binary logarithm of a positive number to 1e-4: enough to rank distributions, and many times as fast as to the last
/// digit.
#[inline(always)]
fn fast_log2(value: f64) -> f64 {
    let bits = value.to_bits();
    let exponent = f64::from((bits >> 52) as i32) - 1023.0;
    let mantissa = f64::from_bits(bits & ((1 << 52) - 1) | (1023 << 52));
    // The series of the inverse hyperbolic tangent about the square root of two.
    let ratio = (mantissa - core::f64::consts::SQRT_2) / (mantissa + core::f64::consts::SQRT_2);
    let square = ratio * ratio;
    let series = ratio * (1.0 + square * (1.0 / 3.0 + square * 0.2));
    exponent + 0.5 + 2.0 * core::f64::consts::LOG2_E * series
}

/// The distribution in real numbers; the mass of one side without the centre is `weight`.
struct Real {
    width: f64,
    squarings: u8,
    weight: f64,
}

impl Real {
    fn new(parameters: &Parametric) -> Self {
        let &Parametric { shape, zero_level, scale, .. } = parameters;
        let squarings = 2 * shape;
        let width = f64::from(2 | (scale & 1)) * libm::exp2(f64::from((scale >> 1) + squarings));
        let weight = match zero_level {
            0 => (0..squarings).fold(width / (width + 8.0), |part, _| part * part),
            level => 1.0 / (1.0 + libm::exp2(f64::from(level) - 8.0)),
        };
        Self { width, squarings, weight }
    }

    /// The part beyond a distance in sixteenths, of what lies beyond 0.
    #[inline(always)]
    fn survival<const SQUARINGS: u8>(&self, distance: f64) -> f64 {
        (0..SQUARINGS).fold(self.width / (self.width + distance), |part, _| part * part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_format::entropy::token::{split, zigzag};

    #[test]
    fn a_distribution_is_found_again() {
        let drawn = Parametric { last: 40, shape: 2, zero_level: 0, scale: 12, centre: -3 };
        let frequencies = drawn.frequencies(Alphabet::Attribute, 4);
        let counts: Vec<u64> = frequencies.iter().map(|&frequency| u64::from(frequency)).collect();
        let found = fitted(&counts, Alphabet::Attribute, 4).unwrap();
        assert_eq!((found.centre, found.last), (-3, 40));
        assert!(found.scale.abs_diff(12) <= 2, "{found:?}");
    }

    #[test]
    fn one_value_alone_is_in_the_middle() {
        let mut counts = vec![0_u64; 64];
        counts[usize::from(split(u64::from(zigzag(-5)), 4).token)] = 100;
        assert_eq!(fitted(&counts, Alphabet::Attribute, 4).unwrap().centre, -5);
        assert_eq!(fitted(&[0; 64], Alphabet::Attribute, 4), None);
    }
}
