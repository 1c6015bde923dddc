//! The start of playback, and what short presentations get of the time that they last.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test that panics has failed")]

use splatstream_stream::control::{
    Decision, Description, Ladder, Layered, Piece, Playback, Rule, Session, Settings,
};
use splatstream_stream::simulation::{Link, Report, Trace, ladders, simulate};

/// A presentation of GOPs of 0.267 s, each of which has from 1 to 60 kB.
fn short(gops: usize) -> Ladder {
    let model = ladders::small(gops);
    let mut ladder = Ladder::new(model.representations().to_vec()).unwrap();
    for gop in model.gops() {
        let small = |piece: &Piece| Piece { bytes: piece.bytes / 50, ..*piece };
        let pieces = (0..gop.representations()).map(|index| gop.pieces(index).iter().map(small).collect());
        let quality = gop.points().iter().map(|point| (point.name, point.quality)).collect();
        let (duration_us, frames) = (267_000, vec![1, 0, 3, 4]);
        ladder.push(Description { duration_us, frames, pieces: pieces.collect(), quality }).unwrap();
    }
    ladder
}

fn play(ladder: &Ladder, rate: u64) -> Report {
    simulate(ladder, &Settings::default(), Layered::default(), &Link::new(Trace::constant(rate)))
}

/// GOPs that were shown at their best point.
fn best_of(ladder: &Ladder, report: &Report) -> usize {
    let is_best = |shown: &&splatstream_stream::control::Shown| {
        let points = ladder.gops()[shown.gop].points();
        points.iter().all(|point| point.quality <= shown.quality)
    };
    report.shown.iter().filter(is_best).count()
}

#[test]
fn short_presentations_are_played_at_their_best_from_the_start_where_the_network_allows() {
    for gops in [1, 2, 4] {
        let ladder = short(gops);
        let report = play(&ladder, 35_000_000);
        assert_eq!(best_of(&ladder, &report), gops, "{:?}", report.shown);
        assert!(report.startup_us() < 500_000 && report.stalled_us() == 0, "{}", report.startup_us());
    }
}

#[test]
fn short_presentations_become_better_while_they_are_played() {
    // All of it takes longer than the start may wait.
    let ladder = short(12);
    let report = play(&ladder, 2_000_000);
    let (first, last) = (report.shown.first().unwrap(), report.shown.last().unwrap());
    assert!(report.startup_us() <= 1_200_000 && report.stalled_us() == 0);
    assert!(last.quality >= first.quality && last.quality > 30.0, "{:?}", report.shown);
}

#[test]
fn the_start_waits_for_nothing_where_the_base_alone_takes_a_second() {
    let ladder = short(4);
    let base = ladder.gops()[0].points()[0].bytes;
    let report = play(&ladder, base * 8);
    assert_eq!((report.shown[0].bytes, report.startup_us()), (base, 1_050_000));
}

#[test]
fn the_start_waits_for_a_second_at_most() {
    // What the first request measures holds no longer: the network falls to a thousandth.
    let ladder = short(4);
    let trace = Trace::new(&[(70_000, 35_000_000), (100_000_000, 35_000)]).unwrap();
    let report = simulate(&ladder, &Settings::default(), Layered::default(), &Link::new(trace));
    assert!((1_000_000..=1_100_000).contains(&report.startup_us()), "{}", report.startup_us());
}

#[test]
fn a_package_on_this_machine_is_played_at_its_best() {
    let ladder = ladders::small(30);
    let link = Link { latency_us: 100, ..Link::new(Trace::constant(2_000_000_000)) };
    let report = simulate(&ladder, &Settings::default(), Layered::local(), &link);
    assert_eq!((best_of(&ladder, &report), report.stalled_us()), (30, 0));
    assert_eq!(report.requests, 30);
}

/// Plays rounds with a viewer's playhead over a network of so many bytes per 10 ms; gives the qualities of each round, as they
/// were when each GOP ended, and what was fetched.
fn rounds(ladder: &Ladder, rate: u64, count: usize) -> (Vec<Vec<f64>>, u64) {
    let mut session = Session::new(ladder.clone(), Settings::default(), Layered::default(), 0).driven();
    session.go_to(0, 0);
    let (mut now_us, mut running) = (0, None);
    let (mut found, mut fetched) = (Vec::new(), 0);
    for _ in 0..count {
        let mut qualities = Vec::new();
        for gop in 0..ladder.gops().len() {
            session.go_to(now_us, gop);
            let mut played_us = 0;
            while played_us < ladder.gops()[gop].duration_us() {
                step(&mut session, now_us, rate, &mut running, &mut fetched);
                now_us += 10_000;
                played_us += if session.state().playback() == Playback::Playing { 10_000 } else { 0 };
                session.at(now_us, played_us);
            }
            qualities.push(session.state().shown().last().unwrap().quality);
        }
        found.push(qualities);
    }
    (found, fetched)
}

/// What a session does, and what arrives, at one time.
fn step<R: Rule>(session: &mut Session<R>, now_us: u64, rate: u64, running: &mut Option<u64>, all: &mut u64) {
    while let decision @ (Decision::Fetch(_) | Decision::Abandon) = session.decide(now_us) {
        *running = matches!(decision, Decision::Fetch(_)).then_some(0);
        session.received(now_us, 0);
    }
    let Some(request) = session.state().request() else { return };
    let bytes = (running.unwrap_or(0) + rate).min(request.fetch.bytes());
    *all += bytes - running.unwrap_or(0);
    *running = Some(bytes);
    session.received(now_us, bytes);
}

#[test]
fn a_second_round_is_played_at_its_best() {
    for gops in [1, 4, 20] {
        let ladder = short(gops);
        let best: Vec<f64> = ladder.gops().iter().map(|gop| gop.points().last().unwrap().quality).collect();
        // 4 Mbit/s: a GOP of 60 kB takes 0.12 s.
        let (played, fetched) = rounds(&ladder, 5000, 3);
        assert_eq!(played[1..], [best.clone(), best], "{gops} GOPs: {played:?}");
        // Nothing is fetched twice.
        let once: u64 = ladder.gops().iter().map(|gop| gop.points().last().unwrap().bytes).sum();
        assert_eq!(fetched, once);
    }
}
