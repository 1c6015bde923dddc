//! SS-TR-003 to SS-TR-008 for all Gaussians of a batch at once.
//!
//! Integers are carried in single precision, which every machine has in vectors. That is exact: no sum reaches 2^22,
//! factors that are not powers of two multiply integers only, and a number is rounded by adding one so large that no
//! fraction is left.
#![expect(
    clippy::float_arithmetic,
    reason = "integers below 2^22 in single precision: every result is exact"
)]

use super::scalar::{reciprocal, shares};
use super::{Batch, LANES, OUTPUTS_MAX, RANKS, sine};
use matrix::Matrix;
use pulp::{Simd, WithSimd};
use splatstream_format::payload::{Network, Part};
use splatstream_format::syntax::NetworkHeader;

mod matrix;

/// One value of each Gaussian of a batch.
pub(crate) type Lane = [f32; LANES];

const ZERO: Lane = [0.0; LANES];

/// Differences of relative positions: -254 to 254.
const DIFFERENCES: i32 = 254;

/// A network ready for batches.
#[derive(Debug, Clone)]
pub struct LaneNetwork {
    header: NetworkHeader,
    geometry: Matrix,
    /// Tokens, and the hidden layer of the geometry network behind them, to embeddings: one start a rank.
    embedding: Matrix,
    ranks: Vec<Vec<f32>>,
    query: Vec<f32>,
    attention: Matrix,
    /// For each axis the relative-position bias of each difference from -254 on.
    bias: [Vec<f32>; 3],
    value: Matrix,
    gain: Vec<[f32; 2]>,
    widening: Matrix,
    narrowing: Matrix,
    head: Matrix,
}

impl LaneNetwork {
    /// Prepares a network.
    pub fn new(network: &Network) -> Self {
        let header = network.header;
        let matrix = |part: Part, columns: usize| {
            let layer = network.layer(part);
            Matrix::new(&layer.weights, &layer.bias, columns)
        };
        let width = header.width();
        let embedding = network.layer(Part::Embedding);
        let gain = network.layer(Part::Gain);
        let float = |value: &i8| f32::from(*value);
        Self {
            header,
            geometry: matrix(Part::Geometry, 3),
            embedding: Matrix::new(&joined(network), &[], Self::embedding_inputs(&header)),
            ranks: embedding
                .bias
                .chunks(width)
                .map(|row| row.iter().map(|&x| f32::from(x)).collect())
                .collect(),
            query: network.layer(Part::Query).weights.iter().map(float).collect(),
            attention: matrix(Part::Attention, width),
            bias: [0, 1, 2].map(|axis| position_bias(network, axis)),
            value: matrix(Part::Value, width),
            gain: gain.weights.iter().zip(&gain.bias).map(|(&w, &b)| [w.into(), b.into()]).collect(),
            widening: matrix(Part::Widening, width),
            narrowing: matrix(Part::Narrowing, header.feed_forward_width.into()),
            head: matrix(Part::Head, width),
        }
    }

    /// The outputs for every Gaussian of a batch, in step/64: row k is output k.
    pub fn outputs(&self, batch: &Batch) -> [[i32; LANES]; OUTPUTS_MAX] {
        self.outputs_on(pulp::Arch::new(), batch)
    }

    /// The same with the instructions of an architecture; those of [`pulp::Arch::Scalar`] every machine has.
    pub fn outputs_on(&self, arch: pulp::Arch, batch: &Batch) -> [[i32; LANES]; OUTPUTS_MAX] {
        arch.dispatch(OneBatch { network: self, batch })
    }

    fn embedding_inputs(header: &NetworkHeader) -> usize {
        header.inputs().wrapping_add(header.geometry_width.into())
    }
}

/// The rows of the embedding, each with its row of the geometry embedding behind it.
fn joined(network: &Network) -> Vec<i8> {
    let header = &network.header;
    let tokens = network.layer(Part::Embedding).weights.chunks(header.inputs());
    let width = usize::from(header.geometry_width);
    let mut geometry = network.layer(Part::GeometryEmbedding).weights.chunks(width.max(1));
    tokens.flat_map(|row| row.iter().chain(geometry.next().unwrap_or_default())).copied().collect()
}

fn position_bias(network: &Network, axis: usize) -> Vec<f32> {
    let fourier = &network.layer(Part::Fourier).weights;
    let weight = |place: usize| fourier.get(place).copied().map_or(0, i32::from);
    let term = |difference: i32, k: u32| {
        let place = usize::try_from(k).unwrap_or(0).wrapping_mul(6).wrapping_add(axis.wrapping_mul(2));
        let phase = difference.wrapping_shl(k);
        let sines = [sine(phase), sine(phase.wrapping_add(128))];
        weight(place)
            .wrapping_mul(sines[0])
            .wrapping_add(weight(place.wrapping_add(1)).wrapping_mul(sines[1]))
    };
    let sum = |difference: i32| (0..4).map(|k| term(difference, k)).fold(0, i32::wrapping_add) as f32;
    (-DIFFERENCES..=DIFFERENCES).map(sum).collect()
}

/// Round(x, shift) of clause 4.2: adding half a unit more than an integer leaves no tie.
#[inline(always)]
fn round(x: Lane, shift: u32) -> Lane {
    const WHOLE: f32 = 12_582_912.0;
    let unit = 1.0 / (1_u32 << shift.min(31)) as f32;
    x.map(|x| ((x + 0.5) * unit + WHOLE) - WHOLE)
}

#[inline(always)]
fn clamp(x: Lane, low: f32, high: f32) -> Lane {
    x.map(|x| {
        let x = if x > low { x } else { low };
        if x < high { x } else { high }
    })
}

#[inline(always)]
fn act(x: Lane, shift: u32) -> Lane {
    clamp(round(x, shift), -127.0, 127.0)
}

#[inline(always)]
fn join(a: &Lane, b: &Lane, each: impl Fn(f32, f32) -> f32) -> Lane {
    let mut out = *a;
    out.iter_mut().zip(b).for_each(|(a, b)| *a = each(*a, *b));
    out
}

#[inline(always)]
fn widened(row: &[i8; LANES]) -> Lane {
    row.map(f32::from)
}

struct OneBatch<'b> {
    network: &'b LaneNetwork,
    batch: &'b Batch,
}

impl WithSimd for OneBatch<'_> {
    type Output = [[i32; LANES]; OUTPUTS_MAX];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let header = &self.network.header;
        let h = self.embeddings();
        let width = header.width();
        let mut pool = vec![ZERO; width];
        if header.full_attention() {
            let mut rows = h.clone();
            for (m, row) in rows.chunks_exact_mut(width).enumerate() {
                self.attend(row, Some(m), &h);
                self.finish(row);
            }
            self.mean(&rows, &mut pool);
        } else {
            self.mean(&h, &mut pool);
            for (x, query) in pool.iter_mut().zip(&self.network.query) {
                *x = clamp(x.map(|x| x + query), -127.0, 127.0);
            }
            self.attend(&mut pool, None, &h);
            self.finish(&mut pool);
        }
        let mut sums = [ZERO; OUTPUTS_MAX + 1];
        self.network.head.multiply(&pool, &mut sums);
        let unit = (1_u32 << header.output_shift.min(31)) as f32;
        let mut out = [[0; LANES]; OUTPUTS_MAX];
        for (out, sum) in out.iter_mut().zip(sums).take(header.outputs()) {
            *out = clamp(round(sum, self.shift(7)), -1023.0, 1023.0).map(|x| (x * unit) as i32);
        }
        out
    }
}

impl OneBatch<'_> {
    #[inline(always)]
    fn shift(&self, place: usize) -> u32 {
        self.network.header.layer_shift.get(place).copied().unwrap_or(1).into()
    }

    /// SS-TR-003: the embeddings of all neighbours, one behind the other.
    #[inline(always)]
    fn embeddings(&self) -> Vec<Lane> {
        let (network, batch) = (self.network, self.batch);
        let width = network.header.width();
        let mut h = vec![ZERO; width.wrapping_mul(batch.neighbours())];
        let mut input = vec![ZERO; LaneNetwork::embedding_inputs(&network.header)];
        let mut hidden = [ZERO; 32];
        for (rank, row) in h.chunks_exact_mut(width).enumerate() {
            let (token, behind) = input.split_at_mut_checked(network.header.inputs()).unwrap_or_default();
            token.iter_mut().zip(batch.token(rank)).for_each(|(slot, value)| *slot = widened(value));
            let mut near = [ZERO; 3];
            near.iter_mut().zip(batch.near(rank)).for_each(|(slot, value)| *slot = widened(value));
            network.geometry.multiply(&near, &mut hidden);
            for (slot, sum) in behind.iter_mut().zip(&hidden) {
                *slot = clamp(round(*sum, self.shift(0)), 0.0, 127.0);
            }
            let ranks = network.ranks.get(rank).or(network.ranks.last()).map_or(&[][..], Vec::as_slice);
            network.embedding.multiply_from(ranks, &input, row);
            row.iter_mut().for_each(|x| *x = act(*x, self.shift(1)));
        }
        h
    }

    /// The mean of rows, halves up.
    #[inline(always)]
    fn mean(&self, rows: &[Lane], out: &mut [Lane]) {
        let count = self.batch.neighbours().min(RANKS) as f32;
        let part = 1.0 / (2.0 * count);
        for row in rows.chunks_exact(out.len().max(1)) {
            out.iter_mut().zip(row).for_each(|(sum, x)| *sum = join(sum, x, |sum, x| sum + x));
        }
        // The numerator is an integer below 2^13: its quotient is off by less than the 1/128 that is left of a half.
        for x in out {
            *x = x.map(|x| ((2.0 * x + count) * part - 0.5 + 1.0 / 128.0 + 12_582_912.0) - 12_582_912.0);
        }
    }

    /// SS-TR-005: adds its context to a row. `m` is its neighbour; none: it is that of the new Gaussian.
    #[inline(always)]
    fn attend(&self, row: &mut [Lane], m: Option<usize>, h: &[Lane]) {
        let network = self.network;
        let width = row.len();
        let mut u = [ZERO; 64];
        network.attention.multiply(row, &mut u);
        u.iter_mut().for_each(|x| *x = act(*x, self.shift(2)));
        let mut share = [ZERO; RANKS];
        for ((j, logit), h) in share.iter_mut().enumerate().zip(h.chunks_exact(width)) {
            let mut sum = self.bias(j, m);
            for (u, h) in u.iter().zip(h) {
                sum.iter_mut().zip(u.iter().zip(h)).for_each(|(sum, (u, h))| *sum += u * h);
            }
            *logit = round(sum, self.shift(3));
        }
        self.softmax(&mut share);
        let mut z = [ZERO; 64];
        for (share, h) in share.iter().zip(h.chunks_exact(width)) {
            for (z, h) in z.iter_mut().zip(h) {
                z.iter_mut().zip(share.iter().zip(h)).for_each(|(z, (share, h))| *z += share * h);
            }
        }
        z.iter_mut().for_each(|z| *z = act(*z, 8));
        let mut context = [ZERO; 64];
        network.value.multiply(z.get(..width).unwrap_or_default(), &mut context);
        for (x, sum) in row.iter_mut().zip(&context) {
            *x = clamp(join(x, &act(*sum, self.shift(4)), |x, c| x + c), -127.0, 127.0);
        }
    }

    /// The relative-position bias between a neighbour and a row, before it is rounded.
    #[inline(always)]
    fn bias(&self, neighbour: usize, m: Option<usize>) -> Lane {
        let mut sum = ZERO;
        let from = m.map_or(&[][..], |m| self.batch.near(m));
        let from = from.iter().copied().chain([[0; LANES]; 3]);
        for ((table, near), from) in self.network.bias.iter().zip(self.batch.near(neighbour)).zip(from) {
            for ((sum, &near), from) in sum.iter_mut().zip(near).zip(from) {
                let place = i32::from(near).wrapping_sub(from.into()).wrapping_add(DIFFERENCES);
                *sum += table.get(place.unsigned_abs() as usize).copied().unwrap_or(0.0);
            }
        }
        sum
    }

    /// Logits become shares, Q8.
    #[inline(always)]
    fn softmax(&self, logits: &mut [Lane; RANKS]) {
        let count = self.batch.neighbours();
        for lane in 0..LANES {
            let mut own = [0_i32; RANKS];
            for (own, logit) in own.iter_mut().zip(logits.iter()) {
                *own = logit.get(lane).copied().unwrap_or(0.0) as i32;
            }
            let own = shares(own.get(..count).unwrap_or_default());
            for (row, share) in logits.iter_mut().zip(own) {
                if let Some(slot) = row.get_mut(lane) {
                    *slot = share as f32;
                }
            }
        }
    }

    /// SS-TR-006 and SS-TR-007.
    #[inline(always)]
    fn finish(&self, row: &mut [Lane]) {
        if self.network.header.normalised() {
            self.normalise(row);
        }
        let wide_width = usize::from(self.network.header.feed_forward_width);
        if wide_width == 0 {
            return;
        }
        let mut wide = [ZERO; 128];
        self.network.widening.multiply(row, &mut wide);
        let wide = wide.get_mut(..wide_width).unwrap_or_default();
        wide.iter_mut().for_each(|x| *x = clamp(round(*x, self.shift(5)), 0.0, 127.0));
        let mut narrow = [ZERO; 64];
        self.network.narrowing.multiply(wide, &mut narrow);
        for (x, sum) in row.iter_mut().zip(&narrow) {
            *x = clamp(join(x, &act(*sum, self.shift(6)), |x, y| x + y), -127.0, 127.0);
        }
    }

    #[inline(always)]
    fn normalise(&self, row: &mut [Lane]) {
        let sum = row.iter().fold(ZERO, |sum, x| join(&sum, x, |sum, x| sum + x));
        let mu = round(sum, self.network.header.width_log2.into());
        let mut squares = ZERO;
        for x in row.iter_mut() {
            *x = join(x, &mu, |x, mu| x - mu);
            squares = join(&squares, x, |sum, x| sum + x * x);
        }
        let r = squares.map(|sum| reciprocal(sum as i32) as f32);
        for (x, &[gain, bias]) in row.iter_mut().zip(&self.network.gain) {
            let unit = round(join(x, &r, |x, r| x * r), 8);
            *x = act(unit.map(|unit| unit * gain + bias), 5);
        }
    }
}
