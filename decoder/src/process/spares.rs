//! Memory of frames that nothing refers to any more: the frames after them are written to it.

use crate::list::GaussianList;
use crate::moves::MoveSpace;
use std::sync::Arc;

/// Memory to be used again: that of lists which ended with the last frame.
#[derive(Debug, Default)]
pub(super) struct Spares {
    lists: Vec<GaussianList>,
    /// Where moves were predicted in.
    pub(super) moves: MoveSpace,
}

impl Spares {
    /// Memory for a list like another.
    pub(super) fn list(&mut self, like: &GaussianList) -> GaussianList {
        let found = self.lists.iter().position(|list| list.len() >= like.len());
        let index = found.or(self.lists.len().checked_sub(1));
        let empty = || GaussianList::empty(like.planes.sh.len());
        index.map_or_else(empty, |index| self.lists.swap_remove(index))
    }

    /// Ends a frame, which needs these lists no more. What it has not used is given up.
    pub(super) fn end_frame(&mut self, lists: impl IntoIterator<Item = Arc<GaussianList>>) {
        self.lists.clear();
        self.take(lists);
    }

    /// Takes the memory of lists, as far as nothing refers to them.
    pub(super) fn take(&mut self, lists: impl IntoIterator<Item = Arc<GaussianList>>) {
        self.lists.extend(lists.into_iter().filter_map(Arc::into_inner));
    }
}
