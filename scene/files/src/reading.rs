//! What all readers share: a file as bytes, planes as a frame, and the check of its values.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{SceneError, SceneErrorKind};
use crate::limits::Budget;
use splatstream_gaussians::{GaussianFrame, Planes};

/// The whole of a file, of which no format is empty but by accident; it counts as long as the budget lives.
pub(crate) fn read_file(path: &Path, budget: &mut Budget) -> Result<Vec<u8>, SceneError> {
    const WHAT: &str = "the file";
    let mut read = || -> Result<Vec<u8>, SceneError> {
        let file = File::open(path)?;
        let size = file.metadata()?.len();
        let mut bytes = budget.room(size, WHAT)?;
        // A pipe has no size, and a file may grow while it is read.
        file.take(size.saturating_add(budget.left()).saturating_add(1)).read_to_end(&mut bytes)?;
        budget.take((bytes.len() as u64).saturating_sub(size), WHAT)?;
        match bytes.is_empty() {
            true => Err(SceneErrorKind::Empty.into()),
            false => Ok(bytes),
        }
    };
    read().map_err(|error| error.in_file(path))
}

/// The frame of `planes`, its rotations at unit length. Values are not checked.
pub(crate) fn frame_of(sh_degree: u8, planes: Planes) -> Result<GaussianFrame, SceneError> {
    Ok(GaussianFrame::from_planes(sh_degree, planes)?.with_unit_rotations())
}

/// The frame, if it holds no value that it may not hold.
pub(crate) fn checked(frame: GaussianFrame) -> Result<GaussianFrame, SceneError> {
    frame.validate()?;
    Ok(frame)
}

/// The values of a row of planes. A frame has that row: its planes are of one length.
pub(crate) fn row_of<const N: usize>(planes: &[Vec<f32>; N], row: usize) -> [f32; N] {
    planes.each_ref().map(|plane| plane.get(row).copied().unwrap_or_default())
}
