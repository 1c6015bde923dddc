//! Clause 8.4 from the other side: coding the symbols of a block.

use super::lanes::Segments;
use super::model::PlaneModel;
use super::token::split;
use super::{FREQUENCY_BITS, MAX_LANES, STATE_LOW};
use crate::bits::BitWriter;
use crate::payload::write_leb128;
use crate::{Error, ErrorKind, Result};

/// A plane model arranged for coding. Built once a unit, shared by its blocks.
#[derive(Debug, Clone)]
pub struct PlaneEncoder {
    direct_log2: u8,
    /// Frequency and first slot of each token, table by table, as many of each table as the longest has.
    intervals: Vec<(u16, u16)>,
    tokens: usize,
    /// Where the intervals of the table of each context start.
    start_of_context: Vec<usize>,
}

impl PlaneEncoder {
    /// Expands the tables of a model.
    pub fn new(model: &PlaneModel) -> Self {
        let tokens = model.tables.iter().map(|table| table.of_token().len()).max().unwrap_or(0);
        let mut intervals = Vec::with_capacity(tokens.wrapping_mul(model.tables.len()));
        for table in &model.tables {
            let mut first = 0_u16;
            for token in 0..tokens {
                let frequency = table.of_token().get(token).copied().unwrap_or(0);
                intervals.push((frequency, first));
                first = first.wrapping_add(frequency);
            }
        }
        let start = |&table: &u8| usize::from(table).wrapping_mul(tokens);
        let start_of_context = model.table_of_context.iter().map(start).collect();
        Self { direct_log2: model.direct_log2, intervals, tokens, start_of_context }
    }

    /// Frequency and first slot of a token in a context; none if it has no frequency.
    #[inline]
    fn interval(&self, context: u8, token: u8) -> Option<(u16, u16)> {
        let token = usize::from(token);
        let start = self.start_of_context.get(usize::from(context)).filter(|_| token < self.tokens)?;
        self.intervals.get(start.wrapping_add(token)).copied().filter(|&(frequency, _)| frequency > 0)
    }
}

#[derive(Debug, Clone, Copy)]
struct Symbol {
    lane: u8,
    frequency: u16,
    first: u16,
}

/// Collects the symbols of one block in reading order; [`BlockWriter::finish`] codes them backwards.
#[derive(Debug)]
pub struct BlockWriter {
    lanes_log2: u8,
    symbols: Vec<Symbol>,
    raw: BitWriter,
}

impl BlockWriter {
    /// An empty block with 2^`lanes_log2` states, at most 32.
    pub fn new(lanes_log2: u8) -> Self {
        Self { lanes_log2: lanes_log2.min(5), symbols: Vec::new(), raw: BitWriter::new() }
    }

    /// Adds a plane: unsigned values and their contexts (empty: all 0).
    ///
    /// # Errors
    /// A value whose token has no frequency in its context's table cannot be coded.
    pub fn plane(
        &mut self,
        encoder: &PlaneEncoder,
        contexts: &[u8],
        values: impl ExactSizeIterator<Item = u64>,
    ) -> Result<()> {
        let values: Vec<u64> = values.collect();
        self.symbols.reserve(values.len());
        let uncodable = Error::new(
            0,
            "8.3",
            ErrorKind::Constraint { rule: "a coded token has a frequency of at least 1" },
        );
        let segments = Segments::new(values.len(), self.lanes_log2);
        for step in 0..segments.length() {
            let mut index = step;
            for lane in 0..u8::try_from(segments.active(step)).unwrap_or(u8::MAX) {
                let value = values.get(index).copied().unwrap_or(0);
                let context = contexts.get(index).copied().unwrap_or(0);
                let token = split(value, encoder.direct_log2);
                let (frequency, first) = encoder.interval(context, token.token).ok_or(uncodable)?;
                self.symbols.push(Symbol { lane, frequency, first });
                if token.raw_bits > 0 {
                    self.raw.bits(token.raw, token.raw_bits);
                }
                index = index.wrapping_add(segments.length());
            }
        }
        Ok(())
    }

    /// The bytes of the block, clause 5.13.
    pub fn finish(self) -> Vec<u8> {
        let mut states = [STATE_LOW; MAX_LANES];
        let mut words: Vec<u16> = Vec::with_capacity(self.symbols.len() / 2);
        for symbol in self.symbols.iter().rev() {
            let Some(state) = states.get_mut(usize::from(symbol.lane)) else { continue };
            let frequency = u32::from(symbol.frequency);
            if u64::from(*state) >= u64::from(frequency).wrapping_shl(20) {
                let [low, high, ..] = state.to_le_bytes();
                words.push(u16::from_le_bytes([low, high]));
                *state = state.wrapping_shr(16);
            }
            let quotient = state.checked_div(frequency).unwrap_or(0);
            let remainder = state.wrapping_sub(quotient.wrapping_mul(frequency));
            *state = quotient
                .wrapping_shl(FREQUENCY_BITS)
                .wrapping_add(remainder)
                .wrapping_add(u32::from(symbol.first));
        }
        let lanes = 1_usize.wrapping_shl(u32::from(self.lanes_log2));
        let raw = self.raw.into_bytes();
        let mut bytes =
            Vec::with_capacity(words.len().wrapping_mul(2).wrapping_add(raw.len()).wrapping_add(133));
        write_leb128(u32::try_from(words.len()).unwrap_or(u32::MAX), &mut bytes);
        for state in states.iter().take(lanes) {
            bytes.extend_from_slice(&state.to_le_bytes());
        }
        for word in words.iter().rev() {
            bytes.extend_from_slice(&word.to_le_bytes());
        }
        bytes.extend_from_slice(&raw);
        bytes
    }
}
