//! What playback is worth under our rule and others, over a folder of network traces:
//!
//! ```text
//! cargo run --release -p splatstream-stream --example qoe -- TRACES [--csv FILE] [--gops N] [--buffer SECONDS]
//!     [--latency SECONDS] [--live SECONDS] [--package NAME=MANIFEST]... [--peer NAME=COMMAND]...
//!     [--partial-peer NAME=COMMAND]...
//! ```
//!
//! Plays packages again and again, with the qualities that their manifests have measured, or ladders that are made up of sizes
//! of real streams, if no package is given.
//!
//! `TRACES` has CSV files of lines `seconds,Mbit/s`, whose names say the class of the network: 3G..., 4G..., hd... for
//! broadband, 5g... . Weights of our rule were tuned on every other trace of each class, in the order of names; the rest is
//! held out, and tables show both. `--live` plays a live presentation that is joined when its first GOP is there, and aims at
//! this time from capture to display; our rule alone changes the rate of playback, by up to 5 %. A peer is a program that speaks the protocol of conformance/peers/README.md; a partial one
//! plays what has arrived of a GOP when its time comes, where others play whole GOPs only.

mod peer;
mod table;

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use splatstream_stream::control::{
    Bola, BufferRule, Gop, Ladder, Layered, Live, Rule, Settings, Single, ThroughputRule,
};
use splatstream_stream::manifest::{GopInfo, Manifest, QualityInfo};
use splatstream_stream::qoe::Score;
use splatstream_stream::simulation::{Link, Report, Trace, ladders, simulate};

use peer::Peer;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// One playback.
struct Row {
    ladder: String,
    class: &'static str,
    trace: String,
    held_out: bool,
    rule: String,
    score: Score,
    requests: u64,
    abandoned: u64,
}

/// A rule in another program.
struct Candidate {
    name: String,
    command: String,
    partial: bool,
}

#[derive(Default)]
struct Arguments {
    traces: PathBuf,
    csv: Option<PathBuf>,
    gops: usize,
    buffer_us: u64,
    latency_us: u64,
    live_us: Option<u64>,
    peers: Vec<Candidate>,
    packages: Vec<(String, PathBuf)>,
}

fn main() -> Result<()> {
    let arguments = parse()?;
    let mut out = std::io::stdout().lock();
    let mut rows = Vec::new();
    let mut costs: BTreeMap<String, (f64, u64)> = BTreeMap::new();
    for (class, held_out, path) in classes(&arguments.traces)? {
        let trace = Trace::parse(&std::fs::read_to_string(&path)?)?;
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        for (ladder, presentation) in presentations(class, &arguments)? {
            for (rule, made) in rules(&arguments.peers)? {
                let start = Instant::now();
                let report = play(&presentation, made, &trace, &arguments);
                let cost = costs.entry(rule.clone()).or_default();
                cost.0 += start.elapsed().as_secs_f64();
                cost.1 += report.decisions;
                let score = Score::of(&presentation, &report);
                let (requests, abandoned) = (report.requests, report.abandoned);
                rows.push(Row {
                    ladder: ladder.clone(),
                    class,
                    trace: name.clone(),
                    held_out,
                    rule,
                    score,
                    requests,
                    abandoned,
                });
            }
        }
    }
    table::print(&mut out, &rows)?;
    for (rule, (seconds, decisions)) in costs {
        writeln!(out, "{rule}: {:.1} us per decision, of {decisions}", seconds * 1e6 / decisions as f64)?;
    }
    if let Some(csv) = &arguments.csv {
        table::write_csv(&mut std::fs::File::create(csv)?, &rows)?;
    }
    Ok(())
}

fn play(presentation: &Ladder, rule: Box<dyn Rule>, trace: &Trace, arguments: &Arguments) -> Report {
    let link = Link { limit_us: 4_000_000_000, latency_us: arguments.latency_us, ..Link::new(trace.clone()) };
    let available_us = presentation.gops().first().map_or(0, Gop::duration_us) as i64;
    let live = |target_us| Live { available_us, target_us, slowest_milli: 950, fastest_milli: 1050 };
    let live = arguments.live_us.map(live);
    let settings = Settings { buffer_us: arguments.buffer_us, live, ..Settings::default() };
    simulate(presentation, &settings, rule, &link)
}

/// Our rule, the baselines and the peers.
fn rules(peers: &[Candidate]) -> Result<Vec<(String, Box<dyn Rule>)>> {
    let mut rules: Vec<(String, Box<dyn Rule>)> = vec![
        ("layered".into(), Box::new(Layered::default())),
        ("throughput".into(), Box::new(Single::whole(ThroughputRule))),
        ("buffer".into(), Box::new(Single::whole(BufferRule))),
        ("bola".into(), Box::new(Single::whole(Bola::default()))),
        ("throughput, partial".into(), Box::new(Single::partial(ThroughputRule))),
        ("buffer, partial".into(), Box::new(Single::partial(BufferRule))),
        ("bola, partial".into(), Box::new(Single::partial(Bola::default()))),
    ];
    for peer in peers {
        let rule = Peer::start(&peer.command)?;
        let rule = if peer.partial { Single::partial(rule) } else { Single::whole(rule) };
        rules.push((peer.name.clone(), Box::new(rule)));
    }
    Ok(rules)
}

/// What is played on a class of networks: the packages, if some are given.
fn presentations(class: &str, arguments: &Arguments) -> Result<Vec<(String, Ladder)>> {
    let gops = arguments.gops;
    let known = match class {
        _ if !arguments.packages.is_empty() => Vec::new(),
        "5G" => vec![("large".into(), ladders::large(gops)), ("paper".into(), ladders::paper(gops))],
        _ => vec![("small".into(), ladders::small(gops))],
    };
    let packaged = |(name, path): &(String, PathBuf)| Ok((name.clone(), repeated(path, gops)?));
    known.into_iter().map(Ok).chain(arguments.packages.iter().map(packaged)).collect()
}

/// The GOPs of a package again and again, with their qualities.
fn repeated(manifest: &Path, gops: usize) -> Result<Ladder> {
    let mut manifest = Manifest::parse(&std::fs::read(manifest)?)?;
    let measured = manifest.quality.take().unwrap_or_default();
    let (mut repeats, mut qualities, mut first_frame) = (Vec::new(), Vec::new(), 0);
    for (gop, number) in manifest.gops.iter().cycle().take(gops).zip(0..) {
        let of_gop = measured.iter().filter(|one| one.gop == Some(gop.index));
        qualities.extend(of_gop.map(|one| QualityInfo { gop: Some(number), ..one.clone() }));
        repeats.push(GopInfo { index: number, first_frame, ..gop.clone() });
        first_frame += gop.frame_count;
    }
    qualities.extend(measured.into_iter().filter(|one| one.gop.is_none()));
    (manifest.gops, manifest.quality) = (repeats, Some(qualities));
    Ok(manifest.ladder()?)
}

/// The traces with their classes, and whether they are held out.
fn classes(folder: &Path) -> Result<Vec<(&'static str, bool, PathBuf)>> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<std::io::Result<_>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "csv"));
    paths.sort();
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    let mut found = Vec::new();
    for path in paths {
        let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
        let class = match name.get(..2) {
            Some("3g") => "3G",
            Some("4g") => "4G",
            Some("5g") => "5G",
            Some("hd") => "broadband",
            _ => "other",
        };
        let count = seen.entry(class).or_default();
        found.push((class, *count % 2 == 1, path));
        *count += 1;
    }
    if found.is_empty() { Err("there are no traces (*.csv) in this folder".into()) } else { Ok(found) }
}

fn microseconds(seconds: &str) -> Result<u64> {
    Ok((seconds.parse::<f64>()? * 1e6) as u64)
}

fn parse() -> Result<Arguments> {
    let mut arguments =
        Arguments { gops: 240, buffer_us: 25_000_000, latency_us: 50_000, ..Arguments::default() };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--csv" => arguments.csv = Some(value()?.into()),
            "--gops" => arguments.gops = value()?.parse()?,
            "--buffer" => arguments.buffer_us = microseconds(&value()?)?,
            "--live" => arguments.live_us = Some(microseconds(&value()?)?),
            "--package" => {
                let package = value()?;
                let (name, manifest) = package.split_once('=').ok_or("a package is NAME=MANIFEST")?;
                arguments.packages.push((name.into(), manifest.into()));
            }
            "--latency" => arguments.latency_us = microseconds(&value()?)?,
            "--peer" | "--partial-peer" => {
                let peer = value()?;
                let (name, command) = peer.split_once('=').ok_or("a peer is NAME=COMMAND")?;
                let partial = word == "--partial-peer";
                arguments.peers.push(Candidate { name: name.into(), command: command.into(), partial });
            }
            _ => arguments.traces = word.into(),
        }
    }
    if arguments.traces.as_os_str().is_empty() {
        return Err("a folder of traces is needed".into());
    }
    Ok(arguments)
}
