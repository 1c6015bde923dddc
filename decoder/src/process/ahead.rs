//! Two frames side by side.
//!
//! A frame that no other one refers to may wait, once it has all its units, until the frame after it has them too: neither
//! needs the other, so that each core decodes one of them. On one core nothing waits. Whatever else happens ends the wait
//! first. Frames and errors come in the order of the stream, as if nothing had waited.

use super::frame::FrameInProgress;
use super::report::Found;
use super::{DecodedFrame, Decoder, FrameEnd};
use crate::cores;
use crate::frame::PLANES;
use crate::gop::Gop;
use crate::operating_point::OperatingPoint;
use splatstream_format::Error;

/// A frame that has ended and is to be handed out.
pub(super) struct Ready {
    frame: DecodedFrame,
    /// The operating point in force where it started.
    point: OperatingPoint,
    /// What had been found wrong when it ended, if more may have been found since.
    found: Option<Found>,
}

impl Decoder {
    /// Whether the frame in progress, which is complete, may wait for the one after it.
    pub(super) fn may_wait(&self) -> bool {
        let (Some(frame), Some(gop)) = (&self.frame, &self.gop) else { return false };
        let is_free = gop.header.is_predicted() && !is_kept(gop, frame.role.temporal_layer);
        let is_wanted = self.options.ahead && !self.options.stop_at_first_error && self.frames_left > 0;
        let is_worth_it = cores::are_many(values(frame)) && rayon::current_num_threads() > 1;
        is_wanted && is_worth_it && is_free && self.waiting.is_none() && frame.error.is_none()
    }

    /// The frame in progress waits. The identities of its new Gaussians are set apart.
    pub(super) fn wait(&mut self) {
        self.waiting = self.frame.take();
        if let Some(frame) = &self.waiting {
            self.next_identity = frame.next_identity();
        }
    }

    /// Whether a frame waits for one that has not started yet.
    pub(super) fn is_waiting(&self) -> bool {
        self.waiting.is_some() && self.frame.is_none()
    }

    /// Decodes the pending units of the frame in progress, and of the one that waits, which ends; reports their errors.
    pub(super) fn settle(&mut self) {
        if cores::HAS_THREADS && self.waiting.is_some() {
            return self.settle_both();
        }
        let Some(mut frame) = self.frame.take() else { return };
        let errors = self.decoded(&mut frame);
        self.frame = Some(frame);
        errors.into_iter().for_each(|error| self.add(error));
    }

    /// Decodes the pending units of a frame; gives their errors.
    fn decoded(&self, frame: &mut FrameInProgress) -> Vec<Error> {
        match self.context(frame.reference) {
            Some(context) if !frame.pending.is_empty() => {
                cores::whole(values(frame), || frame.decode(&context))
            }
            _ => Vec::new(),
        }
    }

    /// Decodes the pending units of the frame that waits, and of the frame in progress if there is one, beside each other.
    /// The former ends.
    fn settle_both(&mut self) {
        let (mut waiting, mut next) = (self.waiting.take(), self.frame.take());
        let decoded = |frame: &mut Option<FrameInProgress>| {
            frame.as_mut().map_or_else(Vec::new, |frame| self.decoded(frame))
        };
        let (errors, next_errors) = rayon::join(|| decoded(&mut waiting), || decoded(&mut next));
        self.frame = waiting;
        errors.into_iter().for_each(|error| self.add(error));
        if let Some(frame) = self.close(FrameEnd::Complete) {
            self.ready.push_back(Ready { frame, point: self.frame_point, found: Some(self.report.found()) });
        }
        if let Some(next) = next {
            self.interrupt.leave(self.frame.replace(next));
        }
        next_errors.into_iter().for_each(|error| self.add(error));
    }

    /// Ends the wait for another frame: its bytes may not come soon. Gives the frame that has waited.
    pub fn stop_waiting(&mut self) -> Option<DecodedFrame> {
        if self.is_waiting() {
            self.settle();
        }
        self.next_ready()
    }

    /// The next frame that has ended.
    pub fn next_ready(&mut self) -> Option<DecodedFrame> {
        if self.interrupt.is_requested() {
            // They are freed with the decoder.
            return None;
        }
        let Ready { frame, point, found } = self.ready.pop_front()?;
        self.frame_point = point;
        self.report.tell(found);
        Some(frame)
    }

    /// Hands out a frame that has ended, after those that ended before it.
    pub(super) fn in_order(&mut self, done: Option<DecodedFrame>) -> Option<DecodedFrame> {
        if self.ready.is_empty() {
            return done;
        }
        self.ready.extend(done.map(|frame| Ready { frame, point: self.frame_point, found: None }));
        self.next_ready()
    }
}

/// Values of all Gaussians of a frame.
fn values(frame: &FrameInProgress) -> usize {
    (frame.header.gaussian_count as usize).saturating_mul(PLANES)
}

/// Whether later frames of a GOP may refer to those of a temporal layer.
pub(super) fn is_kept(gop: &Gop, layer: u8) -> bool {
    gop.header.is_predicted() && (layer == 0 || layer < gop.header.temporal_depth)
}
