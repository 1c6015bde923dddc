//! Frames in, bytes out as they are ready.

use crate::checked::{CheckedSource, named};
use crate::error::Error;
use crate::first_frame::looking;
use crate::frame::learning;
use crate::importance::Ranking;
use crate::isolated::Isolated;
use crate::memory::{Footprint, bytes_of};
use crate::prune::refuse_pruning;
use crate::report::Report;
use crate::room::{Announced, announce};
use crate::sequence::{Analysis, Survey};
use crate::settings::{Settings, Size};
use crate::source::FrameSource;
use crate::spans::span::Common;
use crate::spans::{Coding, Spans, at_once};
use crate::target;
use crate::window::{FirstFrames, Window};
use crate::writer::{Head, Record, UnitWriter};
use core::ops::Range;
use splatstream_decoder::interrupt::Interrupt;
use splatstream_format::Limits;
use splatstream_format::payload::Network;
use splatstream_gaussians::GaussianFrame;
use std::io::Write;

/// Encodes frames as they come: each GOP is written once its frames are there, the first with one more.
///
/// A stream begins with the ranges of all its frames. They are taken from the frames of the first GOP, with room for
/// later ones, and so are the steps where the [settings](Settings) ask for a PSNR or for bits per Gaussian. What leaves
/// these ranges is coded as the nearest that does not, and [reported](Report::isolated). A sequence of one GOP is
/// encoded as [`encode`](crate::encode()) does, which looks at all frames first and writes a slightly smaller stream.
///
/// Memory is that of the frames of a GOP and of coding them, whatever the number of frames; the report takes some 150
/// bytes for each. Who has more threads than a GOP keeps busy lets [several](Encoder::with_gops_at_once) be coded at
/// once.
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
    /// GOPs whose frames are waited for.
    gops_at_once: u32,
    /// None until there are more frames than the first GOP may have.
    stream: Option<Stream>,
    /// Told how many frames have been coded.
    told: Option<Box<dyn FnMut(u32) + Send>>,
}

/// A stream of which some GOPs have been written.
struct Stream {
    /// With steps that are settled.
    settings: Settings,
    analysis: Analysis,
    announced: Announced,
    /// Of the first GOP.
    ranking: Ranking,
    network: Option<Network>,
    record: Record,
    report: Report,
}

impl<W: Write> Encoder<W> {
    /// An encoder that writes to `sink`.
    pub fn new(sink: W, settings: Settings) -> Self {
        Self { sink, settings, window: Window::default(), gops_at_once: 1, stream: None, told: None }
    }

    /// Lets another thread end the work: [`Encoder::push`] and [`Encoder::finish`] then give [`Error::Cancelled`], before
    /// they turn to another frame or, where values are [fitted to pictures](Settings::finetune), to the next iteration.
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
        if let Some(finetune) = &mut self.settings.finetune {
            finetune.watch = finetune.watch.clone().with_cancel(cancel.clone());
        }
        self.window.cancel = cancel;
    }

    /// Calls `told` with the number of frames that have been coded, after each. Where the settings ask for a PSNR or a size,
    /// a sequence of one GOP is coded several times, and told of each time.
    pub fn set_progress(&mut self, told: impl FnMut(u32) + Send + 'static) {
        self.told = Some(Box::new(told));
    }

    /// The same that waits for the frames of so many GOPs, 1 or more, and codes them at the same time, as far as the
    /// [memory](Settings::gop_memory) is for. The bytes are the same; they come later, and sooner altogether.
    #[must_use]
    pub fn with_gops_at_once(self, gops_at_once: u32) -> Self {
        Self { gops_at_once: gops_at_once.max(1), ..self }
    }

    /// Takes the next frame, and writes the GOPs that it completes.
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
        self.check_memory(&frame, number)?;
        self.window.frames.push_back(frame);
        let complete = u64::from(self.gop_length()).saturating_mul(self.gops_at_once.into());
        // With one frame more, the sequence is known to have more than one GOP.
        let waits_for = complete.saturating_add(self.stream.is_none().into());
        if self.window.frames.len() as u64 >= waits_for {
            self.code()?;
        }
        Ok(())
    }

    /// Writes the rest of the stream.
    ///
    /// # Errors
    /// As [`Encoder::push`]; no frame at all.
    pub fn finish(mut self) -> Result<Report, Error> {
        let is_one_gop = self.window.len() <= self.gop_length();
        if self.stream.is_none() && !is_one_gop {
            self.code()?;
        }
        if self.stream.is_none() {
            let mut told = |done, _| tell(&mut self.told, done);
            let max_memory = self.settings.max_memory.saturating_sub(self.window.bytes());
            let settings = Settings { max_memory, ..self.settings };
            let report =
                crate::encode(&mut self.window, &settings, &mut self.sink, &mut told).map_err(cancelled)?;
            self.sink.flush()?;
            return Ok(report);
        }
        self.code_up_to(self.window.len())?;
        let Some(Stream { mut record, mut report, .. }) = self.stream else { return Err(Error::NoFrames) };
        UnitWriter::new(&mut self.sink, &mut record).finish()?;
        self.sink.flush()?;
        (report.bytes, report.frames, report.gops) = (record.offset, self.window.first, record.gops);
        Ok(report)
    }

    /// Refuses a frame that cannot be coded beside those that wait with it.
    fn check_memory(&self, frame: &GaussianFrame, number: u32) -> Result<(), Error> {
        let waiting = self.window.bytes().saturating_add(bytes_of(frame));
        let allowed = self.settings.max_memory.saturating_sub(waiting);
        Footprint::of(frame, number.saturating_add(1), &self.settings).check(number, allowed)
    }

    /// Frames of a GOP, at most.
    fn gop_length(&self) -> u32 {
        self.stream.as_ref().map_or_else(|| self.settings.gop_length(), |stream| stream.settings.gop_length())
    }

    /// Begins the stream with what its first GOP and one frame more announce; later frames that are there already are held
    /// to it.
    fn start(&mut self) -> Result<(), Error> {
        let frames = self.gop_length().saturating_add(1);
        let waiting = self.window.bytes();
        let mut first = FirstFrames { source: &mut self.window, frames };
        let mut source = CheckedSource::new(&mut first, &self.settings).beside(waiting);
        let mut stream = Stream::start(&mut source, &self.settings, &mut self.sink)
            .map_err(|error| cancelled(named(error)))?;
        for (number, frame) in (0..).zip(&mut self.window.frames).skip(frames as usize) {
            *frame = stream.hold(core::mem::take(frame), number)?;
        }
        self.stream = Some(stream);
        Ok(())
    }

    /// Codes the GOPs of which all frames are there.
    fn code(&mut self) -> Result<(), Error> {
        if self.stream.is_none() {
            self.start()?;
        }
        let there = self.window.len();
        let gops = there.checked_div(self.gop_length()).unwrap_or(0);
        self.code_up_to(gops.saturating_mul(self.gop_length()))
    }

    /// Codes the frames before one, at which a GOP begins.
    fn code_up_to(&mut self, end: u32) -> Result<(), Error> {
        let Some(stream) = &mut self.stream else { return Ok(()) };
        let before = self.window.first;
        let frames = before..end;
        let waiting = self.window.bytes();
        let mut source = CheckedSource::new(&mut self.window, &self.settings).beside(waiting);
        let room = self.settings.max_memory.saturating_sub(waiting);
        let mut told = |done: u32| tell(&mut self.told, before.saturating_add(done));
        let coded = stream.code(&mut source, (frames, room), &mut self.sink, &mut told);
        coded.map_err(|error| cancelled(named(error)))?;
        stream.report.leave_out(source.into_dropped());
        self.window.drop_before(end);
        Ok(())
    }
}

impl Stream {
    /// Settles what holds for all frames, and writes what stands before the first GOP.
    fn start(source: &mut dyn FrameSource, settings: &Settings, sink: &mut dyn Write) -> Result<Self, Error> {
        refuse_pruning(settings)?;
        let (settings, ranking, tried) = settled(source, settings)?;
        let (analysis, announced) = announce(Survey::of(source, &settings)?, &settings)?;
        let mut report = Report::new(&analysis, &settings, ranking.importance());
        if let Some(tried) = tried {
            report.pictures = tried.pictures;
            report.target = tried.target;
            report.stands_alone = tried.stands_alone;
        }
        let mut record = Record::new(settings.profile(), &analysis.parameters, 0);
        let description = analysis.description(&settings);
        let head = Head { level: analysis.level, description: Some(&description), shard: None };
        UnitWriter::new(sink, &mut record).start(&head)?;
        let ranking = looking(source, ranking, &settings)?;
        let network = learning::network(source, &settings, &analysis)?;
        Ok(Self { analysis, announced, settings, ranking, network, record, report })
    }

    /// A frame within what was announced.
    fn hold(&mut self, frame: GaussianFrame, number: u32) -> Result<GaussianFrame, Error> {
        let (frame, found) = self.announced.hold(frame, number)?;
        found.into_iter().for_each(|found| Isolated::add(Some(found), &mut self.report.isolated));
        Ok(frame)
    }

    /// Codes frames that begin and end with a GOP, in so much memory.
    fn code(
        &mut self,
        source: &mut dyn FrameSource,
        (frames, room): (Range<u32>, u64),
        sink: &mut dyn Write,
        progress: &mut dyn FnMut(u32),
    ) -> Result<(), Error> {
        let settings = &self.settings;
        let ranking =
            if self.record.gops.is_empty() { self.ranking.clone() } else { self.ranking.for_later() };
        let spans = Spans::new(frames, settings.gop_length());
        let at_once = at_once(settings, &self.analysis, &spans, room);
        let common = Common {
            settings,
            sequence: self.analysis.parameters,
            limits: Limits::of_level(self.analysis.level),
            network: self.network.as_ref(),
        };
        let mut coding = Coding {
            source,
            common,
            head: None,
            writer: &mut UnitWriter::new(sink, &mut self.record),
            report: &mut self.report,
            progress,
        };
        coding.run(spans, ranking, at_once, None)?;
        Ok(())
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
