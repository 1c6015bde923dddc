//! The end of the frame in progress: when it comes, what the decoder keeps of the frame, and what it hands out.

use super::decoded::DecodedFrame;
use super::frame::{Context, FrameInProgress};
use super::{Decoder, FrameEnd, ahead};
use splatstream_format::syntax::{UnitHeader, UnitId};
use splatstream_format::{Error, ErrorKind};

impl Decoder {
    /// Ends the frame in progress if it has all units that belong to the operating point, so that it need not wait for
    /// the unit after it.
    pub(super) fn finish_complete(&mut self) -> Option<DecodedFrame> {
        let frame = self.frame.as_ref()?;
        let is_complete = frame.seen && !frame.has_ended && self.has_all(frame);
        if is_complete && self.may_wait() {
            self.wait();
            return None;
        }
        is_complete.then(|| self.close_frame(FrameEnd::Complete)).flatten()
    }

    /// Whether a frame has all units that belong to the operating point.
    fn has_all(&self, frame: &FrameInProgress) -> bool {
        let takes = |spatial_layer, refinement| {
            let id = UnitId::of_increment(frame.index, refinement);
            UnitHeader::new(id.on_layers(spatial_layer, frame.role.temporal_layer), &[])
                .is_ok_and(|header| self.belongs(&header))
        };
        self.sequence.as_ref().is_some_and(|(sequence, _)| frame.has_all(sequence, takes))
    }

    /// Ends the frame in progress. One that is complete stays: it tells why it takes no further increment.
    pub(super) fn close_frame(&mut self, end: FrameEnd) -> Option<DecodedFrame> {
        self.settle();
        self.close(end)
    }

    /// Ends the frame in progress, whose units have been decoded.
    pub(super) fn close(&mut self, end: FrameEnd) -> Option<DecodedFrame> {
        if self.interrupt.is_requested() {
            // The frame is freed with the decoder.
            self.has_stopped = true;
            return None;
        }
        let mut frame = self.frame.take().filter(|frame| !frame.has_ended)?;
        if let (FrameEnd::Unit(at), true) = (end, frame.is_intra() && !frame.seen) {
            let rule = "an I frame has an increment";
            let error = Error::new(at, "7.1.5", ErrorKind::Constraint { rule });
            self.add(error);
            frame.error.get_or_insert(error);
        }
        frame.is_cut = end == FrameEnd::Cut && !self.has_all(&frame);
        let (layer, reference) = (frame.role.temporal_layer, frame.reference);
        self.frame_point = frame.point;
        let (Some((sequence, _)), Some(gop)) = (&self.sequence, &self.gop) else { return None };
        let context = Context {
            options: &self.options,
            interrupt: &self.interrupt,
            buffers: &self.buffers,
            profile: self.profile,
            sequence,
            gop,
            reference: None,
        };
        let is_kept = ahead::is_kept(gop, layer);
        let reference = reference.and_then(|layer| self.references.get_mut(layer));
        let closed = match frame.close(&context, reference, end != FrameEnd::Cut) {
            Ok(closed) => closed,
            Err(error) => {
                self.add(error);
                return None;
            }
        };
        self.next_identity = closed.next_identity;
        self.has_stopped |= self.interrupt.is_requested();
        let mut spares = closed.spares;
        match is_kept {
            true => self.references.store(layer, closed.state, |state| spares.take(state.into_lists())),
            false => spares.take(closed.state.into_lists()),
        }
        self.spares.push(spares);
        closed.difference.into_iter().for_each(|error| self.add(error));
        if end == FrameEnd::Complete {
            self.frame = Some(frame);
        }
        if self.has_stopped {
            self.interrupt.leave(closed.decoded);
            return None;
        }
        Some(closed.decoded)
    }
}
