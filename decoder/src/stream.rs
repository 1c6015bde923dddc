//! A whole stream through a [`Decoder`]: from bytes that are all there, or that arrive in pieces.

use crate::frame_memory::FrameMemory;
use crate::interrupt::Interrupt;
use crate::operating_point::OperatingPoint;
use crate::process::{DecodedFrame, Decoder, Options};
use core::ops::{ControlFlow, RangeInclusive};
use splatstream_format::syntax::{FileHeader, SequenceParameters, UnitType};
use splatstream_format::unit::Unit;
use splatstream_format::unit_reader::{Event, UnitReader};
use splatstream_format::{Error, Result};

/// How decoding a stream went.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[must_use]
#[non_exhaustive]
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

/// What a [`StreamDecoder`] gives.
#[derive(Debug)]
pub enum Step {
    /// A frame, as soon as the last of its units that belong to the operating point has come.
    Frame(Box<DecodedFrame>),
    /// At least so many more bytes are needed, 1 or more.
    NeedMoreData(u64),
    /// No more frames will come.
    End,
}

/// Decodes a stream whose bytes arrive in pieces. It holds none of them but those of the frame in progress.
///
/// ```
/// use splatstream_decoder::process::Options;
/// use splatstream_decoder::stream::{Step, StreamDecoder};
///
/// /// `received` are the bytes from `decoder.position()` on.
/// fn show(decoder: &mut StreamDecoder, received: &[u8]) -> splatstream_format::Result<()> {
///     if let Step::Frame(frame) = decoder.next_step(received, false)? {
///         println!("frame {}: {} Gaussians", frame.index, frame.planes.len());
///     }
///     Ok(())
/// }
/// show(&mut StreamDecoder::new(&Options::default()), &[])?;
/// # Ok::<(), splatstream_format::Error>(())
/// ```
pub struct StreamDecoder {
    options: Options,
    interrupt: Interrupt,
    memory: FrameMemory,
    reader: UnitReader,
    /// None before the file header.
    decoder: Option<Decoder>,
    /// Where decoding goes on once the sequence parameters have come.
    inside: Option<u64>,
    frames: u32,
}

impl StreamDecoder {
    /// A decoder of a stream from its first byte on.
    pub fn new(options: &Options) -> Self {
        let reader = UnitReader::new(&options.limits);
        let interrupt = Interrupt::default();
        let (decoder, inside) = (None, None);
        let memory = FrameMemory::default();
        Self { options: *options, interrupt, memory, reader, decoder, inside, frames: 0 }
    }

    /// A decoder of the frames from the GOP on whose header stands at the absolute offset `gop`, as an index gives it
    /// (B.3). What stands before it is not looked at, but for the units up to the first sequence parameters, and the scene
    /// description that follows these, if it is intact.
    pub fn inside(gop: u64, options: &Options) -> Self {
        Self { inside: Some(gop), ..Self::new(options) }
    }

    /// Goes on with the GOP whose header stands at an absolute offset. Errors of what came before are forgotten.
    pub fn go_to(&mut self, gop: u64) {
        match &mut self.decoder {
            Some(decoder) if decoder.sequence().is_some() => {
                decoder.restart();
                self.reader = UnitReader::starting_at(gop, &self.options.limits);
            }
            _ => {
                let (interrupt, memory) = (self.interrupt.clone(), self.memory.clone());
                *self = Self { interrupt, memory, ..Self::inside(gop, &self.options) };
            }
        }
    }

    /// Absolute offset of the first byte that is needed next. Those before it are never needed again, unless
    /// [`StreamDecoder::go_to`] goes back.
    pub const fn position(&self) -> u64 {
        self.reader.position()
    }

    /// Decodes until a frame is complete, or more bytes are needed. `bytes` are those of the stream from
    /// [`StreamDecoder::position`] on, and `is_end` says that no more will come. The position moves on.
    ///
    /// # Errors
    /// What clause 6.2 says of the file header; nothing can be decoded then. Other errors are in the
    /// [`StreamDecoder::summary`].
    pub fn next_step(&mut self, bytes: &[u8], is_end: bool) -> Result<Step> {
        let start = self.position();
        if let Some(frame) = self.decoder.as_mut().and_then(Decoder::next_ready) {
            return Ok(self.frame(frame));
        }
        loop {
            // What is left of the stream may be long, and none of it is needed.
            if self.interrupt.is_requested() {
                return Ok(Step::End);
            }
            let used = self.position().checked_sub(start).and_then(|used| usize::try_from(used).ok());
            let rest = match used.map(|used| bytes.get(used..)) {
                Some(Some(rest)) => rest,
                // After the last byte there is nothing.
                Some(None) if is_end => &[],
                // Another place asks for other bytes.
                _ => return Ok(Step::NeedMoreData(1)),
            };
            match self.step(rest, is_end)? {
                // A stream may end without a unit that ends its last frame.
                Some(Step::End) => {
                    let waited = self.stop_waiting();
                    return Ok(waited.map_or(Step::End, |frame| Step::Frame(Box::new(frame))));
                }
                Some(step) => return Ok(step),
                None => {}
            }
        }
    }

    /// Takes what stands at the position.
    fn step(&mut self, bytes: &[u8], is_end: bool) -> Result<Option<Step>> {
        let event = self.reader.read(bytes, is_end);
        let Some(decoder) = &mut self.decoder else {
            return match event? {
                Event::FileHeader(file) => {
                    self.start(&file);
                    Ok(None)
                }
                Event::NeedMoreData(bytes) => Ok(Some(Step::NeedMoreData(bytes))),
                _ => Ok(Some(Step::End)),
            };
        };
        if self.inside.is_some()
            && decoder.sequence().is_some()
            && !matches!(event, Ok(Event::NeedMoreData(_)))
        {
            if let Ok(Event::Unit(unit)) = event {
                decoder.take_description(&unit);
            }
            self.go_inside();
            return Ok(None);
        }
        let frame = match event {
            Ok(Event::Unit(unit)) => self.unit(&unit),
            Err(error) => {
                let frame = decoder.unreadable(error);
                // Where there is nothing to go on with, the next unit is none.
                if !decoder.has_stopped() {
                    self.reader.scan_for(decoder.wanted());
                }
                frame
            }
            Ok(Event::NeedMoreData(bytes)) => return Ok(Some(Step::NeedMoreData(bytes))),
            Ok(Event::End) if self.inside.is_some() => {
                self.go_inside();
                None
            }
            Ok(_) => return Ok(Some(Step::End)),
        };
        Ok(frame.map(|frame| self.frame(frame)))
    }

    fn frame(&mut self, frame: DecodedFrame) -> Step {
        self.frames = self.frames.saturating_add(1);
        Step::Frame(Box::new(frame))
    }

    /// Where [`Options::ahead`] is set: ends the wait for another frame, whose bytes may not come soon, and gives the frame
    /// that has waited. There is none if nothing has waited.
    pub fn stop_waiting(&mut self) -> Option<DecodedFrame> {
        let waited = self.decoder.as_mut().and_then(Decoder::stop_waiting);
        self.frames = self.frames.saturating_add(waited.is_some().into());
        waited
    }

    fn start(&mut self, file: &FileHeader) {
        let mut decoder = match self.inside {
            Some(_) => Decoder::starting_inside(file, self.options),
            None => Decoder::new(file, self.options),
        };
        decoder.set_interrupt(self.interrupt.clone());
        decoder.set_memory(self.memory.clone());
        self.decoder = Some(decoder);
    }

    /// Takes the units of another operating point from the next GOP on. Where it is lower on some axis, it holds there from
    /// the next frame on that has not been decoded yet: one may be, if frames are decoded [ahead](Options::ahead).
    pub fn set_operating_point(&mut self, point: OperatingPoint) {
        self.options.operating_point = point;
        self.decoder.iter_mut().for_each(|decoder| decoder.set_operating_point(point));
    }

    /// Lets another thread end decoding: once it has been requested, no frame is given any more.
    pub fn set_interrupt(&mut self, interrupt: Interrupt) {
        self.decoder.iter_mut().for_each(|decoder| decoder.set_interrupt(interrupt.clone()));
        self.interrupt = interrupt;
    }

    /// Memory of frames: later ones are decoded to what is given back here.
    pub const fn memory(&self) -> &FrameMemory {
        &self.memory
    }

    /// Decodes to memory that others share, such as the decoders of other streams.
    pub fn set_memory(&mut self, memory: FrameMemory) {
        self.decoder.iter_mut().for_each(|decoder| decoder.set_memory(memory.clone()));
        self.memory = memory;
    }

    fn unit(&mut self, unit: &Unit<'_>) -> Option<DecodedFrame> {
        let decoder = self.decoder.as_mut()?;
        let frame = decoder.unit(unit);
        // An end unit with a fault is not the end.
        if unit.header.unit_type() == UnitType::End && !decoder.has_stopped() {
            self.reader.reopen();
        }
        frame
    }

    /// Goes to the GOP that decoding starts with, if there is one.
    fn go_inside(&mut self) {
        if let Some(gop) = self.inside.take() {
            self.reader = UnitReader::starting_at(gop, &self.options.limits);
        }
    }

    /// The state of decoding; none before the file header.
    pub const fn decoder(&self) -> Option<&Decoder> {
        self.decoder.as_ref()
    }

    /// The sequence parameters, once they have come: from the first frame on.
    pub fn sequence(&self) -> Option<&SequenceParameters> {
        self.decoder.as_ref().and_then(Decoder::sequence)
    }

    /// Takes the errors and the lost frames since the last call, in stream order. A [`StreamDecoder::summary`] does not
    /// have them any more.
    pub fn take_report(&mut self) -> (Vec<Error>, Vec<RangeInclusive<u32>>) {
        self.decoder.as_mut().map(Decoder::take_report).unwrap_or_default()
    }

    /// How decoding went so far.
    pub fn summary(&self) -> Summary {
        let Some(decoder) = &self.decoder else { return Summary::default() };
        let (errors, lost) = (decoder.errors().to_vec(), decoder.lost().to_vec());
        Summary { frames: self.frames, errors, lost }
    }
}

/// The frames of a stream that is there as a whole, one after the other.
pub struct Frames<'a> {
    bytes: &'a [u8],
    decoder: StreamDecoder,
}

impl<'a> Frames<'a> {
    /// The frames of the stream that `bytes` is. As all of it is there, frames are decoded [ahead](Options::ahead).
    ///
    /// # Errors
    /// What clause 6.2 says of the file header; nothing can be decoded then.
    pub fn open(bytes: &'a [u8], options: &Options) -> Result<Self> {
        FileHeader::parse(bytes)?;
        Ok(Self { bytes, decoder: StreamDecoder::new(&Options { ahead: true, ..*options }) })
    }

    /// The frames from the GOP on whose header stands at the absolute offset `gop`, see [`StreamDecoder::inside`].
    ///
    /// # Errors
    /// As [`Frames::open`].
    pub fn open_inside(bytes: &'a [u8], gop: u64, options: &Options) -> Result<Self> {
        FileHeader::parse(bytes)?;
        let gop = gop.min(u64::try_from(bytes.len()).unwrap_or(u64::MAX));
        let options = Options { ahead: true, ..*options };
        Ok(Self { bytes, decoder: StreamDecoder::inside(gop, &options) })
    }

    /// The next frame; none after the last.
    pub fn next_frame(&mut self) -> Option<DecodedFrame> {
        loop {
            let at = usize::try_from(self.decoder.position()).unwrap_or(usize::MAX);
            match self.decoder.next_step(self.bytes.get(at..).unwrap_or_default(), true) {
                Ok(Step::Frame(frame)) => return Some(*frame),
                Ok(Step::NeedMoreData(_)) => {}
                Ok(Step::End) | Err(_) => return None,
            }
        }
    }

    /// The sequence parameters, once they have come: from the first frame on.
    pub fn sequence(&self) -> Option<&SequenceParameters> {
        self.decoder.sequence()
    }

    /// Memory of frames: later ones are decoded to what is given back here.
    pub const fn memory(&self) -> &FrameMemory {
        self.decoder.memory()
    }

    /// How decoding went so far.
    pub fn summary(&self) -> Summary {
        self.decoder.summary()
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

/// The same from a GOP on if one is given, to memory that whoever needs a frame no more gives it back to.
///
/// ```
/// use core::ops::ControlFlow;
/// use splatstream_decoder::frame_memory::FrameMemory;
/// use splatstream_decoder::process::Options;
/// use splatstream_decoder::stream::decode_stream_to;
///
/// let memory = FrameMemory::default();
/// let summary = decode_stream_to(&memory, &[], None, &Options::default(), |_, frame| {
///     memory.recycle_integers(frame.planes);
///     ControlFlow::Continue(())
/// });
/// assert!(summary.verdict().is_some());
/// ```
pub fn decode_stream_to(
    memory: &FrameMemory,
    bytes: &[u8],
    gop: Option<u64>,
    options: &Options,
    on_frame: impl FnMut(&SequenceParameters, DecodedFrame) -> ControlFlow<()>,
) -> Summary {
    let mut frames = match gop {
        None => Frames::open(bytes, options),
        Some(gop) => Frames::open_inside(bytes, gop, options),
    };
    frames.iter_mut().for_each(|frames| frames.decoder.set_memory(memory.clone()));
    run(frames, on_frame)
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
