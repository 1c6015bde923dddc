//! 5.8 codebook: entries of one stage of vector-quantised colour.

use super::{MAX_ID, record_io, table};
use crate::{Limits, Result};

/// The largest rank of a transform: the planes of degree 3.
const MAX_RANK: u8 = 45;

table! {
    /// 5.8 — the fixed part of a codebook; the entries follow.
    "5.8" "6.8" codebook CodebookHeader {
        /// 0 to 15
        codebook_id: u8,
        /// values of an entry: the rank of the sh transform it is used with
        component_count: u8,
        /// entries, less one
        entry_count_minus1: u16,
        /// bytes of a value, 1 or 2
        value_bytes: u8,
    }
}

record_io!(CodebookHeader);

impl CodebookHeader {
    /// Entries, 1 to 65536.
    pub fn entry_count(&self) -> u32 {
        u32::from(self.entry_count_minus1).saturating_add(1)
    }

    /// Values of all entries together, at most 45 * 65536.
    pub fn value_count(&self) -> u32 {
        self.entry_count().saturating_mul(self.component_count.into())
    }

    /// 6.8.
    ///
    /// # Errors
    /// Invalid: an identifier, a number of components or a number of bytes outside its range.
    pub fn validate(&self, at: u64) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.range("codebook_id", self.codebook_id, 0, MAX_ID)?;
        check.range("component_count", self.component_count, 1, MAX_RANK)?;
        check.range("value_bytes", self.value_bytes, 1, 2)
    }

    /// A.2: the codebook is not larger than agreed.
    ///
    /// # Errors
    /// Over limit: more values than that.
    pub fn within(&self, at: u64, limits: &Limits) -> Result<()> {
        let at = Self::TABLE.check(at).offset("entry_count_minus1", 0);
        Limits::check(at, "max_codebook_values", self.value_count().into(), limits.max_codebook_values.into())
    }
}
