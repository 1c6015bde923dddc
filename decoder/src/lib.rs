//! Clause 7: the decoding process. Integers up to [`output`], so that every machine gives the same frame.
//!
//! | clause | module |
//! |---|---|
//! | 7.1, 9 state, phases, errors and losses | [`process`], [`stream`] |
//! | 7.2, 7.11 operating points, extraction | [`operating_point`] |
//! | 7.3 frames of a GOP | [`process`] |
//! | 7.4 lists, parents and modes | [`list`], [`increment`] |
//! | 7.5 cells | [`displacement`] |
//! | 7.4.3 moves | [`moves`] |
//! | 7.6 values | [`steps`], [`position`], [`colour`], [`increment::residual`] |
//! | 7.7 prediction | [`neighbours`], [`predictor`], [`transformer`], [`increment::prediction`] |
//! | 7.8 what is shown | [`process::DecodedFrame`] |
//! | 7.9 canonical planes and digests | [`frame`], [`digest`] |
//! | 7.10 output | [`output`] |
//! | 8.4 blocks | [`block`] |
//! | 8.5 contexts | [`context`] |
//!
//! This crate is for the encoder and for tools that look into streams: the encoder calls the same functions, and what it
//! reconstructs is what a decoder reconstructs. What they need is public and follows the text, so that it changes with it.
//! Programs that show streams use the crate `splatstream`.
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

mod attribute;
pub mod block;
mod budget;
mod buffers;
mod carried;
mod cell;
mod coded_block;
pub mod colour;
mod companding;
mod components;
pub mod context;
mod cores;
mod curve;
pub mod digest;
mod direct;
pub mod displacement;
mod entropy_state;
mod fault;
pub mod frame;
pub mod frame_memory;
mod frame_state;
mod gop;
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
mod stage;
pub mod steps;
pub mod stream;
pub mod transformer;
mod vector;
