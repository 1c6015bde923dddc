//! A matrix for one vector at a time: its rows are the lanes.
//!
//! Rows are padded with 0 to lanes and to pairs.

#[cfg(target_arch = "x86_64")]
use super::products;
use super::products::{Portable, Products};
use super::{LANES, Lane, Machine, ZERO, packed};
use pulp::{Simd, WithSimd};

/// Weights of 16 bits.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    /// Pairs of columns.
    pairs: usize,
    /// The weights of 16 rows, a pair of columns after the other; then of the next 16.
    weights: Vec<Lane>,
    machine: Machine,
}

impl Columns {
    /// A matrix of `rows` rows and `columns` columns; `weight` gives what stands in a row and a column.
    pub(crate) fn new(rows: usize, columns: usize, weight: impl Fn(usize, usize) -> Option<i16>) -> Self {
        let (blocks, pairs) = (rows.div_ceil(LANES), columns.div_ceil(2));
        let at = |row, column| weight(row, column).map_or(0, i32::from);
        let lane = |block: usize, pair: usize| {
            let (first, column) = (block.wrapping_mul(LANES), pair.wrapping_mul(2));
            let mut lane = ZERO;
            for (slot, row) in lane.iter_mut().zip(first..rows) {
                *slot = packed(at(row, column), at(row, column.wrapping_add(1)));
            }
            lane
        };
        let weights = (0..blocks).flat_map(|block| (0..pairs).map(move |pair| (block, pair)));
        let weights = weights.map(|(block, pair)| lane(block, pair)).collect();
        Self { pairs, weights, machine: Machine::all().last().copied().unwrap_or(Machine::Portable) }
    }

    /// The products of the rows with a vector of values of 16 bits, in pairs, 16 rows at a time. No sum may leave 32 bits.
    pub(crate) fn multiply(&self, x: &[i32], out: &mut [Lane]) {
        self.multiply_on(self.machine, x, out);
    }

    /// The same with the instructions of a machine.
    fn multiply_on(&self, machine: Machine, x: &[i32], out: &mut [Lane]) {
        match machine {
            Machine::Portable => Product { columns: self, x, out, by: Portable }.run(),
            #[cfg(target_arch = "x86_64")]
            Machine::Sse2(sse2) => Product { columns: self, x, out, by: products::Sse2(sse2) }.run(),
            #[cfg(target_arch = "x86_64")]
            Machine::Avx2(v3) => {
                Simd::vectorize(v3, Product { columns: self, x, out, by: products::Avx2(v3) });
            }
        }
    }
}

struct Product<'p, P> {
    columns: &'p Columns,
    x: &'p [i32],
    out: &'p mut [Lane],
    by: P,
}

impl<P: Products> WithSimd for Product<'_, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.run();
    }
}

impl<P: Products> Product<'_, P> {
    #[inline(always)]
    fn run(self) {
        let Self { columns, x, out, by } = self;
        for (block, out) in columns.weights.chunks_exact(columns.pairs.max(1)).zip(out) {
            for part in 0..P::PARTS {
                let mut sum = by.splat(0);
                for (&x, weights) in x.iter().zip(block) {
                    sum = by.add(sum, by.splat(x), by.load(weights, part));
                }
                by.store(sum, out, part);
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing, reason = "a panic is a failed test")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Numbers of rows and columns that fill no lane and no pair, on every machine that this one can be.
        #[test]
        fn every_machine_gives_the_sums_of_rows_and_vector(
            (rows, columns) in (1_usize..50, 1_usize..50),
            weights in proptest::collection::vec(-1300_i16..=1300, 50 * 50),
            values in proptest::collection::vec(any::<i16>(), 50),
        ) {
            let matrix = Columns::new(rows, columns, |row, column| (column < columns).then(|| weights[row * 50 + column]));
            let value = |index: usize| if index < columns { i32::from(values[index]) } else { 0 };
            let pairs: Vec<i32> = (0..columns.div_ceil(2)).map(|p| packed(value(2 * p), value(2 * p + 1))).collect();
            let dot = |row: usize| (0..columns).map(|k| i32::from(weights[row * 50 + k]) * value(k)).sum::<i32>();
            for machine in Machine::all() {
                let mut sums = vec![ZERO; rows.div_ceil(LANES)];
                matrix.multiply_on(machine, &pairs, &mut sums);
                let sums: Vec<i32> = sums.as_flattened()[..rows].to_vec();
                prop_assert_eq!(sums, (0..rows).map(dot).collect::<Vec<_>>(), "{:?}", machine);
            }
        }
    }
}
