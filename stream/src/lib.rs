//! Streaming of SplatStream: packages for DASH and back, and the control of adaptive players.
//!
//! Nothing here decodes: units are divided, ordered and described as the unit reader of `splatstream-format` gives them.
#![deny(
    clippy::arithmetic_side_effects,
    clippy::as_conversions,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used
)]

mod boxes;
#[cfg(feature = "client")]
pub mod client;
pub mod control;
pub mod division;
pub mod ending;
pub mod live;
pub mod manifest;
pub mod mpd;
pub mod package;
pub mod playback;
pub mod qoe;
mod representation;
pub mod segments;
#[cfg(feature = "server")]
pub mod server;
pub mod simulation;
pub mod structure;
pub mod unpackage;

pub use representation::Representation;
