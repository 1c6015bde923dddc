//! A decoded frame of a predicted GOP as later frames refer to it.

use crate::carried::Carried;
use crate::digest::ListDigest;
use crate::list::GaussianList;
use crate::shift::Shift;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::{Error, Result};
use std::sync::Arc;

/// A frame that others may refer to.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrameState {
    /// Its display index.
    pub(crate) index: u32,
    /// log2 of how many frames it is later than its reference frame.
    pub(crate) span_log2: u8,
    /// How many exact lists frames that refer to this one can have (clause 7.3.3).
    pub(crate) level: u8,
    /// The exact lists; of an I frame those that it shows.
    pub(crate) lists: Vec<Arc<GaussianList>>,
    /// Their digests, as far as they were compared.
    pub(crate) digests: Vec<ListDigest>,
    /// The carried lists; none if they are not available.
    pub(crate) carried: Option<Carried>,
    /// The lists of the I frame of the GOP, if they are a whole anchor: units predict from them.
    pub(crate) anchor: Option<Arc<[Arc<GaussianList>]>>,
    /// Whether the I frame is complete, and this frame and every P or B frame on the way from it has a level above 0.
    pub(crate) is_exact: bool,
    /// Whether it shows less than its operating point asks for.
    pub(crate) is_reduced: bool,
    /// The identities of the Gaussians of each exact list, if they are asked for.
    pub(crate) identities: Vec<Arc<Vec<u32>>>,
    /// What compensated the I frame of the GOP, and compensates carried lists.
    pub(crate) carried_shift: Shift,
    /// The plane models in force in a frame that refers to this one: for its cells, and for its unit of refinement 0.
    pub(crate) models: ModelsInForce,
}

impl FrameState {
    /// The digest of a list of another frame, if that is list r of this one itself, and its digest was compared.
    pub(crate) fn digest(&self, r: u8, list: &Arc<GaussianList>) -> Option<&ListDigest> {
        let own = self.lists.get(usize::from(r)).filter(|own| Arc::ptr_eq(own, list));
        own.and_then(|_| self.digests.get(usize::from(r)))
    }

    /// Its list r.
    ///
    /// # Errors
    /// A fault: it has fewer lists, where r is below its level.
    pub(crate) fn list(&self, r: usize) -> Result<&Arc<GaussianList>> {
        self.lists.get(r).ok_or(Error::fault("a list for each refinement below the level of a frame"))
    }

    /// Its exact lists, once no frame refers to it.
    pub(crate) fn into_lists(self) -> Vec<Arc<GaussianList>> {
        self.lists
    }
}

/// log2 of how many frames a frame is later than the one it refers to: a power of two (7.3.1).
pub(crate) fn span_log2(index: u32, reference: &FrameState) -> u8 {
    let span = index.saturating_sub(reference.index);
    span.checked_ilog2().and_then(|log2| u8::try_from(log2).ok()).unwrap_or(0)
}
