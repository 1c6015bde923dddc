//! `splatstream package`: a stream as files for DASH.

mod live;
mod quality;

use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::counted;
use crate::output_directory::{self, OutputDirectory};
use crate::output_file::{OutputFile, check_directory};
use crate::stream_file::{LimitArgs, StreamFile};
use clap::{Args, ValueEnum};
use serde::Serialize;
use splatstream_chart::numbers::percent;
use splatstream_decoder::process;
use splatstream_stream::Representation;
use splatstream_stream::live::Settings;
use splatstream_stream::manifest::{Manifest, RepresentationInfo};
use splatstream_stream::package::{Layout, Options, Package};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::slice;

/// Write a stream as files for DASH: fragmented MP4, an MPD and a manifest. Nothing is decoded without --quality.
#[derive(Args)]
#[command(after_help = "Examples:\n  splatstream package talk.gss -o talk/\n  \
    splatstream encode frames/ -o - | splatstream package - -o talk/ --live\n\n\
    A file per spatial layer of the I frames and per temporal layer of the others, with a track per refinement.\n\
    What the files are is annex C of the specification; `splatstream unpackage` gives the stream back.")]
pub(crate) struct PackageStream {
    /// The stream; - is standard input.
    #[arg(value_name = "IN.gss")]
    input: PathBuf,
    /// The directory to write to.
    #[arg(short, long = "out", value_name = "DIR")]
    out: PathBuf,
    /// What is fetched at once.
    #[arg(long, value_enum, default_value_t = LayoutName::Gop)]
    layout: LayoutName,
    /// Package a stream that is still being written, GOP by GOP: files appear as they are complete, until the end unit
    /// comes. Players follow the manifest, which is replaced with each GOP or, with --layout frame, with each frame.
    #[arg(long)]
    live: bool,
    /// Seconds of the stream that the manifest lists while it grows, three GOPs at least; 60 or, with --layout frame, 6 by
    /// default.
    #[arg(long, value_name = "SECONDS", requires = "live", value_parser = seconds)]
    window: Option<f64>,
    /// Seconds from capture to display that players are told to aim at; two GOPs or, with --layout frame, two frames by
    /// default.
    #[arg(long, value_name = "SECONDS", requires = "live", value_parser = seconds)]
    target_latency: Option<f64>,
    /// Measure what every operating point of every GOP looks like against everything, for players: PSNR and SSIM of
    /// pictures of its I frame and of a frame of each temporal layer go to the manifest.
    #[arg(long, conflicts_with = "live")]
    quality: bool,
    /// Replace a package that is in the directory. It goes when the new one is whole, and stays where the command fails: the
    /// disk has to hold both. With --live it goes when the first GOP comes.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    limits: LimitArgs,
}

/// The layouts of annex C.5.4.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LayoutName {
    /// A GOP: any prefix of its refinements is one range of bytes.
    Gop,
    /// A frame: low latency, more requests.
    Frame,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    output: &'a Path,
    layout: &'a str,
    /// Of the stream, and of all files.
    bytes_in: u64,
    bytes: u64,
    /// None of a live package.
    frames: Option<u64>,
    gops: usize,
    representations: Vec<RepresentationReport<'a>>,
}

#[derive(Serialize)]
struct RepresentationReport<'a> {
    id: &'a str,
    file: &'a str,
    frame_type: &'a str,
    frames: u32,
    subsegments: usize,
    bytes: u64,
    bandwidth: u64,
}

impl PackageStream {
    /// Packages the stream.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        check_directory(&self.out, "packages")?;
        let inputs = slice::from_ref(&self.input);
        let mut directory = OutputDirectory::new(&self.out, files_in, "packages", inputs, self.force)?;
        let layout = match self.layout {
            LayoutName::Gop => Layout::Gop,
            LayoutName::Frame => Layout::Frame,
        };
        let options = Options { layout, ..Options::default() };
        if self.live {
            let settings = self.live_settings(options);
            return live::run(&self.input, directory, &settings, &self.limits.limits(), console);
        }
        let stream = StreamFile::read(&self.input)?;
        let package = package(&stream, &options, &self.limits.options_to_draw(), self.quality)?;
        let sizes = write(&package, &mut |name| directory.create(name))?;
        directory.finish()?;
        let report = Report::new(&self.out, &package.manifest, (stream.bytes.len() as u64, sizes));
        console.report(&report, || report.text())
    }

    fn live_settings(&self, package: Options) -> Settings {
        let milliseconds = |seconds: f64| (seconds * 1e3) as u32;
        let default = Settings::new(package);
        let window_ms = self.window.map_or(default.window_ms, milliseconds);
        Settings { window_ms, target_latency_ms: self.target_latency.map(milliseconds), ..default }
    }
}

/// The files of a package in a directory, by name; none where there is no package.
pub(crate) fn files_in(directory: &Path) -> Vec<PathBuf> {
    output_directory::files_in(directory, is_of_package)
}

/// A package of a stream, with the table of qualities if it is wanted.
pub(crate) fn package<'a>(
    stream: &'a StreamFile,
    options: &Options,
    decoding: &process::Options,
    quality: bool,
) -> Result<Package<'a>, Failure> {
    let mut package =
        Package::of(&stream.bytes, options, &decoding.limits).map_err(|error| stream.fault(error))?;
    if quality {
        package.manifest.quality = Some(quality::measure(stream, &package.manifest, decoding)?);
    }
    Ok(package)
}

/// Writes all files of a package to those that are created by name, those that name others last; how many bytes they have.
/// None has its name before all are written: there is a whole package or none.
pub(crate) fn write(
    package: &Package<'_>,
    create: &mut dyn FnMut(&str) -> Result<OutputFile, Failure>,
) -> Result<u64, Failure> {
    let (mut files, mut bytes) = (Vec::new(), 0);
    let mut take = |name: &str, size: u64, write: &mut dyn FnMut(&mut OutputFile) -> io::Result<()>| {
        let mut file = create(name)?;
        let whole = write(&mut file).and_then(|()| file.flush());
        whole.map_err(|error| Failure::file("write", file.path(), &error))?;
        bytes += size;
        files.push(file);
        Ok::<(), Failure>(())
    };
    for RepresentationInfo { file: name, bytes: size, .. } in &package.manifest.representations {
        take(name, *size, &mut |file| package.write(name, file))?;
    }
    let manifest = package.manifest.to_json();
    for (name, text) in [(Package::MANIFEST, &manifest), (Package::MPD, &package.mpd)] {
        take(name, text.len() as u64, &mut |file| file.write_all(text.as_bytes()))?;
    }
    files.into_iter().try_for_each(OutputFile::finish)?;
    Ok(bytes)
}

/// From nothing to a day.
fn seconds(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|seconds| (0.0..=86_400.0).contains(seconds));
    found.ok_or_else(|| "a number of seconds from 0 to 86400 is expected".to_owned())
}

/// Whether a file has a name that packages have.
fn is_of_package(path: &Path) -> bool {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return false };
    let stem = name.strip_suffix(".mp4").or(name.strip_suffix(".m4s"));
    // Of a live package there is more after the identifier.
    let id = stem.map(|stem| stem.split_once('-').map_or(stem, |(id, _)| id));
    let of_representation = id.is_some_and(|id| Representation::from_id(id).is_some());
    of_representation || [Package::MANIFEST, Package::MPD].contains(&name)
}

impl<'a> Report<'a> {
    fn new(output: &'a Path, manifest: &'a Manifest, (bytes_in, bytes): (u64, u64)) -> Self {
        let subsegments = |one: &RepresentationInfo| {
            let all = manifest.gops.iter().flat_map(|gop| &gop.subsegments);
            all.filter(|subsegment| subsegment.representation == one.id).count()
        };
        let representations = manifest.representations.iter().map(|one| RepresentationReport {
            id: &one.id,
            file: &one.file,
            frame_type: &one.frame_type,
            frames: one.frames,
            subsegments: subsegments(one),
            bytes: one.bytes,
            bandwidth: one.bandwidth,
        });
        Self {
            output,
            layout: &manifest.layout,
            bytes_in,
            bytes,
            frames: Some(manifest.stream.frames),
            gops: manifest.gops.len(),
            representations: representations.collect(),
        }
    }

    /// Of a live package, whose files are by GOP.
    fn of_live(output: &'a Path, layout: &'a str, bytes_in: u64, bytes: u64, gops: usize) -> Self {
        Self { output, layout, bytes_in, bytes, frames: None, gops, representations: Vec::new() }
    }

    fn text(&self) -> String {
        let more = percent(self.bytes, self.bytes_in) - 100.0;
        let mut text = format!(
            "{}: {}, {} ({more:.1} % more than the stream)\n",
            self.output.display(),
            counted(self.gops as u64, "GOP"),
            counted(self.bytes, "byte")
        );
        for one in &self.representations {
            text += &format!(
                "  {:<12} {}, {}, {}; up to here {:.3} Mbit/s\n",
                one.file,
                counted(one.frames.into(), &format!("{} frame", one.frame_type)),
                counted(one.subsegments as u64, "subsegment"),
                counted(one.bytes, "byte"),
                one.bandwidth as f64 / 1e6
            );
        }
        text
    }
}
