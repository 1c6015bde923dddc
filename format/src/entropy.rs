//! Clause 8: entropy coding. What the reader and the writer of a block share stands here once.
//!
//! A value becomes a [token and raw bits](token); the token is coded by rANS with one of the static
//! [frequency tables](frequencies) of its plane's [model]; which table follows from the contexts of clause
//! 8.5. A [block](reader) holds the symbols of up to 2^16 Gaussians and decodes by itself.

pub mod frequencies;
pub mod in_force;
pub mod lanes;
pub mod layout;
pub mod machine;
pub mod model;
pub mod parametric;
pub mod reader;
pub(crate) mod section;
pub mod token;
pub mod writer;

mod axis;
mod symbol;

/// log2 of the sum of the frequencies of a table, clause 8.3.
pub const FREQUENCY_BITS: u32 = 12;
/// The sum of the frequencies of a table.
pub const FREQUENCY_SUM: u32 = 1 << FREQUENCY_BITS;
/// Lower bound of a rANS state, and its value before the first and after the last symbol, clause 8.4.
pub const STATE_LOW: u32 = 1 << 16;
/// The most rANS states of a block.
pub const MAX_LANES: usize = 32;
