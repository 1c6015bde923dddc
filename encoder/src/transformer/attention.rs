//! SS-TR-005, forwards and backwards.
#![expect(
    clippy::indexing_slicing,
    reason = "rows and neighbours are counted by the trace; tables have an entry for each index that is made"
)]

use super::gradient::Gradient;
use super::lane::{
    Arithmetic, Lane, ZERO, act, add_product, add_rows, clamp, join, round, row, row_mut, stop_act, unit,
};
use super::model::{Model, Trace};
use splatstream_decoder::predictor::EXP;
use splatstream_decoder::transformer::LANES;
use splatstream_format::payload::Part;

/// An entry of [`EXP`] is this part of the exponent.
const EXPONENT: f32 = 1.0 / 32.0;

/// A share of all.
const ALL: f32 = 256.0;

impl Model<'_> {
    #[inline(always)]
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "products of counts that the trace was made with; attention is below 2^26"
    )]
    pub(super) fn attend<A: Arithmetic>(&self, trace: &mut Trace<'_>) {
        let (width, neighbours) = (self.width(), trace.batch.neighbours());
        self.layer(Part::Attention, &trace.row, &mut trace.u, trace.rows);
        trace.u.iter_mut().for_each(|u| *u = act::<A>(u, self.shift(2)));
        for m in 0..trace.rows {
            let u = row(&trace.u, width, m);
            for j in 0..neighbours {
                let mut sum = self.position_bias(trace, m, j);
                let h = row(&trace.h, width, j);
                u.iter().zip(h).for_each(|(u, h)| add_product(&mut sum, u, h));
                trace.share[m * neighbours + j] = round::<A>(&sum, self.shift(3));
            }
            let share = row_mut(&mut trace.share, neighbours, m);
            softmax::<A>(share);
            let z = row_mut(&mut trace.z, width, m);
            for (share, h) in share.iter().zip(trace.h.chunks_exact(width)) {
                z.iter_mut().zip(h).for_each(|(z, h)| add_product(z, share, h));
            }
            z.iter_mut().for_each(|z| *z = act::<A>(z, 8));
        }
        self.layer(Part::Value, &trace.z, &mut trace.context, trace.rows);
        trace.attended.copy_from_slice(&trace.row);
        for (x, context) in trace.attended.iter_mut().zip(&mut trace.context) {
            *context = act::<A>(context, self.shift(4));
            join(x, context, |x, context| x + context);
            *x = clamp(*x, -127.0, 127.0);
        }
    }

    /// The relative-position bias of neighbour `j` for row `m`.
    #[inline(always)]
    fn position_bias(&self, trace: &Trace<'_>, m: usize, j: usize) -> Lane {
        let mut sum = ZERO;
        if self.layout.header.fourier_count > 0 {
            for (axis, table) in self.position.iter().enumerate() {
                let indices = trace.apart((m, j), axis);
                sum.iter_mut().zip(indices).for_each(|(sum, index)| *sum += table[index]);
            }
        }
        sum
    }

    /// Takes the slopes of the attended rows to those of the neighbours' embeddings.
    #[inline(always)]
    pub(super) fn attend_back(
        &self,
        trace: &Trace<'_>,
        mut slope: Vec<Lane>,
        gradient: &mut Gradient<'_>,
    ) -> Vec<Lane> {
        let width = self.width();
        stop_act(&mut slope, &trace.attended, 1.0);
        let mut context = slope.clone();
        stop_act(&mut context, &trace.context, unit(self.shift(4)));
        gradient.add(Part::Value, &context, &trace.z, trace.rows);
        let mut h = vec![ZERO; trace.h.len()];
        let mut u = vec![ZERO; trace.u.len()];
        for m in 0..trace.rows {
            let mut z = vec![ZERO; width];
            self.turned(Part::Value).multiply(row(&context, width, m), &mut z);
            stop_act(&mut z, row(&trace.z, width, m), unit(8));
            self.logits_back(trace, m, &z, &mut h, row_mut(&mut u, width, m), gradient);
        }
        stop_act(&mut u, &trace.u, unit(self.shift(2)));
        gradient.add(Part::Attention, &u, &trace.row, trace.rows);
        for (u, slope) in u.chunks_exact(width).zip(slope.chunks_exact_mut(width)) {
            self.turned(Part::Attention).multiply(u, slope);
        }
        self.rows_back(trace, slope, &mut h, gradient);
        h
    }

    /// Takes the slopes of the mixed neighbours of row `m` to the neighbours and to what the row asks for.
    #[inline(always)]
    fn logits_back(
        &self,
        trace: &Trace<'_>,
        m: usize,
        z: &[Lane],
        h: &mut [Lane],
        u: &mut [Lane],
        gradient: &mut Gradient<'_>,
    ) {
        let width = z.len();
        let share = row(&trace.share, trace.batch.neighbours(), m);
        let mut slopes = vec![ZERO; share.len()];
        let mut mean = ZERO;
        for ((slope, share), h) in slopes.iter_mut().zip(share).zip(trace.h.chunks_exact(width)) {
            z.iter().zip(h).for_each(|(z, h)| add_product(slope, z, h));
            add_product(&mut mean, slope, share);
        }
        let scale = EXPONENT * unit(self.shift(3));
        let asked = row(&trace.u, width, m);
        for (j, (mut slope, share)) in slopes.into_iter().zip(share).enumerate() {
            join(&mut slope, &mean, |slope, mean| (slope - mean / ALL) * scale);
            join(&mut slope, share, |slope, share| slope * share);
            let (own, h) = (row(&trace.h, width, j), row_mut(h, width, j));
            for (((h, u), (z, asked)), own) in h.iter_mut().zip(&mut *u).zip(z.iter().zip(asked)).zip(own) {
                add_product(h, share, z);
                add_product(h, &slope, asked);
                add_product(u, &slope, own);
            }
            if self.layout.header.fourier_count > 0 {
                gradient.add_position(trace, (m, j), &slope);
            }
        }
    }

    /// Takes the slopes of rows to the neighbours' embeddings.
    #[inline(always)]
    fn rows_back(
        &self,
        trace: &Trace<'_>,
        mut slope: Vec<Lane>,
        h: &mut [Lane],
        gradient: &mut Gradient<'_>,
    ) {
        if self.layout.header.full_attention() {
            h.iter_mut().zip(&slope).for_each(|(h, slope)| join(h, slope, |a, b| a + b));
            return;
        }
        stop_act(&mut slope, &trace.row, 1.0);
        add_rows(&slope, gradient.weights(Part::Query));
        let part = 1.0 / trace.batch.neighbours() as f32;
        for h in h.chunks_exact_mut(slope.len()) {
            h.iter_mut().zip(&slope).for_each(|(h, slope)| join(h, slope, |a, b| a + b * part));
        }
    }
}

/// Logits become shares, Q8.
#[inline(always)]
#[expect(
    clippy::arithmetic_side_effects,
    reason = "products of counts that the trace was made with; attention is below 2^26"
)]
fn softmax<A: Arithmetic>(logits: &mut [Lane]) {
    let mut largest = [f32::NEG_INFINITY; LANES];
    for logit in logits.iter() {
        join(&mut largest, logit, |a, b| if a > b { a } else { b });
    }
    let mut total = ZERO;
    for logit in logits.iter_mut() {
        join(logit, &largest, |logit, largest| exponential::<A>(largest - logit));
        join(&mut total, logit, |sum, e| sum + e);
    }
    if !A::ROUNDED {
        logits.iter_mut().for_each(|e| join(e, &total, |e, total| ALL * e / total));
        return;
    }
    // Totals are at most 2^16: the quotients stand in double precision.
    let r = total.map(|total| (f64::from(1 << 26) / f64::from(total)) as u32);
    for e in logits.iter_mut() {
        e.iter_mut().zip(r).for_each(|(e, r)| *e = ((*e as u32 * r + (1 << 17)) >> 18) as f32);
    }
}

#[inline(always)]
fn exponential<A: Arithmetic>(below: f32) -> f32 {
    if A::ROUNDED {
        let index = if below < 255.0 { below as usize } else { 255 };
        EXP[index & 255].into()
    } else {
        libm::expf(-below * EXPONENT)
    }
}
