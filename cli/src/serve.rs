//! `splatstream serve`: packages and streams over HTTP.

mod built_in;
mod network_args;

use crate::console::Console;
use crate::failure::Failure;
use crate::numbers::counted;
use crate::unfinished;
use clap::{Args, ValueEnum};
use network_args::NetworkArgs;
use serde::Serialize;
use splatstream_chart::numbers::grouped;
use splatstream_stream::package::Package;
use splatstream_stream::server::{Entry, Server, ServerError, Settings, Statistics, Tls};
use splatstream_web::page_of_package;
use std::io::{self, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

/// Serve the files of a directory over HTTP/1.1 and HTTP/2, until it is interrupted.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  splatstream serve talk/ --port 8080\n  splatstream serve talk/ --player\n  splatstream serve --built-in --player\n\n\
    Single ranges, conditions and pages of other origins are answered. Nothing outside the directory is served, nothing\n\
    hidden, and no listing. Any web server that answers ranges serves a package as well.\n\
    The first line on standard error is the address; Ctrl-C lets answers in progress end, a second one does not."
)]
pub(crate) struct Serve {
    /// The directory.
    #[arg(value_name = "DIR", required_unless_present = "built_in")]
    directory: Option<PathBuf>,
    /// Serve a package of the built-in moving scene, which is made first and removed at the end.
    #[arg(long, conflicts_with = "directory")]
    built_in: bool,
    /// Answer / with a page that plays the package of the directory, as the network allows.
    #[arg(long)]
    player: bool,
    /// The address to listen on; 0.0.0.0 lets other machines in.
    #[arg(long, value_name = "IP", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// The port to listen on; 0 is any free one.
    #[arg(long, value_name = "N", default_value_t = 8080)]
    port: u16,
    /// Pages of this origin only may read the files; can be given several times. Default is any.
    #[arg(long = "allow-origin", value_name = "ORIGIN")]
    origins: Vec<String>,
    /// Serve with TLS: a chain of certificates in PEM.
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// The key of the certificate in PEM.
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Connections at one time; others wait.
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    max_connections: u32,
    /// Requests at one time; others are answered with 503.
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    max_requests: u32,
    /// Seconds that answers in progress have to end after an interruption.
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = clap::value_parser!(u16).range(0..=3600))]
    grace: u16,
    /// Write a line per request to standard error.
    #[arg(long, value_enum, value_name = "FORMAT")]
    log: Option<LogFormat>,
    #[command(flatten)]
    network: NetworkArgs,
}

/// How requests are logged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LogFormat {
    /// Time, client, request, range, status, bytes, seconds.
    Text,
    /// A JSON object per line, with the same.
    Json,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    directory: &'a Path,
    url: String,
    #[serde(flatten)]
    statistics: Statistics,
}

impl Serve {
    /// Serves until a signal comes.
    pub(crate) fn run(&self, console: &Console) -> Result<(), Failure> {
        self.directory.as_deref().map_or(Ok(()), Failure::refuse_standard_input)?;
        let temporary = self.make()?;
        let directory = self.directory.as_deref().or(temporary.as_ref().map(TempDir::path));
        let directory = directory.unwrap_or(Path::new("."));
        let settings = self.settings(directory)?;
        allow_open_files();
        let log = self.log;
        let announce = |url: &str| console.note(|| format!("serving {} at {url}", directory.display()));
        let (url, statistics) = until_interrupted(&settings, move |entry| write(log, entry), announce)?;
        let report = Report { directory, url, statistics };
        console.report(&report, || report.text())
    }

    /// The built-in scene, if it is to be served.
    fn make(&self) -> Result<Option<TempDir>, Failure> {
        if !self.built_in {
            return Ok(None);
        }
        let directory = tempfile::tempdir()
            .map_err(|error| Failure::other(format!("cannot make a temporary directory: {error}")))?;
        built_in::make(directory.path())?;
        Ok(Some(directory))
    }

    fn settings(&self, directory: &Path) -> Result<Settings, Failure> {
        let mut settings = Settings::new(directory);
        settings.address = SocketAddr::new(self.bind, self.port);
        settings.origins.clone_from(&self.origins);
        let pair = self.tls_cert.clone().zip(self.tls_key.clone());
        settings.tls = pair.map(|(certificates, key)| Tls { certificates, key });
        settings.limits.connections = self.max_connections as usize;
        settings.limits.requests = self.max_requests as usize;
        settings.limits.shutdown = Duration::from_secs(self.grace.into());
        settings.network = self.network.network()?;
        settings.threads = Some(rayon::current_num_threads());
        settings.page = self.player.then(|| self.page_of(directory)).transpose()?;
        Ok(settings)
    }

    /// A page that plays the package of the directory.
    fn page_of(&self, directory: &Path) -> Result<String, Failure> {
        if !directory.join(Package::MANIFEST).is_file() {
            let (directory, name) = (directory.display(), Package::MANIFEST);
            let message =
                format!("{directory}: there is no {name}\n  make a package with splatstream package");
            return Err(Failure::other(message));
        }
        let path = directory.canonicalize().ok();
        let name = path.as_deref().and_then(Path::file_name).filter(|_| !self.built_in);
        let title = name.map_or_else(|| "SplatStream".to_owned(), |name| name.to_string_lossy().into_owned());
        Ok(page_of_package(&title, Package::MANIFEST))
    }
}

/// Serves until a signal comes, once the address has been announced; gives the address and what was served.
pub(crate) fn until_interrupted(
    settings: &Settings,
    log: impl Fn(&Entry) + Send + Sync + 'static,
    announce: impl FnOnce(&str),
) -> Result<(String, Statistics), Failure> {
    let server = Server::bind(settings, log).map_err(refused)?;
    let scheme = if settings.tls.is_some() { "https" } else { "http" };
    let url = format!("{scheme}://{}/", server.address());
    let stopper = server.stopper();
    unfinished::stop_by(move || stopper.stop())?;
    announce(&url);
    Ok((url, server.run()))
}

/// Every connection is an open file, and so is what it asks for.
fn allow_open_files() {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
        let limit = getrlimit(Resource::Nofile);
        // With fewer, clients wait or try again.
        let _fewer = setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, ..limit });
    }
}

/// A line of the log, whole also where several threads write.
fn write(format: Option<LogFormat>, entry: &Entry) {
    let line = match format {
        None => return,
        Some(LogFormat::Text) => entry.text(),
        // An entry holds what JSON can say.
        Some(LogFormat::Json) => serde_json::to_string(entry).unwrap_or_else(|_| entry.text()),
    };
    let _nobody_listens = io::stderr().lock().write_all(format!("{line}\n").as_bytes());
}

fn refused(error: ServerError) -> Failure {
    let advice = match error {
        ServerError::Folder { .. } => "give a directory that can be read",
        ServerError::Address { .. } => "choose another port, or 0 for any free one; check the address",
        ServerError::Pem { .. } => "give a certificate and its key, both PEM",
        ServerError::Bandwidth => "give a trace with a bandwidth above 0",
        _ => "check the arguments",
    };
    Failure::other(format!("{error}\n  {advice}"))
}

impl Report<'_> {
    fn text(&self) -> String {
        let Statistics { seconds, connections, peak_connections, requests, bytes, .. } = self.statistics;
        let mut text = format!(
            "{}: {}, {} in {seconds:.1} s; {}, at most {} at a time\n",
            self.directory.display(),
            counted(requests, "request"),
            counted(bytes, "byte"),
            counted(connections, "connection"),
            grouped(peak_connections),
        );
        let faults = [
            ("refused with 4xx", self.statistics.client_errors),
            ("refused with 5xx", self.statistics.server_errors),
            ("incomplete", self.statistics.incomplete),
            ("closed, timed out", self.statistics.timed_out),
        ];
        for (name, count) in faults.into_iter().filter(|(_, count)| *count > 0) {
            text += &format!("  {name:<17} {}\n", grouped(count));
        }
        text
    }
}
