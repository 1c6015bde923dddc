//! The first frame that a stream shows at an operating point.

use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_gaussians::{FrameError, GaussianFrame};
use std::ops::ControlFlow;

/// The first frame at an operating point, not that of `options`, of which something is shown; none if there is none.
///
/// # Errors
/// Planes that make no frame: the decoder is at fault.
pub fn first_frame(
    stream: &[u8],
    operating_point: OperatingPoint,
    options: &Options,
) -> Result<Option<GaussianFrame>, FrameError> {
    let options = Options { operating_point, ..*options };
    let mut first = None;
    let _faults = decode_stream(stream, &options, |sequence, frame| {
        if frame.is_lost {
            return ControlFlow::Continue(());
        }
        first = Some(to_gaussians(frame.into_shown(), sequence));
        ControlFlow::Break(())
    });
    first.transpose()
}
