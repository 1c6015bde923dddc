//! Annex A: how much a decoder agrees to hold. The only source of "how many at most".

use crate::{Error, ErrorKind, Result};

/// What one decoder accepts; a stream that asks for more is refused before anything is allocated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Gaussians in one frame.
    pub max_gaussians: u32,
    /// Gaussians in one second.
    pub max_gaussian_rate: u64,
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
        Self::of_level(3)
    }
}

impl Limits {
    /// New Gaussians of an increment for each byte of its payload, at most: an amplification that every level has.
    pub const NEW_PER_BYTE: u64 = 16;
    /// The levels of annex A.2.
    pub const LEVELS: core::ops::RangeInclusive<u8> = 1..=4;

    /// The limits of a level, table of annex A.2; those of level 4 for a level that is not defined.
    pub const fn of_level(level: u8) -> Self {
        let (max_gaussians, max_gaussian_rate, max_cells, max_codebook_values) = match level {
            1 => (1 << 18, 1 << 24, 1 << 16, 1 << 21),
            2 => (1 << 20, 1 << 26, 1 << 18, 1 << 22),
            3 => (1 << 22, 1 << 28, 1 << 20, 1 << 23),
            _ => (1 << 24, 1 << 30, 1 << 20, 1 << 23),
        };
        Self {
            max_gaussians,
            max_gaussian_rate,
            max_payload: 1 << 30,
            max_units: 1 << 24,
            max_codebook_values,
            max_cells,
            max_learned: max_gaussians / 2,
        }
    }

    /// The smaller of each two limits.
    #[must_use]
    pub fn at_most(self, other: Self) -> Self {
        Self {
            max_gaussians: self.max_gaussians.min(other.max_gaussians),
            max_gaussian_rate: self.max_gaussian_rate.min(other.max_gaussian_rate),
            max_payload: self.max_payload.min(other.max_payload),
            max_units: self.max_units.min(other.max_units),
            max_codebook_values: self.max_codebook_values.min(other.max_codebook_values),
            max_cells: self.max_cells.min(other.max_cells),
            max_learned: self.max_learned.min(other.max_learned),
        }
    }

    /// The lowest level that allows all that `asked` asks for, if there is one.
    pub fn lowest_level(asked: Self) -> Option<u8> {
        Self::LEVELS.into_iter().find(|&level| asked.at_most(Self::of_level(level)) == asked)
    }

    /// Refuses `asked` above `allowed`; `at` and `limit` go into the error.
    ///
    /// # Errors
    /// Over limit: `asked` is above `allowed`.
    pub fn check(at: u64, limit: &'static str, asked: u64, allowed: u64) -> Result<()> {
        if asked > allowed {
            return Err(Error::new(at, "A.2", ErrorKind::OverLimit { limit, asked, allowed }));
        }
        Ok(())
    }
}
