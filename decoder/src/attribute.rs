//! Clauses 7.6.2 and 7.6.3: coded values to log-scales, opacity and rotation.

use crate::steps::Exponents;
use core::ops::RangeInclusive;
use splatstream_format::{Error, ErrorKind, Result};

/// The values of log-scales and opacity, and of rotation before its step.
pub const ATTRIBUTE_RANGE: RangeInclusive<i32> = -32_768..=32_767;
/// The values of rotation after its step.
pub(crate) const ROTATION_RANGE: RangeInclusive<i32> = -32_767..=32_767;

/// Adds the bias of a plane to its coded values. No sum wraps (annex F.2: `v`).
pub(crate) fn unbias(values: &mut [i32], bias: i32) {
    values.iter_mut().for_each(|value| *value = value.wrapping_add(bias));
}

/// Refuses values outside a range; `at`, `clause` and `element` go into the error.
///
/// # Errors
/// Invalid, naming the first such value.
pub(crate) fn in_range(
    values: &[i32],
    range: &RangeInclusive<i32>,
    element: &'static str,
    clause: &'static str,
    at: u64,
) -> Result<()> {
    let (low, high) = (*range.start(), *range.end());
    // All values at once take less time than a search, which is for the error alone.
    let outside = values.iter().fold(false, |any, &value| any | (value < low) | (value > high));
    let found = if outside { values.iter().find(|&value| !range.contains(value)) } else { None };
    let Some(&value) = found else { return Ok(()) };
    let (value, min, max) = (i64::from(value), i64::from(low), i64::from(high));
    Err(Error::new(at, clause, ErrorKind::OutOfRange { element, value, min, max }))
}

/// Clause 7.6.2. The next log-scale in place of the difference to the one before. None wraps (annex F.2: `cq`).
pub(crate) fn next_log_scale(before: &[i32], differences: &mut [i32]) {
    for (&before, difference) in before.iter().zip(differences) {
        *difference = before.wrapping_sub(*difference);
    }
}

/// Clause 7.6.2. Checks the log-scales of Gaussians that are not predicted: each, and the difference to the one before.
///
/// # Errors
/// Invalid if one is out of range, or a difference of canonical axes is negative.
pub(crate) fn check_log_scales(log_scale: [&[i32]; 3], canonical_axes: bool, at: u64) -> Result<()> {
    for plane in log_scale {
        in_range(plane, &ATTRIBUTE_RANGE, "log_scale", "7.6.2", at)?;
    }
    let [largest, middle, smallest] = log_scale;
    let (mut least, mut greatest) = (0, 0);
    for ((&a, &b), &c) in largest.iter().zip(middle).zip(smallest) {
        // All are in range, so that differences fit.
        let [first, second] = [a.wrapping_sub(b), b.wrapping_sub(c)];
        least = first.min(second).min(least);
        greatest = first.max(second).max(greatest);
    }
    in_range(&[least, greatest], &ATTRIBUTE_RANGE, "log_scale", "7.6.2", at)?;
    if canonical_axes && least < 0 {
        return Err(unsorted(at));
    }
    Ok(())
}

/// The error of canonical axes whose log-scales increase.
pub(crate) fn unsorted(at: u64) -> Error {
    let rule = "canonical axes are sorted from largest to smallest";
    Error::new(at, "7.6.2", ErrorKind::Constraint { rule })
}

/// Clause 7.6.3. The rotations of Gaussians that are not predicted, in place of their coded values: with their bias, times
/// their steps.
///
/// # Errors
/// Invalid if a value leaves the range.
pub(crate) fn rotations(values: &mut [i32], bias: i32, exponents: &Exponents, at: u64) -> Result<()> {
    unbias(values, bias);
    in_range(values, &ATTRIBUTE_RANGE, "rotation", "7.6.3", at)?;
    if *exponents != Exponents::Same(0) {
        exponents.scale(values, 0);
    }
    in_range(values, &ROTATION_RANGE, "rotation", "7.6.3", at)
}
