//! The contexts of clause 8.5, value by value as the table has them.

use splatstream_format::entropy::layout::{Attribute, PlaneInfo};
use splatstream_format::entropy::model::ContextAxis;
use splatstream_format::entropy::token::Alphabet;

/// The coded values of a block and what contexts need of them.
#[derive(Debug, Clone)]
pub(crate) struct BlockValues {
    pub(crate) planes: Vec<PlaneInfo>,
    pub(crate) deltas: Vec<u64>,
    /// `e[p][i]`; empty for the position plane.
    pub(crate) coded: Vec<Vec<i64>>,
    pub(crate) q: [Vec<i64>; 3],
    pub(crate) o: Vec<i64>,
}

fn bit_length(value: u64) -> i64 {
    (0..=64).find(|&n| u128::from(value) < 1 << n).unwrap()
}

impl BlockValues {
    /// Takes `v`, the values of 8.1, and the biases of the planes.
    pub(crate) fn new(planes: &[PlaneInfo], deltas: &[u64], values: &[Vec<i64>], biases: &[i64]) -> Self {
        let v = |attribute: Attribute, place: u8| {
            let is_it = |plane: &PlaneInfo| plane.attribute == attribute && plane.place == place;
            // Sections without the attribute have no source that asks for it.
            planes.iter().position(is_it).map_or_else(Vec::new, |plane| values[plane].clone())
        };
        let less = |a: &[i64], b: &[i64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
        let largest = v(Attribute::LogScale, 0);
        let middle = less(&largest, &v(Attribute::LogScale, 1));
        let smallest = less(&middle, &v(Attribute::LogScale, 2));
        let unbiased =
            |(values, bias): (&Vec<i64>, &i64)| values.iter().map(|value| value - bias).collect::<Vec<_>>();
        Self {
            planes: planes.to_vec(),
            deltas: deltas.to_vec(),
            coded: values.iter().zip(biases).map(unbiased).collect(),
            q: [largest, middle, smallest],
            o: v(Attribute::Opacity, 0),
        }
    }

    /// What the token and raw bits of a symbol give: `u` of 8.1.
    pub(crate) fn unsigned(&self, plane: usize, i: usize) -> u64 {
        let coded = || self.coded[plane][i];
        match self.planes[plane].alphabet {
            Alphabet::Position => self.deltas[i],
            Alphabet::Index => u64::try_from(coded()).unwrap(),
            Alphabet::Attribute => {
                let e = coded();
                u64::try_from(if e >= 0 { 2 * e } else { -2 * e - 1 }).unwrap()
            }
        }
    }

    /// The value of a source, by its code.
    fn source(&self, code: u8, p: usize, i: usize) -> i64 {
        let before = |n: usize| i.checked_sub(n).and_then(|j| self.coded[p].get(j)).copied().unwrap_or(0);
        let length_before = |n: usize| i.checked_sub(n).map_or(0, |j| bit_length(self.deltas[j]));
        // What a section does not have is 0; a plane there may not use it anyway.
        let known = |plane: &[i64]| plane.get(i).copied().unwrap_or(0);
        let length_of = |i: usize| self.deltas.get(i).map_or(0, |&delta| bit_length(delta));
        let PlaneInfo { attribute, alphabet, .. } = self.planes[p];
        match code {
            1 if alphabet == Alphabet::Position => 2 * length_before(1) + length_before(2),
            1 => before(1) + before(2) + before(3) + before(4),
            2 => before(1).abs() + before(2).abs() + before(3).abs() + before(4).abs(),
            3 => p.checked_sub(1).map_or(0, |p| known(&self.coded[p])),
            4 => {
                let group = (0..p).filter(|&g| self.planes[g].attribute == attribute);
                group.map(|g| self.coded[g][i].abs()).sum()
            }
            5 => known(&self.q[0]),
            6 => known(&self.q[1]),
            7 => known(&self.q[0]) + known(&self.q[1]) + known(&self.q[2]),
            8 => known(&self.q[0]) - known(&self.q[2]),
            9 => known(&self.o),
            10 => length_of(i) + length_of(i + 1),
            _ => 0,
        }
    }

    /// `context(p, i)`.
    pub(crate) fn context(&self, axes: &[ContextAxis; 2], p: usize, i: usize) -> u8 {
        let reached = |axis: &ContextAxis| {
            let value = self.source(axis.source.code(), p, i);
            axis.thresholds.iter().filter(|&&threshold| i64::from(threshold) <= value).count()
        };
        let [a, b] = axes;
        u8::try_from(reached(a) * (b.thresholds.len() + 1) + reached(b)).unwrap()
    }
}
