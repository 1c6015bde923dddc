//! Convolutions as products of matrices.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "sizes of maps and kernels in memory, none of which is 0"
)]
#![expect(clippy::indexing_slicing, reason = "rows, columns and depths are cut from maps that are as large")]

use super::maps::{Maps, blur_taps};
use rayon::prelude::*;

/// Pixels that are computed at once: two registers of eight.
const LANES: usize = 16;
/// Channels that are computed at once: with [`LANES`] as many sums as the registers of AVX2 hold beside operands.
const GROUP: usize = 6;
/// Products in a row before the sums are stored: the operands of this many stay in the cache.
const DEPTH: usize = 256;

/// A square kernel for each input and output, and what is added to each output.
#[derive(Clone, Debug)]
pub(super) struct Convolution {
    inputs: usize,
    side: usize,
    outputs: usize,
    /// For each group of outputs, each input, row and column of the kernel: the weight of each output. Zeros
    /// fill the last group.
    weights: Vec<[f32; GROUP]>,
    /// For each group, what is added to each output.
    bias: Vec<[f32; GROUP]>,
}

/// Where the kernel is laid on: the pixels of `maps` whose first row and column these are.
pub(super) struct Windows {
    maps: Maps,
    rows: Vec<usize>,
    columns: Vec<usize>,
}

impl Windows {
    /// A window around each pixel, zeros beyond the border.
    pub(super) fn at_each_pixel(maps: &Maps, side: usize) -> Self {
        let [_, height, width] = maps.size();
        Self { maps: maps.padded(side / 2), rows: (0..height).collect(), columns: (0..width).collect() }
    }

    /// The windows whose products are those of the windows in `maps`, blurred and halved as
    /// [`Maps::blurred_half`] does.
    pub(super) fn blurred_halves(maps: &Maps, side: usize) -> Self {
        let [channels, height, width] = maps.size();
        let (rows, columns) = (BlurredAxis::new(height, side), BlurredAxis::new(width, side));
        let wide = columns.taps.len();
        let blurred = Maps::zero(channels, rows.taps.len(), wide).fill(|channel, map| {
            let from = maps.channel(channel);
            for (to, taps) in map.chunks_mut(wide).zip(&rows.taps) {
                let [above, middle, below] = taps.map(|row| &from[row * width..][..width]);
                let at = |x: usize| 0.25 * above[x] + 0.5 * middle[x] + 0.25 * below[x];
                for (to, &[before, here, after]) in to.iter_mut().zip(&columns.taps) {
                    *to = 0.25 * at(before) + 0.5 * at(here) + 0.25 * at(after);
                }
            }
        });
        Self { maps: blurred, rows: rows.windows, columns: columns.windows }
    }

    /// Copies, for each pixel of an output row, the values its window has at the places `depths` of the kernel,
    /// counted by channel, row, column: for each [`LANES`] pixels, each place, the pixels.
    #[inline(always)]
    fn gather(&self, row: usize, side: usize, depths: std::ops::Range<usize>, tiles: &mut [[f32; LANES]]) {
        let [_, _, width] = self.maps.size();
        let count = depths.len();
        for (place, depth) in depths.enumerate() {
            let (channel, line, column) = (depth / (side * side), depth / side % side, depth % side);
            let from = &self.maps.channel(channel)[(self.rows[row] + line) * width + column..];
            let tiles = tiles.chunks_mut(count).map(|tile| &mut tile[place]);
            for (tile, columns) in tiles.zip(self.columns.chunks(LANES)) {
                if columns.len() == LANES && columns[LANES - 1] - columns[0] == LANES - 1 {
                    tile.copy_from_slice(&from[columns[0]..][..LANES]);
                } else {
                    for (to, &column) in tile.iter_mut().zip(columns) {
                        *to = from[column];
                    }
                }
            }
        }
    }
}

/// One axis of blurred windows.
struct BlurredAxis {
    /// For each blurred value, the values that count a quarter, a half, a quarter.
    taps: Vec<[usize; 3]>,
    /// The first blurred value of each window.
    windows: Vec<usize>,
}

impl BlurredAxis {
    /// Of windows of `side` along `length` values.
    fn new(length: usize, side: usize) -> Self {
        // Those that are the same in each window: the first and last are never read.
        let mut taps: Vec<[usize; 3]> =
            (0..length).map(|i| [i.saturating_sub(1), i, (i + 1).min(length - 1)]).collect();
        let mut windows = Vec::new();
        for outputs in blur_taps(length + 1 - side) {
            let [before, middle, after] = outputs;
            if before.abs_diff(after) == 2 {
                windows.push(middle);
            } else {
                // At a border that reflects the output itself, the blur of the window is one of its own.
                windows.push(taps.len());
                taps.extend((0..side).map(|i| outputs.map(|output| output + i)));
            }
        }
        Self { taps, windows }
    }
}

impl Convolution {
    /// From the weights of each output, input, row and column of the kernel.
    ///
    /// # Panics
    /// If the numbers of values do not fit one another.
    pub(super) fn new([outputs, inputs, side]: [usize; 3], weights: &[f32], bias: &[f32]) -> Self {
        let depth = inputs * side * side;
        assert!(bias.len() == outputs && weights.len() == outputs * depth, "a kernel lacks values");
        let filled = |values: &[f32], output: usize, step: usize, place: usize| {
            values.get(output * step + place).copied().unwrap_or(0.0)
        };
        let group = |group: &[f32]| -> Vec<[f32; GROUP]> {
            (0..depth)
                .map(|place| std::array::from_fn(|output| filled(group, output, depth, place)))
                .collect()
        };
        let weights = weights.chunks(GROUP * depth).flat_map(group).collect();
        let bias = bias.chunks(GROUP).map(|group| std::array::from_fn(|output| filled(group, output, 1, 0)));
        Self { inputs, side, outputs, weights, bias: bias.collect() }
    }

    /// Rows, and columns, of the kernel.
    pub(super) fn side(&self) -> usize {
        self.side
    }

    /// The products of the kernels with each window.
    pub(super) fn apply(&self, windows: &Windows) -> Maps {
        let (height, width) = (windows.rows.len(), windows.columns.len());
        let row = |row| pulp::Arch::new().dispatch(Row { convolution: self, windows, row });
        let rows: Vec<Vec<[f32; LANES]>> = (0..height).into_par_iter().with_max_len(1).map(row).collect();
        let tiles = width.div_ceil(LANES);
        Maps::zero(self.outputs, height, width).fill(|channel, map| {
            for (to, from) in map.chunks_mut(width).zip(&rows) {
                let from = &from[channel / GROUP * GROUP * tiles..];
                let tiles = from.iter().skip(channel % GROUP).step_by(GROUP);
                for (to, from) in to.chunks_mut(LANES).zip(tiles) {
                    to.copy_from_slice(&from[..to.len()]);
                }
            }
        })
    }

    /// The outputs at a row of windows: for each group of outputs, each [`LANES`] windows, each output.
    #[inline(always)]
    fn row(&self, windows: &Windows, row: usize) -> Vec<[f32; LANES]> {
        let tiles = windows.columns.len().div_ceil(LANES);
        let depth = self.inputs * self.side * self.side;
        let mut sums: Vec<[f32; LANES]> = Vec::with_capacity(self.bias.len() * tiles * GROUP);
        for group in &self.bias {
            sums.extend((0..tiles).flat_map(|_| group.map(|bias| [bias; LANES])));
        }
        let mut gathered = vec![[0.0; LANES]; tiles * DEPTH.min(depth)];
        for from in (0..depth).step_by(DEPTH) {
            let depths = from..(from + DEPTH).min(depth);
            let gathered = &mut gathered[..tiles * depths.len()];
            windows.gather(row, self.side, depths.clone(), gathered);
            for (sums, weights) in sums.chunks_mut(GROUP * tiles).zip(self.weights.chunks(depth)) {
                let (sums, _) = sums.as_chunks_mut::<GROUP>();
                for (sums, gathered) in sums.iter_mut().zip(gathered.chunks(depths.len())) {
                    add_products(&weights[depths.clone()], gathered, sums);
                }
            }
        }
        sums
    }
}

/// One row of outputs. Not a closure: the compiler calls those that it could inline, which loses the wide
/// registers.
struct Row<'a> {
    convolution: &'a Convolution,
    windows: &'a Windows,
    row: usize,
}

impl pulp::WithSimd for Row<'_> {
    type Output = Vec<[f32; LANES]>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
        self.convolution.row(self.windows, self.row)
    }
}

/// Adds the products of the weights with the values, place by place in their order.
#[inline(always)]
fn add_products(weights: &[[f32; GROUP]], values: &[[f32; LANES]], sums: &mut [[f32; LANES]; GROUP]) {
    // A copy, which the compiler keeps in registers.
    let mut kept = *sums;
    for (weights, values) in weights.iter().zip(values) {
        for (sums, &weight) in kept.iter_mut().zip(weights) {
            for (sum, &value) in sums.iter_mut().zip(values) {
                *sum = weight.mul_add(value, *sum);
            }
        }
    }
    *sums = kept;
}
