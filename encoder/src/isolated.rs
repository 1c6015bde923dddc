//! Absurd values: taken for the nearest that are sensible, so that one Gaussian spoils nothing else, and reported.

use crate::grid::{MAX_COLOUR, PositionGrid};
use splatstream_gaussians::{GaussianFrame, PlanesMut};

/// Values of one attribute that were too far out and are coded as the nearest that are not.
#[derive(Debug, Clone, Copy, PartialEq)]
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
}

impl Isolated {
    /// Adds what was found in a frame to what was found before.
    #[expect(clippy::arithmetic_side_effects, reason = "counts of Gaussians")]
    pub(crate) fn add(found: Option<Self>, all: &mut Vec<Self>) {
        let Some(found) = found else { return };
        match all.iter_mut().find(|known| known.attribute == found.attribute) {
            Some(known) => known.count += found.count,
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
#[expect(clippy::arithmetic_side_effects, reason = "counts of Gaussians")]
pub(crate) fn colours(
    mut frame: GaussianFrame,
    rows: &[u32],
    number: u32,
) -> (GaussianFrame, Option<Isolated>) {
    let is_out = |value: &f32| value.abs() > MAX_COLOUR;
    let far = |row: usize| {
        let planes = frame.dc().iter().chain(frame.sh());
        planes.map(|plane| plane[row]).find(is_out)
    };
    let all = || frame.dc().iter().chain(frame.sh());
    if !all().flatten().any(is_out) {
        return (frame, None);
    }
    let mut first = None;
    let mut count = 0;
    for row in 0..frame.len() {
        if let Some(value) = far(row) {
            count += 1;
            first.get_or_insert((row, value));
        }
    }
    let found = first.map(|(row, value)| Isolated {
        attribute: "colour",
        count,
        frame: number,
        row: rows[row],
        value,
    });
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
#[expect(clippy::arithmetic_side_effects, reason = "counts of Gaussians")]
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
    let mut found = (0..frame.len()).filter_map(far);
    let (row, value) = found.next()?;
    let count = 1 + found.count() as u64;
    Some(Isolated { attribute: "position", count, frame: number, row: rows[row], value })
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
        planes.dc[2][7] = -1e6;
        planes.dc[0][9] = -30.0;
        let frame = GaussianFrame::from_planes(degree, planes).unwrap();
        let rows: Vec<u32> = (100..100 + frame.len() as u32).collect();
        let (frame, found) = colours(frame, &rows, 3);
        let expected = Isolated { attribute: "colour", count: 2, frame: 3, row: 107, value: 1e6 };
        assert_eq!(found, Some(expected));
        assert_eq!((frame.dc()[1][7], frame.dc()[2][7], frame.dc()[0][9]), (16.0, -16.0, -16.0));
        assert_eq!(colours(frame, &rows, 3).1, None);
    }
}
