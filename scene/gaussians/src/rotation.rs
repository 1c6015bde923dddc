//! Rotations as unit quaternions.

/// A norm² this close to 1 counts as unit. Rounding four components to `f32` moves it by less than 3e-7, so
/// that reading what was written changes no bit.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Scales every quaternion `w x y z` of the four planes to unit length; one that is already, or that has no direction,
/// is not touched.
pub fn normalise_rows(rotation: &mut [Vec<f32>; 4]) {
    let [w, x, y, z] = rotation;
    for (((w, x), y), z) in w.iter_mut().zip(x).zip(y).zip(z) {
        if let Some(unit) = normalised([*w, *x, *y, *z]) {
            [*w, *x, *y, *z] = unit;
        }
    }
}

/// `quaternion` at unit length, or nothing where its norm is zero. Infinite or NaN components pass through:
/// validation names them.
pub fn normalised(quaternion: [f32; 4]) -> Option<[f32; 4]> {
    let norm2: f64 = quaternion.iter().map(|&part| f64::from(part) * f64::from(part)).sum();
    if norm2 == 0.0 {
        return None;
    }
    if !norm2.is_finite() || (norm2 - 1.0).abs() <= UNIT_TOLERANCE {
        return Some(quaternion);
    }
    let norm = norm2.sqrt();
    Some(quaternion.map(|part| (f64::from(part) / norm) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quaternion_is_scaled_once_and_then_left_alone() {
        let once = normalised([1.0, 2.0, -3.0, 4.0]).unwrap();
        assert_eq!(normalised(once), Some(once));
        assert_eq!(normalised([0.0; 4]), None);
    }
}
