//! Clause 7: the decoding process. Integers up to [`output`], so that every machine gives the same frame.
//!
//! | clause | module |
//! |---|---|
//! | 7.1 state, order of units, lost units | [`process`] |
//! | 7.2 counts of a refinement | [`SequenceParameters`](splatstream_format::syntax::SequenceParameters) |
//! | 7.3 positions | [`position`] |
//! | 7.4 - 7.6 log-scales, opacity, rotation | [`attribute`] |
//! | 7.7, 7.8 colour | [`colour`] |
//! | 7.9 canonical planes and digest | [`frame`], [`digest`] |
//! | 7.10 output | [`output`] |
//! | 7.11, 7.19 operating points | [`operating_point`] |
//! | 7.14 homes and modes | [`home`], [`increment`] |
//! | 7.15 cells | [`displacement`] |
//! | 7.16 residuals | [`increment::residual`] |
//! | 7.17 prediction | [`neighbours`], [`predictor`], [`transformer`], [`increment::prediction`] |
//! | 7.18 carried Gaussians | [`frame_state`] |
//! | 8.5 contexts | [`context`] |
//!
//! The encoder calls the same functions: what it reconstructs is what a decoder reconstructs.
#![deny(
    clippy::arithmetic_side_effects,
    clippy::expect_used,
    clippy::float_arithmetic,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used
)]

pub use splatstream_format::entropy::layout;

pub mod attribute;
pub mod block;
pub mod colour;
pub mod context;
pub mod digest;
pub mod displacement;
pub mod entropy_state;
pub mod frame;
pub mod frame_state;
pub mod gop;
pub mod home;
pub mod increment;
mod motion;
pub mod neighbours;
pub mod operating_point;
pub mod output;
pub mod position;
pub mod predictor;
pub mod process;
pub mod stream;
pub mod transformer;
pub mod unit;
