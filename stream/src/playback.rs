//! Playback of a package without a network, a clock or threads: a player in a browser and the native client drive the same one.
//!
//! A [`Player`] is told what time it is and what has arrived. It says which ranges of which files to request and when to give
//! them up, checks every level against its digest, names what is lost, and hands over the units of each GOP that begins to be
//! shown, with the operating point to decode them at. Equal events give equal answers on every machine.
//!
//! ```
//! use splatstream_stream::control::Layered;
//! use splatstream_stream::manifest::Manifest;
//! use splatstream_stream::package::{Options as Packaging, Package};
//! use splatstream_stream::playback::{Command, Options, Player};
//!
//! # let stream = include_bytes!("../../spec/data/worked-temporal-example.gss");
//! let package = Package::of(stream, &Packaging::default(), &Default::default())?;
//! let file = |name: &str| {
//!     let mut bytes = Vec::new();
//!     package.write(name, &mut bytes).map(|()| bytes)
//! };
//! let manifest = Manifest::parse(package.manifest.to_json().as_bytes())?;
//! let mut player = Player::new(manifest, Options::default(), Layered::default(), 0)?;
//! let (mut now_us, mut shown) = (0, 0);
//! while !player.has_ended() {
//!     match player.decide(now_us) {
//!         Command::Fetch(requests) => {
//!             for request in requests {
//!                 player.sent();
//!                 now_us += 1000;
//!                 player.begun(now_us);
//!                 let bytes = file(&request.file)?;
//!                 let start = request.offset as usize;
//!                 player.received(now_us, &bytes[start..start + request.size as usize]);
//!             }
//!         }
//!         Command::Wait { until_us } => now_us = until_us,
//!         Command::Abandon | Command::ReadManifest | Command::PollManifest => unreachable!("this network is good"),
//!     }
//!     while let Some(gop) = player.show() {
//!         assert!(gop.point.is_some() && !gop.units.is_empty());
//!         shown += 1;
//!     }
//! }
//! assert_eq!(shown, 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod driven;
mod error;
mod fault;
mod follow;
pub(crate) mod parts;
mod report;
mod same;
mod store;

use crate::control::number::size;
use crate::control::{Decision, Fetch, Gop, Ladder, OperatingPoint, Rule, Session, Settings, State};
use crate::manifest::{GopInfo, Manifest};
use driven::Viewer;
use follow::{Follow, leave_out_before};
use parts::{Kind, Part, parts, requests};
use same::check_same;
use std::collections::{BTreeMap, BTreeSet};
use std::mem;
use store::Store;

pub use error::PlaybackError;
pub use fault::Fault;
pub use follow::Following;
pub use parts::ByteRequest;
pub use report::{GopLog, Loss, PlayedGop};

/// How a player plays, and how often it asks.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Buffer and limits of the device. The buffer is made shorter where [`Options::memory`] needs it.
    pub settings: Settings,
    /// Requests for what improves a GOP before it is left out.
    pub attempts: u32,
    /// Requests for the base of a GOP before the GOP is left out.
    pub base_attempts: u32,
    /// Bytes of the package that are held at the same time.
    pub memory: u64,
    /// Of a presentation that grows.
    pub following: Following,
}

impl Default for Options {
    /// 3 attempts and 8 for the base, 1 GiB.
    fn default() -> Self {
        Self {
            settings: Settings::default(),
            attempts: 3,
            base_attempts: 8,
            memory: 1 << 30,
            following: Following::default(),
        }
    }
}

/// What the caller of a player does next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Command {
    /// Send these requests, each when the one before has ended, and say what becomes of them. Requests of an earlier fetch are
    /// over: their bytes are no longer wanted.
    Fetch(Vec<ByteRequest>),
    /// Give the requests up.
    Abandon,
    /// Read the manifest again, and give it to [`Player::renew`]. Nothing is fetched until then.
    ReadManifest,
    /// Read the manifest of a presentation that grows, beside all else, if it is another one than before; say what came to
    /// [`Player::renew`], [`Player::unchanged`] or [`Player::unreadable`].
    PollManifest,
    /// Ask again at this time or after the next event, whatever comes first.
    Wait {
        /// Microseconds of the caller's clock.
        until_us: u64,
    },
}

/// While a request runs, the controller is asked at least this often.
const TICK_US: u64 = 100_000;

/// A rule that never waits does not stop the clock: so many decisions are taken at one time.
const DECISIONS: u32 = 16;

/// Times that a level may arrive damaged.
const DAMAGED: u32 = 2;

/// A fetch that runs.
#[derive(Debug)]
struct Running {
    parts: Vec<Part>,
    /// The part that arrives, and what has arrived of it.
    next: usize,
    buffer: Vec<u8>,
    /// Bytes of the levels before it.
    before: u64,
}

/// The playback of a package under a rule: see the [module](self). Times are microseconds of the caller's clock and never go
/// back. Ask for commands until one is [`Command::Wait`], then take what is to be [shown](Player::show).
#[derive(Debug)]
pub struct Player<R> {
    manifest: Manifest,
    options: Options,
    session: Session<R>,
    store: Store,
    running: Option<Running>,
    /// Whether the manifest has to be read again, and whether the caller does so.
    renewal: Renewal,
    /// Set while the presentation grows.
    follow: Option<Follow>,
    /// Whether the caller is to give its requests up.
    gives_up: bool,
    /// Per GOP, Representation and piece: requests that were of no use, and those among them that brought damaged bytes.
    faults: BTreeMap<(usize, usize, u8), (u32, u32)>,
    /// Representations whose files the server refuses, and how often in a row it did so.
    refused: BTreeSet<usize>,
    refusals: BTreeMap<usize, u32>,
    /// The next GOP to show.
    presented: usize,
    /// Units of the GOP that was shown last.
    units: Vec<u8>,
    logs: Vec<GopLog>,
    losses: Vec<Loss>,
    decisions: u64,
    /// Decisions since the last wait.
    streak: u32,
    /// The fetch that was decided last.
    fetch: Option<Fetch>,
    /// Set where the caller has the playhead.
    viewer: Option<Viewer>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Renewal {
    /// What is known holds.
    None,
    /// The manifest has to be read.
    Wanted,
    /// The caller reads it.
    Asked,
}

impl<R: Rule> Player<R> {
    /// A playback that begins now, with nothing fetched.
    ///
    /// # Errors
    /// A package whose GOPs are too large.
    pub fn new(
        mut manifest: Manifest,
        options: Options,
        rule: R,
        now_us: u64,
    ) -> Result<Self, PlaybackError> {
        let follow = Follow::begin(&manifest, &options.following, now_us);
        if let Some(follow) = follow.as_ref().filter(|_| !options.following.from_start) {
            let first = follow.join(&manifest);
            leave_out_before(&mut manifest, first);
        }
        Self::of(manifest, options, rule, follow, now_us)
    }

    /// A playback of the complete GOPs of a manifest.
    fn of(
        mut manifest: Manifest,
        options: Options,
        rule: R,
        follow: Option<Follow>,
        now_us: u64,
    ) -> Result<Self, PlaybackError> {
        manifest.gops.truncate(manifest.complete_gops());
        let ladder = manifest.ladder().map_err(|_| PlaybackError::Changed(None))?;
        let settings = settings(&options, &ladder)?;
        let live = settings.live;
        let numbered = manifest.gops.iter().zip(first_gop(&manifest)..);
        let logs = numbered.map(|(gop, number)| log(number, gop)).collect();
        let mut player = Self {
            manifest,
            options,
            session: Session::new(ladder, settings, rule, now_us),
            store: Store::default(),
            running: None,
            renewal: Renewal::None,
            follow,
            gives_up: false,
            faults: BTreeMap::new(),
            refused: BTreeSet::new(),
            refusals: BTreeMap::new(),
            presented: 0,
            units: Vec::new(),
            logs,
            losses: Vec::new(),
            decisions: 0,
            streak: 0,
            fetch: None,
            viewer: None,
        };
        player
            .session
            .set(now_us, Settings { live: player.live().or(live), ..player.state().settings().clone() });
        Ok(player)
    }

    /// The manifest, as it was read last.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// What the controller knows.
    pub fn state(&self) -> &State {
        self.session.state()
    }

    /// Of each GOP what is known of it.
    pub fn logs(&self) -> &[GopLog] {
        &self.logs
    }

    /// What was left out, in the order in which it was given up.
    pub fn losses(&self) -> &[Loss] {
        &self.losses
    }

    /// Decisions that the controller was asked for.
    pub fn decisions(&self) -> u64 {
        self.decisions
    }

    /// What the controller decided of the last [`Command::Fetch`].
    pub fn fetch(&self) -> Option<&Fetch> {
        self.fetch.as_ref()
    }

    /// Whether what was requested last is still wanted: all of it may have come, or something of it may be wrong.
    pub fn is_fetching(&self) -> bool {
        self.running.is_some()
    }

    /// What to do now.
    pub fn decide(&mut self, now_us: u64) -> Command {
        if mem::take(&mut self.gives_up) {
            return Command::Abandon;
        }
        match self.renewal {
            Renewal::Wanted => {
                self.renewal = Renewal::Asked;
                return Command::ReadManifest;
            }
            Renewal::Asked => {
                self.session.advance(now_us);
                return self.wait(now_us, u64::MAX);
            }
            Renewal::None => {}
        }
        if self.reads(now_us) {
            return Command::PollManifest;
        }
        while self.streak < DECISIONS {
            self.streak = self.streak.saturating_add(1);
            self.decisions = self.decisions.saturating_add(1);
            match self.session.decide(now_us) {
                Decision::Fetch(fetch) => return self.send(now_us, fetch),
                Decision::Abandon => {
                    self.abandon();
                    return Command::Abandon;
                }
                Decision::Rate { .. } => {}
                Decision::Wait { until_us } => return self.wait(now_us, until_us),
            }
        }
        self.wait(now_us, now_us)
    }

    fn wait(&mut self, now_us: u64, until_us: u64) -> Command {
        self.streak = 0;
        let wake_us = until_us.max(now_us.saturating_add(1000));
        let end_us = self.session.state().gop_end_us().unwrap_or(u64::MAX);
        let is_busy = self.running.is_some() || self.renewal != Renewal::None;
        let tick_us = if is_busy { now_us.saturating_add(TICK_US) } else { u64::MAX };
        Command::Wait { until_us: wake_us.min(end_us).min(tick_us).min(self.next_reading_us()) }
    }

    fn send(&mut self, now_us: u64, fetch: Fetch) -> Command {
        let mut parts = parts(&self.manifest, &fetch, |representation| !self.store.has_init(representation));
        let requests = requests(&mut parts);
        self.running = Some(Running { parts, next: 0, buffer: Vec::new(), before: 0 });
        self.fetch = Some(fetch);
        if requests.is_empty() {
            self.received(now_us, &[]);
        }
        Command::Fetch(requests)
    }

    fn abandon(&mut self) {
        if let Some(gop) = self.running.take().and_then(|running| running.parts.first().map(|part| part.gop))
        {
            self.count(gop, |log| log.abandoned = log.abandoned.saturating_add(1));
        }
    }

    /// The number of a GOP in the stream.
    fn number_of(&self, gop: usize) -> usize {
        self.logs.get(gop).map_or(gop, |log| log.number)
    }

    fn count(&mut self, gop: usize, add: impl FnOnce(&mut GopLog)) {
        if let Some(log) = self.logs.get_mut(gop) {
            add(log);
        }
    }

    /// The GOP of the running fetch.
    fn fetched_gop(&self) -> usize {
        self.running.as_ref().and_then(|running| running.parts.first()).map_or(0, |part| part.gop)
    }

    /// A request of the fetch is sent.
    pub fn sent(&mut self) {
        self.count(self.fetched_gop(), |log| log.requests = log.requests.saturating_add(1));
    }

    /// A response begins.
    pub fn begun(&mut self, now_us: u64) {
        self.session.received(now_us, self.counted());
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

    /// More bytes have come, which follow those before. Bytes that are not those that were packaged fail the fetch.
    pub fn received(&mut self, now_us: u64, mut bytes: &[u8]) {
        let arrived = size(bytes.len());
        self.count(self.fetched_gop(), |log| log.bytes = log.bytes.saturating_add(arrived));
        while let Some(running) = &mut self.running {
            let Some(part) = running.parts.get_mut(running.next) else { break };
            let between = size(bytes.len()).min(part.gap);
            part.gap = part.gap.saturating_sub(between);
            bytes = bytes.get(usize::try_from(between).unwrap_or(usize::MAX)..).unwrap_or_default();
            let missing = part.range.size.saturating_sub(size(running.buffer.len()));
            let (own, rest) = bytes
                .split_at_checked(usize::try_from(missing).unwrap_or(usize::MAX))
                .unwrap_or((bytes, &[]));
            running.buffer.extend_from_slice(own);
            bytes = rest;
            if part.gap > 0 || size(running.buffer.len()) < part.range.size {
                break;
            }
            let whole = mem::take(&mut running.buffer);
            if !part.range.holds(&whole) {
                return self.failed(now_us, &Fault::Digest);
            }
            if self.store.insert(part, whole).is_err() {
                return self.failed(now_us, &Fault::Wrong("the file was packaged wrongly"));
            }
            self.refusals.remove(&part.representation);
            if matches!(part.kind, Kind::Level { .. }) {
                running.before = running.before.saturating_add(part.range.size);
            }
            running.next = running.next.saturating_add(1);
        }
        let counted = self.counted();
        if self.running.as_ref().is_some_and(|running| running.next >= running.parts.len()) {
            self.running = None;
        }
        self.session.received(now_us, counted);
        self.trim();
    }

    /// The running fetch has failed: its requests end here. What has failed too often is left out.
    pub fn failed(&mut self, now_us: u64, fault: &Fault) {
        let Some(running) = self.running.take() else { return };
        self.session.failed(now_us);
        let Some(part) = running.parts.get(running.next) else { return };
        self.count(part.gop, |log| log.failures = log.failures.saturating_add(1));
        if *fault == Fault::Changed {
            self.renewal = Renewal::Wanted;
        }
        if self.is_too_often(part, fault) {
            self.leave_out(now_us, part, fault);
        }
    }

    fn is_too_often(&mut self, part: &Part, fault: &Fault) -> bool {
        let (all, damaged) = self.faults.entry((part.gop, part.representation, part.piece)).or_default();
        *all = all.saturating_add(1);
        if *fault == Fault::Digest {
            *damaged = damaged.saturating_add(1);
        }
        let refusals = self.refusals.entry(part.representation).or_default();
        *refusals = if fault.is_final() { refusals.saturating_add(1) } else { 0 };
        let is_base = part.representation == 0 && part.piece == 0;
        let is_gone = !is_base && *refusals >= self.options.attempts;
        let most = match (is_base, self.refused.contains(&part.representation) && fault.is_final()) {
            (_, true) => 1,
            (true, false) => self.options.base_attempts,
            (false, false) => self.options.attempts,
        };
        *all >= most || *damaged >= DAMAGED || is_gone
    }

    fn leave_out(&mut self, now_us: u64, part: &Part, fault: &Fault) {
        if fault.is_final() {
            self.refused.insert(part.representation);
        }
        self.session.unavailable(now_us, part.gop, part.representation, part.piece);
        let representation =
            self.manifest.representations.get(part.representation).map(|info| info.id.clone());
        let refinement = match part.kind {
            Kind::Init => 0,
            Kind::Level { level, .. } => level,
        };
        self.losses.push(Loss {
            gop: self.number_of(part.gop),
            count: 1,
            representation: representation.unwrap_or_default(),
            refinement,
            reason: fault.to_string(),
        });
    }

    /// The next GOP that has begun and was not taken yet. To be asked until there is none.
    pub fn show(&mut self) -> Option<PlayedGop<'_>> {
        let number = if self.viewer.is_some() { self.driven_gop()? } else { self.next_gop()? };
        let state = self.session.state();
        let shown = state.shown().iter().rev().find(|shown| shown.gop == number).copied();
        let shown = shown.filter(|_| !state.is_lost(number));
        let buffer_us = state
            .media_until(state.first_missing())
            .saturating_sub(state.media_until(number.saturating_add(1)));
        let pieces = shown.and_then(|shown| {
            let points = state.ladder().gops().get(number)?.points().iter();
            points.clone().find(|point| point.name == shown.point).map(|point| point.levels.clone())
        });
        let (units, malformed) =
            pieces.map(|pieces| self.store.units(&self.manifest, number, &pieces)).unwrap_or_default();
        self.units = units;
        self.name_malformed(number, malformed);
        let point = shown.map(|shown| decodable(&self.manifest, shown.point));
        self.count(number, |log| (log.shown, log.buffer_us) = (shown, buffer_us));
        let log = self.logs.get(number)?;
        Some(PlayedGop { number: log.number, point, head: self.store.head(), units: &self.units, log })
    }

    /// The next GOP that has begun by the clock and is not skipped. Those before it go away.
    fn next_gop(&mut self) -> Option<usize> {
        let state = self.session.state();
        let number = (self.presented..state.first_open()).find(|&gop| !state.is_skipped(gop));
        self.presented = number.map_or(state.first_open().max(self.presented), |gop| gop.saturating_add(1));
        self.store.drop_before(number.unwrap_or(self.presented));
        number
    }

    /// Names Representations whose bytes are what was packaged, and malformed nevertheless.
    fn name_malformed(&mut self, gop: usize, malformed: Vec<usize>) {
        let gop = self.number_of(gop);
        let infos = malformed.into_iter().filter_map(|index| self.manifest.representations.get(index));
        self.losses.extend(infos.map(|info| Loss {
            gop,
            count: 1,
            representation: info.id.clone(),
            refinement: 0,
            reason: "the file was packaged wrongly".to_owned(),
        }));
    }
}

/// The number of the first GOP that a manifest lists, which is below 2^32.
fn first_gop(manifest: &Manifest) -> usize {
    usize::try_from(manifest.first_gop()).unwrap_or(usize::MAX)
}

fn log(number: usize, gop: &GopInfo) -> GopLog {
    GopLog { number, first_frame: gop.first_frame, frame_count: gop.frame_count, ..GopLog::default() }
}

/// The settings with a buffer that fits into the memory.
fn settings(options: &Options, ladder: &Ladder) -> Result<Settings, PlaybackError> {
    let bytes = |gop: &Gop| gop.points().iter().map(|point| point.bytes).max().unwrap_or(0);
    let largest = ladder.gops().iter().map(bytes).max().unwrap_or(0).max(1);
    // One is shown and one arrives beside those that are buffered.
    let fit = options.memory.checked_div(largest).unwrap_or(0).saturating_sub(2);
    if fit == 0 {
        return Err(PlaybackError::TooLarge(largest));
    }
    let shortest = ladder.gops().iter().map(Gop::duration_us).min().unwrap_or(1);
    let buffer_us = options.settings.buffer_us.min(fit.saturating_mul(shortest));
    let start_us = options.settings.start_us.min(buffer_us);
    Ok(Settings { buffer_us, start_us, ..options.settings.clone() })
}

/// The point that a decoder is told: I frames that are fetched whole are shown whole where they are alone.
fn decodable(manifest: &Manifest, point: OperatingPoint) -> OperatingPoint {
    let levels = manifest.levels_of_piece(0, 0).map_or(1, |levels| levels.end);
    let least = if point.temporal.is_none() { levels.saturating_sub(1) } else { 0 };
    OperatingPoint { refinement: point.refinement.max(least), ..point }
}
