//! Presentations that grow, with a viewer who has the playhead: it follows, goes back, pauses, and returns to what is being made.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use common::broadcast::Broadcast;
use common::played::check;
use splatstream_stream::control::{Layered, Settings};
use splatstream_stream::package::Layout;
use splatstream_stream::playback::{ByteRequest, Command, Following, Options, Player};

/// What a request takes.
const REQUEST_US: u64 = 5000;

/// Number of the last GOP of the broadcast, which ends at 13.2 s.
const LAST: usize = 23;

/// Somebody who watches a broadcast from 5.1 s on.
struct Viewer {
    broadcast: Broadcast,
    player: Player<Layered>,
    now_us: u64,
    /// When the GOP that is shown began and will have been played; none while none is.
    shown_us: Option<(u64, u64)>,
    is_paused: bool,
    /// Numbers of the GOPs that were shown.
    numbers: Vec<usize>,
}

impl Viewer {
    fn new(layout: Layout, window_ms: u32) -> Self {
        Self::with(layout, window_ms, Options::default())
    }

    fn with(layout: Layout, window_ms: u32, options: Options) -> Self {
        let broadcast = Broadcast::new(layout, window_ms);
        let now_us = 5_100_000;
        let manifest = broadcast.manifest(now_us).unwrap();
        let player = Player::driven(manifest, options, Layered::default(), now_us).unwrap();
        Self { broadcast, player, now_us, shown_us: None, is_paused: false, numbers: Vec::new() }
    }

    /// Watches until a time, or until nothing more comes.
    fn watch(&mut self, until_us: u64) {
        while self.now_us < until_us && !self.has_ended() {
            match self.player.decide(self.now_us) {
                Command::Fetch(requests) => self.fetch(&requests),
                Command::Abandon => {}
                Command::ReadManifest => unreachable!("no file changes"),
                Command::PollManifest => {
                    let manifest = self.broadcast.manifest(self.now_us).unwrap();
                    self.player.renew(self.now_us, manifest).unwrap();
                }
                Command::Wait { until_us } => {
                    self.now_us = until_us.min(self.now_us + 20_000);
                    self.play();
                }
            }
            self.show();
        }
    }

    fn has_ended(&self) -> bool {
        let gops = self.player.manifest().gops.len();
        !self.player.is_following() && self.player.state().current() >= gops
    }

    fn fetch(&mut self, requests: &[ByteRequest]) {
        for request in requests {
            self.player.sent();
            self.now_us += REQUEST_US;
            let (from, to) = (request.offset as usize, (request.offset + request.size) as usize);
            self.player.begun(self.now_us);
            let bytes = &self.broadcast.files(self.now_us)[&request.file][from..to];
            self.player.received(self.now_us, bytes);
        }
    }

    /// Takes what is shown, with the pace that it is to be played at.
    fn show(&mut self) {
        let pace = u64::from(self.player.pace_milli());
        while let Some(gop) = self.player.show() {
            check(&self.broadcast.stream, &gop);
            if self.numbers.last() != Some(&gop.number) {
                self.numbers.push(gop.number);
                let frames = u64::from(gop.log.frame_count);
                self.shown_us = Some((self.now_us, self.now_us + frames * 200_000 * 1000 / pace));
            }
        }
    }

    /// Tells how far the GOP that is shown has been played, and goes on with the next one at its end.
    fn play(&mut self) {
        let Some((began_us, ends_us)) = self.shown_us.filter(|_| !self.is_paused) else { return };
        if ends_us > self.now_us {
            return self.player.at(self.now_us, self.now_us - began_us);
        }
        self.shown_us = None;
        self.player.go_to(self.now_us, self.player.state().current() + 1, false);
    }

    fn seek(&mut self, gop: usize) {
        self.shown_us = None;
        self.player.go_to(self.now_us, gop, true);
    }

    fn pause(&mut self, is_paused: bool) {
        self.is_paused = is_paused;
        self.player.run(self.now_us, if is_paused { 0 } else { 1000 });
    }

    fn latency_us(&self) -> u64 {
        self.player.state().latency_us().unwrap()
    }
}

#[test]
fn a_viewer_joins_near_the_end_and_follows_to_the_last_frame() {
    for layout in [Layout::Gop, Layout::Frame] {
        let mut viewer = Viewer::new(layout, 60_000);
        viewer.watch(12_000_000);
        assert!(!viewer.player.is_behind());
        assert!(viewer.latency_us() < 3_500_000, "{}", viewer.latency_us());
        viewer.watch(60_000_000);
        let first = viewer.numbers[0];
        assert!((4..=7).contains(&first), "{first}");
        assert_eq!(viewer.numbers, (first..=LAST).collect::<Vec<_>>());
        assert_eq!(viewer.player.losses(), []);
        assert!(viewer.now_us < 18_000_000, "{}", viewer.now_us);
    }
}

#[test]
fn a_viewer_goes_back_stays_behind_and_returns() {
    // Who had not gone back would not be let so far behind.
    let following = Following { drift_us: 1_000_000, ..Following::default() };
    let mut viewer = Viewer::with(Layout::Gop, 60_000, Options { following, ..Options::default() });
    viewer.watch(6_000_000);
    assert_eq!(viewer.player.first_kept(), 0);
    viewer.seek(0);
    assert!(viewer.player.is_behind());
    let before = viewer.numbers.len();
    viewer.watch(9_000_000);
    let seen = &viewer.numbers[before..];
    assert!(seen.len() > 3 && *seen == (0..seen.len()).collect::<Vec<_>>(), "{seen:?}");
    // 6 s behind, and in no hurry.
    assert!(viewer.latency_us() > 5_500_000 && viewer.player.pace_milli() == 1000);
    let edge = viewer.player.edge().unwrap();
    viewer.seek(edge);
    assert!(!viewer.player.is_behind());
    viewer.watch(9_500_000);
    assert_eq!(viewer.numbers.last(), Some(&edge));
    assert!(viewer.latency_us() < 3_500_000, "{}", viewer.latency_us());
    assert_eq!(viewer.player.losses(), []);
}

#[test]
fn a_short_pause_is_made_up_for_and_a_long_one_is_not() {
    for (pause_us, is_behind) in [(500_000, false), (4_000_000, true)] {
        let mut viewer = Viewer::new(Layout::Gop, 60_000);
        viewer.watch(6_000_000);
        viewer.pause(true);
        assert!(viewer.player.is_behind());
        viewer.watch(6_000_000 + pause_us);
        viewer.pause(false);
        assert_eq!(viewer.player.is_behind(), is_behind);
        viewer.watch(60_000_000);
        // Nothing is left out either way.
        assert_eq!(viewer.numbers, (viewer.numbers[0]..=LAST).collect::<Vec<_>>());
        assert_eq!(viewer.player.losses(), []);
    }
}

#[test]
fn what_is_listed_no_more_cannot_be_gone_back_to_until_it_is_listed_again() {
    let mut viewer = Viewer::new(Layout::Gop, 2000);
    let joined = viewer.player.manifest().gops[0].index as usize;
    viewer.watch(12_000_000);
    let kept = viewer.player.first_kept();
    assert!(kept > 3, "{kept}");
    assert!(viewer.player.manifest().gops[..kept].iter().all(|gop| gop.subsegments.is_empty()));
    // A seek before it shows the first one that is there.
    viewer.seek(0);
    viewer.watch(12_200_000);
    assert_eq!(viewer.numbers.last(), Some(&(joined + kept)));
    viewer.watch(60_000_000);
    assert_eq!(viewer.player.losses(), []);
    // The last manifest lists all GOPs.
    assert_eq!(viewer.player.first_kept(), 0);
    viewer.seek(0);
    viewer.watch(viewer.now_us + 1_000_000);
    assert_eq!(viewer.numbers.iter().rev().find(|&&number| number == joined), Some(&joined));
}

#[test]
fn a_pause_that_outlasts_the_window_goes_on_with_what_is_listed() {
    let settings = Settings { buffer_us: 1_000_000, ..Settings::default() };
    let mut viewer = Viewer::with(Layout::Gop, 2000, Options { settings, ..Options::default() });
    viewer.watch(6_000_000);
    viewer.pause(true);
    viewer.watch(11_000_000);
    viewer.pause(false);
    viewer.watch(60_000_000);
    let [loss] = viewer.player.losses() else { panic!("{:?}", viewer.player.losses()) };
    assert!(loss.reason.contains("no more"), "{loss:?}");
    let skipped = loss.gop..loss.gop + loss.count;
    let expected: Vec<usize> =
        (viewer.numbers[0]..=LAST).filter(|number| !skipped.contains(number)).collect();
    assert_eq!(viewer.numbers, expected);
}
