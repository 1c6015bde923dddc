//! Clause 8.4: decoding the symbols of a block.

use super::model::{ContextAxis, MAX_THRESHOLDS, PlaneModel};
use super::token::{join, unzigzag};
use super::{FREQUENCY_BITS, MAX_LANES, STATE_LOW};
use crate::bits::BitReader;
use crate::payload::leb128;
use crate::{Error, ErrorKind, Result};

/// A frequency table arranged for decoding: slot to token, token to interval.
#[derive(Debug, Clone)]
struct DecodeTable {
    token_of_slot: Box<[u8; 4096]>,
    /// Frequency in the high half, first slot in the low half.
    interval_of_token: Box<[u32; 256]>,
}

impl DecodeTable {
    fn new(of_token: &[u16]) -> Self {
        let mut token_of_slot = Box::new([0_u8; 4096]);
        let mut interval_of_token = Box::new([0_u32; 256]);
        let mut slots = token_of_slot.iter_mut();
        let mut first = 0_u32;
        for ((token, &frequency), interval) in (0_u8..).zip(of_token).zip(interval_of_token.iter_mut()) {
            let frequency = u32::from(frequency);
            *interval = frequency.wrapping_shl(16) | first;
            first = first.wrapping_add(frequency);
            for slot in slots.by_ref().take(usize::from(u16::try_from(frequency).unwrap_or(0))) {
                *slot = token;
            }
        }
        Self { token_of_slot, interval_of_token }
    }
}

/// A plane model arranged for decoding. Built once a unit, shared by its blocks.
#[derive(Debug, Clone)]
pub struct PlaneDecoder {
    bias: i32,
    axes: [ContextAxis; 2],
    /// The thresholds of each axis, filled up with values that no source reaches: a loop of fixed length.
    thresholds: [[i32; MAX_THRESHOLDS]; 2],
    second_contexts: usize,
    tables: Vec<DecodeTable>,
    table_of_context: [u8; 64],
    value_of_token: Box<[u64; 256]>,
    raw_bits_of_token: Box<[u8; 256]>,
}

impl PlaneDecoder {
    /// Expands the tables of a model.
    pub fn new(model: &PlaneModel) -> Self {
        let mut table_of_context = [0; 64];
        for (slot, &place) in table_of_context.iter_mut().zip(&model.table_of_context) {
            *slot = place;
        }
        let mut value_of_token = Box::new([0_u64; 256]);
        let mut raw_bits_of_token = Box::new([0_u8; 256]);
        for ((token, value), raw_bits) in
            (0..=u8::MAX).zip(value_of_token.iter_mut()).zip(raw_bits_of_token.iter_mut())
        {
            let (base, bits) = join(token, model.direct_log2);
            *value = base;
            *raw_bits = u8::try_from(bits).unwrap_or(0);
        }
        let [_, second] = &model.axes;
        Self {
            bias: model.bias,
            axes: model.axes.clone(),
            thresholds: model.axes.each_ref().map(padded),
            second_contexts: second.contexts(),
            tables: model.tables.iter().map(|table| DecodeTable::new(table.of_token())).collect(),
            table_of_context,
            value_of_token,
            raw_bits_of_token,
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

    /// The context of a value on one axis: [`ContextAxis::context`], faster.
    #[inline(always)]
    pub fn axis_context(&self, axis: usize, value: i32) -> u8 {
        let Some(thresholds) = self.thresholds.get(axis) else { return 0 };
        thresholds.iter().map(|&threshold| u8::from(threshold <= value)).fold(0, u8::wrapping_add)
    }

    /// The context of a Gaussian from its contexts on the two axes.
    #[inline(always)]
    pub fn context(&self, first: u8, second: u8) -> u8 {
        let context = usize::from(first).wrapping_mul(self.second_contexts).wrapping_add(usize::from(second));
        let [low, ..] = context.to_le_bytes();
        low
    }
}

fn padded(axis: &ContextAxis) -> [i32; MAX_THRESHOLDS] {
    let mut thresholds = [i32::MAX; MAX_THRESHOLDS];
    for (slot, &threshold) in thresholds.iter_mut().zip(&axis.thresholds) {
        *slot = threshold;
    }
    thresholds
}

/// Reads the symbols of one block, plane by plane.
///
/// Running out of words or bits is remembered and reported by [`BlockReader::finish`].
#[derive(Debug)]
pub struct BlockReader<'a> {
    states: [u32; MAX_LANES],
    lanes: usize,
    words: &'a [u8],
    words_missing: bool,
    raw: BitReader<'a>,
    at: u64,
    raw_at: u64,
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
        let (words, raw) =
            word_bytes.and_then(|count| rest.split_at_checked(count)).ok_or(short("word"))?;
        let mut states = [STATE_LOW; MAX_LANES];
        for (state, bytes) in states.iter_mut().zip(states_bytes.chunks_exact(4)) {
            *state = bytes.try_into().map_or(0, u32::from_le_bytes);
            if *state < STATE_LOW {
                return Err(Error::new(at, "8.4", ErrorKind::EntropyFinalState));
            }
        }
        let raw_offset = block.len().wrapping_sub(raw.len());
        let raw_at = at.wrapping_add(u64::try_from(raw_offset).unwrap_or(0));
        let raw = BitReader::new(raw);
        Ok(Self { states, lanes, words, words_missing: false, raw, at, raw_at })
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
        let mask = self.lanes.wrapping_sub(1) & 31;
        let mut previous = start;
        for (place, out) in out.iter_mut().enumerate() {
            let context = usize::from(context(place, previous)) & 63;
            let table = decoder.table_of_context.get(context).copied().unwrap_or(0);
            let Some(table) = decoder.tables.get(usize::from(table)) else { continue };
            let Some(state) = self.states.get_mut(place & mask) else { continue };
            let token = Self::token(state, table, &mut self.words, &mut self.words_missing);
            let mut value = decoder.value_of_token.get(usize::from(token)).copied().unwrap_or(0);
            let raw_bits = decoder.raw_bits_of_token.get(usize::from(token)).copied().unwrap_or(0);
            if raw_bits > 0 {
                value = value.wrapping_add(self.raw.bits(u32::from(raw_bits)));
            }
            previous = map(value);
            *out = previous;
        }
    }

    /// One rANS step.
    #[inline(always)]
    fn token(state: &mut u32, table: &DecodeTable, words: &mut &[u8], missing: &mut bool) -> u8 {
        let [low, high, ..] = state.to_le_bytes();
        let slot = u32::from(u16::from_le_bytes([low, high & 0x0F]));
        let place = usize::from(u16::from_le_bytes([low, high & 0x0F]));
        let token = table.token_of_slot.get(place).copied().unwrap_or(0);
        let interval = table.interval_of_token.get(usize::from(token)).copied().unwrap_or(0);
        let frequency = interval >> 16;
        let first = interval & 0xFFFF;
        let mut next = frequency
            .wrapping_mul(state.wrapping_shr(FREQUENCY_BITS))
            .wrapping_add(slot)
            .wrapping_sub(first);
        if next < STATE_LOW {
            let word = match words.split_first_chunk::<2>() {
                Some((word, rest)) => {
                    *words = rest;
                    u16::from_le_bytes(*word)
                }
                None => {
                    *missing = true;
                    0
                }
            };
            next = next.wrapping_shl(16) | u32::from(word);
        }
        *state = next;
        token
    }

    /// Reads signed values; contexts are known beforehand (`contexts` empty: all 0).
    pub fn signed(&mut self, decoder: &PlaneDecoder, contexts: &[u8], out: &mut [i32]) {
        let map = |value: u64| unzigzag(low_half(value));
        if contexts.is_empty() {
            self.plane(decoder, out, 0, |_, _| 0, map);
        } else {
            self.plane(decoder, out, 0, |place, _| contexts.get(place).copied().unwrap_or(0), map);
        }
    }

    /// Reads signed values whose context also depends on the values just read: `context(place, previous)`.
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
        self.plane(decoder, out, 0, |place, _| contexts.get(place).copied().unwrap_or(0), map);
    }

    /// Reads Morton deltas; the context depends on the deltas just read.
    pub fn deltas(
        &mut self,
        decoder: &PlaneDecoder,
        context: impl FnMut(usize, u64) -> u8,
        out: &mut [u64],
    ) {
        self.plane(decoder, out, 0, context, |value| value);
    }

    /// Checks that the block ends here: every state back at its start, words and bits used up.
    ///
    /// # Errors
    /// Malformed otherwise.
    pub fn finish(self) -> Result<()> {
        let spent = self.states.iter().all(|&state| state == STATE_LOW);
        if !spent || self.words_missing || !self.words.is_empty() {
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
