//! SS-TR-003 to SS-TR-008 for one Gaussian, as the text has them. The fast path is compared with this.
//!
//! No sum overflows (annex F.6), and the rows of a batch have the widths of the header of its network: what is taken in place of an
//! element that is not there never is.

use super::{Batch, RANKS, act, round, sine};
use crate::predictor::EXP;
use splatstream_format::payload::{Layer, Network, Part};
use splatstream_format::syntax::NetworkHeader;

/// The embedding of a neighbour, or a row of the attention.
type Row = Vec<i32>;

/// The outputs for one Gaussian of a batch, in step/64.
pub fn outputs(network: &Network, batch: &Batch, lane: usize) -> Vec<i32> {
    let header = &network.header;
    let near = |neighbour: usize| -> Row { lane_of(batch.near(neighbour), lane) };
    let nears: Vec<Row> = (0..batch.neighbours()).map(near).collect();
    let embed =
        |(rank, near): (usize, &Row)| embedding(network, rank, &lane_of(batch.token(rank), lane), near);
    let h: Vec<Row> = nears.iter().enumerate().map(embed).collect();
    let rows = if header.full_attention() { h.clone() } else { vec![mean_row(network, &h)] };
    let finished = |(m, row): (usize, &Row)| {
        let origin = if header.full_attention() { nears.get(m).cloned() } else { None };
        let x = attention(network, row, &origin.unwrap_or_else(|| vec![0; 3]), &h, &nears);
        feed_forward(network, normalised(network, x))
    };
    let rows: Vec<Row> = rows.iter().enumerate().map(finished).collect();
    let pool = if header.full_attention() { mean(&rows) } else { rows.concat() };
    let head = network.layer(Part::Head);
    let out =
        |sum: i32| round(sum, shift(header, 7)).clamp(-1023, 1023).wrapping_shl(header.output_shift.into());
    sums(head, &head.bias, &pool).map(out).collect()
}

fn lane_of(rows: &[[i8; super::LANES]], lane: usize) -> Row {
    rows.iter().map(|row| row.get(lane).copied().unwrap_or(0).into()).collect()
}

fn shift(header: &NetworkHeader, index: usize) -> u32 {
    header.layer_shift.get(index).copied().unwrap_or(1).into()
}

fn dot(weights: &[i8], x: &[i32]) -> i32 {
    weights.iter().zip(x).fold(0, |sum, (&w, &x)| sum.wrapping_add(i32::from(w).wrapping_mul(x)))
}

/// `W[i] * x` plus a bias, for every row of a layer.
fn sums<'s>(layer: &'s Layer, bias: &'s [i16], x: &'s [i32]) -> impl Iterator<Item = i32> + 's {
    let rows = layer.weights.chunks_exact(x.len().max(1));
    let bias = bias.iter().copied().chain(core::iter::repeat(0));
    rows.zip(bias).map(|(row, bias)| dot(row, x).wrapping_add(bias.into()))
}

/// SS-TR-003.
fn embedding(network: &Network, rank: usize, token: &[i32], near: &[i32]) -> Row {
    let header = &network.header;
    let geometry = network.layer(Part::Geometry);
    let hidden: Row =
        sums(geometry, &geometry.bias, near).map(|sum| act(sum, shift(header, 0)).max(0)).collect();
    let embedding = network.layer(Part::Embedding);
    let rank = rank.min(usize::from(header.rank_count).saturating_sub(1));
    let start = rank.wrapping_mul(header.width());
    let ranks = embedding.bias.get(start..).unwrap_or_default();
    let mut near = sums(network.layer(Part::GeometryEmbedding), &[], &hidden);
    sums(embedding, ranks, token)
        .map(|sum| act(sum.wrapping_add(near.next().unwrap_or(0)), shift(header, 1)))
        .collect()
}

/// The mean of rows, halves up.
fn mean(rows: &[Row]) -> Row {
    let count = i32::try_from(rows.len().clamp(1, RANKS)).unwrap_or(1);
    let width = rows.first().map_or(0, Vec::len);
    let column =
        |i: usize| rows.iter().filter_map(|row| row.get(i)).fold(0_i32, |sum, x| sum.wrapping_add(*x));
    let rounded = |sum: i32| sum.wrapping_mul(2).wrapping_add(count).div_euclid(count.wrapping_mul(2));
    (0..width).map(|i| rounded(column(i))).collect()
}

/// SS-TR-004: the row of the new Gaussian.
fn mean_row(network: &Network, h: &[Row]) -> Row {
    let query = &network.layer(Part::Query).weights;
    mean(h).iter().zip(query).map(|(x, &q)| x.wrapping_add(q.into()).clamp(-127, 127)).collect()
}

/// SS-TR-005.
fn attention(network: &Network, row: &[i32], from: &[i32], h: &[Row], nears: &[Row]) -> Row {
    let header = &network.header;
    let u: Row =
        sums(network.layer(Part::Attention), &[], row).map(|sum| act(sum, shift(header, 2))).collect();
    let fourier = &network.layer(Part::Fourier).weights;
    let logit = |(h, near): (&Row, &Row)| {
        let products = h.iter().zip(&u).fold(0_i32, |sum, (h, u)| sum.wrapping_add(h.wrapping_mul(*u)));
        round(products.wrapping_add(dot(fourier, &features(near, from))), shift(header, 3))
    };
    let logits: Vec<i32> = h.iter().zip(nears).map(logit).collect();
    let share = shares(&logits);
    let z = |i: usize| {
        let term = |(h, share): (&Row, &i32)| h.get(i).copied().unwrap_or(0).wrapping_mul(*share);
        act(h.iter().zip(&share).map(term).fold(0, i32::wrapping_add), 8)
    };
    let z: Row = (0..row.len()).map(z).collect();
    let value = network.layer(Part::Value);
    let context = sums(value, &value.bias, &z).map(|sum| act(sum, shift(header, 4)));
    row.iter().zip(context).map(|(x, c)| x.wrapping_add(c).clamp(-127, 127)).collect()
}

/// The Fourier features of a relative position: frequency by frequency, axis by axis, sine and cosine.
fn features(near: &[i32], from: &[i32]) -> Row {
    let phases = |k: u32| near.iter().zip(from).map(move |(n, f)| n.wrapping_sub(*f).wrapping_shl(k));
    (0..4).flat_map(|k| phases(k).flat_map(|phase| [sine(phase), sine(phase.wrapping_add(128))])).collect()
}

/// The softmax of logits: Q8.
fn shares(logits: &[i32]) -> Vec<i32> {
    let largest = logits.iter().copied().max().unwrap_or(0);
    let e = |logit: &i32| -> u32 {
        let below = largest.wrapping_sub(*logit).min(255).unsigned_abs();
        EXP.get(below as usize).copied().unwrap_or(1).into()
    };
    let e: Vec<u32> = logits.iter().map(e).collect();
    let total = e.iter().copied().fold(0, u32::wrapping_add);
    let r = (1_u32 << 26).checked_div(total).unwrap_or(0);
    e.iter().map(|e| round(e.wrapping_mul(r).cast_signed(), 18)).collect()
}

/// SS-TR-006.
fn normalised(network: &Network, x: Row) -> Row {
    if !network.header.normalised() {
        return x;
    }
    let mu = round(x.iter().copied().fold(0, i32::wrapping_add), network.header.width_log2.into());
    let centred: Row = x.iter().map(|x| x.wrapping_sub(mu)).collect();
    let r = reciprocal(centred.iter().map(|x| x.wrapping_mul(*x)).fold(0, i32::wrapping_add));
    let Layer { weights, bias } = network.layer(Part::Gain);
    let scaled = |((x, &gain), &bias): ((&i32, &i8), &i16)| {
        let unit = round(x.wrapping_mul(r), 8);
        act(unit.wrapping_mul(gain.into()).wrapping_add(bias.into()), 5)
    };
    centred.iter().zip(weights).zip(bias).map(scaled).collect()
}

/// 2^16 / max(1, isqrt(sum)), `sum` not negative.
pub(super) fn reciprocal(sum: i32) -> i32 {
    (1_i32 << 16).checked_div(sum.max(0).isqrt().max(1)).unwrap_or(0)
}

/// SS-TR-007.
fn feed_forward(network: &Network, x: Row) -> Row {
    let header = &network.header;
    if header.feed_forward_width == 0 {
        return x;
    }
    let widening = network.layer(Part::Widening);
    let wide: Row = sums(widening, &widening.bias, &x).map(|sum| act(sum, shift(header, 5)).max(0)).collect();
    let narrowing = network.layer(Part::Narrowing);
    let added = sums(narrowing, &narrowing.bias, &wide).map(|sum| act(sum, shift(header, 6)));
    x.iter().zip(added).map(|(x, y)| x.wrapping_add(y).clamp(-127, 127)).collect()
}
