//! Well-known rules without layers, to compare with.

use super::number::{microseconds, real, seconds};
use super::single::{Pick, SingleRule, Situation};
use super::state::Request;

/// Part of the measured throughput that is used.
const SAFETY: f64 = 0.9;

/// Picks the largest bitrate below 90 % of the mean throughput of the last transfers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ThroughputRule;

/// Seconds of transfers whose mean is the throughput.
const MEMORY: f64 = 4.0;

impl SingleRule for ThroughputRule {
    fn pick(&mut self, situation: &Situation<'_>) -> Pick {
        let rung = situation.network.mean(MEMORY).map_or(0, |mean| situation.sustained(mean * SAFETY));
        Pick { rung, wait_us: 0 }
    }

    fn give_up(&mut self, situation: &Situation<'_>, request: &Request) -> Option<usize> {
        too_slow(situation, request)
    }
}

/// A lower rung if a request, after half a second, will take over 1.8 times the duration of the GOP, and the other one needs
/// fewer bytes than are missing.
fn too_slow(situation: &Situation<'_>, request: &Request) -> Option<usize> {
    let since = seconds(situation.now_us.saturating_sub(request.progress.first_us));
    let taken = seconds(situation.now_us.saturating_sub(request.progress.sent_us));
    if request.progress.bytes == 0 || taken < 0.5 || since <= 0.0 {
        return None;
    }
    let rate = real(request.progress.bytes) * 8.0 / since;
    let left = request.fetch.bytes().saturating_sub(request.progress.bytes);
    let rung = situation.sustained(rate * SAFETY);
    let fewer = rung < situation.last? && situation.bytes.get(rung).is_some_and(|&bytes| bytes < left);
    (taken + real(left) * 8.0 / rate > 1.8 * situation.duration && fewer).then_some(rung)
}

/// BBA-0: the bitrate is a function of the buffer, the least up to a reservoir, then in proportion up to the largest when 90 %
/// is full; it changes only when that function reaches the next one (Huang et al., "A Buffer-Based Approach to Rate Adaptation",
/// SIGCOMM 2014, section 4; the reservoir is the same share of the buffer, 37.5 %).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BufferRule;

impl SingleRule for BufferRule {
    fn pick(&mut self, situation: &Situation<'_>) -> Pick {
        let rates: Vec<f64> = situation.rungs.iter().map(|rung| rung.bitrate).collect();
        let (least, most) = (rates.first().copied().unwrap_or(0.0), rates.last().copied().unwrap_or(0.0));
        let (reservoir, upper) = (0.375 * situation.full, 0.9 * situation.full);
        let share = ((situation.buffer - reservoir) / (upper - reservoir).max(1e-3)).clamp(0.0, 1.0);
        let rate = least + (most - least) * share;
        let last = situation.last.unwrap_or(0);
        let up = rates.get(last.saturating_add(1)).copied().unwrap_or(most);
        let down = last.checked_sub(1).and_then(|down| rates.get(down)).copied().unwrap_or(least);
        let rung = if share >= 1.0 {
            rates.len().saturating_sub(1)
        } else if share <= 0.0 {
            0
        } else if rate >= up {
            rates.iter().rposition(|&other| other <= rate).unwrap_or(0)
        } else if rate <= down {
            rates.iter().position(|&other| other >= rate).unwrap_or(0)
        } else {
            last
        };
        Pick { rung, wait_us: 0 }
    }
}

/// BOLA-E with the cap of BOLA-O, as dash.js has it: the utility of a bitrate is its logarithm; the rung with the largest
/// (V · (utility + gamma) - buffer) / bitrate is picked (Spiteri, Urgaonkar, Sitaraman, "BOLA: Near-Optimal Bitrate Adaptation
/// for Online Videos", INFOCOM 2016). Time that was not spent on fetching counts as buffered, a rise above the throughput is
/// not followed, and a nearly empty buffer limits what is fetched (the same and Sparacio, MMSys 2018).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bola {
    placeholder: f64,
    started: bool,
}

/// Buffer in seconds below which the least bitrate is preferred.
const LOW_BUFFER: f64 = 10.0;

impl Bola {
    /// V and gamma, with V · gamma = 10 s, and V · (largest utility + gamma) the full buffer, or 10 s and 2 s for each rung if
    /// that is more.
    fn parameters(situation: &Situation<'_>) -> (f64, f64) {
        let rungs = situation.rungs.iter().fold(0.0, |count, _| count + 1.0);
        let target = situation.full.max(LOW_BUFFER + 2.0 * rungs);
        let most = utility(situation, situation.rungs.len().saturating_sub(1)).max(1e-3);
        let v = (target - LOW_BUFFER) / most;
        (v, LOW_BUFFER / v)
    }

    fn preferred(situation: &Situation<'_>, buffer: f64) -> usize {
        let (v, gamma) = Self::parameters(situation);
        let score =
            |rung: usize, rate: f64| (v * (utility(situation, rung) + gamma) - buffer) / rate.max(1.0);
        let scores =
            situation.rungs.iter().enumerate().map(|(index, rung)| (index, score(index, rung.bitrate)));
        scores.fold((0, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best }).0
    }

    /// The least buffer at which a rung is preferred to all below it.
    fn least_buffer(situation: &Situation<'_>, rung: usize) -> f64 {
        let (v, gamma) = Self::parameters(situation);
        let rate = |index: usize| situation.rungs.get(index).map_or(1.0, |rung| rung.bitrate);
        let own = (rate(rung), utility(situation, rung));
        let against = |other: usize| {
            let (low, least) = (rate(other), utility(situation, other));
            v * (gamma + (own.0 * least - low * own.1) / (own.0 - low).max(1.0))
        };
        (0..rung).map(against).fold(0.0, f64::max)
    }

    /// Counts time in which nothing was fetched as if it had been buffered, within what the last rung implies.
    fn account(&mut self, situation: &Situation<'_>, last: usize) {
        let Some(transfer) = situation.network.last() else { return };
        let idle = seconds(situation.now_us.saturating_sub(transfer.last_us));
        let then = situation.buffer + seconds(situation.now_us.saturating_sub(transfer.sent_us));
        let (v, gamma) = Self::parameters(situation);
        let most = (v * (utility(situation, last) + gamma) - then).max(0.0);
        self.placeholder =
            (self.placeholder.min(most) + idle).max(Self::least_buffer(situation, last) - then);
    }

    /// Limits a rung to what arrives within half of the buffer.
    fn within_buffer(situation: &Situation<'_>, rung: usize, throughput: f64) -> usize {
        let safe = 0.5 * (situation.buffer - situation.network.latency()).max(0.0) * throughput / 8.0;
        let fits = |&(_, &bytes): &(usize, &u64)| real(bytes) <= safe;
        let largest = situation.bytes.iter().enumerate().filter(fits).map(|(index, _)| index).max();
        rung.min(largest.unwrap_or(0))
    }
}

/// ln(bitrate / least bitrate)
fn utility(situation: &Situation<'_>, rung: usize) -> f64 {
    let rate = |index: usize| situation.rungs.get(index).map_or(1.0, |rung| rung.bitrate.max(1.0));
    libm::log(rate(rung) / rate(0))
}

impl SingleRule for Bola {
    fn pick(&mut self, situation: &Situation<'_>) -> Pick {
        let Some(throughput) = situation.network.mean(MEMORY) else { return Pick { rung: 0, wait_us: 0 } };
        let sustained = situation.sustained(throughput);
        if !self.started {
            self.started = true;
            self.placeholder = (Self::least_buffer(situation, sustained) - situation.buffer).max(0.0);
        }
        let last = situation.last.unwrap_or(0);
        self.account(situation, last);
        let mut rung = Self::preferred(situation, situation.buffer + self.placeholder);
        if rung > last && rung > sustained {
            rung = last.max(sustained);
        }
        let (v, gamma) = Self::parameters(situation);
        let over = situation.buffer + self.placeholder - v * (utility(situation, rung) + gamma);
        let top = rung.saturating_add(1) >= situation.rungs.len();
        let wait = (over - self.placeholder).max(0.0);
        self.placeholder = (self.placeholder - over.max(0.0)).max(0.0);
        let limited = Self::within_buffer(situation, rung, throughput);
        if limited < rung {
            let least = (Self::least_buffer(situation, limited) - situation.buffer).max(0.0);
            self.placeholder = self.placeholder.min(least);
        }
        let waits = !top && limited == rung;
        Pick { rung: limited, wait_us: if waits { microseconds(wait) } else { 0 } }
    }

    fn give_up(&mut self, situation: &Situation<'_>, request: &Request) -> Option<usize> {
        let rung = too_slow(situation, request)?;
        let least = (Self::least_buffer(situation, rung) - situation.buffer).max(0.0);
        self.placeholder = self.placeholder.min(least);
        Some(rung)
    }
}
