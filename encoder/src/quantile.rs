//! Values by their place among others.

use core::cmp::Ordering;

/// The value that this many percent of all come before, when all are sorted; 50 is the median, of an even number the upper of the
/// two in the middle. None of nothing. Leaves the values in another order.
pub(crate) fn ranked<T: Copy>(
    values: &mut [T],
    percent: usize,
    order: impl Fn(&T, &T) -> Ordering,
) -> Option<T> {
    let place = values.len().saturating_mul(percent) / 100;
    at(values, place, order)
}

/// The value this many percent of the way from the first to the last, when all are sorted, or the one before: 0 is the least,
/// 100 the largest. None of nothing. Leaves the values in another order.
pub(crate) fn between_ends<T: Copy>(
    values: &mut [T],
    percent: usize,
    order: impl Fn(&T, &T) -> Ordering,
) -> Option<T> {
    let place = values.len().saturating_sub(1).saturating_mul(percent) / 100;
    at(values, place, order)
}

/// The value at a place of the sorted ones. Sorting no more than that takes makes it linear in their number.
fn at<T: Copy>(values: &mut [T], place: usize, order: impl Fn(&T, &T) -> Ordering) -> Option<T> {
    (place < values.len()).then(|| *values.select_nth_unstable_by(place, order).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ranks_are_those_of_sorted_values() {
        let mut values = [3.0_f32, 1.0, 4.0, 2.0];
        let percents = [0, 25, 50, 67, 75, 99];
        let found = percents.map(|percent| ranked(&mut values, percent, f32::total_cmp));
        assert_eq!(found, [1.0, 2.0, 3.0, 3.0, 4.0, 4.0].map(Some));
        let found = percents.map(|percent| between_ends(&mut values, percent, f32::total_cmp));
        assert_eq!(found, [1.0, 1.0, 2.0, 3.0, 3.0, 3.0].map(Some));
        assert_eq!(between_ends(&mut values, 100, f32::total_cmp), Some(4.0));
        assert_eq!(ranked::<f32>(&mut [], 50, f32::total_cmp), None);
        assert_eq!(between_ends::<f32>(&mut [], 50, f32::total_cmp), None);
    }
}
