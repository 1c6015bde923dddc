//! Values by their place among others.

use std::cmp::Ordering;

/// The value that this many percent of all come before, when all are sorted, below 100; 50 is the median, of an even number the upper
/// of the two in the middle. None of nothing. Leaves the values in another order.
pub fn ranked<T: Copy>(values: &mut [T], percent: usize, order: impl Fn(&T, &T) -> Ordering) -> Option<T> {
    let place = values.len() * percent / 100;
    (place < values.len()).then(|| *values.select_nth_unstable_by(place, order).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_those_of_sorted_values() {
        let mut values = [3.0_f32, 1.0, 4.0, 2.0];
        let found = [0, 25, 50, 67, 99].map(|percent| ranked(&mut values, percent, f32::total_cmp));
        assert_eq!(found, [1.0, 2.0, 3.0, 3.0, 4.0].map(Some));
        assert_eq!(ranked::<f32>(&mut [], 50, f32::total_cmp), None);
    }
}
