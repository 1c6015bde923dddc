//! What was served: a line per request, and the sums.

use serde::Serialize;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// A request that has ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    /// When it came, in seconds since 1970 (UTC).
    pub time: f64,
    /// Who asked.
    pub peer: SocketAddr,
    /// `HTTP/1.1` or the like.
    pub protocol: &'static str,
    /// `GET` or the like.
    pub method: String,
    /// Path and query as they came, percent-encoded.
    pub target: String,
    /// The header Range, if it had one.
    pub range: Option<String>,
    /// Status of the answer; 0 if the client left before there was one.
    pub status: u16,
    /// Bytes of the body that were handed to the connection.
    pub bytes: u64,
    /// Until the last of them, in seconds.
    pub seconds: f64,
    /// Whether that was the whole body.
    pub complete: bool,
}

impl Entry {
    pub(super) fn came_at(time: SystemTime) -> f64 {
        time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs_f64()
    }

    /// The line of a log for people, without an end of line: time, peer, request, range, status, bytes, seconds.
    pub fn text(&self) -> String {
        let since = Duration::try_from_secs_f64(self.time).unwrap_or_default();
        let time = SystemTime::UNIX_EPOCH.checked_add(since);
        format!(
            "{} {} \"{} {} {}\" {} {} {} {:.3}{}",
            httpdate::fmt_http_date(time.unwrap_or(SystemTime::UNIX_EPOCH)),
            self.peer,
            self.method,
            self.target,
            self.protocol,
            self.range.as_deref().unwrap_or("-"),
            self.status,
            self.bytes,
            self.seconds,
            if self.complete { "" } else { " incomplete" }
        )
    }
}

/// What a server did from its start to its end.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Statistics {
    /// How long it ran.
    pub seconds: f64,
    /// Connections that were accepted.
    pub connections: u64,
    /// The most at one time.
    pub peak_connections: u64,
    /// Connections that were closed because the client sent or took nothing for too long.
    pub timed_out: u64,
    /// Requests that ended.
    pub requests: u64,
    /// Those with status 200 to 299.
    pub successful: u64,
    /// Those with status 300 to 399: 304, mostly.
    pub redirected: u64,
    /// Those with status 400 to 499.
    pub client_errors: u64,
    /// Those with status 500 and above, with those that `fail_share` made.
    pub server_errors: u64,
    /// Those whose body did not come to its end, whoever closed the connection.
    pub incomplete: u64,
    /// Bytes of bodies.
    pub bytes: u64,
}

/// [`Statistics`] while they grow.
#[derive(Debug, Default)]
pub(super) struct Counters {
    connections: AtomicU64,
    open: AtomicU64,
    peak: AtomicU64,
    timed_out: AtomicU64,
    /// By the first digit of the status.
    classes: [AtomicU64; 6],
    incomplete: AtomicU64,
    bytes: AtomicU64,
}

impl Counters {
    pub(super) fn opened(&self) {
        self.connections.fetch_add(1, Ordering::Relaxed);
        let open = self.open.fetch_add(1, Ordering::Relaxed).saturating_add(1);
        self.peak.fetch_max(open, Ordering::Relaxed);
    }

    pub(super) fn closed(&self, in_time: bool) {
        self.open.fetch_sub(1, Ordering::Relaxed);
        self.timed_out.fetch_add(u64::from(!in_time), Ordering::Relaxed);
    }

    pub(super) fn ended(&self, entry: &Entry) {
        let class = usize::from(entry.status.checked_div(100).unwrap_or(0));
        if let Some(class) = self.classes.get(class) {
            class.fetch_add(1, Ordering::Relaxed);
        }
        self.incomplete.fetch_add(u64::from(!entry.complete), Ordering::Relaxed);
        self.bytes.fetch_add(entry.bytes, Ordering::Relaxed);
    }

    pub(super) fn statistics(&self, start: Instant) -> Statistics {
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let [unanswered, other, successful, redirected, client_errors, server_errors] =
            self.classes.each_ref().map(count);
        let requests = [unanswered, other, successful, redirected, client_errors, server_errors];
        Statistics {
            seconds: start.elapsed().as_secs_f64(),
            connections: count(&self.connections),
            peak_connections: count(&self.peak),
            timed_out: count(&self.timed_out),
            requests: requests.iter().sum(),
            successful,
            redirected,
            client_errors,
            server_errors,
            incomplete: count(&self.incomplete),
            bytes: count(&self.bytes),
        }
    }
}
