//! Streams that were encoded a moment ago, decoded frame by frame.

use crate::Error;
use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::decode_stream_to;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;
use std::ops::ControlFlow;

/// Gives each frame of a stream to `take`, which gives back what it has made of it: a later frame is written to that memory.
///
/// # Errors
/// The first error of `take`, which ends decoding; otherwise that of the stream.
pub(crate) fn each_frame(
    memory: &FrameMemory,
    stream: &[u8],
    options: &Options,
    mut take: impl FnMut(&SequenceParameters, DecodedFrame) -> Result<GaussianFrame, Error>,
) -> Result<(), Error> {
    let mut failed = None;
    let summary =
        decode_stream_to(memory, stream, None, options, |sequence, frame| match take(sequence, frame) {
            Ok(gaussians) => {
                memory.recycle(gaussians);
                ControlFlow::Continue(())
            }
            Err(error) => {
                failed = Some(error);
                ControlFlow::Break(())
            }
        });
    failed.or_else(|| summary.verdict().map(Error::Stream)).map_or(Ok(()), Err)
}
