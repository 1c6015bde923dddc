//! Presentations that grow, followed over HTTP and in a directory, from servers that fail.

use super::common::repeated;
use super::server::{Answer, Request, Server};
use super::{Layered, Layout, Outcome, PlayedGop, check, mixed, named, options};
use splatstream_format::Limits;
use splatstream_stream::client::{Client, ClientError, Following, Options};
use splatstream_stream::division::Division;
use splatstream_stream::live::{Change, Live, Settings};
use splatstream_stream::package::{Options as Packaging, Package};
use std::collections::BTreeMap;
use std::path::Path;
use std::thread::{self, JoinHandle, sleep};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Milliseconds of a frame: a GOP has two or five.
const FRAME_MS: u64 = 150;

/// Eight GOPs: 3.3 s.
fn stream() -> Vec<u8> {
    repeated(&mixed(), 2, FRAME_MS as u32)
}

fn now_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_millis() as u64
}

/// Packages a stream in real time, and hands out what changes; returns after the first manifest.
fn broadcast(
    stream: &[u8],
    layout: Layout,
    mut apply: impl FnMut(Change) + Send + 'static,
) -> JoinHandle<()> {
    let (stream, begun) = (stream.to_vec(), Instant::now());
    let division = Division::of(&stream, &Limits::default()).unwrap();
    let mut live =
        Live::new(&Settings::new(Packaging { layout, ..Packaging::default() }), &Limits::default());
    let mut pieces = division.gops.iter().flat_map(|gop| gop.pieces.clone()).collect::<Vec<_>>().into_iter();
    let mut at = 0;
    // The first GOP comes at once.
    for piece in pieces.by_ref() {
        let changes = live.push(&stream[at..piece.end as usize], now_ms()).unwrap();
        at = piece.end as usize;
        let is_described = changes.iter().any(|change| change.name == Package::MANIFEST);
        changes.into_iter().for_each(&mut apply);
        if is_described {
            break;
        }
    }
    thread::spawn(move || {
        for piece in pieces {
            let due = Duration::from_millis(u64::from(piece.place.frame) * FRAME_MS);
            sleep(due.saturating_sub(begun.elapsed()));
            live.push(&stream[at..piece.end as usize], now_ms()).unwrap().into_iter().for_each(&mut apply);
            at = piece.end as usize;
        }
        live.push(&stream[at..], now_ms()).unwrap().into_iter().for_each(&mut apply);
        live.finish(now_ms()).unwrap().into_iter().for_each(&mut apply);
    })
}

/// A server of a presentation that grows.
fn grow(
    stream: &[u8],
    layout: Layout,
    behaviour: impl Fn(&Request) -> Answer + Send + Sync + 'static,
) -> (Server, JoinHandle<()>) {
    let server = Server::start(BTreeMap::new(), behaviour);
    let content = server.content.clone();
    let packager = broadcast(stream, layout, move |Change { name, bytes, appends }| {
        let mut content = content.lock().unwrap();
        let file = content.files.entry(name).or_default();
        if !appends {
            file.clear();
        }
        file.extend(bytes);
    });
    (server, packager)
}

/// From the first GOP on; half a second of patience where that is wanted.
fn following(patience: Duration) -> Options {
    let patience_us = patience.as_micros() as u64;
    let following = Following { from_start: true, patience_us, ..Following::default() };
    Options { following, ..options() }
}

/// Plays from somewhere, and compares every frame.
fn play(place: &str, stream: &[u8], options: Options) -> Result<(Outcome, Vec<usize>), ClientError> {
    let mut numbers = Vec::new();
    let outcome = Client::open(place, options)?.play(Layered::default(), &mut |gop: &PlayedGop<'_>| {
        numbers.push(gop.number);
        check(stream, gop);
    })?;
    Ok((outcome, numbers))
}

#[test]
fn a_presentation_is_followed_to_its_end() {
    for layout in [Layout::Gop, Layout::Frame] {
        let stream = stream();
        let (server, packager) = grow(&stream, layout, |_| Answer::Well);
        let (outcome, numbers) = play(&server.url, &stream, following(Duration::from_secs(10))).unwrap();
        assert_eq!(numbers, (0..8).collect::<Vec<_>>());
        assert_eq!(named(&outcome), Vec::<String>::new());
        assert!(outcome.report.complete);
        let latencies: Vec<u64> = outcome.report.shown.iter().filter_map(|shown| shown.latency_us).collect();
        assert!(latencies.len() == 8 && latencies.iter().all(|us| *us < 5_000_000), "{latencies:?}");
        // Polls are conditional, and not many more than manifests that say something new.
        let requests = server.requests.lock().unwrap();
        let polls: Vec<&Request> =
            requests.iter().filter(|request| request.file == Package::MANIFEST).collect();
        assert!(polls.iter().skip(1).all(|poll| poll.if_none_match.is_some()));
        assert!((6..60).contains(&polls.len()), "{} polls", polls.len());
        packager.join().unwrap();
    }
}

#[test]
fn a_directory_is_followed_to_its_end() {
    let (stream, directory) = (stream(), tempfile::tempdir().unwrap());
    let folder = directory.path().to_path_buf();
    let packager = broadcast(&stream, Layout::Gop, move |change| write(&folder, &change));
    let place = directory.path().to_str().unwrap();
    let (outcome, numbers) = play(place, &stream, following(Duration::from_secs(10))).unwrap();
    assert_eq!((numbers, named(&outcome)), ((0..8).collect(), Vec::new()));
    packager.join().unwrap();
}

/// Files are replaced at once.
fn write(folder: &Path, change: &Change) {
    let (path, unfinished) = (folder.join(&change.name), folder.join("unfinished"));
    let mut bytes = if change.appends { std::fs::read(&path).unwrap() } else { Vec::new() };
    bytes.extend(&change.bytes);
    std::fs::write(&unfinished, bytes).unwrap();
    std::fs::rename(unfinished, path).unwrap();
}

#[test]
fn manifests_that_fail_for_a_while_cost_nothing() {
    let faults: [fn() -> Answer; 5] = [
        || Answer::Status(404),
        || Answer::Status(503),
        || Answer::Reset,
        || Answer::Short(100),
        || Answer::Late(Duration::from_millis(900)),
    ];
    thread::scope(|scope| {
        for (kind, fault) in faults.into_iter().enumerate() {
            scope.spawn(move || {
                let stream = stream();
                let begun = Instant::now();
                let is_down = move || (1000..2000).contains(&begun.elapsed().as_millis());
                let (server, packager) = grow(&stream, Layout::Gop, move |request| {
                    if request.file == Package::MANIFEST && is_down() { fault() } else { Answer::Well }
                });
                let (outcome, numbers) =
                    play(&server.url, &stream, following(Duration::from_secs(20))).unwrap();
                assert_eq!(numbers, (0..8).collect::<Vec<_>>(), "fault {kind}");
                assert_eq!(named(&outcome), Vec::<String>::new(), "fault {kind}");
                packager.join().unwrap();
            });
        }
    });
}

#[test]
fn segments_that_are_gone_are_skipped_and_named() {
    let stream = stream();
    let (server, packager) = grow(&stream, Layout::Gop, |request| match request.file.as_str() {
        "s0-3.m4s" => Answer::Status(404),
        "t1-5.m4s" => Answer::Flip,
        _ => Answer::Well,
    });
    let options = Options { base_attempts: 2, ..following(Duration::from_secs(20)) };
    let (outcome, _) = play(&server.url, &stream, options).unwrap();
    let losses = named(&outcome);
    assert!(losses.contains(&"2 s0 r0: the server answers with status 404".to_owned()), "{losses:?}");
    assert!(losses.iter().all(|loss| loss.starts_with("2 s0") || loss.starts_with("4 t1")), "{losses:?}");
    assert!(outcome.gops[2].shown.is_none() && !outcome.report.complete);
    packager.join().unwrap();
}

#[test]
fn presentations_that_are_gone_for_good_end_with_an_error() {
    let stream = stream();
    let begun = Instant::now();
    let (server, packager) = grow(&stream, Layout::Gop, move |request| {
        let gone = request.file == Package::MANIFEST && begun.elapsed() > Duration::from_secs(1);
        if gone { Answer::Status(404) } else { Answer::Well }
    });
    let error = play(&server.url, &stream, following(Duration::from_millis(500))).unwrap_err();
    assert!(matches!(&error, ClientError::Unreachable(_, why) if why.contains("404")), "{error}");
    packager.join().unwrap();
}

#[test]
fn manifests_that_go_back_or_become_others_end_with_an_error() {
    let stream = stream();
    for other in [false, true] {
        let (server, packager) = grow(&stream, Layout::Gop, |_| Answer::Well);
        packager.join().unwrap();
        // What was published as ended grows again, with fewer GOPs or as another stream.
        let text = server.content.lock().unwrap().files[Package::MANIFEST].clone();
        let whole = splatstream_stream::manifest::Manifest::parse(&text).unwrap();
        let growing = |gops: usize, later_ms: u64| {
            let mut manifest = whole.clone();
            manifest.gops.truncate(gops);
            (manifest.stream.bytes, manifest.stream.digest) = (None, None);
            let live = manifest.live.as_mut().unwrap();
            live.state = "growing".into();
            live.published_ms += later_ms;
            for one in &mut manifest.representations {
                (one.tail, one.tail_file) = (None, None);
            }
            manifest
        };
        let publish = |manifest: &splatstream_stream::manifest::Manifest| {
            let bytes = manifest.to_json().into_bytes();
            server.content.lock().unwrap().files.insert(Package::MANIFEST.to_owned(), bytes);
        };
        publish(&growing(5, 0));
        let mut next = growing(if other { 6 } else { 4 }, 10);
        if other {
            next.live.as_mut().unwrap().started_ms += 1;
        }
        let mut client = Client::open(&server.url, following(Duration::from_secs(10))).unwrap();
        let outcome = client.play(Layered::default(), &mut |gop: &PlayedGop<'_>| {
            check(&stream, gop);
            publish(&next);
        });
        let expected = if other { ClientError::Changed(None) } else { ClientError::Backwards(5, 4) };
        assert_eq!(outcome.unwrap_err(), expected);
    }
}
