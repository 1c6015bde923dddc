//! What the MPD of a live package says: the GOPs so far, and what they cost.

use crate::division::Gop;
use crate::manifest::{ByteRange, GopInfo, Manifest, RepresentationInfo, StreamInfo};
use crate::mpd::{self, Segments};
use crate::package::segment::Subsegment;
use crate::package::{Clock, Layout};
use crate::representation::Representation;
use splatstream_format::syntax::{FileHeader, SequenceParameters};

/// The GOPs so far.
#[derive(Debug, Default)]
pub(super) struct Timeline {
    sequence: Option<(FileHeader, SequenceParameters)>,
    gops: Vec<GopInfo>,
    /// The GOP in progress, if its files are there already.
    growing: Option<GopInfo>,
    costs: Vec<Cost>,
}

/// What a Representation costs.
#[derive(Debug, Clone)]
struct Cost {
    /// Bytes of each level in the GOP in progress.
    bytes: Vec<u64>,
    /// The largest rate of each level, bits per second.
    rates: Vec<u64>,
    /// Frames of complete GOPs, and of the one in progress.
    frames: u32,
    frames_now: u32,
}

impl Timeline {
    /// Before the first GOP of so many Representations.
    pub(super) fn begin(&mut self, header: &FileHeader, sequence: &SequenceParameters, count: usize) {
        let levels = usize::from(sequence.refinement_count);
        self.sequence = Some((*header, *sequence));
        self.costs =
            vec![Cost { bytes: vec![0; levels], rates: vec![0; levels], frames: 0, frames_now: 0 }; count];
    }

    /// The file of the GOP in progress; their numbers are from 1.
    pub(super) fn name_of_segment(&self, representation: Representation) -> String {
        format!("{representation}-{}.m4s", self.gops.len().saturating_add(1))
    }

    /// The files of the GOP in progress are there, and will grow.
    pub(super) fn announce(&mut self, gop: &Gop) {
        self.growing = Some(GopInfo::of(gop));
    }

    /// Counts subsegments of a Representation.
    pub(super) fn count(&mut self, representation: usize, made: &[Subsegment]) {
        let Some(cost) = self.costs.get_mut(representation) else { return };
        for subsegment in made {
            let frames = u32::try_from(subsegment.frames.len()).unwrap_or(u32::MAX);
            cost.frames_now = cost.frames_now.saturating_add(frames);
            for (sum, level) in cost.bytes.iter_mut().zip(&subsegment.levels) {
                *sum = sum.saturating_add(level.size);
            }
        }
    }

    /// The GOP in progress is complete.
    pub(super) fn add(&mut self, gop: &Gop) {
        let Some((_, sequence)) = &self.sequence else { return };
        let clock = Clock::of(sequence);
        let ticks = clock.ticks(gop.header.gop_frame_count.into());
        self.growing = None;
        for cost in &mut self.costs {
            cost.frames = cost.frames.saturating_add(core::mem::take(&mut cost.frames_now));
            for (rate, bytes) in cost.rates.iter_mut().zip(&mut cost.bytes) {
                *rate = (*rate).max(clock.rate(core::mem::take(bytes), ticks));
            }
        }
        self.gops.push(GopInfo::of(gop));
    }

    /// The MPD; none before the first GOP has begun.
    pub(super) fn mpd(
        &self,
        representations: impl Iterator<Item = Representation>,
        layout: Layout,
        started: &str,
        now: &str,
        is_end: bool,
    ) -> Option<String> {
        let (header, sequence) = self.sequence.as_ref()?;
        let representations = self.described(representations, Clock::of(sequence));
        let manifest = Manifest {
            format: Manifest::FORMAT.to_owned(),
            version: Manifest::VERSION,
            stream: StreamInfo::of(header, sequence, self.gops.last()),
            layout: layout.name().to_owned(),
            representations,
            gops: self.gops.clone(),
            quality: None,
        };
        let growing = self.growing.as_ref();
        Some(mpd::of(&manifest, Segments::Numbered { started, now, is_end, growing }))
    }

    /// What the MPD says of each Representation.
    fn described(
        &self,
        representations: impl Iterator<Item = Representation>,
        clock: Clock,
    ) -> Vec<RepresentationInfo> {
        let mut described: Vec<RepresentationInfo> = Vec::new();
        for (representation, cost) in representations.zip(&self.costs) {
            let rates = self.rates(cost, clock);
            let own = rates.iter().map(|rate| (*rate).max(1)).fold(0, u64::saturating_add);
            let before = described.last().map_or(0, |last| last.bandwidth);
            let depends_on = described.iter().map(|earlier| earlier.id.clone()).collect();
            let nothing = ByteRange { offset: 0, size: 0, digest: String::new() };
            described.push(RepresentationInfo {
                id: representation.to_string(),
                file: String::new(),
                frame_type: representation.frame_type().to_owned(),
                layer: representation.codes().1,
                depends_on,
                bandwidth: before.saturating_add(own),
                level_bandwidths: rates,
                frames: cost.frames,
                bytes: 0,
                init: nothing,
                index: None,
                tail: None,
            });
        }
        described
    }

    /// The rates of a Representation, with what the GOP in progress has taken so far.
    fn rates(&self, cost: &Cost, clock: Clock) -> Vec<u64> {
        let ticks = self.growing.as_ref().map(|gop| clock.ticks(gop.frame_count.into()));
        let now = |bytes: u64| ticks.map_or(0, |ticks| clock.rate(bytes, ticks));
        cost.rates.iter().zip(&cost.bytes).map(|(rate, bytes)| now(*bytes).max(*rate)).collect()
    }
}
