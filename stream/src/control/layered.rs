//! The rule for layered streams.

mod idle;
mod start;

use super::fetch::Fetch;
use super::ladder::Gop;
use super::levels::Levels;
use super::number::{count, real, seconds};
use super::options::{Choice, choices, gain};
use super::plan::{Outlook, Stage, best};
use super::rule::{Decision, Rule};
use super::state::{Playback, Request, State};
use idle::is_played_again;
use start::shortness;

/// What the rule goes by. The defaults were tuned on one half of a set of traces and checked on the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// GOPs that are planned ahead, from 1.
    pub horizon: usize,
    /// What a second without picture costs, in qualities of the best operating point.
    pub stall: f64,
    /// What a change of quality by 1 dB costs, in dB·s.
    pub change: f64,
    /// What a full buffer's last second is worth, in units of the sustainable point's next gain in quality.
    pub price: f64,
    /// How many times as much more the first second of an empty buffer is worth.
    pub fear: f64,
    /// Seconds of transfers that the sustainable rate is the mean of.
    pub memory: f64,
    /// Share of the buffer from which GOPs that are there already are upgraded.
    pub upgrade: f64,
    /// Part of the time to a GOP's start that an upgrade may take.
    pub haste: f64,
    /// Throughput in bits per second that is assumed before the first transfer.
    pub first_guess: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self {
            horizon: 8,
            stall: 1.0,
            change: 1.0,
            price: 0.6,
            fear: 4.0,
            memory: 20.0,
            upgrade: 0.15,
            haste: 0.8,
            first_guess: 1_000_000.0,
        }
    }
}

/// Robust model predictive control over the convex hull of operating points, after Yin et al. (SIGCOMM 2015), for layers:
///
/// - The next GOP is fetched up to the point that a plan over some GOPs finds best under a cautious prediction of
///   throughput, its base first and then by gain of quality per byte. A second of buffer has a price, which follows from
///   what the network can sustain and rises as the buffer falls.
/// - A short presentation starts with more than its base, within a second, where the first measured requests show that this
///   gains more than the wait costs, and is fetched whole as long as that comes in time.
/// - When enough is buffered, GOPs that are there are upgraded, if that gains more than it costs; when all is there, in what
///   time is left, and where a short presentation may be played again, those that were played too.
/// - A request is given up when the base of the next GOP would come too late because of it; what has arrived of it is
///   played.
/// - Live, playback runs a little faster or slower towards the latency that is aimed at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layered {
    weights: Weights,
    /// Whether nothing but files is between.
    is_local: bool,
}

impl Layered {
    /// The rule with other weights.
    pub fn new(weights: Weights) -> Self {
        Self { weights, is_local: false }
    }

    /// The rule for a package on this machine: there is no network whose time would have to be shared out, so every GOP is
    /// played at the best point that the device can take.
    pub fn local() -> Self {
        Self { is_local: true, ..Self::default() }
    }

    fn outlook(&self, state: &State) -> Outlook {
        let weights = &self.weights;
        let (least, most) =
            super::ladder::quality_range(horizon(state, state.first_missing(), weights.horizon));
        let sustainable = state.network().mean(weights.memory).unwrap_or(weights.first_guess);
        let range = (most - least).max(1.0);
        let price =
            price(state, sustainable / state.speed()).unwrap_or(range / 100.0) * self.eagerness(state);
        // Live, no more can be buffered than has been captured.
        let captured_us = state.settings().live.map_or(u64::MAX, |live| live.target_us);
        let full = seconds(state.settings().buffer_us.min(captured_us));
        Outlook {
            // In media time.
            throughput: state.network().robust().unwrap_or(weights.first_guess) / state.speed(),
            latency: state.network().latency() * state.speed(),
            buffer: seconds(state.buffer_us()),
            full,
            before: state.quality_before(state.first_missing()),
            stall_weight: weights.stall * most.max(1.0),
            change_weight: weights.change * shortness(state),
            // Towards its end, what is buffered of a stored presentation loses its worth.
            price: price * (left(state) / full.max(0.1)).min(1.0),
            fear: weights.fear,
        }
    }

    /// What a full buffer's last second is worth: on a network that proves steady so much that no more than it sustains is
    /// fetched, or else pictures would change to and fro.
    fn eagerness(&self, state: &State) -> f64 {
        let steady =
            state.network().error().map_or(0.0, |error| (1.0 - error / STEADY_ERROR).clamp(0.0, 1.0));
        self.weights.price + (1.0 - self.weights.price).max(0.0) * steady
    }

    /// What can be chosen of the GOPs that are planned ahead, from one on; those of which nothing can are left out.
    fn stages(&self, state: &State, from: usize) -> Vec<Stage> {
        let gops = horizon(state, from, self.weights.horizon).iter().zip(from..);
        let stages =
            gops.map(|(gop, index)| Stage::new(index, state.choices(index), seconds(gop.duration_us())));
        stages.filter(|stage| !stage.choices.is_empty()).collect()
    }

    /// What to fetch for the next GOP, and what quality it will have.
    fn extend(&self, state: &State, outlook: &Outlook) -> Option<Choice> {
        let stages = self.stages(state, state.first_missing());
        let (index, _) = best(&stages, outlook);
        stages.into_iter().next()?.choices.into_iter().nth(index)
    }

    /// The upgrade of a buffered GOP that gains most in the time it takes; none if none gains. `next` is the quality planned
    /// for the next GOP.
    fn upgrade(&self, state: &State, outlook: &Outlook, next: Option<f64>) -> Option<Fetch> {
        let mut found: Option<(f64, usize, Levels)> = None;
        for index in state.first_open()..state.first_missing() {
            let gop = state.ladder().gops().get(index)?;
            let until = time_until(state, index) * self.weights.haste;
            let options = state.choices(index);
            let Some(now) = options.first().cloned() else { continue };
            let around = [state.quality_before(index), state.quality(index.saturating_add(1)).or(next)];
            for option in options.into_iter().skip(1) {
                let time = outlook.time(option.bytes);
                if time > until {
                    break;
                }
                let changes =
                    |quality: f64| around.iter().flatten().map(|other| (other - quality).abs()).sum::<f64>();
                let smoother = changes(now.quality) - changes(option.quality);
                let better = (option.quality - now.quality) * seconds(gop.duration_us());
                let cost = outlook.worth(outlook.buffer) - outlook.worth(outlook.buffer - time);
                let net = (better + smoother * outlook.change_weight - cost) / time.max(1e-3);
                if net > found.as_ref().map_or(0.0, |best| best.0) {
                    found = Some((net, index, option.levels));
                }
            }
        }
        let (_, gop, levels) = found?;
        request(state, outlook, gop, &levels)
    }

    /// The next request, or when to look for one again.
    fn fetch(&self, state: &State) -> Decision {
        let first =
            improvement(state).or_else(|| self.before_start(state)).or_else(|| self.all_in_time(state));
        if let Some(fetch) = first {
            return Decision::Fetch(fetch);
        }
        let outlook = self.outlook(state);
        let next = state.first_missing();
        let plan = self.extend(state, &outlook);
        let quality = plan.as_ref().map(|plan| plan.quality);
        let wanted = plan.filter(|_| has_room(state, next) && state.available_us(next) <= state.now_us());
        // Time in which nothing else could be fetched costs nothing.
        let price = if wanted.is_some() { outlook.price } else { 0.0 };
        let buffered = outlook.buffer >= self.weights.upgrade * outlook.full;
        let upgrade = if buffered || wanted.is_none() {
            self.upgrade(state, &Outlook { price, ..outlook }, quality)
        } else {
            None
        };
        let fetch = upgrade
            .or_else(|| request(state, &outlook, next, &wanted?.levels))
            .or_else(|| self.in_spare_time(state, &outlook));
        fetch.map_or(later(state), Decision::Fetch)
    }

    /// Whether the running request is of no use any more, or stands in the way of the next base: that would come too late
    /// after it, and little more is buffered than that takes.
    fn abandons(&self, state: &State, request: &Request) -> bool {
        let gop = request.fetch.gop();
        if gop < state.first_open() && !is_played_again(state) {
            return true;
        }
        let next = state.first_missing();
        let Some(base) = base_bytes(state, next) else { return false };
        if gop == next || state.playback() != Playback::Playing || state.viewer.holds {
            return false;
        }
        let left = request.fetch.bytes().saturating_sub(request.progress.bytes);
        let rate = current_rate(state, request).unwrap_or(self.weights.first_guess);
        let time = |bytes: u64| real(bytes) * 8.0 / rate.max(1.0);
        // Short GOPs come in so quick succession that half a second is several of them.
        let gop_seconds = state.ladder().gops().get(next).map_or(1.0, |gop| seconds(gop.duration_us()));
        let need = (state.network().latency() + time(base) * MARGIN).max(0.5 * gop_seconds.min(1.0));
        let buffer = seconds(state.buffer_us()) / state.speed();
        time(left) + need > buffer && left > base && buffer < 4.0 * need
    }
}

/// All that is missing of what stands still, in the order of what it gains: nothing else is looked at.
fn improvement(state: &State) -> Option<Fetch> {
    let gop = state.viewer.holds.then(|| state.current())?;
    let best = state.choices(gop).pop()?;
    if state.is_ready(gop) { Fetch::towards(state, gop, &best.levels) } else { None }
}

/// The base of the next GOP is planned to take so many times as long as predicted.
const MARGIN: f64 = 1.5;

/// Error of predictions from which a network is not steady at all.
const STEADY_ERROR: f64 = 0.05;

/// A request counts as at leisure if it is predicted to take at most this share of the time to the start of its GOP.
const LEISURE: f64 = 0.25;

/// Requests what is missing, in few ranges if there is time.
fn request(state: &State, outlook: &Outlook, gop: usize, wanted: &Levels) -> Option<Fetch> {
    let fetch = Fetch::towards(state, gop, wanted)?;
    let until = time_until(state, gop);
    if outlook.time(fetch.bytes()) > LEISURE * until {
        Some(fetch)
    } else {
        Fetch::at_leisure(state, gop, wanted)
    }
}

/// Media seconds until a GOP begins; without end while the playhead stands still.
fn time_until(state: &State, gop: usize) -> f64 {
    if state.viewer.holds { f64::INFINITY } else { seconds(state.media_until(gop)) }
}

/// A rule that waits looks again after this time.
const TICK_US: u64 = 100_000;

fn later(state: &State) -> Decision {
    Decision::Wait { until_us: state.now_us().saturating_add(TICK_US) }
}

/// All of the next GOP that the device can take, as soon as there is room for it.
fn everything(state: &State) -> Option<Fetch> {
    let next = state.first_missing();
    let is_due = has_room(state, next) && state.available_us(next) <= state.now_us();
    Fetch::at_leisure(state, next, &state.choices(next).pop().filter(|_| is_due)?.levels)
}

/// Whether one more GOP fits in the buffer; it does if nothing is there.
fn has_room(state: &State, gop: usize) -> bool {
    let duration_us = state.ladder().gops().get(gop).map_or(0, Gop::duration_us);
    state.buffer_us() == 0 || state.buffer_us().saturating_add(duration_us) <= state.settings().buffer_us
}

/// Seconds of the presentation that are still to be fetched; without end if it is live.
fn left(state: &State) -> f64 {
    if state.settings().live.is_some() {
        return f64::INFINITY;
    }
    horizon(state, state.first_missing(), usize::MAX).iter().map(|gop| seconds(gop.duration_us())).sum()
}

/// The next GOPs from one on.
fn horizon(state: &State, from: usize, count: usize) -> &[Gop] {
    let gops = state.ladder().gops();
    let to = from.saturating_add(count.max(1)).min(gops.len());
    gops.get(from.min(to)..to).unwrap_or_default()
}

/// Bytes of what is missing of the base of a GOP.
fn base_bytes(state: &State, gop: usize) -> Option<u64> {
    let (gop, arrived) = (state.ladder().gops().get(gop)?, state.arrived(gop)?);
    Some(gop.missing_bytes(&gop.points().first()?.levels, arrived))
}

/// What a second of the network's time is worth when the buffer is full, in dB: the gain in quality per byte of the first
/// step of a GOP that the network cannot sustain, times the bytes it carries in a second. The GOP is the next one.
fn price(state: &State, throughput: f64) -> Option<f64> {
    let gops = state.ladder().gops();
    let gop = gops.get(state.first_missing().min(gops.len().checked_sub(1)?))?;
    let none = Levels::none(gop.representations());
    let hull = choices(gop, &none, &state.settings().limits);
    let budget = count(throughput / 8.0 * seconds(gop.duration_us()));
    let above = hull.iter().zip(hull.iter().skip(1)).find(|(_, to)| to.bytes > budget);
    let (from, to) = above.or_else(|| hull.iter().zip(hull.iter().skip(1)).next_back())?;
    let step = gain(from, to) * if above.is_some() { 1.0 } else { 0.5 };
    Some(step * seconds(gop.duration_us()) * throughput / 8.0)
}

/// A request that has run for so long says something of the network.
const ENOUGH_SECONDS: f64 = 0.3;

/// Throughput of the running request in bits per second, if enough of it has arrived, or else the prediction. What has not
/// begun after its latency counts as arriving at the rate that would deliver its first byte now.
fn current_rate(state: &State, request: &Request) -> Option<f64> {
    let predicted = state.network().robust();
    let since = seconds(state.now_us().saturating_sub(request.progress.sent_us)) - state.network().latency();
    if since < ENOUGH_SECONDS {
        return predicted;
    }
    let own = real(request.progress.bytes.max(1)) * 8.0 / since;
    Some(predicted.map_or(own, |predicted| own.min(predicted)))
}

/// Playback rate towards the latency that is aimed at: in proportion to the distance, a second of which is 5 %, in steps of
/// half a percent, and not faster than the buffer allows. None if it stays.
fn catch_up(state: &State) -> Option<u32> {
    let live = state.settings().live?;
    let distance = seconds(state.latency_us()?) - seconds(live.target_us);
    let short = seconds(state.buffer_us()) < 0.5;
    let wanted = if short { distance.min(-0.2) } else { distance };
    let step = (wanted * 10.0).clamp(-100.0, 100.0);
    let milli = 1000.0 + 5.0 * libm::trunc(step);
    let rate = milli.max(f64::from(live.slowest_milli)).min(f64::from(live.fastest_milli));
    let rate = u32::try_from(count(rate)).unwrap_or(1000);
    (state.playback() == Playback::Playing && rate != state.rate_milli()).then_some(rate)
}

impl Rule for Layered {
    fn decide(&mut self, state: &State) -> Decision {
        if let Some(milli) = catch_up(state) {
            return Decision::Rate { milli };
        }
        match state.request() {
            None if self.is_local => everything(state).map_or(later(state), Decision::Fetch),
            None => self.fetch(state),
            Some(request) if !self.is_local && self.abandons(state, request) => Decision::Abandon,
            Some(_) => later(state),
        }
    }

    fn whole_gops(&self) -> bool {
        self.is_local
    }

    fn may_start(&self, state: &State) -> bool {
        self.is_local || !self.holds(state)
    }
}
