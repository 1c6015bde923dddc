//! Clause 8.4: decoding the symbols of a block.

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
/// A plane model arranged for decoding. Built once a unit, shared by its blocks.
#[derive(Debug, Clone)]
pub struct PlaneDecoder {
    bias: i32,
    axes: [ContextAxis; 2],
    lookups: [AxisLookup; 2],
    second_contexts: usize,
    /// First slot, in `token_of_slot`, of the table of each context.
    slots_of_context: [u32; 64],
    /// The tables one after the other.
    token_of_slot: Vec<u8>,
    /// Frequency in the high half, first slot in the low half.
    interval_of_token: Vec<u32>,
    /// Smallest value and number of raw bits.
    value_of_token: Box<[(u64, u32); TOKENS]>,
}

impl PlaneDecoder {
    /// Expands the tables of a model.
    pub fn new(model: &PlaneModel) -> Self {
        let mut slots_of_context = [0; 64];
        for (slots, &index) in slots_of_context.iter_mut().zip(&model.table_of_context) {
            *slots = u32::from(index).wrapping_shl(FREQUENCY_BITS);
        }
        let mut value_of_token = Box::new([(0, 0); TOKENS]);
        for (token, value) in (0..=u8::MAX).zip(value_of_token.iter_mut()) {
            *value = join(token, model.direct_log2);
        }
        let [_, second] = &model.axes;
        let mut decoder = Self {
            bias: model.bias,
            axes: model.axes.clone(),
            lookups: model.axes.each_ref().map(AxisLookup::new),
            second_contexts: second.contexts(),
            slots_of_context,
            token_of_slot: Vec::with_capacity(model.tables.len().saturating_mul(SLOTS)),
            interval_of_token: Vec::with_capacity(model.tables.len().saturating_mul(TOKENS)),
            value_of_token,
        };
        model.tables.iter().for_each(|table| decoder.expand(table.of_token()));
        decoder
    }

    fn expand(&mut self, of_token: &[u16]) {
        let mut first = 0_u32;
        for token in 0..=u8::MAX {
            let frequency = of_token.get(usize::from(token)).copied().unwrap_or(0);
            self.token_of_slot.extend(core::iter::repeat_n(token, usize::from(frequency)));
            self.interval_of_token.push(u32::from(frequency).wrapping_shl(16) | first);
            first = first.wrapping_add(u32::from(frequency));
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

    /// The context of a value on the first axis: [`ContextAxis::context`], faster.
    #[inline(always)]
    pub fn first_context(&self, value: i32) -> u8 {
        let [lookup, _] = &self.lookups;
        lookup.context(value)
    }

    /// The context of a value on the second axis.
    #[inline(always)]
    pub fn second_context(&self, value: i32) -> u8 {
        let [_, lookup] = &self.lookups;
        lookup.context(value)
    }

    /// The context of a Gaussian from its contexts on the two axes.
    #[inline(always)]
    pub fn context(&self, first: u8, second: u8) -> u8 {
        let context = usize::from(first).wrapping_mul(self.second_contexts).wrapping_add(usize::from(second));
        let [low, ..] = context.to_le_bytes();
        low
    }
}

/// Reads the symbols of one block, plane by plane.
///
/// Running out of words or bits is remembered and reported by [`BlockReader::finish`].
#[derive(Debug)]
pub struct BlockReader<'a> {
    states: [u32; MAX_LANES],
    lanes: usize,
    words: Words<'a>,
    raw: BitReader<'a>,
    at: u64,
    raw_at: u64,
}

/// The words of a block. Past the end they are 0, and the offset keeps counting.
#[derive(Debug, Clone, Copy)]
struct Words<'a> {
    bytes: &'a [u8],
    next: usize,
}

impl Words<'_> {
    /// The next word is taken only if the state is below its bound: a choice of values, not a branch, for
    /// no processor guesses it.
    #[inline(always)]
    fn refill(&mut self, state: u32) -> u32 {
        let rest = self.bytes.get(self.next..).unwrap_or_default();
        let word = rest.first_chunk::<2>().map_or(0, |bytes| u16::from_le_bytes(*bytes));
        let low = state < STATE_LOW;
        self.next = self.next.wrapping_add(usize::from(low).wrapping_mul(2));
        if low { state.wrapping_shl(16) | u32::from(word) } else { state }
    }

    fn are_spent(&self) -> bool {
        self.next == self.bytes.len()
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
        Ok(Self { states, lanes, words: Words { bytes, next: 0 }, raw: BitReader::new(raw), at, raw_at })
    }

    /// Reads one plane: the value of `out[i]` is coded in context `context(i, previous value)`.
    ///
    /// `map` turns the unsigned value into what is stored; the stored value is what `context` sees next.
    #[inline(always)]
    fn plane<V: Copy>(
        &mut self,
        decoder: &PlaneDecoder,
        out: &mut [V],
        start: V,
        mut context: impl FnMut(usize, V) -> u8,
        map: impl Fn(u64) -> V,
    ) {
        // Copies, so that the loop keeps them in registers.
        let (mut states, mut words) = (self.states, self.words);
        let mask = self.lanes.wrapping_sub(1) & 31;
        let mut previous = start;
        for (index, out) in out.iter_mut().enumerate() {
            let context = usize::from(context(index, previous)) & 63;
            let slots = decoder.slots_of_context.get(context).copied().unwrap_or(0);
            let Some(state) = states.get_mut(index & mask) else { continue };
            let (token, next) = Self::token(*state, decoder, slots);
            *state = words.refill(next);
            let (mut value, raw_bits) =
                decoder.value_of_token.get(usize::from(token)).copied().unwrap_or((0, 0));
            if raw_bits > 0 {
                value = value.wrapping_add(self.raw.bits(raw_bits));
            }
            previous = map(value);
            *out = previous;
        }
        (self.states, self.words) = (states, words);
    }

    /// One rANS step in the table that starts at `slots`: the token, and the state before a word is taken.
    #[inline(always)]
    fn token(state: u32, decoder: &PlaneDecoder, slots: u32) -> (u8, u32) {
        let slot = state & 0xFFF;
        let index = usize::try_from(slots | slot).unwrap_or(0);
        let token = decoder.token_of_slot.get(index).copied().unwrap_or(0);
        let interval_place = usize::try_from(slots >> 4 | u32::from(token)).unwrap_or(0);
        let interval = decoder.interval_of_token.get(interval_place).copied().unwrap_or(0);
        let [first, frequency] = [interval & 0xFFFF, interval >> 16];
        let next = frequency.wrapping_mul(state.wrapping_shr(FREQUENCY_BITS));
        (token, next.wrapping_add(slot).wrapping_sub(first))
    }

    /// Reads signed values; contexts are known beforehand (`contexts` empty: all 0).
    pub fn signed(&mut self, decoder: &PlaneDecoder, contexts: &[u8], out: &mut [i32]) {
        let map = |value: u64| unzigzag(low_half(value));
        if contexts.is_empty() {
            self.plane(decoder, out, 0, |_, _| 0, map);
        } else {
            self.plane(decoder, out, 0, |index, _| contexts.get(index).copied().unwrap_or(0), map);
        }
    }

    /// Reads signed values whose context also depends on the values just read: `context(index, previous)`.
    pub fn signed_serial(
        &mut self,
        decoder: &PlaneDecoder,
        context: impl FnMut(usize, i32) -> u8,
        out: &mut [i32],
    ) {
        self.plane(decoder, out, 0, context, |value| unzigzag(low_half(value)));
    }

    /// Reads codebook indices.
    pub fn indices(&mut self, decoder: &PlaneDecoder, contexts: &[u8], out: &mut [i32]) {
        let map = |value: u64| low_half(value).cast_signed();
        self.plane(decoder, out, 0, |index, _| contexts.get(index).copied().unwrap_or(0), map);
    }

    /// Reads Morton deltas; the context depends on the deltas just read.
    pub fn deltas(&mut self, decoder: &PlaneDecoder, context: impl FnMut(usize, u64) -> u8, out: &mut [u64]) {
        self.plane(decoder, out, 0, context, |value| value);
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
