//! How the command line spells the settings of the encoder.

use clap::ValueEnum;
use splatstream_decoder::predictor::Predictor;
use splatstream_encoder::{
    Anchor, Fidelity, Importance, PredictorChoice, Predictors, Preset, Quality, Settings, ShChoice,
};

/// How much to search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PresetName {
    /// One context per plane, no trials, no pictures for the order.
    Fast,
    /// Two contexts per plane, trials on samples, orders by pictures.
    Balanced,
    /// As balanced, with an order that is weighed again more often, and values of single frames that are fitted to pictures: --finetune 20.
    Small,
}

/// How close pictures are to those of the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum QualityName {
    /// 40 dB: visible loss.
    Low,
    /// 45 dB: loss visible side by side.
    Medium,
    /// 50 dB: loss hard to see.
    High,
    /// 57 dB: no visible loss.
    VisuallyLossless,
}

/// How spherical harmonics are coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ShName {
    /// Whichever costs less on the scene.
    Auto,
    /// Transform coefficients.
    Coefficients,
    /// Vector quantisation.
    Vq,
}

/// What new Gaussians of predicted frames and of higher spatial layers are predicted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PredictorName {
    /// Whatever saves bits: none, knn, bilateral or transformer.
    Auto,
    /// Not at all.
    None,
    /// By neighbours, weighted by distance, where that saves bits.
    Knn,
    /// By neighbours, weighted by distance and likeness, where that saves bits.
    Bilateral,
    /// By a network, where that saves bits.
    Transformer,
}

impl From<PredictorName> for Predictors {
    fn from(name: PredictorName) -> Self {
        match name {
            PredictorName::Auto => Self::ALL,
            PredictorName::None => Self::NONE,
            PredictorName::Knn => Self::one(Predictor::Knn),
            PredictorName::Bilateral => Self::one(Predictor::Bilateral),
            PredictorName::Transformer => Self::one(Predictor::Transformer),
        }
    }
}

/// How a predictor is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PredictorChoiceName {
    /// By estimated bits, for runs of Gaussians.
    Bits,
    /// By the smallest sum of residuals, for each Gaussian: the paper's choice.
    L1,
}

impl From<PredictorChoiceName> for PredictorChoice {
    fn from(name: PredictorChoiceName) -> Self {
        match name {
            PredictorChoiceName::Bits => Self::Bits,
            PredictorChoiceName::L1 => Self::Difference,
        }
    }
}

/// What predicted frames of untracked sequences are true to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum FidelityName {
    /// The pictures: what they do not need is not sent.
    Pictures,
    /// The attributes: every difference of a step is sent.
    Attributes,
}

/// What of the I frame of a predicted GOP the first refinements hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum AnchorName {
    /// The same refinements as of every other frame.
    Nested,
    /// All of it, with all spatial layers.
    Whole,
}

/// What puts Gaussians into the first refinements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ImportanceName {
    /// What pictures gain by a Gaussian and lose without it, weighed again as others go.
    Removal,
    /// Transmittance times alpha over the pixels of all views.
    Contribution,
    /// Opacity, the pixels covered and an estimate of the light that reaches it, mean of all views, weighed again as neighbours go; needs no pictures.
    Footprint,
    /// Opacity times volume; needs no views.
    Volume,
}

/// A tool of the encoder that can be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ToolName {
    /// Tables chosen by what has been decoded already.
    Contexts,
    /// Axes sorted by size.
    AxisSort,
    /// Principal components of spherical harmonics.
    ShTransform,
    /// Tables taken over from the refinement before.
    TableReuse,
    /// Steps that follow from size, opacity, shape and importance.
    AdaptiveSteps,
    /// Cells that move what is in them, in predicted frames.
    CellMotion,
    /// Gaussians that continue those of the reference, in predicted frames.
    Survivors,
    /// Leaving out Gaussians that can never be seen.
    Prune,
    /// Importance measured in views; without it, opacity times volume.
    ViewImportance,
}

impl ToolName {
    /// Settings without the tool.
    pub(crate) fn leave_out_of(self, settings: &mut Settings) {
        match self {
            Self::Contexts => settings.tools.contexts = false,
            Self::AxisSort => settings.tools.axis_sort = false,
            Self::ShTransform => settings.tools.sh_transform = false,
            Self::TableReuse => settings.tools.table_reuse = false,
            Self::AdaptiveSteps => settings.tools.adaptive_steps = false,
            Self::CellMotion => settings.tools.cell_motion = false,
            Self::Survivors => settings.tools.survivors = false,
            Self::Prune => settings.keep_invisible = true,
            Self::ViewImportance => settings.importance = Some(Importance::Volume),
        }
    }
}

/// A choice as the command line spells it.
pub(crate) fn spelled(choice: impl ValueEnum) -> String {
    choice.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Fast => Self::Fast,
            PresetName::Balanced => Self::Balanced,
            PresetName::Small => Self::Small,
        }
    }
}

impl From<Preset> for PresetName {
    fn from(preset: Preset) -> Self {
        match preset {
            Preset::Fast => Self::Fast,
            Preset::Balanced => Self::Balanced,
            Preset::Small => Self::Small,
        }
    }
}

impl From<QualityName> for Quality {
    fn from(name: QualityName) -> Self {
        match name {
            QualityName::Low => Self::Low,
            QualityName::Medium => Self::Medium,
            QualityName::High => Self::High,
            QualityName::VisuallyLossless => Self::VisuallyLossless,
        }
    }
}

impl From<ShName> for ShChoice {
    fn from(name: ShName) -> Self {
        match name {
            ShName::Auto => Self::Auto,
            ShName::Coefficients => Self::Coefficients,
            ShName::Vq => Self::VectorQuantised,
        }
    }
}

impl From<AnchorName> for Anchor {
    fn from(name: AnchorName) -> Self {
        match name {
            AnchorName::Nested => Self::Nested,
            AnchorName::Whole => Self::Whole,
        }
    }
}

impl From<FidelityName> for Fidelity {
    fn from(name: FidelityName) -> Self {
        match name {
            FidelityName::Pictures => Self::Pictures,
            FidelityName::Attributes => Self::Attributes,
        }
    }
}

impl From<ImportanceName> for Importance {
    fn from(name: ImportanceName) -> Self {
        match name {
            ImportanceName::Removal => Self::Removal,
            ImportanceName::Contribution => Self::Contribution,
            ImportanceName::Footprint => Self::Footprint,
            ImportanceName::Volume => Self::Volume,
        }
    }
}
