//! Features that a stream may use and a decoder may claim.

/// A tool of the bitstream, by the name that vectors and claims give it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Feature {
    /// Its name.
    pub name: &'static str,
    /// What a stream with it contains.
    pub meaning: &'static str,
    /// The clause to read.
    pub clause: &'static str,
}

/// All of them, in the order of `conformance/schema/vector.schema.json`.
pub const FEATURES: [Feature; 12] = [
    feature("predicted", "P or B frames", "7.3"),
    feature("b-frames", "B frames", "7.3.1"),
    feature("spatial-layers", "more than one spatial layer", "7.1.4"),
    feature("prefixes", "more than one refinement", "7.1.4"),
    feature("sh", "spherical harmonics", "7.6.5"),
    feature("vq", "codebooks", "6.8"),
    feature("cells", "cells that move and rotate parents", "7.5"),
    feature("carried", "carried lists that are shown", "7.8.1"),
    feature("learned", "prediction by a network", "7.7.6"),
    feature("full-attention", "a network with full attention", "7.7.6"),
    feature("several-gops", "more than one GOP", "6.5"),
    feature("subset", "points at which mode subset shows something else", "7.8.2"),
];

const fn feature(name: &'static str, meaning: &'static str, clause: &'static str) -> Feature {
    Feature { name, meaning, clause }
}

/// The names.
pub fn names() -> impl Iterator<Item = &'static str> {
    FEATURES.iter().map(|feature| feature.name)
}
