//! The slopes of a loss: from outputs back to parameters.
//!
//! Rounding passes slopes on as if it were not there, and a clamp that acts passes none. The softmax has the slope of
//! its exponential.
#![expect(clippy::arithmetic_side_effects, reason = "products of counts that the trace was made with")]
#![expect(clippy::indexing_slicing, reason = "ranges are those of the layout that the lanes were made with")]

use super::gradient::Gradient;
use super::lane::{Arithmetic, Lane, ZERO, add_product, add_rows, join, row, row_mut, stop, stop_act, unit};
use super::matrix::add_outer;
use super::model::{Model, Trace};
use splatstream_format::payload::Part;

impl Model<'_> {
    /// Adds what the slopes of the outputs, before their shift, leave of slopes of parameters.
    #[inline(always)]
    pub(super) fn backward<A: Arithmetic>(
        &self,
        trace: &Trace<'_>,
        mut slope: Vec<Lane>,
        gradient: &mut Gradient<'_>,
    ) {
        for (slope, out) in slope.iter_mut().zip(&trace.out) {
            stop(slope, out, -1023.0, 1023.0, unit(self.shift(7)));
        }
        gradient.add(Part::Head, &slope, &trace.pool, 1);
        let mut pool = vec![ZERO; self.width()];
        self.turned(Part::Head).multiply(&slope, &mut pool);
        // Each row has an equal part in the mean.
        let part = 1.0 / trace.rows as f32;
        pool.iter_mut().for_each(|pool| *pool = pool.map(|slope| slope * part));
        let rows = pool.repeat(trace.rows);
        let rows = self.feed_back(trace, rows, gradient);
        let rows = self.normalise_back::<A>(trace, rows, gradient);
        let h = self.attend_back(trace, rows, gradient);
        self.embed_back(trace, h, gradient);
    }

    #[inline(always)]
    fn feed_back(&self, trace: &Trace<'_>, mut slope: Vec<Lane>, gradient: &mut Gradient<'_>) -> Vec<Lane> {
        if trace.wide.is_empty() {
            return slope;
        }
        let (width, rows) = (self.width(), trace.rows);
        stop_act(&mut slope, &trace.fed, 1.0);
        let mut added = slope.clone();
        stop_act(&mut added, &trace.added, unit(self.shift(6)));
        gradient.add(Part::Narrowing, &added, &trace.wide, rows);
        let mut wide = vec![ZERO; trace.wide.len()];
        for (wide, added) in wide.chunks_exact_mut(trace.wide.len() / rows).zip(added.chunks_exact(width)) {
            self.turned(Part::Narrowing).multiply(added, wide);
        }
        for (slope, wide) in wide.iter_mut().zip(&trace.wide) {
            stop(slope, wide, 0.0, 127.0, unit(self.shift(5)));
        }
        gradient.add(Part::Widening, &wide, &trace.normal, rows);
        for (slope, wide) in slope.chunks_exact_mut(width).zip(wide.chunks_exact(wide.len() / rows)) {
            self.turned(Part::Widening).multiply(wide, slope);
        }
        slope
    }

    #[inline(always)]
    fn normalise_back<A: Arithmetic>(
        &self,
        trace: &Trace<'_>,
        mut slope: Vec<Lane>,
        gradient: &mut Gradient<'_>,
    ) -> Vec<Lane> {
        if !self.layout.header.normalised() {
            return slope;
        }
        let width = self.width();
        stop_act(&mut slope, &trace.normal, unit(5));
        add_rows(&slope, gradient.bias(Part::Gain));
        for at in 0..trace.rows {
            let centred = row(&trace.centred, width, at);
            let [squares, r] = &trace.norm[at];
            let slope = row_mut(&mut slope, width, at);
            for ((slope, x), sum) in slope.iter().zip(centred).zip(gradient.weights(Part::Gain)) {
                add_product(sum, slope, &self.unit::<A>(x, r));
            }
            self.centre_back(slope, centred, squares, r);
        }
        slope
    }

    /// Takes the slopes of a normalised row, before gain and bias, to what it was.
    #[inline(always)]
    fn centre_back(&self, slope: &mut [Lane], centred: &[Lane], squares: &Lane, r: &Lane) {
        let mut along = ZERO;
        for ((slope, gain), x) in slope.iter_mut().zip(self.weights(Part::Gain)).zip(centred) {
            join(slope, r, |slope, r| slope * gain * r * unit(8));
            add_product(&mut along, slope, x);
        }
        // A longer row is made shorter.
        join(&mut along, squares, |along, squares| if squares > 1.0 { along / squares } else { 0.0 });
        let mut mean = ZERO;
        for (slope, x) in slope.iter_mut().zip(centred) {
            slope.iter_mut().zip(along.iter().zip(x)).for_each(|(slope, (along, x))| *slope -= along * x);
            join(&mut mean, slope, |sum, slope| sum + slope);
        }
        let part = 1.0 / slope.len() as f32;
        slope.iter_mut().for_each(|slope| join(slope, &mean, |slope, mean| slope - mean * part));
    }

    #[inline(always)]
    fn embed_back(&self, trace: &Trace<'_>, mut h: Vec<Lane>, gradient: &mut Gradient<'_>) {
        let header = &self.layout.header;
        let (width, neighbours) = (self.width(), trace.batch.neighbours());
        stop_act(&mut h, &trace.h, unit(self.shift(1)));
        let weights = gradient.weights(Part::Embedding);
        add_outer(self.arch, (&h, width), (&trace.token, header.inputs()), weights);
        for (j, h) in h.chunks_exact(width).enumerate() {
            let rank = j.min(usize::from(header.rank_count) - 1);
            add_rows(h, row_mut(gradient.bias(Part::Embedding), width, rank));
        }
        if trace.hidden.is_empty() {
            return;
        }
        gradient.add(Part::GeometryEmbedding, &h, &trace.hidden, neighbours);
        let mut hidden = vec![ZERO; trace.hidden.len()];
        for (hidden, h) in hidden.chunks_exact_mut(header.geometry_width.into()).zip(h.chunks_exact(width)) {
            self.turned(Part::GeometryEmbedding).multiply(h, hidden);
        }
        for (slope, hidden) in hidden.iter_mut().zip(&trace.hidden) {
            stop(slope, hidden, 0.0, 127.0, unit(self.shift(0)));
        }
        gradient.add(Part::Geometry, &hidden, &trace.near, neighbours);
    }
}
