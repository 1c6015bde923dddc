//! The loop of a playback: the controller decides, requests run, GOPs are shown.

use super::clock::Clock;
use super::download::{Download, Event};
use super::parts::{Kind, Part, jobs, parts};
use super::report::{GopLog, Loss, Outcome, PlayedGop, Screen};
use super::source::Fault;
use super::store::Store;
use super::{Client, ClientError, Options, read_manifest};
use crate::control::number::size;
use crate::control::{Decision, Fetch, Gop, Ladder, OperatingPoint, Playback, Rule, Session, Settings};
use crate::manifest::{GopInfo, Manifest};
use crate::simulation::Report;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// While a request runs, the controller is asked at least this often.
const TICK_US: u64 = 100_000;

/// Times that a level may arrive damaged.
const DAMAGED: u32 = 2;

impl Client {
    /// Plays all of the presentation under a rule.
    ///
    /// # Errors
    /// A package that becomes another one, and one whose GOPs are too large.
    pub fn play<R: Rule>(&mut self, rule: R, screen: &mut dyn Screen) -> Result<Outcome, ClientError> {
        let ladder = self.manifest.ladder().map_err(|_| ClientError::Changed(None))?;
        let settings = settings(&self.options, &ladder)?;
        let clock = Clock::new(self.options.real_time);
        let logs = self.manifest.gops.iter().map(log).collect();
        let mut player = Player {
            session: Session::new(ladder, settings, rule, clock.now_us()),
            client: self,
            clock,
            store: Store::default(),
            running: None,
            faults: BTreeMap::new(),
            refused: BTreeSet::new(),
            presented: 0,
            logs,
            losses: Vec::new(),
            decisions: 0,
            fetches: Vec::new(),
        };
        while player.session.state().playback() != Playback::Ended {
            let wake_us = player.decide();
            player.present(screen);
            player.step(wake_us)?;
        }
        player.present(screen);
        Ok(player.outcome())
    }
}

fn log(gop: &GopInfo) -> GopLog {
    GopLog { first_frame: gop.first_frame, frame_count: gop.frame_count, ..GopLog::default() }
}

/// The settings with a buffer that fits into the memory.
fn settings(options: &Options, ladder: &Ladder) -> Result<Settings, ClientError> {
    let bytes = |gop: &Gop| gop.points().iter().map(|point| point.bytes).max().unwrap_or(0);
    let largest = ladder.gops().iter().map(bytes).max().unwrap_or(0).max(1);
    // One is shown and one arrives beside those that are buffered.
    let fit = options.memory.checked_div(largest).unwrap_or(0).saturating_sub(2);
    if fit == 0 {
        return Err(ClientError::TooLarge(largest));
    }
    let shortest = ladder.gops().iter().map(Gop::duration_us).min().unwrap_or(1);
    let buffer_us = options.settings.buffer_us.min(fit.saturating_mul(shortest));
    let start_us = options.settings.start_us.min(buffer_us);
    Ok(Settings { buffer_us, start_us, ..options.settings.clone() })
}

/// A fetch that runs.
#[derive(Debug)]
struct Running {
    download: Download,
    parts: Vec<Part>,
    /// The part that arrives, and what has arrived of it.
    next: usize,
    buffer: Vec<u8>,
    /// Bytes of the levels before it.
    before: u64,
}

struct Player<'a, R> {
    client: &'a mut Client,
    session: Session<R>,
    clock: Clock,
    store: Store,
    running: Option<Running>,
    /// Per GOP, Representation and piece: requests that were of no use, and those among them that brought damaged bytes.
    faults: BTreeMap<(usize, usize, u8), (u32, u32)>,
    /// Representations whose files the server refuses.
    refused: BTreeSet<usize>,
    /// The next GOP to show.
    presented: usize,
    logs: Vec<GopLog>,
    losses: Vec<Loss>,
    decisions: u64,
    fetches: Vec<(u64, Fetch)>,
}

impl<R: Rule> Player<'_, R> {
    /// Does what the controller wants until it waits; until when.
    fn decide(&mut self) -> u64 {
        // A rule that never waits does not stop the clock.
        for _ in 0..16 {
            let now_us = self.clock.now_us();
            self.decisions = self.decisions.saturating_add(1);
            match self.session.decide(now_us) {
                Decision::Fetch(fetch) => self.send(fetch, now_us),
                Decision::Abandon => self.abandon(),
                Decision::Rate { .. } => {}
                Decision::Wait { until_us } => return until_us.max(now_us.saturating_add(1000)),
            }
        }
        self.clock.now_us().saturating_add(1000)
    }

    fn send(&mut self, fetch: Fetch, now_us: u64) {
        let parts =
            parts(&self.client.manifest, &fetch, |representation| !self.store.has_init(representation));
        let download = Download::start(self.client.source.clone(), jobs(&self.client.manifest, &parts));
        self.running = Some(Running { download, parts, next: 0, buffer: Vec::new(), before: 0 });
        self.fetches.push((now_us, fetch));
    }

    fn abandon(&mut self) {
        if let Some(gop) = self.running.take().and_then(|running| running.parts.first().map(|part| part.gop))
        {
            self.count(gop, |log| log.abandoned = log.abandoned.saturating_add(1));
        }
    }

    fn count(&mut self, gop: usize, add: impl FnOnce(&mut GopLog)) {
        if let Some(log) = self.logs.get_mut(gop) {
            add(log);
        }
    }

    /// Waits for the next event, and takes it.
    fn step(&mut self, wake_us: u64) -> Result<(), ClientError> {
        let until_us = self.session.state().gop_end_us().map_or(wake_us, |end_us| end_us.min(wake_us));
        let Some(running) = &self.running else {
            self.clock.wait_until(until_us);
            return Ok(());
        };
        let left_us = until_us.saturating_sub(self.clock.now_us()).clamp(1, TICK_US);
        let Some(event) = running.download.next(Duration::from_micros(left_us)) else { return Ok(()) };
        let gop = running.parts.first().map_or(0, |part| part.gop);
        match event {
            Event::Sent => self.count(gop, |log| log.requests = log.requests.saturating_add(1)),
            Event::Begun => self.session.received(self.clock.now_us(), self.counted()),
            Event::Bytes(bytes) => {
                self.count(gop, |log| log.bytes = log.bytes.saturating_add(size(bytes.len())));
                return self.receive(&bytes);
            }
            Event::Failed(fault) => return self.fail(fault),
        }
        Ok(())
    }

    /// Bytes of the running fetch that count: those of a level only with its last one, if its digest is right.
    fn counted(&self) -> u64 {
        self.running.as_ref().map_or(0, |running| {
            match running.parts.get(running.next).map(|part| part.kind) {
                Some(Kind::Level { .. }) => running.before.saturating_add(size(running.buffer.len())),
                _ => running.before,
            }
        })
    }

    /// Takes bytes of the running fetch.
    fn receive(&mut self, mut bytes: &[u8]) -> Result<(), ClientError> {
        while let Some(running) = &mut self.running {
            let Some(part) = running.parts.get(running.next) else { break };
            let missing = part.range.size.saturating_sub(size(running.buffer.len()));
            let (own, rest) = bytes
                .split_at_checked(usize::try_from(missing).unwrap_or(usize::MAX))
                .unwrap_or((bytes, &[]));
            running.buffer.extend_from_slice(own);
            bytes = rest;
            if size(running.buffer.len()) < part.range.size {
                break;
            }
            let whole = std::mem::take(&mut running.buffer);
            if !part.range.holds(&whole) {
                return self.fail(Fault::Digest);
            }
            if self.store.insert(part, whole).is_err() {
                return self.fail(Fault::Wrong("the file was packaged wrongly"));
            }
            if matches!(part.kind, Kind::Level { .. }) {
                running.before = running.before.saturating_add(part.range.size);
            }
            running.next = running.next.saturating_add(1);
        }
        let counted = self.counted();
        if self.running.as_ref().is_some_and(|running| running.next >= running.parts.len()) {
            self.running = None;
        }
        self.session.received(self.clock.now_us(), counted);
        Ok(())
    }

    /// The running fetch has failed: tells the controller, and leaves out what has failed too often.
    fn fail(&mut self, fault: Fault) -> Result<(), ClientError> {
        let Some(running) = self.running.take() else { return Ok(()) };
        self.session.failed(self.clock.now_us());
        let Some(part) = running.parts.get(running.next) else { return Ok(()) };
        self.count(part.gop, |log| log.failures = log.failures.saturating_add(1));
        if fault == Fault::Changed {
            self.read_again()?;
        }
        if self.is_too_often(part, &fault) {
            self.leave_out(part, &fault);
        }
        Ok(())
    }

    fn is_too_often(&mut self, part: &Part, fault: &Fault) -> bool {
        let options = &self.client.options;
        let (all, damaged) = self.faults.entry((part.gop, part.representation, part.piece)).or_default();
        *all = all.saturating_add(1);
        if *fault == Fault::Digest {
            *damaged = damaged.saturating_add(1);
        }
        let is_base = part.representation == 0 && part.piece == 0;
        let most = match (is_base, self.refused.contains(&part.representation) && fault.is_final()) {
            (_, true) => 1,
            (true, false) => options.base_attempts,
            (false, false) => options.attempts,
        };
        *all >= most || *damaged >= DAMAGED
    }

    fn leave_out(&mut self, part: &Part, fault: &Fault) {
        if fault.is_final() {
            self.refused.insert(part.representation);
        }
        self.session.unavailable(self.clock.now_us(), part.gop, part.representation, part.piece);
        let manifest = &self.client.manifest;
        let representation = manifest.representations.get(part.representation).map(|info| info.id.clone());
        let refinement = match part.kind {
            Kind::Init => 0,
            Kind::Level { level, .. } => level,
        };
        self.losses.push(Loss {
            gop: part.gop,
            representation: representation.unwrap_or_default(),
            refinement,
            reason: fault.to_string(),
        });
    }

    /// Reads the manifest again, and goes on if it is that of the same package, to which GOPs may have been added.
    fn read_again(&mut self) -> Result<(), ClientError> {
        let manifest = read_manifest(&self.client.source, &self.client.options)?;
        self.client.source.forget();
        let known = self.client.manifest.gops.len();
        check_same(&self.client.manifest, &manifest)?;
        self.client.manifest = manifest;
        for gop in known..self.client.manifest.gops.len() {
            let manifest = &self.client.manifest;
            let Some((info, description)) = manifest.gops.get(gop).zip(manifest.description(gop)) else {
                break;
            };
            self.logs.push(log(info));
            let pushed = self.session.push(self.clock.now_us(), description);
            pushed.map_err(|_| ClientError::Changed(Some(gop)))?;
        }
        Ok(())
    }

    /// Hands the screen what has begun.
    fn present(&mut self, screen: &mut dyn Screen) {
        while self.presented < self.session.state().first_open() {
            let number = self.presented;
            self.presented = number.saturating_add(1);
            self.show(number, screen);
            self.store.drop_before(self.presented);
        }
    }

    fn show(&mut self, number: usize, screen: &mut dyn Screen) {
        let state = self.session.state();
        let shown = state.shown().iter().rev().find(|shown| shown.gop == number).copied();
        let buffer_us = state
            .media_until(state.first_missing())
            .saturating_sub(state.media_until(number.saturating_add(1)));
        let pieces = shown.and_then(|shown| {
            let points = state.ladder().gops().get(number)?.points().iter();
            points.clone().find(|point| point.name == shown.point).map(|point| point.levels.clone())
        });
        let manifest = &self.client.manifest;
        let (units, malformed) =
            pieces.map(|pieces| self.store.units(manifest, number, &pieces)).unwrap_or_default();
        let losses =
            malformed.into_iter().filter_map(|index| manifest.representations.get(index)).map(|info| Loss {
                gop: number,
                representation: info.id.clone(),
                refinement: 0,
                reason: "the file was packaged wrongly".to_owned(),
            });
        self.losses.extend(losses);
        let point = shown.map(|shown| decodable(manifest, shown.point));
        self.count(number, |log| (log.shown, log.buffer_us) = (shown, buffer_us));
        if let Some(log) = self.logs.get(number) {
            screen.show(&PlayedGop { number, point, head: self.store.head(), units: &units, log });
        }
    }

    fn outcome(self) -> Outcome {
        let sum = |of: fn(&GopLog) -> u64| self.logs.iter().map(of).fold(0, u64::saturating_add);
        let state = self.session.state();
        let report = Report {
            shown: state.shown().to_vec(),
            complete: state.shown().len() == state.ladder().gops().len(),
            waiting_us: state.waiting_us(),
            ended_us: state.now_us(),
            bytes: sum(|log| log.bytes),
            requests: sum(|log| log.requests),
            abandoned: sum(|log| log.abandoned),
            decisions: self.decisions,
            fetches: self.fetches,
        };
        let ladder = state.ladder().clone();
        Outcome { report, gops: self.logs, losses: self.losses, ladder }
    }
}

/// The point that a decoder is told: I frames that are fetched whole are shown whole where they are alone.
fn decodable(manifest: &Manifest, point: OperatingPoint) -> OperatingPoint {
    let levels = manifest.levels_of_piece(0, 0).map_or(1, |levels| levels.end);
    let least = if point.temporal.is_none() { levels.saturating_sub(1) } else { 0 };
    OperatingPoint { refinement: point.refinement.max(least), ..point }
}

/// A package shall be the one it was, but for GOPs that were added and for where ranges are.
fn check_same(old: &Manifest, new: &Manifest) -> Result<(), ClientError> {
    let ids = |manifest: &Manifest| -> Vec<(String, String)> {
        let all = manifest.representations.iter();
        all.map(|info| (info.id.clone(), info.init.digest.clone())).collect()
    };
    let stream = |manifest: &Manifest| {
        let mut stream = manifest.stream.clone();
        (stream.bytes, stream.frames) = (0, 0);
        stream.digest.clear();
        stream
    };
    if ids(old) != ids(new) || stream(old) != stream(new) {
        return Err(ClientError::Changed(None));
    }
    let levels = |gop: &GopInfo| -> Vec<(String, u64, String)> {
        let all = gop
            .subsegments
            .iter()
            .flat_map(|one| one.levels.iter().map(|level| (&one.representation, &level.bytes)));
        all.map(|(id, bytes)| (id.clone(), bytes.size, bytes.digest.clone())).collect()
    };
    for (number, gop) in old.gops.iter().enumerate() {
        let same = |other: &GopInfo| {
            (gop.first_frame, gop.frame_count, levels(gop))
                == (other.first_frame, other.frame_count, levels(other))
        };
        if !new.gops.get(number).is_some_and(same) {
            return Err(ClientError::Changed(Some(number)));
        }
    }
    Ok(())
}
