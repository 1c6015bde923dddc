//! The order of a space-filling curve, for formats whose order is free: neighbours in space are neighbours in the file.

use crate::reading::row_of;
use splatstream_gaussians::GaussianFrame;

/// Steps along each axis: 21 bits of three coordinates fill 63.
const STEPS: f64 = ((1_u64 << 21) - 1) as f64;

/// All rows of a frame in Morton order; equal places stay in the order of the frame.
pub(crate) fn morton_order(frame: &GaussianFrame) -> Vec<u32> {
    let ranges = frame.position().each_ref().map(|plane| range(plane));
    let code = |row: u32| {
        let centre = row_of(frame.position(), row as usize);
        let axes = centre.into_iter().zip(ranges).enumerate();
        axes.fold(0_u64, |code, (axis, (value, (least, extent)))| {
            let steps = if extent > 0.0 { (f64::from(value) - least) / extent * STEPS } else { 0.0 };
            // `as` saturates.
            code | spread(steps.round() as u64) << axis
        })
    };
    let mut coded: Vec<(u64, u32)> = (0..frame.len() as u32).map(|row| (code(row), row)).collect();
    coded.sort_unstable();
    coded.into_iter().map(|(_, row)| row).collect()
}

/// The least value and how far the greatest is from it.
fn range(values: &[f32]) -> (f64, f64) {
    let least = values.iter().fold(f64::INFINITY, |least, &value| least.min(value.into()));
    let most = values.iter().fold(f64::NEG_INFINITY, |most, &value| most.max(value.into()));
    (least, most - least)
}

/// The lowest 21 bits, two places between each.
fn spread(bits: u64) -> u64 {
    let steps = [
        (32, 0x1f_0000_0000_ffff),
        (16, 0x1f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    steps.into_iter().fold(bits & 0x1f_ffff, |bits, (shift, mask)| (bits | bits << shift) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_by_three() {
        let naive = |bits: u64| (0..21).fold(0, |sum, bit| sum | (bits >> bit & 1) << (3 * bit));
        for bits in [0, 1, 0b101, 0x1f_ffff, 0x15_5555, 0x12_3456] {
            assert_eq!(spread(bits), naive(bits), "{bits:#x}");
        }
    }
}
