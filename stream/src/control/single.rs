//! Rules that know no layers: they pick one of some operating points for each GOP, as for a presentation of alternatives.

use super::fetch::Fetch;
use super::ladder::{Ladder, OperatingPoint, Point};
use super::number::{real, seconds, size};
use super::options::{Choice, Limits, hull};
use super::rule::{Decision, Rule};
use super::state::{Request, State};
use super::throughput::Network;

/// An operating point that is offered as an alternative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// Its name.
    pub point: OperatingPoint,
    /// Mean bitrate over the presentation in bits per second.
    pub bitrate: f64,
    /// Mean quality in dB.
    pub quality: f64,
}

impl Rung {
    /// The alternatives of a presentation: the upper convex hull of the means of its operating points, from the least
    /// bitrate.
    pub fn of(ladder: &Ladder, limits: &Limits) -> Vec<Self> {
        let gops = ladder.gops();
        let Some(first) = gops.first() else { return Vec::new() };
        let media = seconds(ladder.duration_us()).max(1e-6);
        let mut names = Vec::new();
        let mut means = Vec::new();
        for (index, point) in
            first.points().iter().enumerate().filter(|(index, p)| *index == 0 || limits.allow(p, first))
        {
            let same =
                || gops.iter().filter_map(|gop| gop.points().iter().find(|other| other.name == point.name));
            let bytes = same().map(|point| point.bytes).fold(0, u64::saturating_add);
            let quality = same().map(|point| point.quality).sum::<f64>() / real(size(gops.len()));
            names.push((bytes, index, point.name));
            means.push(Choice { levels: point.levels.clone(), bytes, quality });
        }
        let named = |choice: Choice| {
            let (_, _, point) = names.iter().find(|(bytes, _, _)| *bytes == choice.bytes)?;
            Some(Self { point: *point, bitrate: real(choice.bytes) * 8.0 / media, quality: choice.quality })
        };
        hull(means).into_iter().filter_map(named).collect()
    }
}

/// What such a rule sees.
#[derive(Clone, Copy, Debug)]
pub struct Situation<'a> {
    /// Time in microseconds.
    pub now_us: u64,
    /// The GOP to pick for, or that is being fetched.
    pub gop: usize,
    /// Number of GOPs.
    pub gops: usize,
    /// Duration of that GOP in seconds.
    pub duration: f64,
    /// Buffered seconds.
    pub buffer: f64,
    /// Largest buffer in seconds.
    pub full: f64,
    /// The rung of the last GOP.
    pub last: Option<usize>,
    /// The alternatives.
    pub rungs: &'a [Rung],
    /// Bytes of each for this GOP.
    pub bytes: &'a [u64],
    /// The requests so far.
    pub network: &'a Network,
}

impl Situation<'_> {
    /// The largest rung whose bitrate a throughput in bits per second sustains, latency included.
    pub fn sustained(&self, throughput: f64) -> usize {
        let time = |rung: &Rung| self.network.latency() + rung.bitrate * self.duration / throughput.max(1.0);
        self.rungs.iter().rposition(|rung| time(rung) <= self.duration).unwrap_or(0)
    }
}

/// What is picked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pick {
    /// Index of the rung; the last if there are fewer.
    pub rung: usize,
    /// Microseconds to wait before it is fetched.
    pub wait_us: u64,
}

/// A rule that picks a rung for each GOP.
pub trait SingleRule {
    /// The rung for the next GOP.
    fn pick(&mut self, situation: &Situation<'_>) -> Pick;

    /// The rung to change to while a GOP is being fetched; none to go on.
    fn give_up(&mut self, situation: &Situation<'_>, request: &Request) -> Option<usize> {
        let _ = (situation, request);
        None
    }
}

impl<R: SingleRule + ?Sized> SingleRule for Box<R> {
    fn pick(&mut self, situation: &Situation<'_>) -> Pick {
        (**self).pick(situation)
    }

    fn give_up(&mut self, situation: &Situation<'_>, request: &Request) -> Option<usize> {
        (**self).give_up(situation, request)
    }
}

/// Plays by a [`SingleRule`]: GOP after GOP, while the buffer has room. What is given up and fetched again at a lower rung
/// keeps the pieces that have arrived.
#[derive(Clone, Debug)]
pub struct Single<R> {
    rule: R,
    whole: bool,
    rungs: Vec<Rung>,
    last: Option<usize>,
    /// GOP, rung and time of what is to be fetched.
    pending: Option<(usize, usize, u64)>,
}

impl<R: SingleRule> Single<R> {
    /// A player without layers: a GOP is played only when all that was picked for it has arrived.
    pub fn whole(rule: R) -> Self {
        Self { rule, whole: true, rungs: Vec::new(), last: None, pending: None }
    }

    /// A player that plays what has arrived of a GOP when its time comes.
    pub fn partial(rule: R) -> Self {
        Self { whole: false, ..Self::whole(rule) }
    }

    /// Calls the rule with what it may see.
    fn ask<T>(
        &mut self,
        state: &State,
        gop: usize,
        ask: impl FnOnce(&mut R, &Situation<'_>) -> T,
    ) -> Option<T> {
        if self.rungs.is_empty() {
            self.rungs = Rung::of(state.ladder(), &state.settings().limits);
        }
        let known = state.ladder().gops().get(gop)?;
        let of = |rung: &Rung| {
            known.points().iter().find(|point| point.name == rung.point).map_or(0, |point| point.bytes)
        };
        let bytes: Vec<u64> = self.rungs.iter().map(of).collect();
        let situation = Situation {
            now_us: state.now_us(),
            gop,
            gops: state.ladder().gops().len(),
            duration: seconds(known.duration_us()),
            buffer: seconds(state.buffer_us()),
            full: seconds(state.settings().buffer_us),
            last: self.last,
            rungs: &self.rungs,
            bytes: &bytes,
            network: state.network(),
        };
        Some(ask(&mut self.rule, &situation))
    }

    /// Fetches what is pending, as soon as its time has come.
    fn fetch(&mut self, state: &State, later: Decision) -> Decision {
        let Some((gop, rung, from_us)) = self.pending else { return later };
        if from_us > state.now_us() {
            return Decision::Wait { until_us: from_us };
        }
        self.pending = None;
        self.last = Some(rung);
        let known = state.ladder().gops().get(gop).filter(|_| gop >= state.first_open());
        let name = self.rungs.get(rung).or(self.rungs.last()).map(|rung| rung.point);
        let point = known.and_then(|known| known.points().iter().find(|point| Some(point.name) == name));
        let all = if self.whole { Fetch::at_leisure } else { Fetch::towards };
        let within =
            |point: &Point| Some(&known?.playable(&point.levels.intersection(state.available(gop)?))?.levels);
        let fetch = point.and_then(|point| all(state, gop, within(point)?));
        fetch.map_or(later, Decision::Fetch)
    }
}

impl<R: SingleRule> Rule for Single<R> {
    fn decide(&mut self, state: &State) -> Decision {
        let later = Decision::Wait { until_us: state.now_us().saturating_add(100_000) };
        if let Some(request) = state.request() {
            let gop = request.fetch.gop();
            let rung = self.ask(state, gop, |rule, situation| rule.give_up(situation, request)).flatten();
            let Some(rung) = rung else { return later };
            self.pending = Some((gop, rung, state.now_us()));
            return Decision::Abandon;
        }
        if self.pending.is_none() {
            let next = state.first_missing();
            let Some(known) = state.ladder().gops().get(next) else { return later };
            let after = state.buffer_us().saturating_add(known.duration_us());
            let full = after > state.settings().buffer_us && state.buffer_us() > 0;
            if full || state.available_us(next) > state.now_us() {
                let over = after.saturating_sub(state.settings().buffer_us).max(1000);
                return Decision::Wait { until_us: state.now_us().saturating_add(over.min(100_000)) };
            }
            let Some(pick) = self.ask(state, next, SingleRule::pick) else { return later };
            self.pending = Some((next, pick.rung, state.now_us().saturating_add(pick.wait_us)));
        }
        self.fetch(state, later)
    }

    fn whole_gops(&self) -> bool {
        self.whole
    }
}
