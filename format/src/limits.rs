//! Annex A: how much a decoder agrees to hold. The only source of "how many at most".

use crate::{Error, ErrorKind, Result};

/// What one decoder accepts; a stream that asks for more is refused before anything is allocated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Gaussians in one frame.
    pub max_gaussians: u32,
    /// Bytes in the payload of one unit.
    pub max_payload: u32,
    /// Units in one stream.
    pub max_units: u32,
    /// Values (entries times components) held by the codebooks of one GOP.
    pub max_codebook_values: u32,
    /// Cells that a predicted frame moves.
    pub max_cells: u32,
    /// New Gaussians of an increment that the network predicts.
    pub max_learned: u32,
}

impl Default for Limits {
    /// The limits of level 3, annex A.
    fn default() -> Self {
        Self {
            max_gaussians: 1 << 22,
            max_payload: 1 << 30,
            max_units: 1 << 24,
            max_codebook_values: 1 << 23,
            max_cells: 1 << 20,
            max_learned: 1 << 21,
        }
    }
}

impl Limits {
    /// Gaussians of a frame that a level allows, table of annex A.2; 0 for a level that is not defined.
    pub const fn gaussians_of_level(level: u8) -> u32 {
        match level {
            1 => 1 << 18,
            2 => 1 << 20,
            3 => 1 << 22,
            4 => 1 << 24,
            _ => 0,
        }
    }

    /// New Gaussians of an increment that the network predicts that a level allows, table of annex A.2.
    pub const fn learned_of_level(level: u8) -> u32 {
        Self::gaussians_of_level(level) / 2
    }

    /// The lowest level that allows frames of `gaussians`.
    pub fn level_of(gaussians: u32) -> Option<u8> {
        (1..=4).find(|&level| gaussians <= Self::gaussians_of_level(level))
    }

    /// Refuses `asked` above `allowed`; `at` and `limit` go into the error.
    pub fn check(at: u64, limit: &'static str, asked: u64, allowed: u64) -> Result<()> {
        if asked > allowed {
            return Err(Error::new(at, "A.2", ErrorKind::OverLimit { limit, asked, allowed }));
        }
        Ok(())
    }
}
