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

mod attempts;
mod driven;
mod error;
mod fault;
mod follow;
mod options;
pub(crate) mod parts;
mod report;
mod running;
mod same;
mod store;

use crate::control::number::size;
use crate::control::{Decision, Fetch, OperatingPoint, Rule, Session, Settings, State};
use crate::manifest::{GopInfo, Manifest};
use attempts::{Attempts, Verdict};
use driven::Viewer;
use follow::{Follow, leave_out_before};
use parts::{Kind, Part, parts, requests};
use running::Running;
use same::check_same;
use std::mem;
use store::Store;

pub use error::PlaybackError;
pub use fault::Fault;
pub use options::{Following, Options};
pub use parts::ByteRequest;
pub use report::{GopLog, Loss, PlayedGop};

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
    attempts: Attempts,
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
        let settings = options.fitted(&ladder)?;
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
            attempts: Attempts::default(),
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
        self.running = Some(Running::new(parts));
        self.fetch = Some(fetch);
        if requests.is_empty() {
            self.received(now_us, &[]);
        }
        Command::Fetch(requests)
    }

    fn abandon(&mut self) {
        if let Some(gop) = self.running.take().and_then(|running| running.gop()) {
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
        self.running.as_ref().and_then(Running::gop).unwrap_or(0)
    }

    /// A request of the fetch is sent.
    pub fn sent(&mut self) {
        self.count(self.fetched_gop(), |log| log.requests = log.requests.saturating_add(1));
    }

    /// A response begins.
    pub fn begun(&mut self, now_us: u64) {
        self.session.received(now_us, self.counted());
    }

    /// Bytes of the running fetch that count.
    fn counted(&self) -> u64 {
        self.running.as_ref().map_or(0, Running::counted)
    }

    /// More bytes have come, which follow those before. Bytes that are not those that were packaged fail the fetch.
    pub fn received(&mut self, now_us: u64, mut bytes: &[u8]) {
        let arrived = size(bytes.len());
        self.count(self.fetched_gop(), |log| log.bytes = log.bytes.saturating_add(arrived));
        while let Some(running) = &mut self.running {
            let Some(whole) = running.fill(&mut bytes) else { break };
            let Some(part) = running.part() else { break };
            if !part.range.holds(&whole) {
                return self.failed(now_us, &Fault::Digest);
            }
            if self.store.insert(part, whole).is_err() {
                return self.failed(now_us, &Fault::Wrong("the file was packaged wrongly"));
            }
            self.attempts.arrived(part.representation);
            running.advance();
        }
        let counted = self.counted();
        if self.running.as_ref().is_some_and(|running| running.part().is_none()) {
            self.running = None;
        }
        self.session.received(now_us, counted);
        self.trim();
    }

    /// The running fetch has failed: its requests end here. What has failed too often is left out.
    pub fn failed(&mut self, now_us: u64, fault: &Fault) {
        let Some(running) = self.running.take() else { return };
        let part = running.part();
        // Who refuses answers: to ask for something else need not wait.
        match part.is_some_and(|part| fault.is_final() && !part.is_base()) {
            true => self.session.refused(now_us),
            false => self.session.failed(now_us),
        }
        let Some(part) = part else { return };
        self.count(part.gop, |log| log.failures = log.failures.saturating_add(1));
        if *fault == Fault::Changed {
            self.renewal = Renewal::Wanted;
        }
        let info = self.manifest.representations.get(part.representation);
        let is_shared = info.is_some_and(|info| info.file == part.file) && self.follow.is_none();
        match self.attempts.judge(part, fault, &self.options, is_shared) {
            Verdict::Again => {}
            Verdict::LeftOut => self.leave_out(now_us, part, fault),
            Verdict::Gone => self.leave_out_everywhere(now_us, part, fault),
        }
    }

    fn leave_out(&mut self, now_us: u64, part: &Part, fault: &Fault) {
        self.attempts.left_out(part, fault);
        self.session.unavailable(now_us, part.gop, part.representation, part.piece);
        let refinement = match part.kind {
            Kind::Init => 0,
            Kind::Level { level, .. } => level,
        };
        self.name_loss(part.gop, part.representation, refinement, fault);
    }

    /// Leaves a Representation out of the GOP of a part, and of all others of which nothing of it has arrived: nobody asks for
    /// it again, nor waits for it.
    fn leave_out_everywhere(&mut self, now_us: u64, part: &Part, fault: &Fault) {
        self.leave_out(now_us, part, fault);
        self.session.give_up_on(now_us, part.representation);
        let state = self.session.state();
        let is_open = |gop: usize| gop >= state.first_open() || self.viewer.is_some();
        let lacks = |gop: usize| {
            let pieces =
                state.ladder().gops().get(gop).map_or(&[][..], |gop| gop.pieces(part.representation));
            let nothing_has_come =
                state.arrived(gop).is_some_and(|levels| levels.of(part.representation) == 0);
            nothing_has_come && pieces.iter().any(|piece| piece.bytes > 0)
        };
        let others: Vec<usize> =
            (0..self.logs.len()).filter(|&gop| gop != part.gop && is_open(gop) && lacks(gop)).collect();
        for gop in others {
            self.name_loss(gop, part.representation, 0, fault);
        }
    }

    fn name_loss(&mut self, gop: usize, representation: usize, refinement: u8, fault: &Fault) {
        let id = self.manifest.representations.get(representation).map(|info| info.id.clone());
        self.losses.push(Loss {
            gop: self.number_of(gop),
            count: 1,
            representation: id.unwrap_or_default(),
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

/// The point that a decoder is told: I frames that are fetched whole are shown whole where they are alone.
fn decodable(manifest: &Manifest, point: OperatingPoint) -> OperatingPoint {
    let levels = manifest.levels_of_piece(0, 0).map_or(1, |levels| levels.end);
    let least = if point.temporal.is_none() { levels.saturating_sub(1) } else { 0 };
    OperatingPoint { refinement: point.refinement.max(least), ..point }
}
