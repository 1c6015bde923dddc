//! Spans: runs of frames that are coded by themselves, several at the same time.
//!
//! A sequence is cut into spans of as many frames as a GOP may have, counted from its first frame. GOPs end early where
//! frames have too little in common, but none goes on past the end of its span. So what is coded of a span follows from
//! its frames and from what holds for the whole sequence, never from another span: it is the same on any number of
//! threads, and on any number of machines.
//!
//! Spans that are coded at the same time have their frames in memory and write to memory. The thread that was called
//! reads frames, hands spans to the threads of rayon, and writes what comes back in the order of the sequence. There
//! are never more spans under way than `at_once`, finished ones that wait for an earlier one included: memory does not
//! grow with the length of the sequence.

mod job;
pub(crate) mod span;

use crate::error::Error;
use crate::gop::SpanCoder;
use crate::importance::Ranking;
use crate::memory::Footprint;
use crate::report::Report;
use crate::sequence::Analysis;
use crate::settings::Settings;
use crate::source::FrameSource;
use crate::writer::{Coded, Head, UnitWriter};
use core::ops::Range;
use job::Job;
use span::{Common, Span};
use std::collections::VecDeque;

/// The spans of some frames of a sequence.
#[derive(Debug, Clone)]
pub(crate) struct Spans {
    frames: Range<u32>,
    length: u32,
}

impl Spans {
    /// Of frames of a sequence whose spans have `length` frames, 1 or more.
    pub(crate) fn new(frames: Range<u32>, length: u32) -> Self {
        Self { frames, length: length.max(1) }
    }

    /// How many are left.
    pub(crate) fn left(&self) -> u32 {
        let of = |frame: u32| frame.checked_div(self.length).unwrap_or(0);
        match self.frames.is_empty() {
            true => 0,
            false => {
                of(self.frames.end.saturating_sub(1)).saturating_sub(of(self.frames.start)).saturating_add(1)
            }
        }
    }
}

impl Iterator for Spans {
    type Item = Span;

    fn next(&mut self) -> Option<Span> {
        let first = self.frames.start;
        if self.frames.is_empty() {
            return None;
        }
        let number = first.checked_div(self.length)?;
        let end = number.saturating_add(1).saturating_mul(self.length).min(self.frames.end);
        self.frames.start = end;
        Some(Span { first, end })
    }
}

/// How many GOPs are coded at once: as many as there are threads, but no more than the settings have memory for. `room`: what
/// there is for all that encoding takes.
pub(crate) fn at_once(settings: &Settings, analysis: &Analysis, spans: &Spans, room: u64) -> usize {
    let gaussians = analysis.counts.iter().copied().max().map_or(0, u64::from);
    let frames = spans.frames.end.saturating_sub(spans.frames.start);
    let footprint = Footprint::new(gaussians, analysis.source_sh_degree, frames, settings);
    let of_another = footprint.of_another_gop().max(1);
    let together = settings.gop_memory.checked_div(of_another).unwrap_or(0);
    // One is coded in any case, from frames that are read when they are needed. Those of several are in memory.
    let beside_one =
        room.saturating_sub(footprint.bytes()).saturating_sub(footprint.frames_of_gop_in_memory());
    let in_room = beside_one.checked_div(of_another).unwrap_or(0).saturating_add(1);
    let fitting = usize::try_from(together.min(in_room)).unwrap_or(usize::MAX).max(1);
    fitting.min(rayon::current_num_threads()).min(spans.left() as usize)
}

/// Looks at the first span once it is coded; whether to go on.
pub(crate) type Judge<'j> = &'j mut dyn FnMut(&mut dyn FrameSource, &Coded, &Report) -> Result<bool, Error>;

/// Codes spans of a source, and writes them.
pub(crate) struct Coding<'c, 'w> {
    pub(crate) source: &'c mut dyn FrameSource,
    pub(crate) common: Common<'c>,
    /// To be written before the first of them; none where it is written already.
    pub(crate) head: Option<Head<'c>>,
    pub(crate) writer: &'c mut UnitWriter<'w>,
    /// What was written.
    pub(crate) report: &'c mut Report,
    /// Is told how many frames are done.
    pub(crate) progress: &'c mut dyn FnMut(u32),
}

impl Coding<'_, '_> {
    /// Codes spans, so many at once. `ranking` knows the order of the first frame, if it is known. `judge` is shown the
    /// first span before anything is written; if it says no, nothing is. Tells whether everything was written.
    ///
    /// # Errors
    /// As [`encode`](fn@crate::encode); of several the one of the earliest span.
    pub(crate) fn run(
        &mut self,
        spans: Spans,
        ranking: Ranking,
        at_once: usize,
        judge: Option<Judge<'_>>,
    ) -> Result<bool, Error> {
        match at_once {
            0 | 1 => self.one_by_one(spans, ranking, judge),
            _ => self.several(spans, ranking, at_once, judge),
        }
    }

    /// Frames are read when they are needed, and what is coded of them is written at once, but for the span that is judged.
    fn one_by_one(
        &mut self,
        spans: Spans,
        ranking: Ranking,
        mut judge: Option<Judge<'_>>,
    ) -> Result<bool, Error> {
        let start = spans.frames.start;
        let mut rankings = rankings(ranking);
        for span in spans {
            if judge.is_none() {
                self.begin()?;
            }
            let done = span.first.saturating_sub(start);
            let progress = &mut |frames: u32| (self.progress)(done.saturating_add(frames));
            let ranking = rankings();
            let report = match judge.take() {
                None => {
                    SpanCoder::new(self.source, self.common, ranking, self.writer, progress).code(span)?
                }
                Some(judge) => {
                    let mut coded = Coded::default();
                    let coder = SpanCoder::new(self.source, self.common, ranking, &mut coded, progress);
                    let report = coder.code(span)?;
                    if !judge(self.source, &coded, &report)? {
                        return Ok(false);
                    }
                    self.begin()?;
                    coded.write_to(self.writer)?;
                    report
                }
            };
            self.writer.pass_on()?;
            self.report.append(report);
        }
        Ok(true)
    }

    fn several(
        &mut self,
        mut spans: Spans,
        ranking: Ranking,
        at_once: usize,
        mut judge: Option<Judge<'_>>,
    ) -> Result<bool, Error> {
        let start = spans.frames.start;
        let mut rankings = rankings(ranking);
        let common = self.common;
        rayon::in_place_scope(|scope| {
            let mut jobs = VecDeque::new();
            loop {
                while jobs.len() < at_once
                    && let Some(span) = spans.next()
                {
                    jobs.push_back(Job::start(scope, self.source, common, span, rankings()));
                }
                let Some(job) = jobs.pop_front() else { return Ok(true) };
                let done = job.span.first.saturating_sub(start);
                let (coded, report) =
                    job.finish(&mut |frames| (self.progress)(done.saturating_add(frames)))?;
                if let Some(judge) = judge.take()
                    && !judge(self.source, &coded, &report)?
                {
                    return Ok(false);
                }
                self.begin()?;
                coded.write_to(self.writer)?;
                self.writer.pass_on()?;
                self.report.append(report);
            }
        })
    }

    /// Writes what stands before the first GOP, if that is not done.
    fn begin(&mut self) -> Result<(), Error> {
        self.head.take().map_or(Ok(()), |head| self.writer.start(&head))
    }
}

/// The ranking of each span: the first may know an order.
fn rankings(first: Ranking) -> impl FnMut() -> Ranking {
    let later = first.for_later();
    let mut first = Some(first);
    move || first.take().unwrap_or_else(|| later.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_counted_from_the_first_frame_of_the_sequence() {
        let spans = |frames, length| {
            let spans = Spans::new(frames, length);
            let count = spans.left();
            let spans: Vec<_> = spans.map(|span| (span.first, span.end)).collect();
            assert_eq!(spans.len(), count as usize);
            spans
        };
        assert_eq!(spans(0..10, 4), [(0, 4), (4, 8), (8, 10)]);
        assert_eq!(spans(4..8, 4), [(4, 8)]);
        assert_eq!(spans(0..3, u32::MAX), [(0, 3)]);
        assert_eq!(spans(7..7, 4), []);
    }
}
