//! A frame to be coded, as its source has it.

use crate::matching::Cloud;
use splatstream_gaussians::GaussianFrame;

/// A frame to be coded.
#[derive(Clone)]
pub(crate) struct Target {
    /// Canonical, without what is never seen.
    pub(crate) frame: GaussianFrame,
    /// Positions in grid steps; empty where frames refer to no others.
    pub(crate) position: [Vec<f32>; 3],
    /// Row of each Gaussian in its file, and rows of the file.
    pub(crate) rows: Vec<u32>,
    pub(crate) row_count: u32,
    /// A digest of the frame as it was read, where a state of fitting is kept.
    pub(crate) digest: Option<u64>,
}

impl Target {
    /// Lets the values go, and keeps which Gaussians they were of.
    pub(crate) fn forget(&mut self) {
        self.frame = GaussianFrame::default();
        self.position = Default::default();
    }

    /// Where rows of the file are among its Gaussians.
    pub(crate) fn places(&self, rows: &[u32]) -> Vec<Option<u32>> {
        let mut place = vec![None; self.row_count as usize];
        for (index, &row) in (0..).zip(&self.rows) {
            place.get_mut(row as usize).into_iter().for_each(|place| *place = Some(index));
        }
        rows.iter().map(|&row| place.get(row as usize).copied().flatten()).collect()
    }

    pub(crate) fn cloud(&self) -> Cloud<'_> {
        Cloud {
            position: self.position.each_ref().map(Vec::as_slice),
            log_scale: self.frame.log_scale().each_ref().map(Vec::as_slice),
            opacity: self.frame.opacity_logit(),
            dc: self.frame.dc().each_ref().map(Vec::as_slice),
            row: &self.rows,
            row_count: self.row_count,
        }
    }
}
