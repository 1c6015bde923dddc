//! SS-TR-005: attention.
//!
//! No sum overflows (annex F.6); rows have the width of the network, and there is a share for each neighbour.

use super::prepared::DIFFERENCE_MAX;
use super::products::Products;
use super::{LANES, Lane, OneBatch, RANKS, Sums, WIDTH, ZERO, act, add, high, packed, pair, pairs, round};
use crate::predictor::EXP;

impl<P: Products> OneBatch<'_, P> {
    /// Adds its context to a row. `m` is its neighbour; none: it is that of the new Gaussian.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    pub(super) fn attend(&self, row: &mut [Lane], m: Option<usize>, h: &[Lane], sums: &mut Sums) {
        let network = self.network;
        let shift = self.shift(2);
        network.attention.multiply(self.by, row, sums);
        let mut u = [ZERO; WIDTH / 2];
        pairs(sums, u.get_mut(..row.len()).unwrap_or_default(), |sum| act(sum, shift));
        let mut shares = [ZERO; RANKS];
        let count = self.batch.neighbours().min(RANKS);
        let shares = shares.get_mut(..count).unwrap_or_default();
        for ((j, logit), h) in shares.iter_mut().enumerate().zip(h.chunks_exact(row.len().max(1))) {
            let mut sum = self.bias(j, m);
            self.add_products(&mut sum, h, &u);
            *logit = sum.map(|sum| round(sum, self.shift(3)));
        }
        softmax(shares);
        let mut z = [ZERO; WIDTH / 2];
        self.mix(h, shares, z.get_mut(..row.len()).unwrap_or_default());
        network.value.multiply(self.by, z.get(..row.len()).unwrap_or_default(), sums);
        Self::join(row, sums, self.shift(4));
    }

    /// Adds the products of two rows of pairs.
    #[inline(always)]
    fn add_products(&self, sums: &mut Lane, a: &[Lane], b: &[Lane]) {
        for part in 0..P::PARTS {
            let terms = a.iter().zip(b);
            let sum = terms.fold(self.by.load(sums, part), |sum, (a, b)| {
                self.by.add(sum, self.by.load(a, part), self.by.load(b, part))
            });
            self.by.store(sum, sums, part);
        }
    }

    /// The rows of `h`, each with its share, Q8.
    #[inline(always)]
    fn mix(&self, h: &[Lane], shares: &[Lane], out: &mut [Lane]) {
        // Neighbours two by two: pairs of values of one row become pairs of values of one index.
        let width = out.len().max(1);
        let mut both = [ZERO; RANKS / 2];
        pairs(shares, &mut both, |share| share);
        for (index, out) in out.iter_mut().enumerate() {
            let (mut first, mut second) = (ZERO, ZERO);
            for (shares, rows) in both.iter().zip(h.chunks(width.wrapping_mul(2))) {
                let a = rows.get(index).unwrap_or(&ZERO);
                let b = rows.get(width.wrapping_add(index)).unwrap_or(&ZERO);
                let (mut of_first, mut of_second) = (ZERO, ZERO);
                for ((of_first, of_second), (&a, &b)) in
                    of_first.iter_mut().zip(&mut of_second).zip(a.iter().zip(b))
                {
                    *of_first = packed(a, b);
                    *of_second = packed(high(a), high(b));
                }
                self.add_products(&mut first, &[of_first], core::slice::from_ref(shares));
                self.add_products(&mut second, &[of_second], core::slice::from_ref(shares));
            }
            *out = pair(&first, &second, |sum| act(sum, 8));
        }
    }

    /// The relative-position bias between a neighbour and a row, before it is rounded.
    #[inline(always)]
    fn bias(&self, neighbour: usize, m: Option<usize>) -> Lane {
        let mut sum = ZERO;
        let from = m.map_or(&[][..], |m| self.batch.near(m));
        let from = from.iter().chain([&[0; LANES]; 3]);
        for ((table, near), from) in self.network.bias.iter().zip(self.batch.near(neighbour)).zip(from) {
            for ((sum, &near), &from) in sum.iter_mut().zip(near).zip(from) {
                let index = i32::from(near).wrapping_sub(from.into()).wrapping_add(DIFFERENCE_MAX) & 511;
                *sum = sum.wrapping_add(table.get(index as usize).copied().unwrap_or(0));
            }
        }
        sum
    }
}

/// Logits become shares, Q8.
#[inline(always)]
fn softmax(logits: &mut [Lane]) {
    let mut largest = [i32::MIN; LANES];
    for row in logits.iter() {
        largest.iter_mut().zip(row).for_each(|(largest, &logit)| *largest = logit.max(*largest));
    }
    let mut total = ZERO;
    for row in logits.iter_mut() {
        for (x, &largest) in row.iter_mut().zip(&largest) {
            let below = largest.wrapping_sub(*x).min(255) as u8;
            *x = EXP.get(usize::from(below)).copied().unwrap_or(1).into();
        }
        add(&mut total, row);
    }
    let r = total.map(|total| (1_i32 << 26).checked_div(total).unwrap_or(0));
    for row in logits {
        row.iter_mut().zip(&r).for_each(|(x, &r)| *x = round(x.wrapping_mul(r), 18));
    }
}
