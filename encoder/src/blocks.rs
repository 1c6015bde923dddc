//! Codes blocks under models: clause 5.13.

use crate::error::Error;
use crate::models;
use rayon::prelude::*;
use splatstream_decoder::coded_block::CodedBlock;
use splatstream_decoder::layout::PlaneInfo;
use splatstream_format::entropy::model::PlaneModel;
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};

/// The bytes of blocks of 2^`lanes_log2` lanes; one model a plane.
///
/// # Errors
/// A value that no token codes.
pub(crate) fn code_blocks(
    planes: &[PlaneInfo],
    models: &[PlaneModel],
    blocks: &[CodedBlock],
    lanes_log2: u8,
) -> Result<Vec<Vec<u8>>, Error> {
    let encoders: Vec<PlaneEncoder> = models.iter().map(PlaneEncoder::new).collect();
    let code_block = |block: &CodedBlock| -> Result<Vec<u8>, Error> {
        let mut writer = BlockWriter::new(lanes_log2);
        for (plane, ((&info, model), encoder)) in planes.iter().zip(models).zip(&encoders).enumerate() {
            let contexts = models::contexts(model, info, plane, block);
            writer.plane(encoder, &contexts, models::unsigned_values(info, plane, block))?;
        }
        Ok(writer.finish())
    };
    blocks.par_iter().map(code_block).collect()
}

/// As many states as cost less than a tenth of a bit a Gaussian.
pub(crate) fn lanes_log2(block_gaussians: usize) -> u8 {
    (block_gaussians / 512).checked_ilog2().unwrap_or(0).min(5) as u8
}
