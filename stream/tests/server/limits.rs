//! What one client may cost, and how a server ends.

use super::client::{Client, get};
use super::{Running, bytes, folder};
use std::fs;
use std::net::TcpStream;
use std::thread::sleep;
use std::time::{Duration, Instant};

#[test]
fn slow_headers_end_with_the_connection() {
    let folder = folder();
    let server = Running::start(folder.path(), |settings| {
        settings.limits.first_request = Duration::from_millis(300);
        settings.limits.idle = Duration::from_millis(300);
    });
    let begun = Instant::now();
    // Nothing at all, a header that never ends, and one after a request that was answered.
    let mut silent = Client::connect(server.address);
    let mut slow = Client::connect(server.address);
    let mut later = Client::connect(server.address);
    slow.write(b"GET / HTTP/1.1\r\n").unwrap();
    assert_eq!(later.ask("GET", "/", &[]).unwrap().status, 200);
    later.write(b"GET / HTTP/1.1\r\n").unwrap();
    for _ in 0..100 {
        let closed = [&mut slow, &mut later].map(|client| client.write(b"X: y\r\n").is_err());
        if closed == [true; 2] {
            break;
        }
        sleep(Duration::from_millis(20));
    }
    for client in [&mut silent, &mut slow, &mut later] {
        assert!(client.rest().is_empty());
    }
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
    assert_eq!(server.stop().0.timed_out, 3);
}

#[test]
fn a_client_that_takes_nothing_is_let_go() {
    let folder = folder();
    fs::write(folder.path().join("long.mp4"), bytes(64 << 20)).unwrap();
    let server =
        Running::start(folder.path(), |settings| settings.limits.stalled = Duration::from_millis(300));
    let mut client = Client::connect(server.address);
    client.send("GET", "/long.mp4", &[]).unwrap();
    let (_, length) = client.head().unwrap();
    sleep(Duration::from_secs(1));
    assert!(client.rest().len() < length);
    let (statistics, entries) = server.stop();
    assert_eq!((statistics.timed_out, statistics.incomplete), (1, 1));
    assert!(!entries[0].complete && entries[0].bytes < 64 << 20);
}

#[test]
fn large_headers_are_refused() {
    let folder = folder();
    let server = Running::start(folder.path(), |_| ());
    for headers in [vec![format!("X: {}", "y".repeat(1 << 20))], vec!["X: y".to_owned(); 100_000]] {
        let mut client = Client::connect(server.address);
        let headers: Vec<&str> = headers.iter().map(String::as_str).collect();
        // The server may have closed the connection before all is sent, and with it what it answered.
        let sent = client.send("GET", "/", &headers);
        match client.head() {
            Ok((reply, _)) => assert_eq!(reply.status, 431),
            Err(_) => assert!(sent.is_err() || client.rest().is_empty()),
        }
    }
    let mut client = Client::connect(server.address);
    client.send("GET", "/", &[&format!("X: {}", "y".repeat(20 << 10))]).unwrap();
    assert_eq!(client.head().unwrap().0.status, 431);
    assert_eq!(get(server.address, &format!("/{}", "a".repeat(10_000)), &[]).status, 404);
}

#[test]
fn connections_and_requests_are_counted() {
    let folder = folder();
    let server = Running::start(folder.path(), |settings| {
        settings.limits.connections = 2;
        settings.limits.requests = 1;
        settings.network.latency = Duration::from_millis(300);
    });
    let mut first = Client::connect(server.address);
    let mut second = Client::connect(server.address);
    first.send("GET", "/talk.gss", &[]).unwrap();
    sleep(Duration::from_millis(100));
    let reply = second.ask("GET", "/talk.gss", &[]).unwrap();
    assert_eq!((reply.status, reply.header("retry-after")), (503, "1"));
    assert_eq!(first.receive("GET").unwrap().status, 200);
    // A third one waits for its turn.
    let address = server.address;
    let third = std::thread::spawn(move || get(address, "/talk.gss", &[]).status);
    sleep(Duration::from_millis(500));
    assert!(!third.is_finished());
    drop(first);
    assert_eq!(third.join().unwrap(), 200);
    assert_eq!(server.stop().0.peak_connections, 2);
}

#[test]
fn a_server_that_stops_ends_its_answers_first() {
    let folder = folder();
    let server = Running::start(folder.path(), |settings| {
        settings.network.bandwidth = Some(splatstream_stream::simulation::Trace::constant(8_000_000));
    });
    // Half a second of it.
    let mut client = Client::connect(server.address);
    let mut idle = Client::connect(server.address);
    assert_eq!(idle.ask("GET", "/talk/s0-1.m4s", &[]).unwrap().status, 200);
    client.send("GET", "/talk/s0.mp4", &["Range: bytes=0-499999"]).unwrap();
    sleep(Duration::from_millis(150));
    server.stopper.stop();
    sleep(Duration::from_millis(50));
    assert!(TcpStream::connect(server.address).is_err(), "nobody is let in");
    assert!(idle.rest().is_empty());
    let reply = client.receive("GET").unwrap();
    assert!(reply.is_whole && reply.body == bytes(500_000));
    let mut server = server;
    let statistics = server.thread.take().unwrap().join().unwrap();
    assert_eq!((statistics.requests, statistics.incomplete, statistics.successful), (2, 0, 2));
}

#[test]
fn the_time_of_the_end_is_limited() {
    let folder = folder();
    let slow = |settings: &mut splatstream_stream::server::Settings| {
        settings.network.bandwidth = Some(splatstream_stream::simulation::Trace::constant(800_000));
        settings.limits.shutdown = Duration::from_millis(200);
    };
    for calls in [1, 2] {
        let server = Running::start(folder.path(), slow);
        let mut client = Client::connect(server.address);
        client.send("GET", "/talk/s0.mp4", &[]).unwrap();
        client.head().unwrap();
        let begun = Instant::now();
        (1..calls).for_each(|_| server.stopper.stop());
        let (statistics, _) = server.stop();
        assert!(begun.elapsed() < Duration::from_secs(2), "{:?}", begun.elapsed());
        assert_eq!((statistics.requests, statistics.incomplete), (1, 1));
    }
}
