//! Clause 7: the decoding process. Integers up to [`output`], so that every machine gives the same frame.
//!
//! | clause | module |
//! |---|---|
//! | 7.1, 9 state, phases, errors and losses | [`process`] |
//! | 7.2, 7.11 operating points, extraction | [`operating_point`] |
//! | 7.3 frames of a GOP | [`process`] |
//! | 7.4 lists, parents and modes | [`list`], [`increment`] |
//! | 7.5 cells | [`displacement`] |
//! | 7.4.3 moves | [`moves`] |
//! | 7.6 values | [`steps`], [`attribute`], [`position`], [`colour`], [`increment::residual`] |
//! | 7.7 prediction | [`neighbours`], [`predictor`], [`transformer`], [`increment::prediction`] |
//! | 7.8 what is shown | [`process::DecodedFrame`] |
//! | 7.9 canonical planes and digests | [`frame`], [`digest`] |
//! | 7.10 output | [`companding`], [`output`] |
//! | 8.5 contexts | [`context`] |
//!
//! The encoder calls the same functions: what it reconstructs is what a decoder reconstructs.
//!
//! ```
//! use splatstream_decoder::{output::to_gaussians, process::Options, stream::Frames};
//!
//! fn count(bytes: &[u8]) -> Result<usize, Box<dyn core::error::Error>> {
//!     let mut frames = Frames::open(bytes, &Options::default())?;
//!     let mut gaussians = 0;
//!     while let Some(frame) = frames.next_frame() {
//!         let Some(sequence) = frames.sequence() else { break };
//!         gaussians += to_gaussians(frame.into_shown(), sequence)?.len();
//!     }
//!     frames.summary().verdict().map_or(Ok(gaussians), |error| Err(error.into()))
//! }
//! ```
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
pub mod budget;
pub mod buffers;
mod carried;
pub mod cell;
pub mod coded_block;
pub mod colour;
pub mod companding;
mod components;
pub mod context;
mod cores;
mod curve;
pub mod digest;
mod direct;
pub mod displacement;
pub mod entropy_state;
mod fault;
pub mod frame;
mod frame_state;
pub mod gop;
pub mod increment;
pub mod interrupt;
pub mod list;
mod motion;
pub mod moves;
pub mod neighbours;
pub mod operating_point;
pub mod output;
pub mod position;
pub mod predictor;
pub mod process;
mod shift;
pub mod stage;
pub mod steps;
pub mod stream;
pub mod transformer;
mod vector;
