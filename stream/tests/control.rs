//! Properties that the rules keep on any network.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test that panics has failed")]

use proptest::prelude::*;
use splatstream_stream::control::{
    Bola, BufferRule, Decision, Description, Ladder, Layered, Levels, Limits, Live, Playback, Rule, Session,
    Settings, Single, SingleRule, State, ThroughputRule,
};
use splatstream_stream::simulation::{Link, Report, Trace, ladders, simulate};

/// Plays with the defaults.
fn play(ladder: &Ladder, rule: impl Rule, trace: Trace) -> Report {
    simulate(ladder, &Settings::default(), rule, &Link::new(trace))
}

/// Every rule, by number.
fn rule(number: usize) -> Box<dyn Rule> {
    let single: Box<dyn SingleRule> = match number {
        0 => return Box::new(Layered::default()),
        1 => Box::new(ThroughputRule),
        2 => Box::new(BufferRule),
        _ => Box::new(Bola::default()),
    };
    if number.is_multiple_of(2) { Box::new(Single::whole(single)) } else { Box::new(Single::partial(single)) }
}

/// Steps of up to 20 s and 40 Mbit/s, of which some are outages, and at least one is not.
fn traces() -> impl Strategy<Value = Trace> {
    let step =
        (50_000_u64..20_000_000, prop_oneof![Just(0), 100_000_u64..3_000_000, 1_000_000_u64..40_000_000]);
    prop::collection::vec(step, 1..12).prop_map(|mut steps| {
        steps.push((5_000_000, 2_000_000));
        Trace::new(&steps).unwrap()
    })
}

/// Replays the requests of a playback: each piece must come after those that it needs.
fn follows_dependencies(ladder: &Ladder, report: &Report) {
    let representations = ladder.representations();
    let mut asked: Vec<Levels> = vec![Levels::none(representations.len()); ladder.gops().len()];
    for (_, fetch) in &report.fetches {
        let known = &mut asked[fetch.gop()];
        for range in fetch.ranges() {
            // A request that was given up is asked for again from where it broke off.
            assert!(range.from <= known.of(range.representation), "a refinement is left out");
            for need in &representations[range.representation].needs {
                let last = u8::try_from(ladder.gops()[fetch.gop()].pieces(*need).len()).unwrap();
                assert!(known.of(*need) >= range.to.min(last), "what a piece needs comes later");
            }
            known.raise(range.representation, range.to);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn playback_ends_and_follows_dependencies(trace in traces(), number in 0_usize..5, losses in prop::collection::vec(1_u64..60_000_000, 0..6)) {
        let ladder = ladders::small(25);
        let mut losses_us = losses;
        losses_us.sort_unstable();
        let link = Link { losses_us, ..Link::new(trace) };
        let report = simulate(&ladder, &Settings::default(), rule(number), &link);
        prop_assert!(report.complete);
        prop_assert_eq!(report.shown.len(), 25);
        follows_dependencies(&ladder, &report);
    }

    #[test]
    fn playback_is_reproducible(trace in traces(), number in 0_usize..5) {
        let ladder = ladders::small(20);
        prop_assert_eq!(play(&ladder, rule(number), trace.clone()), play(&ladder, rule(number), trace));
    }

    #[test]
    fn what_is_carried_and_when_agree(trace in traces(), at in 0_u64..200_000_000, bits in 1_u128..1_000_000_000) {
        let carried = trace.carried(at);
        let until = trace.time_of(carried + bits * 1_000_000).unwrap();
        prop_assert!(trace.carried(until) >= carried + bits * 1_000_000);
        prop_assert!(trace.carried(until - 1) < carried + bits * 1_000_000);
    }

    #[test]
    fn steady_networks_give_steady_pictures(rate in 400_000_u64..30_000_000) {
        let ladder = steady(120);
        let report = play(&ladder, Layered::default(), Trace::constant(rate));
        prop_assert_eq!(report.stalled_us(), 0);
        // After the buffer is filled, at most one change in twenty seconds.
        let late: Vec<_> = report.shown.iter().skip(40).take(60).collect();
        let changes = late.windows(2).filter(|pair| pair[0].point != pair[1].point).count();
        prop_assert!(changes <= 3, "{} changes", changes);
    }

    #[test]
    fn no_stalls_where_the_base_fits(seed in 0_u64..1000, steps in prop::collection::vec((200_000_u64..4_000_000, 0_u64..20_000_000), 4..20)) {
        // The base needs about 270 kbit/s: twice that always passes, whatever else comes and goes.
        let ladder = ladders::small(60);
        let steps: Vec<(u64, u64)> = steps.iter().map(|&(time, rate)| (time, 600_000 + rate * (seed % 3) / 2)).collect();
        let report = play(&ladder, Layered::default(), Trace::new(&steps).unwrap());
        prop_assert_eq!(report.stalled_us(), 0);
    }

    #[test]
    fn devices_are_not_asked_for_more_than_they_can(gaussians in 1_u64..80_000, rate in 1_u64..3_000_000) {
        let ladder = ladders::small(30);
        let limits = Limits { gaussians, gaussians_per_second: rate };
        let settings = Settings { limits, ..Settings::default() };
        let report = simulate(&ladder, &settings, Layered::default(), &Link::new(Trace::constant(100_000_000)));
        for shown in &report.shown {
            let gop = &ladder.gops()[shown.gop];
            let point = gop.points().iter().find(|point| point.name == shown.point).unwrap();
            prop_assert!(limits.allow(point, gop) || point == &gop.points()[0]);
        }
    }
}

/// A presentation whose GOPs are all alike.
fn steady(gops: usize) -> Ladder {
    let first = ladders::small(1);
    let mut ladder = Ladder::new(first.representations().to_vec()).unwrap();
    let gop = &first.gops()[0];
    for _ in 0..gops {
        let pieces = (0..first.representations().len()).map(|index| gop.pieces(index).to_vec()).collect();
        let quality = gop.points().iter().map(|point| (point.name, point.quality)).collect();
        let frames = vec![1, 0, 14, 15];
        let description = Description { duration_us: 1_000_000, frames, pieces, quality };
        ladder.push(description).unwrap();
    }
    ladder
}

#[test]
fn a_minute_without_network_is_one_stall_and_nothing_more() {
    let ladder = ladders::small(90);
    let steps = [(20_000_000, 10_000_000), (60_000_000, 0), (60_000_000, 10_000_000)];
    for number in 0..5 {
        let report = play(&ladder, rule(number), Trace::new(&steps).unwrap());
        assert!(report.complete, "rule {number}");
        let stalls = report.shown.iter().skip(1).filter(|shown| shown.waited_us > 0).count();
        assert_eq!(stalls, 1, "rule {number}");
        // The outage, less what was buffered, and the latency of one request at most.
        assert!(
            (35_000_000..60_000_000).contains(&report.stalled_us()),
            "rule {number}: {}",
            report.stalled_us()
        );
        assert!(report.decisions < 20_000, "rule {number}: {}", report.decisions);
    }
}

#[test]
fn a_whole_gop_is_played_when_a_request_for_more_of_it_fails() {
    // The rule gives the last GOP up in an outage, with its base there, and asks for a little more. That request fails when
    // the GOP is due: nothing else arrives that playback could go on with.
    let trace = Trace::new(&[
        (1_067_148, 8_290_264),
        (10_464_574, 25_290_626),
        (15_504_235, 0),
        (5_000_000, 2_000_000),
    ]);
    let link = Link { losses_us: vec![24_080_737], ..Link::new(trace.unwrap()) };
    let report = simulate(&ladders::small(25), &Settings::default(), Single::whole(Bola::default()), &link);
    assert!(report.complete && report.abandoned == 1);
    assert_eq!((report.shown.len(), report.stalled_us()), (25, 0));
}

#[test]
fn a_network_that_carries_nothing_ends_at_the_limit() {
    let ladder = ladders::small(5);
    let link = Link { limit_us: 120_000_000, ..Link::new(Trace::constant(0)) };
    let report = simulate(&ladder, &Settings::default(), Layered::default(), &link);
    assert!(!report.complete && report.shown.is_empty());
    assert_eq!((report.ended_us, report.startup_us(), report.bytes), (120_000_000, 120_000_000, 0));
}

#[test]
fn a_request_gives_way_to_the_next_base() {
    // The network falls to a fiftieth while a large GOP is being fetched.
    let ladder = ladders::small(60);
    let trace = Trace::new(&[(3_000_000, 30_000_000), (200_000_000, 600_000)]).unwrap();
    let report = play(&ladder, Layered::default(), trace);
    assert_eq!(report.stalled_us(), 0);
    assert!(report.abandoned > 0);
}

/// Fetches all of GOP 0, then all of GOP 1 and so on, and gives up what is too late.
struct Greedy;

impl Rule for Greedy {
    fn decide(&mut self, state: &State) -> Decision {
        if let Some(request) = state.request() {
            if request.fetch.gop() < state.first_open() {
                return Decision::Abandon;
            }
            return Decision::Wait { until_us: state.now_us() + 100_000 };
        }
        let next = (state.first_open()..state.ladder().gops().len()).find_map(|gop| {
            let all = state.ladder().gops()[gop].points().last()?.levels.clone();
            splatstream_stream::control::Fetch::towards(state, gop, &all)
        });
        next.map_or(Decision::Wait { until_us: state.now_us() + 100_000 }, Decision::Fetch)
    }
}

#[test]
fn what_has_arrived_of_a_gop_is_played() {
    // 5 Mbit/s carry a fifth of each GOP in its time.
    let ladder = ladders::small(20);
    let report = play(&ladder, Greedy, Trace::constant(5_000_000));
    assert!(report.complete && report.abandoned > 0);
    let best = ladder.gops()[9].points().last().unwrap();
    assert!(report.shown.iter().any(|shown| shown.point != best.name && shown.quality > 20.0));
}

/// Plays in steps of 10 ms against an endless network, and gives the latency at the end.
fn live_latency(target_us: u64, seconds: u64) -> (u64, u32) {
    let live = Live { available_us: 1_000_000, target_us, slowest_milli: 950, fastest_milli: 1050 };
    let settings = Settings { live: Some(live), ..Settings::default() };
    let mut session = Session::new(ladders::small(200), settings, Layered::default(), 6_000_000);
    let mut arrives = None;
    let mut fastest = 0;
    for step in 0..seconds * 100 {
        let now_us = 6_000_000 + step * 10_000;
        if let Some((at, bytes)) = arrives
            && at <= now_us
        {
            session.received(now_us, bytes);
            arrives = None;
        }
        for _ in 0..8 {
            match session.decide(now_us) {
                Decision::Fetch(fetch) => {
                    assert!(
                        session.state().available_us(fetch.gop()) <= now_us,
                        "a GOP is fetched before it is there"
                    );
                    session.received(now_us, 0);
                    arrives = Some((now_us + 50_000, fetch.bytes()));
                }
                Decision::Abandon => arrives = None,
                Decision::Rate { milli } => {
                    assert!((950..=1050).contains(&milli));
                    fastest = fastest.max(milli);
                }
                Decision::Wait { .. } => break,
            }
        }
    }
    assert_eq!(session.state().playback(), Playback::Playing);
    (session.state().latency_us().unwrap(), fastest)
}

#[test]
fn live_playback_comes_to_the_latency_that_is_aimed_at() {
    let (latency_us, fastest) = live_latency(2_500_000, 120);
    assert!((2_300_000..2_800_000).contains(&latency_us), "{latency_us}");
    assert_eq!(fastest, 1050);
    let (latency_us, _) = live_latency(8_000_000, 120);
    assert!((7_700_000..8_200_000).contains(&latency_us), "{latency_us}");
}

#[test]
fn a_growing_presentation_is_played_as_it_grows() {
    let whole = ladders::small(6);
    let mut session = Session::new(
        Ladder::new(whole.representations().to_vec()).unwrap(),
        Settings::default(),
        Layered::default(),
        0,
    );
    assert!(matches!(session.decide(0), Decision::Wait { .. }), "there is nothing to fetch");
    for (index, gop) in whole.gops().iter().enumerate() {
        let now_us = 1_000_000 * (index as u64 + 1);
        let pieces = (0..whole.representations().len()).map(|index| gop.pieces(index).to_vec()).collect();
        let frames = vec![1, 0, 14, 15];
        let description = Description { duration_us: gop.duration_us(), frames, pieces, quality: vec![] };
        session.push(now_us, description).unwrap();
        let mut requests = 0;
        while let Decision::Fetch(fetch) = session.decide(now_us) {
            assert_eq!(fetch.gop(), index);
            session.received(now_us, 0);
            session.received(now_us + 20_000, fetch.bytes());
            requests += 1;
            assert!(requests < 20, "a GOP is fetched without end");
        }
        assert_eq!(session.state().shown().len(), index + 1);
    }
    session.decide(7_500_000);
    assert_eq!(session.state().playback(), Playback::Ended);
}

/// Plays with a session whose requests are answered at once by `serve`: bytes that arrive, or none for a failure.
fn serve_all(
    session: &mut Session<Box<dyn Rule>>,
    seconds: u64,
    mut serve: impl FnMut(&mut Session<Box<dyn Rule>>, u64),
) {
    for now_us in (0..seconds * 1_000_000).step_by(10_000) {
        for _ in 0..8 {
            match session.decide(now_us) {
                Decision::Fetch(_) => serve(session, now_us),
                Decision::Wait { .. } => break,
                Decision::Abandon | Decision::Rate { .. } => {}
            }
        }
    }
}

#[test]
fn a_server_that_fails_is_asked_less_and_less_often() {
    for number in 0..5 {
        let mut session = Session::new(ladders::small(5), Settings::default(), rule(number), 0);
        let mut requests = Vec::new();
        serve_all(&mut session, 30, |session, now_us| {
            requests.push(now_us);
            session.failed(now_us);
        });
        assert!((8..16).contains(&requests.len()), "rule {number}: {} requests", requests.len());
        assert!(requests.windows(2).all(|pair| pair[1] - pair[0] >= 100_000));
    }
}

#[test]
fn playback_goes_on_without_pieces_that_cannot_be_had() {
    for number in 0..5 {
        let ladder = ladders::small(12);
        let mut session = Session::new(ladder.clone(), Settings::default(), rule(number), 0);
        // P frames of GOP 4 end after two refinements; GOP 7 has no base.
        session.unavailable(0, 4, 2, 2);
        session.unavailable(0, 7, 0, 0);
        serve_all(&mut session, 20, |session, now_us| {
            let request = session.state().request().unwrap();
            assert_ne!(request.fetch.gop(), 7);
            assert!(
                request.fetch.gop() != 4
                    || request.fetch.ranges().iter().all(|range| range.representation != 2 || range.to <= 2)
            );
            let bytes = request.fetch.bytes();
            session.received(now_us, 0);
            session.received(now_us + 1000, bytes);
        });
        let state = session.state();
        assert_eq!(state.playback(), Playback::Ended, "rule {number}");
        let shown: Vec<usize> = state.shown().iter().map(|shown| shown.gop).collect();
        assert_eq!(shown, [0, 1, 2, 3, 4, 5, 6, 8, 9, 10, 11], "rule {number}");
        assert!(state.is_lost(7) && !state.is_lost(4));
        assert!(state.shown().iter().skip(1).all(|shown| shown.waited_us == 0));
    }
}

#[test]
fn what_arrives_damaged_is_fetched_again() {
    let mut session = Session::new(ladders::small(8), Settings::default(), rule(0), 0);
    let mut bases = 0;
    serve_all(&mut session, 20, |session, now_us| {
        let fetch = session.state().request().unwrap().fetch.clone();
        session.received(now_us, 0);
        session.received(now_us + 1000, fetch.bytes());
        if fetch.gop() == 5 && fetch.ranges()[0].offset == 0 && fetch.ranges()[0].representation == 0 {
            bases += 1;
            if bases == 1 {
                session.damaged(now_us + 1000, 5, 0, 0);
            }
        }
    });
    assert_eq!((bases, session.state().shown().len()), (2, 8));
}

#[test]
fn a_playback_is_the_same_on_every_machine() {
    let steps: Vec<(u64, u64)> =
        (1..40_u64).map(|n| (300_000 + n * 70_001 % 900_000, n * 3_700_003 % 25_000_000)).collect();
    let report = play(&ladders::small(100), Layered::default(), Trace::new(&steps).unwrap());
    let quality: f64 = report.shown.iter().map(|shown| shown.quality).sum();
    let seen = (report.requests, report.bytes, report.ended_us, quality.to_bits());
    assert_eq!(seen, (150, 133_531_625, 100_218_870, 4_659_192_726_289_317_297));
}
