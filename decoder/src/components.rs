//! The components of colour of a block, packed for the transform of clause 7.6.5.
//!
//! A plane is packed as soon as it is decoded, while it is near: with its bias, times its steps, its range checked, and in
//! pairs with the plane after it, since machines multiply two pairs of 16 bits and add the products in one instruction.
//!
//! No product overflows (annex F.4). Runs end with the plane, and exponents are as many as values.

use crate::attribute::in_range;
use crate::steps::Exponents;
use crate::vector::{Task, vectorized};
use core::ops::RangeInclusive;
use splatstream_format::entropy::machine::Machine;
use splatstream_format::{Error, Result};

/// The values of a component.
pub const COMPONENT_RANGE: RangeInclusive<i32> = -8191..=8191;

/// Gaussians that are transformed at a time: their sums stay in registers.
pub(crate) const TILE: usize = 32;

/// Pairs of components of the Gaussians of a tile: the first of a pair in the low half.
pub(crate) type Pair = [i32; TILE];

/// The components of some Gaussians.
#[derive(Debug, Default)]
pub(crate) struct Components {
    /// The pairs of a tile one after the other, then those of the next.
    pairs: Vec<Pair>,
    /// Pairs of a tile.
    of_tile: usize,
    /// Planes that were added.
    planes: usize,
    steps: Steps,
    /// That of the first value out of range.
    error: Option<Error>,
}

/// The steps of the Gaussians.
#[derive(Debug)]
enum Steps {
    Same(i32),
    Each(Vec<i32>),
}

impl Default for Steps {
    fn default() -> Self {
        Self::Same(1)
    }
}

impl Components {
    /// Room for the components of `count` Gaussians, `rank` of each, none added yet. `memory` is used again.
    pub(crate) fn new(count: usize, rank: usize, exponents: &Exponents, memory: Vec<Pair>) -> Self {
        let of_tile = rank.div_ceil(2);
        let mut pairs = memory;
        pairs.resize(count.div_ceil(TILE).saturating_mul(of_tile), [0; TILE]);
        Self { pairs, of_tile, planes: 0, steps: Steps::new(exponents), error: None }
    }

    /// Adds the next component of all Gaussians: coded values and their bias. `at` goes into the error.
    pub(crate) fn add(&mut self, coded: &[i32], bias: i32, at: u64) {
        let (first, is_high) = (self.planes / 2, self.planes % 2 == 1);
        self.planes = self.planes.wrapping_add(1);
        let slots = self.pairs.get_mut(first..).unwrap_or_default();
        let mut greatest = 0;
        let pack =
            Pack { coded, bias, steps: &self.steps, slots, of_tile: self.of_tile, greatest: &mut greatest };
        match is_high {
            true => vectorized(HighHalf(pack)),
            false => vectorized(LowHalf(pack)),
        }
        if greatest > COMPONENT_RANGE.end().unsigned_abs() {
            let values = self.steps.scaled(coded, bias);
            self.error = self.error.or(in_range(&values, &COMPONENT_RANGE, "component", "7.6.5", at).err());
        }
    }

    /// Whether all components are in range.
    ///
    /// # Errors
    /// That of the first value that is not.
    pub(crate) fn check(&self) -> Result<()> {
        self.error.map_or(Ok(()), Err)
    }

    /// The pairs of each tile.
    pub(crate) fn tiles(&self) -> impl Iterator<Item = &[Pair]> {
        self.pairs.chunks(self.of_tile.max(1))
    }

    /// The memory, to be used again.
    pub(crate) fn into_memory(self) -> Vec<Pair> {
        self.pairs
    }
}

impl Steps {
    fn new(exponents: &Exponents) -> Self {
        match exponents {
            Exponents::Same(exponent) => Self::Same(crate::steps::step(*exponent)),
            Exponents::Each(exponents) => {
                let mut steps = vec![0; exponents.len()];
                vectorized(EachStep { exponents, out: &mut steps });
                Self::Each(steps)
            }
        }
    }

    fn scaled(&self, coded: &[i32], bias: i32) -> Vec<i32> {
        let step = |row: usize| match self {
            Self::Same(step) => *step,
            Self::Each(steps) => steps.get(row).copied().unwrap_or(0),
        };
        coded
            .iter()
            .enumerate()
            .map(|(row, value)| value.wrapping_add(bias).wrapping_mul(step(row)))
            .collect()
    }
}

struct EachStep<'p> {
    exponents: &'p [u8],
    out: &'p mut [i32],
}

impl Task for EachStep<'_> {
    #[inline(always)]
    fn run(self, _: impl Machine) {
        for (slot, &exponent) in self.out.iter_mut().zip(self.exponents) {
            *slot = crate::steps::step(exponent);
        }
    }
}

/// A component of all Gaussians, to be packed.
struct Pack<'p> {
    coded: &'p [i32],
    bias: i32,
    steps: &'p Steps,
    /// The pairs from the first of the component on.
    slots: &'p mut [Pair],
    of_tile: usize,
    /// Becomes the greatest magnitude.
    greatest: &'p mut u32,
}

struct LowHalf<'p>(Pack<'p>);
struct HighHalf<'p>(Pack<'p>);

impl Task for LowHalf<'_> {
    #[inline(always)]
    fn run(self, _: impl Machine) {
        // Components in range have 15 bits.
        self.0.pack(|_, value| value & 0xFFFF);
    }
}

impl Task for HighHalf<'_> {
    #[inline(always)]
    fn run(self, _: impl Machine) {
        self.0.pack(|low, value| low | value.wrapping_shl(16));
    }
}

impl Pack<'_> {
    #[inline(always)]
    fn pack(self, join: impl Fn(i32, i32) -> i32) {
        let Self { coded, bias, steps, slots, of_tile, greatest } = self;
        let tiles = slots.chunks_mut(of_tile.max(1)).filter_map(<[Pair]>::first_mut);
        let (same, each): (_, &[i32]) = match steps {
            Steps::Same(step) => ([*step; TILE], &[]),
            Steps::Each(steps) => ([0; TILE], steps),
        };
        let mut magnitudes = [0_u32; TILE];
        let mut start = 0_usize;
        for slots in tiles {
            let (mut last_values, mut last_steps) = ([0; TILE], same);
            let values = tile(coded, start, &mut last_values);
            let steps = tile(each, start, &mut last_steps);
            let places = slots.iter_mut().zip(&mut magnitudes);
            for ((slot, magnitude), (&value, &step)) in places.zip(values.iter().zip(steps)) {
                let value = value.wrapping_add(bias).wrapping_mul(step);
                *magnitude = value.unsigned_abs().max(*magnitude);
                *slot = join(*slot, value);
            }
            start = start.wrapping_add(TILE);
        }
        *greatest = magnitudes.into_iter().fold(0, u32::max);
    }
}

/// The values of a tile where they are, or if there are fewer in `copy`: the last one again where there are none, and what
/// `copy` holds without any.
#[inline(always)]
fn tile<'p>(plane: &'p [i32], start: usize, copy: &'p mut [i32; TILE]) -> &'p [i32; TILE] {
    let rest = plane.get(start..).unwrap_or_default();
    match rest.first_chunk() {
        Some(values) => values,
        None => last(rest, copy),
    }
}

#[cold]
fn last<'p>(rest: &[i32], copy: &'p mut [i32; TILE]) -> &'p [i32; TILE] {
    rest.last().into_iter().for_each(|&value| copy.fill(value));
    copy.iter_mut().zip(rest).for_each(|(slot, &value)| *slot = value);
    copy
}
