//! What the values of a block stand for: signed values (4.5), indices into a codebook, Morton deltas.

use super::lanes::LaneEntries;
use super::machine::{Machine, WIDE};
use super::token::{unzigzag, zigzag};

/// What an unsigned value stands for.
pub trait Symbol: Copy {
    /// What is stored.
    type Stored: Copy + Default;

    /// Of values that are their own tokens.
    fn of_tokens<M: Machine>(machine: M, tokens: M::V) -> [Self::Stored; WIDE];

    /// The token that [`Symbol::of_tokens`] made this of.
    fn token(stored: Self::Stored) -> u32;

    /// Of any value.
    fn of_value(value: u64) -> Self::Stored;

    /// Hands value i of every row on to the entries of lane i, of which there may be fewer than rows.
    fn hand_on<M: Machine>(
        machine: M,
        rows: &[[Self::Stored; WIDE]; WIDE],
        entries: &mut LaneEntries<'_, Self::Stored>,
    );
}

/// Signed values, 4.5.
#[derive(Debug, Clone, Copy)]
pub struct Signed;
/// Indices into a codebook.
#[derive(Debug, Clone, Copy)]
pub struct Index;
/// Morton deltas.
#[derive(Debug, Clone, Copy)]
pub struct Delta;

impl Symbol for Signed {
    type Stored = i32;

    #[inline(always)]
    fn of_tokens<M: Machine>(machine: M, tokens: M::V) -> [i32; WIDE] {
        let sign = machine.sub(machine.splat(0), machine.and(tokens, machine.splat(1)));
        signed(machine, machine.xor(machine.shr::<1>(tokens), sign))
    }

    #[inline(always)]
    fn token(stored: i32) -> u32 {
        zigzag(stored)
    }

    #[inline(always)]
    fn of_value(value: u64) -> i32 {
        unzigzag(low_half(value))
    }

    #[inline(always)]
    fn hand_on<M: Machine>(machine: M, rows: &[[i32; WIDE]; WIDE], entries: &mut LaneEntries<'_, i32>) {
        // One by one: arrays that are filled in a loop would be emptied first.
        let [a, b, c, d, e, f, g, h] = rows;
        let upper = [vector(machine, a), vector(machine, b), vector(machine, c), vector(machine, d)];
        let lower = [vector(machine, e), vector(machine, f), vector(machine, g), vector(machine, h)];
        let ([a, b, c, d], [e, f, g, h]) = (upper, lower);
        let columns = machine.transpose([a, b, c, d, e, f, g, h]);
        for (lane, column) in columns.into_iter().enumerate() {
            let (values, slots) = (signed(machine, column), entries.of_lane(lane));
            match slots.first_chunk_mut() {
                Some(slots) => *slots = values,
                None => slots.iter_mut().zip(values).for_each(|(slot, value)| *slot = value),
            }
        }
    }
}

impl Symbol for Index {
    type Stored = i32;

    #[inline(always)]
    fn of_tokens<M: Machine>(machine: M, tokens: M::V) -> [i32; WIDE] {
        signed(machine, tokens)
    }

    #[inline(always)]
    fn token(stored: i32) -> u32 {
        stored.cast_unsigned()
    }

    #[inline(always)]
    fn of_value(value: u64) -> i32 {
        low_half(value).cast_signed()
    }

    #[inline(always)]
    fn hand_on<M: Machine>(machine: M, rows: &[[i32; WIDE]; WIDE], entries: &mut LaneEntries<'_, i32>) {
        Signed::hand_on(machine, rows, entries);
    }
}

impl Symbol for Delta {
    type Stored = u64;

    #[inline(always)]
    fn of_tokens<M: Machine>(machine: M, tokens: M::V) -> [u64; WIDE] {
        machine.store(tokens).map(u64::from)
    }

    #[inline(always)]
    fn token(stored: u64) -> u32 {
        low_half(stored)
    }

    #[inline(always)]
    fn of_value(value: u64) -> u64 {
        value
    }

    #[inline(always)]
    fn hand_on<M: Machine>(_: M, rows: &[[u64; WIDE]; WIDE], entries: &mut LaneEntries<'_, u64>) {
        for lane in 0..WIDE {
            let column = rows.iter().filter_map(|row| row.get(lane));
            entries.of_lane(lane).iter_mut().zip(column).for_each(|(slot, &value)| *slot = value);
        }
    }
}

/// A vector of signed values.
#[inline(always)]
pub fn vector<M: Machine>(machine: M, values: &[i32; WIDE]) -> M::V {
    machine.load(values.map(i32::cast_unsigned))
}

/// The values of a vector, signed.
#[inline(always)]
pub fn signed<M: Machine>(machine: M, values: M::V) -> [i32; WIDE] {
    machine.store(values).map(u32::cast_signed)
}

/// The low 32 bits.
#[inline(always)]
fn low_half(value: u64) -> u32 {
    let [a, b, c, d, ..] = value.to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}
