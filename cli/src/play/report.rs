//! What a playback was like.

use super::decoding::Decoded;
use crate::numbers::counted;
use serde::Serialize;
use splatstream_format::Error;
use splatstream_stream::client::{GopLog, Loss, Outcome, PlayedGop};
use splatstream_stream::control::{Ladder, Shown};
use splatstream_stream::manifest::Manifest;
use splatstream_stream::qoe::Score;
use splatstream_stream::simulation::Report as Simulated;
use std::collections::BTreeMap;

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Report {
    location: String,
    rule: &'static str,
    /// Whether time and network were virtual.
    simulated: bool,
    /// Whether qualities are from the table of the manifest, and not estimates.
    quality_measured: bool,
    gops: Vec<GopReport>,
    losses: Vec<LossReport>,
    totals: Totals,
}

#[derive(Serialize)]
struct GopReport {
    gop: usize,
    first_frame: u32,
    frames: u32,
    /// None if nothing of it could be had.
    op: Option<String>,
    quality_db: Option<f64>,
    began_seconds: Option<f64>,
    waited_seconds: Option<f64>,
    buffer_seconds: Option<f64>,
    /// From capture to display, of a presentation that grew.
    latency_seconds: Option<f64>,
    switched: bool,
    /// Of the operating point, and all that arrived.
    bytes: u64,
    fetched_bytes: u64,
    requests: u64,
    failures: u64,
    abandoned: u64,
    decoded: Option<Decoded>,
}

#[derive(Serialize)]
struct LossReport {
    gop: usize,
    count: usize,
    representation: String,
    refinement: u8,
    reason: String,
}

#[derive(Serialize)]
struct Totals {
    complete: bool,
    seconds: f64,
    bytes: u64,
    unplayed_percent: f64,
    requests: u64,
    abandoned: u64,
    startup_seconds: f64,
    /// Mean from capture to display, of a presentation that grew.
    latency_seconds: Option<f64>,
    stalls: u64,
    stalled_seconds: f64,
    switches: u64,
    quality_db: f64,
    change_db_per_minute: f64,
    experience_db: f64,
    sabre_utility: f64,
    sabre_rebuffering: f64,
    sabre_score: f64,
    lolp: f64,
}

impl Report {
    /// Of a playback over a network, with what was decoded.
    pub(super) fn of_playback(
        manifest: &Manifest,
        outcome: &Outcome,
        mut decoded: BTreeMap<usize, Decoded>,
    ) -> Self {
        let rows = outcome.gops.iter();
        let gops = rows.map(|log| GopReport::new(log, decoded.remove(&log.number))).collect();
        let losses = outcome.losses.iter().map(LossReport::from).collect();
        let mut report = Self { losses, ..Self::new(manifest, gops, &outcome.report, &outcome.score()) };
        report.totals.complete &= report.gops.iter().all(GopReport::is_seen);
        report
    }

    /// Why a limit kept frames from being decoded, or why none could be; nothing if frames were, as far as they arrived.
    pub(super) fn undecoded(&self) -> Option<Error> {
        let all = || self.gops.iter().filter_map(|gop| gop.decoded.as_ref());
        let is_blank = all().all(|decoded| decoded.frames == 0);
        all().find(|decoded| decoded.is_over_limit() || is_blank)?.worst
    }

    /// Of a simulated playback.
    pub(super) fn of_simulation(manifest: &Manifest, ladder: &Ladder, simulated: &Simulated) -> Self {
        let row = |(gop, info): (usize, &splatstream_stream::manifest::GopInfo)| {
            let shown = simulated.shown.iter().find(|shown| shown.gop == gop).copied();
            let requests = simulated.fetches.iter().filter(|(_, fetch)| fetch.gop() == gop).count();
            let log = GopLog {
                number: gop,
                first_frame: info.first_frame,
                frame_count: info.frame_count,
                shown,
                requests: requests as u64,
                bytes: shown.map_or(0, |shown| shown.fetched),
                ..GopLog::default()
            };
            GopReport { buffer_seconds: None, ..GopReport::new(&log, None) }
        };
        let gops = manifest.gops.iter().enumerate().map(row).collect();
        Self { simulated: true, ..Self::new(manifest, gops, simulated, &Score::of(ladder, simulated)) }
    }

    fn new(manifest: &Manifest, mut gops: Vec<GopReport>, report: &Simulated, score: &Score) -> Self {
        let mut last = None;
        for gop in gops.iter_mut().filter(|gop| gop.op.is_some()) {
            gop.switched = last.is_some() && last != gop.op;
            last.clone_from(&gop.op);
        }
        Self {
            location: String::new(),
            rule: "",
            simulated: false,
            quality_measured: manifest.quality.is_some(),
            gops,
            losses: Vec::new(),
            totals: Totals::new(report, score),
        }
    }

    /// The same with what was played, and by which rule.
    pub(super) fn of(self, location: &str, rule: &'static str) -> Self {
        Self { location: location.to_owned(), rule, ..self }
    }

    /// Whether any GOP was played, if there was one.
    pub(super) fn has_played(&self) -> bool {
        self.gops.is_empty() || self.played() > 0
    }

    /// GOPs that were played: those that arrived, and of which something could be decoded.
    fn played(&self) -> usize {
        self.gops.iter().filter(|gop| gop.op.is_some() && gop.is_seen()).count()
    }

    /// A line for each loss; those of one kind in GOPs that follow each other share one.
    fn losses_text(&self) -> String {
        let is_next = |a: &LossReport, b: &LossReport| {
            let kind =
                |loss: &LossReport| (loss.representation.clone(), loss.refinement, loss.reason.clone());
            a.count == 1 && b.count == 1 && b.gop == a.gop + 1 && kind(a) == kind(b)
        };
        let line = |losses: &[LossReport]| {
            let (first, last) = losses.first().zip(losses.last())?;
            let LossReport { gop, count, representation, refinement, reason } = first;
            let end = last.gop + last.count.saturating_sub(1);
            Some(match (losses.len(), count) {
                (1, 0 | 1) => format!(
                    "GOP {gop}: {representation} is left out from refinement {refinement} on: {reason}\n"
                ),
                (1, _) => format!("GOPs {gop} to {end} are skipped: {reason}\n"),
                _ => format!(
                    "GOPs {gop} to {end}: {representation} is left out from refinement {refinement} on: {reason}\n"
                ),
            })
        };
        self.losses.chunk_by(is_next).filter_map(line).collect()
    }

    pub(super) fn text(&self) -> String {
        let totals = &self.totals;
        let mut text = String::new();
        text += &self.losses_text();
        for gop in &self.gops {
            for error in gop.decoded.iter().flat_map(|decoded| &decoded.errors) {
                text += &format!("GOP {}: {error}\n", gop.gop);
            }
        }
        let shown = self.played();
        // Estimates compare points of one GOP, and are no decibels of any picture.
        let quality = match self.quality_measured {
            true => format!("mean quality {:.2} dB (measured)", totals.quality_db),
            false => {
                format!("mean quality {:.2} (estimated; package --quality measures dB)", totals.quality_db)
            }
        };
        let unit = if self.quality_measured { " dB" } else { "" };
        text += &format!(
            "{shown} of {} by the rule {}: start-up {:.3} s, {} of {:.3} s, {}\n\
             {} in {}, {:.1} % not played; {quality}\n\
             experience {:.2}{unit}, sabre {:.3}, LoL+ {:.3}\n",
            counted(self.gops.len() as u64, "GOP"),
            self.rule,
            totals.startup_seconds,
            counted(totals.stalls, "stall"),
            totals.stalled_seconds,
            counted(totals.switches, "switch"),
            counted(totals.bytes, "byte"),
            counted(totals.requests, "request"),
            totals.unplayed_percent,
            totals.experience_db,
            totals.sabre_score,
            totals.lolp,
        );
        text
    }
}

impl GopReport {
    /// Whether there were pictures of it, if it was decoded.
    fn is_seen(&self) -> bool {
        self.decoded.as_ref().is_none_or(|decoded| decoded.frames > 0)
    }

    fn new(log: &GopLog, decoded: Option<Decoded>) -> Self {
        let of = |value: fn(&Shown) -> f64| log.shown.as_ref().map(value);
        Self {
            gop: log.number,
            first_frame: log.first_frame,
            frames: log.frame_count,
            op: log.shown.map(|shown| shown.point.to_string()),
            quality_db: of(|shown| shown.quality),
            began_seconds: of(|shown| seconds(shown.began_us)),
            waited_seconds: of(|shown| seconds(shown.waited_us)),
            buffer_seconds: Some(seconds(log.buffer_us)),
            latency_seconds: log.shown.and_then(|shown| shown.latency_us).map(seconds),
            switched: false,
            bytes: log.shown.map_or(0, |shown| shown.bytes),
            fetched_bytes: log.bytes,
            requests: log.requests,
            failures: log.failures,
            abandoned: log.abandoned,
            decoded,
        }
    }
}

impl From<&Loss> for LossReport {
    fn from(loss: &Loss) -> Self {
        let Loss { gop, count, representation, refinement, reason } = loss.clone();
        Self { gop, count, representation, refinement, reason }
    }
}

impl Totals {
    fn new(report: &Simulated, score: &Score) -> Self {
        let is_live = report.shown.iter().any(|shown| shown.latency_us.is_some());
        Self {
            complete: report.complete,
            seconds: seconds(report.ended_us),
            bytes: report.bytes,
            unplayed_percent: 100.0 * score.unplayed,
            requests: report.requests,
            abandoned: report.abandoned,
            startup_seconds: score.startup_seconds,
            latency_seconds: is_live.then_some(score.latency_seconds),
            stalls: score.stalls,
            stalled_seconds: score.stalled_seconds,
            switches: score.switches,
            quality_db: score.quality,
            change_db_per_minute: score.change_per_minute,
            experience_db: score.experience,
            sabre_utility: score.sabre_utility,
            sabre_rebuffering: score.sabre_rebuffering,
            sabre_score: score.sabre_score,
            lolp: score.lolp,
        }
    }
}

/// A GOP that begins, as a line.
pub(super) fn line(gop: &PlayedGop<'_>) -> String {
    let (number, log) = (gop.number, gop.log);
    let Some(shown) = log.shown else {
        let failed = counted(log.failures, "request");
        return format!("GOP {number}: nothing of it could be had, {failed} failed");
    };
    let behind = shown.latency_us.map_or(String::new(), |us| format!(", {:.3} s behind", seconds(us)));
    let waited = match shown.waited_us {
        0 => String::new(),
        us if shown.gop == 0 => format!(", after {:.3} s", seconds(us)),
        us => format!(", stalled for {:.3} s", seconds(us)),
    };
    format!(
        "GOP {number}: {}, {} in {}, {:.1} s buffered{behind}{waited}",
        shown.point,
        counted(shown.bytes, "byte"),
        counted(log.requests, "request"),
        seconds(log.buffer_us),
    )
}

fn seconds(us: u64) -> f64 {
    us as f64 / 1e6
}
