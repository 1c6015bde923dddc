//! What the manifest and the MPD of a live package say: the GOPs so far, where they are, and what they cost.

use super::Settings;
use crate::division::Gop;
use crate::manifest::{
    ByteRange, GopInfo, LiveInfo, Manifest, RepresentationInfo, StreamInfo, SubsegmentInfo, digest_of,
};
use crate::mpd;
use crate::package::segment::Subsegment;
use crate::package::{Clock, Layout};
use crate::representation::Representation;
use splatstream_format::syntax::{FileHeader, SequenceParameters};
use std::collections::VecDeque;

/// The GOPs so far.
#[derive(Debug)]
pub(super) struct Timeline {
    settings: Settings,
    sequence: Option<(FileHeader, SequenceParameters)>,
    /// All complete GOPs, without their subsegments.
    gops: Vec<GopInfo>,
    /// The last of them in JSON, with their subsegments, and the bytes of these.
    described: VecDeque<String>,
    described_bytes: usize,
    /// The GOP in progress, if its files are there already.
    growing: Option<GopInfo>,
    tracks: Vec<Track>,
}

/// What is known of a Representation.
#[derive(Debug)]
struct Track {
    representation: Representation,
    init: ByteRange,
    /// Bytes of each level in the GOP in progress.
    bytes: Vec<u64>,
    /// The largest rate of each level, bits per second.
    rates: Vec<u64>,
    /// Frames of complete GOPs, and of the one in progress.
    frames: u32,
    frames_now: u32,
    /// Of the GOP in progress.
    subsegments: Vec<SubsegmentInfo>,
}

/// When the stream began, and what time it is: milliseconds since 1970.
#[derive(Debug, Clone, Copy)]
pub(super) struct Times {
    pub(super) started_ms: u64,
    pub(super) now_ms: u64,
}

/// What is known once the stream has ended.
#[derive(Debug)]
pub(super) struct End {
    /// Bytes and digest of the stream.
    pub(super) bytes: u64,
    pub(super) digest: String,
    /// The name of the file with the tail, and where in it the tail is.
    pub(super) file: String,
    pub(super) tail: ByteRange,
}

impl Timeline {
    pub(super) fn new(settings: Settings) -> Self {
        Self {
            settings,
            sequence: None,
            gops: Vec::new(),
            described: VecDeque::new(),
            described_bytes: 0,
            growing: None,
            tracks: Vec::new(),
        }
    }

    /// Before the first GOP.
    pub(super) fn begin(&mut self, header: &FileHeader, sequence: &SequenceParameters) {
        self.sequence = Some((*header, *sequence));
    }

    /// Adds a Representation with its initialisation segment.
    pub(super) fn track(&mut self, representation: Representation, init: &[u8]) {
        let levels = self.sequence.map_or(0, |(_, sequence)| usize::from(sequence.refinement_count));
        let size = u64::try_from(init.len()).unwrap_or(u64::MAX);
        self.tracks.push(Track {
            representation,
            init: ByteRange { offset: 0, size, digest: digest_of(&[init]) },
            bytes: vec![0; levels],
            rates: vec![0; levels],
            frames: 0,
            frames_now: 0,
            subsegments: Vec::new(),
        });
    }

    /// The file of the GOP in progress; their numbers are from 1.
    pub(super) fn name_of_segment(&self, representation: Representation) -> String {
        format!("{representation}-{}.m4s", self.gops.len().saturating_add(1))
    }

    /// The files of the GOP in progress are there, and will grow.
    pub(super) fn announce(&mut self, gop: &Gop) {
        self.growing = Some(GopInfo { growing: true, ..GopInfo::of(gop) });
    }

    /// Counts subsegments of a Representation, and takes what they are.
    pub(super) fn count(&mut self, index: usize, made: &[Subsegment], described: Vec<SubsegmentInfo>) {
        let Some(track) = self.tracks.get_mut(index) else { return };
        for subsegment in made {
            let frames = u32::try_from(subsegment.frames.len()).unwrap_or(u32::MAX);
            track.frames_now = track.frames_now.saturating_add(frames);
            for (sum, level) in track.bytes.iter_mut().zip(&subsegment.levels) {
                *sum = sum.saturating_add(level.size);
            }
        }
        track.subsegments.extend(described);
    }

    /// The GOP in progress is complete.
    pub(super) fn add(&mut self, gop: &Gop) {
        let Some((_, sequence)) = &self.sequence else { return };
        let clock = Clock::of(sequence);
        let ticks = clock.ticks(gop.header.gop_frame_count.into());
        self.growing = None;
        let info = GopInfo::of(gop);
        let subsegments = self.tracks.iter_mut().flat_map(|track| core::mem::take(&mut track.subsegments));
        let subsegments = subsegments.collect();
        self.describe(&GopInfo { subsegments, ..info.clone() });
        for track in &mut self.tracks {
            track.frames = track.frames.saturating_add(core::mem::take(&mut track.frames_now));
            for (rate, bytes) in track.rates.iter_mut().zip(&mut track.bytes) {
                *rate = (*rate).max(clock.rate(core::mem::take(bytes), ticks));
            }
        }
        self.gops.push(info);
    }

    /// Keeps what the manifest says of a complete GOP, and lets go of the first ones if that is too much.
    fn describe(&mut self, gop: &GopInfo) {
        let text = json(gop);
        self.described_bytes = self.described_bytes.saturating_add(text.len());
        self.described.push_back(text);
        while self.described_bytes > self.settings.manifest_bytes && self.described.len() > Settings::LEAST {
            let first = self.described.pop_front().unwrap_or_default();
            self.described_bytes = self.described_bytes.saturating_sub(first.len());
        }
    }

    /// The manifest in JSON as it is now; none before the sequence is known.
    pub(super) fn manifest(&self, times: Times, end: Option<&End>) -> Option<String> {
        let (_, sequence) = self.sequence.as_ref()?;
        let all = self.described.len();
        let listed = if end.is_some() { all } else { self.window(Clock::of(sequence)) };
        let complete = self.described.iter().skip(all.saturating_sub(listed));
        let growing = self.growing.as_ref().map(|gop| {
            let subsegments = self.tracks.iter().flat_map(|track| &track.subsegments).cloned().collect();
            json(&GopInfo { subsegments, ..gop.clone() })
        });
        let manifest = self.described_as(times, listed, end)?;
        Some(manifest.to_json_with(complete.chain(&growing).map(String::as_str)))
    }

    /// The MPD as it is now, with all GOPs; none before the sequence is known.
    pub(super) fn mpd(&self, times: Times, end: Option<&End>) -> Option<String> {
        let gops = self.gops.iter().chain(&self.growing).cloned().collect();
        Some(mpd::of(&Manifest { gops, ..self.described_as(times, self.gops.len(), end)? }))
    }

    /// A manifest of the last so many GOPs, without them.
    fn described_as(&self, times: Times, listed: usize, end: Option<&End>) -> Option<Manifest> {
        let (header, sequence) = self.sequence.as_ref()?;
        let clock = Clock::of(sequence);
        let state = if end.is_some() { LiveInfo::ENDED } else { LiveInfo::GROWING };
        Some(Manifest {
            format: Manifest::FORMAT.to_owned(),
            version: Manifest::VERSION,
            stream: StreamInfo {
                bytes: end.map(|end| end.bytes),
                digest: end.map(|end| end.digest.clone()),
                ..StreamInfo::of(header, sequence, self.growing.as_ref().or(self.gops.last()))
            },
            layout: self.settings.package.layout.name().to_owned(),
            live: Some(LiveInfo {
                state: state.to_owned(),
                first_gop: u64::try_from(self.gops.len().saturating_sub(listed)).unwrap_or(u64::MAX),
                started_ms: times.started_ms,
                published_ms: times.now_ms,
                target_latency_ms: self.target_latency_ms(clock),
                update_ms: self.update_ms(clock),
            }),
            representations: self.representations(clock, end),
            gops: Vec::new(),
            quality: None,
        })
    }

    /// How many complete GOPs a growing manifest lists.
    fn window(&self, clock: Clock) -> usize {
        let end = self.gops.last().map_or(0, GopInfo::end);
        let before =
            |gop: &&GopInfo| milliseconds(clock, end.saturating_sub(gop.end())) < self.settings.window_ms;
        let within = self.gops.iter().rev().take_while(before).count();
        within.max(Settings::LEAST).min(self.described.len())
    }

    /// From a manifest to the next one: a frame, or the longest GOP.
    fn update_ms(&self, clock: Clock) -> u32 {
        match self.settings.package.layout {
            Layout::Gop => milliseconds(clock, self.longest()).max(1),
            Layout::Frame => milliseconds(clock, 1).max(1),
        }
    }

    /// Two frames or two GOPs, if nothing else is wanted.
    fn target_latency_ms(&self, clock: Clock) -> u32 {
        let least = match self.settings.package.layout {
            Layout::Gop => milliseconds(clock, self.longest().saturating_mul(2)),
            Layout::Frame => milliseconds(clock, 2),
        };
        self.settings.target_latency_ms.unwrap_or(least)
    }

    /// Frames of the longest GOP.
    fn longest(&self) -> u64 {
        self.gops.iter().chain(&self.growing).map(|gop| gop.frame_count).max().unwrap_or(0).into()
    }

    /// What is said of each Representation.
    fn representations(&self, clock: Clock, end: Option<&End>) -> Vec<RepresentationInfo> {
        let mut all: Vec<RepresentationInfo> = Vec::new();
        for track in &self.tracks {
            let rates = self.rates(track, clock);
            let own = rates.iter().map(|rate| (*rate).max(1)).fold(0, u64::saturating_add);
            let before = all.last().map_or(0, |last| last.bandwidth);
            let depends_on = all.iter().map(|earlier| earlier.id.clone()).collect();
            let end = end.filter(|_| all.is_empty());
            all.push(RepresentationInfo {
                id: track.representation.to_string(),
                file: name_of_init(track.representation),
                frame_type: track.representation.frame_type().to_owned(),
                layer: track.representation.codes().1,
                depends_on,
                bandwidth: before.saturating_add(own),
                level_bandwidths: rates,
                frames: track.frames,
                bytes: track.init.size,
                init: track.init.clone(),
                index: None,
                tail: end.map(|end| end.tail.clone()),
                tail_file: end.map(|end| end.file.clone()),
            });
        }
        all
    }

    /// The rates of a Representation, with what the GOP in progress has taken so far.
    fn rates(&self, track: &Track, clock: Clock) -> Vec<u64> {
        let ticks = self.growing.as_ref().map(|gop| clock.ticks(gop.frame_count.into()));
        let now = |bytes: u64| ticks.map_or(0, |ticks| clock.rate(bytes, ticks));
        track.rates.iter().zip(&track.bytes).map(|(rate, bytes)| now(*bytes).max(*rate)).collect()
    }
}

/// The file of an initialisation segment.
pub(super) fn name_of_init(representation: Representation) -> String {
    format!("{representation}-init.mp4")
}

/// Frames in milliseconds, rounded up.
fn milliseconds(clock: Clock, frames: u64) -> u32 {
    let ticks = u128::from(clock.ticks(frames)).saturating_mul(1000);
    u32::try_from(ticks.div_ceil(u128::from(clock.timescale.max(1)))).unwrap_or(u32::MAX)
}

/// A GOP as the manifest has it.
fn json(gop: &GopInfo) -> String {
    // Keys are strings and values are finite: nothing can fail.
    serde_json::to_string(gop).unwrap_or_default()
}
