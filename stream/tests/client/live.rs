//! Presentations that grow while they are played.

use super::server::{Answer, Request, Server};
use super::{Layered, Layout, Outcome, PlayedGop, check, frame_lasts, mixed, named, options, served};
use splatstream_stream::client::{Client, Options};
use splatstream_stream::control::Live;
use splatstream_stream::manifest::Manifest;
use splatstream_stream::package::Package;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

fn manifest_of(server: &Server) -> Manifest {
    Manifest::parse(&server.content.lock().unwrap().files[Package::MANIFEST]).unwrap()
}

fn describe(server: &Server, manifest: &Manifest) {
    let bytes = manifest.to_json().into_bytes();
    server.content.lock().unwrap().files.insert(Package::MANIFEST.to_owned(), bytes);
}

#[test]
fn gops_that_were_added_meanwhile_are_played_too() {
    let stream = mixed();
    let server = Server::start(served(&stream, Layout::Gop), |_| Answer::Well);
    let whole = manifest_of(&server);
    let mut first = whole.clone();
    first.gops.truncate(2);
    describe(&server, &first);
    let mut options = options();
    // So little is buffered that the second GOP is fetched when the first one is shown.
    options.settings.buffer_us = first.ladder().unwrap().gops()[0].duration_us();
    let mut client = Client::open(&server.url, options).unwrap();
    let outcome = client.play(Layered::default(), &mut |gop: &PlayedGop<'_>| {
        check(&stream, gop);
        if gop.number == 0 {
            describe(&server, &whole);
            server.content.lock().unwrap().tag = "\"2\"".into();
        }
    });
    let outcome = outcome.unwrap();
    assert_eq!((outcome.gops.len(), outcome.report.shown.len()), (4, 4));
    assert_eq!(named(&outcome), Vec::<String>::new());
}

/// Plays a live presentation from a server on which GOPs appear this much later than the player thinks, and the more so the
/// longer it takes.
fn play_live(late: Duration, slower_percent: u64) -> Outcome {
    let stream = mixed();
    let begun_us = Arc::new(AtomicU64::new(u64::MAX));
    let (clock, start) = (Instant::now(), Arc::clone(&begun_us));
    let now_us = move || clock.elapsed().as_micros() as u64;
    let mut files = served(&stream, Layout::Gop);
    let mut manifest = Manifest::parse(&files[Package::MANIFEST]).unwrap();
    frame_lasts(&mut manifest, 200);
    files.insert(Package::MANIFEST.to_owned(), manifest.to_json().into_bytes());
    let ladder = manifest.ladder().unwrap();
    let mut available_us = 0;
    let mut ends = Vec::new();
    for (gop, info) in ladder.gops().iter().zip(&manifest.gops) {
        available_us += gop.duration_us() * (100 + slower_percent) / 100;
        let ranges = info.subsegments.iter().flat_map(|one| {
            one.levels.iter().map(|level| (format!("{}.mp4", one.representation), level.bytes.offset))
        });
        ends.extend(ranges.map(|range| (range, available_us + late.as_micros() as u64)));
    }
    let not_yet = move |request: &Request| {
        let place = (request.file.clone(), request.range.map_or(0, |(first, _)| first as u64));
        let due_us = ends.iter().find(|(range, _)| *range == place).map_or(0, |(_, due_us)| *due_us);
        let is_early = now_us() < start.load(Ordering::SeqCst).saturating_add(due_us);
        if due_us > 0 && is_early { Answer::Status(416) } else { Answer::Well }
    };
    let server = Server::start(files, not_yet);
    let first_us = ladder.gops()[0].duration_us();
    let live =
        Live { available_us: first_us as i64, target_us: first_us, slowest_milli: 950, fastest_milli: 1050 };
    let mut options = Options { real_time: true, ..options() };
    options.settings.live = Some(live);
    let mut client = Client::open(&server.url, options).unwrap();
    begun_us.store(now_us(), Ordering::SeqCst);
    client.play(Layered::default(), &mut |gop: &PlayedGop<'_>| check(&stream, gop)).unwrap()
}

#[test]
fn clocks_of_live_servers_may_be_late_and_slow() {
    let cases = [(0, 0), (300, 0), (0, 25)];
    std::thread::scope(|scope| {
        for (late_ms, slower) in cases {
            scope.spawn(move || {
                let outcome = play_live(Duration::from_millis(late_ms), slower);
                assert!(outcome.report.complete, "{late_ms} ms, {slower} %");
                assert_eq!(named(&outcome), Vec::<String>::new());
                let failures: u64 = outcome.gops.iter().map(|gop| gop.failures).sum();
                assert_eq!(failures > 0, late_ms + slower > 0, "{late_ms} ms, {slower} %");
                let latencies: Vec<u64> =
                    outcome.report.shown.iter().filter_map(|shown| shown.latency_us).collect();
                // A GOP, how late it is, and the time until it is asked for again.
                assert!(latencies.iter().all(|us| (1_000_000..2_200_000).contains(us)), "{latencies:?}");
            });
        }
    });
}
