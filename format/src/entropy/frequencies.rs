//! Clause 8.3: a static frequency table and how it is carried.

use super::FREQUENCY_SUM;
use super::parametric::Parametric;
use super::token::Alphabet;
use crate::bits::BitWriter;

/// How a table is carried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Carried {
    /// Every frequency but that of this token, which the others imply.
    Explicit {
        /// The token.
        mode: u8,
    },
    /// Numbers that all frequencies follow from.
    Parametric(Parametric),
}

/// Frequencies of the tokens 0, 1, ...; they sum to [`FREQUENCY_SUM`], and the last is not zero.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Frequencies {
    of_token: Vec<u16>,
    carried: Carried,
}

impl Frequencies {
    /// The table in which only `token` occurs; it codes that token in no bits.
    pub fn single(token: u8) -> Self {
        let mut of_token = vec![0; usize::from(token)];
        of_token.push(4096);
        Self { of_token, carried: Carried::Explicit { mode: token } }
    }

    /// The frequency of each token.
    pub fn of_token(&self) -> &[u16] {
        &self.of_token
    }

    /// The only token, if there is just one.
    pub fn single_token(&self) -> Option<u8> {
        let (&last, others) = self.of_token.split_last()?;
        if u32::from(last) == FREQUENCY_SUM { u8::try_from(others.len()).ok() } else { None }
    }

    /// The table nearest to `counts` that can be carried; no counts at all give the single token 0.
    ///
    /// The most frequent token takes what rounding leaves, so its frequency is the one not carried.
    pub fn from_counts(counts: &[u64]) -> Self {
        let total: u64 = counts.iter().copied().fold(0, u64::saturating_add);
        let used = counts.iter().rposition(|&count| count > 0).map_or(0, |last| last.saturating_add(1));
        let counts = counts.get(..used.min(256)).unwrap_or_default();
        let mode = mode_of(counts);
        let occurring = counts.iter().filter(|&&count| count > 0).count();
        if occurring <= 1 {
            return Self::single(u8::try_from(mode).unwrap_or(0));
        }
        let mut scale = u64::from(FREQUENCY_SUM);
        loop {
            let mut of_token: Vec<u16> =
                counts.iter().map(|&count| carried_frequency(count, scale, total)).collect();
            if let Some(frequency) = of_token.get_mut(mode) {
                *frequency = 0;
            }
            let others: u32 = of_token.iter().map(|&frequency| u32::from(frequency)).sum();
            match FREQUENCY_SUM.checked_sub(others).and_then(|rest| u16::try_from(rest).ok()) {
                Some(rest) if rest > 0 => {
                    if let Some(frequency) = of_token.get_mut(mode) {
                        *frequency = rest;
                    }
                    let mode = u8::try_from(mode).unwrap_or(0);
                    return Self { of_token, carried: Carried::Explicit { mode } };
                }
                // Rounding up small counts took it all: shrink the others a little and try again.
                _ => scale = scale.saturating_sub(scale / 16),
            }
        }
    }

    /// The table of a distribution.
    pub fn parametric(parameters: Parametric, alphabet: Alphabet, direct_log2: u8) -> Self {
        let of_token = parameters.frequencies(alphabet, direct_log2);
        Self { of_token, carried: Carried::Parametric(parameters) }
    }

    /// Writes what clause 5.12 has after `table_kind` 3.
    pub fn write(&self, bits: &mut BitWriter, alphabet: Alphabet, largest_token: u8) {
        let is_parametric = matches!(self.carried, Carried::Parametric(_));
        bits.bits(u64::from(is_parametric), 1);
        let last = u8::try_from(self.of_token.len().saturating_sub(1)).unwrap_or(0);
        bits.bits(u64::from(last), token_bits(largest_token));
        match self.carried {
            Carried::Explicit { mode } => {
                bits.bits(u64::from(mode), token_bits(last));
                self.write_frequencies(bits, mode);
            }
            Carried::Parametric(Parametric { shape, zero_level, scale, centre, .. }) => {
                bits.bits(u64::from(shape), 2);
                bits.bits(u64::from(zero_level), 4);
                bits.bits(u64::from(scale), 6);
                if alphabet == Alphabet::Attribute {
                    bits.signed_exp_golomb(centre);
                }
            }
        }
    }

    /// Length and mantissa of every frequency but that of `mode`.
    fn write_frequencies(&self, bits: &mut BitWriter, mode: u8) {
        let mut previous = 0_i32;
        for (token, &frequency) in self.of_token.iter().enumerate() {
            if token == usize::from(mode) {
                continue;
            }
            let frequency = u32::from(frequency);
            let length = bit_length(frequency);
            let signed = i32::try_from(length).unwrap_or(0);
            bits.signed_exp_golomb(signed.wrapping_sub(previous));
            previous = signed;
            let (mantissa_bits, shift) = mantissa(length);
            bits.bits(u64::from(frequency.wrapping_shr(shift)), mantissa_bits);
        }
    }

    /// The table of explicit frequencies; the one of `mode`, 0 in `of_token`, is what the others leave.
    ///
    /// `None` if that is not 1 to 4095, or the last token has no frequency (6.12).
    pub fn with_implied(mut of_token: Vec<u16>, mode: u8) -> Option<Self> {
        let others: u32 = of_token.iter().map(|&frequency| u32::from(frequency)).sum();
        let implied = FREQUENCY_SUM.checked_sub(others).filter(|&rest| rest > 0 && rest < FREQUENCY_SUM)?;
        *of_token.get_mut(usize::from(mode))? = u16::try_from(implied).ok()?;
        (of_token.last() != Some(&0)).then_some(Self { of_token, carried: Carried::Explicit { mode } })
    }
}

/// Bits of an element that holds a token up to `largest`.
pub(super) const fn token_bits(largest: u8) -> u32 {
    u8::BITS.wrapping_sub(largest.leading_zeros())
}

/// The first of the largest entries.
fn mode_of<T: Ord + Copy>(values: &[T]) -> usize {
    let mut best: Option<(usize, T)> = None;
    for (index, &value) in values.iter().enumerate() {
        if best.is_none_or(|(_, largest)| value > largest) {
            best = Some((index, value));
        }
    }
    best.map_or(0, |(index, _)| index)
}

/// Bit length: 0 for 0, else one more than the place of the leading one.
const fn bit_length(value: u32) -> u32 {
    u32::BITS.wrapping_sub(value.leading_zeros())
}

/// Mantissa bits carried below the leading one of a frequency of this length, and their place.
pub(super) const fn mantissa(length: u32) -> (u32, u32) {
    let below = length.saturating_sub(1);
    let carried = if below < 3 { below } else { 3 };
    (carried, below.wrapping_sub(carried))
}

/// The frequency nearest to `count * scale / total` that has four significant bits, at least 1.
fn carried_frequency(count: u64, scale: u64, total: u64) -> u16 {
    if count == 0 {
        return 0;
    }
    let exact = u128::from(count).saturating_mul(u128::from(scale));
    let total = u128::from(total.max(1));
    let rounded = exact.saturating_add(total / 2).checked_div(total).unwrap_or(0);
    let frequency = u32::try_from(rounded).unwrap_or(FREQUENCY_SUM).clamp(1, FREQUENCY_SUM.wrapping_sub(1));
    let (_, shift) = mantissa(bit_length(frequency));
    let half = 1_u32.wrapping_shl(shift) >> 1;
    let nearest = frequency.wrapping_add(half).wrapping_shr(shift).wrapping_shl(shift);
    u16::try_from(nearest.min(3840)).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_table_from_counts_sums_to_4096_keeps_every_token_and_reads_back(
            counts in prop::collection::vec(prop_oneof![Just(0_u64), 1_u64..5, 0_u64..1_000_000], 1..256)
        ) {
            let table = Frequencies::from_counts(&counts);
            prop_assert_eq!(table.of_token().iter().map(|&f| u32::from(f)).sum::<u32>(), FREQUENCY_SUM);
            for (token, &count) in counts.iter().enumerate() {
                if count > 0 {
                    prop_assert!(table.of_token()[token] > 0);
                }
            }
            let Carried::Explicit { mode } = table.carried else { panic!("counts give an explicit table") };
            let others = |(token, &f)| if token == usize::from(mode) { 0 } else { f };
            let implied =
                Frequencies::with_implied(table.of_token().iter().enumerate().map(others).collect(), mode);
            prop_assert_eq!(implied, table.single_token().is_none().then_some(table));
        }

        #[test]
        fn a_parametric_table_sums_to_4096_and_keeps_every_token(
            alphabet in prop::sample::select(vec![Alphabet::Attribute, Alphabet::Position, Alphabet::Index]),
            direct_log2 in 2_u8..=5, last in any::<u8>(), shape in 0_u8..4, zero_level in 0_u8..16,
            scale in 0_u8..=Parametric::MAX_SCALE, centre in prop_oneof![-9..9_i32, -32768..32768_i32]
        ) {
            let last = last.min(alphabet.last_token(direct_log2).unwrap());
            let parameters = Parametric { last, shape, zero_level, scale, centre };
            let table = Frequencies::parametric(parameters, alphabet, direct_log2);
            prop_assert_eq!(table.of_token().len(), usize::from(last) + 1);
            prop_assert_eq!(table.of_token().iter().map(|&f| u32::from(f)).sum::<u32>(), FREQUENCY_SUM);
            prop_assert!(table.of_token().iter().all(|&f| f > 0));
        }
    }
}
