//! 5.10 index: where the GOPs start. It serves seeking; decoders may ignore it.

use super::{record_io, table};
use crate::Result;

table! {
    /// 5.10 — the fixed part of an index; the entries follow.
    "5.10" "6.10" index IndexHeader {
        /// entries, one for each GOP
        entry_count: u32,
    }
}

record_io!(IndexHeader);

table! {
    /// 5.10.1 — one entry of the index.
    "5.10.1" "6.10" index_entry IndexEntry {
        /// display index of the first frame of the GOP
        frame: u32,
        /// zero
        reserved_zero: u32,
        /// offset in the stream of the GOP's header unit
        offset: u64,
    }
}

record_io!(IndexEntry);

impl IndexHeader {
    /// 6.10: any number of entries.
    ///
    /// # Errors
    /// None: it is there so that all records are checked alike.
    pub fn validate(&self, _at: u64) -> Result<()> {
        Ok(())
    }
}

impl IndexEntry {
    /// 6.10.
    ///
    /// # Errors
    /// Unsupported: reserved bits are set.
    pub fn validate(&self, at: u64) -> Result<()> {
        Self::TABLE.check(at).reserved_bits("reserved_zero", 0, self.reserved_zero)
    }

    /// 6.10: frame and offset are greater than those of the entry before.
    ///
    /// # Errors
    /// Invalid: one of them is not.
    pub fn validate_after(&self, at: u64, before: &Self) -> Result<()> {
        let check = Self::TABLE.check(at);
        let least = |before: u64| before.saturating_add(1);
        let (frame, least_frame) = (u64::from(self.frame), least(before.frame.into()));
        check.equal("frame", frame, frame.max(least_frame))?;
        check.equal("offset", self.offset, self.offset.max(least(before.offset)))
    }
}
