//! From bytes to frames.

use crate::Cancel;
use crate::error::{Error, Result, Warning};
use crate::frame::{Frame, time_of};
use crate::limits::Limits;
use crate::source::{Source, Window};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::{Step, StreamDecoder};
use splatstream_format::payload::SceneDescription;
use splatstream_format::seek::gop_of;
use splatstream_format::{Class, Error as StreamError};
use splatstream_gaussians::GaussianFrame;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// A place in a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Position {
    /// The frame with this index.
    Frame(u32),
    /// The frame that is shown at this time.
    Time(Duration),
}

/// Decodes a stream: see the [crate] for a file and for bytes as they arrive.
pub struct Decoder {
    source: Source,
    stream: StreamDecoder,
    limits: Limits,
    point: OperatingPoint,
    cancel: Cancel,
    /// Whether two frames are decoded at a time.
    is_ahead: bool,
    /// Offset of the GOP header that decoding starts with; none at the start of the stream.
    start: Option<u64>,
    /// Frames before this one are decoded and not given out.
    from: u32,
    warnings: Vec<Warning>,
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Decoding,
    /// After the last frame.
    Ended,
    /// An error ended decoding.
    Failed,
}

impl Decoder {
    /// A decoder that bytes are [pushed](Decoder::push) to.
    pub fn new() -> Self {
        Self::of(Source::Pushed(Window::default()))
    }

    /// A decoder of a file, which is read as it is needed.
    ///
    /// # Errors
    /// A file that cannot be opened. What is wrong with its content comes with the first frame.
    ///
    /// ```no_run
    /// let frames = splatstream::Decoder::open("talk.gss")?;
    /// println!("{} frames", frames.filter_map(Result::ok).count());
    /// # Ok::<(), splatstream::Error>(())
    /// ```
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Ok(Self::from_reader(File::open(path)?))
    }

    /// A decoder of bytes in memory. Many decoders can share them.
    ///
    /// ```
    /// # let stream = include_bytes!("../examples/talk.gss").to_vec();
    /// let bytes: std::sync::Arc<[u8]> = stream.into();
    /// let [left, right] = [(); 2].map(|()| splatstream::Decoder::from_bytes(bytes.clone()));
    /// assert_eq!(left.count(), right.count());
    /// ```
    pub fn from_bytes(bytes: impl Into<Arc<[u8]>>) -> Self {
        Self::of(Source::Shared(bytes.into()))
    }

    /// A decoder of anything that can be read at any place. A reader that has not got all bytes yet fails with
    /// [`WouldBlock`](std::io::ErrorKind::WouldBlock) at its end: then there is [no frame](Decoder::next_frame) until it has
    /// more. Such a decoder seeks, unlike one that bytes are pushed to.
    pub fn from_reader(reader: impl Read + Seek + Send + 'static) -> Self {
        Self::of(Source::Reader(Box::new(reader), Window::default()))
    }

    fn of(source: Source) -> Self {
        let (limits, point, cancel) = (Limits::default(), OperatingPoint::ALL, Cancel::default());
        let stream = stream(&limits, point, &cancel, false);
        let (warnings, state) = (Vec::new(), State::Decoding);
        Self { source, stream, limits, point, cancel, is_ahead: false, start: None, from: 0, warnings, state }
    }

    /// Starts again, with all that has been asked for so far.
    fn restart(&mut self) {
        let memory = self.stream.memory().clone();
        self.stream = stream(&self.limits, self.point, &self.cancel, self.is_ahead);
        self.stream.set_memory(memory);
        self.start.iter().for_each(|&gop| self.stream.go_to(gop));
    }

    /// The same with other limits. To be called before anything has been decoded.
    ///
    /// ```
    /// # let stream = include_bytes!("../examples/talk.gss").to_vec();
    /// use splatstream::{Decoder, Error, Limits};
    ///
    /// let limits = Limits { max_memory: 1 << 20, ..Limits::default() };
    /// let mut decoder = Decoder::from_bytes(stream).with_limits(limits);
    /// assert!(matches!(decoder.next_frame(), Err(Error::Stream(_))));
    /// ```
    #[must_use]
    pub fn with_limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self.restart();
        self
    }

    /// The same at another operating point.
    ///
    /// ```
    /// # let stream = include_bytes!("../examples/talk.gss").to_vec();
    /// // The first refinement of every frame.
    /// let small = splatstream::Decoder::from_bytes(stream).with_operating_point("s0,t0,r0".parse()?);
    /// for frame in small {
    ///     assert_eq!(frame?.refinements(), 1);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn with_operating_point(mut self, point: OperatingPoint) -> Self {
        self.point = point;
        self.restart();
        self
    }

    /// The same, but where the bytes of two frames are there of which neither needs the other, both are decoded at a time:
    /// more frames a second on more than one core. The first of them comes later for it, a lower operating point may hold one
    /// frame later, and decoding takes the memory of one frame more. To be called before anything has been decoded.
    ///
    /// ```
    /// # let stream = include_bytes!("../examples/talk.gss").to_vec();
    /// # let bytes: std::sync::Arc<[u8]> = stream.into();
    /// use splatstream::Decoder;
    ///
    /// let [one, two] = [Decoder::from_bytes(bytes.clone()), Decoder::from_bytes(bytes).ahead()];
    /// for (one, two) in one.zip(two) {
    ///     assert_eq!(one?.digest(), two?.digest());
    /// }
    /// # Ok::<(), splatstream::Error>(())
    /// ```
    #[must_use]
    pub fn ahead(mut self) -> Self {
        self.is_ahead = true;
        self.restart();
        self
    }

    /// The same from the GOP on whose header stands at an offset, as an index or a package gives it. What stands before it is
    /// not looked at, but for the units up to the first sequence parameters. To be called before anything has been decoded.
    #[must_use]
    pub fn starting_at(mut self, gop: u64) -> Self {
        self.start = Some(gop);
        self.restart();
        self
    }

    /// Changes the operating point: from the next GOP on, and where it is lower on some axis, from the next frame on that has
    /// not been decoded yet, which may be one of them [`ahead`](Decoder::ahead).
    pub fn set_operating_point(&mut self, point: OperatingPoint) {
        self.point = point;
        self.stream.set_operating_point(point);
    }

    /// Takes the memory of a frame that is no longer needed: the next one is written to it, which saves the system clearing fresh
    /// memory, up to a third of the time of decoding. A [`Frame`] that is dropped does so by itself; this is for what
    /// [`Frame::into_gaussians`] has made of one.
    ///
    /// ```
    /// # let stream = include_bytes!("../examples/talk.gss").to_vec();
    /// let mut decoder = splatstream::Decoder::from_bytes(stream);
    /// while let Some(frame) = decoder.next_frame()? {
    ///     let gaussians = frame.into_gaussians();
    ///     println!("{} Gaussians", gaussians.len());
    ///     decoder.recycle(gaussians);
    /// }
    /// # Ok::<(), splatstream::Error>(())
    /// ```
    pub fn recycle(&self, gaussians: GaussianFrame) {
        self.stream.memory().recycle(gaussians);
    }

    /// Lets another thread end the work of this decoder, also within a frame.
    ///
    /// ```
    /// # let stream = include_bytes!("../examples/talk.gss").to_vec();
    /// use splatstream::{Cancel, Decoder, Error};
    ///
    /// let cancel = Cancel::new();
    /// let mut decoder = Decoder::from_bytes(stream);
    /// decoder.set_cancel(cancel.clone());
    /// std::thread::spawn(move || cancel.request()).join().ok();
    /// assert!(matches!(decoder.next_frame(), Err(Error::Cancelled)));
    /// ```
    pub fn set_cancel(&mut self, cancel: Cancel) {
        self.stream.set_interrupt(cancel.clone());
        self.cancel = cancel;
    }

    /// Takes the next bytes of the stream. Those that are no longer needed are dropped as frames are taken, and so is what
    /// comes after decoding is [finished](Decoder::is_finished).
    ///
    /// # Errors
    /// A decoder that reads by itself or that has been told the [end](Decoder::end); more bytes than
    /// [`Limits::max_memory`] or the longest unit lets wait.
    pub fn push(&mut self, bytes: &[u8]) -> Result<()> {
        match self.state {
            State::Decoding => self.source.push(bytes, self.limits.max_memory),
            State::Ended | State::Failed => Ok(()),
        }
    }

    /// No more bytes will be pushed: a frame that lacks some is given out.
    pub fn end(&mut self) {
        self.source.end();
    }

    /// The next frame. None if more bytes have to come, or after the last one: see [`Decoder::is_finished`].
    ///
    /// # Errors
    /// A stream that cannot be decoded at all or not within the limits, a file that cannot be read, a cancellation; and
    /// once, after the last frame, what was lost there. Damage otherwise costs frames, not the call:
    /// [`Frame::warnings`] tell.
    pub fn next_frame(&mut self) -> Result<Option<Frame>> {
        if self.state != State::Decoding {
            return Ok(None);
        }
        let frame = self.decode();
        if frame.is_err() && self.state == State::Decoding {
            self.state = State::Failed;
        }
        frame
    }

    fn decode(&mut self) -> Result<Option<Frame>> {
        loop {
            let at = self.stream.position();
            let (bytes, is_end) = self.source.bytes(at);
            let step = self.stream.next_step(bytes, is_end);
            // What has been taken need not be kept while the next bytes are awaited.
            self.source.go_to(self.stream.position());
            self.check_cancelled()?;
            match step? {
                Step::Frame(frame) => {
                    if let Some(frame) = self.told(*frame)? {
                        return Ok(Some(frame));
                    }
                }
                // Nothing will come, whatever follows.
                Step::NeedMoreData(_) if self.has_failed() => {
                    self.collect()?;
                    return self.finish();
                }
                Step::NeedMoreData(more) => {
                    // Shared bytes are all there: the decoder has gone to another place.
                    if !self.source.is_shared() && !self.source.fill(more)? {
                        let waited = self.stream.stop_waiting();
                        self.check_cancelled()?;
                        let Some(waited) = waited else { return Ok(None) };
                        if let Some(frame) = self.told(waited)? {
                            return Ok(Some(frame));
                        }
                    }
                }
                Step::End => {
                    self.collect()?;
                    return self.finish();
                }
            }
        }
    }

    /// Refuses what the decoder gives once it was told to end: parts of it are missing.
    ///
    /// # Errors
    /// It was cancelled.
    fn check_cancelled(&self) -> Result<()> {
        match self.cancel.is_requested() {
            true => Err(Error::Cancelled),
            false => Ok(()),
        }
    }

    /// A frame as it is given out, with what was found wrong up to it.
    ///
    /// # Errors
    /// As [`Self::collect`] and [`Self::frame`].
    fn told(&mut self, decoded: DecodedFrame) -> Result<Option<Frame>> {
        self.collect()?;
        self.frame(decoded)
    }

    fn has_failed(&self) -> bool {
        self.stream.decoder().is_some_and(|decoder| decoder.has_failed())
    }

    /// Takes what the decoder has found wrong since the last frame.
    ///
    /// # Errors
    /// Something was over a limit, or the decoder is at fault.
    fn collect(&mut self) -> Result<()> {
        let (errors, lost) = self.stream.take_report();
        let ends = |error: &&StreamError| error.class() == Class::OverLimit || error.is_fault();
        if let Some(&error) = errors.iter().find(ends) {
            return Err(error.into());
        }
        self.warnings.extend(errors.into_iter().map(Warning::Damaged));
        self.warnings.extend(lost.into_iter().map(Warning::Lost));
        Ok(())
    }

    /// A frame as it is given out; none if nothing is known of it, or if another one is sought.
    ///
    /// # Errors
    /// Planes or identities that do not fit together.
    fn frame(&mut self, decoded: DecodedFrame) -> Result<Option<Frame>> {
        let Some(&sequence) = self.stream.sequence().filter(|_| decoded.index >= self.from) else {
            self.stream.memory().recycle_integers(decoded.planes);
            return Ok(None);
        };
        if decoded.is_lost {
            self.warnings.push(Warning::Lost(decoded.index..=decoded.index));
            return Ok(None);
        }
        let Some(point) = self.stream.decoder().map(|decoder| decoder.frame_point()) else { return Ok(None) };
        let warnings = core::mem::take(&mut self.warnings);
        Frame::new(decoded, point, sequence, warnings, self.stream.memory().clone()).map(Some)
    }

    fn finish(&mut self) -> Result<Option<Frame>> {
        self.state = State::Ended;
        match self.warnings.is_empty() {
            true => Ok(None),
            false => Err(Error::Incomplete(core::mem::take(&mut self.warnings))),
        }
    }

    /// Whether no more frames will come, whatever is pushed.
    pub fn is_finished(&self) -> bool {
        self.state != State::Decoding
    }

    /// Goes to a frame: the next one that is given out has its index, or a higher one where that is missing. Decoding
    /// starts at the GOP of the frame if the stream has an index, and at the first GOP otherwise. This works after the end
    /// and after errors too; what was lost before is forgotten.
    ///
    /// # Errors
    /// A decoder that bytes are pushed to. A time in a stream that cannot be decoded.
    ///
    /// ```
    /// # let stream = include_bytes!("../examples/talk.gss").to_vec();
    /// use splatstream::Position;
    ///
    /// let mut decoder = splatstream::Decoder::from_bytes(stream);
    /// decoder.seek(Position::Frame(5))?;
    /// assert_eq!(decoder.next_frame()?.map(|frame| frame.index()), Some(5));
    /// # Ok::<(), splatstream::Error>(())
    /// ```
    pub fn seek(&mut self, to: Position) -> Result<()> {
        if self.source.is_pushed() {
            return Err(Error::NotSeekable);
        }
        let frame = match to {
            Position::Frame(frame) => frame,
            Position::Time(time) => self.frame_at(time)?,
        };
        self.from = frame;
        self.warnings.clear();
        self.state = State::Decoding;
        self.start = gop_of(&mut self.source, frame, &self.limits.of_format()).map(|gop| gop.offset);
        match self.start {
            Some(gop) => self.stream.go_to(gop),
            None => self.restart(),
        }
        Ok(())
    }

    /// The frame that is shown at a time.
    fn frame_at(&mut self, time: Duration) -> Result<u32> {
        // The sequence parameters come with the first frame.
        if self.stream.sequence().is_none() {
            self.next_frame()?;
        }
        let (rate, ticks) =
            self.stream.sequence().map_or((1, 1), |all| (all.ticks_per_second, all.ticks_per_frame));
        let frames = time.as_nanos() * u128::from(rate) / 1_000_000_000 / u128::from(ticks.max(1));
        Ok(u32::try_from(frames).unwrap_or(u32::MAX))
    }

    /// What the stream says of its scene, for viewers: what points up, cameras, the background. None before it has come.
    pub fn description(&self) -> Option<&SceneDescription> {
        self.stream.decoder().and_then(|decoder| decoder.scene())
    }

    /// The operating point of everything that the stream has, once the sequence parameters have come.
    pub fn highest_point(&self) -> Option<OperatingPoint> {
        self.stream.sequence().map(OperatingPoint::highest)
    }

    /// From a frame to the next at the full frame rate, once the sequence parameters have come.
    pub fn frame_duration(&self) -> Option<Duration> {
        self.stream.sequence().map(|sequence| time_of(1, sequence))
    }

    /// Frames in the stream, once the sequence parameters have come, if these say it.
    pub fn frame_count(&self) -> Option<u32> {
        self.stream.sequence().map(|sequence| sequence.frame_count).filter(|&count| count > 0)
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

/// The frames, up to the last one or the first error. Of a decoder that bytes are pushed to those that are complete.
impl Iterator for Decoder {
    type Item = Result<Frame>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_frame().transpose()
    }
}

/// A decoder of a stream from its start.
fn stream(limits: &Limits, point: OperatingPoint, cancel: &Cancel, ahead: bool) -> StreamDecoder {
    let mut stream = StreamDecoder::new(&Options {
        limits: limits.of_format(),
        operating_point: point,
        identities: true,
        budget: limits.budget(),
        ahead,
        ..Options::default()
    });
    stream.set_interrupt(cancel.clone());
    stream
}
