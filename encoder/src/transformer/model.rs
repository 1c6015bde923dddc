//! SS-TR-003 to SS-TR-008 for the Gaussians of a batch, with everything on the way kept for the slopes.
#![expect(clippy::arithmetic_side_effects, reason = "products of counts of the header, each of eight bits")]
#![expect(clippy::indexing_slicing, reason = "ranges are those of the layout that the values were made with")]

use super::lane::{
    Arithmetic, Lane, ZERO, act, add_product, add_rows, clamp, join, mean, round, row, row_mut,
};
use super::matrix::Matrix;
use super::parameters::{DIFFERENCES, Layout};
use pulp::Arch;
use splatstream_decoder::transformer::{Batch, LANES};
use splatstream_format::payload::Part;

/// A network ready to be run forwards and backwards.
#[derive(Debug)]
pub(super) struct Model<'l> {
    pub(super) layout: &'l Layout,
    pub(super) arch: Arch,
    values: Vec<f32>,
    /// The matrices of the parts, and with their columns as rows.
    matrices: [[Matrix; 2]; 11],
    /// For each axis the relative-position bias of each difference from -254 on.
    pub(super) position: [Vec<f32>; 3],
}

/// What a pass computes on its way. Arrays have one row for a neighbour or for a row of the attention.
pub(super) struct Trace<'b> {
    pub(super) batch: &'b Batch,
    /// Every neighbour has a row.
    pub(super) full: bool,
    /// Rows of the attention.
    pub(super) rows: usize,
    pub(super) near: Vec<Lane>,
    pub(super) token: Vec<Lane>,
    pub(super) hidden: Vec<Lane>,
    pub(super) h: Vec<Lane>,
    pub(super) row: Vec<Lane>,
    pub(super) u: Vec<Lane>,
    pub(super) share: Vec<Lane>,
    pub(super) z: Vec<Lane>,
    pub(super) context: Vec<Lane>,
    pub(super) attended: Vec<Lane>,
    /// Less their mean.
    pub(super) centred: Vec<Lane>,
    /// The sum of their squares and 2^16 over its root.
    pub(super) norm: Vec<[Lane; 2]>,
    pub(super) normal: Vec<Lane>,
    pub(super) wide: Vec<Lane>,
    pub(super) added: Vec<Lane>,
    pub(super) fed: Vec<Lane>,
    pub(super) pool: Vec<Lane>,
    /// Before the shift of the output.
    pub(super) out: Vec<Lane>,
}

impl<'b> Trace<'b> {
    fn new(layout: &Layout, batch: &'b Batch) -> Self {
        let header = &layout.header;
        let neighbours = batch.neighbours();
        let full = header.full_attention();
        let rows = if full { neighbours } else { 1 };
        let (width, wide) = (header.width(), usize::from(header.feed_forward_width));
        let zeros = |count: usize| vec![ZERO; count];
        let widened = |row: &[i8; LANES]| row.map(f32::from);
        let all = |of: &dyn Fn(usize) -> Vec<Lane>| (0..neighbours).flat_map(of).collect();
        Self {
            batch,
            full,
            rows,
            near: all(&|j| batch.near(j).iter().map(widened).collect()),
            token: all(&|j| batch.token(j).iter().map(widened).collect()),
            hidden: zeros(neighbours * usize::from(header.geometry_width)),
            h: zeros(neighbours * width),
            row: zeros(rows * width),
            u: zeros(rows * width),
            share: zeros(rows * neighbours),
            z: zeros(rows * width),
            context: zeros(rows * width),
            attended: zeros(rows * width),
            centred: zeros(rows * width),
            norm: vec![[ZERO; 2]; rows],
            normal: zeros(rows * width),
            wide: zeros(rows * wide),
            added: zeros(rows * width),
            fed: zeros(rows * width),
            pool: zeros(width),
            out: zeros(header.outputs()),
        }
    }

    /// For each lane the index of what neighbour `j` is apart from row `m`.
    #[inline(always)]
    pub(super) fn apart(&self, (m, j): (usize, usize), axis: usize) -> [usize; LANES] {
        let mut out = [0; LANES];
        // The row of the new Gaussian is at the origin.
        let from = if self.full { self.batch.near(m)[axis] } else { [0; LANES] };
        for (index, (&near, from)) in out.iter_mut().zip(self.batch.near(j)[axis].iter().zip(from)) {
            *index = difference(near, from);
        }
        out
    }
}

impl<'l> Model<'l> {
    /// The network of some parameters, or of the integers next to them.
    pub(super) fn new<A: Arithmetic>(layout: &'l Layout, parameters: &[f32]) -> Self {
        let whole = |value: &f32| if A::ROUNDED { value.round_ties_even() } else { *value };
        let values: Vec<f32> = parameters.iter().map(whole).collect();
        let arch = Arch::new();
        let matrices = Part::ALL.map(|part| {
            let (columns, weights) = (layout.columns(part), &values[layout.weights(part)]);
            let rows = weights.len() / columns.max(1);
            let turned = |row: usize, column: usize| weights[column * columns + row];
            [
                Matrix::new(arch, rows, columns, |row, column| weights[row * columns + column]),
                Matrix::new(arch, columns, rows, turned),
            ]
        });
        let position = [0, 1, 2].map(|axis| position_bias(layout, &values, axis));
        Self { layout, arch, values, matrices, position }
    }

    pub(super) fn weights(&self, part: Part) -> &[f32] {
        &self.values[self.layout.weights(part)]
    }

    fn matrix(&self, part: Part) -> &Matrix {
        &self.matrices[part as usize][0]
    }

    /// A matrix with rows and columns exchanged.
    pub(super) fn turned(&self, part: Part) -> &Matrix {
        &self.matrices[part as usize][1]
    }

    fn bias(&self, part: Part) -> &[f32] {
        &self.values[self.layout.bias(part)]
    }

    pub(super) fn shift(&self, index: usize) -> u8 {
        self.layout.header.layer_shift[index]
    }

    pub(super) fn width(&self) -> usize {
        self.layout.header.width()
    }

    /// Runs a batch through the network.
    #[inline(always)]
    pub(super) fn forward<'b, A: Arithmetic>(&self, batch: &'b Batch) -> Trace<'b> {
        let mut trace = Trace::new(self.layout, batch);
        self.embed::<A>(&mut trace);
        self.make_rows::<A>(&mut trace);
        self.attend::<A>(&mut trace);
        self.normalise::<A>(&mut trace);
        self.feed::<A>(&mut trace);
        self.pool::<A>(&mut trace);
        trace.out.iter_mut().zip(self.bias(Part::Head)).for_each(|(out, bias)| out.fill(*bias));
        self.matrix(Part::Head).multiply(&trace.pool, &mut trace.out);
        trace.out.iter_mut().for_each(|out| *out = clamp(round::<A>(out, self.shift(7)), -1023.0, 1023.0));
        trace
    }

    /// The outputs of a pass, in step/64.
    #[inline(always)]
    pub(super) fn outputs(&self, trace: &Trace<'_>) -> Vec<[i32; LANES]> {
        let shift = self.layout.header.output_shift;
        trace.out.iter().map(|out| out.map(|out| (out as i32) << shift)).collect()
    }

    /// A layer, for rows of its inputs. `out` is zero.
    #[inline(always)]
    pub(super) fn layer(&self, part: Part, x: &[Lane], out: &mut [Lane], rows: usize) {
        let (inputs, outputs) = (x.len() / rows, out.len() / rows);
        for at in 0..rows {
            let out = row_mut(out, outputs, at);
            out.iter_mut().zip(self.bias(part)).for_each(|(out, bias)| out.fill(*bias));
            self.matrix(part).multiply(row(x, inputs, at), out);
        }
    }

    /// SS-TR-003.
    #[inline(always)]
    fn embed<A: Arithmetic>(&self, trace: &mut Trace<'_>) {
        let header = &self.layout.header;
        let neighbours = trace.batch.neighbours();
        let (width, geometry) = (self.width(), usize::from(header.geometry_width));
        self.layer(Part::Geometry, &trace.near, &mut trace.hidden, neighbours);
        for hidden in &mut trace.hidden {
            *hidden = clamp(round::<A>(hidden, self.shift(0)), 0.0, 127.0);
        }
        let ranks = self.bias(Part::Embedding);
        for j in 0..neighbours {
            let h = row_mut(&mut trace.h, width, j);
            let rank = j.min(usize::from(header.rank_count) - 1) * width;
            h.iter_mut().zip(&ranks[rank..]).for_each(|(h, rank)| h.fill(*rank));
            self.matrix(Part::Embedding).multiply(row(&trace.token, header.inputs(), j), h);
            self.matrix(Part::GeometryEmbedding).multiply(row(&trace.hidden, geometry, j), h);
            h.iter_mut().for_each(|h| *h = act::<A>(h, self.shift(1)));
        }
    }

    /// SS-TR-004.
    #[inline(always)]
    fn make_rows<A: Arithmetic>(&self, trace: &mut Trace<'_>) {
        if self.layout.header.full_attention() {
            trace.row.copy_from_slice(&trace.h);
            return;
        }
        add_rows(&trace.h, &mut trace.row);
        let count = trace.batch.neighbours() as f32;
        for (row, query) in trace.row.iter_mut().zip(self.weights(Part::Query)) {
            *row = clamp(mean::<A>(row, count).map(|x| x + query), -127.0, 127.0);
        }
    }

    /// SS-TR-006.
    #[inline(always)]
    fn normalise<A: Arithmetic>(&self, trace: &mut Trace<'_>) {
        if !self.layout.header.normalised() {
            trace.normal.copy_from_slice(&trace.attended);
            return;
        }
        let width = self.width();
        for at in 0..trace.rows {
            let x = row(&trace.attended, width, at);
            let mut sum = ZERO;
            x.iter().for_each(|x| join(&mut sum, x, |sum, x| sum + x));
            let mu = round::<A>(&sum, self.layout.header.width_log2);
            let mut squares = ZERO;
            let centred = row_mut(&mut trace.centred, width, at);
            for (centred, x) in centred.iter_mut().zip(x) {
                *centred = *x;
                join(centred, &mu, |x, mu| x - mu);
                add_product(&mut squares, centred, centred);
            }
            let r = reciprocal::<A>(&squares);
            trace.norm[at] = [squares, r];
            let gains = self.weights(Part::Gain).iter().zip(self.bias(Part::Gain));
            let normal = row_mut(&mut trace.normal, width, at);
            for ((normal, centred), (gain, bias)) in normal.iter_mut().zip(centred).zip(gains) {
                let unit = self.unit::<A>(centred, &r);
                *normal = act::<A>(&unit.map(|unit| unit * gain + bias), 5);
            }
        }
    }

    /// A component of a normalised row, before its gain.
    #[inline(always)]
    pub(super) fn unit<A: Arithmetic>(&self, centred: &Lane, r: &Lane) -> Lane {
        let mut product = *centred;
        join(&mut product, r, |x, r| x * r);
        round::<A>(&product, 8)
    }

    /// SS-TR-007.
    #[inline(always)]
    fn feed<A: Arithmetic>(&self, trace: &mut Trace<'_>) {
        trace.fed.copy_from_slice(&trace.normal);
        if trace.wide.is_empty() {
            return;
        }
        self.layer(Part::Widening, &trace.normal, &mut trace.wide, trace.rows);
        for wide in &mut trace.wide {
            *wide = clamp(round::<A>(wide, self.shift(5)), 0.0, 127.0);
        }
        self.layer(Part::Narrowing, &trace.wide, &mut trace.added, trace.rows);
        for (fed, added) in trace.fed.iter_mut().zip(&mut trace.added) {
            *added = act::<A>(added, self.shift(6));
            join(fed, added, |x, y| x + y);
            *fed = clamp(*fed, -127.0, 127.0);
        }
    }

    #[inline(always)]
    fn pool<A: Arithmetic>(&self, trace: &mut Trace<'_>) {
        add_rows(&trace.fed, &mut trace.pool);
        if self.layout.header.full_attention() {
            let count = trace.rows as f32;
            trace.pool.iter_mut().for_each(|pool| *pool = mean::<A>(pool, count));
        }
    }
}

/// 2^16 / max(1, isqrt(sum)). Sums are integers below 2^22: their roots are too far from the next integer to be
/// rounded to it, and so are the quotients.
#[inline(always)]
fn reciprocal<A: Arithmetic>(squares: &Lane) -> Lane {
    squares.map(|sum| {
        let root = if sum > 1.0 { sum.sqrt() } else { 1.0 };
        if A::ROUNDED { (65_536.0 / root.floor()).floor() } else { 65_536.0 / root }
    })
}

fn position_bias(layout: &Layout, values: &[f32], axis: usize) -> Vec<f32> {
    let fourier = &values[layout.weights(Part::Fourier)];
    let term = |sines: &[f32; 8]| {
        let pairs = fourier.chunks_exact(6).zip(sines.chunks_exact(2));
        pairs.map(|(weights, sines)| weights[2 * axis] * sines[0] + weights[2 * axis + 1] * sines[1]).sum()
    };
    layout.sines().iter().map(term).collect()
}

/// The index of the difference between two relative positions.
#[inline(always)]
pub(super) fn difference(near: i8, from: i8) -> usize {
    usize::try_from(i32::from(near) - i32::from(from) + DIFFERENCES).unwrap_or(0)
}
