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
use splatstream_stream::server::{self, Bucket, Network, Server};
use splatstream_stream::simulation::{Link, Report, Trace, simulate};
use std::env;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::thread;
use std::time::Duration;

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

/// Plays from a server of its own.
fn play(package: &Path, trace: &Trace, latency: Duration) -> Result<Figures> {
    let mut setup = server::Settings::new(package);
    setup.address.set_port(0);
    setup.network = Network { bandwidth: Some(trace.clone()), latency, ..Network::default() };
    let server = Server::bind(&setup, |_| ())?;
    let (url, stopper) = (format!("http://{}/", server.address()), server.stopper());
    thread::spawn(|| server.run());
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
        requests: manifest.requests(),
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
    let mut worst = 0.0_f64;
    let results: Vec<(&String, Result<(Figures, Figures)>)> = thread::scope(|scope| {
        let compare = |path: &String| {
            let trace = Trace::parse(&fs::read_to_string(path)?)?;
            Ok((play(package, &trace, latency)?, virtually(package, &trace, latency)?))
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
