//! SplatStream bitstream syntax: bytes to syntax elements and back.
//!
//! A stream is a [`FileHeader`](syntax::FileHeader) followed by units ([`mod@unit`], annex B). The payload of a
//! unit is a fixed record ([`syntax`], clause 5), and, where its extent depends on data, a division into
//! byte sections ([`payload`]). Inside the sections stand plane models and entropy-coded symbols
//! ([`entropy`], clause 8).
//!
//! No floating point, no I/O, no threads, and no allocation that [`Limits`] or the bytes present do not bound.
#![deny(
    clippy::arithmetic_side_effects,
    clippy::as_conversions,
    clippy::expect_used,
    clippy::float_arithmetic,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used
)]

#[cfg(feature = "arbitrary")]
pub mod arbitrary_stream;
pub mod bits;
pub mod entropy;
mod error;
pub mod follower;
pub mod inspect;
mod limits;
pub mod payload;
pub mod seek;
pub mod syntax;
pub mod unit;
pub mod unit_reader;

pub use error::{Class, Error, ErrorKind, Result};
pub use limits::Limits;
