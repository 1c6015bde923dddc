//! Where frames come from.

use splatstream_gaussians::GaussianFrame;

/// A sequence of frames, each read when it is needed. The encoder asks for every frame twice, and for a few more often.
pub trait FrameSource {
    /// Frames in the sequence.
    fn len(&self) -> u32;

    /// True if there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One frame, counted from 0.
    ///
    /// # Errors
    /// The frame cannot be had; the error says which file and why.
    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>>;

    /// The same as pictures of the stream are compared with it: what a source leaves out of a frame is still there.
    ///
    /// # Errors
    /// As [`frame`](Self::frame).
    fn original(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        self.frame(number)
    }
}

/// Frames in memory.
impl FrameSource for Vec<GaussianFrame> {
    fn len(&self) -> u32 {
        Self::len(self) as u32
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        self.get(number as usize).cloned().ok_or_else(|| format!("there is no frame {number}").into())
    }
}
