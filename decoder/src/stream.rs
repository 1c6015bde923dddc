//! A whole stream through a [`Decoder`].

use crate::process::{DecodedFrame, Decoder, Options};
use core::ops::{ControlFlow, RangeInclusive};
use splatstream_format::syntax::{SequenceParameters, UnitType};
use splatstream_format::unit::{Stream, Unit, Units};
use splatstream_format::{Error, Result};

/// How decoding a stream went.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[must_use]
pub struct Summary {
    /// Frames handed out.
    pub frames: u32,
    /// Every error, in stream order.
    pub errors: Vec<Error>,
    /// Display indices of frames that were lost and not handed out.
    pub lost: Vec<RangeInclusive<u32>>,
}

impl Summary {
    /// The error that the verdict of clause 9 names; none if the stream is accepted.
    pub fn verdict(&self) -> Option<Error> {
        self.errors.first().copied()
    }
}

/// The frames of a stream, one after the other.
pub struct Frames<'a> {
    stream: Stream<'a>,
    units: Units<'a>,
    decoder: Decoder<'a>,
    frames: u32,
}

impl<'a> Frames<'a> {
    /// The frames of the stream that `bytes` is.
    ///
    /// # Errors
    /// What clause 6.2 says of the file header; nothing can be decoded then.
    pub fn open(bytes: &'a [u8], options: &Options) -> Result<Self> {
        let stream = Stream::open(bytes, &options.limits)?;
        let decoder = Decoder::new(stream.header(), *options);
        Ok(Self { stream, units: stream.units(), decoder, frames: 0 })
    }

    /// The frames from the GOP on whose header stands at the absolute offset `gop`, as an index gives it (B.3). What stands
    /// before it is not looked at, but for the units up to the first sequence parameters.
    ///
    /// # Errors
    /// As [`Frames::open`].
    pub fn open_inside(bytes: &'a [u8], gop: u64, options: &Options) -> Result<Self> {
        let stream = Stream::open(bytes, &options.limits)?;
        let decoder = Decoder::starting_inside(stream.header(), *options);
        let mut frames = Self { stream, units: stream.units(), decoder, frames: 0 };
        while let Some(unit) = frames.units.next_unit() {
            let is_sequence = unit.is_ok_and(|unit| unit.header.unit_type() == UnitType::SequenceParameters);
            frames.take(unit);
            if is_sequence {
                break;
            }
        }
        frames.units = stream.units_from(gop);
        Ok(frames)
    }

    /// The next frame; none after the last.
    pub fn next_frame(&mut self) -> Option<DecodedFrame> {
        loop {
            let unit = self.units.next_unit()?;
            if let Some(frame) = self.take(unit) {
                self.frames = self.frames.saturating_add(1);
                return Some(frame);
            }
        }
    }

    /// Takes a unit, or looks for the next one after bytes that are none; gives the frame that this ends, if it does.
    fn take(&mut self, unit: Result<Unit<'a>>) -> Option<DecodedFrame> {
        match unit {
            Ok(unit) => {
                let frame = self.decoder.unit(&unit);
                let is_end = unit.header.unit_type() == UnitType::End;
                // An end unit with a fault is not the end.
                if is_end && !self.decoder.has_stopped() {
                    self.units = self.stream.units_from(self.units.position());
                }
                frame
            }
            Err(error) => {
                let frame = self.decoder.unreadable(error);
                // Where there is nothing to go on with, the next unit is none.
                if !self.decoder.has_stopped() {
                    self.units.scan_for(self.decoder.wanted());
                }
                frame
            }
        }
    }

    /// The sequence parameters, once they have come: from the first frame on.
    pub fn sequence(&self) -> Option<&SequenceParameters> {
        self.decoder.sequence()
    }

    /// How decoding went so far.
    pub fn summary(&self) -> Summary {
        let (errors, lost) = (self.decoder.errors().to_vec(), self.decoder.lost().to_vec());
        Summary { frames: self.frames, errors, lost }
    }
}

/// Decodes a stream; hands out each frame as it is complete, until `on_frame` breaks off.
pub fn decode_stream(
    bytes: &[u8],
    options: &Options,
    on_frame: impl FnMut(&SequenceParameters, DecodedFrame) -> ControlFlow<()>,
) -> Summary {
    run(Frames::open(bytes, options), on_frame)
}

/// The same from a GOP on, see [`Frames::open_inside`].
pub fn decode_stream_inside(
    bytes: &[u8],
    gop: u64,
    options: &Options,
    on_frame: impl FnMut(&SequenceParameters, DecodedFrame) -> ControlFlow<()>,
) -> Summary {
    run(Frames::open_inside(bytes, gop, options), on_frame)
}

fn run(
    frames: Result<Frames<'_>>,
    mut on_frame: impl FnMut(&SequenceParameters, DecodedFrame) -> ControlFlow<()>,
) -> Summary {
    let mut frames = match frames {
        Ok(frames) => frames,
        Err(error) => return Summary { errors: vec![error], ..Summary::default() },
    };
    while let Some(frame) = frames.next_frame() {
        let Some(sequence) = frames.sequence() else { break };
        if on_frame(sequence, frame).is_break() {
            break;
        }
    }
    frames.summary()
}
