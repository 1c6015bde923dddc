//! Many clients at once.

use super::client::Client;
use super::{MACHINE, Running, bytes, folder};
use std::thread;
use std::time::{Duration, Instant};

#[test]
fn two_hundred_clients_are_served_without_an_error() {
    let _alone = MACHINE.lock();
    let folder = folder();
    let server = Running::start(folder.path(), |_| ());
    let (address, whole) = (server.address, bytes(1_000_000));
    let end = Instant::now() + Duration::from_secs(2);
    let requests: u64 = thread::scope(|scope| {
        let clients: Vec<_> = (0..200_usize)
            .map(|number| {
                let whole = &whole;
                scope.spawn(move || {
                    let mut client = Client::connect(address);
                    let mut requests = 0;
                    while Instant::now() < end {
                        let first = (number * 4_000 + requests * 7_919) % 900_000;
                        let range = format!("Range: bytes={first}-{}", first + 50_000);
                        let reply = client.ask("GET", "/talk/s0.mp4", &[&range]).unwrap();
                        assert!(reply.status == 206 && reply.body == whole[first..=first + 50_000]);
                        requests += 1;
                    }
                    requests as u64
                })
            })
            .collect();
        clients.into_iter().map(|client| client.join().unwrap()).sum()
    });
    let (statistics, _) = server.stop();
    assert_eq!((statistics.requests, statistics.successful, statistics.incomplete), (requests, requests, 0));
    assert_eq!((statistics.peak_connections, statistics.timed_out), (200, 0));
    assert_eq!(statistics.bytes, requests * 50_001);
}
