//! The elements of 5.14 that say how spherical harmonics are coded.

use super::reader::Reader;
use super::{MAX_ID, Spot};
use crate::{Error, ErrorKind, Result};

/// An index of [`ShHeader::codebook_ids`] that is not used. It does not occur in a stream.
pub const NO_CODEBOOK: u8 = 255;

/// Stages of vector quantisation, at most.
const MAX_STAGES: u8 = 4;

/// How the spherical harmonics of the higher degrees are coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ShMode {
    /// 0, which is never written: not at all; they are zero.
    None,
    /// 1: one plane for each component of the transform.
    Coefficients,
    /// 2: one plane of codebook indices for each stage.
    VectorQuantised,
}

impl ShMode {
    /// The mode with a code.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::None),
            1 => Some(Self::Coefficients),
            2 => Some(Self::VectorQuantised),
            _ => None,
        }
    }

    /// The code of the mode.
    pub const fn code(self) -> u8 {
        match self {
            Self::None => 0,
            Self::Coefficients => 1,
            Self::VectorQuantised => 2,
        }
    }

    /// The name used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Coefficients => "coefficients",
            Self::VectorQuantised => "vector quantised",
        }
    }
}

/// How an increment codes its spherical harmonics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShHeader {
    /// 0 is none, 1 is coefficients, 2 is vector quantised.
    pub sh_mode: u8,
    /// Stages of vector quantisation; 0 unless `sh_mode` is 2.
    pub vq_stage_count: u8,
    /// Codebooks of the stages, 0 to 15; [`NO_CODEBOOK`] for a stage that is not used.
    pub codebook_ids: [u8; 4],
}

impl ShHeader {
    /// How the higher degrees are coded; `None` for a header that is refused.
    pub const fn mode(&self) -> Option<ShMode> {
        ShMode::from_code(self.sh_mode)
    }

    /// The codebooks of the stages in use.
    pub fn codebooks(&self) -> impl Iterator<Item = u8> + use<> {
        self.codebook_ids.into_iter().take(self.vq_stage_count.into())
    }

    /// Reads the elements; each is checked before it decides what follows.
    pub(super) fn read(reader: &mut Reader<'_, '_>) -> Result<Self> {
        let mut header = Self { sh_mode: 0, vq_stage_count: 0, codebook_ids: [NO_CODEBOOK; 4] };
        let spot = |at, element| Spot { at, clause: "6.14", element };
        let at = reader.at();
        header.sh_mode = reader.u8("sh_mode")?;
        validate_mode(header.sh_mode, spot(at, "sh_mode"))?;
        if header.mode() == Some(ShMode::VectorQuantised) {
            let at = reader.at();
            header.vq_stage_count = reader.u8("vq_stage_count")?;
            spot(at, "vq_stage_count").range(header.vq_stage_count, 1, MAX_STAGES)?;
            let ids = reader.take("codebook_ids", header.vq_stage_count.into())?;
            header.codebook_ids.iter_mut().zip(ids).for_each(|(slot, id)| *slot = *id);
        }
        Ok(header)
    }

    /// The bytes of the elements.
    pub(super) fn to_bytes(self) -> Vec<u8> {
        let mut bytes = vec![self.sh_mode];
        if self.mode() == Some(ShMode::VectorQuantised) {
            bytes.push(self.vq_stage_count);
            bytes.extend(self.codebooks());
        }
        bytes
    }

    /// 6.14: the ranges of the three elements; `spot` is where index `index` of an element stands.
    pub(super) fn validate(&self, spot: impl Fn(&'static str, usize) -> Spot) -> Result<()> {
        validate_mode(self.sh_mode, spot("sh_mode", 0))?;
        let vector_quantised = self.mode() == Some(ShMode::VectorQuantised);
        let (min, max) = if vector_quantised { (1, MAX_STAGES) } else { (0, 0) };
        spot("vq_stage_count", 0).range(self.vq_stage_count, min, max)?;
        for (index, id) in self.codebook_ids.into_iter().enumerate() {
            let used = index < usize::from(self.vq_stage_count);
            let (min, max) = if used { (0, MAX_ID) } else { (NO_CODEBOOK, NO_CODEBOOK) };
            spot("codebook_ids", index).range(id, min, max)?;
        }
        Ok(())
    }
}

/// 0 is what an absent element stands for, and codes above 2 are reserved.
fn validate_mode(sh_mode: u8, spot: Spot) -> Result<()> {
    let Spot { at, clause, element } = spot;
    if ShMode::from_code(sh_mode).is_none() {
        return Err(Error::new(at, clause, ErrorKind::Reserved { element, value: sh_mode.into() }));
    }
    spot.range(sh_mode, 1, ShMode::VectorQuantised.code())
}
