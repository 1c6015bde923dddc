//! C.9.3: a presentation that grows is followed: when the manifest is read again, what is appended, and what is skipped.

use super::options::Following;
use super::{PlaybackError, Player, Renewal, check_same, first_gop, log};
use crate::control::{Live, Rule, Settings};
use crate::manifest::{GopInfo, Manifest};
use crate::playback::Loss;
use core::ops::Range;

/// What is known of a presentation while it grows. Times are those of the player.
#[derive(Debug)]
pub(super) struct Follow {
    pub(super) target_us: u64,
    /// Whether the latency is to stay what it was at the start.
    stays: bool,
    /// When frame 0 was captured, as far as that is known: a GOP that was listed had been captured, so it is never later.
    captured_us: i64,
    /// The least difference of this clock and that of the packager.
    offset_us: i64,
    published_ms: u64,
    /// Media time of the last complete GOP.
    gop_us: u64,
    /// When the presentation was last seen to grow.
    heard_us: u64,
    /// When the manifest is to be read, and whether it is being read.
    next_us: u64,
    is_reading: bool,
    failures: u32,
}

/// The manifest is not read again before this has passed.
const LEAST_US: u64 = 20_000;

/// How much later than a GOP is complete the manifest is read.
const LATER_US: u64 = 10_000;

impl Follow {
    /// Begins to follow a presentation, if it grows.
    pub(super) fn begin(manifest: &Manifest, options: &Following, now_us: u64) -> Option<Self> {
        let mut follow = manifest.is_growing().then_some(Self {
            target_us: 0,
            stays: false,
            captured_us: i64::MAX,
            offset_us: i64::MAX,
            published_ms: 0,
            gop_us: 0,
            heard_us: now_us,
            next_us: now_us,
            is_reading: false,
            failures: 0,
        })?;
        follow.hear(now_us, manifest);
        let wanted_us = options.target_us.unwrap_or_else(|| target_us(manifest));
        follow.target_us = wanted_us.max(longest_us(manifest).saturating_mul(3).div_ceil(2));
        if options.from_start {
            // What is played from the start is not hurried.
            let started_us = manifest.gops.first().map_or(0, |gop| start_us(manifest, gop));
            let latency_us =
                signed(now_us).saturating_sub(follow.captured_us.saturating_add(signed(started_us)));
            follow.target_us = follow.target_us.max(u64::try_from(latency_us).unwrap_or(0));
            follow.stays = true;
        }
        Some(follow)
    }

    /// Takes times from a manifest, and plans when to read the next one: when the next GOP should be complete.
    fn hear(&mut self, now_us: u64, manifest: &Manifest) {
        let Some(live) = &manifest.live else { return };
        let complete = manifest.complete_gops();
        let last = complete.checked_sub(1).and_then(|last| manifest.gops.get(last));
        let published_us = signed(live.published_ms.saturating_mul(1000));
        self.offset_us = self.offset_us.min(signed(now_us).saturating_sub(published_us));
        let started_us = signed(live.started_ms.saturating_mul(1000)).saturating_add(self.offset_us);
        let end_us = last.map_or(0, |gop| end_us(manifest, gop));
        let before_us = self.captured_us;
        self.captured_us = before_us.min(started_us).min(signed(now_us).saturating_sub(signed(end_us)));
        if self.stays {
            let more_us = before_us.saturating_sub(self.captured_us);
            self.target_us = self.target_us.saturating_add(u64::try_from(more_us).unwrap_or(0));
        }
        self.gop_us = last.map_or(u64::from(live.update_ms).saturating_mul(1000), |gop| {
            end_us.saturating_sub(start_us(manifest, gop)).max(1)
        });
        let published_us = published_us.saturating_add(self.offset_us);
        let expected_us = match manifest.gops.get(complete) {
            Some(growing) => self.captured_us.saturating_add(signed(self::end_us(manifest, growing))),
            None => published_us.saturating_add(signed(self.gop_us)),
        };
        let expected_us = u64::try_from(expected_us).unwrap_or(0).saturating_add(LATER_US);
        let latest_us = now_us.saturating_add(self.gop_us.saturating_mul(2));
        (self.published_ms, self.heard_us) = (live.published_ms, now_us);
        (self.is_reading, self.failures) = (false, 0);
        self.next_us = expected_us.min(latest_us).max(now_us.saturating_add(LEAST_US));
    }

    /// There is nothing new in the manifest, which is read again soon.
    fn wait(&mut self, now_us: u64, again_us: u64, patience_us: u64) -> Result<(), PlaybackError> {
        self.is_reading = false;
        self.next_us = now_us.saturating_add(again_us);
        let silent_us = now_us.saturating_sub(self.heard_us);
        if silent_us > patience_us.saturating_add(self.gop_us) {
            return Err(PlaybackError::Stopped(silent_us));
        }
        Ok(())
    }

    /// The complete GOP in which what was captured the target ago begins; the first one if none is that old.
    pub(super) fn join(&self, manifest: &Manifest) -> usize {
        let complete = manifest.gops.iter().take(manifest.complete_gops());
        let end_us = complete.clone().next_back().map_or(0, |gop| end_us(manifest, gop));
        let is_old = |gop: &&GopInfo| start_us(manifest, gop).saturating_add(self.target_us) <= end_us;
        complete.take_while(is_old).count().saturating_sub(1)
    }

    /// What the controller is told: when the first of the GOPs that it knows was complete.
    fn live(&self, end_us: u64, later_us: u64) -> Live {
        let available_us = self.captured_us.saturating_add(signed(end_us)).saturating_sub(signed(later_us));
        Live { available_us, target_us: self.target_us, slowest_milli: 950, fastest_milli: 1050 }
    }
}

/// Leaves the first complete GOPs out of a manifest.
pub(super) fn leave_out_before(manifest: &mut Manifest, first: usize) {
    let first = first.min(manifest.complete_gops());
    manifest.gops.drain(..first);
    if let Some(live) = &mut manifest.live {
        live.first_gop = live.first_gop.saturating_add(u64::try_from(first).unwrap_or(0));
    }
}

impl<R: Rule> Player<R> {
    /// Whether all was played, and nothing more comes.
    pub fn has_ended(&self) -> bool {
        self.follow.is_none() && self.state().playback() == crate::control::Playback::Ended
    }

    /// Whether the presentation still grows, as far as is known.
    pub fn is_following(&self) -> bool {
        self.follow.is_some()
    }

    /// Whether the manifest is to be read now; then it is being read.
    pub(super) fn reads(&mut self, now_us: u64) -> bool {
        let due = self.follow.as_mut().filter(|follow| !follow.is_reading && follow.next_us <= now_us);
        due.map(|follow| follow.is_reading = true).is_some()
    }

    /// When the manifest is to be read.
    pub(super) fn next_reading_us(&self) -> u64 {
        let waiting = self.follow.as_ref().filter(|follow| !follow.is_reading);
        waiting.map_or(u64::MAX, |follow| follow.next_us)
    }

    /// The manifest is the one that was read before.
    ///
    /// # Errors
    /// A presentation that has neither grown nor ended for longer than [`Following::patience_us`].
    pub fn unchanged(&mut self, now_us: u64) -> Result<(), PlaybackError> {
        let patience_us = self.options.following.patience_us;
        let Some(follow) = &mut self.follow else { return Ok(()) };
        follow.failures = 0;
        let again_us = follow.gop_us.div_ceil(8).clamp(LEAST_US, 1_000_000);
        follow.wait(now_us, again_us, patience_us)
    }

    /// The manifest could not be read. It is asked for again after 0.1 s, 0.2 s and so on up to 3.2 s; playback goes on.
    ///
    /// # Errors
    /// As [`Player::unchanged`].
    pub fn unreadable(&mut self, now_us: u64) -> Result<(), PlaybackError> {
        let patience_us = self.options.following.patience_us;
        let Some(follow) = &mut self.follow else { return Ok(()) };
        let again_us = 100_000_u64 << follow.failures.min(5);
        follow.failures = follow.failures.saturating_add(1);
        follow.wait(now_us, again_us, patience_us)
    }

    /// The manifest has been read again, with the layers that are fetched. Playback goes on if it is that of the same package,
    /// to which GOPs may have been added. A copy that is not newer than the one before is discarded.
    ///
    /// # Errors
    /// A package that has become another one, or whose GOPs are too large.
    pub fn renew(&mut self, now_us: u64, manifest: Manifest) -> Result<(), PlaybackError> {
        let published_ms = manifest.live.as_ref().map(|live| live.published_ms);
        let before_ms = self.follow.as_ref().map(|follow| follow.published_ms);
        if published_ms.is_some() && published_ms <= before_ms {
            self.renewal = Renewal::None;
            return self.unchanged(now_us);
        }
        check_same(&self.manifest, &self.logs, &manifest)?;
        self.renewal = Renewal::None;
        match &mut self.follow {
            Some(follow) if manifest.is_growing() => follow.hear(now_us, &manifest),
            follow => *follow = None,
        }
        self.forget_shown();
        self.place_again(&manifest);
        self.forget_unlisted(now_us, &manifest);
        let first = self.skip_ahead(now_us, &manifest);
        self.append(now_us, manifest, first)?;
        self.set(now_us)
    }

    /// Lets go of where the bytes of GOPs are that were shown.
    fn forget_shown(&mut self) {
        let is_followed = self.follow.is_some();
        for gop in self.manifest.gops.iter_mut().take(self.presented).filter(|_| is_followed) {
            gop.subsegments = Vec::new();
        }
    }

    /// Takes where the bytes of GOPs are now.
    fn place_again(&mut self, manifest: &Manifest) {
        let first = first_gop(manifest);
        let listed = manifest.gops.get(..manifest.complete_gops()).unwrap_or_default();
        let known = self.manifest.gops.iter_mut().zip(&self.logs).skip(self.presented);
        for (gop, log) in known {
            if let Some(info) = log.number.checked_sub(first).and_then(|index| listed.get(index)) {
                gop.clone_from(info);
            }
        }
    }

    /// Where what is to be fetched next is not listed any more, or playback is far behind: skips GOPs. Gives the number
    /// of the first GOP that is to be appended.
    fn skip_ahead(&mut self, now_us: u64, manifest: &Manifest) -> usize {
        let known = self.logs.last().map_or(first_gop(&self.manifest), |log| log.number.saturating_add(1));
        let state = self.session.state();
        let missing = state.first_missing();
        let next = self.logs.get(missing).map_or(known, |log| log.number);
        let first = first_gop(manifest);
        let Some(follow) = &self.follow else { return known.max(first) };
        let most_us = follow.target_us.saturating_add(self.options.following.drift_us);
        let is_late = !self.is_behind()
            && !state.shown().is_empty()
            && state.latency_us().is_some_and(|us| us > most_us);
        let to = first.saturating_add(follow.join(manifest));
        if to <= next || !(first > next || is_late) {
            return known.max(first);
        }
        let why = if first > next { "the manifest lists them no more" } else { "playback is too far behind" };
        let end =
            missing.saturating_add(self.logs.iter().skip(missing).filter(|log| log.number < to).count());
        if self.session.skip(now_us, missing..end) {
            self.running = None;
            self.gives_up = true;
        }
        self.name_skipped(next..to, why);
        known.max(to)
    }

    /// Names GOPs that are skipped, together with those before them if these were skipped for the same reason.
    fn name_skipped(&mut self, numbers: Range<usize>, why: &str) {
        let count = numbers.len();
        let before = self.losses.last_mut();
        if let Some(loss) =
            before.filter(|loss| loss.reason == why && loss.gop.saturating_add(loss.count) == numbers.start)
        {
            loss.count = loss.count.saturating_add(count);
            return;
        }
        let representation = self.manifest.representations.first().map(|info| info.id.clone());
        self.losses.push(Loss {
            gop: numbers.start,
            count,
            representation: representation.unwrap_or_default(),
            refinement: 0,
            reason: why.to_owned(),
        });
    }

    /// Appends the GOPs of a manifest from a number on, and takes all else that it says.
    fn append(&mut self, now_us: u64, manifest: Manifest, from: usize) -> Result<(), PlaybackError> {
        let first = first_gop(&manifest);
        let mut gops = std::mem::take(&mut self.manifest.gops);
        let skipped = from.saturating_sub(first);
        let described = manifest.gops.iter().skip(skipped).zip(manifest.descriptions(skipped));
        for (number, (info, description)) in (first.saturating_add(skipped)..).zip(described) {
            let pushed = self.session.push(now_us, description);
            pushed.map_err(|_| PlaybackError::Changed(Some(number)))?;
            self.logs.push(log(number, info));
            gops.push(info.clone());
        }
        self.manifest = Manifest { gops, ..manifest };
        Ok(())
    }

    /// Tells the controller when GOPs were captured, and what fits into the memory.
    fn set(&mut self, now_us: u64) -> Result<(), PlaybackError> {
        let live = self.live().or(self.session.state().settings().live);
        let settings = self.options.fitted(self.session.state().ladder())?;
        self.session.set(now_us, Settings { live, ..settings });
        Ok(())
    }

    /// What the controller is told while the presentation grows.
    pub(super) fn live(&self) -> Option<Live> {
        let follow = self.follow.as_ref()?;
        let gops = self.session.state().ladder().gops();
        let later = gops.iter().skip(1).map(crate::control::Gop::duration_us).fold(0, u64::saturating_add);
        let last = self.manifest.gops.last();
        Some(follow.live(last.map_or(0, |gop| end_us(&self.manifest, gop)), later))
    }
}

/// Frames of a manifest in microseconds.
fn frames_us(manifest: &Manifest, frames: u64) -> u64 {
    let ticks = u128::from(frames).saturating_mul(manifest.stream.ticks_per_frame.into());
    let us = ticks.saturating_mul(1_000_000).checked_div(manifest.stream.ticks_per_second.into());
    us.and_then(|us| u64::try_from(us).ok()).unwrap_or(u64::MAX)
}

fn start_us(manifest: &Manifest, gop: &GopInfo) -> u64 {
    frames_us(manifest, gop.first_frame.into())
}

fn end_us(manifest: &Manifest, gop: &GopInfo) -> u64 {
    frames_us(manifest, gop.end())
}

fn longest_us(manifest: &Manifest) -> u64 {
    let frames = manifest.gops.iter().map(|gop| gop.frame_count).max().unwrap_or(0);
    frames_us(manifest, frames.into())
}

/// The latency that a manifest tells players to aim at.
fn target_us(manifest: &Manifest) -> u64 {
    manifest.live.as_ref().map_or(0, |live| u64::from(live.target_latency_ms).saturating_mul(1000))
}

fn signed(us: u64) -> i64 {
    i64::try_from(us).unwrap_or(i64::MAX)
}
