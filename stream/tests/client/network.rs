//! Playback from this project's server over bad networks, and through its restart.

use super::common::files;
use super::{Layered, Layout, Outcome, PlayedGop, check, frame_lasts, mixed, named, options};
use crate::common::package;
use splatstream_stream::client::{Client, Loss, Options};
use splatstream_stream::package::{Options as Packaging, Package};
use splatstream_stream::server::{Network, Server, Settings, Statistics, Stopper};
use std::fs;
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A server in a thread of its own, which ends with the value.
struct Running {
    address: SocketAddr,
    stopper: Stopper,
    thread: Option<JoinHandle<Statistics>>,
}

impl Running {
    /// Serves a folder, at an address with port 0 at any free one.
    fn start(folder: &Path, address: SocketAddr, network: Network) -> Self {
        let mut settings = Settings::new(folder);
        (settings.address, settings.network) = (address, network);
        let server = Server::bind(&settings, |_| ()).unwrap();
        let (address, stopper) = (server.address(), server.stopper());
        Self { address, stopper, thread: Some(std::thread::spawn(|| server.run())) }
    }

    fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Stops it, in the middle of its answers.
    fn stop(mut self) -> Statistics {
        self.end();
        self.thread.take().unwrap().join().unwrap()
    }

    fn end(&self) {
        self.stopper.stop();
        self.stopper.stop();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.end();
    }
}

fn anywhere() -> SocketAddr {
    ([127, 0, 0, 1], 0).into()
}

/// A folder with the package of a stream, in which a frame lasts some milliseconds.
fn folder(stream: &[u8], frame_ms: u32) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut package = package(stream, &Packaging { layout: Layout::Gop, ..Packaging::default() });
    for (name, bytes) in files(&package) {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    frame_lasts(&mut package.manifest, frame_ms);
    fs::write(folder.path().join(Package::MANIFEST), package.manifest.to_json()).unwrap();
    folder
}

/// Plays by our rule; every frame is checked.
fn play(url: &str, stream: &[u8], options: Options, mut each: impl FnMut(&PlayedGop<'_>)) -> Outcome {
    let mut client = Client::open(url, options).unwrap();
    let screen = &mut |gop: &PlayedGop<'_>| {
        check(stream, gop);
        each(gop);
    };
    client.play(Layered::default(), screen).unwrap()
}

fn is_base(loss: &&Loss) -> bool {
    (loss.representation.as_str(), loss.refinement) == ("s0", 0)
}

#[test]
fn faults_of_the_network_are_outlasted_or_named() {
    let (stream, mut lost) = (mixed(), 0);
    for seed in 0..6 {
        let folder = folder(&stream, 1000);
        let network = Network { drop_share: 0.25, fail_share: 0.15, seed, ..Network::default() };
        let server = Running::start(folder.path(), anywhere(), network);
        // Nothing is slow here but a machine that has other work.
        let options = Options { real_time: false, ..Options::default() };
        let outcome = play(&server.url(), &stream, options, |_| ());
        for loss in &outcome.losses {
            assert!(loss.reason.contains("503") || loss.reason.contains("ends"), "{loss:?}");
        }
        let shown = outcome.gops.iter().filter(|gop| gop.shown.is_some()).count();
        let bases =
            outcome.losses.iter().filter(|loss| (loss.representation.as_str(), loss.refinement) == ("s0", 0));
        assert_eq!(shown + bases.count(), outcome.gops.len(), "{:?}", named(&outcome));
        let failures: u64 = outcome.gops.iter().map(|gop| gop.failures).sum();
        let statistics = server.stop();
        // The manifest may have failed too.
        assert!(failures <= statistics.server_errors + statistics.incomplete);
        lost += failures;
    }
    assert!(lost > 0);
}

/// Takes the next connection to an address, and closes it: so one request fails, however slow the machine is.
fn hang_up_once(address: SocketAddr) {
    let listener = TcpListener::bind(address).unwrap();
    listener.set_nonblocking(true).unwrap();
    let begin = Instant::now();
    while listener.accept().is_err() && begin.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_server_that_is_started_again_is_found_again() {
    let stream = mixed();
    let folder = folder(&stream, 150);
    let server = Running::start(folder.path(), anywhere(), Network::default());
    let (address, url) = (server.address, server.url());
    let mut running = Some(server);
    let mut options = Options { real_time: true, ..options() };
    // So little is buffered that most is fetched later.
    options.settings.buffer_us = 600_000;
    let mut restart = None;
    let outcome = play(&url, &stream, options, |gop| {
        if gop.number != 0 {
            return;
        }
        running.take().unwrap().stop();
        let folder = folder.path().to_owned();
        restart = Some(std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(500));
            hang_up_once(address);
            Running::start(&folder, address, Network::default())
        }));
    });
    drop(restart.unwrap().join().unwrap());
    assert!(outcome.report.complete, "{:?}", named(&outcome));
    assert!(outcome.gops.iter().any(|gop| gop.failures > 0));
    // What improves a GOP is given up sooner than its base.
    assert_eq!(outcome.losses.iter().find(is_base), None);
}
