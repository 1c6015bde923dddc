//! Requests that were of no use, and when there have been enough of them.

use super::fault::Fault;
use super::options::Options;
use super::parts::Part;
use std::collections::{BTreeMap, BTreeSet};

/// Times that a level may arrive damaged.
const DAMAGED: u32 = 2;

/// What comes of a part that has not come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It is asked for again.
    Again,
    /// It is left out of its GOP, with all that needs it.
    LeftOut,
    /// The file of its Representation is gone: that is left out of all GOPs.
    Gone,
}

/// What has been asked for in vain.
#[derive(Debug, Default)]
pub(super) struct Attempts {
    /// Per GOP, Representation and piece: requests that were of no use, and those among them that brought damaged bytes.
    faults: BTreeMap<(usize, usize, u8), (u32, u32)>,
    /// Representations whose files the server refuses, and how often in a row it did so.
    refused: BTreeSet<usize>,
    refusals: BTreeMap<usize, u32>,
}

impl Attempts {
    /// A part of a Representation has come.
    pub(super) fn arrived(&mut self, representation: usize) {
        self.refusals.remove(&representation);
    }

    /// A part has not come, for a reason; what comes of that. `is_shared` says that the file has the Representation in all GOPs.
    pub(super) fn judge(
        &mut self,
        part: &Part,
        fault: &Fault,
        options: &Options,
        is_shared: bool,
    ) -> Verdict {
        let (all, damaged) = self.faults.entry((part.gop, part.representation, part.piece)).or_default();
        *all = all.saturating_add(1);
        if *fault == Fault::Digest {
            *damaged = damaged.saturating_add(1);
        }
        let refusals = self.refusals.entry(part.representation).or_default();
        *refusals = if fault.is_final() { refusals.saturating_add(1) } else { 0 };
        let is_gone = !part.is_base() && *refusals >= options.attempts;
        let most = match (part.is_base(), self.refused.contains(&part.representation) && fault.is_final()) {
            (_, true) => 1,
            (true, false) => options.base_attempts,
            (false, false) => options.attempts,
        };
        match *all >= most || *damaged >= DAMAGED {
            _ if is_gone && is_shared && part.representation > 0 => Verdict::Gone,
            is_spent if is_spent || is_gone => Verdict::LeftOut,
            _ => Verdict::Again,
        }
    }

    /// A part is left out, for a reason: a Representation whose files are refused is asked for once from then on.
    pub(super) fn left_out(&mut self, part: &Part, fault: &Fault) {
        if fault.is_final() {
            self.refused.insert(part.representation);
        }
    }

    /// Forgets what was asked for of a GOP.
    pub(super) fn forget(&mut self, gop: usize) {
        self.faults.retain(|key, _| key.0 != gop);
    }
}
