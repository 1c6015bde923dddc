//! Clause 7.18: a frame as later ones refer to it, and what is carried into it.

use crate::digest::{UnitDigest, frame_digest, unit_digest};
use crate::displacement::CellField;
use crate::frame::QuantizedFrame;
use crate::home::Home;
use crate::process::Compensation;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::syntax::IncrementHeader;
use std::sync::Arc;

/// A frame as later ones refer to it.
#[derive(Debug, Clone)]
pub struct FrameState {
    /// Its display index.
    pub number: u32,
    /// The homes, from 0 on, as far as they were decoded.
    pub homes: Vec<Home>,
    /// The homes of the intra frame of the GOP.
    pub anchor: Arc<Vec<Home>>,
    /// The cells of the predicted frames from the intra frame to this one.
    pub fields: Vec<Arc<CellField>>,
    /// What is carried of each home, where it has been shown.
    pub carried: Vec<Option<Home>>,
    /// What was added before output.
    pub compensation: Compensation,
    /// The plane models in force for unit 0 of a frame that refers to this one.
    pub models: ModelsInForce,
}

impl FrameState {
    /// Clause 7.18: what is carried of a home into this frame.
    fn carried_of(&self, home: usize) -> Home {
        if let Some(Some(known)) = self.carried.get(home) {
            return known.clone();
        }
        let anchor = self.anchor.get(home).cloned().unwrap_or_default();
        self.fields.iter().fold(anchor, |home, field| home.carried(field))
    }

    /// Carries what was not decoded of `refinements` homes from the frame this one refers to.
    pub fn carry_from(&mut self, reference: &Self, refinements: usize) {
        let Some(field) = self.fields.last() else { return };
        let decoded = self.homes.len();
        let carried =
            (0..refinements).map(|home| (home >= decoded).then(|| reference.carried_of(home).carried(field)));
        self.carried = carried.collect();
    }

    /// The Gaussians that are shown: those decoded, then those carried; and how many are decoded.
    pub fn shown(&self, sh_planes: usize, subset: bool) -> (QuantizedFrame, usize) {
        let mut planes = QuantizedFrame::zeroed(0, sh_planes);
        self.homes.iter().for_each(|home| planes.append(&home.planes));
        let decoded = planes.len();
        let carried = self.carried.iter().flatten().filter(|_| !subset);
        carried.for_each(|home| planes.append(&home.planes));
        (planes, decoded)
    }

    /// The digest of what is carried.
    pub fn carried_digest(&self) -> u64 {
        let digests: Vec<UnitDigest> =
            self.carried.iter().flatten().map(|home| unit_digest(&home.planes, 0..home.len())).collect();
        frame_digest(&digests)
    }

    /// What a header adds to all decoded Gaussians, or to those that are not of the intra frame.
    pub(crate) fn compensation(&self, header: &IncrementHeader, all: bool) -> Compensation {
        let (log_scale, opacity) = (header.compensation_log_scale, header.compensation_opacity);
        if log_scale == 0 && opacity == 0 {
            return Compensation::default();
        }
        let of_home = |home: &Home| home.anchor.iter().map(|&anchor| all || !anchor).collect::<Vec<_>>();
        Compensation { log_scale, opacity, applies: self.homes.iter().flat_map(of_home).collect() }
    }
}
