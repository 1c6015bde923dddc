//! The tools that are compared.

use super::attempt::Attempt;
use super::sample::Sample;
use super::{Warnings, ours, peers};
use splatstream_encoder::Report;

/// A codec and how it is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tool {
    /// This encoder with its defaults.
    SplatStream,
    /// The same, every frame by itself.
    AllIntra,
    /// SPZ, version 3.
    Spz,
    /// What SOG makes of the values, without its packing.
    Sog,
    /// `.splat`.
    Splat,
}

impl Tool {
    /// Those for scenes that stand still.
    pub(super) const OF_SCENES: [Self; 4] = [Self::SplatStream, Self::Spz, Self::Sog, Self::Splat];
    /// Those for sequences.
    pub(super) const OF_SEQUENCES: [Self; 2] = [Self::SplatStream, Self::AllIntra];
    /// All of them.
    pub(super) const ALL: [Self; 5] = [Self::SplatStream, Self::AllIntra, Self::Spz, Self::Sog, Self::Splat];

    /// What the page calls it.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::SplatStream => "SplatStream",
            Self::AllIntra => "all intra",
            Self::Spz => "SPZ",
            Self::Sog => "SOG",
            Self::Splat => ".splat",
        }
    }

    /// Its colour and mark in figures.
    pub(super) const fn style(self) -> usize {
        match self {
            Self::SplatStream => 0,
            Self::AllIntra => 1,
            Self::Spz => 2,
            Self::Sog => 3,
            Self::Splat => 4,
        }
    }

    /// Codes a sample and decodes it again. `plain` is the encoder's report on the base, to tell what is different.
    pub(super) fn attempt(self, sample: &Sample, plain: Option<&Report>, said: Warnings<'_>) -> Attempt {
        match self {
            Self::SplatStream => ours::attempt(sample, false, plain, said),
            Self::AllIntra => ours::attempt(sample, true, plain, said),
            Self::Spz => peers::attempt(sample, peers::spz),
            Self::Sog => peers::attempt(sample, peers::sog),
            Self::Splat => peers::attempt(sample, peers::splat),
        }
    }
}
