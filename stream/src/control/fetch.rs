//! What one request asks for.

use super::options::Range;

/// Byte ranges of one GOP, in the order they are wanted: each piece after those it needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fetch {
    gop: usize,
    ranges: Vec<Range>,
}

impl Fetch {
    /// Ranges of a GOP; none where there is none.
    pub(super) fn new(gop: usize, ranges: Vec<Range>) -> Option<Self> {
        (!ranges.is_empty()).then_some(Self { gop, ranges })
    }

    /// Index of the GOP.
    pub fn gop(&self) -> usize {
        self.gop
    }

    /// What is requested, in order.
    pub fn ranges(&self) -> &[Range] {
        &self.ranges
    }

    /// Bytes of all ranges.
    pub fn bytes(&self) -> u64 {
        self.ranges.iter().map(|range| range.bytes).fold(0, u64::saturating_add)
    }
}
