//! One request from its arrival to the last byte of its answer.

use super::Shared;
use super::connection::Connection;
use super::log::Entry;
use axum::body::{Body, Bytes};
use axum::extract::Request;
use hyper::Version;
use hyper::header::RANGE;
use std::fs::File;
use std::io::{self, Read};
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use tokio::sync::OwnedSemaphorePermit;
use tokio::time::Instant;

/// Bytes that are read at once where bandwidth is not limited.
const CHUNK: u32 = 1 << 16;

/// A request that is being answered. Dropping it ends it: it is counted, logged, and no longer in flight.
pub(super) struct Transfer {
    pub(super) shared: Arc<Shared>,
    pub(super) entry: Entry,
    /// Its number, from 0.
    pub(super) number: u64,
    connection: Arc<Connection>,
    start: Instant,
    _permit: Option<OwnedSemaphorePermit>,
}

impl Transfer {
    pub(super) fn begin(shared: Arc<Shared>, connection: Arc<Connection>, request: &Request) -> Self {
        connection.begin();
        let range = request.headers().get(RANGE).and_then(|range| range.to_str().ok());
        let entry = Entry {
            time: Entry::came_at(SystemTime::now()),
            peer: connection.peer,
            protocol: protocol(request.version()),
            method: request.method().to_string(),
            target: request.uri().path_and_query().map(ToString::to_string).unwrap_or_default(),
            range: range.map(ToOwned::to_owned),
            status: 0,
            bytes: 0,
            seconds: 0.0,
            complete: false,
        };
        let number = shared.next_number();
        let permit = Arc::clone(&shared.requests).try_acquire_owned().ok();
        Self { shared, entry, number, connection, start: Instant::now(), _permit: permit }
    }

    /// Whether no more requests than allowed are in flight.
    pub(super) fn is_allowed(&self) -> bool {
        self._permit.is_some()
    }

    /// A body of part of a file, read as the connection takes it.
    pub(super) fn send(self, file: File, length: u64) -> Body {
        let drop_after = self.shared.network.drops_after(self.number, length);
        let chunks = Chunks { file, left: length, drop_after, transfer: self };
        Body::from_stream(futures_util::stream::try_unfold(chunks, Chunks::next))
    }

    /// A body of the page, of which parts are handed to the connection as it takes them. The network holds it up nowhere.
    pub(super) fn send_page(self, page: Bytes) -> Body {
        Body::from_stream(futures_util::stream::unfold((page, self), next_of_page))
    }

    /// Waits until the link has carried bytes.
    async fn carried(&self, bytes: u32) {
        let Some(until) = self.shared.link.as_ref().map(|link| link.grant(bytes)) else { return };
        self.connection.is_active_until(until);
        tokio::time::sleep_until(until).await;
    }
}

impl Drop for Transfer {
    fn drop(&mut self) {
        self.entry.seconds = self.start.elapsed().as_secs_f64();
        self.connection.end();
        self.shared.ended(&self.entry);
    }
}

/// The next bytes of the page, which share its memory.
async fn next_of_page((mut page, mut transfer): (Bytes, Transfer)) -> Option<(Part, (Bytes, Transfer))> {
    if page.is_empty() {
        return None;
    }
    let size = u32::try_from(page.len()).unwrap_or(u32::MAX).min(CHUNK);
    let part = page.split_to(usize::try_from(size).unwrap_or(usize::MAX).min(page.len()));
    transfer.entry.bytes = transfer.entry.bytes.saturating_add(size.into());
    transfer.entry.complete = page.is_empty();
    transfer.connection.is_active_until(Instant::now());
    Some((Ok(part), (page, transfer)))
}

/// Some bytes of a body.
type Part = io::Result<Bytes>;

/// The rest of a body.
struct Chunks {
    file: File,
    left: u64,
    /// Bytes until the connection is to be closed.
    drop_after: Option<u64>,
    transfer: Transfer,
}

impl Chunks {
    async fn next(mut self) -> io::Result<Option<(Bytes, Self)>> {
        if self.left == 0 {
            return Ok(None);
        }
        if self.drop_after == Some(0) {
            // Lets the connection send what it has.
            tokio::time::sleep(Duration::from_millis(20)).await;
            return Err(io::ErrorKind::ConnectionAborted.into());
        }
        let most = self.left.min(self.drop_after.unwrap_or(u64::MAX));
        let most = u32::try_from(most).unwrap_or(u32::MAX);
        let size = most.min(self.transfer.shared.link.as_ref().map_or(CHUNK, |link| link.quantum()));
        self.transfer.carried(size).await;
        let (bytes, file) = read(self.file, size).await?;
        self.file = file;
        self.left = self.left.saturating_sub(size.into());
        self.drop_after = self.drop_after.map(|bytes| bytes.saturating_sub(size.into()));
        self.transfer.entry.bytes = self.transfer.entry.bytes.saturating_add(size.into());
        self.transfer.entry.complete = self.left == 0;
        self.transfer.connection.is_active_until(Instant::now());
        Ok(Some((bytes, self)))
    }
}

/// The next bytes of a file; an error if it has become shorter.
async fn read(mut file: File, size: u32) -> io::Result<(Bytes, File)> {
    let work = move || {
        let mut bytes = vec![0; usize::try_from(size).unwrap_or(usize::MAX)];
        file.read_exact(&mut bytes)?;
        Ok((bytes.into(), file))
    };
    tokio::task::spawn_blocking(work).await.map_err(io::Error::other)?
}

fn protocol(version: Version) -> &'static str {
    match version {
        Version::HTTP_10 => "HTTP/1.0",
        Version::HTTP_2 => "HTTP/2.0",
        _ => "HTTP/1.1",
    }
}
