//! The "smallest three" way of storing a unit quaternion: the largest component follows from the others.

/// Puts back the largest component, which is not stored because the norm is 1 and its sign is made positive.
/// `largest` 0 to 3 is its index; `smallest` are the others in their order.
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

/// The index of the component largest in magnitude (the first of equals), and the others in their order with
/// the sign that makes the largest positive.
pub(crate) fn to_smallest_three(quaternion: [f32; 4]) -> (usize, [f64; 3]) {
    let mut largest = (0, 0.0_f32);
    for (index, part) in quaternion.into_iter().enumerate() {
        if part.abs() > largest.1.abs() {
            largest = (index, part);
        }
    }
    let (index, part) = largest;
    let sign = if part < 0.0 { -1.0 } else { 1.0 };
    let [a, b, c, d] = quaternion.map(|part| f64::from(part) * sign);
    let others = match index {
        0 => [b, c, d],
        1 => [a, c, d],
        2 => [a, b, d],
        _ => [a, b, c],
    };
    (index, others)
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
}
