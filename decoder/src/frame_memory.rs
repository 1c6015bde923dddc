//! Memory of frames that nobody needs any more: the frames after them are written to it.
//!
//! Fresh memory of a frame is tens of megabytes that the system clears page by page, which takes up to half as long as decoding
//! does. A frame that was shown is given back instead.

use crate::cores;
use crate::frame::{PLANES, QuantizedFrame, SIGNED};
use crate::interrupt::Interrupt;
use bytemuck::allocation::cast_vec;
use core::fmt;
use splatstream_gaussians::GaussianFrame;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What debug builds fill planes with: nothing may depend on what is in them.
const JUNK: i32 = 0x5EED_5EED;

/// Planes that later frames are decoded to, at most as many as two frames have, since two may be decoded at a time. Clones share
/// them.
///
/// What is here was the caller's before, and no budget counts it: whoever gives frames back one by one has no more than without.
///
/// ```
/// use splatstream_decoder::output::to_gaussians;
/// use splatstream_decoder::process::Options;
/// use splatstream_decoder::stream::Frames;
///
/// fn show(bytes: &[u8]) -> Result<(), Box<dyn core::error::Error>> {
///     let mut frames = Frames::open(bytes, &Options::default())?;
///     while let Some(frame) = frames.next_frame() {
///         let Some(sequence) = frames.sequence() else { break };
///         let gaussians = to_gaussians(frame.into_shown(), sequence)?;
///         println!("{} Gaussians", gaussians.len());
///         frames.memory().recycle(gaussians);
///     }
///     Ok(())
/// }
/// # assert!(show(&[]).is_err());
/// ```
#[derive(Clone, Default)]
pub struct FrameMemory(Arc<Mutex<Vec<Vec<i32>>>>);

impl fmt::Debug for FrameMemory {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("FrameMemory").field("planes", &self.planes().len()).finish()
    }
}

impl FrameMemory {
    /// Takes the memory of a frame, as far as no clone of the frame shares it.
    pub fn recycle(&self, frame: GaussianFrame) {
        self.take(frame.into_memory().into_iter().map(cast_vec).collect());
    }

    /// Takes the memory of a frame of integers.
    pub fn recycle_integers(&self, mut frame: QuantizedFrame) {
        let mut planes: Vec<Vec<i32>> =
            frame.position.iter_mut().map(core::mem::take).map(cast_vec).collect();
        planes.extend(frame.signed_planes_mut().map(core::mem::take));
        self.take(planes);
    }

    /// A copy of a frame.
    #[must_use]
    pub fn copy(&self, frame: &QuantizedFrame) -> QuantizedFrame {
        let blank = self.blank(frame.len(), frame.sh.len(), Interrupt::NEVER);
        QuantizedFrame::joined(blank, &[frame], Interrupt::NEVER)
    }

    /// A frame of `count` Gaussians, whose integers mean nothing. Where an interrupt is requested, planes are empty.
    pub(crate) fn blank(&self, count: usize, sh_planes: usize, interrupt: &Interrupt) -> QuantizedFrame {
        let signed = SIGNED.saturating_add(sh_planes);
        let values = count.saturating_mul(PLANES.saturating_add(sh_planes));
        let count = || if interrupt.is_requested() { 0 } else { count };
        let positions = || [(); 3].map(|()| cast_vec(self.plane(count())));
        let planes = || cores::map(values, vec![(); signed], |()| self.plane(count()));
        let (position, planes) = cores::join(values, positions, planes);
        QuantizedFrame::of_planes(position, planes)
    }

    /// Keeps these planes of a frame, and of those before no more than as many, and none that is far larger.
    fn take(&self, mut planes: Vec<Vec<i32>>) {
        planes.retain(|plane| plane.capacity() > 0);
        let Some(count) = planes.first().map(Vec::len) else { return };
        let mut kept = self.planes();
        kept.retain(|plane| is_fit(plane, count));
        let most = planes.len();
        let surplus = kept.len().saturating_sub(most);
        kept.drain(..surplus);
        kept.append(&mut planes);
    }

    /// A plane of so many values, which mean nothing.
    fn plane(&self, count: usize) -> Vec<i32> {
        let kept = self.planes().pop().filter(|plane| is_fit(plane, count));
        let mut plane = kept.unwrap_or_else(|| vec![0; count]);
        plane.resize(count, 0);
        if cfg!(debug_assertions) {
            plane.fill(JUNK);
        }
        plane
    }

    fn planes(&self) -> MutexGuard<'_, Vec<Vec<i32>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Whether a plane has room for so many values, and not for more than twice as many.
fn is_fit(plane: &Vec<i32>, count: usize) -> bool {
    (count..=count.saturating_mul(2)).contains(&plane.capacity())
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatstream_gaussians::Planes;

    /// Of degree 1.
    fn gaussians(count: usize) -> GaussianFrame {
        let mut planes = Planes::with_capacity(1, 0);
        planes.iter_mut().for_each(|plane| plane.resize(count, 1.5));
        GaussianFrame::from_planes(1, planes).unwrap()
    }

    #[test]
    fn what_was_recycled_is_written_to_and_no_more_is_kept_than_of_two_frames() {
        let memory = FrameMemory::default();
        let frame = gaussians(100);
        let address = frame.sh().last().map(|plane| plane.as_ptr().addr());
        memory.recycle(frame);
        let plane = memory.clone().plane(60);
        assert_eq!((Some(plane.as_ptr().addr()), plane.len()), (address, 60));
        (0..9).for_each(|_| memory.recycle(gaussians(100)));
        assert_eq!(memory.planes().len(), 2 * (PLANES + 9));
        // One that has fewer planes, one that has none, and far smaller ones.
        memory.recycle_integers(QuantizedFrame::zeroed(90, 0));
        assert_eq!(memory.planes().len(), 2 * PLANES);
        memory.recycle_integers(QuantizedFrame::default());
        assert_eq!(memory.planes().len(), 2 * PLANES);
        memory.recycle(gaussians(40));
        assert_eq!(memory.planes().len(), PLANES + 9);
        assert_eq!(memory.plane(10).capacity(), 10, "no plane of four times the size");
        assert_eq!(memory.plane(41).capacity(), 41, "and none that has to grow");
        // What a clone still shows is not taken.
        let shown = gaussians(5);
        memory.recycle(shown.clone());
        assert_eq!(shown, gaussians(5));
    }

    #[test]
    fn planes_without_memory_are_not_kept() {
        let memory = FrameMemory::default();
        memory.recycle(gaussians(0));
        memory.recycle_integers(QuantizedFrame::default());
        assert!(memory.planes().is_empty());
        assert_eq!(memory.blank(3, 0, Interrupt::NEVER).len(), 3);
    }

    #[test]
    fn a_copy_in_used_memory_is_the_frame() {
        let memory = FrameMemory::default();
        memory.recycle(gaussians(7));
        let mut frame = QuantizedFrame::zeroed(3, 9);
        frame.signed_planes_mut().zip(1..).for_each(|(plane, value)| plane.fill(value));
        frame.position[2] = vec![4, 5, 6];
        assert_eq!(memory.copy(&frame), frame);
    }
}
