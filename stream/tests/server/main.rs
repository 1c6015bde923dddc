//! The server, over real sockets.
#![cfg(feature = "server")]
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]
#![allow(clippy::print_stdout, reason = "it says what it skips")]

mod client;
mod crowd;
mod files;
mod hostile;
mod limits;
mod network;
mod nginx;
mod protocols;

use splatstream_stream::server::{Entry, Server, Settings, Statistics, Stopper};
use std::fs;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use tempfile::TempDir;

/// Held by tests that measure time, and by those that take the whole machine.
static MACHINE: Mutex<()> = Mutex::new(());

/// Bytes of which every four are different.
fn bytes(length: usize) -> Vec<u8> {
    (0_u32..).flat_map(|number| number.wrapping_mul(2_654_435_761).to_le_bytes()).take(length).collect()
}

/// A folder with a file of each kind.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("talk")).unwrap();
    fs::write(path.join("talk/s0.mp4"), bytes(1_000_000)).unwrap();
    fs::write(path.join("talk/s0-1.m4s"), bytes(1_000)).unwrap();
    fs::write(path.join("talk/s0-2.m4s"), bytes(1_000)).unwrap();
    fs::write(path.join("talk/manifest.mpd"), "<MPD/>").unwrap();
    fs::write(path.join("talk/manifest.json"), "{}").unwrap();
    fs::write(path.join("talk.gss"), bytes(5_000)).unwrap();
    fs::write(path.join("index.html"), "<!doctype html>").unwrap();
    fs::write(path.join("player.js"), "0").unwrap();
    fs::write(path.join("player.wasm"), "").unwrap();
    folder
}

/// A server in a thread of its own, which ends with the value.
struct Running {
    address: SocketAddr,
    entries: Arc<Mutex<Vec<Entry>>>,
    stopper: Stopper,
    thread: Option<JoinHandle<Statistics>>,
}

impl Running {
    fn start(folder: &Path, change: impl FnOnce(&mut Settings)) -> Self {
        let mut settings = Settings::new(folder);
        settings.address.set_port(0);
        change(&mut settings);
        let entries = Arc::new(Mutex::new(Vec::new()));
        let log = Arc::clone(&entries);
        let server = Server::bind(&settings, move |entry| log.lock().unwrap().push(entry.clone())).unwrap();
        let (address, stopper) = (server.address(), server.stopper());
        Self { address, entries, stopper, thread: Some(std::thread::spawn(|| server.run())) }
    }

    /// Stops it, and waits for the last answer.
    fn stop(mut self) -> (Statistics, Vec<Entry>) {
        self.stopper.stop();
        let statistics = self.thread.take().unwrap().join().unwrap();
        let entries = std::mem::take(&mut *self.entries.lock().unwrap());
        (statistics, entries)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stopper.stop();
        self.stopper.stop();
    }
}
