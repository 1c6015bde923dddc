//! A network as batches want it.
//!
//! No sum overflows (annex F.6). Layers have the lengths that the header of the network gives (6.17); padding is 0.

use super::Machine;
use super::matrix::{Matrix, ROWS, blocks};
use crate::transformer::sine;
use splatstream_format::payload::{Network, Part};
use splatstream_format::syntax::NetworkHeader;

/// Differences of relative positions reach from -254 to 254.
pub(super) const DIFFERENCE_MAX: i32 = 254;

/// Relative-position bias of each difference, from -254 on; those after them are unused.
pub(super) type Biases = [i32; 512];

/// A network ready for batches.
#[derive(Debug, Clone)]
pub struct LaneNetwork {
    pub(super) header: NetworkHeader,
    pub(super) geometry: Matrix,
    /// Tokens, and the hidden layer of the geometry network after them, to embeddings; see `ranks`.
    pub(super) embedding: Matrix,
    /// The biases of the embedding for each rank.
    pub(super) ranks: Vec<Vec<[i32; ROWS]>>,
    /// Two values a step.
    pub(super) query: Vec<[i32; 2]>,
    pub(super) attention: Matrix,
    /// For each axis.
    pub(super) bias: [Biases; 3],
    pub(super) value: Matrix,
    /// Gain and bias of each row.
    pub(super) gain: Vec<[i32; 2]>,
    pub(super) widening: Matrix,
    pub(super) narrowing: Matrix,
    pub(super) head: Matrix,
    /// What it runs on.
    pub(super) machine: Machine,
}

impl LaneNetwork {
    /// Its dimensions.
    pub fn header(&self) -> &NetworkHeader {
        &self.header
    }

    /// Prepares a network.
    pub fn new(network: &Network) -> Self {
        let header = network.header;
        let matrix = |part: Part, columns: usize| {
            let layer = network.layer(part);
            Matrix::new(&layer.weights, &layer.bias, columns)
        };
        let width = header.width();
        let query = &network.layer(Part::Query).weights;
        let gain = network.layer(Part::Gain);
        Self {
            header,
            geometry: matrix(Part::Geometry, 3),
            embedding: embedding(network),
            ranks: network.layer(Part::Embedding).bias.chunks(width).map(blocks).collect(),
            query: query.as_chunks().0.iter().map(|both: &[i8; 2]| both.map(i32::from)).collect(),
            attention: matrix(Part::Attention, width),
            bias: [0, 1, 2].map(|axis| position_bias(network, axis)),
            value: matrix(Part::Value, width),
            gain: gain.weights.iter().zip(&gain.bias).map(|(&w, &b)| [w.into(), b.into()]).collect(),
            widening: matrix(Part::Widening, width),
            narrowing: matrix(Part::Narrowing, header.feed_forward_width.into()),
            head: matrix(Part::Head, width),
            machine: Machine::all().last().copied().unwrap_or(Machine::Portable),
        }
    }
}

/// The rows of the embedding, each with its row of the geometry embedding after it. Both begin with a pair.
fn embedding(network: &Network) -> Matrix {
    let header = &network.header;
    let (inputs, geometry) = (header.inputs(), usize::from(header.geometry_width));
    let padding = inputs & 1;
    let tokens = network.layer(Part::Embedding).weights.chunks(inputs.max(1));
    let mut after = network.layer(Part::GeometryEmbedding).weights.chunks(geometry.max(1));
    let row = |token: &[i8]| -> Vec<i8> {
        let after = after.next().unwrap_or_default();
        token.iter().copied().chain(core::iter::repeat_n(0, padding)).chain(after.iter().copied()).collect()
    };
    let weights: Vec<i8> = tokens.flat_map(row).collect();
    let columns = inputs.wrapping_add(padding).wrapping_add(geometry);
    Matrix::new(&weights, &[], columns)
}

fn position_bias(network: &Network, axis: usize) -> Biases {
    let fourier = &network.layer(Part::Fourier).weights;
    let weight = |index: usize| fourier.get(index).copied().map_or(0, i32::from);
    let term = |difference: i32, k: u32| {
        let index = usize::try_from(k).unwrap_or(0).wrapping_mul(6).wrapping_add(axis.wrapping_mul(2));
        let phase = difference.wrapping_shl(k);
        let sines = [sine(phase), sine(phase.wrapping_add(128))];
        weight(index)
            .wrapping_mul(sines[0])
            .wrapping_add(weight(index.wrapping_add(1)).wrapping_mul(sines[1]))
    };
    let sum = |difference: i32| (0..4).map(|k| term(difference, k)).fold(0, i32::wrapping_add);
    let mut out = [0; 512];
    out.iter_mut()
        .zip(-DIFFERENCE_MAX..=DIFFERENCE_MAX)
        .for_each(|(slot, difference)| *slot = sum(difference));
    out
}
