//! A palette of rows of values, and for each row of a scene the entry that is nearest to it, or nearly.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Rounds of moving entries to the mean of the rows that choose them.
const ROUNDS: usize = 4;

/// Entries that a row is compared with, at most, in a search.
const COMPARED: usize = 48;

/// Rows of values, one after another.
pub(super) struct Rows {
    pub(super) values: Vec<f32>,
    /// Values of a row.
    pub(super) width: usize,
}

impl Rows {
    fn get(&self, row: u32) -> &[f32] {
        let first = (row as usize).saturating_mul(self.width);
        self.values.get(first..).and_then(|rest| rest.get(..self.width)).unwrap_or_default()
    }

    /// How many rows.
    pub(super) fn len(&self) -> usize {
        self.values.len().checked_div(self.width).unwrap_or(0)
    }
}

/// A palette of so many entries at most, and the entry of each row.
///
/// The rows are divided in two again and again, always where they differ most in all, along the value that differs most. The
/// means of the parts are the first palette, which Lloyd's method then improves. The divisions are a tree in which the
/// entries near a row are found by looking into its nearest parts first.
pub(super) fn palette(rows: &Rows, most: usize) -> (Rows, Vec<u32>) {
    let mut tree = Tree::of(rows, most);
    let mut labels = Vec::new();
    for round in 0..=ROUNDS {
        labels = tree.labels(rows);
        if round < ROUNDS {
            tree.move_entries(rows, &labels);
        }
    }
    (tree.entries, labels)
}

/// Rows that may be divided.
struct Part {
    /// The sum of the squares of the differences from the mean: the largest is divided first.
    squares: f64,
    node: usize,
    rows: Vec<u32>,
    /// The value that differs most, and its mean.
    axis: usize,
    middle: f64,
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Part {}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.squares.total_cmp(&other.squares).then(other.node.cmp(&self.node))
    }
}

impl Part {
    fn of(rows: &Rows, members: Vec<u32>, node: usize) -> (Self, Vec<f32>) {
        let count = members.len().max(1) as f64;
        let (mut sums, mut squares) = (vec![0.0_f64; rows.width], vec![0.0_f64; rows.width]);
        for &row in &members {
            for ((sum, square), &value) in sums.iter_mut().zip(&mut squares).zip(rows.get(row)) {
                let value = f64::from(value);
                *sum += value;
                *square += value * value;
            }
        }
        let means: Vec<f64> = sums.iter().map(|sum| sum / count).collect();
        let spreads: Vec<f64> = squares
            .iter()
            .zip(&means)
            .map(|(square, mean)| (square - mean * mean * count).max(0.0))
            .collect();
        let axis = (0..rows.width)
            .max_by(|&a, &b| spread(&spreads, a).total_cmp(&spread(&spreads, b)).then(b.cmp(&a)));
        let axis = axis.unwrap_or(0);
        let middle = spread(&means, axis);
        let entry = means.into_iter().map(|mean| mean as f32).collect();
        (Self { squares: spreads.iter().sum(), node, rows: members, axis, middle }, entry)
    }
}

fn spread(values: &[f64], at: usize) -> f64 {
    values.get(at).copied().unwrap_or(0.0)
}

/// A division of rows, or an entry of the palette.
#[derive(Clone, Copy)]
enum Node {
    Division { axis: usize, middle: f64, below: usize, above: usize },
    Entry(u32),
}

struct Tree {
    nodes: Vec<Node>,
    entries: Rows,
}

impl Tree {
    fn of(rows: &Rows, most: usize) -> Self {
        let (first, entry) = Part::of(rows, (0..rows.len() as u32).collect(), 0);
        let mut tree =
            Self { nodes: vec![Node::Entry(0)], entries: Rows { values: entry, width: rows.width } };
        let mut parts = BinaryHeap::from([first]);
        while tree.entries.len() < most
            && let Some(part) = parts.pop()
        {
            let is_below = |&&row: &&u32| {
                rows.get(row).get(part.axis).is_some_and(|&value| f64::from(value) < part.middle)
            };
            let (below, above): (Vec<u32>, Vec<u32>) = part.rows.iter().partition(is_below);
            // Rows that are alike are not divided, nor are those that differ by less than rounding.
            if below.is_empty() || above.is_empty() {
                continue;
            }
            parts.extend(tree.divide(rows, &part, below, above));
        }
        tree
    }

    /// Puts two entries in place of one.
    fn divide(&mut self, rows: &Rows, part: &Part, below: Vec<u32>, above: Vec<u32>) -> [Part; 2] {
        let first = self.nodes.len();
        let old = match self.nodes.get(part.node) {
            Some(&Node::Entry(entry)) => entry,
            _ => 0,
        };
        let new = self.entries.len() as u32;
        let node = Node::Division {
            axis: part.axis,
            middle: part.middle,
            below: first,
            above: first.saturating_add(1),
        };
        self.nodes.get_mut(part.node).into_iter().for_each(|place| *place = node);
        self.nodes.extend([Node::Entry(old), Node::Entry(new)]);
        let (below, entry) = Part::of(rows, below, first);
        self.set(old, &entry);
        let (above, entry) = Part::of(rows, above, first.saturating_add(1));
        self.entries.values.extend(entry);
        [below, above]
    }

    fn set(&mut self, entry: u32, values: &[f32]) {
        let first = (entry as usize).saturating_mul(self.entries.width);
        let places = self.entries.values.iter_mut().skip(first).take(self.entries.width);
        places.zip(values).for_each(|(place, &value)| *place = value);
    }

    /// The entry of each row.
    fn labels(&self, rows: &Rows) -> Vec<u32> {
        let mut waiting = BinaryHeap::new();
        (0..rows.len() as u32).map(|row| self.nearest(rows.get(row), &mut waiting)).collect()
    }

    /// The nearest entry among those of the nearest parts; `waiting` is scratch.
    fn nearest(&self, row: &[f32], waiting: &mut BinaryHeap<Near>) -> u32 {
        let mut best = (f32::INFINITY, 0);
        let mut left = COMPARED;
        waiting.clear();
        waiting.push(Near { distance: 0.0, node: 0 });
        while let Some(Near { distance, node: mut at }) = waiting.pop() {
            if left == 0 || distance >= best.0 {
                break;
            }
            while let Some(&Node::Division { axis, middle, below, above }) = self.nodes.get(at) {
                let beyond = row.get(axis).copied().unwrap_or(0.0) - middle as f32;
                let (near, far) = if beyond < 0.0 { (below, above) } else { (above, below) };
                waiting.push(Near { distance: distance + beyond * beyond, node: far });
                at = near;
            }
            if let Some(&Node::Entry(entry)) = self.nodes.get(at) {
                let apart: f32 =
                    row.iter().zip(self.entries.get(entry)).map(|(a, b)| (a - b) * (a - b)).sum();
                if apart < best.0 || (apart == best.0 && entry < best.1) {
                    best = (apart, entry);
                }
            }
            left = left.saturating_sub(1);
        }
        best.1
    }

    /// Moves each entry to the mean of the rows that have chosen it.
    fn move_entries(&mut self, rows: &Rows, labels: &[u32]) {
        let mut sums = vec![0.0_f64; self.entries.values.len()];
        let mut counts = vec![0_u32; self.entries.len()];
        for (row, &label) in (0..).zip(labels) {
            let first = (label as usize).saturating_mul(rows.width);
            let places = sums.get_mut(first..).unwrap_or_default();
            places.iter_mut().zip(rows.get(row)).for_each(|(sum, &value)| *sum += f64::from(value));
            counts.get_mut(label as usize).into_iter().for_each(|count| *count = count.saturating_add(1));
        }
        let width = rows.width.max(1);
        let entries = self.entries.values.chunks_exact_mut(width).zip(sums.chunks_exact(width));
        for ((entry, sums), count) in entries.zip(counts).filter(|&(_, count)| count > 0) {
            entry.iter_mut().zip(sums).for_each(|(value, sum)| *value = (sum / f64::from(count)) as f32);
        }
    }
}

/// A part of the tree that has not been looked into, and the square of how far away it is, or less.
struct Near {
    distance: f32,
    node: usize,
}

impl PartialEq for Near {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Near {}

impl PartialOrd for Near {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Near {
    /// The nearest is the greatest, which a heap gives first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.node.cmp(&self.node))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_gaussians::random::SplitMix64;

    fn random_rows(count: usize, width: usize) -> Rows {
        let mut random = SplitMix64::new(7);
        let values = (0..count.saturating_mul(width))
            .map(|_| (random.bits() >> 40) as f32 / (1 << 24) as f32)
            .collect();
        Rows { values, width }
    }

    fn squares(rows: &Rows, (palette, labels): &(Rows, Vec<u32>)) -> f64 {
        let pairs = (0..).zip(labels).flat_map(|(row, &label)| rows.get(row).iter().zip(palette.get(label)));
        pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum()
    }

    #[test]
    fn rows_of_few_kinds_are_kept() {
        let values = [[1.0, 2.0], [3.0, -1.0], [1.0, 2.0], [0.0, 0.0]].concat();
        let rows = Rows { values, width: 2 };
        let found = palette(&rows, 8);
        assert_eq!(found.0.len(), 3);
        assert_eq!(squares(&rows, &found), 0.0);
    }

    #[test]
    fn more_entries_are_nearer() {
        let rows = random_rows(3000, 9);
        let [few, many] = [16, 256].map(|most| squares(&rows, &palette(&rows, most)));
        let none = squares(&rows, &palette(&rows, 1));
        assert!(few < 0.85 * none && many < 0.8 * few, "{none} {few} {many}");
    }

    #[test]
    fn the_entry_of_a_row_is_mostly_the_nearest() {
        let rows = random_rows(2000, 9);
        let (entries, labels) = palette(&rows, 128);
        let apart = |row: u32, entry: u32| -> f32 {
            rows.get(row).iter().zip(entries.get(entry)).map(|(a, b)| (a - b).powi(2)).sum()
        };
        let nearest = (0..)
            .zip(&labels)
            .filter(|&(row, &label)| (0..128).all(|other| apart(row, other) >= apart(row, label)));
        assert!(nearest.count() > 1800);
    }
}
