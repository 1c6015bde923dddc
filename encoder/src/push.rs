//! Frames in, bytes out as they are ready.

use crate::checked::{CheckedSource, named};
use crate::error::Error;
use crate::frame::learning;
use crate::gop::SequenceCoder;
use crate::importance::Ranking;
use crate::isolated::Isolated;
use crate::progress::Progress;
use crate::report::{Dropped, Report};
use crate::room::{Announced, announce};
use crate::sequence::Survey;
use crate::settings::{Settings, Size};
use crate::source::FrameSource;
use crate::target;
use crate::writer::{Record, UnitWriter};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_format::Limits;
use splatstream_format::payload::Network;
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::GaussianFrame;
use std::collections::VecDeque;
use std::io::Write;

/// Encodes frames as they come: each GOP is written once its frames are there, and one more.
///
/// A stream begins with the ranges of all its frames. They are taken from the frames of the first GOP, with room for
/// later ones, and so are the steps where the [settings](Settings) ask for a PSNR or for bits per Gaussian. What leaves
/// these ranges is coded as the nearest that does not, and [reported](Report::isolated). A sequence of one GOP is
/// encoded as [`encode`](crate::encode()) does, which looks at all frames first and writes a slightly smaller stream.
///
/// Memory is that of the frames of a GOP and of coding them, whatever the number of frames; the report takes some 150
/// bytes for each.
///
/// ```
/// use splatstream_encoder::{Encoder, Settings};
/// use splatstream_files::builtin::BuiltinScene;
///
/// let scene = BuiltinScene { gaussians: 100, frames: 5, ..BuiltinScene::default() };
/// let mut bytes = Vec::new();
/// let mut encoder = Encoder::new(&mut bytes, Settings { gop: 2, ..Settings::default() });
/// for number in 0..scene.frames {
///     encoder.push(scene.frame(number))?;
/// }
/// let report = encoder.finish()?;
/// assert_eq!((report.frames, report.bytes), (5, bytes.len() as u64));
/// # Ok::<(), splatstream_encoder::Error>(())
/// ```
pub struct Encoder<W> {
    sink: W,
    settings: Settings,
    window: Window,
    /// None until there are more frames than the first GOP may have.
    stream: Option<Stream>,
    /// Told how many frames have been coded.
    told: Option<Box<dyn FnMut(u32) + Send>>,
}

/// The frames that are not coded yet.
#[derive(Default)]
struct Window {
    /// The number of the first.
    first: u32,
    frames: VecDeque<GaussianFrame>,
    cancel: Interrupt,
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
    /// Forgets the frames before one.
    fn drop_before(&mut self, number: u32) {
        self.frames.drain(..(number.saturating_sub(self.first) as usize).min(self.frames.len()));
        self.first = number;
    }
}

/// A stream of which some GOPs have been written.
struct Stream {
    /// With steps that are settled.
    settings: Settings,
    sequence: SequenceParameters,
    announced: Announced,
    limits: Limits,
    ranking: Ranking,
    network: Option<Network>,
    record: Record,
    report: Report,
    looked_at: u32,
}

impl<W: Write> Encoder<W> {
    /// An encoder that writes to `sink`.
    pub fn new(sink: W, settings: Settings) -> Self {
        Self { sink, settings, window: Window::default(), stream: None, told: None }
    }

    /// Lets another thread end the work: [`Encoder::push`] and [`Encoder::finish`] then give [`Error::Cancelled`], before
    /// they turn to another frame.
    ///
    /// ```
    /// use splatstream_decoder::interrupt::Interrupt;
    /// use splatstream_encoder::{Encoder, Error, Settings};
    /// use splatstream_files::builtin::BuiltinScene;
    ///
    /// let cancel = Interrupt::new();
    /// let mut encoder = Encoder::new(Vec::new(), Settings::default());
    /// encoder.set_cancel(cancel.clone());
    /// encoder.push(BuiltinScene { gaussians: 100, ..BuiltinScene::default() }.frame(0))?;
    /// std::thread::spawn(move || cancel.request()).join().ok();
    /// assert!(matches!(encoder.finish(), Err(Error::Cancelled)));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn set_cancel(&mut self, cancel: Interrupt) {
        self.window.cancel = cancel;
    }

    /// Calls `told` with the number of frames that have been coded, after each. Where the settings ask for a PSNR or a size,
    /// a sequence of one GOP is coded several times, and told of each time.
    pub fn set_progress(&mut self, told: impl FnMut(u32) + Send + 'static) {
        self.told = Some(Box::new(told));
    }

    /// Takes the next frame, and writes the GOP that it completes.
    ///
    /// # Errors
    /// Settings or frames that cannot be coded, a sink that cannot be written, a [cancellation](Encoder::set_cancel). No
    /// stream comes of what was written then.
    pub fn push(&mut self, frame: GaussianFrame) -> Result<(), Error> {
        let number = self.window.len();
        let frame = match &mut self.stream {
            Some(stream) => stream.hold(frame, number)?,
            None => frame,
        };
        self.window.frames.push_back(frame);
        // With one frame more, what would be left of the sequence is known not to be one frame.
        if self.window.frames.len() as u64 > u64::from(self.settings.gop_length()) {
            self.gop()?;
        }
        Ok(())
    }

    /// Writes the rest of the stream.
    ///
    /// # Errors
    /// As [`Encoder::push`]; no frame at all.
    pub fn finish(mut self) -> Result<Report, Error> {
        if self.stream.is_none() {
            let mut told = |done, _| tell(&mut self.told, done);
            let report = crate::encode(&mut self.window, &self.settings, &mut self.sink, &mut told)
                .map_err(cancelled)?;
            self.sink.flush()?;
            return Ok(report);
        }
        while !self.window.frames.is_empty() {
            self.gop()?;
        }
        let Some(Stream { mut record, mut report, .. }) = self.stream else { return Err(Error::NoFrames) };
        UnitWriter::new(&mut self.sink, &mut record).finish()?;
        self.sink.flush()?;
        (report.bytes, report.frames, report.gops) = (record.offset, self.window.first, record.gops);
        Ok(report)
    }

    /// Codes the first GOP of the frames that are there.
    fn gop(&mut self) -> Result<(), Error> {
        if self.stream.is_none() {
            let mut source = CheckedSource::new(&mut self.window, self.settings.drop_invalid);
            let started = Stream::start(&mut source, &self.settings, &mut self.sink);
            self.stream = Some(started.map_err(|error| cancelled(named(error)))?);
        }
        let Some(stream) = &mut self.stream else { return Ok(()) };
        let first = self.window.first;
        let last = self.window.len().min(first.saturating_add(stream.settings.gop_length()));
        let mut source = CheckedSource::new(&mut self.window, stream.settings.drop_invalid);
        let mut told = |done, _| tell(&mut self.told, done);
        let end = stream.gop(&mut source, (first, last), &mut self.sink, &mut told);
        let end = end.map_err(|error| cancelled(named(error)))?;
        let coded = |dropped: &Dropped| dropped.frame < end;
        stream.report.leave_out(source.into_dropped().into_iter().filter(coded));
        self.window.drop_before(end);
        Ok(())
    }
}

impl Stream {
    /// Settles what holds for all frames, and writes what stands before the first GOP.
    fn start(source: &mut dyn FrameSource, settings: &Settings, sink: &mut dyn Write) -> Result<Self, Error> {
        let (settings, ranking, tried) = settled(source, settings)?;
        let (analysis, announced) = announce(Survey::of(source, &settings)?, &settings)?;
        let mut report = Report::new(&analysis, &settings, ranking.importance());
        if let Some(tried) = tried {
            report.pictures = tried.pictures;
            report.target = tried.target;
            report.stands_alone = tried.stands_alone;
        }
        let mut record = Record::new(settings.profile(), &analysis.parameters);
        UnitWriter::new(sink, &mut record).start(&analysis, &settings.description)?;
        let network = learning::network(source, &settings, &analysis)?;
        Ok(Self {
            sequence: analysis.parameters,
            announced,
            limits: Limits::of_level(analysis.level),
            settings,
            ranking,
            network,
            record,
            report,
            looked_at: 0,
        })
    }

    /// A frame within what was announced.
    fn hold(&mut self, frame: GaussianFrame, number: u32) -> Result<GaussianFrame, Error> {
        let (frame, found) = self.announced.hold(frame, number)?;
        found.into_iter().for_each(|found| Isolated::add(Some(found), &mut self.report.isolated));
        Ok(frame)
    }

    /// Codes a GOP of the frames from `first` to `last` at most, and gives the frame after it.
    fn gop(
        &mut self,
        source: &mut dyn FrameSource,
        (first, last): (u32, u32),
        sink: &mut dyn Write,
        progress: Progress<'_>,
    ) -> Result<u32, Error> {
        let mut writer = UnitWriter::new(sink, &mut self.record);
        let mut coder = SequenceCoder {
            source,
            settings: &self.settings,
            sequence: self.sequence,
            ranking: &mut self.ranking,
            writer: &mut writer,
            report: &mut self.report,
            network: self.network.take(),
            limits: self.limits,
            recorder: None,
            looked_at: self.looked_at,
        };
        let end = coder.gop(first, last, progress)?;
        (self.network, self.looked_at) = (coder.network, coder.looked_at);
        Ok(end)
    }
}

fn tell(told: &mut Option<Box<dyn FnMut(u32) + Send>>, done: u32) {
    told.iter_mut().for_each(|told| told(done));
}

/// A frame that was not given out because of a cancellation is no fault of its source.
fn cancelled(error: Error) -> Error {
    match &error {
        Error::Source { source, .. } if matches!(source.downcast_ref(), Some(Error::Cancelled)) => {
            Error::Cancelled
        }
        _ => error,
    }
}

/// Settings with steps for the frames that are there, and what trying them has shown, if it was done.
///
/// # Errors
/// A size of the whole stream, of which the number of frames is not known.
fn settled(
    source: &mut dyn FrameSource,
    settings: &Settings,
) -> Result<(Settings, Ranking, Option<Report>), Error> {
    if let Some(Size::Bytes(bytes)) = settings.size {
        let allowed = "bits per Gaussian where frames are pushed, whose number is not known";
        return Err(Error::Setting { name: "size", value: format!("{bytes} bytes"), allowed });
    }
    if settings.psnr.is_some() || settings.size.is_some() {
        let (settled, ranking, report) = target::settle(source, settings)?;
        return Ok((settled, ranking, Some(report)));
    }
    let tried = match settings.verify {
        true => Some(crate::pass::encode_once(
            source,
            settings,
            Ranking::new(settings),
            &mut std::io::sink(),
            &mut |_, _| (),
        )?),
        false => None,
    };
    Ok((Settings { verify: false, ..settings.clone() }, Ranking::new(settings), tried))
}
