//! The order of frames, by their names.

use std::cmp::Ordering;

/// Orders names as people count: frame_9 before frame_10. The order is total: only equal names are equal.
pub fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    loop {
        let (text_a, number_a, rest_a) = split_number(left);
        let (text_b, number_b, rest_b) = split_number(right);
        let order = text_a
            .cmp(text_b)
            .then_with(|| number_a.len().cmp(&number_b.len()))
            .then_with(|| number_a.cmp(number_b));
        if order != Ordering::Equal {
            return order;
        }
        if rest_a.is_empty() || rest_b.is_empty() {
            // Names that differ only in leading zeros still have one order.
            return rest_a.len().cmp(&rest_b.len()).then_with(|| a.cmp(b));
        }
        (left, right) = (rest_a, rest_b);
    }
}

/// A name up to its first number, that number without leading zeros, and the rest.
fn split_number(name: &str) -> (&str, &str, &str) {
    let start = name.find(|c: char| c.is_ascii_digit()).unwrap_or(name.len());
    let (text, rest) = name.split_at(start);
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    let (number, rest) = rest.split_at(end);
    (text, number.trim_start_matches('0'), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_in_the_order_that_people_count_in() {
        let mut names = ["f10.ply", "f9.ply", "f010.ply", "f1b2.ply", "f1b10.ply", "a.ply"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["a.ply", "f1b2.ply", "f1b10.ply", "f9.ply", "f010.ply", "f10.ply"]);
    }

    #[test]
    fn the_order_of_names_is_total() {
        let names = ["", "1", "01", "1a", "a1", "a", "a1b", "a01b", "a2"];
        for a in names {
            for b in names {
                assert_eq!(natural_order(a, b), natural_order(b, a).reverse(), "{a} {b}");
                assert_eq!(natural_order(a, b) == Ordering::Equal, a == b, "{a} {b}");
            }
        }
    }
}
