//! A learned metric that forgives a shift by a pixel.
//!
//! Source: Ghildyal and Liu, "Shift-tolerant perceptual similarity metric", 2022, with its AlexNet; facts of the
//! network from the weights and the package stlpips-pytorch 0.0.2.

mod convolution;
mod maps;
mod npy;
mod weights;

pub use weights::WeightsError;

use super::{assert_same_size, shown};
use crate::image::Image;
use convolution::{Convolution, Windows};
use maps::Maps;
use rayon::prelude::*;
use std::path::Path;

/// Keeps the division by a feature's length from failing where all channels are 0.
const EPSILON: f64 = 1e-10;
/// The shortest side whose maps are large enough for each layer.
const SHORTEST_SIDE: usize = 21;

/// The network: five layers, and what to subtract from a channel of the picture and to divide it by first.
///
/// About 30 thousand million multiplications for a picture of 960 x 540 pixels. They are fused with the
/// additions, as [`f32::mul_add`] is: a processor without that instruction gives the same figures, slowly.
#[derive(Clone, Debug)]
pub struct StLpips {
    shift: [f32; 3],
    scale: [f32; 3],
    layers: [Layer; 5],
}

/// A convolution, and how much each of its outputs counts in the distance.
#[derive(Clone, Debug)]
struct Layer {
    convolution: Convolution,
    channel_weights: Vec<f32>,
}

/// What the network makes of a picture; computed once for a reference that many pictures are compared with.
/// About 170 bytes for each pixel of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Features {
    layers: [Maps; 5],
}

impl StLpips {
    /// Reads the weights, a NumPy archive (`.npz`) of the arrays of the published network under their names
    /// there.
    ///
    /// # Errors
    /// A file that cannot be read or is no archive; an array that is missing, of another shape, or not of
    /// 32-bit floats in the order of C; a value that is not finite.
    pub fn read(path: &Path) -> Result<Self, WeightsError> {
        weights::read(path)
    }

    /// The distance of two pictures: 0 for equal ones, without a unit or an upper limit. None if a side is
    /// shorter than 21 pixels. Equal for any number of threads and on every machine.
    ///
    /// # Panics
    /// If the sizes differ.
    #[must_use]
    pub fn distance(&self, reference: &Image, image: &Image) -> Option<f64> {
        assert_same_size(reference, image);
        Some(self.feature_distance(&self.features(reference)?, &self.features(image)?))
    }

    /// The outputs of the layers, for [`StLpips::feature_distance`]. None if a side is shorter than 21 pixels.
    #[must_use]
    pub fn features(&self, image: &Image) -> Option<Features> {
        if image.width() < SHORTEST_SIDE || image.height() < SHORTEST_SIDE {
            return None;
        }
        let [first, second, third, fourth, fifth] = self.layers.each_ref().map(|layer| &layer.convolution);
        // The blur of the first layer comes before its rectifier and is linear, hence may be done on the three
        // channels of the picture instead of the 64 of the output.
        let windows = Windows::blurred_halves(&self.input(image).padded(2), first.side());
        let one = first.apply(&windows).rectified();
        let around = |maps: &Maps, layer: &Convolution| Windows::at_each_pixel(maps, layer.side());
        let two = second.apply(&around(&one.pooled().blurred_half(), second)).rectified();
        let three = third.apply(&around(&two.pooled().blurred_half(), third)).rectified();
        let four = fourth.apply(&around(&three, fourth)).rectified();
        let five = fifth.apply(&around(&four, fifth)).rectified();
        Some(Features { layers: [one, two, three, four, five] })
    }

    /// The distance of two pictures, from their features.
    ///
    /// # Panics
    /// If the sizes of the features differ.
    #[must_use]
    pub fn feature_distance(&self, reference: &Features, image: &Features) -> f64 {
        let layers = reference.layers.iter().zip(&image.layers).zip(&self.layers);
        layers
            .map(|((reference, image), layer)| layer_distance(reference, image, &layer.channel_weights))
            .sum()
    }

    /// The picture in -1..1, then shifted and scaled as the network was trained.
    #[expect(clippy::indexing_slicing, reason = "rows and channels lie within the maps")]
    fn input(&self, image: &Image) -> Maps {
        Maps::zero(3, image.height(), image.width()).fill(|channel, map| {
            for (value, &pixel) in map.iter_mut().zip(image.pixels()) {
                *value = (2.0 * shown(pixel[channel]) - 1.0 - self.shift[channel]) / self.scale[channel];
            }
        })
    }
}

/// The mean over the pixels of the weighted square distance of features of length 1.
#[expect(clippy::indexing_slicing, reason = "rows and channels lie within the maps")]
#[expect(clippy::arithmetic_side_effects, reason = "sizes of maps in memory")]
fn layer_distance(reference: &Maps, image: &Maps, weights: &[f32]) -> f64 {
    assert_eq!(reference.size(), image.size(), "features of pictures of different sizes are compared");
    let [_, height, width] = reference.size();
    let row_distance = |row: usize| -> f64 {
        let lengths = [reference, image].map(|maps| {
            let mut squares = vec![0.0; width];
            for map in maps.each() {
                for (square, &value) in squares.iter_mut().zip(&map[row * width..]) {
                    *square += f64::from(value) * f64::from(value);
                }
            }
            squares.iter().map(|square: &f64| square.sqrt() + EPSILON).collect::<Vec<f64>>()
        });
        let mut distances = vec![0.0; width];
        for ((reference, image), &weight) in reference.each().zip(image.each()).zip(weights) {
            let pairs = reference[row * width..].iter().zip(&image[row * width..]);
            let lengths = lengths[0].iter().zip(&lengths[1]);
            for ((distance, (&a, &b)), (a_length, b_length)) in distances.iter_mut().zip(pairs).zip(lengths) {
                let difference = f64::from(a) / a_length - f64::from(b) / b_length;
                *distance += f64::from(weight) * difference * difference;
            }
        }
        distances.iter().sum()
    };
    let rows: Vec<f64> = (0..height).into_par_iter().map(row_distance).collect();
    rows.iter().sum::<f64>() / (width * height) as f64
}
