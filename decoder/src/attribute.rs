//! Clauses 7.6.2 and 7.6.3: coded values to log-scales, opacity and rotation.

use core::ops::RangeInclusive;
use splatstream_format::{Error, ErrorKind, Result};

/// The values of log-scales, opacity and rotation before its shift.
pub const ATTRIBUTE_RANGE: RangeInclusive<i32> = -32_768..=32_767;
/// The values of rotation after its shift.
pub const ROTATION_RANGE: RangeInclusive<i32> = -32_767..=32_767;

/// Values times 2^shift. Coded values are below 2^17 and a shift is at most 7.
pub fn shifted(values: &[i32], shift: u8) -> Vec<i32> {
    values.iter().map(|value| value.wrapping_shl(shift.into())).collect()
}

/// Adds the bias of a plane to its coded values.
pub fn unbias(coded: &[i32], bias: i32) -> Vec<i32> {
    unbias_shifted(coded, bias, 0)
}

/// Adds the bias of a plane to its coded values, and multiplies by 2^shift.
pub fn unbias_shifted(coded: &[i32], bias: i32, shift: u8) -> Vec<i32> {
    coded.iter().map(|&value| value.wrapping_add(bias).wrapping_shl(shift.into())).collect()
}

/// Refuses values outside a range; `at`, `clause` and `element` go into the error.
///
/// # Errors
/// Invalid, naming the first such value.
pub fn in_range(
    values: &[i32],
    range: &RangeInclusive<i32>,
    element: &'static str,
    clause: &'static str,
    at: u64,
) -> Result<()> {
    let (low, high) = (*range.start(), *range.end());
    let outside = values.iter().fold(false, |any, &value| any | (value < low) | (value > high));
    if outside {
        let value = values.iter().find(|&value| !range.contains(value)).copied().unwrap_or(0);
        let (value, min, max) = (i64::from(value), i64::from(low), i64::from(high));
        return Err(Error::new(at, clause, ErrorKind::OutOfRange { element, value, min, max }));
    }
    Ok(())
}

/// Clause 7.6.2. The next log-scale: the one before less the difference.
pub fn next_log_scale(before: &[i32], differences: &[i32]) -> Vec<i32> {
    before.iter().zip(differences).map(|(&before, &difference)| before.wrapping_sub(difference)).collect()
}

/// Clause 7.6.2. Checks one plane of log-scales and the values it came from.
///
/// # Errors
/// Invalid if one is out of range, or a difference of canonical axes is negative.
pub fn check_log_scale(values: &[i32], log_scale: &[i32], canonical_difference: bool, at: u64) -> Result<()> {
    in_range(values, &ATTRIBUTE_RANGE, "log_scale", "7.6.2", at)?;
    in_range(log_scale, &ATTRIBUTE_RANGE, "log_scale", "7.6.2", at)?;
    if canonical_difference && values.iter().any(|&difference| difference < 0) {
        let rule = "canonical axes are sorted from largest to smallest";
        return Err(Error::new(at, "7.6.2", ErrorKind::Constraint { rule }));
    }
    Ok(())
}

/// Clause 7.6.3. How many bits coarser the rotation of a nearly round Gaussian is coded.
#[inline]
pub fn rotation_shift(anisotropy: i32, thresholds: [u8; 3]) -> u32 {
    let counts = |&threshold: &u8| u32::from(threshold > 0 && anisotropy < i32::from(threshold));
    thresholds.iter().map(counts).fold(0, u32::wrapping_add)
}

/// Clause 7.6.3. Rotation integers, shifted by what 7.6.3 and the unit leave out.
///
/// # Errors
/// Invalid if a value leaves the range.
pub fn rotations(
    values: &[i32],
    largest: &[i32],
    smallest: &[i32],
    thresholds: [u8; 3],
    shift: u8,
    at: u64,
) -> Result<Vec<i32>> {
    in_range(values, &ATTRIBUTE_RANGE, "rotation", "7.6.3", at)?;
    let shifted: Vec<i32> = values
        .iter()
        .zip(largest.iter().zip(smallest))
        .map(|(&value, (&largest, &smallest))| {
            let coarser = rotation_shift(largest.wrapping_sub(smallest), thresholds);
            value.wrapping_shl(coarser.wrapping_add(shift.into()))
        })
        .collect();
    in_range(&shifted, &ROTATION_RANGE, "rotation", "7.6.3", at)?;
    Ok(shifted)
}
