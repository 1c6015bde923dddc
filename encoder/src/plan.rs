//! What holds for all frames of a sequence, found once: with it, parts of the sequence are encoded anywhere.

mod record;

pub(crate) use record::described;
pub use record::{PlanRecord, PlannedSteps, PlannedTarget, Single};

use crate::checked::{CheckedSource, named};
use crate::error::Error;
use crate::first_frame::{first_ranking, looking};
use crate::frame::learning;
use crate::gop::SpanCoder;
use crate::importance::Ranking;
use crate::report::{Report, TargetReport};
use crate::sequence::{Analysis, analyse};
use crate::settings::Settings;
use crate::shard::Shard;
use crate::source::FrameSource;
use crate::spans::span::{Common, Span};
use crate::spans::{Coding, Judge, Spans, at_once};
use crate::verification::{Tried, Verifier};
use crate::writer::{Coded, Head, Record, UnitWriter};
use core::ops::Range;
use splatstream_format::Limits;
use splatstream_format::payload::Network;
use splatstream_format::syntax::{FrameType, Profile, SequenceParameters};
use std::io::Write;

/// Where the first GOP takes more than this part of what its I frames let expect of I frames alone, these are tried.
const DOUBTFUL: f64 = 0.6;

/// Frames that each stand for themselves, without layers, are preferred to a stream that takes more than this times as
/// many bytes.
const LARGER: f64 = 1.005;

/// What holds for all frames of a sequence: steps, ranges, layers, the network.
///
/// [`encode`](fn@crate::encode) finds it and codes all GOPs with it. Where that takes too long for one machine, each
/// machine [encodes a shard](Plan::encode_shard), and [`concat`](fn@crate::concat) joins them to the stream that
/// `encode` would have written, byte for byte. Plans are the same wherever they are made; a
/// [record](Plan::record) carries one from machine to machine.
///
/// ```
/// use splatstream_encoder::{Settings, plan};
/// use splatstream_files::builtin::BuiltinScene;
///
/// let scene = BuiltinScene { gaussians: 100, frames: 4, ..BuiltinScene::default() };
/// let mut frames: Vec<_> = (0..scene.frames).map(|number| scene.frame(number)).collect();
/// let settings = Settings { gop: 2, ..Settings::default() };
/// let plan = plan(&mut frames, &settings)?;
/// assert_eq!(plan.shards(), 2);
/// let mut shard = Vec::new();
/// plan.encode_shard(&mut frames, (1, 2), &mut shard, &mut |_, _| ())?;
/// # Ok::<(), splatstream_encoder::Error>(())
/// ```
pub struct Plan {
    /// What was asked for, as it was asked for.
    asked: Settings,
    /// With steps that are settled.
    settings: Settings,
    analysis: Analysis,
    network: Option<Network>,
    /// Knows the order of the first frame, where that was needed; none where the plan comes from a record.
    ranking: Option<Ranking>,
    target: Option<TargetReport>,
    /// What fitting has seen of the first frame with these steps; none where it has not drawn just these.
    tried: Option<Tried>,
    stands_alone: bool,
    /// A digest of each frame as it is read; empty where all frames are coded at once.
    frame_digests: Vec<u64>,
}

impl Plan {
    /// With steps that are settled.
    pub(crate) fn new(
        source: &mut dyn FrameSource,
        asked: &Settings,
        settings: Settings,
        ranking: Ranking,
    ) -> Result<Self, Error> {
        let analysis = analyse(source, &settings)?;
        let ranking = looking(source, ranking, &settings)?;
        let network = learning::network(source, &settings, &analysis)?;
        let stands_alone = asked.may_predict() && !settings.may_predict();
        let (asked, ranking) = (asked.clone(), Some(ranking));
        Ok(Self {
            asked,
            settings,
            analysis,
            network,
            ranking,
            target: None,
            tried: None,
            stands_alone,
            frame_digests: Vec::new(),
        })
    }

    /// The same with how its steps were found.
    pub(crate) fn with_target(self, target: TargetReport) -> Self {
        Self { target: Some(target), ..self }
    }

    /// The same with a digest of each frame as it was read.
    pub(crate) fn with_frame_digests(self, frame_digests: Vec<u64>) -> Self {
        Self { frame_digests, ..self }
    }

    /// The same with what fitting has seen of the first frame.
    pub(crate) fn with_tried(self, tried: Option<Tried>) -> Self {
        Self { tried, ..self }
    }

    /// The same with frames that each stand for themselves, in one layer.
    pub(crate) fn alone(&self, source: &mut dyn FrameSource) -> Result<Self, Error> {
        let (settings, ranking) = (self.settings.clone().alone(), self.ranking(source, true)?);
        let plan = Self::new(source, &self.asked, settings, ranking)?;
        Ok(Self { target: self.target, ..plan })
    }

    /// The plan with frames that stand for themselves, if the first GOP is smaller with it. `coded` and `report`: the first
    /// GOP with this one.
    ///
    /// # Errors
    /// As [`encode`](fn@crate::encode).
    pub(crate) fn better_alone(
        &self,
        source: &mut dyn FrameSource,
        coded: &Coded,
        report: &Report,
    ) -> Result<Option<Self>, Error> {
        if !is_doubtful(report) {
            return Ok(None);
        }
        let alone = self.alone(source)?;
        let (smaller, _) = alone.code(source, Span { first: 0, end: report.coded.len() as u32 })?;
        Ok((coded.bytes() as f64 > LARGER * smaller.bytes() as f64).then_some(alone))
    }

    /// Shards that the sequence can be cut into, at most: the GOPs that it has if no frame forces another one.
    pub fn shards(&self) -> u32 {
        self.spans(0..self.analysis.parameters.frame_count).left()
    }

    /// The frames of shard `number` of `count`, counted from 1.
    ///
    /// # Errors
    /// A number that is not from 1 to `count`, or more shards than there can be.
    pub fn frames_of_shard(&self, (number, count): (u32, u32)) -> Result<Range<u32>, Error> {
        let (spans, frames) = (self.shards(), self.analysis.parameters.frame_count);
        if !(1..=count).contains(&number) {
            return Err(Error::Setting {
                name: "shard",
                value: format!("{number}/{count}"),
                allowed: "1/N to N/N",
            });
        }
        if count > spans {
            return Err(Error::Shards { count, most: spans });
        }
        let length = self.settings.gop_length();
        let start = |number: u32| {
            let span = u64::from(number).saturating_mul(spans.into()).checked_div(count.into()).unwrap_or(0);
            (span as u32).saturating_mul(length).min(frames)
        };
        Ok(start(number.saturating_sub(1))..start(number))
    }

    /// Encodes shard `number` of `count`, counted from 1: a stream of its own, that begins with frame 0. It says in a
    /// unit of private data what it is a part of, which [`concat`](fn@crate::concat) leaves out. `progress` is called with frames of the
    /// shard. Frames in the report and in errors are counted in the whole sequence.
    ///
    /// # Errors
    /// As [`encode`](fn@crate::encode) and [`Plan::frames_of_shard`]; a source that is not the one of the plan.
    pub fn encode_shard(
        &self,
        source: &mut dyn FrameSource,
        (number, count): (u32, u32),
        sink: &mut dyn Write,
        progress: crate::Progress<'_>,
    ) -> Result<Report, Error> {
        let frames = self.frames_of_shard((number, count))?;
        let (shards, sequence_frames) = ((number, count), self.analysis.parameters.frame_count);
        let shard = Shard { plan: self.record()?.digest(), shards, frames: frames.clone(), sequence_frames };
        if source.len() != sequence_frames {
            return Err(Error::OtherFrames { found: source.len(), planned: sequence_frames });
        }
        let mut source =
            CheckedSource::new(source, &self.settings).expecting(&self.analysis.counts, &self.frame_digests);
        let encoded = self.encode(&mut source, (frames.clone(), Some(shard)), sink, progress);
        let mut report = encoded.map_err(named)?;
        (report.target, report.stands_alone) = (self.target, self.stands_alone);
        // The first frame of the sequence is read for the views, whichever shard has it.
        report.leave_out(source.into_dropped().into_iter().filter(|dropped| frames.contains(&dropped.frame)));
        Ok(report)
    }

    /// Encodes frames of the sequence, all of them or those of a shard.
    pub(crate) fn encode(
        &self,
        source: &mut dyn FrameSource,
        frames: (Range<u32>, Option<Shard>),
        sink: &mut dyn Write,
        progress: crate::Progress<'_>,
    ) -> Result<Report, Error> {
        let report = self.encode_judged(source, frames, sink, progress, None)?;
        report.ok_or(Error::Fault("nothing was written, and nobody refused it"))
    }

    /// The same. Nothing is written and none is given where `judge` refuses the first span.
    pub(crate) fn encode_judged(
        &self,
        source: &mut dyn FrameSource,
        (frames, shard): (Range<u32>, Option<Shard>),
        sink: &mut dyn Write,
        progress: crate::Progress<'_>,
        judge: Option<Judge<'_>>,
    ) -> Result<Option<Report>, Error> {
        let settings = &self.settings;
        let frame_count = frames.end.saturating_sub(frames.start);
        let sequence = SequenceParameters { frame_count, ..self.analysis.parameters };
        let ranking = self.ranking(source, frames.start == 0)?;
        let mut report = Report::new(&self.analysis, settings, ranking.importance());
        let mut record = Record::new(settings.profile(), &sequence, frames.start);
        let is_verified = settings.verify || settings.has_target();
        record.verifier = is_verified.then(|| Verifier::new(frames.clone()));
        let mut writer = UnitWriter::new(sink, &mut record);
        let spans = self.spans(frames);
        let at_once = at_once(settings, &self.analysis, &spans, settings.max_memory);
        let description = self.analysis.description(settings);
        let head =
            Head { level: self.analysis.level, description: Some(&description), shard: shard.as_ref() };
        let mut coding = Coding {
            source,
            common: self.common(),
            head: Some(head),
            writer: &mut writer,
            report: &mut report,
            progress: &mut |done| progress(done, frame_count),
        };
        if !coding.run(spans, ranking, at_once, judge)? {
            return Ok(None);
        }
        writer.finish()?;
        (report.bytes, report.gops, report.frames) = (record.offset, record.gops, frame_count);
        let tried = self.tried.as_ref().filter(|_| is_as_tried(&report, settings));
        let compare = |verifier: Verifier| verifier.compare(source, settings, tried);
        report.pictures = record.verifier.map(compare).transpose()?;
        Ok(Some(report))
    }

    /// Codes a span to memory.
    pub(crate) fn code(&self, source: &mut dyn FrameSource, span: Span) -> Result<(Coded, Report), Error> {
        let mut coded = Coded::default();
        let (ranking, mut progress) = (self.ranking(source, true)?, |_| ());
        let report = SpanCoder::new(source, self.common(), ranking, &mut coded, &mut progress).code(span)?;
        Ok((coded, report))
    }

    /// The ranking that the first GOP is coded with, or those after it.
    fn ranking(&self, source: &mut dyn FrameSource, is_first: bool) -> Result<Ranking, Error> {
        match &self.ranking {
            Some(ranking) if is_first => Ok(ranking.clone()),
            Some(ranking) => Ok(ranking.for_later()),
            None if is_first && self.asked.has_target() => first_ranking(source, &self.asked),
            None => looking(source, Ranking::new(&self.settings), &self.settings),
        }
    }

    pub(crate) fn spans(&self, frames: Range<u32>) -> Spans {
        Spans::new(frames, self.settings.gop_length())
    }

    fn common(&self) -> Common<'_> {
        Common {
            settings: &self.settings,
            sequence: self.analysis.parameters,
            limits: Limits::of_level(self.analysis.level),
            network: self.network.as_ref(),
        }
    }
}

/// Whether frames that each stand for themselves might take fewer bytes than a GOP did.
fn is_doubtful(report: &Report) -> bool {
    share_of_intra(report) > DOUBTFUL
}

/// What a Gaussian of all frames takes, as a part of what one of an I frame does. Of a single frame nothing.
pub(crate) fn share_of_intra(report: &Report) -> f64 {
    let of = |counts: fn(FrameType) -> bool| {
        let frames = report.coded.iter().filter(|frame| counts(frame.frame_type));
        frames.fold((0.0, 0.0), |sum, frame| (sum.0 + frame.bytes as f64, sum.1 + f64::from(frame.gaussians)))
    };
    let (all, intra) = (of(|_| true), of(|kind| kind == FrameType::Intra));
    let share = all.0 * intra.1 / (intra.0 * all.1);
    if report.coded.len() > 1 && share.is_finite() { share } else { 0.0 }
}

/// Whether a decoder has of a stream what [fitting](crate::allocation) made of its only frame to draw it: fitting knows no
/// codebook, no predictor, and no values that are not the nearest to those of the source.
fn is_as_tried(report: &Report, settings: &Settings) -> bool {
    let is_plain = settings.profile() == Profile::Intra && settings.finetune.is_none();
    is_plain && report.frames == 1 && report.sh_codebook_entries == 0
}
