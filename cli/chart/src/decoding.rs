//! Streams that were encoded a moment ago, decoded frame by frame.

use crate::Error;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_format::syntax::SequenceParameters;
use std::ops::ControlFlow;

/// Gives each frame of a stream to `take`.
///
/// # Errors
/// The first error of `take`, which ends decoding; otherwise that of the stream.
pub(crate) fn each_frame(
    stream: &[u8],
    options: &Options,
    mut take: impl FnMut(&SequenceParameters, DecodedFrame) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut failed = None;
    let summary = decode_stream(stream, options, |sequence, frame| match take(sequence, frame) {
        Ok(()) => ControlFlow::Continue(()),
        Err(error) => {
            failed = Some(error);
            ControlFlow::Break(())
        }
    });
    failed.or_else(|| summary.verdict().map(Error::Stream)).map_or(Ok(()), Err)
}
