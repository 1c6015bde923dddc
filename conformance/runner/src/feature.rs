//! What a stream can make use of and a decoder can claim.

/// A tool of the bitstream, by the name that vectors and claims give it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Feature {
    /// Its name.
    pub name: &'static str,
    /// What a stream with it has.
    pub meaning: &'static str,
    /// What to read.
    pub clause: &'static str,
}

/// All of them, in the order of `conformance/schema/vector.schema.json`.
pub const FEATURES: [Feature; 12] = [
    feature("predicted", "P or B frames", "7.13"),
    feature("b-frames", "B frames", "7.13.1"),
    feature("spatial-layers", "more than one spatial layer", "7.13.3"),
    feature("prefixes", "more than one refinement", "7.2"),
    feature("sh", "spherical harmonics", "7.8"),
    feature("vq", "codebooks", "6.8"),
    feature("cells", "cells that move or turn parents", "7.15"),
    feature("carried", "Gaussians carried over from another frame", "7.18.1"),
    feature("learned", "a network that predicts", "7.17.6"),
    feature("full-attention", "a network with full attention", "7.17.6"),
    feature("several-gops", "more than one GOP", "6.5"),
    feature("subset", "points at which the mode makes a difference", "7.18.2"),
];

const fn feature(name: &'static str, meaning: &'static str, clause: &'static str) -> Feature {
    Feature { name, meaning, clause }
}

/// The names.
pub fn names() -> impl Iterator<Item = &'static str> {
    FEATURES.iter().map(|feature| feature.name)
}
