//! The loop of events.

use super::request::{Request, Requests};
use super::trace::Trace;
use crate::control::{Decision, Fetch, Ladder, Playback, Rule, Session, Settings, Shown};
use std::collections::BTreeSet;

/// A network between a server and a player.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Its bandwidth.
    pub trace: Trace,
    /// From a request to its first byte, in microseconds.
    pub latency_us: u64,
    /// Times at which the connection is lost: a request that is running fails. They increase.
    pub losses_us: Vec<u64>,
    /// Time at which the simulation ends in any case.
    pub limit_us: u64,
    /// How fetches are sent.
    pub requests: Requests,
    /// A link that was idle for longer carries at once what it would have carried in so many microseconds.
    pub credit_us: u64,
}

impl Link {
    /// A link with a latency of 50 ms, no losses and no credit, for at most 10,000 s, on which fetches are one request.
    pub fn new(trace: Trace) -> Self {
        Self {
            trace,
            latency_us: 50_000,
            losses_us: Vec::new(),
            limit_us: 10_000_000_000,
            requests: Requests::Together,
            credit_us: 0,
        }
    }
}

/// What a playback was like.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The GOPs that were played, in order.
    pub shown: Vec<Shown>,
    /// Whether all were.
    pub complete: bool,
    /// How long playback had been waiting when the simulation ended, in microseconds; 0 if it was not.
    pub waiting_us: u64,
    /// When it ended, in microseconds from its start.
    pub ended_us: u64,
    /// Bytes that arrived.
    pub bytes: u64,
    /// Those of them that are levels of GOPs: what initialisation segments and the bytes between levels have is no media.
    pub media_bytes: u64,
    /// Requests that were sent.
    pub requests: u64,
    /// Requests that were given up by the rule.
    pub abandoned: u64,
    /// Decisions that were asked for.
    pub decisions: u64,
    /// All requests: when they were sent, and for what.
    pub fetches: Vec<(u64, Fetch)>,
}

impl Report {
    /// From the start to the first GOP, in microseconds; the whole time if none was played.
    pub fn startup_us(&self) -> u64 {
        self.shown.first().map_or(self.ended_us, |shown| shown.began_us)
    }

    /// How long playback stood still after it had started, in microseconds.
    pub fn stalled_us(&self) -> u64 {
        let last = if self.shown.is_empty() { 0 } else { self.waiting_us };
        self.shown.iter().skip(1).map(|shown| shown.waited_us).fold(last, u64::saturating_add)
    }
}

/// While a request runs, a rule is asked at least this often.
const TICK_US: u64 = 100_000;

/// Plays a presentation under a rule over a link, from time 0.
pub fn simulate<R: Rule>(ladder: &Ladder, settings: &Settings, rule: R, link: &Link) -> Report {
    let mut run = Run {
        session: Session::new(ladder.clone(), settings.clone(), rule, 0),
        link,
        now_us: 0,
        wake_us: 0,
        flow: None,
        inits: BTreeSet::new(),
        used: 0,
        report: Report {
            shown: Vec::new(),
            complete: false,
            waiting_us: 0,
            ended_us: 0,
            bytes: 0,
            media_bytes: 0,
            requests: 0,
            abandoned: 0,
            decisions: 0,
            fetches: Vec::new(),
        },
    };
    while run.session.state().playback() != Playback::Ended && run.now_us < link.limit_us {
        run.decide();
        run.step();
    }
    let mut report = run.report;
    report.shown = run.session.state().shown().to_vec();
    report.complete = run.session.state().playback() == Playback::Ended;
    report.media_bytes = run.session.state().media_bytes();
    report.waiting_us = run.session.state().waiting_us();
    report.ended_us = run.now_us;
    report
}

/// The running fetch on the network.
struct Flow {
    /// Its requests; the first one is running.
    requests: Vec<Request>,
    first_us: u64,
    /// What the network has carried before it.
    before: u128,
    /// Bytes of the running request, and of levels in those before it.
    bytes: u64,
    done: u64,
}

struct Run<'a, R> {
    session: Session<R>,
    link: &'a Link,
    now_us: u64,
    wake_us: u64,
    flow: Option<Flow>,
    /// Representations whose initialisation segments have arrived.
    inits: BTreeSet<usize>,
    /// What the network had carried when it last carried something.
    used: u128,
    report: Report,
}

/// A byte in millionths of a bit.
const BYTE: u128 = 8_000_000;

impl<R: Rule> Run<'_, R> {
    /// Does what the rule wants until it waits.
    fn decide(&mut self) {
        // A rule that never waits does not stop the clock.
        for _ in 0..16 {
            self.report.decisions = self.report.decisions.saturating_add(1);
            match self.session.decide(self.now_us) {
                Decision::Fetch(fetch) => self.send(fetch),
                Decision::Abandon => {
                    self.flow = None;
                    self.report.abandoned = self.report.abandoned.saturating_add(1);
                }
                Decision::Rate { .. } => {}
                Decision::Wait { until_us } => {
                    self.wake_us = until_us.max(self.now_us.saturating_add(1000));
                    return;
                }
            }
        }
        self.wake_us = self.now_us.saturating_add(1000);
    }

    fn send(&mut self, fetch: Fetch) {
        let requests = self.link.requests.of(&fetch, self.session.state().ladder(), &self.inits);
        self.begin(requests, 0);
        self.report.fetches.push((self.now_us, fetch));
    }

    /// The first of some requests is sent, after so many bytes of levels have arrived.
    fn begin(&mut self, requests: Vec<Request>, done: u64) {
        let first_us = self.now_us.saturating_add(self.link.latency_us);
        let before = self.used.max(self.link.trace.carried(first_us.saturating_sub(self.link.credit_us)));
        self.flow = Some(Flow { requests, first_us, before, bytes: 0, done });
        self.report.requests = self.report.requests.saturating_add(1);
    }

    /// Goes on to the next event.
    fn step(&mut self) {
        let mut next = self.wake_us.min(self.link.limit_us);
        if let Some(end) = self.session.state().gop_end_us() {
            next = next.min(end);
        }
        let loss = self.link.losses_us.iter().copied().find(|&loss| loss > self.now_us);
        if let Some(flow) = &self.flow {
            let mut ends = flow.requests.iter().take(1).flat_map(Request::ends);
            let mark = ends.find(|&end| end > flow.bytes).unwrap_or(0);
            let carried = flow.before.saturating_add(u128::from(mark).saturating_mul(BYTE));
            let mark_us = self.link.trace.time_of(carried).unwrap_or(u64::MAX).max(flow.first_us);
            let event_us = if self.now_us < flow.first_us { flow.first_us } else { mark_us };
            next = next.min(event_us).min(self.now_us.saturating_add(TICK_US)).min(loss.unwrap_or(u64::MAX));
        }
        self.now_us = next.max(self.now_us);
        self.receive(loss == Some(self.now_us));
    }

    /// Hands the session what has arrived by now.
    fn receive(&mut self, lost: bool) {
        let Some(flow) = &mut self.flow else { return };
        if self.now_us >= flow.first_us {
            let carried = self.link.trace.carried(self.now_us).saturating_sub(flow.before);
            let nothing = Request::default();
            let request = flow.requests.first().unwrap_or(&nothing);
            let all = request.bytes();
            let bytes = u64::try_from(carried / BYTE).unwrap_or(u64::MAX).min(all);
            self.report.bytes = self.report.bytes.saturating_add(bytes.saturating_sub(flow.bytes));
            flow.bytes = bytes;
            self.used = flow.before.saturating_add(u128::from(bytes).saturating_mul(BYTE));
            let arrived = flow.done.saturating_add(request.counted(bytes));
            self.inits.extend(request.inits(bytes));
            self.session.received(self.now_us, arrived);
            if bytes == all {
                let rest = flow.requests.get(1..).unwrap_or_default().to_vec();
                self.flow = None;
                if !rest.is_empty() {
                    self.begin(rest, arrived);
                }
                return;
            }
        }
        if lost {
            self.flow = None;
            self.session.failed(self.now_us);
        }
    }
}
