//! The channels between two layers.
#![expect(clippy::arithmetic_side_effects, reason = "sizes of maps in memory, which are larger than a tap")]
#![expect(clippy::indexing_slicing, reason = "rows and columns lie within the map")]

use rayon::prelude::*;

/// Channels of one size, each row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Maps {
    size: [usize; 3],
    values: Vec<f32>,
}

impl Maps {
    pub(super) fn zero(channels: usize, height: usize, width: usize) -> Self {
        Self { size: [channels, height, width], values: vec![0.0; channels * height * width] }
    }

    /// Channels, rows, columns.
    pub(super) fn size(&self) -> [usize; 3] {
        self.size
    }

    /// The values of each channel.
    pub(super) fn each(&self) -> impl Iterator<Item = &[f32]> {
        self.values.chunks(self.area())
    }

    /// The values of one channel.
    pub(super) fn channel(&self, channel: usize) -> &[f32] {
        &self.values[channel * self.area()..][..self.area()]
    }

    /// The maps with the values that `fill` makes of each channel, all at once.
    pub(super) fn fill(mut self, fill: impl Fn(usize, &mut [f32]) + Sync) -> Self {
        let area = self.area();
        self.values.par_chunks_mut(area).enumerate().for_each(|(channel, map)| fill(channel, map));
        self
    }

    /// Zeros on all sides.
    pub(super) fn padded(&self, border: usize) -> Self {
        let [channels, height, width] = self.size;
        let wide = width + 2 * border;
        Self::zero(channels, height + 2 * border, wide).fill(|channel, map| {
            let rows = self.channel(channel).chunks(width).zip(map.chunks_mut(wide).skip(border));
            for (from, to) in rows {
                to[border..border + width].copy_from_slice(from);
            }
        })
    }

    /// Negative values become 0.
    pub(super) fn rectified(self) -> Self {
        self.fill(|_, map| map.iter_mut().for_each(|value| *value = value.max(0.0)))
    }

    /// The largest value of each 3 x 3 pixels; smaller by 2 rows and 2 columns.
    pub(super) fn pooled(&self) -> Self {
        let [channels, height, width] = self.size;
        let narrow = width - 2;
        Self::zero(channels, height - 2, narrow).fill(|channel, map| {
            let mut column_maxima = vec![0.0; width];
            for (row, to) in map.chunks_mut(narrow).enumerate() {
                let from = &self.channel(channel)[row * width..];
                for (x, maximum) in column_maxima.iter_mut().enumerate() {
                    *maximum = from[x].max(from[width + x]).max(from[2 * width + x]);
                }
                for (to, from) in to.iter_mut().zip(column_maxima.array_windows::<3>()) {
                    *to = from[0].max(from[1]).max(from[2]);
                }
            }
        })
    }

    /// Blurred with 1/4, 1/2, 1/4 along both axes, at every second pixel, after reflection of 2 pixels at the
    /// borders.
    pub(super) fn blurred_half(&self) -> Self {
        let [channels, height, width] = self.size;
        let (rows, columns) = (blur_taps(height), blur_taps(width));
        Self::zero(channels, rows.len(), columns.len()).fill(|channel, map| {
            let from = self.channel(channel);
            let mut blurred = vec![0.0; width];
            for (to, taps) in map.chunks_mut(columns.len()).zip(&rows) {
                let [above, middle, below] = taps.map(|row| &from[row * width..][..width]);
                for (x, blurred) in blurred.iter_mut().enumerate() {
                    *blurred = 0.25 * above[x] + 0.5 * middle[x] + 0.25 * below[x];
                }
                for (to, taps) in to.iter_mut().zip(&columns) {
                    *to = 0.25 * blurred[taps[0]] + 0.5 * blurred[taps[1]] + 0.25 * blurred[taps[2]];
                }
            }
        })
    }

    fn area(&self) -> usize {
        self.size[1] * self.size[2]
    }
}

/// For each output of the blur along an axis of `length`, at least 3, inputs: the inputs that count a quarter, a
/// half, a quarter.
pub(super) fn blur_taps(length: usize) -> Vec<[usize; 3]> {
    // Of `length + 4` values with the reflections; no output begins at the last two.
    let outputs = (length + 4 - 3) / 2 + 1;
    let reflected = |padded: usize| {
        let from_start = padded.abs_diff(2);
        from_start.min(2 * (length - 1) - from_start)
    };
    (0..outputs).map(|output| [0, 1, 2].map(|tap| reflected(2 * output + tap))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blur_reflects_at_both_ends() {
        assert_eq!(blur_taps(4), [[2, 1, 0], [0, 1, 2], [2, 3, 2]]);
        assert_eq!(blur_taps(5), [[2, 1, 0], [0, 1, 2], [2, 3, 4], [4, 3, 2]]);
    }
}
