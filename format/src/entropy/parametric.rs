//! Clause 8.3: a frequency table that follows from a few numbers.

use super::FREQUENCY_SUM;
use super::token::{Alphabet, join};

/// Distances from the centre, less 1, that count in full; greater ones count as this one.
const FAR: u64 = 1 << 36;

/// A distribution of values around a centre that falls off as a power of the distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Parametric {
    /// The largest token.
    pub last: u8,
    /// How fast the tails fall: as the power -4^`shape` of the distance; at most 3.
    pub shape: u8,
    /// 0, or the probability of the centre: its odds are 2^(`zero_level` - 8); at most 15.
    pub zero_level: u8,
    /// Half octaves of the width; at most [`Self::MAX_SCALE`].
    pub scale: u8,
    /// The value in the middle, 16 bits; 0 for alphabets without sign.
    pub centre: i32,
}

impl Parametric {
    /// The largest `scale`.
    pub const MAX_SCALE: u8 = 63;

    /// The frequency of each token up to the last: 1, and its share of the rest by the mass of its values.
    pub fn frequencies(&self, alphabet: Alphabet, direct_log2: u8) -> Vec<u16> {
        let tails = Tails::new(self);
        let mass_below = |token: u8| {
            let (value, _) = join(token, direct_log2);
            tails.mass_below(value, alphabet)
        };
        let last = u32::from(self.last);
        let shared = u64::from(FREQUENCY_SUM.wrapping_sub(1).wrapping_sub(last));
        let whole = mass_below(self.last.saturating_add(1)).max(1);
        let cumulative = |token: u8| {
            let share = shared.wrapping_mul(mass_below(token)).checked_div(whole).unwrap_or(0);
            u32::from(token).wrapping_add(u32::try_from(share).unwrap_or(0))
        };
        let mut frequencies = Vec::with_capacity(usize::from(self.last).wrapping_add(1));
        let mut first = 0_u32;
        for token in 0..=self.last {
            let end = if token == self.last { FREQUENCY_SUM } else { cumulative(token.wrapping_add(1)) };
            frequencies.push(u16::try_from(end.wrapping_sub(first)).unwrap_or(0));
            first = end;
        }
        frequencies
    }
}

/// The mass on one side of the centre, in units of 2^-16. No intermediate number reaches 2^63.
struct Tails {
    centre: i64,
    /// In sixteenths; below 2^39.
    width: u64,
    squarings: u8,
    /// The mass without the centre.
    weight: u64,
}

impl Tails {
    fn new(parameters: &Parametric) -> Self {
        let &Parametric { shape, zero_level, scale, centre, .. } = parameters;
        let squarings = shape.wrapping_mul(2);
        let width = u64::from(2 | (scale & 1)).wrapping_shl(u32::from((scale >> 1).wrapping_add(squarings)));
        let mut tails = Self { centre: i64::from(centre), width, squarings, weight: 0 };
        tails.weight = match zero_level {
            0 => tails.survival(8),
            level => {
                (1_u64 << 24).checked_div(1_u64.wrapping_shl(u32::from(level)).wrapping_add(256)).unwrap_or(0)
            }
        };
        tails
    }

    /// The part beyond a distance in sixteenths, of what lies beyond 0.
    fn survival(&self, distance: u64) -> u64 {
        let mut part =
            self.width.wrapping_shl(16).checked_div(self.width.wrapping_add(distance)).unwrap_or(0);
        for _ in 0..self.squarings {
            part = part.wrapping_mul(part) >> 16;
        }
        part
    }

    /// The mass from `distance` on, which is at least 1.
    fn tail(&self, distance: u64) -> u64 {
        let sixteenths = distance.wrapping_sub(1).min(FAR).wrapping_mul(16);
        self.weight.wrapping_mul(self.survival(sixteenths)) >> 16
    }

    /// The mass of the signed values below `value`.
    fn signed_mass_below(&self, value: i64) -> u64 {
        let beyond = value.wrapping_sub(self.centre);
        if beyond > 0 {
            (1_u64 << 17).wrapping_sub(self.tail(beyond.unsigned_abs()))
        } else {
            self.tail(beyond.unsigned_abs().wrapping_add(1))
        }
    }

    /// The mass of the values whose codes (8.1) are below `code`.
    fn mass_below(&self, code: u64, alphabet: Alphabet) -> u64 {
        match alphabet {
            Alphabet::Attribute => {
                let half = i64::try_from(code >> 1).unwrap_or(0);
                let above = half.wrapping_add(i64::try_from(code & 1).unwrap_or(0));
                self.signed_mass_below(above).wrapping_sub(self.signed_mass_below(half.wrapping_neg()))
            }
            Alphabet::Position | Alphabet::Index => match code {
                0 => 0,
                code => (1_u64 << 16).wrapping_sub(self.tail(code)),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bits::BitWriter;
    use crate::entropy::frequencies::Frequencies;
    use crate::entropy::model::{ContextAxis, PlaneModel, read_models, write_models};

    fn parameters(last: u8, shape: u8, zero_level: u8, scale: u8, centre: i32) -> Parametric {
        Parametric { last, shape, zero_level, scale, centre }
    }

    #[test]
    fn the_examples_of_8_3() {
        assert_eq!(
            parameters(9, 2, 0, 3, 0).frequencies(Alphabet::Attribute, 2),
            [2952, 520, 520, 44, 43, 6, 6, 2, 1, 2]
        );
        assert_eq!(
            parameters(12, 1, 6, 5, -2).frequencies(Alphabet::Attribute, 3),
            [307, 1120, 111, 820, 49, 1120, 24, 307, 123, 56, 28, 15, 16]
        );
        let deltas = parameters(20, 0, 0, 9, 0).frequencies(Alphabet::Position, 2);
        assert_eq!(deltas.get(..8), Some([602, 902, 542, 361, 259, 194, 151, 122].as_slice()));
    }

    #[test]
    fn values_far_beyond_the_width_share_what_rounding_leaves() {
        let far = parameters(251, 0, 15, 63, 0).frequencies(Alphabet::Position, 5);
        assert_eq!(far.iter().map(|&frequency| u32::from(frequency)).sum::<u32>(), FREQUENCY_SUM);
        assert_eq!(far.last(), Some(&1));
        let off_centre = parameters(9, 3, 0, 0, -32768).frequencies(Alphabet::Attribute, 2);
        assert_eq!(off_centre, [1, 1, 1, 1, 1, 1, 1, 1, 1, 4087]);
    }

    #[test]
    fn a_model_with_a_parametric_table_comes_back() {
        for (alphabet, centre) in
            [(Alphabet::Attribute, -32768), (Alphabet::Position, 0), (Alphabet::Index, 0)]
        {
            let table = Frequencies::parametric(parameters(63, 3, 15, 63, centre), alphabet, 4);
            let axes = [ContextAxis::NONE, ContextAxis::NONE];
            let model =
                PlaneModel { bias: 0, direct_log2: 4, axes, tables: vec![table], table_of_context: vec![0] };
            let written = write_models(core::slice::from_ref(&model), &[alphabet], None);
            assert_eq!(read_models(&written, 0, &[alphabet], &[None], &mut ()).unwrap(), [model]);
        }
    }

    #[test]
    fn a_centre_has_16_bits() {
        for (centre, error) in [(32767, None), (32768, Some("CONSTRAINT")), (-32769, Some("CONSTRAINT"))] {
            let mut bits = BitWriter::new();
            bits.bits(0, 1);
            bits.signed_exp_golomb(0);
            bits.bits(0, 3 + 4);
            bits.bits(0b111, 2 + 1);
            bits.bits(63, 6 + 2 + 4 + 6);
            bits.signed_exp_golomb(centre);
            let read = read_models(&bits.into_bytes(), 0, &[Alphabet::Attribute], &[None], &mut ());
            assert_eq!(read.err().map(|error| error.kind.code()), error, "{centre}");
        }
    }
}
