//! Clause 8.4: decoding the symbols of a block.
//!
//! All lanes go forward together, a step at a time: what a symbol waits for is in its own lane, so that the lanes are
//! independent chains. Some steps make a tile. Before a tile, what is known beforehand of its contexts is gathered lane
//! by lane; after it, its values are handed on lane by lane: memory is only touched in runs.

use super::frequencies::Frequencies;
use super::lanes::Segments;
use super::model::{AxisLookup, ContextAxis, PlaneModel};
use super::token::{join, unzigzag};
use super::{FREQUENCY_BITS, MAX_LANES, STATE_LOW};
use crate::bits::BitReader;
use crate::payload::leb128;
use crate::{Error, ErrorKind, Result};

/// Slots of a table.
const SLOTS: usize = 4096;
/// Tokens of a table.
const TOKENS: usize = 256;
/// Contexts of a plane, at most.
const CONTEXTS: usize = 64;
/// Slots of a table, on average, from which on raw bits are expected of every symbol: below, that a symbol has some is
/// a branch that is seldom taken.
const MANY_RAW: u64 = 400;
/// Steps of a tile.
const TILE: usize = 16;

/// A plane model arranged for decoding. Built once a unit, shared by its blocks.
#[derive(Debug, Clone)]
pub struct PlaneDecoder {
    bias: i32,
    axes: [ContextAxis; 2],
    lookups: [AxisLookup; 2],
    /// The number of the table of each context.
    table_of_context: [u8; CONTEXTS],
    tables: Vec<Table>,
    /// Smallest value and number of raw bits.
    value_of_token: Box<[(u64, u32); TOKENS]>,
    /// Tokens below this one are values, and have no raw bits.
    direct: u32,
    /// Whether many of the symbols have raw bits.
    is_raw: bool,
}

/// A frequency table, by slot and by token.
#[derive(Debug, Clone)]
struct Table {
    token_of_slot: [u8; SLOTS],
    /// Frequency in the high half, first slot in the low half.
    interval_of_token: [u32; TOKENS],
}

impl Table {
    fn new(of_token: &[u16]) -> Self {
        let mut table = Self { token_of_slot: [0; SLOTS], interval_of_token: [0; TOKENS] };
        let mut slots = table.token_of_slot.iter_mut();
        let mut first = 0_u32;
        for ((token, interval), &frequency) in
            (0..=u8::MAX).zip(table.interval_of_token.iter_mut()).zip(of_token)
        {
            slots.by_ref().take(frequency.into()).for_each(|slot| *slot = token);
            *interval = u32::from(frequency).wrapping_shl(16) | first;
            first = first.wrapping_add(frequency.into());
        }
        table
    }
}

impl PlaneDecoder {
    /// Expands the tables of a model.
    pub fn new(model: &PlaneModel) -> Self {
        let mut table_of_context = [0; CONTEXTS];
        table_of_context.iter_mut().zip(&model.table_of_context).for_each(|(slot, &table)| *slot = table);
        let mut value_of_token = Box::new([(0, 0); TOKENS]);
        for (token, value) in (0..=u8::MAX).zip(value_of_token.iter_mut()) {
            *value = join(token, model.direct_log2);
        }
        let direct = 1_u32.wrapping_shl(model.direct_log2.into());
        let of_raw = |table: &Frequencies| -> u64 {
            let direct = usize::try_from(direct).unwrap_or(usize::MAX);
            table.of_token().iter().skip(direct).map(|&frequency| u64::from(frequency)).sum()
        };
        let raw: u64 = model.tables.iter().map(of_raw).sum();
        let [first, second] = &model.axes;
        let second_contexts = u8::try_from(second.contexts()).unwrap_or(u8::MAX);
        Self {
            bias: model.bias,
            axes: model.axes.clone(),
            lookups: [AxisLookup::new(first, second_contexts), AxisLookup::new(second, 1)],
            table_of_context,
            tables: model.tables.iter().map(|table| Table::new(table.of_token())).collect(),
            value_of_token,
            direct,
            is_raw: raw > u64::try_from(model.tables.len()).unwrap_or(0).saturating_mul(MANY_RAW),
        }
    }

    /// What is added to the coded values.
    pub fn bias(&self) -> i32 {
        self.bias
    }

    /// The two context axes.
    pub fn axes(&self) -> &[ContextAxis; 2] {
        &self.axes
    }

    /// The two context axes as tables, whose entries add up to the context.
    pub fn lookups(&self) -> &[AxisLookup; 2] {
        &self.lookups
    }
}

/// The contexts of the symbols of a plane.
pub trait Contexts<V> {
    /// Adds what is known beforehand of the contexts of the entries from `first` on to `contexts`, one for each.
    fn gather(&self, first: usize, contexts: &mut [u8]);

    /// Adds what follows from the values before to the contexts of a step, one for each lane.
    fn complete(&self, contexts: &mut [u8]);

    /// Learns the values of a step, one for each lane.
    fn follow(&mut self, values: &[V]);
}

/// Contexts that are known beforehand, one for each entry; none are all 0.
#[derive(Debug, Clone, Copy)]
pub struct KnownContexts<'c>(pub &'c [u8]);

impl<V> Contexts<V> for KnownContexts<'_> {
    fn gather(&self, first: usize, contexts: &mut [u8]) {
        let known = self.0.get(first..).unwrap_or_default();
        contexts.iter_mut().zip(known).for_each(|(slot, &context)| *slot = context);
    }

    fn complete(&self, _: &mut [u8]) {}

    fn follow(&mut self, _: &[V]) {}
}

/// Reads the symbols of one block, plane by plane.
///
/// Running out of words or bits is remembered and reported by [`BlockReader::finish`].
#[derive(Debug)]
pub struct BlockReader<'a> {
    states: [u32; MAX_LANES],
    lanes_log2: u8,
    words: Words<'a>,
    raw: BitReader<'a>,
    at: u64,
    raw_at: u64,
}

/// The words of a block. Past the end they are 0, and the offset keeps counting.
#[derive(Debug, Clone, Copy)]
struct Words<'a> {
    words: &'a [[u8; 2]],
    next: usize,
}

impl Words<'_> {
    /// The next word is taken only if the state is below its bound: a choice of values, not a branch, for
    /// no processor guesses it.
    #[inline(always)]
    fn refill(&mut self, state: u32) -> u32 {
        let word = self.words.get(self.next).map_or(0, |bytes| u16::from_le_bytes(*bytes));
        let low = state < STATE_LOW;
        self.next = self.next.wrapping_add(usize::from(low));
        if low { state.wrapping_shl(16) | u32::from(word) } else { state }
    }

    fn are_spent(&self) -> bool {
        self.next == self.words.len()
    }
}

impl<'a> BlockReader<'a> {
    /// Divides the bytes of a block, clause 5.13; `at` is the absolute offset of the first.
    ///
    /// # Errors
    /// Malformed if the states or words do not fit in the block.
    pub fn open(block: &'a [u8], at: u64, lanes_log2: u8) -> Result<Self> {
        let lanes = 1_usize.wrapping_shl(u32::from(lanes_log2)).min(MAX_LANES);
        let short = |element| Error::new(at, "5.13", ErrorKind::ShortSection { element });
        let (word_count, rest) = leb128(block, at, "word_count", "5.13")?;
        let (states_bytes, rest) = rest.split_at_checked(lanes.wrapping_mul(4)).ok_or(short("state"))?;
        let word_bytes = usize::try_from(word_count).ok().and_then(|count| count.checked_mul(2));
        let (bytes, raw) = word_bytes.and_then(|count| rest.split_at_checked(count)).ok_or(short("word"))?;
        let mut states = [STATE_LOW; MAX_LANES];
        for (state, bytes) in states.iter_mut().zip(states_bytes.chunks_exact(4)) {
            *state = bytes.try_into().map_or(0, u32::from_le_bytes);
            if *state < STATE_LOW {
                return Err(Error::new(at, "8.4", ErrorKind::EntropyFinalState));
            }
        }
        let raw_offset = block.len().wrapping_sub(raw.len());
        let raw_at = at.wrapping_add(u64::try_from(raw_offset).unwrap_or(0));
        let (words, _) = bytes.as_chunks();
        Ok(Self { states, lanes_log2, words: Words { words, next: 0 }, raw: BitReader::new(raw), at, raw_at })
    }

    /// Reads one plane of as many values as `out` holds. `map` turns the unsigned value into what is stored; the stored
    /// value is what `contexts` sees.
    #[inline(always)]
    fn plane<V: Copy + Default>(
        &mut self,
        decoder: &PlaneDecoder,
        contexts: &mut impl Contexts<V>,
        map: impl Fn(u64) -> V + Copy,
        out: &mut [V],
    ) {
        let Some(first_table) = decoder.tables.first() else { return };
        let mut tables = [first_table; CONTEXTS];
        for (table, &number) in tables.iter_mut().zip(&decoder.table_of_context) {
            *table = decoder.tables.get(usize::from(number)).unwrap_or(first_table);
        }
        match decoder.is_raw {
            true => self.tiles::<V, true>(decoder, &tables, contexts, map, out),
            false => self.tiles::<V, false>(decoder, &tables, contexts, map, out),
        }
    }

    /// The tiles of a plane, one after the other.
    #[inline(always)]
    fn tiles<V: Copy + Default, const RAW: bool>(
        &mut self,
        decoder: &PlaneDecoder,
        tables: &[&Table; CONTEXTS],
        contexts: &mut impl Contexts<V>,
        map: impl Fn(u64) -> V + Copy,
        out: &mut [V],
    ) {
        let segments = Segments::new(out.len(), self.lanes_log2);
        let mut values = [[V::default(); MAX_LANES]; TILE];
        for start in (0..segments.length()).step_by(TILE) {
            let mut known = [[0; TILE]; MAX_LANES];
            for (lane, known) in (0..segments.lanes()).zip(&mut known) {
                let range = segments.entries(lane, start, TILE);
                contexts.gather(range.start, known.get_mut(..range.len()).unwrap_or_default());
            }
            for (index, values) in values.iter_mut().enumerate().take(segments.length().wrapping_sub(start)) {
                let active = segments.active(start.wrapping_add(index));
                let values = values.get_mut(..active).unwrap_or_default();
                let mut of_step = [0; MAX_LANES];
                for (context, known) in of_step.iter_mut().zip(&known) {
                    *context = known.get(index).copied().unwrap_or(0);
                }
                let of_step = of_step.get_mut(..active).unwrap_or_default();
                contexts.complete(of_step);
                self.step::<V, RAW>(decoder, tables, of_step, map, values);
                contexts.follow(values);
            }
            for lane in 0..segments.lanes().min(MAX_LANES) {
                let entries = out.get_mut(segments.entries(lane, start, TILE)).unwrap_or_default();
                for (slot, values) in entries.iter_mut().zip(&values) {
                    *slot = values.get(lane).copied().unwrap_or_default();
                }
            }
        }
    }

    /// One symbol of each lane. Each loop does a part of the work for all lanes: loads that are slow wait together, and
    /// vectors do what has no loads.
    #[inline(always)]
    fn step<V, const RAW: bool>(
        &mut self,
        decoder: &PlaneDecoder,
        tables: &[&Table; CONTEXTS],
        contexts: &[u8],
        map: impl Fn(u64) -> V,
        values: &mut [V],
    ) {
        let (mut tokens, mut intervals) = ([0_u32; MAX_LANES], [0_u32; MAX_LANES]);
        let symbols = tokens.iter_mut().zip(&mut intervals);
        for (((token, interval), &state), &context) in symbols.zip(&self.states).zip(contexts) {
            // Every index is below the length of its array: nothing is checked.
            let Some(table) = tables.get(usize::from(context & 63)) else { continue };
            let slot = usize::try_from(state & 0xFFF).unwrap_or(0);
            let found = table.token_of_slot.get(slot).copied().unwrap_or(0);
            *interval = table.interval_of_token.get(usize::from(found)).copied().unwrap_or(0);
            *token = found.into();
        }
        // Copies, so that the loop keeps them in registers.
        let (mut words, mut raw) = (self.words, self.raw);
        let states = self.states.iter_mut().zip(tokens.iter().zip(&intervals));
        for ((state, (&token, &interval)), value) in states.zip(values) {
            let [first, frequency] = [interval & 0xFFFF, interval >> 16];
            let next = frequency.wrapping_mul(state.wrapping_shr(FREQUENCY_BITS));
            *state = words.refill(next.wrapping_add(*state & 0xFFF).wrapping_sub(first));
            *value = map(if RAW || token >= decoder.direct {
                let index = usize::try_from(token & 0xFF).unwrap_or(0);
                let (least, raw_bits) = decoder.value_of_token.get(index).copied().unwrap_or((0, 0));
                least.wrapping_add(raw.bits(raw_bits))
            } else {
                token.into()
            });
        }
        (self.words, self.raw) = (words, raw);
    }

    /// Reads signed values.
    #[inline(always)]
    pub fn signed(&mut self, decoder: &PlaneDecoder, contexts: &mut impl Contexts<i32>, out: &mut [i32]) {
        self.plane(decoder, contexts, |value| unzigzag(low_half(value)), out);
    }

    /// Reads codebook indices.
    #[inline(always)]
    pub fn indices(&mut self, decoder: &PlaneDecoder, contexts: &mut impl Contexts<i32>, out: &mut [i32]) {
        self.plane(decoder, contexts, |value| low_half(value).cast_signed(), out);
    }

    /// Reads Morton deltas.
    #[inline(always)]
    pub fn deltas(&mut self, decoder: &PlaneDecoder, contexts: &mut impl Contexts<u64>, out: &mut [u64]) {
        self.plane(decoder, contexts, |value| value, out);
    }

    /// Checks that the block ends here: every state back at its start, words and bits used up.
    ///
    /// # Errors
    /// Malformed otherwise.
    pub fn finish(self) -> Result<()> {
        let spent = self.states.iter().all(|&state| state == STATE_LOW);
        // Raw bits that were not there are the first thing that went wrong.
        if !self.raw.overran() && (!spent || !self.words.are_spent()) {
            return Err(Error::new(self.at, "8.4", ErrorKind::EntropyFinalState));
        }
        self.raw.finish(self.raw_at, "raw_bits", "8.4")
    }
}

/// The low 32 bits.
#[inline(always)]
fn low_half(value: u64) -> u32 {
    let [a, b, c, d, ..] = value.to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}
