//! Structural similarity.
//!
//! Source: Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error visibility to structural
//! similarity", 2004.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "sizes of a picture in memory, which is larger than a window"
)]
#![expect(
    clippy::indexing_slicing,
    reason = "rows and columns lie within the picture, and windows within rows"
)]

use super::{Mask, assert_same_size, shown};
use crate::image::Image;
use rayon::prelude::*;

/// Pixels from the middle of the window to its edge.
pub(crate) const RADIUS: usize = 5;
/// Pixels across the window.
pub(crate) const TAPS: usize = 2 * RADIUS + 1;
/// Standard deviation of the window's weights, pixels.
const SIGMA: f64 = 1.5;
/// (K1 L)² and (K2 L)², for a range L of 1.
const STABILISERS: [f64; 2] = [0.01 * 0.01, 0.03 * 0.03];
/// Rows of the map that one thread computes at a time: enough that the rows above and below, which two bands
/// filter, are few, and few enough that they stay in the cache.
const BAND: usize = 32;

/// The structural similarity of each pixel: -1 to 1, 1 where the pictures are equal.
///
/// The window is Gaussian, 11 x 11 pixels, sigma 1.5, its weights sum to 1; K1 = 0.01, K2 = 0.03, L = 1; variances
/// and the covariance are those of a population, that is, not corrected for a sample. Channels are compared one
/// by one and averaged. Only pixels whose window lies in the picture have a value: 5 pixels at each border have
/// none.
#[derive(Clone, Debug, PartialEq)]
pub struct SsimMap {
    /// Pixels in a row of the picture.
    width: usize,
    /// Row by row, without the border.
    values: Vec<f64>,
}

/// The mean structural similarity of two pictures, -1 to 1; as [`SsimMap`] defines it. None if a side is
/// shorter than 11 pixels.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn ssim(reference: &Image, image: &Image) -> Option<f64> {
    SsimMap::between(reference, image).map(|map| map.mean())
}

impl SsimMap {
    /// Compares two pictures. None if a side is shorter than the window, 11 pixels.
    ///
    /// # Panics
    /// If the sizes differ.
    #[must_use]
    pub fn between(reference: &Image, image: &Image) -> Option<Self> {
        assert_same_size(reference, image);
        let (width, height) = (reference.width(), reference.height());
        if width < TAPS || height < TAPS {
            return None;
        }
        let inner = width - 2 * RADIUS;
        let mut values = vec![0.0; inner * (height - 2 * RADIUS)];
        let weights = window();
        values.par_chunks_mut(inner * BAND).enumerate().for_each(|(band, values)| {
            let first = width * BAND * band;
            let last = first + width * (values.len() / inner + 2 * RADIUS);
            let rows = [&reference.pixels()[first..last], &image.pixels()[first..last]];
            pulp::Arch::new().dispatch(Band { rows, width, weights: &weights, values });
        });
        Some(Self { width, values })
    }

    /// The mean over all pixels that have a value.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len() as f64
    }

    /// The mean over the pixels of the mask that have a value. None if there are none.
    ///
    /// # Panics
    /// If the mask is of another size than the pictures.
    #[must_use]
    pub fn masked_mean(&self, mask: &Mask) -> Option<f64> {
        let inner = self.width - 2 * RADIUS;
        let height = self.values.len() / inner + 2 * RADIUS;
        assert_eq!(
            mask.included().len(),
            self.width * height,
            "the mask is of another size than the pictures"
        );
        let rows = mask.included().chunks(self.width).skip(RADIUS);
        let included = rows.flat_map(|row| &row[RADIUS..RADIUS + inner]);
        let counted = self.values.iter().zip(included).filter(|&(_, &included)| included);
        let (sum, count) = counted.fold((0.0, 0_usize), |(sum, count), (value, _)| (sum + value, count + 1));
        (count > 0).then(|| sum / count as f64)
    }
}

/// The window along one axis; the whole is the product of two.
pub(crate) fn window() -> [f64; TAPS] {
    let bell = std::array::from_fn(|tap| {
        let distance = tap as f64 - RADIUS as f64;
        libm::exp(-0.5 * (distance / SIGMA) * (distance / SIGMA))
    });
    let sum: f64 = bell.iter().sum();
    bell.map(|weight: f64| weight / sum)
}

/// Some rows of the map, and the rows of both pictures that their windows touch. Not a closure: the compiler
/// calls those that it could inline, which loses the wide registers.
struct Band<'a> {
    rows: [&'a [[f32; 3]]; 2],
    width: usize,
    weights: &'a [f64; TAPS],
    values: &'a mut [f64],
}

impl pulp::WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        compare_band(self.rows, self.width, self.weights, self.values);
    }
}

/// Computes the rows `values` of the map from the rows of both pictures.
///
/// The moments are those of p = a + b and q = a - b, which need four filters where those of a and b need five:
/// 2 mean(a) mean(b) = (mean(p)² - mean(q)²) / 2, mean(a)² + mean(b)² = (mean(p)² + mean(q)²) / 2, and so on.
#[inline(always)]
fn compare_band(rows: [&[[f32; 3]]; 2], width: usize, weights: &[f64; TAPS], values: &mut [f64]) {
    let inner = width - 2 * RADIUS;
    let [reference, image] = rows.map(|pixels| pixels.chunks(width));
    let mut moments = [(); 4].map(|()| vec![0.0; width]);
    let mut filtered = vec![0.0; reference.len() * 4 * inner];
    let mut sums = vec![0.0; 4 * inner];
    for channel in 0..3 {
        let pairs = reference.clone().zip(image.clone());
        for ((reference, image), filtered) in pairs.zip(filtered.chunks_mut(4 * inner)) {
            fill_moments(reference, image, channel, &mut moments);
            for (moment, filtered) in moments.iter().zip(filtered.chunks_mut(inner)) {
                filter_row(moment, weights, filtered);
            }
        }
        for (row, values) in values.chunks_mut(inner).enumerate() {
            filter_column(&filtered[row * 4 * inner..], weights, &mut sums);
            add_similarity(&sums, values);
        }
    }
}

/// Sum and difference of a channel, and their squares.
#[inline(always)]
fn fill_moments(reference: &[[f32; 3]], image: &[[f32; 3]], channel: usize, moments: &mut [Vec<f64>; 4]) {
    let [sums, differences, sum_squares, difference_squares] = moments;
    for (x, (&reference, &image)) in reference.iter().zip(image).enumerate() {
        let (reference, image) = (f64::from(shown(reference[channel])), f64::from(shown(image[channel])));
        let (sum, difference) = (reference + image, reference - image);
        (sums[x], differences[x]) = (sum, difference);
        (sum_squares[x], difference_squares[x]) = (sum * sum, difference * difference);
    }
}

/// Filters along a row: `filtered` is shorter by the window's width less one.
#[inline(always)]
fn filter_row(row: &[f64], weights: &[f64; TAPS], filtered: &mut [f64]) {
    for (filtered, window) in filtered.iter_mut().zip(row.array_windows::<TAPS>()) {
        // The window is symmetric: half of the products do.
        let mut sum = weights[RADIUS] * window[RADIUS];
        for tap in 0..RADIUS {
            sum += weights[tap] * (window[tap] + window[TAPS - 1 - tap]);
        }
        *filtered = sum;
    }
}

/// Filters down the columns of as many rows as the window has, each as long as `sums`.
#[inline(always)]
fn filter_column(rows: &[f64], weights: &[f64; TAPS], sums: &mut [f64]) {
    let length = sums.len();
    let rows: [&[f64]; TAPS] = std::array::from_fn(|tap| &rows[tap * length..][..length]);
    for (x, sum) in sums.iter_mut().enumerate() {
        *sum = weights[RADIUS] * rows[RADIUS][x];
        for tap in 0..RADIUS {
            *sum += weights[tap] * (rows[tap][x] + rows[TAPS - 1 - tap][x]);
        }
    }
}

/// Adds a channel's third of the similarity to a row of the map, from the means of sum, difference and squares.
#[inline(always)]
fn add_similarity(means: &[f64], values: &mut [f64]) {
    let inner = values.len();
    let [p, q, pp, qq] = [0, 1, 2, 3].map(|moment| &means[moment * inner..][..inner]);
    let [first, second] = STABILISERS;
    for (x, value) in values.iter_mut().enumerate() {
        let (p_square, q_square) = (p[x] * p[x], q[x] * q[x]);
        let (p_variance, q_variance) = (pp[x] - p_square, qq[x] - q_square);
        let luminance = (0.5 * (p_square - q_square) + first) / (0.5 * (p_square + q_square) + first);
        let structure =
            (0.5 * (p_variance - q_variance) + second) / (0.5 * (p_variance + q_variance) + second);
        *value += luminance * structure / 3.0;
    }
}
