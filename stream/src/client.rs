//! A client: fetches what the controller of [`control`](crate::control) decides, from a server or a directory, and checks it.
//!
//! Nothing that a server sends is believed: every level is compared with its digest in the manifest before it counts, and
//! sizes, redirects and times are bounded. What cannot be had is named ([`Loss`]) and played without.
//!
//! ```no_run
//! use splatstream_stream::client::{Client, Options, PlayedGop};
//! use splatstream_stream::control::Layered;
//!
//! let mut client = Client::open("http://localhost:8080/talk/", Options::default())?;
//! let outcome = client.play(Layered::default(), &mut |gop: &PlayedGop<'_>| {
//!     println!("GOP {}: {} bytes for the decoder", gop.number, gop.units.len());
//! })?;
//! println!("{} GOPs, {} losses", outcome.gops.len(), outcome.losses.len());
//! # Ok::<(), splatstream_stream::client::ClientError>(())
//! ```

mod clock;
mod download;
mod player;
mod poll;
mod report;
mod source;
mod transport;
mod whole;

use crate::control::Settings;
use crate::manifest::{Manifest, ManifestError};
use crate::package::Package;
use crate::playback::{Fault, PlaybackError};
use source::Source;
use std::fmt;
use std::time::Duration;

pub use crate::playback::{Following, GopLog, Loss, PlayedGop};
pub use report::{Outcome, Screen};

/// How a client plays, and what it takes from a server.
#[derive(Clone, Debug)]
pub struct Options {
    /// Buffer and limits of the device. The buffer is made shorter where [`Options::memory`] needs it.
    pub settings: Settings,
    /// The highest spatial and temporal layer that are fetched; higher numbers than there are fetch all.
    pub layers: (u8, u8),
    /// How a presentation that grows is followed.
    pub following: Following,
    /// Whether time passes as it does. Otherwise playback skips the time in which nothing is being fetched, unless the
    /// presentation grows.
    pub real_time: bool,
    /// To establish a connection.
    pub connect_timeout: Duration,
    /// Until a response begins, and from one piece of it to the next.
    pub read_timeout: Duration,
    /// For all of a response.
    pub response_timeout: Duration,
    /// Redirects of a request.
    pub redirects: u32,
    /// Requests for what improves a GOP before it is left out.
    pub attempts: u32,
    /// Requests for the base of a GOP before the GOP is left out.
    pub base_attempts: u32,
    /// Bytes of the package that are held at the same time; as many again of whole files, kept and on their way together,
    /// where a server does not answer with ranges of bytes.
    pub memory: u64,
}

impl Default for Options {
    /// 10 s to connect and for each piece of a response, 5 minutes for a response, 3 redirects, 3 attempts and 8 for the base,
    /// 1 GiB.
    fn default() -> Self {
        Self {
            settings: Settings::default(),
            layers: (u8::MAX, u8::MAX),
            following: Following::default(),
            real_time: true,
            connect_timeout: Duration::from_secs(10),
            read_timeout: Duration::from_secs(10),
            response_timeout: Duration::from_secs(300),
            redirects: 3,
            attempts: 3,
            base_attempts: 8,
            memory: 1 << 30,
        }
    }
}

/// Why nothing, or no more, can be played.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ClientError {
    /// The manifest, or the initialisation segment of the base, cannot be had: from where, and why.
    Unreachable(String, String),
    /// The manifest is refused.
    Manifest(ManifestError),
    /// The package has become another one: the first GOP that differs, or none if all do.
    Changed(Option<usize>),
    /// Three GOPs have more bytes than [`Options::memory`]: bytes of the largest one.
    TooLarge(u64),
    /// A manifest that was written later has fewer GOPs than one that was read before: how many there were, and are.
    Backwards(usize, usize),
    /// A presentation has neither grown nor ended for so many microseconds.
    Stopped(u64),
}

impl fmt::Display for ClientError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreachable(place, why) => write!(f, "{place}: {why}"),
            Self::Manifest(error) => write!(f, "the manifest is refused: {error}"),
            Self::Changed(gop) => PlaybackError::Changed(*gop).fmt(f),
            Self::TooLarge(bytes) => PlaybackError::TooLarge(*bytes).fmt(f),
            Self::Backwards(known, listed) => {
                PlaybackError::Backwards { known: *known, listed: *listed }.fmt(f)
            }
            Self::Stopped(us) => PlaybackError::Stopped(*us).fmt(f),
        }
    }
}

impl std::error::Error for ClientError {}

impl From<PlaybackError> for ClientError {
    fn from(error: PlaybackError) -> Self {
        match error {
            PlaybackError::Changed(gop) => Self::Changed(gop),
            PlaybackError::TooLarge(bytes) => Self::TooLarge(bytes),
            PlaybackError::Backwards { known, listed } => Self::Backwards(known, listed),
            PlaybackError::Stopped(us) => Self::Stopped(us),
        }
    }
}

impl From<ManifestError> for ClientError {
    fn from(error: ManifestError) -> Self {
        Self::Manifest(error)
    }
}

/// A package somewhere, whose manifest has been read.
#[derive(Debug)]
pub struct Client {
    source: Source,
    manifest: Manifest,
    /// The version of the manifest, if the server gives one.
    tag: Option<String>,
    options: Options,
}

impl Client {
    /// Reads the manifest of a package: at the URL of its `manifest.json`, of its MPD or of its directory, or in a directory of
    /// this machine.
    ///
    /// # Errors
    /// A manifest that cannot be had or is refused.
    pub fn open(location: &str, options: Options) -> Result<Self, ClientError> {
        let source = Source::new(location, &options);
        let (manifest, tag) = read_manifest(&source, &options)?;
        Ok(Self { source, manifest, tag, options })
    }

    /// Whether the package is in a directory of this machine: [`Layered::local`](crate::control::Layered::local) is the rule for
    /// those.
    pub fn is_local(&self) -> bool {
        matches!(self.source, Source::Directory(_))
    }

    /// The manifest, as it was read last, with the layers that are fetched.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }
}

/// The manifest and its version, after as many attempts as the base of a GOP gets.
fn read_manifest(source: &Source, options: &Options) -> Result<(Manifest, Option<String>), ClientError> {
    let mut wait = Duration::from_millis(100);
    let mut attempt = 1;
    loop {
        match source.whole(Package::MANIFEST, Manifest::MAX_BYTES, None) {
            Ok(Some((bytes, tag))) => {
                let manifest = Manifest::parse(&bytes)?;
                source.expect(&manifest);
                return Ok((manifest.up_to(options.layers), tag));
            }
            Ok(None) => return Err(unasked(source)),
            Err(fault) if attempt >= options.base_attempts || fault.is_final() => {
                return Err(ClientError::Unreachable(source.place(Package::MANIFEST), fault.to_string()));
            }
            Err(_) => std::thread::sleep(wait),
        }
        attempt = attempt.saturating_add(1);
        wait = wait.saturating_mul(2).min(Duration::from_millis(3200));
    }
}

/// A server says that a file has not changed, which nobody asked.
fn unasked(source: &Source) -> ClientError {
    ClientError::Unreachable(source.place(Package::MANIFEST), Fault::Status(304).to_string())
}
