//! A uniform grid over points: who is near whom.
//!
//! The grid spans the box of the inner points; those outside are put into the cells of its border. Moving
//! points to the border brings them closer together, never apart, so that a search by cells misses nothing.

/// Cells an axis, at most: 16 MB of cells.
const MAX_CELLS: f32 = 160.0;

/// Points that a cell holds on average. Scenes are surfaces: most cells are empty, and the others hold some.
const POINTS_A_CELL: f32 = 0.125;

/// Points in cells.
pub(super) struct Grid<'a> {
    points: [&'a [f32]; 3],
    low: [f32; 3],
    cell: f32,
    cells: [usize; 3],
    /// Where each cell starts in `members`; one more for the end of the last.
    starts: Vec<u32>,
    members: Vec<u32>,
}

/// A point found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Neighbour {
    /// Its index.
    pub(super) index: u32,
    /// Its squared distance.
    pub(super) squared: f32,
}

impl<'a> Grid<'a> {
    /// Sorts points into cells.
    pub(super) fn new(points: [&'a [f32]; 3]) -> Self {
        let [low, high] = inner_box(points);
        let sides = [0, 1, 2].map(|axis: usize| high[axis] - low[axis]);
        let longest = sides.iter().fold(f32::MIN_POSITIVE, |longest, &side| longest.max(side));
        let wanted = (points[0].len() as f32 / POINTS_A_CELL).cbrt().clamp(1.0, MAX_CELLS);
        let cell = longest / wanted;
        let cells = sides.map(|side| (side / cell).floor() as usize + 1);
        let mut grid = Self { points, low, cell, cells, starts: Vec::new(), members: Vec::new() };
        grid.fill();
        grid
    }

    /// Counting sort: how many a cell has, where it starts, who is in it.
    fn fill(&mut self) {
        let buckets: Vec<usize> =
            (0..self.points[0].len()).map(|row| self.index_of(self.cell_of(self.point(row)))).collect();
        self.starts = vec![0; self.cells.iter().product::<usize>() + 1];
        buckets.iter().for_each(|&bucket| self.starts[bucket + 1] += 1);
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let mut free = self.starts.clone();
        self.members = vec![0; buckets.len()];
        for (row, &bucket) in buckets.iter().enumerate() {
            self.members[free[bucket] as usize] = row as u32;
            free[bucket] += 1;
        }
    }

    /// The nearest point; of equally near ones the first. None if there are no points.
    pub(super) fn nearest(&self, to: [f32; 3]) -> Option<Neighbour> {
        let mut best: Option<Neighbour> = None;
        let most = self.cells.iter().copied().max().unwrap_or(0);
        for shell in 0..=most {
            // Every point of this shell and those outside it is further away than this.
            let bound = self.cell * shell.saturating_sub(1) as f32;
            if best.is_some_and(|best| best.squared < bound * bound) {
                break;
            }
            self.visit_shell(self.cell_of(to), shell, &mut |index| {
                let found = self.neighbour(index, to);
                let closer = best.is_none_or(|best| (found.squared, index) < (best.squared, best.index));
                best = if closer { Some(found) } else { best };
            });
        }
        best
    }

    /// Visits every point within `radius`.
    pub(super) fn within(&self, to: [f32; 3], radius: f32, visit: &mut impl FnMut(Neighbour)) {
        let shells = (radius / self.cell).ceil() as usize + 1;
        for shell in 0..=shells.min(self.cells.iter().copied().max().unwrap_or(0)) {
            self.visit_shell(self.cell_of(to), shell, &mut |index| {
                let found = self.neighbour(index, to);
                if found.squared <= radius * radius {
                    visit(found);
                }
            });
        }
    }

    /// Visits the points of the cells that are `shell` cells from `centre` on the axis where they are
    /// furthest.
    fn visit_shell(&self, centre: [usize; 3], shell: usize, visit: &mut impl FnMut(u32)) {
        let span = |axis: usize| {
            centre[axis].saturating_sub(shell)..=(centre[axis] + shell).min(self.cells[axis] - 1)
        };
        for z in span(2) {
            for y in span(1) {
                let mut visit_cell =
                    |x: usize| self.cell_members([x, y, z]).iter().for_each(|&index| visit(index));
                if z.abs_diff(centre[2]) == shell || y.abs_diff(centre[1]) == shell {
                    span(0).for_each(visit_cell);
                } else {
                    // Between its faces, a shell has only the two ends on x.
                    centre[0].checked_sub(shell).into_iter().for_each(&mut visit_cell);
                    Some(centre[0] + shell).filter(|&x| x < self.cells[0]).into_iter().for_each(visit_cell);
                }
            }
        }
    }

    fn cell_members(&self, cell: [usize; 3]) -> &[u32] {
        let bucket = self.index_of(cell);
        &self.members[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }

    fn neighbour(&self, index: u32, to: [f32; 3]) -> Neighbour {
        let point = self.point(index as usize);
        let squared = point.iter().zip(to).map(|(a, b)| (a - b) * (a - b)).sum();
        Neighbour { index, squared }
    }

    fn point(&self, row: usize) -> [f32; 3] {
        self.points.map(|plane| plane[row])
    }

    fn cell_of(&self, point: [f32; 3]) -> [usize; 3] {
        // A float that is too small or too large becomes the nearest integer: the cells of the border.
        [0, 1, 2].map(|axis: usize| {
            (((point[axis] - self.low[axis]) / self.cell).floor() as usize).min(self.cells[axis] - 1)
        })
    }

    fn index_of(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.cells[1] + y) * self.cells[0] + x
    }
}

/// The box of the points without the outermost hundredth at both ends of each axis.
pub(super) fn inner_box(points: [&[f32]; 3]) -> [[f32; 3]; 2] {
    let sorted = points.map(|plane| {
        let mut plane = plane.to_vec();
        plane.sort_unstable_by(f32::total_cmp);
        plane
    });
    let at = |share: usize| {
        sorted.each_ref().map(|plane| {
            plane.get((plane.len() * share / 100).min(plane.len().saturating_sub(1))).copied().unwrap_or(0.0)
        })
    };
    [at(1), at(99)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points that are not evenly spread: some far out, some in one place.
    fn points(count: usize) -> [Vec<f32>; 3] {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut planes = [(); 3].map(|()| Vec::new());
        for row in 0..count {
            let scale = if row % 97 == 0 { 1000.0 } else { 1.0 };
            let flat = [1.0, 0.1, 3.0];
            for (plane, flat) in planes.iter_mut().zip(flat) {
                let value = if row % 53 == 0 { 0.25 } else { random() };
                plane.push(value * scale * flat);
            }
        }
        planes
    }

    #[test]
    fn the_grid_finds_what_a_search_of_all_points_finds() {
        let (mine, others) = (points(700), points(911));
        let grid = Grid::new(others.each_ref().map(Vec::as_slice));
        for row in 0..700 {
            let to = mine.each_ref().map(|plane| plane[row]);
            let all: Vec<Neighbour> = (0..911).map(|index| grid.neighbour(index, to)).collect();
            let best = all.iter().copied().reduce(|a, b| if b.squared < a.squared { b } else { a });
            assert_eq!(grid.nearest(to), best);
            let mut near = Vec::new();
            grid.within(to, 0.2, &mut |found| near.push(found.index));
            near.sort_unstable();
            let expected: Vec<u32> =
                all.iter().filter(|found| found.squared <= 0.2 * 0.2).map(|found| found.index).collect();
            assert_eq!(near, expected);
        }
    }

    #[test]
    fn one_point_and_none_are_searched_too() {
        let one = [[1.0], [2.0], [3.0]];
        let grid = Grid::new(one.each_ref().map(<[f32; 1]>::as_slice));
        assert_eq!(grid.nearest([-9.0; 3]).map(|found| found.index), Some(0));
        assert_eq!(Grid::new([&[]; 3]).nearest([0.0; 3]), None);
    }
}
