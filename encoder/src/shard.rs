//! What a shard says of itself: a unit of private data that stands before its first GOP.

use core::ops::Range;
use splatstream_format::syntax::UnitType;
use splatstream_format::unit::Unit;

/// The unit begins with this.
const MAGIC: [u8; 8] = *b"gssshard";

/// Which part of which sequence a stream is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shard {
    /// The digest of the [plan](crate::PlanRecord::digest).
    pub plan: u64,
    /// Its number and how many there are, counted from 1.
    pub shards: (u32, u32),
    /// Its frames in the sequence.
    pub frames: Range<u32>,
    /// Frames of the sequence.
    pub sequence_frames: u32,
}

impl Shard {
    /// The unit of private data that holds it.
    pub(crate) const UNIT_TYPE: UnitType = UnitType::User(0xd5);

    /// The payload of the unit.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let ((number, count), frames) = (self.shards, &self.frames);
        let numbers = [number, count, frames.start, frames.end, self.sequence_frames];
        let numbers = numbers.into_iter().flat_map(u32::to_le_bytes);
        MAGIC.into_iter().chain(self.plan.to_le_bytes()).chain(numbers).collect()
    }

    /// What a unit says; none if it says something else.
    pub(crate) fn of(unit: &Unit<'_>) -> Option<Self> {
        let is_shard = unit.header.unit_type() == Self::UNIT_TYPE;
        is_shard.then(|| Self::parse(unit.payload)).flatten()
    }

    fn parse(payload: &[u8]) -> Option<Self> {
        let (plan, numbers) = payload.strip_prefix(&MAGIC)?.split_first_chunk()?;
        let (numbers, rest) = numbers.as_chunks();
        let numbers: Vec<u32> = numbers.iter().copied().map(u32::from_le_bytes).collect();
        let &[number, count, start, end, sequence_frames] = numbers.as_slice() else { return None };
        let plan = u64::from_le_bytes(*plan);
        let shard = Self { plan, shards: (number, count), frames: start..end, sequence_frames };
        (rest.is_empty() && start < end && end <= sequence_frames).then_some(shard)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shard_reads_as_it_is_written() {
        let shard = Shard { plan: 7 << 40, shards: (2, 3), frames: 16..48, sequence_frames: 50 };
        let bytes = shard.to_bytes();
        assert_eq!(Shard::parse(&bytes), Some(shard));
        assert!((0..bytes.len()).all(|length| Shard::parse(&bytes[..length]).is_none()));
        assert!(Shard::parse(&[&bytes[..], &[0]].concat()).is_none());
    }
}
