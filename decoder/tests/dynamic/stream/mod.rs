//! Streams of profile 1 made by hand, and what they shall decode to.
//!
//! A [`scene::Scene`] holds the values of GOPs, frames and increments, and becomes a script of units. Digests, counts
//! and expected frames follow from the clauses as [`cells`], [`gaussian`], [`prediction`], [`transformer`], [`frames`] and
//! [`shown`] write them down: Gaussian by Gaussian, sharing no code with the decoder.

pub(crate) mod cells;
pub(crate) mod draw;
pub(crate) mod expect;
pub(crate) mod frames;
pub(crate) mod gaussian;
pub(crate) mod network;
pub(crate) mod prediction;
pub(crate) mod sample;
pub(crate) mod scene;
mod script;
pub(crate) mod shown;
pub(crate) mod transformer;
