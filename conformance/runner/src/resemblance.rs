//! What a wrong file resembles: the right one after a common mistake.

use crate::attribute::from_bytes;
use crate::symptom::Symptom;

/// The symptom of a file, if it has one. `expected` are the right values, plane after plane; `uncompensated` those before
/// 7.8.3.
pub(crate) fn of_file(
    expected: &[i32],
    found: &[u8],
    gaussians: usize,
    uncompensated: &[i32],
) -> Option<Symptom> {
    if found.len() != expected.len().saturating_mul(4) {
        return Some(of_other_length(expected, found));
    }
    of_values(expected, &from_bytes(found), gaussians.max(1), uncompensated)
}

fn of_other_length(expected: &[i32], found: &[u8]) -> Symptom {
    let (halves, rest) = found.as_chunks::<2>();
    // A value that does not fit into two bytes can have become anything.
    let is_half = |(half, &value): (&[u8; 2], &i32)| {
        i16::try_from(value).map_or(true, |value| value == i16::from_le_bytes(*half))
    };
    if rest.is_empty() && halves.len() == expected.len() && halves.iter().zip(expected).all(is_half) {
        Symptom::TwoBytes
    } else if !found.len().is_multiple_of(4) {
        Symptom::PartOfValue
    } else {
        Symptom::OtherCount
    }
}

fn of_values(expected: &[i32], found: &[i32], gaussians: usize, uncompensated: &[i32]) -> Option<Symptom> {
    let planes = |values: &[i32]| values.chunks(gaussians).map(<[i32]>::to_vec).collect::<Vec<_>>();
    let is_swapped = |(&a, &b): (&i32, &i32)| a == b.swap_bytes();
    if found == uncompensated {
        return Some(Symptom::Uncompensated);
    }
    if expected.iter().zip(found).all(is_swapped) {
        return Some(Symptom::BigEndian);
    }
    if rows(expected, gaussians).concat() == found {
        return Some(Symptom::Interleaved);
    }
    if sorted(planes(expected)) == sorted(planes(found)) {
        return Some(Symptom::OtherPlanes);
    }
    if sorted(rows(expected, gaussians)) == sorted(rows(found, gaussians)) {
        return Some(Symptom::OtherOrder);
    }
    let errors: Vec<u32> =
        expected.iter().zip(found).map(|(&a, &b)| a.abs_diff(b)).filter(|&error| error > 0).collect();
    if errors.iter().all(|&error| error == 1) {
        return Some(Symptom::OffByOne);
    }
    (errors.len().saturating_mul(10) >= expected.len().saturating_mul(9)).then_some(Symptom::Unrelated)
}

/// The Gaussians of an attribute, each with its values.
fn rows(values: &[i32], gaussians: usize) -> Vec<Vec<i32>> {
    let planes: Vec<&[i32]> = values.chunks(gaussians).collect();
    let row = |gaussian: usize| planes.iter().filter_map(|plane| plane.get(gaussian).copied()).collect();
    (0..gaussians).map(row).collect()
}

fn sorted(mut lists: Vec<Vec<i32>>) -> Vec<Vec<i32>> {
    lists.sort_unstable();
    lists
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attribute::to_bytes;

    /// Three planes of two Gaussians.
    const RIGHT: [i32; 6] = [1, 2, 30, 400, 5, -6];

    fn seen(values: &[i32]) -> Option<Symptom> {
        of_file(&RIGHT, &to_bytes(values), 2, &[0; 6])
    }

    #[test]
    fn mistakes_in_the_order_of_values_are_recognised() {
        assert_eq!(seen(&[1, 30, 5, 2, 400, -6]), Some(Symptom::Interleaved));
        assert_eq!(seen(&[5, -6, 30, 400, 1, 2]), Some(Symptom::OtherPlanes));
        assert_eq!(seen(&[2, 1, 400, 30, -6, 5]), Some(Symptom::OtherOrder));
    }

    #[test]
    fn mistakes_in_the_bytes_of_values_are_recognised() {
        assert_eq!(seen(&RIGHT.map(i32::swap_bytes)), Some(Symptom::BigEndian));
        let halves: Vec<u8> = RIGHT.iter().flat_map(|&value| (value as i16).to_le_bytes()).collect();
        assert_eq!(of_file(&RIGHT, &halves, 2, &[]), Some(Symptom::TwoBytes));
        let longer = [to_bytes(&RIGHT), vec![0]].concat();
        assert_eq!(of_file(&RIGHT, &longer, 2, &[]), Some(Symptom::PartOfValue));
        assert_eq!(of_file(&RIGHT, &to_bytes(&RIGHT[..3]), 2, &[]), Some(Symptom::OtherCount));
    }

    #[test]
    fn mistakes_in_values_are_recognised() {
        assert_eq!(seen(&[0; 6]), Some(Symptom::Uncompensated));
        assert_eq!(seen(&[1, 2, 31, 400, 5, -7]), Some(Symptom::OffByOne));
        assert_eq!(seen(&[9, 9, 9, 9, 9, 9]), Some(Symptom::Unrelated));
        assert_eq!(seen(&[1, 2, 30, 400, 5, 7]), None);
    }
}
