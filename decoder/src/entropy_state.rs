//! How the sections of a unit were decoded, as one number: two decoders that compare it unit by unit find the unit at which
//! they differ. Defined in `conformance/README.md`; no part of the decoding process, and nothing is computed unless
//! [`Options::entropy`](crate::process::Options::entropy) asks for it.

use crate::fault;
use crate::increment::values::UnitValues;
use splatstream_format::Result;
use splatstream_format::entropy::STATE_LOW;
use splatstream_format::payload::CodedSection;
use xxhash_rust::xxh64::Xxh64;

/// The entropy state of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnitEntropy {
    /// Absolute offset of the payload of the unit.
    pub payload_at: u64,
    /// XXH64 over the lanes and lengths of all blocks, and all values.
    pub state: u64,
}

/// The number of a unit from its sections, all of which were decoded; none if it has none.
///
/// # Errors
/// A fault: a block is longer than a section can say.
pub(crate) fn of_sections(sections: &[CodedSection<'_>], values: &UnitValues) -> Result<Option<u64>> {
    let mut hash = Xxh64::new(0);
    for coded in sections {
        add_blocks(&mut hash, coded.lanes_log2, &coded.blocks)?;
        let values = values.section(coded.section);
        // The plane of the position alphabet is the first.
        add_deltas(&mut hash, &values.deltas);
        values.planes.iter().for_each(|plane| add_values(&mut hash, plane));
    }
    Ok((!sections.is_empty()).then(|| hash.digest()))
}

/// The final states and the length of each block. A block of another final state is an error (8.4), so that those of a
/// decoded one need not be kept.
fn add_blocks(hash: &mut Xxh64, lanes_log2: u8, blocks: &[(&[u8], u64)]) -> Result<()> {
    // At most 2^5 (6.15).
    let lanes = 1_usize.wrapping_shl(lanes_log2.into());
    for (bytes, _) in blocks {
        (0..lanes).for_each(|_| hash.update(&STATE_LOW.to_le_bytes()));
        hash.update(&fault::count(bytes.len())?.to_le_bytes());
    }
    Ok(())
}

fn add_deltas(hash: &mut Xxh64, deltas: &[u64]) {
    deltas.iter().for_each(|delta| hash.update(&delta.to_le_bytes()));
}

fn add_values(hash: &mut Xxh64, values: &[i32]) {
    values.iter().for_each(|value| hash.update(&value.to_le_bytes()));
}
