//! The neighbours of new Gaussians, gathered: each with all its attributes side by side.
//!
//! Indices are those of rows, below the number of neighbours, so that their products with a width fit; each is in the set that the
//! neighbours were found in.

use super::at;
use crate::cores;
use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use crate::neighbours::Neighbour;
use crate::stage::Stage;
use core::ops::Range;

/// Columns of a row before those of sh.
const BEFORE_SH: usize = 10;

/// Rows that are gathered together: a plane is read for all of them before the next.
const RUN: usize = 256;
/// Neighbours between two looks at the interrupt: they lie anywhere in memory.
const PART: usize = 1 << 16;

/// The Gaussians of a set that are neighbours, in the order of the set.
#[derive(Debug)]
pub(super) struct Rows {
    width: usize,
    values: Vec<i32>,
    /// The row of each neighbour.
    indices: Vec<u32>,
}

impl Rows {
    /// Gathers the neighbours out of a set; where an interrupt is requested, the rows mean nothing.
    pub(super) fn new_unless(interrupt: &Interrupt, set: &QuantizedFrame, neighbours: &[Neighbour]) -> Self {
        let mut used = vec![false; set.len()];
        let parts = || neighbours.chunks(PART).take_while(|_| !interrupt.is_requested());
        for neighbour in parts().flatten() {
            if let Some(used) = used.get_mut(neighbour.index as usize) {
                *used = true;
            }
        }
        let used_indices: Vec<u32> =
            (0..).zip(&used).filter(|(_, used)| **used).map(|(index, _)| index).collect();
        let mut row_of = vec![0; set.len()];
        for (row, &index) in (0..).zip(&used_indices) {
            if let Some(slot) = row_of.get_mut(index as usize) {
                *slot = row;
            }
        }
        let width = BEFORE_SH.wrapping_add(set.sh.len());
        if interrupt.is_requested() {
            return Self { width, values: Vec::new(), indices: Vec::new() };
        }
        let mut indices = Vec::with_capacity(neighbours.len());
        for part in parts() {
            indices.extend(part.iter().map(|neighbour| at(&row_of, neighbour.index)));
        }
        let count = used_indices.len().wrapping_mul(width);
        let mut values = vec![0; count];
        let runs = values.chunks_mut(width.wrapping_mul(RUN)).zip(used_indices.chunks(RUN));
        cores::for_each(interrupt, count, runs, |(values, indices)| {
            for (column, plane) in set.signed_planes().enumerate() {
                let slots = values.iter_mut().skip(column).step_by(width);
                slots.zip(indices).for_each(|(slot, &index)| *slot = at(plane, index));
            }
        });
        Self { width, values, indices }
    }

    /// The attributes of all neighbours in `range`.
    pub(super) fn of(&self, range: Range<usize>) -> impl Iterator<Item = &[i32]> + Clone {
        self.indices.get(range).unwrap_or_default().iter().map(|&index| self.row(index))
    }

    /// The number of the row of each neighbour in `range`.
    pub(super) fn indices(&self, range: Range<usize>) -> &[u32] {
        self.indices.get(range).unwrap_or_default()
    }

    /// Rows.
    pub(super) fn len(&self) -> usize {
        self.values.len().checked_div(self.width).unwrap_or(0)
    }

    /// A row.
    pub(super) fn row(&self, index: u32) -> &[i32] {
        let start = (index as usize).wrapping_mul(self.width);
        self.values.get(start..start.wrapping_add(self.width)).unwrap_or_default()
    }

    /// The columns of an attribute.
    pub(super) fn columns(&self, stage: Stage) -> Range<usize> {
        match stage {
            Stage::LogScale => 0..3,
            Stage::Opacity => 3..4,
            Stage::Rotation => 4..7,
            Stage::Dc => 7..BEFORE_SH,
            Stage::Sh => BEFORE_SH..self.width,
        }
    }
}
