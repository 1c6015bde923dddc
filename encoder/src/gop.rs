//! GOPs, frame by frame: I frames, and frames that refer to others.
#![expect(
    clippy::arithmetic_side_effects,
    reason = "numbers of frames rise from the first of a GOP to the end of the sequence, and sizes are of what is in memory"
)]

mod group;
mod intra;
mod means;
mod predicted;
mod worth;

use crate::canonical::{canonicalise, visible};
use crate::checked::digest;
use crate::error::Error;
use crate::frame::CodedFrame;
use crate::frame::recorder::{Recorder, weights};
use crate::frame::target::Target;
use crate::gop_tools::GopTools;
use crate::grid::PositionGrid;
use crate::importance::Ranking;
use crate::isolated::{self, Isolated};
use crate::matching::{shares_little, shares_much};
use crate::motion::follow::follow;
use crate::report::{FrameReport, Report};
use crate::settings::Structure;
use crate::source::FrameSource;
use crate::spans::span::{Common, Span};
use crate::writer::GopSink;
use group::Gop;
use rayon::prelude::*;
use splatstream_format::payload::write_frame;
use splatstream_format::syntax::{
    FrameHeader, FrameRole, FrameType, GopHeader, Profile, UnitHeader, UnitId, UnitType,
};

/// A GOP whose predicted frames take more than this part, on average, is tried as I frames too.
const DOUBTFUL: f64 = 0.5;

/// A GOP gets its number where it is written: how many come before it is not known before.
const UNNUMBERED: u32 = 0;

/// Codes the frames of a span, one after the other.
pub(crate) struct SpanCoder<'a> {
    pub(crate) source: &'a mut dyn FrameSource,
    /// What it has in common with all other spans.
    pub(crate) common: Common<'a>,
    pub(crate) ranking: Ranking,
    /// Where coded GOPs go.
    pub(crate) sink: &'a mut dyn GopSink,
    /// What was coded of the span.
    pub(crate) report: Report,
    /// What a network is trained with, while that is being collected.
    pub(crate) recorder: Option<&'a Recorder>,
    /// Frames before this one have been looked at.
    pub(crate) looked_at: u32,
    /// Is told how many frames of the span are done.
    pub(crate) progress: &'a mut dyn FnMut(u32),
}

/// An I frame to be coded.
struct Intra {
    target: Target,
    /// Its Gaussians, most important first.
    order: Vec<u32>,
}

/// Whether a frame has been predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// It has.
    Predicted,
    /// It shares too little with the frame that it would refer to.
    Unlike,
    /// It takes as many bits as an I frame.
    Dear,
}

impl<'a> SpanCoder<'a> {
    /// Of a span that nothing has been coded of.
    pub(crate) fn new(
        source: &'a mut dyn FrameSource,
        common: Common<'a>,
        ranking: Ranking,
        sink: &'a mut dyn GopSink,
        progress: &'a mut dyn FnMut(u32),
    ) -> Self {
        Self {
            source,
            common,
            ranking,
            sink,
            report: Report::default(),
            recorder: None,
            looked_at: 0,
            progress,
        }
    }

    /// Codes all frames, and reports what was coded.
    ///
    /// # Errors
    /// As [`encode`](fn@crate::encode).
    pub(crate) fn code(mut self, span: Span) -> Result<Report, Error> {
        let mut first = span.first;
        while first < span.end && !self.recorder.is_some_and(Recorder::is_full) {
            first = self.gop(first, span)?;
        }
        Ok(self.report)
    }

    /// Codes a GOP of the frames from `first` to the end of the span at most, and gives the frame after it: it ends where
    /// a frame shares little with the one it would refer to.
    fn gop(&mut self, first: u32, span: Span) -> Result<u32, Error> {
        let (before, last) = ((self.report.clone(), self.looked_at), span.end);
        let intra = self.intra_target(first)?;
        let mut gop = self.start(first, last - first, &intra)?;
        let order = self.weighs_layers(first).then(|| intra.order.clone());
        self.intra(&mut gop, first, intra)?;
        if let Some(order) = order {
            self.weigh_layers(&gop, last, order)?;
        }
        let (end, verdict) = self.others(&mut gop, span)?;
        gop.header = self.header(end - first);
        if end == first + 1 && (verdict != Verdict::Predicted || self.is_rest(first, last)) {
            (self.report, self.looked_at) = before;
            return self.intra_run(first, span, verdict);
        }
        if self.is_doubtful(&before.0, &gop) {
            let after = (self.report.clone(), self.looked_at);
            (self.report, self.looked_at) = before;
            let intra = self.intra_target(first)?;
            let mut alone = self.alone(first, last, intra)?;
            for number in first + 1..end {
                let intra = self.intra_target(number)?;
                self.intra(&mut alone, number, intra)?;
            }
            alone.header = GopHeader::intra(UNNUMBERED, end - first);
            match alone.bytes() < gop.bytes() {
                true => gop = alone,
                false => (self.report, self.looked_at) = after,
            }
        }
        self.write(&mut gop)?;
        Ok(end)
    }

    /// Codes the frames of a GOP after its first, as far as they can be predicted, and gives the frame after them.
    fn others(&mut self, gop: &mut Gop, span: Span) -> Result<(u32, Verdict), Error> {
        let second = gop.first + 1;
        (self.progress)(second - span.first);
        for number in second..span.end {
            let role = gop.header.role(number - gop.first);
            match role.reference {
                None => {
                    let intra = self.intra_target(number)?;
                    self.intra(gop, number, intra)?;
                }
                Some(reference) => {
                    let target = self.target(number)?;
                    let verdict = self.predicted(gop, number, &role, gop.first + reference, &target)?;
                    if verdict != Verdict::Predicted {
                        return Ok((number, verdict));
                    }
                }
            }
            (self.progress)(number + 1 - span.first);
        }
        Ok((span.end, Verdict::Predicted))
    }

    /// Whether a frame is what is left of a span, or of a sequence, that may predict frames.
    fn is_rest(&self, first: u32, last: u32) -> bool {
        let settings = self.common.settings;
        let may_predict = settings.temporal_layers() > 0 && settings.gop > 1;
        may_predict && first > 0 && first + 1 == last
    }

    /// Whether the frames of a GOP might take fewer bits if each stood for itself. `before`: what was written before it.
    fn is_doubtful(&self, before: &Report, gop: &Gop) -> bool {
        let frames = self.report.coded.iter().skip(before.coded.len());
        let predicted = frames.filter(|frame| frame.frame_type != FrameType::Intra);
        let (bytes, gaussians) =
            predicted.fold((0, 0), |sum, frame| (sum.0 + frame.bytes, sum.1 + u64::from(frame.gaussians)));
        let is_trained_with = self.recorder.is_some() || !self.common.settings.tools.survivors;
        !is_trained_with && bytes as f64 > DOUBTFUL * gop.intra_bytes * gaussians as f64
    }

    /// A GOP of I frames in one layer: its first frame.
    fn alone(&mut self, first: u32, last: u32, intra: Intra) -> Result<Gop, Error> {
        let mut gop = self.start(first, last - first, &intra)?;
        gop.header = GopHeader::intra(UNNUMBERED, last - first);
        gop.in_one_layer = true;
        self.intra(&mut gop, first, intra)?;
        Ok(gop)
    }

    /// Codes a GOP of I frames, where the second could not be predicted from the first, and gives the frame after it.
    ///
    /// Frames that share little are I frames until two share much again, which begins a GOP; those of which the
    /// differences are dear are I frames as far as the GOP goes.
    fn intra_run(&mut self, first: u32, span: Span, verdict: Verdict) -> Result<u32, Error> {
        let last = span.end;
        let intra = self.intra_target(first)?;
        let mut gop = self.alone(first, last, intra)?;
        let mut end = first + 1;
        let mut next = (verdict == Verdict::Unlike).then(|| self.target(end)).transpose()?;
        while end < last {
            if let Some(target) = next.take()
                && end + 1 < last
            {
                let after = self.target(end + 1)?;
                if !self.is_unlike(&target, &after) {
                    break;
                }
                next = Some(after);
            }
            let intra = self.intra_target(end)?;
            self.intra(&mut gop, end, intra)?;
            end += 1;
            (self.progress)(end - span.first);
        }
        gop.header = GopHeader::intra(UNNUMBERED, end - first);
        self.write(&mut gop)?;
        Ok(end)
    }

    /// Whether a frame shares too little with the one before it to be predicted from it.
    fn is_unlike(&self, before: &Target, after: &Target) -> bool {
        let matching =
            follow(&before.cloud(), &after.cloud(), &self.measure(), self.common.sequence.position_bits);
        shares_little(&matching) && !(self.by_pictures() && shares_much(&matching))
    }

    /// A GOP of at most so many frames that starts with an I frame.
    fn start(&mut self, first: u32, frames: u32, intra: &Intra) -> Result<Gop, Error> {
        let frame = &intra.target.frame;
        let (sequence, settings) = (&self.common.sequence, self.common.settings);
        let tools = GopTools::new(frame, &intra.order, sequence, settings, frames);
        if self.report.coded.is_empty() {
            tools.report(&mut self.report);
        }
        Ok(Gop {
            first,
            header: self.header(frames),
            units: tools.units(sequence, first)?,
            tools,
            references: (0..settings.temporal_layers()).map(|_| None).collect(),
            anchor: Vec::new(),
            compensation: Vec::new(),
            price_level: 0,
            intra_bytes: f64::INFINITY,
            steadiness: None,
            is_open: false,
            has_learned: false,
            in_one_layer: false,
        })
    }

    /// The header of a GOP of some frames.
    fn header(&self, frames: u32) -> GopHeader {
        match self.common.settings.temporal_layers() {
            0 => GopHeader::intra(UNNUMBERED, frames),
            layers => GopHeader::predicted(UNNUMBERED, frames, layers - 1),
        }
    }

    /// Writes what has been coded of a GOP. Its header and the network it needs are known then.
    fn write(&mut self, gop: &mut Gop) -> Result<(), Error> {
        if !gop.is_open {
            self.sink.gop(&gop.header, gop.first)?;
            if let Some(network) = self.common.network.filter(|_| gop.has_learned) {
                let id = UnitId::of_frame(UnitType::Weights, gop.first);
                self.sink.unit(id, weights(network)?.to_bytes()?)?;
            }
            gop.is_open = true;
        }
        gop.units.drain(..).try_for_each(|(id, payload)| self.sink.unit(id, payload))
    }

    /// A frame in canonical form.
    #[expect(clippy::indexing_slicing, reason = "units are counted by what they index, axes are constants")]
    fn target(&mut self, number: u32) -> Result<Target, Error> {
        let frame = self.source.frame(number).map_err(|source| Error::Source { frame: number, source })?;
        let keeps_state =
            self.common.settings.finetune.as_ref().is_some_and(|finetune| finetune.state.is_kept());
        let digest = keeps_state.then(|| digest(&frame));
        let rows = visible(&frame, self.common.settings.keep_invisible);
        let row_count = frame.len() as u32;
        // Where frames are predicted axes are named as in the reference, and what a frame starts with is sorted.
        let sorts =
            self.common.sequence.canonical_axes() || self.common.settings.profile() == Profile::Dynamic;
        let frame = canonicalise(frame.into_selected(&rows), sorts);
        let (frame, found) = isolated::colours(frame, &rows, number);
        let grid = PositionGrid::of(&self.common.sequence);
        // A frame is looked at again where it is tried in one way and coded in another.
        if number >= self.looked_at {
            self.looked_at = number + 1;
            Isolated::add(found, &mut self.report.isolated);
            Isolated::add(isolated::positions(&frame, &rows, &grid, number), &mut self.report.isolated);
        }
        let steps = |axis: usize| {
            let plane = frame.position()[axis].par_iter();
            plane.map(|&value| grid.steps(axis, value)).collect()
        };
        // Frames by themselves are not matched with others.
        let position = match self.common.settings.structure {
            Structure::Intra => Default::default(),
            Structure::Predicted { .. } => [0, 1, 2].map(steps),
        };
        Ok(Target { frame, position, rows, row_count, digest })
    }

    /// Adds the units of a coded frame to its GOP, and what they are to the report.
    #[expect(clippy::indexing_slicing, reason = "units are counted by what they index, axes are constants")]
    fn add(
        &mut self,
        gop: &mut Gop,
        number: u32,
        role: &FrameRole,
        target: &Target,
        coded: &CodedFrame,
    ) -> Result<(), Error> {
        let gaussians = coded.gaussians();
        let sh = gop.tools.sh.as_ref().map(|_| 0);
        let header = FrameHeader::new(role.frame_type, 0, sh, gaussians);
        let payload =
            write_frame(&header, coded.carried_digest, coded.cells.as_ref(), &self.common.sequence)?;
        let cells = coded.cells.as_ref().map_or(0, |cells| cells.cell_count);
        let mut frame = FrameReport::new(role.frame_type, gaussians, cells);
        let start = gop.units.len();
        let id = UnitId::of_frame(UnitType::FrameHeader, number).on_layers(0, role.temporal_layer);
        gop.units.push((id, payload));
        for unit in &coded.units {
            let id = UnitId::of_increment(number, unit.refinement);
            gop.units.push((id.on_layers(unit.spatial_layer, role.temporal_layer), unit.payload.clone()));
            frame.add(&unit.header, unit.predicted);
            frame.prediction_saves += unit.prediction_saves as u64;
            gop.has_learned |= unit.predicted[3] > 0;
        }
        frame.least_bits = coded.least_bits();
        let bytes = |(_, payload): &(UnitId, Vec<u8>)| (UnitHeader::SIZE + payload.len()) as u64;
        frame.bytes = gop.units[start..].iter().map(bytes).sum();
        self.report.invisible += u64::from(target.row_count) - target.rows.len() as u64;
        self.report.gaussians += u64::from(gaussians);
        self.report.coded.push(frame);
        self.report.digests.push(coded.units.last().map_or(0, |unit| unit.header.refinement_digest));
        Ok(())
    }
}
