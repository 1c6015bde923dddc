//! Parts of sequences: frames that are in memory, and the first frames of a source.

use crate::error::Error;
use crate::memory::bytes_of;
use crate::source::FrameSource;
use splatstream_decoder::interrupt::Interrupt;
use splatstream_gaussians::GaussianFrame;
use std::collections::VecDeque;

/// Frames of a sequence that follow each other, in memory. They keep the numbers that they have in the sequence.
#[derive(Default)]
pub(crate) struct Window {
    /// The number of the first.
    pub(crate) first: u32,
    pub(crate) frames: VecDeque<GaussianFrame>,
    /// Ends the work on them.
    pub(crate) cancel: Interrupt,
}

impl FrameSource for Window {
    fn len(&self) -> u32 {
        self.first.saturating_add(u32::try_from(self.frames.len()).unwrap_or(u32::MAX))
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        // Whatever is tried or coded asks for its frames, one after the other.
        if self.cancel.is_requested() {
            return Err(Error::Cancelled.into());
        }
        let at = number.checked_sub(self.first).and_then(|at| self.frames.get(at as usize));
        at.cloned().ok_or_else(|| format!("frame {number} is not there any more").into())
    }
}

impl Window {
    /// What the frames take.
    pub(crate) fn bytes(&self) -> u64 {
        self.frames.iter().map(bytes_of).fold(0, u64::saturating_add)
    }

    /// Forgets the frames before one.
    pub(crate) fn drop_before(&mut self, number: u32) {
        self.frames.drain(..(number.saturating_sub(self.first) as usize).min(self.frames.len()));
        self.first = number;
    }
}

/// The first frames of a source.
pub(crate) struct FirstFrames<'a> {
    pub(crate) source: &'a mut dyn FrameSource,
    pub(crate) frames: u32,
}

impl FrameSource for FirstFrames<'_> {
    fn len(&self) -> u32 {
        self.frames.min(self.source.len())
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        self.source.frame(number)
    }

    fn original(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        self.source.original(number)
    }
}
