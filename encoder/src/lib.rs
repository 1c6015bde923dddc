//! The SplatStream encoder (informative: any stream that the specification accepts is a stream).
//!
//! Read it from the top: [`encode`](fn@encode) in `stream` finds steps for the quality or the size that is asked for
//! (`target`), looks at every frame once (`sequence`), writes the beginning of the stream, its GOPs and its end
//! (`writer`). `gop` goes from frame to frame: each GOP gets its colour transforms and codebooks (`gop_tools`), each frame
//! (`frame`) its units, and each unit its sections (`section`, `models`, `blocks`). An I frame of one layer and a
//! predicted frame take the same way. Where that is asked for, the values of I frames are fitted to pictures (`finetune`).
//! The result is decoded and looked at (`verification`). Prediction, contexts and reconstruction are the decoder's own
//! functions. Same frames and settings, same bytes, on every machine and with any number of threads.
//!
//! Kernels of numbers index what they have counted themselves; each says at its head why that cannot fail.

// In tests, an overflow is a failed test.
#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects))]
#![deny(clippy::expect_used, clippy::indexing_slicing, clippy::panic, clippy::unwrap_used)]

mod allocation;
mod attribute;
mod blocks;
mod boundaries;
mod budget;
pub mod canonical;
mod checked;
mod clusters;
mod colour;
mod combination;
mod concat;
mod entropy_cost;
mod error;
mod finetune;
mod first_frame;
mod frame;
mod gop;
mod gop_tools;
mod grid;
mod importance;
mod isolated;
mod laws;
mod matching;
mod memory;
mod models;
mod motion;
mod parametric_fit;
mod pass;
mod pca;
mod plan;
mod progress;
mod prune;
mod push;
mod quantile;
mod quantised;
mod reach;
mod refinements;
mod report;
mod room;
mod savings;
mod secant;
mod section;
mod sensitivity;
mod sequence;
mod settings;
mod shape;
mod shard;
mod source;
mod spans;
mod steps;
mod stream;
mod strips;
mod target;
pub mod transformer;
mod upright;
mod value_digest;
mod verification;
mod vq;
mod window;
mod writer;

pub use attribute::Attribute;
pub use boundaries::refinements_by_slope;
pub use budget::{Effort, Work};
pub use concat::{ConcatError, Concatenated, PartError, StreamPart, concat};
pub use error::Error;
pub use finetune::{
    Finetune, FinetuneLoss, FinetuneProgress, FinetuneReport, FinetuneState, FinetuneWatch, Photograph,
    PointReport, PointWeight, StateError,
};
pub use frame::learning::{nearer, samples, train_network};
pub use frame::training_memory::bytes_of_samples;
pub use isolated::Isolated;
pub use laws::Laws;
pub use plan::{Plan, PlanRecord, PlannedSteps, PlannedTarget, Single};
pub use progress::Progress;
pub use push::Encoder;
pub use report::{
    Dropped, FrameReport, GopReport, PictureReport, Pruned, Report, TargetReport, VerifiedFrame,
};
pub use savings::{Basis, Saving, Tool};
pub use settings::{
    Anchor, Fidelity, Importance, NetworkSource, PredictorChoice, Predictors, Preset, Quality, Settings,
    ShChoice, Size, Structure, Tools,
};
pub use shard::Shard;
pub use source::FrameSource;
pub use steps::Steps;
pub use stream::{encode, plan};
pub use upright::up_of;
