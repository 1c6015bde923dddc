//! `splatstream play`: a package, from a server or a directory, as a player fetches and decodes it.

mod decoding;
mod report;

use crate::console::{Console, to_json};
use crate::failure::{Failure, Instead};
use crate::numbers::counted;
use crate::output_file::{OutputFile, check_ending, refuse_inputs};
use crate::package::files_in;
use crate::stream_file::LimitArgs;
use crate::whole_file::read_text;
use clap::{Args, ValueEnum};
use decoding::Decoding;
use report::Report;
use splatstream_stream::client::{Client, Following, Options, PlayedGop};
use splatstream_stream::control::{
    Bola, BufferRule, Gop, Layered, Limits, Rule, Settings, Single, ThroughputRule,
};
use splatstream_stream::manifest::Manifest;
use splatstream_stream::simulation::{Link, Requests, Trace, simulate};
use std::path::{Path, PathBuf};

/// Play a package: fetch ranges as the network allows, decode, and report on every GOP.
///
/// Every level is compared with its digest in the manifest, and every decoded frame with that in the stream. What cannot be
/// had is named, and played without: refinements and layers, or the whole GOP if it is the base of one. A presentation that
/// grows is followed until it has ended.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream play http://localhost:8080/talk/\n  \
    splatstream play talk/ --no-wait --json\n  \
    splatstream play talk/ --trace mobile.csv --rule bola -o bola.json\n\n\
    A trace is CSV: a line of titles, then a time in seconds and the Mbit/s from then on.")]
pub(crate) struct Play {
    /// The package: the URL of its directory, of its manifest.json or of its .mpd, or a directory.
    #[arg(value_name = "URL_OR_DIR")]
    location: String,
    /// Who decides what is fetched.
    #[arg(long, value_enum, default_value_t = RuleName::Layered)]
    rule: RuleName,
    /// Simulate a network with this bandwidth over time, in virtual time, in place of playing; for a directory.
    #[arg(long, value_name = "FILE.csv")]
    trace: Option<PathBuf>,
    /// Milliseconds from a request to its first byte, on the simulated network.
    #[arg(long, value_name = "MS", default_value_t = 50, requires = "trace", value_parser = clap::value_parser!(u32).range(0..=60_000))]
    latency: u32,
    /// Gaussians that the device can draw: points whose frames may have more are not played, but for the lowest of each GOP.
    #[arg(long, value_name = "N")]
    limit_gaussians: Option<u64>,
    /// Highest spatial and temporal layer to fetch.
    #[arg(long, value_name = "sS,tT", value_parser = layers)]
    limit_layers: Option<(u8, u8)>,
    /// Seconds that are buffered at most.
    #[arg(long, value_name = "SECONDS", default_value_t = 25.0, value_parser = seconds)]
    buffer: f64,
    /// Of a presentation that grows: start with the first GOP that is listed, not near the last one.
    #[arg(long)]
    from_start: bool,
    /// Of a presentation that grows: seconds from capture to display to aim at, one and a half of the longest GOP at least;
    /// by default what the manifest says.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    target_latency: Option<f64>,
    /// Of a presentation that grows: end with an error if it has neither grown nor ended for so many seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds)]
    patience: f64,
    /// Skip the time in which nothing is fetched: playback ends as soon as all is there. Not while the presentation grows.
    #[arg(long)]
    no_wait: bool,
    /// Fetch and check only.
    #[arg(long)]
    no_decode: bool,
    /// A file for the report as JSON.
    #[arg(short, long = "out", value_name = "REPORT.json")]
    out: Option<PathBuf>,
    #[command(flatten)]
    limits: LimitArgs,
}

/// What to do about an address that is taken for a path.
const SCHEME: &str = "\n  if it is on a server, write http:// or https:// before it";

/// Who decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum RuleName {
    /// Layer-aware model predictive control.
    Layered,
    /// The highest rate below the measured throughput; like the two below it knows no layers and plays whole GOPs.
    Throughput,
    /// The rate that the level of the buffer stands for.
    Buffer,
    /// BOLA: the best utility for the level of the buffer.
    Bola,
}

impl RuleName {
    /// The rule, for a package on this machine or on a server.
    fn rule(self, is_local: bool) -> Box<dyn Rule> {
        match self {
            Self::Layered if is_local => Box::new(Layered::local()),
            Self::Layered => Box::new(Layered::default()),
            Self::Throughput => Box::new(Single::whole(ThroughputRule)),
            Self::Buffer => Box::new(Single::whole(BufferRule)),
            Self::Bola => Box::new(Single::whole(Bola::default())),
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Layered => "layered",
            Self::Throughput => "throughput",
            Self::Buffer => "buffer",
            Self::Bola => "bola",
        }
    }
}

impl Play {
    /// Plays, or simulates, and reports.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        console.claim(self.out.as_deref())?;
        Failure::refuse_standard_input(Path::new(&self.location))?;
        let inputs = self.inputs();
        if let Some(out) = &self.out {
            refuse_inputs(out, &inputs)?;
            check_ending(out, "json", "a report in JSON")?;
        }
        let trace = self.trace.as_deref().map(|path| self.read_trace(path)).transpose()?;
        let failed = |error| {
            let advice = if self.lacks_scheme() { SCHEME } else { "" };
            Failure::other(format!("{}: cannot play: {error}{advice}", self.location))
        };
        let mut client = Client::open(&self.location, self.options()).map_err(failed)?;
        self.warn_of_large_points(client.manifest(), console);
        let report = match trace {
            Some(trace) => {
                let ladder = client.manifest().ladder().map_err(|error| Failure::other(error.to_string()))?;
                let link = Link {
                    latency_us: u64::from(self.latency) * 1000,
                    requests: Requests::OfClient(Box::new(client.manifest().clone())),
                    ..Link::new(trace)
                };
                let outcome = simulate(&ladder, &self.settings(), self.rule.rule(false), &link);
                Report::of_simulation(client.manifest(), &ladder, &outcome)
            }
            None => {
                let mut decoding = Decoding::start(!self.no_decode, self.limits.options())?;
                let show = &mut |gop: &PlayedGop<'_>| {
                    if !console.is_json() {
                        console.note(|| report::line(gop));
                    }
                    decoding.show(gop);
                };
                let outcome = client.play(self.rule.rule(client.is_local()), show).map_err(failed)?;
                Report::of_playback(client.manifest(), &outcome, decoding.finish()?)
            }
        };
        let report = report.of(&self.location, self.rule.name());
        if let Some(path) = &self.out {
            OutputFile::write_apart(path, &inputs, to_json(&report)?.as_bytes())?;
        }
        console.report_beside(self.out.as_deref(), &report, || report.text())?;
        if let Some(error) = report.undecoded() {
            let level = Some(client.manifest().stream.level);
            let path = PathBuf::from(&self.location);
            return Err(Failure::Stream { path, error, instead: Instead::Nothing, level });
        }
        match report.has_played() {
            true => Ok(()),
            false => Err(Failure::other(format!(
                "{}: nothing could be played: no GOP of it arrived\n  check whether all files of the package are there",
                self.location
            ))),
        }
    }

    /// Says so where even the lowest point of a GOP has more Gaussians than the device can draw: it is played all the same.
    fn warn_of_large_points(&self, manifest: &Manifest, console: &Console) {
        let (Some(limit), Ok(ladder)) = (self.limit_gaussians, manifest.ladder()) else { return };
        let least = |gop: &Gop| gop.points().iter().map(|point| point.gaussians).min();
        let largest = ladder.gops().iter().filter_map(least).max().unwrap_or_default();
        if largest > limit {
            console.complain(&format!(
                "warning: frames of the lowest operating point have up to {}, more than --limit-gaussians {limit}; \
                 they are played all the same, since nothing has fewer",
                counted(largest, "Gaussian")
            ));
        }
    }

    /// Whether the location, which is no path here, looks like the address of a server: a host with a port, or a name with dots,
    /// before what is on it.
    fn lacks_scheme(&self) -> bool {
        let host = self.location.split('/').next().unwrap_or_default();
        let (name, port) = host.rsplit_once(':').map_or((host, None), |(name, port)| (name, Some(port)));
        let is_host = port.is_some_and(|port| port.parse::<u16>().is_ok())
            || name == "localhost"
            || name.split('.').filter(|label| !label.is_empty()).count() > 1;
        is_host && !name.is_empty() && !Path::new(&self.location).exists()
    }

    /// The files that it reads: a trace, and those of a package on this machine.
    fn inputs(&self) -> Vec<PathBuf> {
        let location = PathBuf::from(&self.location);
        let directory = match location.parent() {
            _ if location.is_dir() => &location,
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let package = files_in(directory);
        [Some(location), self.trace.clone()].into_iter().flatten().chain(package).collect()
    }

    fn read_trace(&self, path: &Path) -> Result<Trace, Failure> {
        if self.location.contains("://") {
            return Err(Failure::Usage(
                "--trace simulates a network for the package in a directory; over a real one, the server shapes".into(),
            ));
        }
        let text = read_text(path)?;
        Trace::parse(&text).map_err(|error| Failure::other(format!("{}: {error}", path.display())))
    }

    fn options(&self) -> Options {
        Options {
            settings: self.settings(),
            layers: self.limit_layers.unwrap_or((u8::MAX, u8::MAX)),
            real_time: !self.no_wait,
            following: Following {
                from_start: self.from_start,
                target_us: self.target_latency.map(|seconds| (seconds * 1e6) as u64),
                patience_us: (self.patience * 1e6) as u64,
                ..Following::default()
            },
            ..Options::default()
        }
    }

    fn settings(&self) -> Settings {
        let gaussians = self.limit_gaussians.unwrap_or(u64::MAX);
        let limits = Limits { gaussians, ..Limits::default() };
        Settings { buffer_us: (self.buffer * 1e6) as u64, limits, ..Settings::default() }
    }
}

/// Layers such as `s1,t0`.
fn layers(text: &str) -> Result<(u8, u8), String> {
    let layer = |part: Option<&str>, letter| part?.strip_prefix(letter)?.parse().ok();
    let mut parts = text.split(',');
    let found = layer(parts.next(), 's').zip(layer(parts.next(), 't')).filter(|_| parts.next().is_none());
    found.ok_or_else(|| "layers are written like s1,t0".to_owned())
}

/// From a tenth of a second to a day.
fn seconds(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|seconds| (0.1..=86_400.0).contains(seconds));
    found.ok_or_else(|| "a number of seconds from 0.1 to 86400 is expected".to_owned())
}
