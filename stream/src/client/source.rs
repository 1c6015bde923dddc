//! Where a package is: ranges of bytes of its files, from an HTTP server or a directory.

use super::Options;
use super::transport::{self, Counting};
use super::whole::{Wanted, WholeFiles, kept_range};
use crate::manifest::{Manifest, digest_of};
use crate::package::Package;
use crate::playback::{ByteRequest, Fault};
use std::collections::HashMap;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use ureq::http::{HeaderMap, Response, StatusCode, header};
use ureq::typestate::WithoutBody;
use ureq::unversioned::resolver::DefaultResolver;
use ureq::unversioned::transport::{Connector, DefaultConnector};
use ureq::{Agent, Body, RequestBuilder};

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::NotFound => Self::Missing(error.to_string()),
            _ => Self::Failed(error.to_string()),
        }
    }
}

impl From<ureq::Error> for Fault {
    fn from(error: ureq::Error) -> Self {
        Self::Failed(error.to_string())
    }
}

/// How the name of an MPD ends, which is beside the manifest.
const MPD: &[u8] = b".mpd";

/// Bytes of a file and its version, or nothing.
pub(super) type Whole = Option<(Vec<u8>, Option<String>)>;

/// A package. Clones share connections and what is known of files.
#[derive(Debug, Clone)]
pub(super) enum Source {
    /// On a server.
    Server(Server),
    /// On this machine.
    Directory(PathBuf),
}

impl Source {
    pub(super) fn new(location: &str, options: &Options) -> Self {
        if location.starts_with("http://") || location.starts_with("https://") {
            return Self::Server(Server::new(location, options));
        }
        let path = PathBuf::from(location);
        let is_description =
            |name: &OsStr| name == Package::MANIFEST || name.as_encoded_bytes().ends_with(MPD);
        let is_file = path.file_name().is_some_and(is_description) && !path.is_dir();
        Self::Directory(if is_file { path.parent().map(PathBuf::from).unwrap_or_default() } else { path })
    }

    /// How people call a file.
    pub(super) fn place(&self, file: &str) -> String {
        match self {
            Self::Server(server) => server.url(file),
            Self::Directory(path) => path.join(file).display().to_string(),
        }
    }

    /// All bytes of a file that has at most so many, and its version; nothing if that is the one that is known.
    pub(super) fn whole(&self, file: &str, most: usize, known: Option<&str>) -> Result<Whole, Fault> {
        let (reader, tag): (Box<dyn Read>, _) = match self {
            Self::Server(server) => match server.whole(file, known)? {
                Some((reader, tag)) => (Box::new(reader), tag),
                None => return Ok(None),
            },
            Self::Directory(path) => (Box::new(File::open(path.join(file))?), None),
        };
        let mut bytes = Vec::new();
        let limit = u64::try_from(most).unwrap_or(u64::MAX);
        reader.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
        if bytes.len() > most {
            return Err(Fault::Wrong("the file is too large"));
        }
        let tag = match self {
            Self::Server(_) => tag,
            Self::Directory(_) => Some(digest_of(&[&bytes])),
        };
        let is_known = tag.is_some() && tag.as_deref() == known;
        Ok((!is_known).then_some((bytes, tag)))
    }

    /// A range of a file, which has one byte or more. The reader may have fewer bytes, and more. Where much has to be read for
    /// it, that ends when the range is not wanted any more.
    pub(super) fn range(
        &self,
        request: &ByteRequest,
        is_wanted: &dyn Fn() -> bool,
    ) -> Result<Box<dyn Read + Send>, Fault> {
        let ByteRequest { file, offset, size } = request;
        let (offset, size) = (*offset, *size);
        match self {
            Self::Server(server) => server.range(file, (offset, size), is_wanted),
            Self::Directory(path) => {
                let mut file = File::open(path.join(file))?;
                file.seek(SeekFrom::Start(offset))?;
                Ok(Box::new(file.take(size)))
            }
        }
    }

    /// Takes from a manifest how large files can be.
    pub(super) fn expect(&self, manifest: &Manifest) {
        if let Self::Server(server) = self {
            server.files.expect(manifest);
        }
    }

    /// Forgets which versions of files were seen.
    pub(super) fn forget(&self) {
        if let Self::Server(server) = self {
            server.tags.lock().unwrap_or_else(PoisonError::into_inner).clear();
            server.files.forget();
        }
    }
}

/// A package on an HTTP server.
#[derive(Debug, Clone)]
pub(super) struct Server {
    agent: Agent,
    /// Up to the names of files.
    base: String,
    /// From the question mark on.
    query: String,
    /// `ETag` of each file.
    tags: Arc<Mutex<HashMap<String, String>>>,
    /// What was sent whole.
    files: Arc<WholeFiles>,
}

impl Server {
    fn new(location: &str, options: &Options) -> Self {
        let location = location.split('#').next().unwrap_or_default();
        let (path, query) = location.find('?').map_or((location, ""), |at| location.split_at(at));
        let folder = path.rsplit_once('/').filter(|(_, name)| name.as_bytes().ends_with(MPD));
        let folder = folder.map_or_else(|| path.strip_suffix(Package::MANIFEST), |(folder, _)| Some(folder));
        let base = folder.unwrap_or(path).trim_end_matches('/');
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .max_redirects(options.redirects)
            .max_redirects_will_error(false)
            .timeout_connect(Some(options.connect_timeout))
            .timeout_recv_response(Some(options.read_timeout))
            .timeout_per_read(Some(options.read_timeout))
            .timeout_recv_body(Some(options.response_timeout))
            .max_idle_connections_per_host(4)
            .user_agent(concat!("splatstream/", env!("CARGO_PKG_VERSION")))
            .accept_encoding("identity");
        Self {
            agent: Agent::with_parts(
                config.build(),
                DefaultConnector::new().chain(Counting),
                DefaultResolver::default(),
            ),
            base: format!("{base}/"),
            query: query.to_owned(),
            tags: Arc::default(),
            files: Arc::new(WholeFiles::new(options.memory)),
        }
    }

    fn url(&self, file: &str) -> String {
        [&self.base, file, &self.query].concat()
    }

    fn whole(
        &self,
        file: &str,
        known: Option<&str>,
    ) -> Result<Option<(impl Read + use<>, Option<String>)>, Fault> {
        let mut request = self.agent.get(self.url(file)).header(header::CACHE_CONTROL, "no-cache");
        if let Some(tag) = known {
            request = request.header(header::IF_NONE_MATCH, tag);
        }
        let response = call(request)?;
        match response.status() {
            StatusCode::OK => {
                let tag = text(response.headers(), header::ETAG.as_str()).map(str::to_owned);
                Ok(Some((transport::Body(response.into_body().into_reader()), tag)))
            }
            StatusCode::NOT_MODIFIED if known.is_some() => Ok(None),
            status => Err(Fault::Status(status.as_u16())),
        }
    }

    /// A range of a file. A server that has sent a whole file in place of a range is taken to do so with every file.
    fn range(
        &self,
        file: &str,
        range: (u64, u64),
        is_wanted: &dyn Fn() -> bool,
    ) -> Result<Box<dyn Read + Send>, Fault> {
        let (offset, size) = range;
        let mut wanted = Wanted { file, length: None, range, is_wanted };
        let slot = self.files.is_needed().then(|| self.files.slot(file));
        let mut held = slot.as_ref().map(|slot| slot.lock().unwrap_or_else(PoisonError::into_inner));
        if let Some(range) = held.as_ref().and_then(|kept| kept_range(kept, offset, size)) {
            return Ok(range);
        }
        if let Some(came) = held.as_mut().and_then(|kept| self.files.go_on(kept, &wanted)) {
            return came;
        }
        let response = self.answer(file, offset, size)?;
        wanted.length = response.body().content_length();
        let is_range = response.status() == StatusCode::PARTIAL_CONTENT;
        let body = transport::Body(response.into_body().into_reader());
        match &mut held {
            _ if is_range => Ok(Box::new(body)),
            Some(kept) => self.files.keep(kept, body, &wanted),
            None => {
                let slot = self.files.slot(file);
                let mut kept = slot.lock().unwrap_or_else(PoisonError::into_inner);
                self.files.keep(&mut kept, body, &wanted)
            }
        }
    }

    /// The response to a request for a range: that range, or the whole file.
    fn answer(&self, file: &str, offset: u64, size: u64) -> Result<Response<Body>, Fault> {
        let last = offset.saturating_add(size.saturating_sub(1));
        let known = self.tag(file);
        let mut request =
            self.agent.get(self.url(file)).header(header::RANGE, format!("bytes={offset}-{last}"));
        // A weak tag says nothing about bytes.
        if let Some(tag) = known.as_deref().filter(|tag| !tag.starts_with("W/")) {
            request = request.header(header::IF_RANGE, tag);
        }
        let response = call(request)?;
        self.check(file, &response, known.as_deref(), offset, last)?;
        Ok(response)
    }

    fn tag(&self, file: &str) -> Option<String> {
        self.tags.lock().unwrap_or_else(PoisonError::into_inner).get(file).cloned()
    }

    /// Whether a response is the range asked for, or the whole file, of the file that was seen before.
    fn check<B>(
        &self,
        file: &str,
        response: &Response<B>,
        known: Option<&str>,
        first: u64,
        last: u64,
    ) -> Result<(), Fault> {
        let tag = text(response.headers(), header::ETAG.as_str());
        let is_other = known.is_some_and(|known| tag.is_some_and(|tag| tag != known));
        match response.status() {
            StatusCode::PARTIAL_CONTENT if is_other => return Err(Fault::Changed),
            StatusCode::PARTIAL_CONTENT => {}
            StatusCode::PRECONDITION_FAILED | StatusCode::RANGE_NOT_SATISFIABLE => {
                return Err(Fault::Changed);
            }
            StatusCode::OK if is_other => return Err(Fault::Changed),
            StatusCode::OK => {
                self.remember(file, tag);
                return Ok(());
            }
            status => return Err(Fault::Status(status.as_u16())),
        }
        let expected = format!("bytes {first}-{last}/");
        if !text(response.headers(), header::CONTENT_RANGE.as_str())
            .is_some_and(|range| range.starts_with(&expected))
        {
            return Err(Fault::Wrong("the server answers with another range of bytes"));
        }
        self.remember(file, tag);
        Ok(())
    }

    fn remember(&self, file: &str, tag: Option<&str>) {
        if let Some(tag) = tag {
            let mut tags = self.tags.lock().unwrap_or_else(PoisonError::into_inner);
            tags.insert(file.to_owned(), tag.to_owned());
        }
    }
}

/// The response to a request, after redirects.
fn call(request: RequestBuilder<WithoutBody>) -> Result<Response<Body>, Fault> {
    transport::progress();
    let response = request.call().map_err(|error| match error {
        ureq::Error::BadUri(why) if why.starts_with("unknown scheme") => ELSEWHERE,
        error => error.into(),
    })?;
    let location = text(response.headers(), header::LOCATION.as_str());
    match location.filter(|_| REDIRECTS.contains(&response.status().as_u16())) {
        Some(location) if is_elsewhere(location) => Err(ELSEWHERE),
        Some(_) => Err(Fault::Wrong("too many redirects")),
        None => Ok(response),
    }
}

/// Why a redirect is not followed.
const ELSEWHERE: Fault = Fault::Wrong("the server redirects to an address that is neither http nor https");

/// Statuses of redirects that are followed.
const REDIRECTS: [u16; 5] = [301, 302, 303, 307, 308];

/// Whether a location has a scheme that is not one of the web. The library takes some of these for names of files.
fn is_elsewhere(location: &str) -> bool {
    let Some((scheme, _)) = location.split_once(':') else { return false };
    let is_scheme = scheme.starts_with(|first: char| first.is_ascii_alphabetic())
        && scheme.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte));
    is_scheme && !["http", "https"].iter().any(|known| known.eq_ignore_ascii_case(scheme))
}

fn text<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    headers.get(name)?.to_str().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schemes_are_not_names_of_files() {
        for location in ["file:///etc/passwd", "ftp://a/", "data:,x", "view-source:http://a/"] {
            assert!(is_elsewhere(location), "{location}");
        }
        for location in ["http://a/", "HTTPS://a/", "/a:b", "../a:b", "a", "", "://a", "1:2"] {
            assert!(!is_elsewhere(location), "{location}");
        }
    }

    #[test]
    fn locations_are_of_directories_and_of_manifests() {
        let place = |location: &str| Source::new(location, &Options::default()).place("s0.mp4");
        assert_eq!(place("http://a/b"), "http://a/b/s0.mp4");
        assert_eq!(place("http://a/b/"), "http://a/b/s0.mp4");
        assert_eq!(place("https://a/b/manifest.json?key=1#x"), "https://a/b/s0.mp4?key=1");
        assert_eq!(place("http://a/b/manifest.mpd?key=1"), "http://a/b/s0.mp4?key=1");
        assert_eq!(place("b/manifest.mpd"), PathBuf::from("b").join("s0.mp4").display().to_string());
        assert_eq!(place("b/manifest.json"), PathBuf::from("b").join("s0.mp4").display().to_string());
    }
}
