//! No description, weight or order of events makes a session panic or a rule ask for what is not there.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a test that panics has failed")]

use proptest::prelude::*;
use splatstream_stream::control::{
    Bola, BufferRule, Decision, Description, Ladder, Layer, Layered, Limits, Live, OperatingPoint, Piece,
    Representation, Rule, Session, Settings, Single, ThroughputRule, Weights,
};

fn representations() -> Vec<Representation> {
    let needs = [vec![], vec![0], vec![0, 1], vec![0, 2]];
    let layers = [Layer::Spatial(0), Layer::Spatial(1), Layer::Temporal(0), Layer::Temporal(1)];
    layers.into_iter().zip(needs).map(|(layer, needs)| Representation { layer, needs }).collect()
}

/// Any number, and often a small or the largest one.
fn number() -> impl Strategy<Value = u64> {
    prop_oneof![0_u64..5, 0_u64..10_000_000, any::<u64>(), Just(u64::MAX)]
}

/// Any float, and often an ordinary one.
fn float() -> impl Strategy<Value = f64> {
    prop_oneof![-10.0_f64..50.0, any::<f64>()]
}

fn description() -> impl Strategy<Value = Description> {
    let piece = (number(), number()).prop_map(|(bytes, gaussians)| Piece { bytes, gaussians });
    let pieces = prop::collection::vec(prop::collection::vec(piece, 0..4), 4);
    let point = (0_u8..3, prop::option::of(0_u8..3), 0_u8..4, float()).prop_map(
        |(spatial, temporal, refinement, quality)| {
            (OperatingPoint { spatial, temporal, refinement }, quality)
        },
    );
    (number(), prop::collection::vec(any::<u32>(), 4), pieces, prop::collection::vec(point, 0..20)).prop_map(
        |(duration_us, frames, pieces, quality)| Description { duration_us, frames, pieces, quality },
    )
}

fn settings() -> impl Strategy<Value = Settings> {
    let live = prop::option::of((any::<i64>(), number(), any::<u32>(), any::<u32>()));
    (number(), number(), number(), number(), live).prop_map(|(buffer_us, start_us, gaussians, rate, live)| {
        Settings {
            buffer_us,
            start_us,
            limits: Limits { gaussians, gaussians_per_second: rate },
            live: live.map(|(available_us, target_us, slowest_milli, fastest_milli)| Live {
                available_us,
                target_us,
                slowest_milli,
                fastest_milli,
            }),
        }
    })
}

fn weights() -> impl Strategy<Value = Weights> {
    (0_usize..20, prop::array::uniform8(float())).prop_map(|(horizon, f)| Weights {
        horizon,
        stall: f[0],
        change: f[1],
        price: f[2],
        fear: f[3],
        memory: f[4],
        upgrade: f[5],
        haste: f[6],
        first_guess: f[7],
    })
}

fn rule(number: usize, weights: Weights) -> Box<dyn Rule> {
    match number {
        0 => Box::new(Layered::new(weights)),
        1 => Box::new(Single::whole(ThroughputRule)),
        2 => Box::new(Single::partial(BufferRule)),
        3 => Box::new(Single::whole(Bola::default())),
        _ => Box::new(Layered::default()),
    }
}

#[derive(Clone, Debug)]
enum Event {
    Decide,
    Received(u64),
    Failed,
    Unavailable(usize, usize, u8),
    Damaged(usize, usize, u8),
    Push(Description),
    Set(Settings),
    Skip(usize, usize),
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        4 => Just(Event::Decide),
        3 => number().prop_map(Event::Received),
        1 => Just(Event::Failed),
        1 => (0_usize..12, 0_usize..6, any::<u8>()).prop_map(|(gop, index, from)| Event::Unavailable(gop, index, from)),
        1 => (0_usize..12, 0_usize..6, any::<u8>()).prop_map(|(gop, index, from)| Event::Damaged(gop, index, from)),
        1 => description().prop_map(Event::Push),
        1 => settings().prop_map(Event::Set),
        1 => (0_usize..12, 0_usize..12).prop_map(|(from, to)| Event::Skip(from, to)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn sessions_take_any_events(
        gops in prop::collection::vec(description(), 0..10),
        settings in settings(),
        weights in weights(),
        kind in 0_usize..5,
        events in prop::collection::vec((prop_oneof![0_u64..3_000_000, number()], event()), 0..60),
    ) {
        let mut ladder = Ladder::new(representations()).unwrap();
        for gop in gops {
            let _ = ladder.push(gop);
        }
        let mut session = Session::new(ladder, settings, rule(kind, weights), 0);
        let mut now_us = 0_u64;
        for (passed, event) in events {
            now_us = now_us.saturating_add(passed);
            match event {
                Event::Decide => {
                    if let Decision::Fetch(fetch) = session.decide(now_us) {
                        prop_assert!(fetch.gop() < session.state().ladder().gops().len());
                        prop_assert!(fetch.gop() >= session.state().first_open());
                    }
                }
                Event::Received(bytes) => session.received(now_us, bytes),
                Event::Failed => session.failed(now_us),
                Event::Unavailable(gop, index, from) => session.unavailable(now_us, gop, index, from),
                Event::Damaged(gop, index, from) => session.damaged(now_us, gop, index, from),
                Event::Set(settings) => session.set(now_us, settings),
                Event::Skip(from, to) => {
                    let _ = session.skip(now_us, from..to);
                }
                Event::Push(description) => {
                    let _ = session.push(now_us, description);
                }
            }
        }
    }
}
