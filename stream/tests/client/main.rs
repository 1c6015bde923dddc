//! Playback from servers that fail: it goes on, every loss is named, and every frame is that of the operating point.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

#[path = "../common/mod.rs"]
mod common;
mod follow;
mod hostile;
mod live;
mod network;
mod server;

use common::played::check;
use common::{files, is_conforming, package, vectors};
use server::{Answer, Request, Server};
use splatstream_stream::client::{Client, ClientError, Options, Outcome, PlayedGop};
use splatstream_stream::control::{BufferRule, Layered, Rule, Single, ThroughputRule};
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::{Layout, Options as Packaging, Package};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A stream of several GOPs with three temporal layers.
fn mixed() -> Vec<u8> {
    vector("temporal-gops-mixed")
}

fn vector(name: &str) -> Vec<u8> {
    let path = vectors().into_iter().find(|path| path.parent().is_some_and(|folder| folder.ends_with(name)));
    std::fs::read(path.unwrap()).unwrap()
}

/// All files of a package with the manifest, in which a frame lasts a second: there is time to fetch what improves a GOP.
fn served(stream: &[u8], layout: Layout) -> BTreeMap<String, Vec<u8>> {
    let mut package = package(stream, &Packaging { layout, ..Packaging::default() });
    let mut served: BTreeMap<String, Vec<u8>> = files(&package).into_iter().collect();
    frame_lasts(&mut package.manifest, 1000);
    served.insert(Package::MANIFEST.to_owned(), package.manifest.to_json().into_bytes());
    served
}

/// Makes every frame last some milliseconds.
fn frame_lasts(manifest: &mut Manifest, milliseconds: u32) {
    (manifest.stream.ticks_per_second, manifest.stream.ticks_per_frame) = (1000, milliseconds);
}

fn options() -> Options {
    Options { real_time: false, read_timeout: Duration::from_millis(400), ..Options::default() }
}

/// Plays a package, whose frames are all checked.
fn play(url: &str, stream: &[u8], options: Options, rule: impl Rule) -> Result<Outcome, ClientError> {
    let mut client = Client::open(url, options)?;
    let mut numbers = Vec::new();
    let outcome = client.play(rule, &mut |gop: &PlayedGop<'_>| {
        numbers.push(gop.number);
        check(stream, gop);
    })?;
    assert_eq!(
        numbers,
        (0..client.manifest().gops.len()).collect::<Vec<_>>(),
        "each GOP is shown once, in order"
    );
    Ok(outcome)
}

fn play_from(
    stream: &[u8],
    behaviour: impl Fn(&Request) -> Answer + Send + Sync + 'static,
) -> (Outcome, Server) {
    let server = Server::start(served(stream, Layout::Gop), behaviour);
    let outcome = play(&server.url, stream, options(), Layered::default()).unwrap();
    (outcome, server)
}

/// The losses as text.
fn named(outcome: &Outcome) -> Vec<String> {
    let losses = outcome.losses.iter();
    losses
        .map(|loss| format!("{} {} r{}: {}", loss.gop, loss.representation, loss.refinement, loss.reason))
        .collect()
}

#[test]
fn all_layers_of_many_streams_are_played() {
    for path in vectors().into_iter().filter(|path| is_conforming(path)).step_by(9) {
        let stream = std::fs::read(&path).unwrap();
        for layout in [Layout::Gop, Layout::Frame] {
            let directory = tempfile::tempdir().unwrap();
            for (name, bytes) in served(&stream, layout) {
                std::fs::write(directory.path().join(name), bytes).unwrap();
            }
            let place = directory.path().to_str().unwrap();
            let outcome = play(place, &stream, options(), Layered::default()).unwrap();
            assert!(outcome.losses.is_empty(), "{}: {:?}", path.display(), named(&outcome));
            assert_eq!(outcome.report.complete, !outcome.gops.is_empty() || outcome.ladder.gops().is_empty());
        }
    }
}

#[test]
fn rules_for_comparison_play_too() {
    let stream = mixed();
    let server = Server::start(served(&stream, Layout::Gop), |_| Answer::Well);
    let throughput = play(&server.url, &stream, options(), Single::whole(ThroughputRule)).unwrap();
    let buffer = play(&server.url, &stream, options(), Single::partial(BufferRule)).unwrap();
    for outcome in [throughput, buffer] {
        assert!(outcome.report.complete && outcome.losses.is_empty());
    }
}

#[test]
fn connections_are_kept() {
    let (outcome, server) = play_from(&mixed(), |_| Answer::Well);
    let requests = server.requests.lock().unwrap();
    assert!(outcome.losses.is_empty() && outcome.report.requests > 5);
    // One that is given up closes its connection.
    let abandoned = outcome.report.abandoned as usize;
    let connections = requests.iter().map(|request| request.connection).max().unwrap() + 1;
    assert!(connections <= 2 + abandoned, "{connections} connections for {} requests", requests.len());
    assert!(requests.iter().skip(8).any(|request| request.if_range.is_some()));
}

#[test]
fn what_is_refused_is_played_without() {
    for status in [404, 503] {
        let (outcome, server) = play_from(&mixed(), move |request| match request.file.as_str() {
            "t1.mp4" => Answer::Status(status),
            _ => Answer::Well,
        });
        assert!(outcome.report.complete);
        assert!(!outcome.losses.is_empty());
        assert!(
            outcome
                .losses
                .iter()
                .all(|loss| loss.representation == "t1" && loss.reason.contains(&status.to_string()))
        );
        let refused =
            server.requests.lock().unwrap().iter().filter(|request| request.file == "t1.mp4").count();
        // What is not there is asked for three times in all; what fails may be there for the next GOP.
        assert!(refused <= if status == 404 { 3 } else { 3 * outcome.gops.len() }, "{refused} of {status}");
        // Each GOP loses it once; one that is improved later may do so after the next.
        let mut lost: Vec<usize> = outcome.losses.iter().map(|loss| loss.gop).collect();
        lost.sort_unstable();
        assert!(lost.windows(2).all(|pair| pair[0] < pair[1]), "{lost:?}");
        assert!(
            outcome
                .gops
                .iter()
                .all(|gop| gop.shown.is_some_and(|shown| shown.waited_us == 0 || gop.number == 0))
        );
    }
}

#[test]
fn files_of_a_server_without_ranges_are_fetched_whole_and_once() {
    let (outcome, server) = play_from(&mixed(), |_| Answer::Whole);
    assert!(outcome.report.complete && outcome.losses.is_empty(), "{:?}", named(&outcome));
    assert!(outcome.gops.iter().all(|gop| gop.failures == 0));
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for request in server.requests.lock().unwrap().iter() {
        *counts.entry(request.file.clone()).or_default() += 1;
    }
    assert!(counts.len() > 2 && counts.values().all(|count| *count == 1), "{counts:?}");
}

/// Whether a request is for levels of a file, and not for its initialisation segment.
fn is_range(request: &Request, file: &str) -> bool {
    request.file == file && request.range.is_some_and(|(first, _)| first > 0)
}

#[test]
fn passing_faults_cost_nothing() {
    let faults: [fn(&Request) -> Answer; 8] = [
        |_| Answer::Flip,
        |_| Answer::Whole,
        |_| Answer::Other,
        |_| Answer::Short(10),
        |_| Answer::Short(usize::MAX),
        |_| Answer::Reset,
        |_| Answer::Status(500),
        |_| Answer::Late(Duration::from_millis(900)),
    ];
    // What goes wrong is waited for: all at the same time.
    std::thread::scope(|scope| {
        for (kind, fault) in faults.into_iter().enumerate() {
            scope.spawn(move || pass(kind, fault, "s0.mp4"));
            scope.spawn(move || pass(kind, fault, "t0.mp4"));
            // Ranges and digests are not of the manifest.
            if kind > 2 {
                scope.spawn(move || pass(kind, fault, Package::MANIFEST));
            }
        }
    });
}

/// The first request for media of a file, or for the manifest, fails.
fn pass(kind: usize, fault: fn(&Request) -> Answer, file: &'static str) {
    let done = AtomicBool::new(false);
    let is_manifest = file == Package::MANIFEST;
    let (outcome, _server) = play_from(&mixed(), move |request| {
        let hit = if is_manifest { request.file == file } else { is_range(request, file) };
        let first = hit && !done.swap(true, Ordering::SeqCst);
        if first { fault(request) } else { Answer::Well }
    });
    assert!(outcome.report.complete, "fault {kind} of {file}");
    assert_eq!(named(&outcome), Vec::<String>::new(), "fault {kind} of {file}");
    let failures: u64 = outcome.gops.iter().map(|gop| gop.failures).sum();
    // A whole file has the range too.
    let is_fault = !is_manifest && kind != 1;
    assert_eq!(failures, u64::from(is_fault), "fault {kind} of {file}");
}

#[test]
fn damaged_levels_are_fetched_once_more_and_dropped() {
    let (outcome, server) =
        play_from(&mixed(), |request| if is_range(request, "t0.mp4") { Answer::Flip } else { Answer::Well });
    assert!(outcome.report.complete);
    assert!(
        outcome.losses.iter().all(|loss| loss.representation == "t0" && loss.reason.contains("digest")),
        "{:?}",
        named(&outcome)
    );
    let mut counts: BTreeMap<_, usize> = BTreeMap::new();
    for request in server.requests.lock().unwrap().iter().filter(|request| is_range(request, "t0.mp4")) {
        *counts.entry(request.range.unwrap().1).or_default() += 1;
    }
    assert!(
        counts.values().all(|&count| count <= 2) && counts.values().any(|&count| count == 2),
        "{counts:?}"
    );
}

/// Where the levels of the base of the second GOP begin in its file.
fn second_base(stream: &[u8]) -> Vec<usize> {
    let package = package(stream, &Packaging::default());
    let base = &package.manifest.gops[1].subsegments[0];
    assert_eq!(base.representation, "s0");
    base.levels.iter().map(|level| level.bytes.offset as usize).collect()
}

/// How often the client asked for ranges of `s0.mp4` that begin at an offset.
fn asked(server: &Server, first: usize) -> usize {
    let requests = server.requests.lock().unwrap();
    requests
        .iter()
        .filter(|request| request.file == "s0.mp4" && request.range.is_some_and(|range| range.0 == first))
        .count()
}

#[test]
fn a_lost_base_is_skipped_and_named() {
    let stream = mixed();
    let first = second_base(&stream)[0];
    for status in [502, 404] {
        let behaviour = move |request: &Request| match request.range {
            Some((start, _)) if request.file == "s0.mp4" && start == first => Answer::Status(status),
            _ => Answer::Well,
        };
        let (outcome, server) = play_from(&stream, behaviour);
        assert_eq!(named(&outcome), [format!("1 s0 r0: the server answers with status {status}")]);
        assert!(outcome.gops[1].shown.is_none() && !outcome.report.complete);
        assert_eq!(outcome.report.shown.len(), outcome.gops.len() - 1);
        assert_eq!(asked(&server, first), 8);
    }
}

#[test]
fn levels_that_arrived_before_a_fault_are_not_fetched_again() {
    let stream = mixed();
    let starts = second_base(&stream);
    let (first, length) = (starts[0], starts[1] - starts[0]);
    let behaviour = move |request: &Request| match request.range {
        Some((start, last)) if request.file == "s0.mp4" && start == first && last > first + length => {
            Answer::Short(length + 10)
        }
        _ => Answer::Well,
    };
    let (outcome, server) = play_from(&stream, behaviour);
    assert_eq!((named(&outcome), outcome.gops[1].failures), (Vec::new(), 1));
    assert_eq!(starts.iter().map(|&start| asked(&server, start)).collect::<Vec<_>>(), [1, 1]);
}

#[test]
fn what_a_slow_server_does_not_bring_in_time_is_given_up() {
    let stream = mixed();
    let package = package(&stream, &Packaging::default());
    // All of the third GOP but its base comes slowly.
    let slow: Vec<(String, usize)> = package.manifest.gops[2]
        .subsegments
        .iter()
        .flat_map(|one| one.levels.iter().map(|level| (one.representation.clone() + ".mp4", level)))
        .map(|(file, level)| (file, level.bytes.offset as usize))
        .skip(1)
        .collect();
    let mut files = served(&stream, Layout::Gop);
    let mut manifest = package.manifest;
    frame_lasts(&mut manifest, 250);
    files.insert(Package::MANIFEST.to_owned(), manifest.to_json().into_bytes());
    let server = Server::start(files, move |request| {
        let is_slow = slow.iter().any(|(file, at)| {
            *file == request.file && request.range.is_some_and(|(first, last)| (first..=last).contains(at))
        });
        if is_slow { Answer::Slow(Duration::from_millis(20)) } else { Answer::Well }
    });
    let options = Options { real_time: true, ..options() };
    let outcome = play(&server.url, &stream, options, Layered::default()).unwrap();
    assert!(outcome.report.complete && outcome.losses.is_empty());
    let best = outcome.ladder.gops()[2].points().last().unwrap().name;
    let point = |gop: usize| outcome.gops[gop].shown.unwrap().point;
    assert!(outcome.gops[2].abandoned > 0 && point(2) != best, "{:?}", outcome.gops[2]);
    assert_eq!(point(1), best);
}

#[test]
fn restarts_are_outlasted() {
    let (outcome, _server) =
        play_from(
            &mixed(),
            |request| if (4..6).contains(&request.number) { Answer::Reset } else { Answer::Well },
        );
    assert!(outcome.report.complete);
    assert_eq!(named(&outcome), Vec::<String>::new());
}

#[test]
fn a_server_that_tags_files_anew_is_followed() {
    let stream = mixed();
    let server = Server::start(served(&stream, Layout::Gop), |_| Answer::Well);
    let mut client = Client::open(&server.url, options()).unwrap();
    let content = server.content.clone();
    let outcome = client.play(Layered::default(), &mut |gop: &PlayedGop<'_>| {
        content.lock().unwrap().tag = format!("\"{}\"", gop.number + 2);
        check(&stream, gop);
    });
    assert!(outcome.unwrap().losses.is_empty());
}

/// Options with a buffer of about a GOP, so that some are fetched late.
fn short(manifest: &Manifest) -> Options {
    let mut options = options();
    options.settings.buffer_us = manifest.ladder().unwrap().gops()[0].duration_us();
    options
}

#[test]
fn another_package_ends_playback_with_an_error() {
    let stream = mixed();
    let server = Server::start(served(&stream, Layout::Gop), |_| Answer::Well);
    let manifest = Client::open(&server.url, options()).unwrap().manifest().clone();
    let mut client = Client::open(&server.url, short(&manifest)).unwrap();
    let content = server.content.clone();
    let outcome = client.play(Layered::default(), &mut |gop: &PlayedGop<'_>| {
        check(&stream, gop);
        let mut content = content.lock().unwrap();
        content.files = served(&vector("codebook-defined-again"), Layout::Gop);
        content.tag = "\"other\"".into();
    });
    assert_eq!(outcome, Err(ClientError::Changed(None)));
}

#[test]
fn packages_that_are_not_there_or_too_large_are_refused() {
    let stream = mixed();
    let server = Server::start(served(&stream, Layout::Gop), |_| Answer::Well);
    let gone = Server::start(BTreeMap::new(), |_| Answer::Well);
    let error = Client::open(&gone.url, options()).unwrap_err();
    assert!(matches!(&error, ClientError::Unreachable(_, why) if why.contains("404")), "{error}");
    let small = Options { memory: 1000, ..options() };
    let error = play(&server.url, &stream, small, Layered::default()).unwrap_err();
    assert!(matches!(error, ClientError::TooLarge(_)));
    assert!(
        Client::open(Path::new("/nowhere").to_str().unwrap(), Options { base_attempts: 1, ..options() })
            .is_err()
    );
}

#[test]
fn memory_bounds_what_is_buffered() {
    let stream = mixed();
    let server = Server::start(served(&stream, Layout::Gop), |_| Answer::Well);
    let ladder = Client::open(&server.url, options()).unwrap().manifest().ladder().unwrap();
    let most = ladder.gops().iter().flat_map(|gop| gop.points()).map(|point| point.bytes).max().unwrap();
    let outcome =
        play(&server.url, &stream, Options { memory: 3 * most, ..options() }, Layered::default()).unwrap();
    assert!(outcome.report.complete && outcome.losses.is_empty());
    let shortest = ladder.gops().iter().map(|gop| gop.duration_us()).min().unwrap();
    let longest = ladder.gops().iter().map(|gop| gop.duration_us()).max().unwrap();
    assert!(outcome.gops.iter().all(|gop| gop.buffer_us <= shortest + longest), "{:?}", outcome.gops);
}
