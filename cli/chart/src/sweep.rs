//! What is swept: variants of the encoder's settings, each at every quality.
//!
//! A variant is a name, settings and a group. All of them code every frame by itself; what predicted frames gain is
//! measured apart, on the first GOP of a sequence. What takes another time, presets and fitting to pictures, stands on the
//! front of speed and size, at the quality of comparison only.

use splatstream_encoder::{Quality, Settings};

/// What variants have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// What all others are compared with.
    Baseline,
    /// Another preset.
    Preset,
    /// The baseline, with values that are fitted to pictures.
    Fitted,
    /// The baseline less a tool.
    Without,
    /// The baseline with a choice made for it.
    Chosen,
}

impl Group {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Preset => "preset",
            Self::Fitted => "fitted",
            Self::Without => "without",
            Self::Chosen => "chosen",
        }
    }
}

/// Settings under a name.
#[derive(Debug, Clone)]
pub struct Variant {
    /// What the page calls it.
    pub name: String,
    /// What it is one of.
    pub group: Group,
    /// Whether it orders Gaussians otherwise than the baseline: then refinement levels differ too.
    pub reorders: bool,
    /// The settings; the quality comes from the sweep.
    pub settings: Settings,
}

impl Variant {
    /// The settings at a quality: fitted to the scene, as `encode` does.
    pub fn at(&self, quality: Quality) -> Settings {
        Settings { steps: quality.steps(), ..self.at_decibels(quality.decibels()) }
    }

    /// The settings for a PSNR.
    pub(crate) fn at_decibels(&self, decibels: f32) -> Settings {
        Settings { psnr: Some(decibels), ..self.settings.clone() }
    }
}

/// All variants, the baseline first, and the qualities of each.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// The variants.
    pub variants: Vec<Variant>,
    /// The qualities, coarsest first.
    pub qualities: Vec<Quality>,
    /// Shares up to each refinement, percent.
    pub refinements: Vec<u8>,
    /// Times that runs at the [quality of comparison](Self::quality) are timed; others are timed once.
    pub repeat: u32,
    /// What stands on the front of speed and size: the baseline, other presets, and fitting to pictures.
    pub efforts: Vec<Variant>,
    /// Whether choices that decoders feel stand there too: tools left out, codebooks, refinements, predictors.
    pub choices: bool,
}

impl Sweep {
    /// The quality at which variants are compared: high, or the finest of the sweep.
    pub fn quality(&self) -> Quality {
        let high = self.qualities.iter().copied().find(|&quality| quality == Quality::High);
        high.or(self.qualities.last().copied()).unwrap_or(Quality::High)
    }

    /// Times that a run at a quality is timed: only where variants are compared do speeds stand side by side.
    pub fn repeats(&self, quality: Quality) -> u32 {
        if quality == self.quality() { self.repeat } else { 1 }
    }

    /// The baseline at the quality of comparison.
    pub fn headline(&self) -> Settings {
        self.variants.first().map_or_else(Settings::default, |variant| variant.at(self.quality()))
    }

    /// Operating points of a run that are looked at: every refinement level where the curve over them is drawn.
    pub fn points(&self, variant: &Variant, quality: Quality) -> usize {
        let all = variant.group == Group::Baseline || variant.reorders && quality == self.quality();
        if all { self.refinements.len() } else { 1 }
    }

    /// Pairs of a variant and a quality.
    pub fn runs(&self) -> impl Iterator<Item = (&Variant, Quality)> {
        self.variants.iter().flat_map(|variant| self.qualities.iter().map(move |&quality| (variant, quality)))
    }
}
