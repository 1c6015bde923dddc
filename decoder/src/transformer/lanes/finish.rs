//! SS-TR-006 and SS-TR-007: normalisation and the feed-forward block.
//!
//! No sum overflows (annex F.6); rows have the width of the network.

use super::products::Products;
use super::{FEED_FORWARD, Lane, OneBatch, Sums, WIDTH, ZERO, act, add, high, low, pairs, round};
use crate::transformer::scalar::reciprocal;

impl<P: Products> OneBatch<'_, P> {
    /// Brings a row to its end.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    pub(super) fn finish(&self, row: &mut [Lane], sums: &mut Sums) {
        let network = self.network;
        if network.header.normalised() {
            self.normalise(row);
        }
        let width = usize::from(network.header.feed_forward_width);
        if width == 0 {
            return;
        }
        let shift = self.shift(5);
        network.widening.multiply(self.by, row, sums);
        let mut wide = [ZERO; FEED_FORWARD / 2];
        pairs(sums.get(..width).unwrap_or_default(), &mut wide, |sum| round(sum, shift).clamp(0, 127));
        network.narrowing.multiply(self.by, &wide, sums);
        Self::join(row, sums, self.shift(6));
    }

    #[inline(always)]
    fn normalise(&self, row: &mut [Lane]) {
        let mut values = [ZERO; WIDTH];
        let mut sum = ZERO;
        for (values, row) in values.chunks_mut(2).zip(row.iter()) {
            if let [first, second] = values {
                (*first, *second) = (row.map(low), row.map(high));
                add(&mut sum, first);
                add(&mut sum, second);
            }
        }
        let mu = sum.map(|sum| round(sum, self.network.header.width_log2.into()));
        let values = values.get_mut(..row.len().wrapping_mul(2)).unwrap_or_default();
        let mut squares = ZERO;
        for x in values.iter_mut() {
            for ((x, square), &mu) in x.iter_mut().zip(&mut squares).zip(&mu) {
                *x = x.wrapping_sub(mu);
                *square = square.wrapping_add(x.wrapping_mul(*x));
            }
        }
        let r = squares.map(reciprocal);
        for (x, &[gain, bias]) in values.iter_mut().zip(&self.network.gain) {
            for (x, &r) in x.iter_mut().zip(&r) {
                let unit = round(x.wrapping_mul(r), 8);
                *x = act(unit.wrapping_mul(gain).wrapping_add(bias), 5);
            }
        }
        pairs(values, row, |x| x);
    }
}
