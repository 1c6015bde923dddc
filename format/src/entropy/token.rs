//! Clause 8.2: an unsigned value as a token and raw bits.

/// What a value of a plane may be, and so which tokens may occur.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alphabet {
    /// Signed attribute values, mapped to unsigned by [`zigzag`]; below 2^17 after mapping.
    Attribute,
    /// Morton deltas, below 2^60.
    Position,
    /// Indices into a codebook, below 2^16.
    Index,
}

impl Alphabet {
    /// Largest bit length, less one, of a value that has raw bits.
    pub const fn max_exponent(self) -> u32 {
        match self {
            Self::Attribute => 16,
            Self::Position => 59,
            Self::Index => 15,
        }
    }

    /// The largest token for `direct_log2`, if all tokens fit in a byte; they do for none above 7.
    pub fn last_token(self, direct_log2: u8) -> Option<u8> {
        u8::try_from(token_base(u32::from(direct_log2), self.max_exponent()).wrapping_add(3)).ok()
    }
}

/// The first token of the values with exponent `exponent`.
const fn token_base(direct_log2: u32, exponent: u32) -> u32 {
    1_u32.wrapping_shl(direct_log2).wrapping_add(exponent.wrapping_sub(direct_log2).wrapping_mul(4))
}

/// A value split in its coded parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Token {
    /// The entropy-coded part.
    pub token: u8,
    /// How many raw bits follow.
    pub raw_bits: u32,
    /// Their value.
    pub raw: u64,
}

/// Splits `value`; values below 2^direct_log2 are tokens of their own, above them a token holds the
/// exponent and the two bits below the leading one.
#[inline]
pub fn split(value: u64, direct_log2: u8) -> Token {
    let raw_bits = raw_bits(value, direct_log2);
    let direct_log2 = u32::from(direct_log2);
    if value < 1_u64.wrapping_shl(direct_log2) {
        let [token, ..] = value.to_le_bytes();
        return Token { token, raw_bits, raw: 0 };
    }
    let exponent = value.ilog2();
    let [top, ..] = value.wrapping_shr(raw_bits).to_le_bytes();
    let [token, ..] = token_base(direct_log2, exponent).wrapping_add(u32::from(top & 3)).to_le_bytes();
    Token { token, raw_bits, raw: value & 1_u64.wrapping_shl(raw_bits).wrapping_sub(1) }
}

/// How many raw bits [`split`] leaves of a value: those below the three highest, none of a token of its own. Without a branch,
/// which would often be taken wrongly.
#[inline]
pub(super) fn raw_bits(value: u64, direct_log2: u8) -> u32 {
    let direct = 1_u64.wrapping_shl(direct_log2.into());
    let below_top = (value | direct).ilog2().wrapping_sub(2);
    if value < direct { 0 } else { below_top }
}

/// The smallest value of a token and its number of raw bits; the inverse of [`split`].
pub fn join(token: u8, direct_log2: u8) -> (u64, u32) {
    let direct = 1_u32.wrapping_shl(u32::from(direct_log2));
    let token = u32::from(token);
    if token < direct {
        return (u64::from(token), 0);
    }
    let above = token.wrapping_sub(direct);
    let raw_bits = u32::from(direct_log2).wrapping_add(above >> 2).wrapping_sub(2);
    (u64::from(4 | (above & 3)).wrapping_shl(raw_bits), raw_bits)
}

/// Clause 4.5: signed to unsigned, 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
#[inline]
pub const fn zigzag(value: i32) -> u32 {
    (value.wrapping_shl(1) ^ (value >> 31)).cast_unsigned()
}

/// The inverse of [`zigzag`].
#[inline]
pub const fn unzigzag(value: u32) -> i32 {
    (value >> 1).cast_signed() ^ (value & 1).cast_signed().wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_value_is_its_token_and_its_raw_bits(value in 0_u64..1 << 60, shift in 0_u32..60, direct_log2 in 2_u8..=4) {
            let value = value >> shift;
            let token = split(value, direct_log2);
            let (base, raw_bits) = join(token.token, direct_log2);
            prop_assert_eq!(raw_bits, token.raw_bits);
            prop_assert_eq!(base.checked_add(token.raw), Some(value));
            prop_assert!(token.token <= Alphabet::Position.last_token(direct_log2).unwrap());
        }

        #[test]
        fn zigzag_is_a_bijection(value in any::<i32>()) {
            prop_assert_eq!(unzigzag(zigzag(value)), value);
        }
    }

    #[test]
    fn small_magnitudes_have_small_codes() {
        assert_eq!([0, -1, 1, -2].map(zigzag), [0, 1, 2, 3]);
        assert_eq!(Alphabet::Attribute.last_token(7), Some(167));
        assert_eq!(Alphabet::Position.last_token(5), Some(251));
    }
}
