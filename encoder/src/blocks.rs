//! Codes blocks under models: clause 5.13.

use crate::error::Error;
use crate::models;
use rayon::prelude::*;
use splatstream_decoder::block::CodedBlock;
use splatstream_decoder::layout::PlaneInfo;
use splatstream_format::entropy::model::PlaneModel;
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};

/// The `lanes_log2` that suits blocks, and their bytes; one model a plane.
///
/// # Errors
/// A value that no token codes.
pub(crate) fn code_blocks(
    planes: &[PlaneInfo],
    models: &[PlaneModel],
    blocks: &[CodedBlock],
) -> Result<(u8, Vec<Vec<u8>>), Error> {
    let lanes_log2 = lanes_log2(blocks.iter().map(CodedBlock::len).max().unwrap_or(0));
    let encoders: Vec<PlaneEncoder> = models.iter().map(PlaneEncoder::new).collect();
    let code_block = |block: &CodedBlock| -> Result<Vec<u8>, Error> {
        let mut writer = BlockWriter::new(lanes_log2);
        for (plane, (&info, encoder)) in planes.iter().zip(&encoders).enumerate() {
            let contexts = models::contexts(&models[plane], info, plane, block);
            writer.plane(encoder, &contexts, models::unsigned_values(info, plane, block))?;
        }
        Ok(writer.finish())
    };
    let bytes: Vec<Vec<u8>> = blocks.par_iter().map(code_block).collect::<Result<_, Error>>()?;
    Ok((lanes_log2, bytes))
}

/// As many states as cost less than a tenth of a bit a Gaussian.
fn lanes_log2(block_gaussians: usize) -> u8 {
    (block_gaussians / 512).checked_ilog2().unwrap_or(0).min(5) as u8
}
