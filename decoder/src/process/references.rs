//! The frames of a GOP that later ones can refer to.

use crate::frame_state::FrameState;

/// The last frame of each temporal layer.
#[derive(Debug, Default)]
pub(super) struct References {
    layers: [Option<FrameState>; 4],
}

impl References {
    /// The temporal layer in which the frame with a display index is kept.
    pub(super) fn find(&self, index: u32) -> Option<usize> {
        self.layers.iter().position(|state| state.as_ref().is_some_and(|state| state.index == index))
    }

    /// The frame that is kept for a layer.
    pub(super) fn get(&self, layer: usize) -> Option<&FrameState> {
        self.layers.get(layer).and_then(Option::as_ref)
    }

    /// The same, to be changed.
    pub(super) fn get_mut(&mut self, layer: usize) -> Option<&mut FrameState> {
        self.layers.get_mut(layer).and_then(Option::as_mut)
    }

    /// Keeps a frame. No later frame refers to those of its layer and of higher ones that came before.
    pub(super) fn store(&mut self, layer: u8, state: FrameState, give_up: impl FnMut(FrameState)) {
        let layer = usize::from(layer);
        self.layers.iter_mut().skip(layer).filter_map(Option::take).for_each(give_up);
        if let Some(slot) = self.layers.get_mut(layer) {
            *slot = Some(state);
        }
    }
}
