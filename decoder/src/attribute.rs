//! Clauses 7.4 to 7.6: coded values to log-scales, opacity and rotation.

use splatstream_format::{Error, ErrorKind, Result};

/// Adds the bias of a plane to its coded values.
///
/// # Errors
/// Invalid if a value leaves -limit..=limit; `at` and `element` go into the error.
pub fn unbias(coded: &[i32], bias: i32, limit: i32, element: &'static str, at: u64) -> Result<Vec<i32>> {
    let values: Vec<i32> = coded.iter().map(|&value| value.wrapping_add(bias)).collect();
    in_range(&values, limit, element, at)?;
    Ok(values)
}

/// Refuses values outside -limit..=limit.
///
/// # Errors
/// Invalid, naming the first such value.
pub fn in_range(values: &[i32], limit: i32, element: &'static str, at: u64) -> Result<()> {
    let low = limit.wrapping_neg();
    let outside = values.iter().fold(false, |any, &value| any | (value < low) | (value > limit));
    if outside {
        let value = values.iter().find(|&&value| value < low || value > limit).copied().unwrap_or(0);
        return Err(Error::new(
            at,
            "7.4",
            ErrorKind::OutOfRange {
                element,
                value: i64::from(value),
                min: i64::from(low),
                max: i64::from(limit),
            },
        ));
    }
    Ok(())
}

/// The largest magnitude of a log-scale, opacity or rotation integer.
pub const ATTRIBUTE_LIMIT: i32 = 32_767;

/// Clause 7.4. The next smaller log-scale: the one before less the difference.
///
/// # Errors
/// Invalid if a difference is negative while the axes are canonical, or a log-scale out of range.
pub fn smaller(larger: &[i32], differences: &[i32], canonical: bool, at: u64) -> Result<Vec<i32>> {
    if canonical && differences.iter().any(|&difference| difference < 0) {
        let rule = "canonical axes are sorted from largest to smallest";
        return Err(Error::new(at, "7.4", ErrorKind::Constraint { rule }));
    }
    let values: Vec<i32> =
        larger.iter().zip(differences).map(|(&larger, &difference)| larger.wrapping_sub(difference)).collect();
    in_range(&values, ATTRIBUTE_LIMIT, "log_scale", at)?;
    Ok(values)
}

/// Clause 7.6. How many bits coarser the rotation of a nearly round Gaussian is coded.
#[inline]
pub fn rotation_shift(anisotropy: i32, thresholds: [u8; 3]) -> u32 {
    thresholds.iter().map(|&threshold| u32::from(anisotropy < i32::from(threshold))).fold(0, u32::wrapping_add)
}

/// Clause 7.6. Rotation integers on the fine lattice.
///
/// # Errors
/// Invalid if a value leaves the range.
pub fn rotations(
    values: &[i32],
    largest: &[i32],
    smallest: &[i32],
    thresholds: [u8; 3],
    at: u64,
) -> Result<Vec<i32>> {
    if thresholds == [0; 3] {
        return Ok(values.to_vec());
    }
    let shifted: Vec<i32> = values
        .iter()
        .zip(largest.iter().zip(smallest))
        .map(|(&value, (&largest, &smallest))| {
            value.wrapping_shl(rotation_shift(largest.wrapping_sub(smallest), thresholds))
        })
        .collect();
    in_range(&shifted, ATTRIBUTE_LIMIT, "rotation", at)?;
    Ok(shifted)
}
