//! Clause 8.4: decoding the symbols of a block.
//!
//! All lanes go forward together, a step at a time: what a symbol waits for is in its own lane, so that the lanes are
//! independent chains. Some steps make a tile. Before a tile, what is known beforehand of its contexts is gathered lane
//! by lane; after it, its values are handed on lane by lane: memory is only touched in runs.

use super::lanes::{LaneEntries, Segments};
use super::machine::{Machine, WIDE};
use super::model::{AxisLookup, ContextAxis, PlaneModel};
use super::token::join;
use super::{FREQUENCY_BITS, MAX_LANES, STATE_LOW};
use crate::bits::BitReader;
use crate::payload::leb128;
use crate::{Error, ErrorKind, Result};
use core::ops::Range;

pub use super::symbol::{Delta, Index, Signed, Symbol, signed, vector};

/// Slots of a table.
const SLOTS: usize = 4096;
/// Tokens of a table.
const TOKENS: usize = 256;
/// Contexts of a plane, at most.
const CONTEXTS: usize = 64;

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
}

/// A frequency table, by slot and by token.
#[derive(Debug, Clone)]
struct Table {
    token_of_slot: [u8; SLOTS],
    /// Of each token that occurs, itself in the high 8 bits, its frequency less 1 in the next 12, and its first slot in the
    /// low 12.
    entry_of_token: [u32; TOKENS],
}

impl Table {
    #[inline(always)]
    fn token(&self, slot: u32) -> u32 {
        let slot = usize::try_from(slot & 0xFFF).unwrap_or(0);
        self.token_of_slot.get(slot).copied().unwrap_or(0).into()
    }

    #[inline(always)]
    fn entry(&self, token: u32) -> u32 {
        let token = usize::try_from(token & 0xFF).unwrap_or(0);
        self.entry_of_token.get(token).copied().unwrap_or(0)
    }

    fn new(of_token: &[u16]) -> Self {
        let mut table = Self { token_of_slot: [0; SLOTS], entry_of_token: [0; TOKENS] };
        let mut slots = table.token_of_slot.iter_mut();
        let mut first = 0_u32;
        for ((token, entry), &frequency) in (0..=u8::MAX).zip(table.entry_of_token.iter_mut()).zip(of_token) {
            slots.by_ref().take(frequency.into()).for_each(|slot| *slot = token);
            let length = u32::from(frequency.saturating_sub(1));
            *entry = u32::from(token).wrapping_shl(24) | length.wrapping_shl(12) | first & 0xFFF;
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
        let [first, second] = &model.axes;
        let second_contexts = u8::try_from(second.contexts()).unwrap_or(u8::MAX);
        Self {
            bias: model.bias,
            axes: model.axes.clone(),
            lookups: [AxisLookup::new(first, second_contexts), AxisLookup::new(second, 1)],
            table_of_context,
            tables: model.tables.iter().map(|table| Table::new(table.of_token())).collect(),
            value_of_token,
            direct: 1_u32.wrapping_shl(model.direct_log2.into()),
        }
    }

    /// What is added to the coded values.
    pub fn bias(&self) -> i32 {
        self.bias
    }

    /// The smallest value of a token and its number of raw bits.
    #[inline(always)]
    fn value(&self, token: u32) -> (u64, u32) {
        let token = usize::try_from(token & 0xFF).unwrap_or(0);
        self.value_of_token.get(token).copied().unwrap_or((0, 0))
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
pub trait Contexts<M: Machine, V> {
    /// What is known beforehand of the contexts of eight entries of each of eight lanes: the entries at `first` and those
    /// after them. `None` if nothing is known of any entry of the plane. Values for entries that are not there have no
    /// meaning.
    fn known(&self, machine: M, first: [usize; WIDE]) -> Option<[M::V; WIDE]>;

    /// Adds what follows from the values before to the contexts of a step.
    fn add_serial<const GROUPS: usize>(&self, machine: M, contexts: &mut [M::V; GROUPS]);

    /// Learns the values of a step; those of lanes that have no entry mean nothing.
    fn follow<const GROUPS: usize>(&mut self, machine: M, values: &[[V; WIDE]; GROUPS]);
}

/// Contexts that are known beforehand, one for each entry; none are all 0.
#[derive(Debug, Clone, Copy)]
pub struct KnownContexts<'c>(pub &'c [u8]);

impl<M: Machine, V> Contexts<M, V> for KnownContexts<'_> {
    #[inline(always)]
    fn known(&self, machine: M, first: [usize; WIDE]) -> Option<[M::V; WIDE]> {
        Some(first.map(|first| {
            let mut of_lane = [0; WIDE];
            let known = self.0.get(first..).unwrap_or_default();
            of_lane.iter_mut().zip(known).for_each(|(slot, &context)| *slot = context.into());
            machine.load(of_lane)
        }))
    }

    #[inline(always)]
    fn add_serial<const GROUPS: usize>(&self, _: M, _: &mut [M::V; GROUPS]) {}

    #[inline(always)]
    fn follow<const GROUPS: usize>(&mut self, _: M, _: &[[V; WIDE]; GROUPS]) {}
}

/// Reads the symbols of one block, plane by plane.
///
/// Running out of words or bits is remembered and reported by [`BlockReader::finish`].
#[derive(Debug)]
pub struct BlockReader<'a> {
    states: [[u32; WIDE]; MAX_LANES / WIDE],
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

/// Words that a step may look at: one for each lane, and those that a vector looks at and does not take.
type Ahead = [[u8; 2]; MAX_LANES + WIDE];

impl Words<'_> {
    /// The next words, where they are, or in `copy` if there are fewer: only then is that filled, since engines of
    /// WebAssembly fill arrays by a call.
    #[inline(always)]
    fn ahead<'w>(&'w self, copy: &'w mut Option<Ahead>) -> &'w Ahead {
        let rest = self.words.get(self.next..).unwrap_or_default();
        match rest.first_chunk() {
            Some(words) => words,
            None => Self::last(rest, copy),
        }
    }

    #[cold]
    fn last<'w>(rest: &[[u8; 2]], copy: &'w mut Option<Ahead>) -> &'w Ahead {
        let copy = copy.insert([[0; 2]; MAX_LANES + WIDE]);
        copy.iter_mut().zip(rest).for_each(|(slot, word)| *slot = *word);
        copy
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
        let mut states = [[STATE_LOW; WIDE]; MAX_LANES / WIDE];
        for (state, bytes) in states.as_flattened_mut().iter_mut().zip(states_bytes.chunks_exact(4)) {
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

    /// Reads one plane of as many values as `out` holds; what is stored is what `contexts` sees.
    #[inline(always)]
    pub fn plane<S: Symbol, M: Machine>(
        &mut self,
        machine: M,
        decoder: &PlaneDecoder,
        contexts: &mut impl Contexts<M, S::Stored>,
        out: &mut [S::Stored],
    ) {
        let Some(first_table) = decoder.tables.first() else { return };
        let mut tables = [first_table; CONTEXTS];
        for (table, &number) in tables.iter_mut().zip(&decoder.table_of_context) {
            *table = decoder.tables.get(usize::from(number)).unwrap_or(first_table);
        }
        let plane = Plane { machine, decoder, tables };
        match self.lanes_log2 {
            5.. => self.tiles::<S, M, 4>(&plane, contexts, out),
            4 => self.tiles::<S, M, 2>(&plane, contexts, out),
            _ => self.tiles::<S, M, 1>(&plane, contexts, out),
        }
    }

    /// The tiles of a plane, one after the other.
    ///
    /// Where vectors are enabled by function this is a part of what is compiled for the machine. On WebAssembly, where they
    /// are enabled for all, it is a function of its own: engines give registers to very large functions with less care.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn tiles<S: Symbol, M: Machine, const GROUPS: usize>(
        &mut self,
        plane: &Plane<'_, M>,
        contexts: &mut impl Contexts<M, S::Stored>,
        out: &mut [S::Stored],
    ) {
        let machine = plane.machine;
        let segments = Segments::new(out.len(), self.lanes_log2);
        let lanes: [[Range<usize>; WIDE]; GROUPS] = core::array::from_fn(|group| {
            let first = group.wrapping_mul(WIDE);
            core::array::from_fn(|lane| segments.entries(first.wrapping_add(lane), 0, usize::MAX))
        });
        let mut values = [[[S::Stored::default(); WIDE]; WIDE]; GROUPS];
        let mut known = [[machine.splat(0); WIDE]; GROUPS];
        for start in (0..segments.length()).step_by(WIDE) {
            for (known, lanes) in known.iter_mut().zip(&lanes) {
                let first = lanes.each_ref().map(|lane| lane.start.wrapping_add(start));
                if let Some(rows) = contexts.known(machine, first) {
                    *known = machine.transpose(rows);
                }
            }
            let steps = start..segments.length().min(start.wrapping_add(WIDE));
            let tile = Tile { plane, known: &known, steps, segments };
            // Blocks of few lanes are rare: not worth code of their own.
            match GROUPS == MAX_LANES / WIDE && tile.steps.end <= segments.whole() {
                true => self.tile::<S, M, GROUPS, true>(tile, contexts, &mut values),
                false => self.tile::<S, M, GROUPS, false>(tile, contexts, &mut values),
            }
            for (rows, lanes) in values.iter().zip(&lanes) {
                S::hand_on(machine, rows, &mut LaneEntries::new(lanes, start, out));
            }
        }
    }

    /// The steps of a tile, in all of which every lane has an entry if it is `WHOLE`.
    #[inline(always)]
    fn tile<S: Symbol, M: Machine, const GROUPS: usize, const WHOLE: bool>(
        &mut self,
        tile: Tile<'_, M, GROUPS>,
        contexts: &mut impl Contexts<M, S::Stored>,
        values: &mut [[[S::Stored; WIDE]; WIDE]; GROUPS],
    ) {
        let Tile { plane, known, steps, segments } = tile;
        let mut decoded = [[S::Stored::default(); WIDE]; GROUPS];
        for (row, step) in steps.enumerate() {
            let mut of_step = [plane.machine.splat(0); GROUPS];
            for (of_step, known) in of_step.iter_mut().zip(known) {
                known.get(row).into_iter().for_each(|&known| *of_step = known);
            }
            contexts.add_serial(plane.machine, &mut of_step);
            let active = if WHOLE { segments.lanes() } else { segments.active(step) };
            self.step::<S, M, GROUPS, WHOLE>(plane, of_step, active, &mut decoded);
            contexts.follow(plane.machine, &decoded);
            for (values, decoded) in values.iter_mut().zip(&decoded) {
                values.get_mut(row).into_iter().for_each(|slot| *slot = *decoded);
            }
        }
    }

    /// Reads one symbol of each lane below `active`, which are all lanes of the block if it is `WHOLE`; the values of other
    /// lanes mean nothing. Each loop does a part of the work for all lanes: loads that are slow wait together.
    #[inline(always)]
    fn step<S: Symbol, M: Machine, const GROUPS: usize, const WHOLE: bool>(
        &mut self,
        plane: &Plane<'_, M>,
        contexts: [M::V; GROUPS],
        active: usize,
        values: &mut [[S::Stored; WIDE]; GROUPS],
    ) {
        let machine = plane.machine;
        let mut lane_of_group = machine.load([0, 1, 2, 3, 4, 5, 6, 7]);
        let active_lanes = machine.splat(u32::try_from(active).unwrap_or(0));
        let mut is_split = machine.splat(0);
        let last_direct = machine.splat(plane.decoder.direct.wrapping_sub(1));
        let mut copy = None;
        let words = self.words.ahead(&mut copy);
        let mut taken = 0_usize;
        for ((values, states), contexts) in values.iter_mut().zip(&mut self.states).zip(contexts) {
            let state = machine.load(*states);
            let slots = machine.and(state, machine.splat(0xFFF));
            let entries = machine.load(plane.find(machine.store(slots), machine.store(contexts)));
            let first = machine.and(entries, machine.splat(0xFFF));
            let rest = machine.sub(slots, first);
            let quotient = machine.shr::<{ FREQUENCY_BITS.cast_signed() }>(state);
            let length = machine.and(machine.shr::<12>(entries), machine.splat(0xFFF));
            let product = machine.add(machine.mul(length, quotient), quotient);
            let mask = match WHOLE {
                true => machine.splat(u32::MAX),
                false => machine.greater(active_lanes, lane_of_group),
            };
            let (next, more) =
                machine.advance(state, machine.add(product, rest), mask, &window(words, taken));
            *states = machine.store(next);
            taken = taken.wrapping_add(more);
            let tokens = machine.shr::<24>(entries);
            let split = machine.greater(tokens, last_direct);
            is_split = machine.or(is_split, machine.and(split, mask));
            lane_of_group = machine.add(lane_of_group, machine.splat(8));
            *values = S::of_tokens(machine, tokens);
        }
        self.words.next = self.words.next.wrapping_add(taken);
        if machine.any(is_split) {
            for value in values.as_flattened_mut().iter_mut().take(active) {
                let token = S::token(*value);
                if token >= plane.decoder.direct {
                    let (least, raw_bits) = plane.decoder.value(token);
                    *value = S::of_value(least.wrapping_add(self.raw.bits(raw_bits)));
                }
            }
        }
    }

    /// Checks that the block ends here: every state back at its start, words and bits used up.
    ///
    /// # Errors
    /// Malformed otherwise.
    pub fn finish(self) -> Result<()> {
        let spent = self.states.as_flattened().iter().all(|&state| state == STATE_LOW);
        // Raw bits that were not there are the first thing that went wrong.
        if !self.raw.overran() && (!spent || !self.words.are_spent()) {
            return Err(Error::new(self.at, "8.4", ErrorKind::EntropyFinalState));
        }
        self.raw.finish(self.raw_at, "raw_bits", "8.4")
    }
}

/// A tile to be read: the contexts that are known beforehand, and its steps.
struct Tile<'t, M: Machine, const GROUPS: usize> {
    plane: &'t Plane<'t, M>,
    known: &'t [[M::V; WIDE]; GROUPS],
    steps: Range<usize>,
    segments: Segments,
}

/// A plane to be read.
struct Plane<'d, M> {
    machine: M,
    decoder: &'d PlaneDecoder,
    /// The table of each context.
    tables: [&'d Table; CONTEXTS],
}

impl<M> Plane<'_, M> {
    /// The entries of the tokens of slots. Every index here is below the length of its array: nothing is checked.
    #[inline(always)]
    fn find(&self, slots: [u32; WIDE], contexts: [u32; WIDE]) -> [u32; WIDE] {
        const NONE: &Table = &Table { token_of_slot: [0; SLOTS], entry_of_token: [0; TOKENS] };
        let table = |context: u32| -> &Table {
            let context = usize::try_from(context & 63).unwrap_or(0);
            self.tables.get(context).copied().unwrap_or(NONE)
        };
        let tables = contexts.map(table);
        let mut entries = slots;
        for (slot, table) in entries.iter_mut().zip(tables) {
            *slot = table.token(*slot);
        }
        for (entry, table) in entries.iter_mut().zip(tables) {
            *entry = table.entry(*entry);
        }
        entries
    }
}

/// The words after those that vectors before have taken, which are fewer than [`MAX_LANES`]: so nothing is checked.
#[inline(always)]
fn window(words: &Ahead, taken: usize) -> [u16; WIDE] {
    let rest = words.get(taken & (MAX_LANES - 1)..).unwrap_or_default();
    rest.first_chunk::<WIDE>().map_or([0; WIDE], |words| words.map(u16::from_le_bytes))
}
