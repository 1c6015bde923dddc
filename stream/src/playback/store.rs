//! What has arrived and is not played yet: levels whose digests are right.

use super::parts::{Kind, Part};
use crate::control::Levels;
use crate::control::number::size;
use crate::division::Place;
use crate::manifest::Manifest;
use crate::segments::Initialization;
use splatstream_format::Result;
use std::collections::BTreeMap;

/// GOP, Representation, subsegment within these, level.
type Key = (usize, usize, usize, u8);

/// The bytes of a playback.
#[derive(Debug, Default)]
pub(super) struct Store {
    inits: BTreeMap<usize, Initialization>,
    levels: BTreeMap<Key, Vec<u8>>,
}

impl Store {
    /// Whether the initialisation segment of a Representation is there.
    pub(super) fn has_init(&self, representation: usize) -> bool {
        self.inits.contains_key(&representation)
    }

    /// Keeps a part whose digest is right.
    ///
    /// # Errors
    /// An initialisation segment that was malformed when it was packaged.
    pub(super) fn insert(&mut self, part: &Part, bytes: Vec<u8>) -> Result<()> {
        match part.kind {
            Kind::Init => {
                self.inits.insert(part.representation, Initialization::parse(&bytes)?);
            }
            Kind::Level { subsegment, level } => {
                self.levels.insert((part.gop, part.representation, subsegment, level), bytes);
            }
        }
        Ok(())
    }

    /// Bytes of all levels.
    pub(super) fn bytes(&self) -> u64 {
        self.levels.values().map(|bytes| size(bytes.len())).fold(0, u64::saturating_add)
    }

    /// The GOPs of which there is something, in order.
    pub(super) fn gops(&self) -> Vec<usize> {
        let mut gops: Vec<usize> = self.levels.keys().map(|key| key.0).collect();
        gops.dedup();
        gops
    }

    /// Removes a GOP.
    pub(super) fn remove(&mut self, gop: usize) {
        self.levels.retain(|key, _| key.0 != gop);
    }

    /// Removes all GOPs before one.
    pub(super) fn drop_before(&mut self, gop: usize) {
        self.levels = self.levels.split_off(&(gop, 0, 0, 0));
    }

    /// The start of the stream; nothing before the initialisation segment of the base is there.
    pub(super) fn head(&self) -> &[u8] {
        self.inits.get(&0).map_or(&[], Initialization::head)
    }

    /// The units of some pieces of a GOP, in the order of the stream, and the Representations whose files are malformed.
    pub(super) fn units(&self, manifest: &Manifest, gop: usize, pieces: &Levels) -> (Vec<u8>, Vec<usize>) {
        let mut samples: Vec<(Place, Vec<u8>)> = Vec::new();
        let mut malformed = Vec::new();
        for (&representation, init) in &self.inits {
            let last = pieces.of(representation).checked_sub(1);
            let Some(levels) = last.and_then(|last| manifest.levels_of_piece(representation, last)) else {
                continue;
            };
            for bytes in self.subsegments(gop, representation, levels.end) {
                match init.samples(&bytes) {
                    Ok(found) => {
                        samples.extend(found.into_iter().map(|(place, units)| (place, units.to_vec())))
                    }
                    Err(_) => malformed.push(representation),
                }
            }
        }
        samples.sort_by_key(|(place, _)| *place);
        malformed.dedup();
        (samples.into_iter().flat_map(|(_, units)| units).collect(), malformed)
    }

    /// The first levels of each subsegment that a Representation has in a GOP.
    fn subsegments(&self, gop: usize, representation: usize, levels: u8) -> Vec<Vec<u8>> {
        let mut found: BTreeMap<usize, Vec<u8>> = BTreeMap::new();
        let range = (gop, representation, 0, 0)..(gop, representation.saturating_add(1), 0, 0);
        for (&(_, _, subsegment, level), bytes) in self.levels.range(range) {
            if level < levels {
                found.entry(subsegment).or_default().extend_from_slice(bytes);
            }
        }
        found.into_values().collect()
    }
}
