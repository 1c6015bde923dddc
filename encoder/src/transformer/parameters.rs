//! The parameters of a network, one after the other in the order of 6.17.2, as numbers that can change a little.
#![expect(clippy::indexing_slicing, reason = "ranges are those of the layout that the values were made with")]

use splatstream_decoder::transformer::sine;
use splatstream_format::Result;
use splatstream_format::payload::{Layer, Network, Part};
use splatstream_format::syntax::NetworkHeader;
use splatstream_gaussians::random::SplitMix64;
use std::ops::Range;

/// Differences of relative positions: -254 to 254.
pub(super) const DIFFERENCES: i32 = 254;

/// The sines and cosines of a difference of relative positions, frequency by frequency. 7.17.6.
pub(super) type Sines = [f32; 8];

/// Where each array of a network stands, and what depends on the header alone.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) header: NetworkHeader,
    weights: [Range<usize>; 11],
    bias: [Range<usize>; 11],
    length: usize,
    /// Those of the differences from -254 on.
    sines: Vec<Sines>,
}

impl Layout {
    #[expect(clippy::arithmetic_side_effects, reason = "sums of counts of the header")]
    pub(super) fn new(header: NetworkHeader) -> Self {
        let mut length = 0;
        let mut next = |count: usize| {
            length += count;
            length - count..length
        };
        let arrays = Part::ALL.map(|part| {
            let (weights, bias) = part.lengths(&header);
            (next(weights), next(bias))
        });
        let sines = (-DIFFERENCES..=DIFFERENCES).map(sines).collect();
        let (weights, bias) = (arrays.clone().map(|(weights, _)| weights), arrays.map(|(_, bias)| bias));
        Self { header, weights, bias, length, sines }
    }

    /// The offsets of the `i8` of a part.
    pub(super) fn weights(&self, part: Part) -> Range<usize> {
        self.weights[part as usize].clone()
    }

    /// The offsets of its `i16`.
    pub(super) fn bias(&self, part: Part) -> Range<usize> {
        self.bias[part as usize].clone()
    }

    /// Parameters in all.
    pub(super) fn len(&self) -> usize {
        self.length
    }

    pub(super) fn sines(&self) -> &[Sines] {
        &self.sines
    }

    /// Columns of the matrix of a part.
    pub(super) fn columns(&self, part: Part) -> usize {
        let header = &self.header;
        match part {
            Part::Geometry => 3,
            Part::GeometryEmbedding => header.geometry_width.into(),
            Part::Embedding => header.inputs(),
            Part::Query | Part::Fourier | Part::Gain => 1,
            Part::Attention | Part::Value | Part::Widening | Part::Head => header.width(),
            Part::Narrowing => header.feed_forward_width.into(),
        }
    }

    /// How much one unit of a parameter does: that of a bias does as much as that of a weight whose input is 1, but
    /// inputs are about [`ACTIVE`].
    pub(super) fn scales(&self) -> Vec<f32> {
        let mut scales = vec![1.0; self.length];
        for part in Part::ALL {
            scales[self.bias(part)].fill(ACTIVE);
        }
        scales
    }

    /// Parameters to start from.
    ///
    /// Weights are uniform and so wide that a layer of them gives what it is given on the average: `2^layer_shift`
    /// over the root of its inputs, for a shift of 6 at most 64 / sqrt(8) * sqrt(3) = 39 of 127, so that a weight has
    /// room to become larger and steps enough to be fine. The head is zero: an untrained network is its
    /// base.
    pub(super) fn initial(&self, seed: u64) -> Vec<f32> {
        let mut random = SplitMix64::new(seed);
        let mut values = vec![0.0; self.length];
        let root = libm::sqrtf(self.header.width() as f32);
        for (part, range) in Part::ALL.into_iter().zip(&self.weights) {
            let layer = |shift: usize| {
                let one = (1_u32 << self.header.layer_shift[shift].min(15)) as f32;
                one * libm::sqrtf(3.0 / self.columns(part).max(1) as f32)
            };
            let (middle, reach) = match part {
                Part::Geometry => (0.0, layer(0)),
                // Two layers add up to the embedding, and to the row; the first of each pair is to lead.
                Part::GeometryEmbedding => (0.0, layer(1) / 2.0),
                Part::Embedding => (0.0, layer(1)),
                Part::Attention => (0.0, layer(2)),
                Part::Value => (0.0, layer(4)),
                Part::Widening => (0.0, layer(5)),
                Part::Narrowing => (0.0, layer(6) / 2.0),
                Part::Query => (0.0, 16.0),
                Part::Fourier => (0.0, 4.0),
                // A normalised row has a length of 256, its components 256 / root: times this over 2^5, `ACTIVE`.
                Part::Gain => (ACTIVE * 32.0 / 256.0 * root, 0.0),
                Part::Head => (0.0, 0.0),
            };
            for value in &mut values[range.clone()] {
                *value = (middle + reach * random.signed()).clamp(-127.0, 127.0);
            }
        }
        values
    }

    /// The parameters of a network that has this header.
    pub(super) fn of(&self, network: &Network) -> Vec<f32> {
        let mut values = vec![0.0; self.length];
        for part in Part::ALL {
            let layer = network.layer(part);
            let weights = values[self.weights(part)].iter_mut();
            weights.zip(&layer.weights).for_each(|(value, &weight)| *value = weight.into());
            let bias = values[self.bias(part)].iter_mut();
            bias.zip(&layer.bias).for_each(|(value, &bias)| *value = bias.into());
        }
        values
    }

    /// The network of the integers next to parameters.
    pub(super) fn network(&self, values: &[f32]) -> Result<Network> {
        let layer = |part: Part| Layer {
            weights: values[self.weights(part)].iter().map(|value| value.round_ties_even() as i8).collect(),
            bias: values[self.bias(part)].iter().map(|value| value.round_ties_even() as i16).collect(),
        };
        Network::new(self.header, Part::ALL.map(layer))
    }

    /// Keeps parameters in the range of their integers.
    pub(super) fn confine(&self, values: &mut [f32]) {
        for part in Part::ALL {
            let (weights, bias) = (self.weights(part), self.bias(part));
            values[weights].iter_mut().for_each(|value| *value = value.clamp(-128.0, 127.0));
            values[bias].iter_mut().for_each(|value| *value = value.clamp(-32_768.0, 32_767.0));
        }
    }
}

/// What activations are to be on the root of the average of their squares: a quarter of their range, so that the
/// clamp at four times as much is rare and rounding is a small part.
const ACTIVE: f32 = 32.0;

#[expect(clippy::arithmetic_side_effects, reason = "sums of counts of the header")]
fn sines(difference: i32) -> Sines {
    let mut out = [0.0; 8];
    for (frequency, pair) in out.chunks_exact_mut(2).enumerate() {
        let phase = difference << frequency;
        pair.copy_from_slice(&[sine(phase) as f32, sine(phase + 128) as f32]);
    }
    out
}
