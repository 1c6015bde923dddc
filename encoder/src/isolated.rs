//! Absurd values: taken for the nearest that are sensible, so that one Gaussian spoils nothing else, and reported.

use crate::grid::{MAX_COLOUR, PositionGrid};
use rayon::prelude::*;
use splatstream_gaussians::{GaussianFrame, PlanesMut};
use std::cmp::Ordering;

/// Values of one attribute that were too far out and are coded as the nearest that are not.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Isolated {
    /// The attribute.
    pub attribute: &'static str,
    /// Gaussians, over all frames.
    pub count: u64,
    /// The frame of the first.
    pub frame: u32,
    /// The first Gaussian, counted in the order of the source.
    pub row: u32,
    /// Its value.
    pub value: f32,
    /// Frame, Gaussian and value of the one that is farthest out.
    pub farthest: (u32, u32, f32),
}

impl Isolated {
    /// What was found in a frame: rows and values.
    pub(crate) fn of(
        attribute: &'static str,
        frame: u32,
        found: impl Iterator<Item = (u32, f32)>,
    ) -> Option<Self> {
        let found: Vec<(u32, f32)> = found.collect();
        let &(row, value) = found.first()?;
        let &(far_row, far) = found.iter().max_by(|a, b| by_magnitude(&a.1, &b.1))?;
        let count = found.len() as u64;
        Some(Self { attribute, count, frame, row, value, farthest: (frame, far_row, far) })
    }

    /// Adds what was found in a frame to what was found before.
    pub(crate) fn add(found: Option<Self>, all: &mut Vec<Self>) {
        let Some(found) = found else { return };
        match all.iter_mut().find(|known| known.attribute == found.attribute) {
            Some(known) => {
                known.count = known.count.saturating_add(found.count);
                if found.farthest.2.abs() > known.farthest.2.abs() {
                    known.farthest = found.farthest;
                }
            }
            None => all.push(found),
        }
    }
}

/// The frame with colours of which none is far beyond what a screen shows, and what they were; `rows`: the row of each
/// Gaussian in the source.
#[expect(
    clippy::indexing_slicing,
    reason = "axes are constants; rows are those of the frame, of which `rows` has as many"
)]
pub(crate) fn colours(
    mut frame: GaussianFrame,
    rows: &[u32],
    number: u32,
) -> (GaussianFrame, Option<Isolated>) {
    let is_out = |value: &f32| value.abs() > MAX_COLOUR;
    // In whole vectors: hardly any frame has such colours.
    let all_are_in = |values: &[f32]| !values.iter().fold(false, |any, value| any | is_out(value));
    let planes: Vec<&Vec<f32>> = frame.dc().iter().chain(frame.sh()).collect();
    if planes.par_iter().all(|plane| all_are_in(plane)) {
        return (frame, None);
    }
    let value = |row: usize| {
        let planes = frame.dc().iter().chain(frame.sh());
        planes.map(|plane| plane[row]).filter(is_out).max_by(by_magnitude)
    };
    let found = (0..frame.len()).filter_map(|row| Some((rows[row], value(row)?)));
    let found = Isolated::of("colour", number, found);
    let PlanesMut { dc, sh, .. } = frame.planes_mut();
    for value in dc.into_iter().chain(sh).flatten() {
        *value = value.clamp(-MAX_COLOUR, MAX_COLOUR);
    }
    (frame, found)
}

/// The Gaussians of a frame that the grid of positions does not reach.
#[expect(
    clippy::indexing_slicing,
    reason = "axes are constants; rows are those of the frame, of which `rows` has as many"
)]
pub(crate) fn positions(
    frame: &GaussianFrame,
    rows: &[u32],
    grid: &PositionGrid,
    number: u32,
) -> Option<Isolated> {
    let far = |row: usize| {
        let values = [0, 1, 2].map(|axis: usize| frame.position()[axis][row]);
        (0..3).find(|&axis| grid.is_beyond(axis, values[axis])).map(|axis| (row, values[axis]))
    };
    let found: Vec<(usize, f32)> = (0..frame.len()).into_par_iter().filter_map(far).collect();
    Isolated::of("position", number, found.into_iter().map(|(row, value)| (rows[row], value)))
}

fn by_magnitude(a: &f32, b: &f32) -> Ordering {
    a.abs().total_cmp(&b.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_files::builtin::BuiltinScene;

    #[test]
    fn absurd_colours_are_counted_and_become_sensible() {
        let frame = BuiltinScene { gaussians: 100, ..BuiltinScene::default() }.frame(0);
        let degree = frame.sh_degree();
        let mut planes = frame.into_planes();
        planes.dc[1][7] = 1e6;
        planes.dc[2][7] = -2e6;
        planes.dc[0][9] = -30.0;
        let frame = GaussianFrame::from_planes(degree, planes).unwrap();
        let rows: Vec<u32> = (100..100 + frame.len() as u32).collect();
        let (frame, found) = colours(frame, &rows, 3);
        let farthest = (3, 107, -2e6);
        let expected = Isolated { attribute: "colour", count: 2, frame: 3, row: 107, value: -2e6, farthest };
        assert_eq!(found, Some(expected));
        assert_eq!((frame.dc()[1][7], frame.dc()[2][7], frame.dc()[0][9]), (16.0, -16.0, -16.0));
        assert_eq!(colours(frame, &rows, 3).1, None);
    }
}
