//! A GOP while its frames are being coded: what they share, and what waits to be written.
#![expect(clippy::arithmetic_side_effects, reason = "bytes in memory")]

use crate::frame::steadiness::Steadiness;
use crate::frame::{CodedFrame, Reference};
use crate::gop_tools::GopTools;
use splatstream_decoder::list::GaussianList;
use splatstream_format::syntax::{GopHeader, UnitHeader, UnitId};

/// A GOP while its frames are being coded.
pub(super) struct Gop {
    /// Display index of its first frame.
    pub(super) first: u32,
    pub(super) header: GopHeader,
    pub(super) tools: GopTools,
    /// The last frame of each temporal layer and its number.
    pub(super) references: Vec<Option<(u32, Reference)>>,
    /// The lists of the I frame, where new Gaussians of other frames may be predicted from all of them.
    pub(super) anchor: Vec<GaussianList>,
    /// What fills the holes of the prefixes of the I frame, and so of all frames.
    pub(super) compensation: Vec<(i8, i8)>,
    /// The level of the price of a bit in pictures, of the last frame that had one.
    pub(super) price_level: i32,
    /// What the I frame takes: bytes of a Gaussian.
    pub(super) intra_bytes: f64,
    /// How good its frames are, where these are true to attributes.
    pub(super) steadiness: Option<Steadiness>,
    /// Units that are not written yet.
    pub(super) units: Vec<(UnitId, Vec<u8>)>,
    /// Whether the header has been written.
    pub(super) is_open: bool,
    /// Whether a new Gaussian takes the network.
    pub(super) has_learned: bool,
    /// Whether no frame refers to another although some might have: spatial layers would only cost bits.
    pub(super) in_one_layer: bool,
}

impl Gop {
    /// Bytes of its units so far.
    pub(super) fn bytes(&self) -> usize {
        self.units.iter().map(|(_, payload)| UnitHeader::SIZE + payload.len()).sum()
    }

    /// Keeps the I frame of a predicted GOP.
    pub(super) fn start_with(&mut self, number: u32, coded: CodedFrame, whole_anchor: bool) {
        if whole_anchor {
            self.anchor.clone_from(&coded.reference.lists);
        } else {
            let top = coded.units.last().map_or(0, |unit| unit.spatial_layer);
            let highest = coded.units.iter().filter(|unit| unit.spatial_layer == top);
            let offsets = highest.map(|u| (u.header.compensation_log_scale, u.header.compensation_opacity));
            self.compensation = offsets.collect();
        }
        self.keep(0, number, coded.reference);
    }

    /// Keeps a frame that others refer to, and no frame of a higher temporal layer.
    #[expect(clippy::indexing_slicing, reason = "units are counted by what they index, axes are constants")]
    pub(super) fn keep(&mut self, layer: u8, number: u32, reference: Reference) {
        let layer = usize::from(layer);
        self.references.iter_mut().skip(layer).for_each(|slot| *slot = None);
        self.references[layer] = Some((number, reference));
    }
}
