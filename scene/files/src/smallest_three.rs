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
}
