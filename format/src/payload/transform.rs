//! 5.7 transform: header, mean, basis.

use super::after_fixed_part;
use crate::syntax::{SequenceParameters, TransformHeader, after, encode};
use crate::{Error, ErrorKind, Result};

/// The largest magnitude of a mean, in units of step/64.
const MAX_MEAN: i32 = 1 << 30;
/// 1.0 in Q12, the largest magnitude of a basis weight.
const MAX_BASIS: i16 = 1 << 12;

/// A linear transform from `rank` coded components to `dimension` output integers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transform {
    /// The fixed part.
    pub header: TransformHeader,
    /// The output for components 0, in units of step/64; `dimension` of them.
    pub mean: Vec<i32>,
    /// Q12; index `k * dimension + j` is the weight of component k in output j.
    pub basis: Vec<i16>,
}

impl Transform {
    /// Reads and checks a payload that stands at offset `at`.
    ///
    /// # Errors
    /// Malformed: bytes are missing or left over. Unsupported: a reserved kind. Invalid: a value that clause
    /// 6.7 forbids in a stream of this sequence.
    pub fn parse(payload: &[u8], at: u64, sequence: &SequenceParameters) -> Result<Self> {
        let (header, rest) = TransformHeader::parse(payload, at, sequence)?;
        Self::parse_rest(header, rest, at)
    }

    /// Reads and checks `rest`, the bytes after a header that has been accepted. `at` is the offset of the
    /// payload, that is of the header.
    ///
    /// # Errors
    /// Malformed: bytes are missing or left over. Invalid: a number of the mean or the basis that clause 6.7
    /// forbids.
    pub fn parse_rest(header: TransformHeader, rest: &[u8], at: u64) -> Result<Self> {
        // At most 45 and 45 * 45.
        let (means, weights) = Self::lengths(&header);
        let mut reader = after_fixed_part(&TransformHeader::TABLE, rest, at);
        let mean = reader.take("mean", means.saturating_mul(size_of::<i32>()))?;
        let basis = reader.take("basis", weights.saturating_mul(size_of::<i16>()))?;
        reader.end()?;
        let mean = mean.as_chunks().0.iter().map(|value| i32::from_le_bytes(*value)).collect();
        let basis = basis.as_chunks().0.iter().map(|value| i16::from_le_bytes(*value)).collect();
        let transform = Self { header, mean, basis };
        transform.validate_values(at)?;
        Ok(transform)
    }

    /// The bytes of the payload; refused where [`Self::parse`] would refuse them. Offsets of errors count from
    /// the start of the payload.
    ///
    /// # Errors
    /// Unsupported or invalid as for [`Self::parse`].
    pub fn to_bytes(&self, sequence: &SequenceParameters) -> Result<Vec<u8>> {
        self.header.validate(0, sequence)?;
        self.validate_values(0)?;
        let mut bytes = encode(&self.header);
        bytes.extend(self.mean.iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend(self.basis.iter().flat_map(|value| value.to_le_bytes()));
        Ok(bytes)
    }

    /// The weights of each component in turn, `dimension` of them.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[i16]> {
        self.basis.chunks_exact(usize::from(self.header.dimension).max(1))
    }

    /// Numbers of the mean and of the basis.
    fn lengths(header: &TransformHeader) -> (usize, usize) {
        let dimension = usize::from(header.dimension);
        (dimension, dimension.saturating_mul(header.rank.into()))
    }

    /// 6.7, the ranges of `mean` and `basis`.
    fn validate_values(&self, at: u64) -> Result<()> {
        let refuse = |at, kind| Err(Error::new(at, TransformHeader::TABLE.semantics, kind));
        let (means, weights) = Self::lengths(&self.header);
        if (self.mean.len(), self.basis.len()) != (means, weights) {
            // Only a transform made by hand: the parser counts.
            return refuse(
                at,
                ErrorKind::Constraint { rule: "mean and basis are as long as the header says" },
            );
        }
        let mut at = after(at, TransformHeader::SIZE);
        for &mean in &self.mean {
            if !(-MAX_MEAN..=MAX_MEAN).contains(&mean) {
                return refuse(at, out_of_range("mean", mean.into(), MAX_MEAN.into()));
            }
            at = after(at, size_of::<i32>());
        }
        for &weight in &self.basis {
            if !(-MAX_BASIS..=MAX_BASIS).contains(&weight) {
                return refuse(at, out_of_range("basis", weight.into(), MAX_BASIS.into()));
            }
            at = after(at, size_of::<i16>());
        }
        Ok(())
    }
}

/// Outside `-max..=max`.
const fn out_of_range(element: &'static str, value: i64, max: i64) -> ErrorKind {
    ErrorKind::OutOfRange { element, value, min: max.saturating_neg(), max }
}
