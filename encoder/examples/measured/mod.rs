//! What the programs of this folder measure with: seconds of some work, and decoding as a player does it.

use splatstream_decoder::frame_memory::FrameMemory;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream_to;
use std::hint::black_box;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

pub(crate) type Result<T> = core::result::Result<T, Box<dyn std::error::Error>>;

/// What some work took.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seconds {
    /// Processor time of all threads.
    pub(crate) processor: f64,
    /// Time on the clock.
    pub(crate) wall: f64,
}

/// Does some work, and says what it took.
pub(crate) fn measured<T>(work: impl FnOnce() -> T) -> (T, Seconds) {
    let (processor, wall) = (processor_time(), Instant::now());
    let result = work();
    let wall = wall.elapsed().as_secs_f64();
    (result, Seconds { processor: processor_time().saturating_sub(processor).as_secs_f64(), wall })
}

/// Processor time of this process so far, of all threads; zero where it is not known.
pub(crate) fn processor_time() -> Duration {
    #[cfg(unix)]
    {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Duration::try_from(now).unwrap_or_default()
    }
    #[cfg(not(unix))]
    Duration::ZERO
}

/// Decodes all frames of a stream in memory to planes of f32, each in the memory of the one before, and says how many Gaussians
/// they have together.
///
/// # Errors
/// The stream has a fault.
pub(crate) fn decoded(stream: &[u8], verify: bool, memory: &FrameMemory) -> Result<u64> {
    let mut gaussians = 0;
    let mut failed = None;
    let options = Options { verify, ..Options::default() };
    let summary = decode_stream_to(memory, black_box(stream), None, &options, |sequence, frame| {
        match to_gaussians(frame.into_shown(), sequence) {
            Ok(frame) => {
                gaussians += frame.len() as u64;
                memory.recycle(black_box(frame));
            }
            Err(error) => failed = Some(error),
        }
        if failed.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    match (failed, summary.verdict()) {
        (Some(error), _) => Err(error.into()),
        (None, Some(error)) => Err(error.into()),
        (None, None) => Ok(gaussians),
    }
}
