//! Presentations that grow, followed in virtual time: a packager writes while a player polls and plays. What is shown is what
//! a decoder of the whole stream shows.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use common::broadcast::Broadcast;
use common::played::check;
use splatstream_stream::control::Layered;
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::{Layout, Package};
use splatstream_stream::playback::{
    ByteRequest, Command, Fault, Following, GopLog, Loss, Options, PlaybackError, Player,
};
use std::cell::Cell;

/// What a request for the manifest brings.
enum Read {
    Well,
    Fault,
    Instead(Box<Manifest>),
}

/// What a request for the manifest brings at a time.
type Reading<'a> = dyn Fn(u64, &Manifest) -> Read + 'a;

/// How a playback goes.
struct Case<'a> {
    /// When it starts.
    start_us: u64,
    following: Following,
    /// Whether the network is there, for a time.
    is_up: &'a dyn Fn(u64) -> bool,
    /// What a request for the manifest brings at a time; the manifest is the right one.
    read: &'a Reading<'a>,
}

impl Default for Case<'_> {
    fn default() -> Self {
        Self {
            start_us: 5_100_000,
            following: Following::default(),
            is_up: &|_| true,
            read: &|_, _| Read::Well,
        }
    }
}

/// What it was like.
#[derive(Debug)]
struct Played {
    /// Numbers of the GOPs that were shown.
    numbers: Vec<usize>,
    logs: Vec<GopLog>,
    losses: Vec<Loss>,
    polls: usize,
    end_us: u64,
}

impl Played {
    fn latencies(&self) -> Vec<u64> {
        self.logs.iter().filter_map(|log| log.shown?.latency_us).collect()
    }
}

/// What a request takes.
const REQUEST_US: u64 = 5000;

fn play(broadcast: &Broadcast, case: &Case<'_>) -> Result<Played, PlaybackError> {
    let options = Options { following: case.following, ..Options::default() };
    let mut now_us = case.start_us;
    let first = broadcast.manifest(now_us).unwrap();
    let mut published_ms = first.live.as_ref().unwrap().published_ms;
    let mut player = Player::new(first, options, Layered::default(), now_us)?;
    let (mut numbers, mut polls) = (Vec::new(), 0);
    while !player.has_ended() {
        match player.decide(now_us) {
            Command::Fetch(requests) => fetch(broadcast, case, &mut player, &mut now_us, &requests),
            Command::Abandon => {}
            Command::ReadManifest => unreachable!("no file changes"),
            Command::Wait { until_us } => now_us = until_us,
            Command::PollManifest => {
                polls += 1;
                let manifest = broadcast.manifest(now_us).unwrap();
                let read = if (case.is_up)(now_us) { (case.read)(now_us, &manifest) } else { Read::Fault };
                let new_ms = manifest.live.as_ref().unwrap().published_ms;
                match read {
                    Read::Fault => player.unreadable(now_us)?,
                    Read::Instead(other) => player.renew(now_us, *other)?,
                    Read::Well if new_ms == published_ms => player.unchanged(now_us)?,
                    Read::Well => {
                        published_ms = new_ms;
                        player.renew(now_us, manifest)?;
                    }
                }
            }
        }
        while let Some(gop) = player.show() {
            check(&broadcast.stream, &gop);
            numbers.push(gop.number);
        }
        assert!(now_us < 200_000_000, "it does not end: {:?}", player.state().playback());
    }
    let (logs, losses) = (player.logs().to_vec(), player.losses().to_vec());
    Ok(Played { numbers, logs, losses, polls, end_us: now_us })
}

fn fetch(
    broadcast: &Broadcast,
    case: &Case<'_>,
    player: &mut Player<Layered>,
    now_us: &mut u64,
    requests: &[ByteRequest],
) {
    for request in requests {
        player.sent();
        *now_us += REQUEST_US;
        if !(case.is_up)(*now_us) {
            return player.failed(*now_us, &Fault::Status(503));
        }
        let (from, to) = (request.offset as usize, (request.offset + request.size) as usize);
        let bytes = &broadcast.files(*now_us)[&request.file][from..to];
        player.begun(*now_us);
        player.received(*now_us, bytes);
    }
}

const LAST: usize = 23;

#[test]
fn playback_joins_behind_the_last_gop_and_follows() {
    for layout in [Layout::Gop, Layout::Frame] {
        let broadcast = Broadcast::new(layout, 60_000);
        let played = play(&broadcast, &Case::default()).unwrap();
        // At 5.1 s GOPs up to 8 are complete, which end at 5 s at most; the target is 2 s or, of single frames, 1.5 s.
        let first = played.numbers[0];
        assert!((4..=7).contains(&first), "{first}");
        assert_eq!(played.numbers, (first..=LAST).collect::<Vec<_>>());
        assert_eq!(played.losses, []);
        let latencies = played.latencies();
        assert!(latencies.iter().all(|us| (1_400_000..3_200_000).contains(us)), "{latencies:?}");
        let most: u64 = played.logs.iter().skip(1).map(|log| log.shown.unwrap().waited_us).sum();
        assert!(most < 500_000, "it stands still for {most} us");
        // As many as GOPs came, and some that came too early.
        assert!((10..50).contains(&played.polls), "{} polls", played.polls);
        assert!((14_000_000..17_000_000).contains(&played.end_us), "{}", played.end_us);
    }
}

#[test]
fn playback_starts_with_the_first_gop_that_is_listed() {
    for window_ms in [60_000, 2000] {
        let broadcast = Broadcast::new(Layout::Gop, window_ms);
        let first = broadcast.manifest(5_100_000).unwrap().first_gop() as usize;
        assert_eq!(first == 0, window_ms > 2000);
        let following = Following { from_start: true, ..Following::default() };
        let played = play(&broadcast, &Case { following, ..Case::default() }).unwrap();
        assert_eq!(played.numbers, (first..=LAST).collect::<Vec<_>>());
        assert_eq!(played.losses, []);
        // What is played from the start is not hurried.
        let rates: Vec<u32> = played.logs.iter().map(|log| log.shown.unwrap().rate_milli).collect();
        assert!(rates.iter().all(|rate| (950..=1010).contains(rate)), "{rates:?}");
    }
}

#[test]
fn a_presentation_that_ended_before_is_played_whole() {
    let broadcast = Broadcast::new(Layout::Frame, 2000);
    let played = play(&broadcast, &Case { start_us: 20_000_000, ..Case::default() }).unwrap();
    assert_eq!((played.numbers, played.polls), ((0..=LAST).collect::<Vec<_>>(), 0));
}

#[test]
fn playback_begins_with_the_first_gop_that_comes() {
    let broadcast = Broadcast::new(Layout::Frame, 60_000);
    // The first frame is there, and no GOP is complete.
    let played = play(&broadcast, &Case { start_us: 500_000, ..Case::default() }).unwrap();
    assert_eq!(played.numbers, (0..=LAST).collect::<Vec<_>>());
    assert_eq!(played.losses, []);
}

#[test]
fn clocks_need_not_agree() {
    let broadcast = Broadcast::new(Layout::Gop, 60_000);
    // The same playback by a clock that says another time.
    let plain = play(&broadcast, &Case::default()).unwrap();
    let shift = |manifest: &Manifest, hours: i64| {
        let mut manifest = manifest.clone();
        let live = manifest.live.as_mut().unwrap();
        for ms in [&mut live.started_ms, &mut live.published_ms] {
            *ms = ms.checked_add_signed(hours * 3_600_000).unwrap();
        }
        manifest
    };
    for hours in [-1000, 1000] {
        let history = broadcast.history.iter().map(|(at_us, files)| {
            let mut files = files.clone();
            if let Some(text) = files.get_mut(Package::MANIFEST) {
                *text = shift(&Manifest::parse(text).unwrap(), hours).to_json().into_bytes();
            }
            (*at_us, files)
        });
        let other = Broadcast { stream: broadcast.stream.clone(), history: history.collect() };
        let played = play(&other, &Case::default()).unwrap();
        assert_eq!(played.logs, plain.logs);
    }
}

#[test]
fn what_fell_out_of_the_window_is_skipped_and_named() {
    for layout in [Layout::Gop, Layout::Frame] {
        let broadcast = Broadcast::new(layout, 0);
        let is_up = |now_us: u64| !(6_000_000..10_000_000).contains(&now_us);
        let played = play(&broadcast, &Case { is_up: &is_up, ..Case::default() }).unwrap();
        let [loss] = played.losses.as_slice() else { panic!("{:?}", played.losses) };
        assert!(loss.count >= 2 && loss.reason.contains("no more"), "{loss:?}");
        let skipped = loss.gop..loss.gop + loss.count;
        let expected: Vec<usize> =
            (played.numbers[0]..=LAST).filter(|number| !skipped.contains(number)).collect();
        assert_eq!(played.numbers, expected);
        // Near the last GOP again.
        let latencies = played.latencies();
        assert!(*latencies.last().unwrap() < 3_500_000, "{latencies:?}");
    }
}

#[test]
fn playback_that_is_far_behind_goes_on_nearer_to_the_last_gop() {
    let broadcast = Broadcast::new(Layout::Gop, 60_000);
    let is_up = |now_us: u64| !(6_000_000..10_000_000).contains(&now_us);
    let following = Following { drift_us: 2_000_000, ..Following::default() };
    let played = play(&broadcast, &Case { is_up: &is_up, following, ..Case::default() }).unwrap();
    let [loss] = played.losses.as_slice() else { panic!("{:?}", played.losses) };
    assert!(loss.reason.contains("behind"), "{loss:?}");
    // With patience for it, nothing is lost, and playback is faster for a while.
    let played = play(&broadcast, &Case { is_up: &is_up, ..Case::default() }).unwrap();
    assert_eq!(played.losses, []);
    assert_eq!(played.numbers, (played.numbers[0]..=LAST).collect::<Vec<_>>());
    let rates: Vec<u32> = played.logs.iter().map(|log| log.shown.unwrap().rate_milli).collect();
    assert!(rates.contains(&1050), "{rates:?}");
}

#[test]
fn a_manifest_that_is_gone_for_a_while_costs_nothing() {
    let broadcast = Broadcast::new(Layout::Gop, 60_000);
    let read = |now_us: u64, _: &Manifest| {
        if (6_000_000..8_000_000).contains(&now_us) { Read::Fault } else { Read::Well }
    };
    let played = play(&broadcast, &Case { read: &read, ..Case::default() }).unwrap();
    assert_eq!(played.losses, []);
    assert_eq!(played.numbers, (played.numbers[0]..=LAST).collect::<Vec<_>>());
}

#[test]
fn silence_ends_playback_with_an_error() {
    let broadcast = Broadcast::new(Layout::Gop, 60_000);
    let following = Following { patience_us: 3_000_000, ..Following::default() };
    let gone = |now_us: u64, _: &Manifest| if now_us > 6_000_000 { Read::Fault } else { Read::Well };
    let frozen = broadcast.manifest(6_000_000).unwrap();
    let still = |now_us: u64, _: &Manifest| match now_us > 6_000_000 {
        true => Read::Instead(Box::new(frozen.clone())),
        false => Read::Well,
    };
    let cases: [&Reading<'_>; 2] = [&gone, &still];
    for (number, read) in cases.into_iter().enumerate() {
        let result = play(&broadcast, &Case { read, following, ..Case::default() });
        let Err(PlaybackError::Stopped(us)) = result else { panic!("case {number}: {result:?}") };
        assert!((3_000_000..8_000_000).contains(&us), "case {number}: {us}");
    }
}

#[test]
fn an_old_copy_is_passed_over() {
    let broadcast = Broadcast::new(Layout::Gop, 60_000);
    let old = broadcast.manifest(5_100_000).unwrap();
    // A cache that is behind answers now and then.
    let count = Cell::new(0);
    let read = |_: u64, _: &Manifest| match count.replace(count.get() + 1) % 3 {
        0 => Read::Instead(Box::new(old.clone())),
        _ => Read::Well,
    };
    let played = play(&broadcast, &Case { read: &read, ..Case::default() }).unwrap();
    assert_eq!(played.losses, []);
    assert_eq!(played.numbers, (played.numbers[0]..=LAST).collect::<Vec<_>>());
}

/// A change of a manifest that is newer than the one before.
type Edit = fn(&mut Manifest);

/// Whether an error is the one that there should be.
type IsRight = fn(&PlaybackError) -> bool;

#[test]
fn another_presentation_ends_playback_with_an_error() {
    let broadcast = Broadcast::new(Layout::Gop, 60_000);
    let edits: [(Edit, IsRight); 4] = [
        (
            |manifest| manifest.gops.truncate(3),
            |error| matches!(error, PlaybackError::Backwards { listed: 3, .. }),
        ),
        (
            |manifest| manifest.live.as_mut().unwrap().started_ms += 1,
            |error| *error == PlaybackError::Changed(None),
        ),
        (|manifest| manifest.stream.sh_degree ^= 1, |error| *error == PlaybackError::Changed(None)),
        (
            |manifest| {
                for gop in &mut manifest.gops {
                    gop.subsegments[0].levels[0].bytes.digest = "0123456789abcdef".to_owned();
                }
            },
            |error| matches!(error, PlaybackError::Changed(Some(_))),
        ),
    ];
    for (number, (edit, is_right)) in edits.into_iter().enumerate() {
        let read = |now_us: u64, manifest: &Manifest| {
            let mut other = manifest.clone();
            edit(&mut other);
            if now_us > 6_000_000 { Read::Instead(Box::new(other)) } else { Read::Well }
        };
        let error = play(&broadcast, &Case { read: &read, ..Case::default() }).unwrap_err();
        assert!(is_right(&error), "case {number}: {error}");
    }
}
