//! The package of a server: what to request, and frames of what has come.

mod report;

use crate::received::Received;
use splatstream::scene::SceneDescription;
use splatstream::{Class, Decoder, Error, Frame, OperatingPoint, Warning};
use splatstream_stream::control::{self, Layered};
use splatstream_stream::manifest::Manifest;
use splatstream_stream::playback::{Command, Fault, GopLog, Loss, Options, Player};

/// Bytes of a package that a tab of a browser holds at the same time.
const MEMORY: u64 = 256 << 20;

/// Plays one package. The clock of the page is told before anything that takes time.
pub struct Package {
    player: Player<Layered>,
    /// Of the clock of the page, microseconds.
    now_us: u64,
    gop: OpenGop,
    /// What the stream says of its scene, once a GOP has been opened.
    scene: Option<SceneDescription>,
    /// Whether the last GOP has been decoded to its end.
    is_ended: bool,
    /// Whether the clock goes on from the frame that comes next, and whether it does so from the one that was given last.
    jumps: bool,
    is_jump: bool,
    /// Thousandths; 0 while the page stands still.
    speed_milli: u32,
    /// Losses that were told.
    told: usize,
    /// What was lost since the last frame, a line each.
    pub warnings: Vec<String>,
    /// Times that playback stood still on the way from a GOP to the next, and how long in microseconds.
    stalls: (u32, u64),
}

/// The GOP whose frames are decoded.
struct OpenGop {
    decoder: Decoder,
    number: usize,
    /// Whether the decoder has its units.
    is_open: bool,
    /// Only its first frame is decoded, and whether that has been.
    is_still: bool,
    is_done: bool,
    /// The highest temporal layer that it has.
    temporal: u8,
    /// Frames before this one are not given out.
    from: u32,
    /// When it was entered.
    since_us: u64,
    /// Whether it follows the one before, so that to wait for it is a stall.
    follows: bool,
}

impl Package {
    /// A package with a manifest, whose base is requested at once.
    ///
    /// # Errors
    /// Why the manifest is refused.
    pub fn open(manifest: &[u8], now_us: u64) -> Result<Self, String> {
        let options = Options { memory: MEMORY, ..Options::default() };
        let player = Player::driven(parse(manifest)?, options, Layered::default(), now_us);
        let player = player.map_err(|error| error.to_string())?;
        let gop = OpenGop {
            decoder: Decoder::new(),
            number: player.state().current(),
            is_open: false,
            is_still: false,
            is_done: false,
            temporal: 0,
            from: 0,
            since_us: now_us,
            follows: false,
        };
        let mut package = Self {
            player,
            now_us,
            gop,
            scene: None,
            is_ended: false,
            jumps: true,
            is_jump: false,
            speed_milli: 0,
            told: 0,
            warnings: Vec::new(),
            stalls: (0, 0),
        };
        package.speed_milli = if package.is_moving() { 1000 } else { 0 };
        package.player.run(now_us, package.speed_milli);
        Ok(package)
    }

    /// Whether there are several frames, or may be.
    fn is_moving(&self) -> bool {
        self.player.is_following() || self.player.manifest().stream.frames > 1
    }

    /// The manifest has been read again.
    ///
    /// # Errors
    /// A manifest that is refused, or one of another package.
    pub fn renew(&mut self, manifest: &[u8]) -> Result<(), String> {
        self.take(parse(manifest)?)
    }

    fn take(&mut self, manifest: Manifest) -> Result<(), String> {
        self.player.renew(self.now_us, manifest).map_err(|error| error.to_string())
    }

    /// The manifest of a presentation that grows has been read beside playback.
    ///
    /// # Errors
    /// That of another package; a presentation that has neither grown nor ended for a minute. A manifest that is refused may be
    /// whole the next time.
    pub fn polled(&mut self, manifest: &[u8]) -> Result<(), String> {
        match parse(manifest) {
            Ok(manifest) => self.take(manifest),
            Err(reason) => self.unreadable(&reason),
        }
    }

    /// The manifest of a presentation that grows could not be read, for a reason.
    ///
    /// # Errors
    /// As [`Package::polled`].
    pub fn unreadable(&mut self, reason: &str) -> Result<(), String> {
        self.player.unreadable(self.now_us).map_err(|error| format!("{error}: {reason}"))
    }

    /// What time it is; it never goes back.
    pub fn clock(&mut self, now_us: u64) {
        self.now_us = self.now_us.max(now_us);
        // A picture that stands for frames is as far into its GOP as the clock says.
        if self.gop.is_open && self.gop.is_still && self.speed_milli > 0 {
            let passed_us = self.now_us.saturating_sub(self.gop.since_us);
            let milli = passed_us.saturating_mul(self.speed_milli.into()) / 1000;
            self.player.at(self.now_us, milli);
        }
    }

    /// What to do now.
    pub fn decide(&mut self) -> Command {
        self.player.decide(self.now_us)
    }

    /// A request is sent.
    pub fn sent(&mut self) {
        self.player.sent();
    }

    /// A response begins.
    pub fn begun(&mut self) {
        self.player.begun(self.now_us);
    }

    /// Bytes have come; whether they, and those before them, are what was packaged.
    pub fn received(&mut self, bytes: &[u8]) -> bool {
        let failures = self.sum(|log| log.failures);
        self.player.received(self.now_us, bytes);
        failures == self.sum(|log| log.failures)
    }

    fn sum(&self, of: fn(&GopLog) -> u64) -> u64 {
        self.player.logs().iter().map(of).fold(0, u64::saturating_add)
    }

    /// The requests have failed.
    pub fn failed(&mut self, fault: &Fault) {
        self.player.failed(self.now_us, fault);
    }

    /// Whether what was requested is still wanted.
    pub fn is_fetching(&self) -> bool {
        self.player.is_fetching()
    }

    /// Whether the frame that was given last can be given again, better.
    pub fn is_better(&self) -> bool {
        self.gop.is_open
            && self.player.state().current() == self.gop.number
            && (self.gop.is_still || self.speed_milli == 0)
            && self.player.is_due()
    }

    /// Whether nothing is missing that would make the frame better that was given last.
    pub fn is_best(&self) -> bool {
        let state = self.player.state();
        let is_there = || state.choices(state.current()).iter().all(|choice| choice.bytes == 0);
        self.gop.is_open && state.current() == self.gop.number && !self.player.is_due() && is_there()
    }

    /// Plays at a speed in thousandths, or stands still at 0.
    pub fn run(&mut self, speed_milli: u32) {
        if !self.is_moving() {
            return;
        }
        self.speed_milli = speed_milli;
        self.player.run(self.now_us, speed_milli);
    }

    /// Goes to a frame.
    pub fn seek(&mut self, index: u32) {
        let number = self.player.manifest().gop_of(index).unwrap_or(0);
        self.enter(number, index, true);
    }

    /// Shows an operating point; with 255 on every axis what the network allows.
    pub fn choose(&mut self, [spatial, temporal, refinement]: [u8; 3]) {
        let is_automatic = [spatial, temporal, refinement] == [u8::MAX; 3];
        let point = control::OperatingPoint { spatial, temporal: Some(temporal), refinement };
        self.player.choose(self.now_us, (!is_automatic).then_some(point));
    }

    /// Frames of the package; 0 while it grows.
    pub fn frame_count(&self) -> u32 {
        if self.player.is_following() {
            return 0;
        }
        u32::try_from(self.player.manifest().stream.frames).unwrap_or(u32::MAX)
    }

    /// Whether the clock goes on from the frame that was given last: it is the first one, or GOPs before it were skipped.
    pub fn is_jump(&self) -> bool {
        self.is_jump
    }

    /// The decoder of the GOP that is shown.
    pub fn decoder(&self) -> &Decoder {
        &self.gop.decoder
    }

    /// What the stream says of its scene; none before the first frame.
    pub fn scene(&self) -> Option<&SceneDescription> {
        self.scene.as_ref()
    }

    /// Whether the last GOP has been decoded to its end.
    pub fn is_ended(&self) -> bool {
        self.is_ended
    }

    /// The next frame, and the index up to which it stands; none at the end, and as long as bytes are missing.
    ///
    /// # Errors
    /// Units that cannot be decoded at all.
    pub fn next_frame(&mut self) -> Result<Option<(Frame, u32)>, String> {
        loop {
            self.open_gop();
            if !self.gop.is_open {
                self.is_ended |= self.is_over();
                return Ok(None);
            }
            if self.gop.is_done {
                match self.next_gop() {
                    true => continue,
                    false => return Ok(None),
                }
            }
            match self.gop.decoder.next_frame() {
                Ok(Some(frame)) if self.is_wanted(&frame) => return Ok(Some(self.give(frame))),
                Ok(Some(frame)) => self.warn(frame.warnings()),
                Ok(None) if !self.next_gop() => return Ok(None),
                Ok(None) => {}
                Err(Error::Incomplete(warnings)) => {
                    self.warn(&warnings);
                    if !self.next_gop() {
                        return Ok(None);
                    }
                }
                Err(error) => return Err(error.to_string()),
            }
        }
    }

    /// Whether a frame is given out: it still stands at the one that is sought.
    fn is_wanted(&self, frame: &Frame) -> bool {
        self.until(frame.index()) > self.gop.from
    }

    /// The index up to which a frame of the open GOP stands: that of the next one that its operating point has.
    fn until(&self, index: u32) -> u32 {
        let end = self.first_frame(self.gop.number.saturating_add(1));
        let is_next = |frame: &u32| !self.gop.is_still && self.is_shown(*frame);
        (index.saturating_add(1)..end).find(is_next).unwrap_or(end)
    }

    /// Whether the playhead waits for a GOP that will not come: the presentation has ended.
    fn is_over(&self) -> bool {
        !self.player.is_following() && self.gop.number >= self.player.manifest().gops.len()
    }

    fn give(&mut self, frame: Frame) -> (Frame, u32) {
        self.warn(frame.warnings());
        self.is_jump = core::mem::take(&mut self.jumps);
        let first = self.first_frame(self.gop.number);
        let duration = self.gop.decoder.frame_duration().unwrap_or_default();
        let passed = duration.saturating_mul(frame.index().saturating_sub(first));
        let until = self.until(frame.index());
        self.gop.from = frame.index();
        if self.gop.is_still {
            // Nothing more is decoded of it.
            self.gop.is_done = true;
        } else {
            self.player.at(self.now_us, u64::try_from(passed.as_micros()).unwrap_or(u64::MAX));
        }
        (frame, until)
    }

    /// The first frame of a GOP; the number of frames after the last one.
    fn first_frame(&self, gop: usize) -> u32 {
        let gops = &self.player.manifest().gops;
        let end = || gops.last().map_or(0, |last| last.first_frame.saturating_add(last.frame_count));
        gops.get(gop).map_or_else(end, |gop| gop.first_frame)
    }

    /// Opens the GOP that is due.
    fn open_gop(&mut self) {
        let mut current = self.player.state().current();
        while let Some(gop) = self.player.show() {
            let is_lost = gop.point.is_none();
            if let Some(chosen) = gop.point {
                self.scene.get_or_insert_with(|| scene_of(gop.head));
                let start = gop.head.len();
                let received = Received::whole([gop.head, gop.units].concat());
                let (spatial, refinement) = (chosen.spatial, chosen.refinement);
                let temporal = chosen.temporal.unwrap_or(0);
                let point = OperatingPoint { spatial, temporal, refinement };
                let opened = received.decoder().starting_at(start as u64).with_operating_point(point);
                self.gop.decoder = opened;
                (self.gop.is_open, self.gop.is_still) = (true, chosen.temporal.is_none());
                (self.gop.is_done, self.gop.temporal) = (false, temporal);
            }
            if self.gop.follows {
                let waited_us = gop.log.shown.map_or(0, |shown| shown.waited_us);
                self.stalls.0 = self.stalls.0.saturating_add(u32::from(waited_us > 0));
                self.stalls.1 = self.stalls.1.saturating_add(waited_us);
            }
            self.gop.follows = false;
            self.skip_to(current);
            self.tell_losses();
            if is_lost && !self.next_gop() {
                return;
            }
            current = self.player.state().current();
        }
        self.tell_losses();
    }

    /// The playhead is in a GOP: where it is another one than that it went to, those between were skipped.
    fn skip_to(&mut self, gop: usize) {
        if gop != self.gop.number {
            (self.gop.number, self.gop.from) = (gop, self.first_frame(gop));
            self.jumps = true;
        }
    }

    /// Goes on with the GOP after the one that is open; whether there is one, or will be.
    fn next_gop(&mut self) -> bool {
        let next = self.gop.number.saturating_add(1);
        let is_there = next < self.player.manifest().gops.len() || self.player.is_following();
        if is_there {
            self.enter(next, self.first_frame(next), false);
        } else {
            (self.gop.is_open, self.is_ended) = (false, true);
        }
        is_there
    }

    fn enter(&mut self, number: usize, from: u32, is_sought: bool) {
        self.player.go_to(self.now_us, number, is_sought);
        self.is_ended = false;
        self.gop.number = number;
        self.gop.from = from;
        self.gop.since_us = self.now_us;
        (self.gop.is_open, self.gop.is_still, self.gop.is_done) = (false, false, false);
        self.gop.follows = !is_sought;
        self.jumps &= !is_sought;
    }

    /// Remembers warnings. A GOP of a package ends where its last unit does, which is no damage, nor are frames that the
    /// operating point does not have.
    fn warn(&mut self, warnings: &[Warning]) {
        let is_real = |warning: &&Warning| match warning {
            Warning::Damaged(error) => error.class() != Class::Truncated,
            Warning::Lost(frames) => frames.clone().any(|frame| self.is_shown(frame)),
            _ => true,
        };
        let real: Vec<String> = warnings.iter().filter(is_real).map(ToString::to_string).collect();
        self.warnings.extend(real);
    }

    /// Whether the operating point of the open GOP has a frame.
    fn is_shown(&self, index: u32) -> bool {
        let gop = self.player.manifest().gops.get(self.gop.number);
        let mut frames = gop.into_iter().flat_map(|gop| &gop.subsegments).flat_map(|one| &one.frames);
        frames.any(|frame| frame.frame == index && frame.temporal_layer <= self.gop.temporal)
    }

    fn tell_losses(&mut self) {
        let losses = self.player.losses();
        self.warnings.extend(losses.iter().skip(self.told).map(line));
        self.told = losses.len();
    }
}

fn parse(manifest: &[u8]) -> Result<Manifest, String> {
    Manifest::parse(manifest).map_err(|error| format!("the manifest is refused: {error}"))
}

/// What the head of a stream says of the scene. A decoder that starts at a GOP does not look at it.
fn scene_of(head: &[u8]) -> SceneDescription {
    let mut decoder = Received::whole(head.to_vec()).decoder();
    // There is no frame in it, and what is wrong with it is said of the GOP that it is decoded with.
    let _ = decoder.next_frame();
    decoder.description().cloned().unwrap_or_default()
}

/// A loss in words.
fn line(loss: &Loss) -> String {
    let Loss { gop, count, representation, refinement, reason } = loss;
    let last = gop.saturating_add(*count).saturating_sub(1);
    match count {
        0 | 1 => {
            format!("GOP {gop}: {representation} from refinement {refinement} on cannot be had: {reason}")
        }
        _ => format!("GOPs {gop} to {last} are skipped: {reason}"),
    }
}
