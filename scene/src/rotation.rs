//! Rotations: unit quaternions, and the "smallest three" way of storing them.

/// A norm² this close to 1 counts as unit. Rounding four components to `f32` moves it by less than 3e-7, so
/// that reading what was written changes no bit.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Scales every quaternion `w x y z` of the four planes to unit length; one that is already, or that has no direction,
/// is not touched.
pub(crate) fn normalise_rows(rotation: &mut [Vec<f32>; 4]) {
    let [w, x, y, z] = rotation;
    for (((w, x), y), z) in w.iter_mut().zip(x).zip(y).zip(z) {
        if let Some(unit) = normalised([*w, *x, *y, *z]) {
            [*w, *x, *y, *z] = unit;
        }
    }
}

/// `quaternion` at unit length, or nothing where its norm is zero. Infinite or NaN components pass through:
/// validation names them.
pub(crate) fn normalised(quaternion: [f32; 4]) -> Option<[f32; 4]> {
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

/// Puts back the largest component, which is not stored because the norm is 1 and its sign is made positive.
/// `largest` 0 to 3 is its place; `smallest` are the others in their order.
///
/// Components too large for a unit quaternion leave 0 for the largest; the caller normalises.
pub(crate) fn from_smallest_three(largest: usize, smallest: [f64; 3]) -> [f32; 4] {
    let sum: f64 = smallest.iter().map(|part| part * part).sum();
    let rebuilt = (1.0 - sum).max(0.0).sqrt();
    let [a, b, c] = smallest;
    let parts = match largest {
        0 => [rebuilt, a, b, c],
        1 => [a, rebuilt, b, c],
        2 => [a, b, rebuilt, c],
        _ => [a, b, c, rebuilt],
    };
    parts.map(|part| part as f32)
}

/// The place of the component largest in magnitude (the first of equals), and the others in their order with
/// the sign that makes the largest positive.
pub(crate) fn to_smallest_three(quaternion: [f32; 4]) -> (usize, [f64; 3]) {
    let mut largest = 0;
    for place in 1..4 {
        if quaternion[place].abs() > quaternion[largest].abs() {
            largest = place;
        }
    }
    let sign = if quaternion[largest] < 0.0 { -1.0 } else { 1.0 };
    let others = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][largest];
    (largest, others.map(|place| f64::from(quaternion[place]) * sign))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_component_is_put_back_in_its_place() {
        let q = [0.1_f32, -0.7, 0.5, 0.5];
        let (largest, smallest) = to_smallest_three(q);
        assert_eq!(largest, 1);
        let back = from_smallest_three(largest, smallest);
        for (a, b) in q.iter().zip(back) {
            assert!((a + b).abs() < 1e-6, "{q:?} comes back negated: {back:?}");
        }
    }

    #[test]
    fn a_quaternion_is_scaled_once_and_then_left_alone() {
        let once = normalised([1.0, 2.0, -3.0, 4.0]).unwrap();
        assert_eq!(normalised(once), Some(once));
        assert_eq!(normalised([0.0; 4]), None);
    }
}
