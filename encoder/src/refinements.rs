//! What each refinement brings of an order of importance.

use core::ops::Range;
use splatstream_format::syntax::prefix_length;

/// The parts of an order of so many Gaussians that the refinements up to these percentages bring, one after the other.
pub(crate) fn parts(percents: &[u8], total: usize) -> impl Iterator<Item = Range<usize>> {
    percents.iter().scan(0, move |start, &percent| {
        let part = *start..(prefix_length(percent, total as u32) as usize).max(*start);
        *start = part.end;
        Some(part)
    })
}
