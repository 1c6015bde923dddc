//! Clause 7.5: cells that move, and the Gaussians that move with them.
//!
//! A fine position is in 64ths of a grid step, a fine rotation in 64ths of rotation_step.
//!
//! Sums stay below 2^31 (annex F.4). Runs are parts of planes of one length, which follows from the lists they are of.

use crate::cores;
use crate::interrupt::Interrupt;
use crate::motion::{Bounds, Motion, Planes};
use crate::position::morton;

pub use crate::cell::{Cell, isqrt, rotation_unit};

/// Gaussians displaced by one task.
const RUN: usize = 4096;

/// The cells of a frame that move; a Gaussian in no listed cell stays. Clause 7.5.
#[derive(Debug, Clone, Default)]
pub struct CellField {
    cell_log2: u8,
    position_bits: u8,
    unit: i64,
    /// Morton codes of the cells, increasing; the cells in the same order.
    codes: Vec<u64>,
    cells: Vec<Cell>,
    motions: Vec<Motion>,
}

impl CellField {
    /// A field of cells, each with the Morton code of its coordinates, codes strictly increasing.
    ///
    /// `cell_log2` is 0 to position_bits, `position_bits` at most 20, `unit` that of
    /// [`rotation_unit`].
    pub fn new(cell_log2: u8, position_bits: u8, unit: i64, cells: Vec<(u64, Cell)>) -> Self {
        let (codes, cells): (Vec<u64>, Vec<Cell>) = cells.into_iter().unzip();
        let motions = cells.iter().map(|cell| Motion::of(cell, cell_log2)).collect();
        Self { cell_log2, position_bits, unit, codes, cells, motions }
    }

    /// True if nothing moves.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Cells that are listed.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// The listed cell in which a fine position lies.
    pub fn find(&self, position_fine: [i32; 3]) -> Option<&Cell> {
        self.at(self.coordinates(position_fine))
    }

    /// Fine position and fine rotation of a Gaussian after the motion of a cell.
    pub fn displace(
        &self,
        cell: &Cell,
        position_fine: [i32; 3],
        rotation_fine: [i32; 3],
    ) -> ([i32; 3], [i32; 3]) {
        let (motion, bounds) = (Motion::of(cell, self.cell_log2), self.bounds());
        (motion.position(position_fine, bounds), motion.rotation(rotation_fine, bounds))
    }

    /// Displaces every Gaussian by its cell and returns for each whether that cell is stale.
    ///
    /// The planes hold fine positions and fine rotations and have the same length.
    pub fn displace_planes(&self, position: &mut [Vec<i32>; 3], rotation: &mut [Vec<i32>; 3]) -> Vec<bool> {
        self.displace_unless(Interrupt::NEVER, position, rotation)
    }

    /// The same; where an interrupt is requested, the planes mean nothing.
    pub(crate) fn displace_unless(
        &self,
        interrupt: &Interrupt,
        position: &mut [Vec<i32>; 3],
        rotation: &mut [Vec<i32>; 3],
    ) -> Vec<bool> {
        let [x, y, z] = position;
        let mut stale = vec![false; x.len()];
        let values = x.len().saturating_mul(6);
        let [x, y, z] = [x, y, z].map(|plane| plane.chunks_mut(RUN));
        let [a, b, c] = rotation.each_mut().map(|plane| plane.chunks_mut(RUN));
        let runs = stale.chunks_mut(RUN).zip(x.zip(y).zip(z)).zip(a.zip(b).zip(c));
        cores::for_each(interrupt, values, runs, |((stale, ((x, y), z)), ((a, b), c))| {
            self.displace_run(stale, [x, y, z], [a, b, c]);
        });
        stale
    }

    /// Neighbours in a list mostly share a cell: those that follow each other in one are moved together.
    fn displace_run(&self, stale: &mut [bool], position: [&mut [i32]; 3], rotation: [&mut [i32]; 3]) {
        let mut index = 0;
        let (mut planes, mut stale) = ((position, rotation), stale);
        loop {
            let ([xs, ys, zs], _) = &planes;
            let mut positions = xs.iter().zip(ys.iter()).zip(zs.iter()).map(|((&x, &y), &z)| [x, y, z]);
            let Some(coordinates) = positions.next().map(|first| self.coordinates(first)) else { return };
            let same = positions.take_while(|&next| self.coordinates(next) == coordinates).count();
            let length = same.wrapping_add(1);
            let cell = self.at_or_after(coordinates, &mut index).zip(self.motions.get(index));
            let (own, rest) = split(planes, length);
            let (own_stale, rest_stale) = stale.split_at_mut_checked(length).unwrap_or_default();
            if let Some((cell, motion)) = cell {
                own_stale.fill(cell.stale);
                motion.displace(own, self.bounds());
            }
            (planes, stale) = (rest, rest_stale);
        }
    }

    fn coordinates(&self, position_fine: [i32; 3]) -> [u32; 3] {
        let cell_log2 = u32::from(self.cell_log2);
        position_fine.map(|fine| (fine.saturating_add(32) >> 6).wrapping_shr(cell_log2) as u32)
    }

    fn at(&self, coordinates: [u32; 3]) -> Option<&Cell> {
        self.at_or_after(coordinates, &mut 0)
    }

    /// The cell with these coordinates. It is looked for first at `index` and at the one after: lists are nearly in the
    /// order of the cells. `index` becomes that of the cell, or of the next one.
    fn at_or_after(&self, coordinates: [u32; 3], index: &mut usize) -> Option<&Cell> {
        let [x, y, z] = coordinates;
        let code = morton(x, y, z);
        let is_at = |index: usize| {
            let before = index.checked_sub(1).and_then(|before| self.codes.get(before));
            let end = self.codes.len();
            index <= end
                && before.is_none_or(|&before| before < code)
                && self.codes.get(index).is_none_or(|&at| code <= at)
        };
        let next = index.wrapping_add(1);
        if !is_at(*index) {
            let search = || self.codes.partition_point(|&before| before < code);
            *index = if is_at(next) { next } else { search() };
        }
        // A Morton code has 21 bits of a coordinate: a position far outside the grid is in no cell.
        self.cells.get(*index).filter(|cell| cell.coordinates == coordinates)
    }

    fn bounds(&self) -> Bounds {
        let last = 1_i32.wrapping_shl(u32::from(self.position_bits)).wrapping_sub(1) << 6;
        Bounds { position: last, one: i32::try_from(self.unit.wrapping_mul(64)).unwrap_or(i32::MAX) }
    }
}

/// The first `length` Gaussians and the others.
fn split((position, rotation): Planes<'_>, length: usize) -> (Planes<'_>, Planes<'_>) {
    let [x, y, z] = position.map(|plane| plane.split_at_mut_checked(length).unwrap_or_default());
    let [a, b, c] = rotation.map(|plane| plane.split_at_mut_checked(length).unwrap_or_default());
    (([x.0, y.0, z.0], [a.0, b.0, c.0]), ([x.1, y.1, z.1], [a.1, b.1, c.1]))
}

#[cfg(test)]
#[expect(clippy::arithmetic_side_effects, reason = "an overflow is a failed test")]
mod tests {
    use super::*;
    use crate::cell::rotation_unit;
    use proptest::prelude::*;

    /// Fine position and fine rotation.
    type Gaussian = ([i32; 3], [i32; 3]);

    const TOP: i32 = ((1 << 20) - 1) * 64;

    fn field(cells: Vec<Cell>) -> CellField {
        let code = |cell: &Cell| morton(cell.coordinates[0], cell.coordinates[1], cell.coordinates[2]);
        let mut cells: Vec<(u64, Cell)> = cells.into_iter().map(|cell| (code(&cell), cell)).collect();
        cells.sort_by_key(|&(code, _)| code);
        cells.dedup_by_key(|&mut (code, _)| code);
        CellField::new(17, 20, 128, cells)
    }

    fn rotated(rotation: [i32; 3]) -> CellField {
        field(vec![Cell { coordinates: [3; 3], rotation, ..Cell::default() }])
    }

    /// A fine position at an offset from the middle of cell 3, 3, 3.
    fn beside([x, y, z]: [i32; 3]) -> [i32; 3] {
        [x, y, z].map(|offset| ((7 << 16) << 6) + offset)
    }

    fn steps(bits: f32) -> i64 {
        rotation_unit(bits.to_bits())
    }

    #[test]
    fn the_unit_is_the_nearest_integer_to_the_inverse_of_the_step() {
        // 0.4 as a binary32 is a little more than 2 / 5.
        assert_eq!([steps(1.0), steps(0.4), steps(0.4_f32.next_down()), steps(0.007_812_5)], [1, 2, 3, 128]);
        assert_eq!(
            [steps(1.0 / 32_766.0), steps(1.0 / 32_767.0), steps(1.0 / 32_768.0)],
            [32_766, 32_767, 32_767]
        );
        assert_eq!([steps(f32::from_bits(0x2B80_0000)), steps(0.0)], [32_767, 32_767]);
    }

    #[test]
    fn a_third_of_a_turn_about_the_diagonal_exchanges_the_axes() {
        let field = rotated([8192; 3]);
        let (position, rotation) = field.displace(&field.cells[0], beside([100, 200, -300]), [0; 3]);
        assert_eq!((position, rotation), (beside([-300, 100, 200]), [64 * 64; 3]));
    }

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        let field = rotated([0, 0, 11_585]);
        let ([x, y, z], _) = field.displace(&field.cells[0], beside([6400, 0, 640]), [0; 3]);
        let [middle_x, end_y, same_z] = beside([0, 6400, 640]);
        assert!(x.abs_diff(middle_x) <= 1 && y.abs_diff(end_y) <= 1 && z == same_z, "{x} {y} {z}");
    }

    #[test]
    fn a_rotation_keeps_its_real_part_positive() {
        // Two thirds of a turn about the diagonal are a third of a turn back.
        let field = rotated([8192; 3]);
        let (_, rotation) = field.displace(&field.cells[0], beside([0; 3]), [64 * 64; 3]);
        assert_eq!(rotation, [-64 * 64; 3]);
        let (_, rotation) = field.displace(&field.cells[0], beside([0; 3]), [5000; 3]);
        assert!(rotation.iter().all(|&part| part < 0), "{rotation:?}");
    }

    fn small_cells() -> impl Strategy<Value = Vec<Cell>> {
        let parts = ([0_u32..8, 0..8, 0..8], any::<bool>(), [-9000..9000, -9000..9000, -9000..9000]);
        let rotation = [-8192..=8192, -8192..=8192, -8192..=8192];
        let cell = (parts, rotation).prop_map(|((coordinates, stale, translation), rotation)| Cell {
            coordinates,
            stale,
            translation,
            rotation,
        });
        proptest::collection::vec(cell, 0..64)
    }

    proptest! {
        #[test]
        fn without_a_rotation_a_cell_only_shifts(
            fine in [0..=TOP, 0..=TOP, 0..=TOP], rotation in [-4096..=4096, -4096..=4096, -4096..=4096],
            translation in [-1_048_576..=1_048_576, -1_048_576..=1_048_576, -1_048_576..=1_048_576],
        ) {
            let field = field(vec![Cell { coordinates: [3; 3], translation, ..Cell::default() }]);
            let (position, same) = field.displace(&field.cells[0], fine, rotation);
            prop_assert_eq!(same, rotation);
            for axis in 0..3 {
                prop_assert_eq!(position[axis], (fine[axis] + 8 * translation[axis]).clamp(0, TOP));
            }
        }

        #[test]
        fn planes_move_as_their_gaussians_do(
            cells in small_cells(),
            fine in proptest::collection::vec(([0..=TOP, 0..=TOP, 0..=TOP], [-9000..9000, -9000..9000, -9000..9000]), 0..40),
        ) {
            let field = field(cells);
            let plane = |of: fn(&Gaussian) -> i32| fine.iter().map(of).collect::<Vec<_>>();
            let mut position = [plane(|g| g.0[0]), plane(|g| g.0[1]), plane(|g| g.0[2])];
            let mut rotation = [plane(|g| g.1[0]), plane(|g| g.1[1]), plane(|g| g.1[2])];
            let stale = field.displace_planes(&mut position, &mut rotation);
            for (at, &(before, start)) in fine.iter().enumerate() {
                let cell = field.find(before);
                let (moved, rotated) = cell.map_or((before, start), |cell| field.displace(cell, before, start));
                prop_assert_eq!(stale[at], cell.is_some_and(|cell| cell.stale));
                prop_assert_eq!([position[0][at], position[1][at], position[2][at]], moved);
                prop_assert_eq!([rotation[0][at], rotation[1][at], rotation[2][at]], rotated);
            }
        }
    }
}
