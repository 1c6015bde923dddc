//! What a user asks for: quality, effort, layers.

use crate::finetune::request::Finetune;
use crate::frame::ladder::Ladder;
use crate::laws::Laws;
use crate::steps::Steps;
use crate::transformer::Architecture;
use splatstream_decoder::predictor::Predictor;
use splatstream_format::payload::{Network, SceneDescription};
use splatstream_format::syntax::Profile;
use splatstream_render::Camera;

/// How much is searched. [`Settings::of`] has everything that a preset stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// One context source a plane, no trial of vector quantisation.
    Fast,
    /// Two context sources a plane; vector quantisation is tried on a sample.
    #[default]
    Balanced,
    /// As balanced, with every source tried for both axes, and Gaussians weighed again whenever a quarter of them have gone.
    Small,
}

/// How close the pictures of the decoded scene are to those of the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quality {
    /// Visible loss in still comparison: 40 dB.
    Low,
    /// Loss visible side by side: 45 dB.
    Medium,
    /// Loss hard to see: 50 dB.
    #[default]
    High,
    /// No visible loss: 57 dB.
    VisuallyLossless,
}

impl Quality {
    /// All of them, coarsest first.
    pub const ALL: [Self; 4] = [Self::Low, Self::Medium, Self::High, Self::VisuallyLossless];

    /// Its name in reports and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::VisuallyLossless => "visually-lossless",
        }
    }

    /// The PSNR of pictures that a quality stands for, decibels.
    pub const fn decibels(self) -> f32 {
        match self {
            Self::Low => 40.0,
            Self::Medium => 45.0,
            Self::High => 50.0,
            Self::VisuallyLossless => 57.0,
        }
    }

    /// Steps that give about this quality on an average scene: those from which a [fit](Settings::psnr) starts.
    pub fn steps(self) -> Steps {
        Steps::about(self.decibels())
    }
}

/// How SH is coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ShChoice {
    /// Whichever has the lower rate-distortion cost on a sample of the scene.
    #[default]
    Auto,
    /// Transform coefficients.
    Coefficients,
    /// Vector quantisation of the transform coefficients.
    VectorQuantised,
}

/// What puts Gaussians into the first refinements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Importance {
    /// The geometric mean of contribution and of what the pictures lose without a Gaussian. Gaussians go one after the other,
    /// the least first; what is lost without one rises as its neighbours go, and all that are left are weighed again whenever
    /// about half of them have gone.
    Removal,
    /// Transmittance times alpha, summed over the pixels of all views.
    Contribution,
    /// Opacity and the pixels that a Gaussian covers, means of the views, as far as those before it let light through, which is
    /// estimated. No picture is drawn.
    Footprint,
    /// Opacity times volume: the paper's, and the only one that needs no views.
    Volume,
}

/// What frames refer to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Structure {
    /// To nothing: every frame is an intra frame.
    #[default]
    Intra,
    /// To earlier frames of the GOP, with this many temporal layers, 1 to 4: 1 is I P P P, 2 is I B P B P, more are
    /// dyadic.
    Predicted {
        /// Temporal layers.
        layers: u8,
    },
}

/// What of the I frame of a predicted GOP those receive who take some of the refinements only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Anchor {
    /// The same refinements as of every other frame.
    #[default]
    Nested,
    /// All of it, with all spatial layers: the paper's anchor.
    Whole,
}

/// Neighbours of a prediction, unless others are asked for.
const NEIGHBOURS: u8 = 8;

/// The predictors that new Gaussians may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Predictors {
    /// By code.
    allowed: [bool; 4],
}

impl Predictors {
    /// Every one; the transformer where there is a network.
    pub const ALL: Self = Self { allowed: [true; 4] };
    /// New Gaussians are not predicted.
    pub const NONE: Self = Self { allowed: [true, false, false, false] };

    /// One, and none where that is better.
    pub fn one(predictor: Predictor) -> Self {
        Self { allowed: Predictor::ALL.map(|other| other == predictor || other == Predictor::None) }
    }

    /// One for every new Gaussian for which there is something to predict from, whether it pays or not.
    pub fn always(predictor: Predictor) -> Self {
        Self { allowed: Predictor::ALL.map(|other| other == predictor) }
    }

    /// Those of both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self { allowed: Predictor::ALL.map(|predictor| self.allows(predictor) || other.allows(predictor)) }
    }

    /// Whether new Gaussians may take a predictor.
    pub fn allows(self, predictor: Predictor) -> bool {
        let [none, knn, bilateral, transformer] = self.allowed;
        match predictor {
            Predictor::None => none,
            Predictor::Knn => knn,
            Predictor::Bilateral => bilateral,
            Predictor::Transformer => transformer,
        }
    }
}

/// Where the network of the learned predictor comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum NetworkSource {
    /// The registered one, of which a stream has the name only.
    Registered,
    /// Trained on the sequence, on the base that is nearer to its colours, and carried.
    Fitted,
    /// The same of an architecture.
    Trained(Architecture),
    /// Given, and carried.
    Given(Box<Network>),
}

/// What predicted frames are true to where no row of a file keeps its meaning. Sequences of which some rows do are
/// always true to their attributes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fidelity {
    /// To the pictures: a difference is sent where they need it, so that they are no more than [`Settings::tolerance`]
    /// below what they would be if every difference were sent. Everything else is carried over from the reference.
    Pictures,
    /// To the attributes: what differs from the reference by more than a step is sent.
    Attributes,
}

/// How the predictor of new Gaussians is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PredictorChoice {
    /// By estimated bits, for runs of Gaussians, where prediction pays at all.
    #[default]
    Bits,
    /// By the sum of absolute residuals, for each Gaussian: the paper's.
    Difference,
}

/// How large a stream shall be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// So many bits for each Gaussian that is coded, everything counted; above 0.
    BitsPerGaussian(f64),
    /// A stream of so many bytes.
    Bytes(u64),
}

/// Tools that can be left out, to see what each is worth. Streams are valid with any of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tools {
    /// Tables chosen by what has been decoded; without them each plane of a unit has one table.
    pub contexts: bool,
    /// Axes sorted by size where that is cheaper; without it they stay as they come.
    pub axis_sort: bool,
    /// Principal components of spherical harmonics; without them components are the coefficients.
    pub sh_transform: bool,
    /// Plane models taken over from the refinement before; without it each refinement carries its own.
    pub table_reuse: bool,
    /// Steps that follow from the size, the opacity, the shape and the importance of a Gaussian, where they are fitted to
    /// a PSNR; without it all Gaussians have the same.
    pub adaptive_steps: bool,
    /// Predicted frames: cells that move what is in them; without it only residuals move Gaussians.
    pub cell_motion: bool,
    /// Predicted frames: Gaussians continue those of the reference; without it every Gaussian is new.
    pub survivors: bool,
}

impl Default for Tools {
    fn default() -> Self {
        Self {
            contexts: true,
            axis_sort: true,
            sh_transform: true,
            table_reuse: true,
            adaptive_steps: true,
            cell_motion: true,
            survivors: true,
        }
    }
}

/// Frames of a predicted GOP, at most (6.5).
const MAX_PREDICTED_FRAMES: u32 = 1024;

/// Everything a user may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// How much is searched.
    pub preset: Preset,
    /// Quantiser steps.
    pub steps: Steps,
    /// How steps follow from what is known of a Gaussian.
    pub laws: Laws,
    /// Fit steps and laws to the first frame, so that pictures have this PSNR in views that decide nothing else,
    /// decibels; 20 to 90.
    pub psnr: Option<f32>,
    /// Fit the steps so that the stream has this size, to 3 %; `psnr` is not looked at then.
    pub size: Option<Size>,
    /// Decode some of the stream and compare its pictures with those of the source. Where `psnr` or `size` is given that
    /// is done in any case.
    pub verify: bool,
    /// Leave out Gaussians with values that are not finite; otherwise they are an error.
    pub drop_invalid: bool,
    /// Frames in a GOP.
    pub gop: u32,
    /// What the frames of a GOP refer to.
    pub structure: Structure,
    /// What of I frames belongs to the first refinements of predicted GOPs.
    pub anchor: Anchor,
    /// Spatial layers, 1 to 4.
    pub spatial_layers: u8,
    /// How new Gaussians are predicted, where frames refer to others or there are spatial layers.
    pub predictors: Predictors,
    /// How a predictor is chosen among them.
    pub predictor_choice: PredictorChoice,
    /// Neighbours of a prediction, 1 to 16.
    pub neighbours: u8,
    /// Where the network comes from; none: it is trained where no other predictor is allowed, else there is none.
    pub network: Option<NetworkSource>,
    /// Refinement percentages, increasing, the last 100; at most 10.
    pub refinements: Vec<u8>,
    /// Highest SH degree kept; none keeps what the scene needs.
    pub sh_degree: Option<u8>,
    /// How SH is coded.
    pub sh: ShChoice,
    /// Keep Gaussians whose opacity is below 1/255 everywhere.
    pub keep_invisible: bool,
    /// Leave out the Gaussians that pictures miss least, as many as can go until pictures without them fall to this PSNR against
    /// pictures with them, decibels, 20 to 90, in the worst of some views that look at the scene from near and far. Only of
    /// frames that each stand for themselves. `psnr` is still that of all that is coded against the whole source.
    pub prune: Option<f32>,
    /// What puts Gaussians into the first refinements; none: footprint for the fast preset, removal for others.
    pub importance: Option<Importance>,
    /// The views that importance and pictures are measured in; none: made for the first frame, all around.
    pub cameras: Vec<Camera>,
    /// What predicted frames are true to; none: attributes for the fast preset, pictures for others.
    pub fidelity: Option<Fidelity>,
    /// How far the pictures of a frame that is true to them may be below what they would be if every difference were
    /// sent, which is what the steps of the quality give: decibels above 0, mean of the views, against the source.
    pub tolerance: f32,
    /// Fit the values of I frames to pictures; none: each is the nearest to that of the source.
    pub finetune: Option<Finetune>,
    /// Tools that may be used.
    pub tools: Tools,
    /// log2 of the Gaussians in an entropy block.
    pub block_log2: u8,
    /// Memory that GOPs coded at the same time may take together, bytes, as far as it can be estimated; one GOP at a
    /// time takes what it takes. The stream is the same whatever stands here.
    pub gop_memory: u64,
    /// Most memory that encoding may take at the same time, bytes, beside what a source of frames keeps for itself: frames that
    /// take [more](Settings::memory) are [refused](crate::Error::OverMemory) before any of it is taken. With little, fewer GOPs
    /// are coded at once. Default: no bound, for a caller's own frames; who encodes what strangers send gives one. The stream is
    /// the same whatever stands here.
    pub max_memory: u64,
    /// Ticks in a second, and from one frame to the next.
    pub ticks: (u32, u32),
    /// What the stream says about its scene. The bounds are those of the Gaussians, whatever stands here.
    pub description: SceneDescription,
}

/// Iterations of fitting values to pictures that the small preset takes.
const ITERATIONS_OF_SMALL: u32 = 20;

impl Settings {
    /// Everything that a preset stands for: how much is searched, and for the small one
    /// [fitting to pictures](Settings::finetune), which takes most of its time and gains most of what it gains.
    pub fn of(preset: Preset) -> Self {
        let finetune = match preset {
            Preset::Fast | Preset::Balanced => None,
            Preset::Small => Some(Finetune { iterations: ITERATIONS_OF_SMALL, ..Finetune::default() }),
        };
        Self { preset, finetune, ..Self::default() }
    }

    /// What predicted frames are true to.
    pub(crate) fn fidelity(&self) -> Fidelity {
        self.fidelity.unwrap_or(match self.preset {
            Preset::Fast => Fidelity::Attributes,
            Preset::Balanced | Preset::Small => Fidelity::Pictures,
        })
    }

    /// Whether steps are found for what is asked for.
    pub(crate) fn has_target(&self) -> bool {
        self.psnr.is_some() || self.size.is_some()
    }

    /// Whether frames may refer to others.
    pub(crate) fn may_predict(&self) -> bool {
        self.temporal_layers() > 0 && self.tools.survivors
    }

    /// The profile that the layers and the structure take.
    pub(crate) fn profile(&self) -> Profile {
        match (self.structure, self.spatial_layers) {
            (Structure::Intra, 1) => Profile::Intra,
            _ => Profile::Dynamic,
        }
    }

    /// The same for frames that each stand for themselves, in one layer.
    pub(crate) fn alone(self) -> Self {
        Self { structure: Structure::Intra, spatial_layers: 1, ..self }
    }

    /// Temporal layers; 0 where no frame refers to another.
    pub(crate) fn temporal_layers(&self) -> u8 {
        match self.structure {
            Structure::Intra => 0,
            Structure::Predicted { layers } => layers,
        }
    }

    /// Spatial layers of the stream: no more than have something to add.
    pub fn spatial_layer_count(&self) -> u8 {
        self.spatial_layers.min(Ladder::most_layers(self.refinements.len()))
    }

    /// Frames of a GOP, at most. GOPs begin at multiples of it, and where a frame has too little in common with the one
    /// before.
    pub fn gop_length(&self) -> u32 {
        self.gop.min(if self.temporal_layers() > 0 { MAX_PREDICTED_FRAMES } else { u32::MAX })
    }

    /// Whether predicted GOPs have whole anchors.
    pub(crate) fn whole_anchor(&self) -> bool {
        self.anchor == Anchor::Whole && self.structure != Structure::Intra
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            preset: Preset::default(),
            steps: Quality::default().steps(),
            laws: Laws::default(),
            psnr: None,
            size: None,
            verify: false,
            drop_invalid: false,
            gop: 16,
            structure: Structure::default(),
            anchor: Anchor::default(),
            spatial_layers: 1,
            predictors: Predictors::ALL,
            predictor_choice: PredictorChoice::default(),
            neighbours: NEIGHBOURS,
            network: None,
            refinements: vec![10, 20, 30, 50, 100],
            sh_degree: None,
            sh: ShChoice::default(),
            keep_invisible: false,
            prune: None,
            importance: None,
            cameras: Vec::new(),
            fidelity: None,
            tolerance: 0.3,
            finetune: None,
            tools: Tools::default(),
            block_log2: 14,
            gop_memory: 2 << 30,
            max_memory: u64::MAX,
            ticks: (30, 1),
            description: SceneDescription::default(),
        }
    }
}
