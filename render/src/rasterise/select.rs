//! Some Gaussians of a frame, on all cores.

use rayon::prelude::*;
use splatstream_gaussians::{GaussianFrame, Planes};

/// As [`GaussianFrame::select`], with planes side by side: one core waits for memory most of the time.
///
/// # Panics
/// If an index is not below [`GaussianFrame::len`].
#[must_use]
#[expect(
    clippy::indexing_slicing,
    reason = "a row that is not there is a fault of the caller, as `select` says"
)]
pub fn select(frame: &GaussianFrame, indices: &[u32]) -> GaussianFrame {
    let mut planes = Planes { sh: vec![Vec::new(); frame.sh().len()], ..Planes::default() };
    let (of_frame, picked): (Vec<_>, Vec<_>) = (frame.planes().iter().collect(), planes.iter_mut().collect());
    of_frame.into_par_iter().zip(picked).for_each(|(from, to)| {
        *to = indices.iter().map(|&row| from[row as usize]).collect();
    });
    match GaussianFrame::from_planes(frame.sh_degree(), planes) {
        Ok(selected) => selected.with_antialiased(frame.antialiased()),
        // Planes of a frame make one, whichever rows they have.
        Err(_) => frame.select(indices),
    }
}
