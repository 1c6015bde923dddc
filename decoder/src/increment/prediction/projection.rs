//! SS-TR-001 and SS-TR-008: from colours to the components that a network works with, and back.
//!
//! No sum overflows (annex F.6); outputs and weights that a network or a transform lacks are 0.

use crate::transformer::{Columns, LANES, Lane, OUTPUTS_MAX, packed};
use splatstream_format::payload::Transform;
use splatstream_format::syntax::NetworkHeader;

/// Colour planes, at most: dc, and SH of degree 3.
pub(super) const COLOURS_MAX: usize = 48;

/// The largest magnitude of a colour.
const COLOUR_MAX: i32 = 1 << 30;

/// Planes of dc.
const DC_PLANES: usize = 3;

/// A colour: dc, then sh.
pub(super) type Colour = [i32; COLOURS_MAX];

/// The components of a colour, times 2^12: those of dc, then those of sh.
pub(super) type Components = [i64; OUTPUTS_MAX];

/// The transforms of dc and sh as one, as far as the outputs of a network go.
#[derive(Debug)]
pub(super) struct Projection {
    /// Row k has the weights of output k, 1.0 is 2^12. Without a component they are 0.
    rows: Vec<[i16; COLOURS_MAX]>,
    /// The rows for colours of 16 bits. None if sums might leave 32 bits; those of a basis of unit length do not.
    forward: Option<Columns>,
    /// From outputs to colours.
    back: Columns,
}

impl Projection {
    /// The components that `header` counts and the transforms have.
    pub(super) fn new(header: &NetworkHeader, dc: &Transform, sh: Option<&Transform>) -> Self {
        let mut rows = vec![[0; COLOURS_MAX]; header.outputs()];
        let dc_count = usize::from(header.dc_count);
        for (row, weights) in rows.iter_mut().take(dc_count).zip(dc.rows()) {
            row.iter_mut().zip(weights).for_each(|(slot, &weight)| *slot = weight);
        }
        for (row, weights) in rows.iter_mut().skip(dc_count).zip(sh.into_iter().flat_map(Transform::rows)) {
            row.iter_mut().skip(DC_PLANES).zip(weights).for_each(|(slot, &weight)| *slot = weight);
        }
        let reach = |row: &[i16; COLOURS_MAX]| -> u32 {
            row.iter().map(|weight| u32::from(weight.unsigned_abs())).fold(0, u32::wrapping_add)
        };
        let is_narrow = rows.iter().all(|row| reach(row) < 1 << 16);
        let weight = |row: usize, column: usize| rows.get(row)?.get(column).copied();
        let forward = is_narrow.then(|| Columns::new(rows.len(), COLOURS_MAX, weight));
        let back = Columns::new(COLOURS_MAX, rows.len(), |row, column| weight(column, row));
        Self { rows, forward, back }
    }

    /// The components of a colour.
    pub(super) fn components(&self, colour: &[i32]) -> Components {
        let mut components = [0; OUTPUTS_MAX];
        if let Some((forward, colour)) = self.forward.as_ref().zip(narrowed(colour)) {
            let mut sums = [[0; LANES]; OUTPUTS_MAX.div_ceil(LANES)];
            forward.multiply(&colour, &mut sums);
            components.iter_mut().zip(sums.as_flattened()).for_each(|(slot, &sum)| *slot = sum.into());
        } else {
            components.iter_mut().zip(&self.rows).for_each(|(slot, row)| *slot = wide_sum(row, colour));
        }
        components
    }

    /// Adds to a base what outputs stand for; they are in -2^14..=2^14.
    pub(super) fn add(&self, outputs: impl Iterator<Item = i32>, base: &mut Colour) {
        let mut pairs = [0; OUTPUTS_MAX.div_ceil(2)];
        let mut outputs = outputs.take(self.rows.len());
        for pair in &mut pairs {
            *pair = packed(outputs.next().unwrap_or(0), outputs.next().unwrap_or(0));
        }
        // With at most 19 weights of 2^12 no sum reaches 2^31.
        let mut sums: [Lane; COLOURS_MAX / LANES] = [[0; LANES]; _];
        self.back.multiply(&pairs, &mut sums);
        for (value, sum) in base.iter_mut().zip(sums.as_flattened()) {
            let change = sum.wrapping_add(1 << 11).wrapping_shr(12);
            *value = value.wrapping_add(change).clamp(COLOUR_MAX.wrapping_neg(), COLOUR_MAX);
        }
    }
}

/// A colour in pairs of 16 bits, if it has no more.
fn narrowed(colour: &[i32]) -> Option<[i32; COLOURS_MAX / 2]> {
    let mut values = [0; COLOURS_MAX];
    let mut lost = 0;
    for (slot, &value) in values.iter_mut().zip(colour) {
        *slot = value;
        lost |= value ^ i32::from(value as i16);
    }
    let mut narrow = [0; COLOURS_MAX / 2];
    let pairs = values.as_chunks().0.iter();
    narrow.iter_mut().zip(pairs).for_each(|(slot, &[low, high])| *slot = packed(low, high));
    (lost == 0).then_some(narrow)
}

fn wide_sum(weights: &[i16; COLOURS_MAX], colour: &[i32]) -> i64 {
    let terms =
        weights.iter().zip(colour).map(|(&weight, &value)| i64::from(weight).wrapping_mul(value.into()));
    terms.fold(0, i64::wrapping_add)
}

#[cfg(test)]
#[allow(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use splatstream_format::syntax::TransformHeader;

    fn transform(rank: u8, dimension: u8, mut weights: impl Iterator<Item = i16>) -> Transform {
        let header = TransformHeader { transform_id: 0, transform_kind: 0, dimension, rank };
        let weight_count = usize::from(rank) * usize::from(dimension);
        let basis = (0..weight_count).map(|_| weights.next().unwrap_or(0)).collect();
        Transform { header, mean: vec![0; dimension.into()], basis }
    }

    fn header(dc_count: u8, sh_count: u8) -> NetworkHeader {
        NetworkHeader {
            network_flags: 0,
            width_log2: 3,
            feed_forward_width: 0,
            geometry_width: 0,
            fourier_count: 0,
            rank_count: 1,
            dc_count,
            sh_count,
            token_shift: 0,
            output_shift: 4,
            layer_shift: [1; 8],
        }
    }

    /// SS-TR-001 and SS-TR-008 as they are written.
    fn as_written(transform: &Transform, colour: &[i32], outputs: &[i32]) -> (Vec<i64>, Vec<i32>) {
        let rows: Vec<&[i16]> = transform.rows().take(outputs.len()).collect();
        let dot = |row: &&[i16]| row.iter().zip(colour).map(|(&w, &c)| i64::from(w) * i64::from(c)).sum();
        let moved = |(i, &base): (usize, &i32)| {
            let sum: i64 =
                rows.iter().zip(outputs).map(|(row, &out)| i64::from(row[i]) * i64::from(out)).sum();
            (i64::from(base) + ((sum + 2048) >> 12)).clamp(-1 << 30, 1 << 30) as i32
        };
        (rows.iter().map(dot).collect(), colour.iter().enumerate().map(moved).collect())
    }

    proptest! {
        /// Bases of unit length and any others, colours of 16 bits and of 31, missing components.
        #[test]
        fn narrow_sums_are_the_sums_of_the_text(
            weights in proptest::collection::vec(-4096_i16..=4096, 1..300),
            (dc_rank, sh_rank) in (0_u8..=3, 0_u8..=45),
            (dc_count, sh_count) in (0_u8..=3, 0_u8..=16),
            unused in prop_oneof![Just(1_u32), Just(16), Just(23)],
            values in proptest::collection::vec(any::<i32>(), COLOURS_MAX),
            outputs in proptest::collection::vec(-16_368..=16_368, OUTPUTS_MAX),
            thin in 1_i16..20,
        ) {
            let mut weights = weights.into_iter().map(|weight| weight / thin).cycle();
            let dc = transform(dc_rank, 3, &mut weights);
            let sh = transform(sh_rank, 45, &mut weights);
            let colour: Vec<i32> = values.iter().map(|value| value >> unused).collect();
            let projection = Projection::new(&header(dc_count, sh_count), &dc, Some(&sh));
            let (dc_outputs, sh_outputs) = outputs.split_at(dc_count.into());
            let (dc_sums, dc_colour) = as_written(&dc, &colour[..3], dc_outputs);
            let (sh_sums, sh_colour) = as_written(&sh, &colour[3..], &sh_outputs[..sh_count.into()]);

            let components = projection.components(&colour);
            prop_assert_eq!(&components[..dc_sums.len()], &dc_sums);
            let of_sh = &components[dc_count.into()..];
            prop_assert_eq!(&of_sh[..sh_sums.len()], &sh_sums);
            prop_assert!(of_sh[sh_sums.len()..].iter().all(|&sum| sum == 0));
            let mut moved = [0; COLOURS_MAX];
            moved.copy_from_slice(&colour);
            projection.add(outputs.iter().copied(), &mut moved);
            prop_assert_eq!(&moved[..], &[dc_colour, sh_colour].concat());
        }
    }
}
