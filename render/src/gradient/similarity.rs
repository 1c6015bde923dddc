//! L1 and structural similarity of two pictures in one pass, with slopes.
//!
//! Source of SSIM: Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error visibility to structural
//! similarity", 2004.
//!
//! Let p and q be sum and difference of picture and reference, P, Q, P₂, Q₂ the windows' means of p, q, p², q². Similarity is
//! L·S with L = (½(P² − Q²) + C1) / (½(P² + Q²) + C1) and S the same of the variances P₂ − P² and Q₂ − Q² with C2. The slope
//! by a pixel is a* + 2 p b* + 2 q c*, where a*, b* and c* are the windows' means of the slopes by P and Q together, by P₂ and
//! by Q₂. So a row of slopes takes four filters of eleven rows of moments and three of eleven rows of those: both are kept
//! in rings of eleven rows, and nothing is stored for the whole picture but its slopes.
#![expect(clippy::arithmetic_side_effects, reason = "rows and columns of a picture in memory")]
#![expect(
    clippy::indexing_slicing,
    reason = "rows lie within the picture or are skipped, and windows within rows"
)]

use crate::image::Image;
use crate::metrics::{RADIUS, TAPS, window};
use rayon::prelude::*;

/// (K1 L)² and (K2 L)², for a range L of 1.
const STABILISERS: [f32; 2] = [0.01 * 0.01, 0.03 * 0.03];

/// Rows that a thread goes through at a time; 20 more are filtered for their windows, and those of these.
const BAND: usize = 128;

/// From a value of a channel to the next of the same.
const CHANNELS: usize = 3;

/// The sums of differences and of similarities, and the slope of the two sums, weighted, by each pixel of `picture`.
pub(super) fn compare(reference: &Image, picture: &Image, weights: [f32; 2]) -> ([f64; 2], Image) {
    let length = CHANNELS * picture.width();
    let mut slopes = vec![[0.0; 3]; picture.pixels().len()];
    let pictures = [reference.pixels().as_flattened(), picture.pixels().as_flattened()];
    let taps = window().map(|tap| tap as f32);
    let bands = slopes.as_flattened_mut().par_chunks_mut(length * BAND).enumerate();
    let band = |(number, slopes)| {
        let band = Band { pictures, length, first: number * BAND, taps, weights, slopes };
        pulp::Arch::new().dispatch(band)
    };
    let sums: Vec<[f64; 2]> = bands.map(band).collect();
    let sum = sums.iter().fold([0.0; 2], |sum: [f64; 2], band| [sum[0] + band[0], sum[1] + band[1]]);
    (sum, Image::new(picture.width(), slopes))
}

/// Some rows of both pictures.
struct Band<'a> {
    /// Reference and picture, whole.
    pictures: [&'a [f32]; 2],
    /// Values in a row.
    length: usize,
    /// The first row of the band.
    first: usize,
    taps: [f32; TAPS],
    weights: [f32; 2],
    /// The slopes by its rows.
    slopes: &'a mut [f32],
}

impl pulp::WithSimd for Band<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
        self.compare()
    }
}

impl Band<'_> {
    #[inline(always)]
    fn compare(self) -> [f64; 2] {
        let Self { pictures, length, first, taps, weights, slopes } = self;
        let height = pictures[0].len() / length;
        let rows = slopes.len() / length;
        let row = |at: usize| pictures.map(|picture| &picture[at * length..][..length]);
        let mut moments = Ring::<4>::new(length);
        let mut derivatives = Ring::<3>::new(length);
        let mut sums = [0.0; 2];
        let mut terms = vec![0.0; length];
        // Of every step, a row of moments comes in, the similarity of the row 5 above it is known, and the slopes of the row
        // 5 above that. Rows are counted from 10 above the band; outside of the picture all is 0.
        for step in 0..rows + 4 * RADIUS {
            let in_picture = |delay: usize| {
                let at = (first + step).checked_sub(2 * RADIUS + delay);
                at.filter(|&at| at < height)
            };
            match in_picture(0) {
                Some(at) => fill_moments(row(at), &mut moments.line),
                None => moments.clear(),
            }
            moments.push(step, &taps);
            if step < 2 * RADIUS {
                continue;
            }
            let means = moments.filtered(step, &taps);
            match in_picture(RADIUS) {
                Some(_) => {
                    similarity(means, &mut derivatives.line, &mut terms);
                    // Rows of other bands are theirs to count.
                    if (3 * RADIUS..3 * RADIUS + rows).contains(&step) {
                        sums[1] += total(&terms);
                    }
                }
                None => derivatives.clear(),
            }
            derivatives.push(step, &taps);
            if let Some(own) = step.checked_sub(4 * RADIUS) {
                let means = derivatives.filtered(step, &taps);
                let slopes = &mut slopes[own * length..][..length];
                fill_slopes(row(first + own), means, weights, slopes, &mut terms);
                sums[0] += total(&terms);
            }
        }
        sums
    }
}

/// The last eleven rows of some quantities, filtered along the row.
struct Ring<const N: usize> {
    length: usize,
    /// A row of each quantity that comes in, with 0 on either side.
    line: [Vec<f32>; N],
    rows: Vec<f32>,
    /// A row of each quantity, filtered down the columns as well.
    filtered: [Vec<f32>; N],
}

/// Values outside of the picture that a window needs on one side.
const MARGIN: usize = RADIUS * CHANNELS;

impl<const N: usize> Ring<N> {
    fn new(length: usize) -> Self {
        Self {
            length,
            line: std::array::from_fn(|_| vec![0.0; length + 2 * MARGIN]),
            rows: vec![0.0; TAPS * N * length],
            filtered: std::array::from_fn(|_| vec![0.0; length]),
        }
    }

    /// A row of 0 comes in.
    fn clear(&mut self) {
        self.line.iter_mut().for_each(|line| line.fill(0.0));
    }

    /// Takes the row that has come in.
    #[inline(always)]
    fn push(&mut self, step: usize, taps: &[f32; TAPS]) {
        let rows = self.rows[step % TAPS * N * self.length..].chunks_mut(self.length);
        for (line, row) in self.line.iter().zip(rows) {
            let length = row.len();
            filter(std::array::from_fn(|tap| &line[tap * CHANNELS..][..length]), taps, row);
        }
    }

    /// The window's means around the row that came in five steps ago.
    #[inline(always)]
    fn filtered(&mut self, step: usize, taps: &[f32; TAPS]) -> &[Vec<f32>; N] {
        for (number, filtered) in self.filtered.iter_mut().enumerate() {
            // The row that came in last is in the last place of the window.
            let row = |tap: usize| ((step + 1 + tap) % TAPS * N + number) * self.length;
            filter(std::array::from_fn(|tap| &self.rows[row(tap)..][..self.length]), taps, filtered);
        }
        &self.filtered
    }
}

/// Sums eleven rows with the weights of the window.
#[inline(always)]
fn filter(rows: [&[f32]; TAPS], taps: &[f32; TAPS], sums: &mut [f32]) {
    let rows = rows.map(|row| &row[..sums.len()]);
    for (x, sum) in sums.iter_mut().enumerate() {
        // The window is symmetric: half of the products do.
        let mut total = taps[RADIUS] * rows[RADIUS][x];
        for tap in 0..RADIUS {
            total += taps[tap] * (rows[tap][x] + rows[TAPS - 1 - tap][x]);
        }
        *sum = total;
    }
}

/// Sum and difference of a row, and their squares.
#[inline(always)]
fn fill_moments([reference, picture]: [&[f32]; 2], line: &mut [Vec<f32>; 4]) {
    let length = reference.len();
    let [p, q, pp, qq] = line.each_mut().map(|line| &mut line[MARGIN..][..length]);
    for x in 0..length {
        let (sum, difference) = (picture[x] + reference[x], picture[x] - reference[x]);
        (p[x], q[x]) = (sum, difference);
        (pp[x], qq[x]) = (sum * sum, difference * difference);
    }
}

/// The slopes of a row's similarity by the means of p and q together, of p² and of q²; and the similarities.
#[inline(always)]
fn similarity([p, q, pp, qq]: &[Vec<f32>; 4], line: &mut [Vec<f32>; 3], similarities: &mut [f32]) {
    let length = similarities.len();
    let p = &p[..length];
    let [q, pp, qq] = [q, pp, qq].map(|means| &means[..length]);
    let [both, first, second] = line.each_mut().map(|line| &mut line[MARGIN..][..length]);
    let [c1, c2] = STABILISERS;
    for x in 0..length {
        let (p, q) = (p[x], q[x]);
        let (p_square, q_square) = (p * p, q * q);
        let (p_variance, q_variance) = (pp[x] - p_square, qq[x] - q_square);
        let bright = 1.0 / (0.5 * (p_square + q_square) + c1);
        let rough = 1.0 / (0.5 * (p_variance + q_variance) + c2);
        let luminance = (0.5 * (p_square - q_square) + c1) * bright;
        let structure = (0.5 * (p_variance - q_variance) + c2) * rough;
        // 1 - luminance, 1 + luminance and so on, from what they are made of, which loses no digits.
        let by_pp = 0.5 * luminance * q_variance * rough * rough;
        let by_qq = -0.5 * luminance * (p_variance + 2.0 * c2) * rough * rough;
        let by_p = structure * p * q_square * bright * bright - 2.0 * p * by_pp;
        let by_q = -structure * q * (p_square + 2.0 * c1) * bright * bright - 2.0 * q * by_qq;
        (both[x], first[x], second[x]) = (by_p + by_q, by_pp, by_qq);
        similarities[x] = luminance * structure;
    }
}

/// The slopes of a row of the loss, and its differences.
#[inline(always)]
fn fill_slopes(
    [reference, picture]: [&[f32]; 2],
    [both, first, second]: &[Vec<f32>; 3],
    [difference, similarity]: [f32; 2],
    slopes: &mut [f32],
    differences: &mut [f32],
) {
    let length = slopes.len();
    let differences = &mut differences[..length];
    let [reference, picture] = [reference, picture].map(|row| &row[..length]);
    let [both, first, second] = [both, first, second].map(|means| &means[..length]);
    for x in 0..length {
        let (p, q) = (picture[x] + reference[x], picture[x] - reference[x]);
        let side = if q > 0.0 { difference } else { -difference };
        let side = if q == 0.0 { 0.0 } else { side };
        slopes[x] = side + similarity * (both[x] + 2.0 * (p * first[x] + q * second[x]));
        differences[x] = q.abs();
    }
}

/// The sum of a row, in a fixed order: sixteen sums side by side.
#[inline(always)]
fn total(row: &[f32]) -> f64 {
    let mut sums = [0.0; 16];
    let chunks = row.chunks_exact(16);
    let rest: f64 = chunks.remainder().iter().map(|&value| f64::from(value)).sum();
    for chunk in chunks {
        for lane in 0..16 {
            sums[lane] += f64::from(chunk[lane]);
        }
    }
    sums.iter().sum::<f64>() + rest
}
