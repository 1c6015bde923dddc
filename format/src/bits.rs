//! Clause 4.4: bits within bytes, least significant bit first.

use crate::{Error, ErrorKind, Result};

/// Reads bits from a byte slice, least significant bit of the first byte first.
///
/// Reading past the end gives zeros and is remembered: [`BitReader::finish`] reports it. So an inner loop
/// needs no branch an error would take.
#[derive(Debug, Clone, Copy)]
pub struct BitReader<'a> {
    bytes: &'a [u8],
    /// The last eight bytes, or as many as there are, and where they start: what is read where fewer are left.
    tail: (u64, usize),
    /// Bits read so far.
    position: u64,
}

impl<'a> BitReader<'a> {
    /// The most bits that one call of [`BitReader::bits`] may ask for.
    pub const MAX_BITS: u32 = 57;

    /// Starts at bit 0 of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        let start = bytes.len().saturating_sub(8);
        let last = bytes.get(start..).unwrap_or_default();
        let word = last.iter().rev().fold(0, |word: u64, &byte| word.wrapping_shl(8) | u64::from(byte));
        Self { bytes, tail: (word, start), position: 0 }
    }

    /// Bits read so far, those past the end included.
    pub const fn position(&self) -> u64 {
        self.position
    }

    /// Bits there are in all.
    pub fn available(&self) -> u64 {
        u64::try_from(self.bytes.len()).unwrap_or(u64::MAX).saturating_mul(8)
    }

    /// Descriptor u(n), n at most [`BitReader::MAX_BITS`].
    #[inline(always)]
    pub fn bits(&mut self, count: u32) -> u64 {
        // Eight bytes from the one in which the bits start: they hold 57 bits or more of what is to come.
        let start = usize::try_from(self.position >> 3).unwrap_or(usize::MAX);
        let rest = self.bytes.get(start..).unwrap_or_default();
        let word = match rest.first_chunk::<8>() {
            Some(bytes) => u64::from_le_bytes(*bytes),
            None => self.last_bytes(start),
        };
        let bit = u32::try_from(self.position & 7).unwrap_or(0);
        let value = word.wrapping_shr(bit);
        self.position = self.position.wrapping_add(count.into());
        value & 1_u64.wrapping_shl(count).wrapping_sub(1)
    }

    /// What is left from a byte on, fewer than eight bytes, followed by zeros.
    fn last_bytes(&self, start: usize) -> u64 {
        let (word, first) = self.tail;
        let bits = u32::try_from(start.saturating_sub(first).saturating_mul(8)).unwrap_or(u32::MAX);
        word.checked_shr(bits).unwrap_or(0)
    }

    /// A small u(n) as a `u8`, n at most 8.
    pub fn small(&mut self, count: u32) -> u8 {
        let [low, ..] = self.bits(count.min(8)).to_le_bytes();
        low
    }

    /// Descriptor ue: z zero bits, a one, then z bits x; the value is 2^z - 1 + x. z is at most 31.
    pub fn exp_golomb(&mut self) -> Option<u32> {
        let mut zeros = 0_u32;
        while self.bits(1) == 0 {
            zeros = zeros.wrapping_add(1);
            if zeros > 31 {
                return None;
            }
        }
        let base = 1_u64.wrapping_shl(zeros).wrapping_sub(1);
        u32::try_from(base.wrapping_add(self.bits(zeros))).ok()
    }

    /// Descriptor se: an ue value k, odd k are positive: 0, 1, -1, 2, -2, ...
    pub fn signed_exp_golomb(&mut self) -> Option<i32> {
        let code = i64::from(self.exp_golomb()?);
        let half = code.wrapping_add(1) >> 1;
        i32::try_from(if code & 1 == 1 { half } else { half.wrapping_neg() }).ok()
    }

    /// True once more bits were asked for than there are.
    pub fn overran(&self) -> bool {
        self.position > self.available()
    }

    /// Checks that what is left is padding: fewer than eight bits, all zero.
    ///
    /// # Errors
    /// Malformed: the bits ran out, whole bytes are left, or the padding is not zero. `at` is the absolute
    /// offset of the section's first byte.
    pub fn finish(mut self, at: u64, element: &'static str, clause: &'static str) -> Result<()> {
        let end = at.wrapping_add(self.position.min(self.available()) / 8);
        if self.overran() {
            return Err(Error::new(end, clause, ErrorKind::ShortSection { element }));
        }
        let left = self.available().wrapping_sub(self.position);
        if left >= 8 {
            return Err(Error::new(end, clause, ErrorKind::TrailingBytes { element, bytes: left / 8 }));
        }
        let padding = self.bits(u32::try_from(left).unwrap_or(0));
        if padding != 0 {
            return Err(Error::new(end, clause, ErrorKind::Padding { element }));
        }
        Ok(())
    }
}

/// Writes bits in the order in which [`BitReader`] reads them.
#[derive(Debug, Clone, Default)]
pub struct BitWriter {
    bytes: Vec<u8>,
    /// The bits that do not fill eight bytes yet, and how many they are: fewer than 64. Higher ones are 0.
    pending: u64,
    pending_bits: u32,
}

impl BitWriter {
    /// An empty writer.
    pub fn new() -> Self {
        Self::default()
    }

    /// Descriptor u(n), n at most [`BitReader::MAX_BITS`]; higher bits of `value` are dropped.
    #[inline]
    pub fn bits(&mut self, value: u64, count: u32) {
        let value = value & 1_u64.wrapping_shl(count).wrapping_sub(1);
        self.pending |= value.wrapping_shl(self.pending_bits);
        let filled = self.pending_bits.wrapping_add(count);
        if filled >= 64 {
            self.bytes.extend_from_slice(&self.pending.to_le_bytes());
            // Seven bits or more were pending, since no more than 57 are added.
            self.pending = value.wrapping_shr(64_u32.wrapping_sub(self.pending_bits));
        }
        self.pending_bits = filled & 63;
    }

    /// Descriptor ue, `value` at most 2^32 - 2.
    pub fn exp_golomb(&mut self, value: u32) {
        let shifted = u64::from(value).wrapping_add(1);
        let zeros = shifted.ilog2();
        self.bits(0, zeros);
        self.bits(1, 1);
        self.bits(shifted, zeros);
    }

    /// Descriptor se, magnitude below 2^30.
    pub fn signed_exp_golomb(&mut self, value: i32) {
        let magnitude = value.unsigned_abs().wrapping_mul(2);
        self.exp_golomb(if value > 0 { magnitude.wrapping_sub(1) } else { magnitude });
    }

    /// Bits written so far.
    pub fn len_bits(&self) -> u64 {
        u64::try_from(self.bytes.len())
            .unwrap_or(u64::MAX)
            .saturating_mul(8)
            .saturating_add(u64::from(self.pending_bits))
    }

    /// Pads with zero bits to a whole byte.
    pub fn into_bytes(mut self) -> Vec<u8> {
        let begun = 0..self.pending_bits.div_ceil(8);
        self.bytes.extend(begun.zip(self.pending.to_le_bytes()).map(|(_, byte)| byte));
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_descriptor_reads_back(values in prop::collection::vec((any::<u64>(), 0_u32..=57, -1_000_000_i32..1_000_000), 0..50)) {
            let mut writer = BitWriter::new();
            for &(value, bits, signed) in &values {
                writer.bits(value, bits);
                writer.signed_exp_golomb(signed);
                writer.exp_golomb(signed.unsigned_abs());
            }
            let written = writer.len_bits();
            let bytes = writer.into_bytes();
            let mut reader = BitReader::new(&bytes);
            for &(value, bits, signed) in &values {
                prop_assert_eq!(reader.bits(bits), value & (1_u64 << bits).wrapping_sub(1));
                prop_assert_eq!(reader.signed_exp_golomb(), Some(signed));
                prop_assert_eq!(reader.exp_golomb(), Some(signed.unsigned_abs()));
            }
            prop_assert_eq!(reader.position(), written);
            prop_assert!(reader.finish(0, "test", "4.4").is_ok());
        }
    }

    #[test]
    fn reading_past_the_end_is_reported_at_the_end() {
        let mut reader = BitReader::new(&[0xFF]);
        assert_eq!(reader.bits(12), 0xFF);
        let error = reader.finish(100, "test", "4.4").unwrap_err();
        assert_eq!((error.at, error.kind.code()), (101, "SHORT_SECTION"));
    }
}
