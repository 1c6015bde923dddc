//! A whole stream through a [`Decoder`].

use crate::process::{DecodedFrame, Decoder, Options};
use core::ops::ControlFlow;
use splatstream_format::syntax::SequenceParameters;
use splatstream_format::unit::{Delivery, Stream, Units};
use splatstream_format::{Error, Result};

/// How decoding a stream went.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Summary {
    /// Frames handed out.
    pub frames: u32,
    /// Why decoding ended before the end of the stream, if it did.
    pub end: Option<Error>,
}

/// Decodes a stream; hands out each frame as it is complete, until `on_frame` breaks off.
///
/// When the stream breaks off or turns out wrong, the frame that was arriving is handed out as far as it is
/// there, provided the options are tolerant.
pub fn decode_stream(
    bytes: &[u8],
    options: &Options,
    mut on_frame: impl FnMut(&SequenceParameters, DecodedFrame) -> ControlFlow<()>,
) -> Summary {
    let mut summary = Summary::default();
    summary.end = run(bytes, None, options, &mut summary.frames, &mut on_frame).err();
    summary
}

/// The same from the group on whose header stands at the absolute offset `gop`, as an index gives it (B.3).
///
/// What stands before it is not looked at, but for the units up to the sequence parameters.
pub fn decode_stream_inside(
    bytes: &[u8],
    gop: u64,
    options: &Options,
    mut on_frame: impl FnMut(&SequenceParameters, DecodedFrame) -> ControlFlow<()>,
) -> Summary {
    let mut summary = Summary::default();
    summary.end = run(bytes, Some(gop), options, &mut summary.frames, &mut on_frame).err();
    summary
}

/// A decoder and the units that it takes: all, or those from a group on.
fn start<'a>(stream: &Stream<'a>, gop: Option<u64>, options: &Options) -> Result<(Decoder<'a>, Units<'a>)> {
    let Some(gop) = gop else { return Ok((Decoder::new(stream.header(), *options), stream.units())) };
    let mut decoder = Decoder::starting_inside(stream.header(), *options);
    for unit in stream.units() {
        decoder.unit(&unit?)?;
        if decoder.sequence().is_some() {
            break;
        }
    }
    Ok((decoder, stream.units_from(gop)))
}

fn run(
    bytes: &[u8],
    gop: Option<u64>,
    options: &Options,
    frames: &mut u32,
    on_frame: &mut impl FnMut(&SequenceParameters, DecodedFrame) -> ControlFlow<()>,
) -> Result<()> {
    let stream = Stream::open(bytes, &options.limits)?;
    let (mut decoder, mut units) = start(&stream, gop, options)?;
    let mut hand_out = |decoder: &Decoder<'_>, frame: Option<DecodedFrame>| match (decoder.sequence(), frame)
    {
        (Some(sequence), Some(frame)) => {
            *frames = frames.wrapping_add(1);
            on_frame(sequence, frame)
        }
        _ => ControlFlow::Continue(()),
    };
    while let Some(delivery) = units.next_unit() {
        let step = match delivery {
            Ok(Delivery::Intact(unit)) => decoder.unit(&unit),
            Ok(Delivery::Damaged(damaged)) => decoder.damaged(&damaged).map(|()| None),
            Err(error) => Err(error),
        };
        let frame = match step {
            Ok(frame) => frame,
            // An error in the frame that was arriving stands before this one in the stream.
            Err(error) => {
                let frame = decoder.cut()?;
                let _ = hand_out(&decoder, frame);
                return Err(error);
            }
        };
        if hand_out(&decoder, frame).is_break() {
            return Ok(());
        }
    }
    Ok(())
}
