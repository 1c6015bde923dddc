//! 5.11 end: the last unit, and with it the proof that nothing is missing.

use super::{record_io, table};
use crate::Result;

table! {
    /// 5.11 — the payload of the end unit.
    "5.11" "6.11" end EndOfStream {
        /// frames in the stream
        frame_count: u32,
        /// units before the end unit
        unit_count: u32,
        /// offset in the stream of the index unit; 0 is none
        index_offset: u64,
    }
}

record_io!(EndOfStream);

impl EndOfStream {
    /// 6.11, as far as it needs no other unit: any numbers.
    ///
    /// # Errors
    /// None: it is there so that all records are checked alike.
    pub fn validate(&self, _at: u64) -> Result<()> {
        Ok(())
    }

    /// 6.11: the numbers are those of the stream, which is `expected`.
    ///
    /// # Errors
    /// Invalid: a number is another.
    pub fn validate_against(&self, at: u64, expected: &Self) -> Result<()> {
        let check = Self::TABLE.check(at);
        check.equal("frame_count", self.frame_count.into(), expected.frame_count.into())?;
        check.equal("unit_count", self.unit_count.into(), expected.unit_count.into())?;
        check.equal("index_offset", self.index_offset, expected.index_offset)
    }
}
