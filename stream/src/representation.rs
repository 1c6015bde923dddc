//! C.3: what a package divides a stream into.

use core::fmt;
use splatstream_format::syntax::{MAX_LAYERS, SequenceParameters};

/// A part of a stream that is a Representation and a file of its own. The order is that of dependence: a Representation
/// needs those before it, but never one after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Representation {
    /// What the I frames have on a spatial layer. That of layer 0 also has what belongs to whole GOPs.
    Spatial(u8),
    /// The predicted frames of a temporal layer.
    Temporal(u8),
}

impl Representation {
    /// The kind as `gssC` and the layer write it: 0 is spatial, 1 is temporal.
    pub const fn codes(self) -> (u8, u8) {
        match self {
            Self::Spatial(layer) => (0, layer),
            Self::Temporal(layer) => (1, layer),
        }
    }

    /// The Representation with these codes.
    pub const fn from_codes(kind: u8, layer: u8) -> Option<Self> {
        match (kind, layer < MAX_LAYERS) {
            (0, true) => Some(Self::Spatial(layer)),
            (1, true) => Some(Self::Temporal(layer)),
            _ => None,
        }
    }

    /// The Representation with an identifier such as `s0`.
    pub fn from_id(id: &str) -> Option<Self> {
        Self::all().find(|representation| representation.to_string() == id)
    }

    /// Whether it has I frames, which need no other frame.
    pub const fn is_intra(self) -> bool {
        matches!(self, Self::Spatial(_))
    }

    /// `I`, `P` or `B`.
    pub const fn frame_type(self) -> &'static str {
        match self {
            Self::Spatial(_) => "I",
            Self::Temporal(0) => "P",
            Self::Temporal(_) => "B",
        }
    }

    /// The name of its file.
    pub fn file_name(self) -> String {
        format!("{self}.mp4")
    }

    /// Every Representation that a stream may have.
    fn all() -> impl Iterator<Item = Self> {
        (0..MAX_LAYERS).map(Self::Spatial).chain((0..MAX_LAYERS).map(Self::Temporal))
    }

    /// Every Representation that a sequence may have.
    pub fn of_sequence(sequence: &SequenceParameters) -> impl Iterator<Item = Self> {
        let (spatial, temporal) = (sequence.spatial_layer_count, sequence.temporal_layer_count);
        Self::all().filter(move |representation| match representation {
            Self::Spatial(layer) => *layer < spatial,
            Self::Temporal(layer) => *layer < temporal,
        })
    }
}

/// `s0` is the base layer of the I frames, `t1` the first layer of temporal-enhancement frames.
impl fmt::Display for Representation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, layer) = self.codes();
        write!(formatter, "{}{layer}", if kind == 0 { 's' } else { 't' })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_codes_lead_back() {
        let mut before = None;
        for representation in Representation::all() {
            let (kind, layer) = representation.codes();
            assert_eq!(Representation::from_codes(kind, layer), Some(representation));
            assert_eq!(Representation::from_id(&representation.to_string()), Some(representation));
            assert!(before < Some(representation));
            before = Some(representation);
        }
        assert_eq!(Representation::from_codes(2, 0), None);
        assert_eq!(Representation::from_codes(0, 4), None);
        assert_eq!(Representation::from_id("s4"), None);
    }
}
