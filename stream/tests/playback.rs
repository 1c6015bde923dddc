//! Players whose caller has the playhead: what they request, and what they give of it.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use common::{files, package, vectors};
use splatstream_stream::control::{Layered, OperatingPoint, Playback};
use splatstream_stream::manifest::{GopInfo, Manifest};
use splatstream_stream::package::Options as Packaging;
use splatstream_stream::playback::{ByteRequest, Command, Fault, Options, PlaybackError, Player};
use std::collections::BTreeMap;

/// A package in memory, from which a player fetches; every request takes a millisecond, and bytes come at a rate.
struct Network {
    files: BTreeMap<String, Vec<u8>>,
    player: Player<Layered>,
    now_us: u64,
    /// Microseconds of a byte.
    byte_us: u64,
    requests: Vec<ByteRequest>,
    abandoned: u32,
    shown: Vec<Shown>,
}

/// A GOP that was shown: its number, its point, its units.
type Shown = (usize, Option<OperatingPoint>, Vec<u8>);

fn manifest_of(stream: &[u8]) -> (BTreeMap<String, Vec<u8>>, Manifest) {
    let mut package = package(stream, &Packaging::default());
    (package.manifest.stream.ticks_per_second, package.manifest.stream.ticks_per_frame) = (10, 1);
    (files(&package).into_iter().collect(), package.manifest)
}

fn mixed() -> Vec<u8> {
    let is_it =
        |path: &std::path::PathBuf| path.parent().is_some_and(|one| one.ends_with("temporal-gops-mixed"));
    std::fs::read(vectors().into_iter().find(is_it).unwrap()).unwrap()
}

impl Network {
    fn new(byte_us: u64, options: Options) -> Self {
        Self::of(manifest_of(&mixed()), byte_us, options)
    }

    fn of((files, manifest): (BTreeMap<String, Vec<u8>>, Manifest), byte_us: u64, options: Options) -> Self {
        let player = Player::driven(manifest, options, Layered::default(), 0).unwrap();
        Self { files, player, now_us: 0, byte_us, requests: Vec::new(), abandoned: 0, shown: Vec::new() }
    }

    /// Fetches for so long, and gives what was shown last.
    fn run(&mut self, us: u64) -> Option<Shown> {
        let (until_us, before) = (self.now_us + us, self.shown.len());
        while self.now_us < until_us {
            match self.player.decide(self.now_us) {
                Command::Fetch(requests) => self.fetch(requests),
                Command::Abandon => self.abandoned += 1,
                Command::ReadManifest | Command::PollManifest => panic!("nothing changes"),
                Command::Wait { until_us } => self.now_us = until_us.min(self.now_us + 20_000),
            }
            self.show();
        }
        self.shown.get(before..).unwrap_or_default().last().cloned()
    }

    fn show(&mut self) {
        while let Some(gop) = self.player.show() {
            self.shown.push((gop.number, gop.point, gop.units.to_vec()));
        }
    }

    /// Sends requests; what is no longer wanted does not come.
    fn fetch(&mut self, requests: Vec<ByteRequest>) {
        for request in requests {
            self.player.sent();
            self.now_us += 1000;
            self.player.begun(self.now_us);
            let start = usize::try_from(request.offset).unwrap();
            let bytes =
                self.files[&request.file][start..start + usize::try_from(request.size).unwrap()].to_vec();
            self.requests.push(request);
            for chunk in bytes.chunks(64) {
                self.now_us += self.byte_us * chunk.len() as u64;
                self.player.received(self.now_us, chunk);
                self.show();
            }
        }
    }
}

#[test]
fn a_gop_begins_when_its_caller_says_so() {
    let mut network = Network::new(1, Options::default());
    let (number, point, units) = network.run(1_000_000).unwrap();
    assert!(number == 0 && point.is_some() && !units.is_empty());
    // However long it takes: no GOP follows by itself.
    assert!(network.run(60_000_000).is_none_or(|(number, ..)| number == 0));
    network.player.go_to(network.now_us, 1, false);
    assert_eq!(network.run(1_000_000).map(|(number, ..)| number), Some(1));
    assert_eq!(network.player.state().playback(), Playback::Playing);
}

#[test]
fn what_stands_still_becomes_as_good_as_it_can_be() {
    let mut network = Network::new(50, Options::default());
    network.player.run(0, 0);
    network.run(20_000_000);
    let shown = &network.shown;
    let gops = network.player.state().ladder().gops();
    let qualities: Vec<f64> = shown
        .iter()
        .map(|(_, point, _)| {
            gops[0].points().iter().find(|one| Some(one.name) == *point).map_or(0.0, |one| one.quality)
        })
        .collect();
    assert!(shown.len() > 2 && shown.iter().all(|(number, ..)| *number == 0));
    assert!(qualities.windows(2).all(|pair| pair[0] <= pair[1]), "{qualities:?}");
    let most = gops[0].points().iter().map(|point| point.quality).fold(0.0, f64::max);
    assert_eq!(qualities.last(), Some(&most));
}

#[test]
fn a_chosen_point_is_fetched_whole_and_shown() {
    let mut network = Network::new(1, Options::default());
    let chosen = OperatingPoint { spatial: 0, temporal: Some(0), refinement: 0 };
    network.player.choose(0, Some(chosen));
    let (_, point, _) = network.run(1_000_000).unwrap();
    assert_eq!(point, Some(chosen));
    let bytes: u64 = network.requests.iter().map(|request| request.size).sum();
    network
        .player
        .choose(network.now_us, Some(OperatingPoint { spatial: 9, temporal: Some(9), refinement: 9 }));
    network.player.go_to(network.now_us, 0, true);
    let best = network.player.state().ladder().gops()[0].points().last().unwrap().name;
    assert_eq!(network.run(1_000_000).unwrap().1, Some(best));
    assert!(network.requests.iter().map(|request| request.size).sum::<u64>() > bytes);
}

#[test]
fn gops_that_are_there_are_shown_again_without_a_request() {
    let mut network = Network::new(1, Options::default());
    let gops = network.player.manifest().gops.len();
    network.player.choose(0, Some(OperatingPoint { spatial: 9, temporal: Some(9), refinement: 9 }));
    let mut first = Vec::new();
    for gop in 0..gops {
        network.player.go_to(network.now_us, gop, false);
        first.push(network.run(1_000_000).unwrap());
    }
    let count = network.requests.len();
    for gop in (0..gops).rev() {
        network.player.go_to(network.now_us, gop, true);
        assert_eq!(network.run(10_000).as_ref(), Some(&first[gop]));
    }
    assert_eq!(network.requests.len(), count);
}

/// The package with its second GOP ten times more.
fn long() -> (BTreeMap<String, Vec<u8>>, Manifest) {
    let (files, mut manifest) = manifest_of(&mixed());
    for _ in 0..10 {
        let last = manifest.gops.last().unwrap();
        let first_frame = last.first_frame + last.frame_count;
        manifest.gops.push(GopInfo { first_frame, ..manifest.gops[1].clone() });
    }
    (files, manifest)
}

#[test]
fn memory_is_bounded_and_what_went_away_is_fetched_again() {
    let (_, manifest) = long();
    let ladder = manifest.ladder().unwrap();
    let most = ladder.gops().iter().flat_map(|gop| gop.points()).map(|point| point.bytes).max().unwrap();
    let mut network = Network::of(long(), 1, Options { memory: 3 * most, ..Options::default() });
    let best = OperatingPoint { spatial: 9, temporal: Some(9), refinement: 9 };
    network.player.choose(0, Some(best));
    for round in 0..2 {
        for gop in 0..manifest.gops.len() {
            network.player.go_to(network.now_us, gop, gop == 0 && round > 0);
            let (number, point, units) = network.run(1_000_000).unwrap();
            assert!(number == gop && point.is_some() && !units.is_empty());
        }
    }
    let bytes: u64 = network.requests.iter().map(|request| request.size).sum();
    let once: u64 = ladder.gops().iter().filter_map(|gop| gop.points().last()).map(|point| point.bytes).sum();
    assert!(once > 3 * most && bytes > once + once / 2, "{bytes} bytes were fetched of {once}");
}

#[test]
fn a_seek_gives_up_what_is_in_its_way() {
    let mut network = Network::new(1, Options::default());
    let last = network.player.manifest().gops.len() - 1;
    assert!(matches!(network.player.decide(0), Command::Fetch(_)));
    network.player.sent();
    network.player.go_to(1000, last, true);
    assert_eq!(network.player.decide(1000), Command::Abandon);
    assert!(matches!(network.player.decide(1000), Command::Fetch(_)));
    assert_eq!(network.player.logs()[0].abandoned, 1);
}

#[test]
fn files_that_are_refused_in_one_gop_after_the_other_are_left_out() {
    let mut network = Network::new(1, Options::default());
    let mut refused = 0;
    for gop in 0..network.player.manifest().gops.len() {
        network.player.go_to(network.now_us, gop, false);
        let until_us = network.now_us + 800_000;
        while network.now_us < until_us {
            match network.player.decide(network.now_us) {
                Command::Fetch(requests) => {
                    let of_base = requests.iter().take_while(|request| request.file == "s0.mp4");
                    let of_base: Vec<_> = of_base.cloned().collect();
                    let is_refused = of_base.len() < requests.len();
                    network.fetch(of_base);
                    if is_refused {
                        refused += 1;
                        network.player.sent();
                        network.player.failed(network.now_us, &Fault::Status(404));
                    }
                }
                Command::Wait { until_us } => network.now_us = until_us.min(network.now_us + 20_000),
                _ => {}
            }
            network.show();
        }
    }
    let losses = network.player.losses();
    assert!(refused > 2 && !losses.is_empty(), "{refused} refused, {} losses", losses.len());
    assert!(losses.iter().all(|loss| loss.reason.contains("404") && loss.representation != "s0"));
}

#[test]
fn another_package_is_refused() {
    let mut network = Network::new(1, Options::default());
    let mut other = network.player.manifest().clone();
    other.gops[1].frame_count += 1;
    assert_eq!(network.player.renew(0, other), Err(PlaybackError::Changed(Some(1))));
}

#[test]
fn frames_are_in_the_gop_that_begins_before_them() {
    let (_, manifest) = manifest_of(&mixed());
    for (number, gop) in manifest.gops.iter().enumerate() {
        assert_eq!(manifest.gop_of(gop.first_frame), Some(number));
        assert_eq!(manifest.gop_of(gop.first_frame + gop.frame_count - 1), Some(number));
    }
    assert_eq!(manifest.gop_of(u32::MAX), Some(manifest.gops.len() - 1));
}
