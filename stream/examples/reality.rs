//! How true simulations are: plays a package in real time from a server whose bandwidth is that of a trace, simulates the same,
//! and prints both. What `.ci/reports reality` runs:
//!
//! ```text
//! cargo run --release -p splatstream-stream --features client,server --example reality -- PACKAGE LATENCY_MS TRACE.csv...
//! ```
//!
//! It ends with an error if bytes, mean quality, start-up or the time with stalls differ by more than 5 %.
#![allow(clippy::print_stdout, reason = "it is a program")]

use splatstream_stream::client::{Client, Options, PlayedGop};
use splatstream_stream::control::{Layered, Settings};
use splatstream_stream::package::Package;
use splatstream_stream::qoe::Score;
use splatstream_stream::server::{self, Bucket, Network, Server, Stopper};
use splatstream_stream::simulation::{Link, Report, Requests, Trace, simulate};
use std::env;
use std::error::Error;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

type Result<T> = std::result::Result<T, Box<dyn Error + Send + Sync>>;

/// Media time that is buffered at most.
const BUFFER_US: u64 = 10_000_000;

/// Largest difference, in percent.
const TOLERANCE: f64 = 5.0;

/// What is compared.
struct Figures {
    bytes: f64,
    quality: f64,
    startup: f64,
    /// Seconds from the first frame to the end, stalls among them.
    playing: f64,
    stalled: f64,
    requests: u64,
}

impl Figures {
    fn of(report: &Report, score: &Score) -> Self {
        let seconds = |us: u64| us as f64 / 1e6;
        Self {
            bytes: report.bytes as f64,
            quality: score.quality,
            startup: seconds(report.startup_us()),
            playing: seconds(report.ended_us.saturating_sub(report.startup_us())),
            stalled: seconds(report.stalled_us()),
            requests: report.requests,
        }
    }

    fn row(&self, kind: &str) -> String {
        let Self { bytes, quality, startup, stalled, requests, .. } = self;
        format!(
            "{kind:<9} {:>9.1} kB  {quality:>6.2} dB  start-up {startup:>7.3} s  stalled {stalled:>7.3} s  {requests:>4} requests",
            bytes / 1000.0
        )
    }

    /// Differences from others in percent: of bytes, quality, start-up, and of stalls in the time from the first frame on.
    fn differences(&self, other: &Self) -> [f64; 4] {
        let percent = |ours: f64, theirs: f64| 100.0 * (ours - theirs) / theirs;
        [
            percent(self.bytes, other.bytes),
            percent(self.quality, other.quality),
            percent(self.startup, other.startup),
            percent(self.playing, other.playing),
        ]
    }
}

fn settings() -> Settings {
    Settings { buffer_us: BUFFER_US, ..Settings::default() }
}

/// A server in a thread of its own.
fn serve(package: &Path, network: Network) -> Result<(SocketAddr, Stopper)> {
    let mut setup = server::Settings::new(package);
    setup.address.set_port(0);
    setup.network = network;
    let server = Server::bind(&setup, |_| ())?;
    let (address, stopper) = (server.address(), server.stopper());
    thread::spawn(|| server.run());
    Ok((address, stopper))
}

/// What the latency comes to on this machine: the median time of requests of a byte, on a network without other limits.
fn measured(package: &Path, latency: Duration) -> Result<Duration> {
    let (address, stopper) = serve(package, Network { latency, ..Network::default() })?;
    let mut socket = BufReader::new(TcpStream::connect(address)?);
    let mut times = Vec::new();
    for _ in 0..31 {
        let begun = Instant::now();
        let request =
            format!("GET /{} HTTP/1.1\r\nHost: {address}\r\nRange: bytes=0-0\r\n\r\n", Package::MANIFEST);
        socket.get_mut().write_all(request.as_bytes())?;
        let mut line = String::from("headers");
        while !line.trim_end().is_empty() {
            line.clear();
            socket.read_line(&mut line)?;
        }
        socket.read_exact(&mut [0])?;
        times.push(begun.elapsed());
    }
    stopper.stop();
    times.sort();
    Ok(times.get(times.len() / 2).copied().unwrap_or(latency))
}

/// Plays from a server of its own.
fn play(package: &Path, trace: &Trace, latency: Duration) -> Result<Figures> {
    let network = Network { bandwidth: Some(trace.clone()), latency, ..Network::default() };
    let (address, stopper) = serve(package, network)?;
    let url = format!("http://{address}/");
    let mut client = Client::open(&url, Options { settings: settings(), ..Options::default() })?;
    let outcome = client.play(Layered::default(), &mut |_: &PlayedGop<'_>| ())?;
    stopper.stop();
    if let Some(loss) = outcome.losses.first() {
        return Err(format!("GOP {}: {}", loss.gop, loss.reason).into());
    }
    Ok(Figures::of(&outcome.report, &outcome.score()))
}

/// The same in virtual time. The trace begins with the manifest, and playback when that has come.
fn virtually(package: &Path, trace: &Trace, latency: Duration) -> Result<Figures> {
    let place = package.to_str().ok_or("the package must have a name in UTF-8")?;
    let manifest = Client::open(place, Options::default())?.manifest().clone();
    let bytes = fs::metadata(package.join(Package::MANIFEST))?.len();
    let begun_us = trace.time_of(u128::from(bytes) * 8_000_000).ok_or("the trace carries nothing")?;
    let link = Link {
        latency_us: u64::try_from(latency.as_micros())?,
        requests: Requests::OfClient(Box::new(manifest.clone())),
        credit_us: Bucket::DEPTH_US,
        ..Link::new(trace.since(begun_us))
    };
    let ladder = manifest.ladder()?;
    let report = simulate(&ladder, &settings(), Layered::default(), &link);
    Ok(Figures::of(&report, &Score::of(&ladder, &report)))
}

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [package, latency, traces @ ..] = arguments.as_slice() else {
        return Err("arguments: PACKAGE LATENCY_MS TRACE.csv...".into());
    };
    let (package, latency) = (Path::new(package), Duration::from_millis(latency.parse()?));
    let own = measured(package, latency)?;
    println!("a request of a byte takes {:.1} ms", own.as_secs_f64() * 1e3);
    let mut worst = 0.0_f64;
    let results: Vec<(&String, Result<(Figures, Figures)>)> = thread::scope(|scope| {
        let compare = |path: &String| {
            let trace = Trace::parse(&fs::read_to_string(path)?)?;
            Ok((play(package, &trace, latency)?, virtually(package, &trace, own)?))
        };
        // Each has a server and a link of its own, so that all can run at the same time.
        let running: Vec<_> = traces.iter().map(|path| (path, scope.spawn(move || compare(path)))).collect();
        let joined = running.into_iter();
        joined.map(|(path, one)| (path, one.join().unwrap_or_else(|_| Err("it panicked".into())))).collect()
    });
    for (path, result) in results {
        let (real, simulated) = result?;
        let differences = simulated.differences(&real);
        worst = differences.iter().fold(worst, |worst, difference| worst.max(difference.abs()));
        let [bytes, quality, startup, playing] = differences;
        println!("{}", Path::new(path).file_stem().unwrap_or_default().to_string_lossy());
        println!("  {}\n  {}", real.row("real time"), simulated.row("simulated"));
        println!(
            "  bytes {bytes:+.1} %, quality {quality:+.1} %, start-up {startup:+.1} %, time with stalls {playing:+.1} %"
        );
    }
    if worst > TOLERANCE {
        return Err(format!("the largest difference is {worst:.1} %").into());
    }
    Ok(())
}
