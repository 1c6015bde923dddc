//! Clause 8.4 from the other side: coding the symbols of a block.

use super::frequencies::Frequencies;
use super::lanes::Segments;
use super::model::PlaneModel;
use super::token::{raw_bits, split};
use super::{FREQUENCY_BITS, MAX_LANES, STATE_LOW};
use crate::bits::BitWriter;
use crate::payload::write_leb128;
use crate::{Error, ErrorKind, Result};
use std::borrow::Cow;

/// Contexts of a plane, at most, for which a place is kept: all that a byte can name.
const CONTEXTS: usize = 1 << 8;
/// Tokens of a table.
const TOKENS: usize = 1 << 8;
/// A place of a table at which there is none: a plane has at most 64 contexts, and no more tables.
const NO_TABLE: u8 = u8::MAX;

/// A plane model arranged for coding. Built once a unit, shared by its blocks.
#[derive(Debug, Clone)]
pub struct PlaneEncoder {
    direct_log2: u8,
    /// The symbol of each token, table by table; those of frequency 0 cannot be coded.
    symbols: Vec<[Symbol; TOKENS]>,
    /// The table of each context, [`NO_TABLE`] of those that the model does not have.
    table_of_context: [u8; CONTEXTS],
}

/// The slots of a token among all that its table has.
#[derive(Debug, Clone, Copy, Default)]
struct Symbol {
    frequency: u16,
    first: u16,
}

impl PlaneEncoder {
    /// Expands the tables of a model.
    pub fn new(model: &PlaneModel) -> Self {
        let expanded = |of_token: &[u16]| {
            let mut symbols = [Symbol::default(); TOKENS];
            let mut first = 0_u16;
            for (symbol, &frequency) in symbols.iter_mut().zip(of_token) {
                *symbol = Symbol { frequency, first };
                first = first.wrapping_add(frequency);
            }
            symbols
        };
        let of_tables = model.tables.iter().map(Frequencies::of_token);
        let mut table_of_context = [NO_TABLE; CONTEXTS];
        table_of_context.iter_mut().zip(&model.table_of_context).for_each(|(to, &table)| *to = table);
        Self { direct_log2: model.direct_log2, symbols: of_tables.map(expanded).collect(), table_of_context }
    }

    /// The slots of a token in a context; none of them if it cannot be coded there.
    #[inline(always)]
    fn symbol(&self, context: u8, token: u8) -> Symbol {
        let table = self.table_of_context.get(usize::from(context)).copied().unwrap_or(NO_TABLE);
        let symbols = self.symbols.get(usize::from(table));
        symbols.and_then(|symbols| symbols.get(usize::from(token))).copied().unwrap_or_default()
    }
}

/// Collects the symbols of one block; [`BlockWriter::finish`] codes them backwards.
#[derive(Debug)]
pub struct BlockWriter {
    lanes_log2: u8,
    /// Plane by plane, as the values stand there, but lanes a [`stride`] apart.
    symbols: Vec<Symbol>,
    /// Where each plane starts among the symbols, and its segments.
    planes: Vec<(usize, Segments)>,
    raw: BitWriter,
}

/// Symbols of a cache line.
const SYMBOLS_OF_LINE: usize = 16;

/// How far apart the first symbols of two lanes are in memory: a cache line farther than they need be. Lanes take turns, and
/// segments of a power of two would have all of their symbols in a few sets of the cache, which hold fewer lines than there are
/// lanes.
const fn stride(segments: Segments) -> usize {
    segments.length().wrapping_add(SYMBOLS_OF_LINE)
}

impl BlockWriter {
    /// An empty block with 2^`lanes_log2` states, at most 32.
    pub fn new(lanes_log2: u8) -> Self {
        Self { lanes_log2: lanes_log2.min(5), symbols: Vec::new(), planes: Vec::new(), raw: BitWriter::new() }
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
        let mut contexts = Cow::Borrowed(contexts);
        if contexts.len() < values.len() {
            contexts.to_mut().resize(values.len(), 0);
        }
        let (start, segments) = (self.symbols.len(), Segments::new(values.len(), self.lanes_log2));
        let mut can_be_coded = true;
        let mut has_raw_bits = false;
        let lanes = values.chunks(segments.length()).zip(contexts.chunks(segments.length()));
        for (lane, (values, contexts)) in lanes.enumerate() {
            let first = start.wrapping_add(lane.wrapping_mul(stride(segments)));
            self.symbols.resize(first, Symbol::default());
            self.symbols.extend(values.iter().zip(contexts).map(|(&value, &context)| {
                let token = split(value, encoder.direct_log2);
                let symbol = encoder.symbol(context, token.token);
                can_be_coded &= symbol.frequency > 0;
                has_raw_bits |= token.raw_bits > 0;
                symbol
            }));
        }
        if !can_be_coded {
            let rule = "a coded token has a frequency of at least 1";
            return Err(Error::new(0, "8.3", ErrorKind::Constraint { rule }));
        }
        if has_raw_bits {
            self.raw_bits(encoder.direct_log2, &values, segments);
        }
        self.planes.push((start, segments));
        Ok(())
    }

    /// Writes what tokens do not say of values, in reading order.
    fn raw_bits(&mut self, direct_log2: u8, values: &[u64], segments: Segments) {
        for step in 0..segments.length() {
            for &value in values.iter().skip(step).step_by(segments.length()) {
                self.raw.bits(value, raw_bits(value, direct_log2));
            }
        }
    }

    /// The bytes of the block, clause 5.13.
    pub fn finish(self) -> Vec<u8> {
        let mut states = States::new(self.symbols.len());
        let mut end = self.symbols.len();
        for &(start, segments) in self.planes.iter().rev() {
            states.code(self.symbols.get(start..end).unwrap_or_default(), segments);
            end = start;
        }
        let lanes = 1_usize.wrapping_shl(u32::from(self.lanes_log2));
        let raw = self.raw.into_bytes();
        let words = states.words.get(..states.written).unwrap_or_default();
        let mut bytes =
            Vec::with_capacity(words.len().wrapping_mul(2).wrapping_add(raw.len()).wrapping_add(133));
        write_leb128(u32::try_from(words.len()).unwrap_or(u32::MAX), &mut bytes);
        for state in states.of_lanes.iter().take(lanes) {
            bytes.extend_from_slice(&state.to_le_bytes());
        }
        let start = bytes.len();
        bytes.resize(start.wrapping_add(words.len().wrapping_mul(2)), 0);
        let (places, _) = bytes.get_mut(start..).unwrap_or_default().as_chunks_mut::<2>();
        places.iter_mut().zip(words.iter().rev()).for_each(|(place, word)| *place = word.to_le_bytes());
        bytes.extend_from_slice(&raw);
        bytes
    }
}

/// Frequencies that there are, 0 among them.
const FREQUENCIES: usize = 1_usize.wrapping_shl(FREQUENCY_BITS).wrapping_add(1);

/// 2^44 divided by each frequency, rounded up; 0 for frequency 0, which codes nothing.
static RECIPROCALS: [u64; FREQUENCIES] = reciprocals();

const fn reciprocals() -> [u64; FREQUENCIES] {
    let mut reciprocals = [0_u64; FREQUENCIES];
    let mut rest = reciprocals.as_mut_slice();
    let mut frequency = 0_u64;
    while let Some((reciprocal, others)) = rest.split_first_mut() {
        *reciprocal = if frequency == 0 { 0 } else { 1_u64.wrapping_shl(44).div_ceil(frequency) };
        frequency = frequency.wrapping_add(1);
        rest = others;
    }
    reciprocals
}

/// A state divided by a frequency, by multiplication, which takes a fraction of the time and is exact.
///
/// The reciprocal of f is larger than 2^44 / f by less than 1. So the product is larger than 2^44 x / f by less than x < 2^32, which
/// is less than the 2^44 / f by which the next integer is above, since f is at most 2^12. And x < 2^20 f, so that the product is below
/// 2^64.
#[inline(always)]
fn quotient(state: u32, frequency: u32) -> u32 {
    let reciprocal = usize::try_from(frequency).ok().and_then(|at| RECIPROCALS.get(at)).copied().unwrap_or(0);
    let [a, b, c, d, ..] = (u64::from(state).wrapping_mul(reciprocal) >> 44).to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

/// The states of a block, and the words that left them.
struct States {
    of_lanes: [u32; MAX_LANES],
    /// One for each symbol, more than ever leave.
    words: Vec<u16>,
    written: usize,
}

impl States {
    fn new(symbols: usize) -> Self {
        Self { of_lanes: [STATE_LOW; MAX_LANES], words: vec![0; symbols], written: 0 }
    }

    /// Codes the symbols of a plane, from the last that is read to the first.
    fn code(&mut self, plane: &[Symbol], segments: Segments) {
        let stride = stride(segments);
        for step in (0..segments.length()).rev() {
            let active = segments.active(step);
            let mut index = step.wrapping_add(active.wrapping_mul(stride));
            for state in self.of_lanes.iter_mut().take(active).rev() {
                index = index.wrapping_sub(stride);
                let Symbol { frequency, first } = plane.get(index).copied().unwrap_or_default();
                let frequency = u32::from(frequency);
                // A word leaves a state that would grow too large. It is written in any case, and counted if it leaves: what
                // comes cannot be foreseen, and a branch would be taken wrongly as often as words leave.
                let leaves = u64::from(*state) >= u64::from(frequency).wrapping_shl(20);
                if let Some(word) = self.words.get_mut(self.written) {
                    let [low, high, ..] = state.to_le_bytes();
                    *word = u16::from_le_bytes([low, high]);
                }
                self.written = self.written.wrapping_add(leaves.into());
                let rest = state.wrapping_shr(u32::from(leaves).wrapping_mul(16));
                let quotient = quotient(rest, frequency);
                let remainder = rest.wrapping_sub(quotient.wrapping_mul(frequency));
                *state = quotient
                    .wrapping_shl(FREQUENCY_BITS)
                    .wrapping_add(remainder)
                    .wrapping_add(u32::from(first));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_are_exact_where_they_change_and_at_the_ends() {
        for frequency in 1..=1_u32 << FREQUENCY_BITS {
            // A state is below 2^20 times the frequency when a symbol is coded.
            let most = (u64::from(frequency) << 20) - 1;
            let most = u32::try_from(most.min(u64::from(u32::MAX))).unwrap();
            let multiples = (0..32).map(|shift| (most >> shift) / frequency * frequency);
            let around = multiples.flat_map(|state| [state.saturating_sub(1), state, (state + 1).min(most)]);
            for state in around.chain([0, 1, most - 1, most]) {
                assert_eq!(quotient(state, frequency), state / frequency, "{state} / {frequency}");
            }
        }
    }
}
