//! `splatstream view`: a stream as a web page.

use crate::console::Console;
use crate::failure::Failure;
use crate::output_file::{OutputFile, check_ending, refuse_inputs};
use crate::serve::until_interrupted;
use crate::stream_file::{SizeArgs, StreamFile};
use clap::Args;
use serde::Serialize;
use splatstream_chart::numbers::grouped;
use splatstream_format::unit::Stream;
use splatstream_stream::server::Settings;
use splatstream_web::{page_beside, page_with};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::{fs, io, slice};

/// Write a web page that plays a stream, or serve one on this machine until it is interrupted.
///
/// The page holds the player, the decoder and, with -o, the stream: it needs no other file and no network.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  splatstream view talk.gss -o talk.html\n  splatstream view talk.gss\n\n\
    Without -o the first line on standard error is the address; Ctrl-C ends it."
)]
pub(crate) struct View {
    /// The stream; - is standard input.
    #[arg(value_name = "IN.gss")]
    input: PathBuf,
    /// The page to write, with the stream inside; - is standard output. Without it the page is served.
    #[arg(short, long = "out", value_name = "PAGE.html", conflicts_with_all = ["bind", "port"])]
    out: Option<PathBuf>,
    /// The name of the page; default is the title of the stream, or the name of its file.
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// The address to listen on; 0.0.0.0 lets other machines in.
    #[arg(long, value_name = "IP", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// The port to listen on; 0 is any free one.
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    #[command(flatten)]
    limits: SizeArgs,
}

/// The name of the stream beside a page that is served.
const STREAM: &str = "stream.gss";

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    /// The page; none if it was served.
    output: Option<PathBuf>,
    /// Where it was served; none if it was written.
    url: Option<String>,
    /// Bytes of the page.
    bytes: u64,
    /// Bytes of the stream.
    bytes_in: u64,
}

impl View {
    /// Writes or serves the page.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        console.claim(self.out.as_deref())?;
        if let Some(out) = &self.out {
            refuse_inputs(out, slice::from_ref(&self.input))?;
            check_ending(out, "html", "a web page")?;
        }
        let stream = StreamFile::read(&self.input)?;
        let limits = self.limits.limits();
        Stream::open(&stream.bytes, &limits).map_err(|error| stream.fault(error))?;
        if let Some(error) = stream.damage(&limits) {
            let path = stream.path.display();
            console.complain(&format!("warning: {path}: {error}\n  the page plays what is intact"));
        }
        let described = stream.description(&limits).and_then(|description| description.title);
        let title = self.title.clone().or(described).unwrap_or_else(|| name_of(&self.input));
        match &self.out {
            Some(out) => self.write(console, out, &stream, &title),
            None => self.serve(console, &stream, &title),
        }
    }

    fn write(&self, console: &Console, out: &Path, stream: &StreamFile, title: &str) -> Result<(), Failure> {
        let page = page_with(title, &stream.bytes);
        OutputFile::write_apart(out, slice::from_ref(&self.input), page.as_bytes())?;
        let report = Report::new(Some(out), None, &page, stream);
        console.report_beside(Some(out), &report, || report.text())
    }

    fn serve(&self, console: &Console, stream: &StreamFile, title: &str) -> Result<(), Failure> {
        let page = page_beside(title, STREAM);
        let directory = directory_of(&page, stream)
            .map_err(|error| Failure::other(format!("a temporary directory cannot be written: {error}")))?;
        let mut settings = Settings::new(directory.path());
        settings.address = SocketAddr::new(self.bind, self.port);
        let announce = |url: &str| console.note(|| format!("{} is at {url}", self.input.display()));
        let (url, _) = until_interrupted(&settings, |_| {}, announce)?;
        let report = Report::new(None, Some(url), &page, stream);
        console.report(&report, || report.text())
    }
}

/// A directory with a page and its stream, which goes away with what this gives.
fn directory_of(page: &str, stream: &StreamFile) -> io::Result<tempfile::TempDir> {
    // Servers hide names that start with a dot.
    let directory = tempfile::Builder::new().prefix("splatstream-view-").tempdir()?;
    fs::write(directory.path().join("index.html"), page)?;
    fs::write(directory.path().join(STREAM), &stream.bytes)?;
    Ok(directory)
}

/// The name of a file without its extension.
pub(crate) fn name_of(path: &Path) -> String {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    stem.filter(|stem| stem != "-").unwrap_or_else(|| "SplatStream".to_owned())
}

impl Report {
    fn new(output: Option<&Path>, url: Option<String>, page: &str, stream: &StreamFile) -> Self {
        let (bytes, bytes_in) = (page.len() as u64, stream.bytes.len() as u64);
        Self { output: output.map(Path::to_path_buf), url, bytes, bytes_in }
    }

    fn text(&self) -> String {
        let (bytes, stream) = (grouped(self.bytes), grouped(self.bytes_in));
        match &self.output {
            Some(output) => format!("{}: {bytes} bytes, {stream} of the stream\n", output.display()),
            None => format!("a page of {bytes} bytes and a stream of {stream} bytes were served\n"),
        }
    }
}
