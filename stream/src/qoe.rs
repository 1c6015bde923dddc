//! Quality of experience: what a playback was worth, by our own formula and by two that are published.
//!
//! ```
//! use splatstream_stream::control::{Layered, Settings};
//! use splatstream_stream::qoe::Score;
//! use splatstream_stream::simulation::{Link, Trace, ladders, simulate};
//!
//! let ladder = ladders::small(60);
//! let report = simulate(&ladder, &Settings::default(), Layered::default(), &Link::new(Trace::constant(30_000_000)));
//! let score = Score::of(&ladder, &report);
//! assert!(score.quality > 33.0 && score.stalled_seconds == 0.0);
//! ```

use std::collections::BTreeMap;

use crate::control::{Ladder, OperatingPoint, Shown, number};
use crate::simulation::Report;
use number::{real, seconds, size};

/// The scores of a playback. Those by other people's formulas are about bitrates, as those formulas are: the bitrate of a
/// GOP is the mean over the presentation of that of the operating point that was played of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Our own: (sum of quality · duration - sum of |change of quality| - `W` · (stalls + start-up)) / duration of the
    /// presentation, in dB. `W` is the mean quality of the best operating points, and what was never played has the quality
    /// 0. It has the form of equation 5 of Yin et al., "A Control-Theoretic Approach for Dynamic Adaptive Video Streaming over
    /// HTTP", SIGCOMM 2015, with their balanced weights.
    pub experience: f64,
    /// Mean quality of what was played, by duration, in dB.
    pub quality: f64,
    /// Time to the first GOP.
    pub startup_seconds: f64,
    /// Time that playback stood still after that.
    pub stalled_seconds: f64,
    /// Number of times that it did.
    pub stalls: u64,
    /// GOPs whose operating point is another than that of the one before.
    pub switches: u64,
    /// Sum of the changes of quality from GOP to GOP per minute, in dB.
    pub change_per_minute: f64,
    /// Mean time from capture to display of the GOPs of a live presentation when they begin; 0 for a stored one.
    pub latency_seconds: f64,
    /// Megabytes that were received.
    pub megabytes: f64,
    /// Share of the bytes of media that were received and not played.
    pub unplayed: f64,
    /// sabre's "time average played utility": the mean of ln(bitrate / least bitrate) over all time, stalls included
    /// (Spiteri, Sitaraman, Sparacio, "From Theory to Practice: Improving Bitrate Adaptation in the DASH Reference Player",
    /// MMSys 2018, section 5, and `sabre.py`).
    pub sabre_utility: f64,
    /// sabre's "rebuffer ratio": stalls / all time.
    pub sabre_rebuffering: f64,
    /// sabre's "time average score": (sum of utilities - 5 · stalls / duration of a GOP) / (all time / duration of a GOP), with
    /// its default `gamma_p` of 5.
    pub sabre_score: f64,
    /// `LoL+` per GOP in Mbit/s: bitrate · duration - |change of bitrate| - largest bitrate · stalls - latency · weight -
    /// least bitrate · |1 - rate of playback|, where the weight is 0.05 of the least bitrate up to a latency of 1.1 s and 0.1
    /// of the largest beyond (Bentaleb et al., "Catching the Moment with `LoL+` in Twitch-Like Low-Latency Live Streaming
    /// Platforms", IEEE Transactions on Multimedia 2021, and `LoLpQoEEvaluator.js` of dash.js). The latency of a stored
    /// presentation is 0.
    pub lolp: f64,
}

/// Weight of stalls in sabre's score.
const GAMMA_P: f64 = 5.0;

impl Score {
    /// The scores of a playback of a presentation.
    pub fn of(ladder: &Ladder, report: &Report) -> Self {
        let gops = ladder.gops();
        let (_, best) = crate::control::ladder::quality_range(gops);
        let media = seconds(ladder.duration_us()).max(1e-6);
        let mut score = Self::plain(ladder, report);
        let played: f64 = report.shown.iter().map(|shown| shown.quality * duration(ladder, shown)).sum();
        let changes = score.change_per_minute * media / 60.0;
        score.experience =
            (played - changes - best * (score.startup_seconds + score.stalled_seconds)) / media;
        score.sabre(ladder, report);
        score.lolp(ladder, report);
        score
    }

    /// What needs no weights.
    fn plain(ladder: &Ladder, report: &Report) -> Self {
        let media: f64 = report.shown.iter().map(|shown| duration(ladder, shown)).sum();
        let played: f64 = report.shown.iter().map(|shown| shown.quality * duration(ladder, shown)).sum();
        let pairs = || report.shown.iter().zip(report.shown.iter().skip(1));
        let changes: f64 = pairs().map(|(a, b)| (b.quality - a.quality).abs()).sum();
        let useful = report.shown.iter().map(|shown| shown.bytes).fold(0, u64::saturating_add);
        Self {
            quality: played / media.max(1e-6),
            startup_seconds: seconds(report.startup_us()),
            stalled_seconds: seconds(report.stalled_us()),
            stalls: size(report.shown.iter().skip(1).filter(|shown| shown.waited_us > 0).count()),
            switches: size(pairs().filter(|(a, b)| a.point != b.point).count()),
            change_per_minute: changes * 60.0 / seconds(ladder.duration_us()).max(1e-6),
            latency_seconds: report
                .shown
                .iter()
                .filter_map(|shown| shown.latency_us)
                .map(seconds)
                .sum::<f64>()
                / real(size(report.shown.len()).max(1)),
            megabytes: real(report.bytes) / 1e6,
            unplayed: real(report.media_bytes.saturating_sub(useful)) / real(report.media_bytes.max(1)),
            ..Self::default()
        }
    }

    fn sabre(&mut self, ladder: &Ladder, report: &Report) {
        let bitrates = Bitrates::new(ladder);
        let gop = seconds(ladder.duration_us()) / real(size(ladder.gops().len()).max(1));
        let utility: f64 =
            report.shown.iter().map(|shown| libm::log((bitrates.of(shown) / bitrates.least).max(1.0))).sum();
        let time = seconds(report.ended_us).max(1e-6);
        let chunks = (time / gop.max(1e-6)).max(1e-6);
        self.sabre_utility = utility / chunks;
        self.sabre_rebuffering = self.stalled_seconds / time;
        self.sabre_score = (utility - GAMMA_P * self.stalled_seconds / gop.max(1e-6)) / chunks;
    }

    fn lolp(&mut self, ladder: &Ladder, report: &Report) {
        let bitrates = Bitrates::new(ladder);
        let (least, most) = (bitrates.least, bitrates.most);
        let mut sum = 0.0;
        let mut last: Option<f64> = None;
        for shown in &report.shown {
            let own = bitrates.of(shown);
            let stall = if shown.gop == 0 { 0.0 } else { seconds(shown.waited_us) };
            let latency = seconds(shown.latency_us.unwrap_or(0));
            let weight = if latency <= 1.1 { least * 0.05 } else { most * 0.1 };
            let rate = f64::from(shown.rate_milli) / 1000.0;
            sum += own * duration(ladder, shown) - last.map_or(0.0, |last| (own - last).abs()) - most * stall;
            sum -= weight * latency + least * (1.0 - rate).abs();
            last = Some(own);
        }
        self.lolp = sum / 1e6 / real(size(report.shown.len()).max(1));
    }
}

fn duration(ladder: &Ladder, shown: &Shown) -> f64 {
    ladder.gops().get(shown.gop).map_or(0.0, |gop| seconds(gop.duration_us()))
}

/// Mean bits per second of all operating points, and of the least and the largest ones.
struct Bitrates {
    of: BTreeMap<OperatingPoint, f64>,
    least: f64,
    most: f64,
}

impl Bitrates {
    fn new(ladder: &Ladder) -> Self {
        let mut sums: BTreeMap<OperatingPoint, (f64, f64)> = BTreeMap::new();
        let (mut least, mut most) = (0.0, 0.0);
        for gop in ladder.gops() {
            for point in gop.points() {
                let (bits, time) = sums.entry(point.name).or_default();
                *bits += real(point.bytes) * 8.0;
                *time += seconds(gop.duration_us());
            }
            least += gop.points().first().map_or(0.0, |point| real(point.bytes) * 8.0);
            most += gop.points().last().map_or(0.0, |point| real(point.bytes) * 8.0);
        }
        let media = seconds(ladder.duration_us()).max(1e-6);
        let of = sums.into_iter().map(|(name, (bits, time))| (name, bits / time.max(1e-6))).collect();
        Self { of, least: (least / media).max(1.0), most: (most / media).max(1.0) }
    }

    fn of(&self, shown: &Shown) -> f64 {
        self.of.get(&shown.point).copied().unwrap_or(self.least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Layered, Point, Settings};
    use crate::simulation::{Link, Trace, ladders, simulate};

    /// A playback of three GOPs: the base after 1 s, the best at once, the base again after a stall of 2 s.
    fn playback(ladder: &Ladder) -> Report {
        let mut report = simulate(
            ladder,
            &Settings::default(),
            Layered::default(),
            &Link::new(Trace::constant(1_000_000_000)),
        );
        let ends = |gop: usize| (ladder.gops()[gop].points().first(), ladder.gops()[gop].points().last());
        let chosen: [Option<&Point>; 3] = [ends(0).0, ends(1).1, ends(2).0];
        for ((shown, point), (began_us, waited_us)) in report.shown.iter_mut().zip(chosen).zip([
            (1_000_000, 1_000_000),
            (2_000_000, 0),
            (5_000_000, 2_000_000),
        ]) {
            let point = point.expect("every GOP has points");
            (shown.point, shown.quality, shown.bytes) = (point.name, point.quality, point.bytes);
            (shown.began_us, shown.waited_us) = (began_us, waited_us);
        }
        report.ended_us = 6_000_000;
        report
    }

    fn near(value: f64, expected: f64) {
        assert!((value - expected).abs() < 1e-9, "{value} {expected}");
    }

    #[test]
    fn scores_follow_their_formulas() {
        let ladder = ladders::small(3);
        let report = playback(&ladder);
        let score = Score::of(&ladder, &report);
        let q: Vec<f64> = report.shown.iter().map(|shown| shown.quality).collect();
        let best = ladder
            .gops()
            .iter()
            .filter_map(|gop| gop.points().last())
            .map(|point| point.quality)
            .sum::<f64>()
            / 3.0;
        near(score.quality, (q[0] + q[1] + q[2]) / 3.0);
        let changes = (q[1] - q[0]) + (q[1] - q[2]);
        near(score.experience, (q[0] + q[1] + q[2] - changes - 3.0 * best) / 3.0);
        assert_eq!(
            (score.startup_seconds, score.stalled_seconds, score.stalls, score.switches),
            (1.0, 2.0, 1, 2)
        );
        let mean = |of: fn(&[Point]) -> Option<&Point>| {
            ladder
                .gops()
                .iter()
                .filter_map(|gop| of(gop.points()))
                .map(|point| real(point.bytes) * 8.0)
                .sum::<f64>()
                / 3.0
        };
        let (least, most) = (mean(<[Point]>::first), mean(<[Point]>::last));
        near(score.sabre_utility, libm::log(most / least) / 6.0);
        near(score.sabre_rebuffering, 2.0 / 6.0);
        near(score.sabre_score, (libm::log(most / least) - 5.0 * 2.0) / 6.0);
        near(score.lolp, (2.0 * least + most - 2.0 * (most - least) - 2.0 * most) / 3e6);
    }
}
