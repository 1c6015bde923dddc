//! The SplatStream encoder (informative: any stream that the specification accepts is a stream).
//!
//! Two passes over the frames: [`sequence`] finds lattices and what the scene needs, then each GOP gets its
//! [colour](mod@colour) transforms and codebooks and each [frame](mod@frame) its units. Prediction, contexts and
//! reconstruction are the decoder's own functions. Same frames and settings, same bytes, on every machine
//! and with any number of threads.

mod allocation;
mod blocks;
pub mod canonical;
mod clusters;
mod colour;
mod dynamic;
mod entropy_cost;
mod error;
mod frame;
mod importance;
mod lattice;
mod matching;
mod models;
mod motion;
mod pca;
mod section;
mod sequence;
mod settings;
mod source;
mod stream;
pub mod transformer;
mod vq;

pub use dynamic::learning::{nearer, samples, train_network};
pub use error::Error;
pub use settings::{
    Fidelity, Importance, NetworkSource, PredictorChoice, Predictors, Preset, Quality, Settings, ShChoice,
    Steps, Structure, Tools,
};
pub use source::FrameSource;
pub use stream::{FrameReport, Progress, Report, encode};
