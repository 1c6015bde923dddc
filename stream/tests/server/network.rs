//! Networks for tests.

use super::client::{Client, ask, get};
use super::{MACHINE, Running, bytes, folder};
use splatstream_stream::server::{Network, Server, ServerError, Settings};
use splatstream_stream::simulation::Trace;
use std::time::{Duration, Instant};

/// How long four clients take that share a link, as a multiple of what the trace says.
fn time_on(trace: &Trace) -> f64 {
    let folder = folder();
    let server = Running::start(folder.path(), |settings| settings.network.bandwidth = Some(trace.clone()));
    let begun = Instant::now();
    let address = server.address;
    let clients: Vec<_> = (0..4)
        .map(|_| std::thread::spawn(move || get(address, "/talk/s0.mp4", &["Range: bytes=0-899999"])))
        .collect();
    for client in clients {
        let reply = client.join().unwrap();
        assert!(reply.is_whole && reply.body == bytes(900_000));
    }
    let expected = trace.time_of(4 * 900_000 * 8_000_000).unwrap() as f64 / 1e6;
    begun.elapsed().as_secs_f64() / expected
}

#[test]
fn bytes_come_at_the_rate_of_the_trace() {
    let _alone = MACHINE.lock();
    // A mean of 16 Mbit/s; with a gap.
    let trace = Trace::parse("t_s,mbps\n0,30\n0.2,0\n0.3,10\n0.5,20\n").unwrap();
    // Other programs may keep the machine busy for a while; faster than the trace it never is.
    let times: Vec<f64> = (0..3).map(|_| time_on(&trace)).collect();
    assert!(times.iter().all(|time| *time > 0.95), "{times:?}");
    assert!(times.iter().any(|time| *time < 1.05), "{times:?}");
}

#[test]
fn a_link_that_carries_nothing_is_refused() {
    let folder = folder();
    let mut settings = Settings::new(folder.path());
    settings.network = Network { bandwidth: Some(Trace::constant(0)), ..Network::default() };
    assert!(matches!(Server::bind(&settings, |_| ()), Err(ServerError::Bandwidth)));
}

#[test]
fn answers_wait_for_the_latency() {
    let folder = folder();
    let server =
        Running::start(folder.path(), |settings| settings.network.latency = Duration::from_millis(100));
    let begun = Instant::now();
    let mut client = Client::connect(server.address);
    for _ in 0..3 {
        assert_eq!(client.ask("GET", "/talk.gss", &["Range: bytes=0-9"]).unwrap().status, 206);
    }
    let took = begun.elapsed();
    assert!(took >= Duration::from_millis(300) && took < Duration::from_millis(900), "{took:?}");
}

#[test]
fn faults_are_those_of_the_seed() {
    let folder = folder();
    let network = Network { drop_share: 0.3, fail_share: 0.2, seed: 5, ..Network::default() };
    let server = Running::start(folder.path(), |settings| settings.network = network.clone());
    let (mut failed, mut dropped) = (0, 0);
    for number in 0..60 {
        let (fails, drops) = (network.fails(number), network.drops_after(number, 5_000));
        let mut client = Client::connect(server.address);
        client.send("GET", "/talk.gss", &[]).unwrap();
        let reply = client.receive("GET").unwrap();
        assert_eq!(reply.status, if fails { 503 } else { 200 }, "{number}");
        let drops = drops.filter(|_| !fails);
        assert_eq!(reply.is_whole, drops.is_none(), "{number}");
        if let Some(arrived) = drops {
            assert_eq!(reply.body.len() as u64, arrived);
        }
        failed += u64::from(fails);
        dropped += u64::from(drops.is_some());
    }
    assert!(failed > 0 && dropped > 0);
    let (statistics, _) = server.stop();
    assert_eq!((statistics.server_errors, statistics.incomplete), (failed, dropped));
}

#[test]
fn nobody_waits_on_a_link_that_is_not_used() {
    let folder = folder();
    let trace = Trace::parse("t_s,mbps\n0,0\n3600,1\n").unwrap();
    let server = Running::start(folder.path(), |settings| settings.network.bandwidth = Some(trace));
    assert_eq!(ask(server.address, "HEAD", "/talk.gss", &[]).status, 200);
    assert_eq!(get(server.address, "/none", &[]).status, 404);
}
