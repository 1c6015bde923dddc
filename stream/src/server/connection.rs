//! One connection: TLS, HTTP/1.1 or 2, and the times after which it is closed.

use super::{Limits, Shared, Stop};
use axum::{Extension, Router};
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto::Builder;
use hyper_util::service::TowerToHyperService;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::time::Instant;

/// A connection, as its requests see it.
pub(super) struct Connection {
    pub(super) peer: SocketAddr,
    limits: Limits,
    activity: Mutex<Activity>,
}

/// When something last happened: a request came or ended, or the client took a part of an answer. Bytes of a request that is
/// not complete do not count, so slow headers end with the connection.
struct Activity {
    last: Instant,
    in_flight: u32,
    had_request: bool,
}

impl Connection {
    fn new(peer: SocketAddr, limits: Limits) -> Self {
        let activity = Activity { last: Instant::now(), in_flight: 0, had_request: false };
        Self { peer, limits, activity: Mutex::new(activity) }
    }

    pub(super) fn begin(&self) {
        let mut activity = self.activity();
        activity.in_flight = activity.in_flight.saturating_add(1);
        activity.had_request = true;
        activity.last = activity.last.max(Instant::now());
    }

    pub(super) fn end(&self) {
        let mut activity = self.activity();
        activity.in_flight = activity.in_flight.saturating_sub(1);
        activity.last = Instant::now();
    }

    /// The server itself takes until then.
    pub(super) fn is_active_until(&self, time: Instant) {
        let mut activity = self.activity();
        activity.last = activity.last.max(time);
    }

    fn activity(&self) -> MutexGuard<'_, Activity> {
        self.activity.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns when the connection has been without activity for too long.
    async fn expired(&self) {
        let limits = &self.limits;
        // What happens meanwhile may bring the end nearer: from a stall that is long to an idle time that is short.
        let pause = limits.first_request.min(limits.idle).min(limits.stalled);
        loop {
            let (now, expires) = (Instant::now(), self.expires());
            if expires <= now {
                return;
            }
            tokio::time::sleep_until(now.checked_add(pause).unwrap_or(expires).min(expires)).await;
        }
    }

    fn expires(&self) -> Instant {
        let activity = self.activity();
        let time = match (activity.in_flight, activity.had_request) {
            (0, false) => self.limits.first_request,
            (0, true) => self.limits.idle,
            _ => self.limits.stalled,
        };
        activity.last.checked_add(time).unwrap_or(activity.last)
    }
}

/// Serves a client until it leaves, a time is over or the server stops.
pub(super) async fn serve(
    socket: TcpStream,
    peer: SocketAddr,
    shared: Arc<Shared>,
    router: Router,
    mut stop: watch::Receiver<Stop>,
) {
    shared.counters.opened();
    let connection = Arc::new(Connection::new(peer, shared.limits.clone()));
    let talk = talk(socket, Arc::clone(&connection), &shared, router, stop.clone());
    let in_time = tokio::select! {
        () = talk => true,
        () = connection.expired() => false,
        _ = stop.wait_for(|stop| *stop == Stop::Now) => true,
    };
    shared.counters.closed(in_time);
}

async fn talk(
    socket: TcpStream,
    connection: Arc<Connection>,
    shared: &Shared,
    router: Router,
    stop: watch::Receiver<Stop>,
) {
    // Answers leave at once; where that cannot be set they leave later.
    let _slower = socket.set_nodelay(true);
    let router = router.layer(Extension(connection));
    match &shared.tls {
        None => speak(socket, &shared.limits, router, stop).await,
        Some(tls) => {
            // A client that breaks off the handshake has nobody to tell.
            if let Ok(socket) = tls.accept(socket).await {
                speak(socket, &shared.limits, router, stop).await;
            }
        }
    }
}

/// HTTP/1.1 or 2, whichever the client begins with.
async fn speak<S>(socket: S, limits: &Limits, router: Router, mut stop: watch::Receiver<Stop>)
where
    S: AsyncRead + AsyncWrite + Unpin + 'static,
{
    let mut builder = Builder::new(TokioExecutor::new());
    let header_bytes = limits.header_bytes.max(8 << 10);
    // Times are those of `Connection`.
    builder.http1().header_read_timeout(None).max_buf_size(header_bytes).max_headers(64);
    builder
        .http2()
        .timer(TokioTimer::new())
        .max_concurrent_streams(limits.streams)
        .max_header_list_size(u32::try_from(header_bytes).unwrap_or(u32::MAX))
        .max_send_buf_size(1 << 16);
    let service = TowerToHyperService::new(router);
    let conversation = builder.serve_connection(TokioIo::new(socket), service);
    tokio::pin!(conversation);
    tokio::select! {
        // A connection that breaks has nobody to tell; its requests are logged as incomplete.
        _ = conversation.as_mut() => return,
        _ = stop.wait_for(|stop| *stop != Stop::No) => {}
    }
    conversation.as_mut().graceful_shutdown();
    let _broken = conversation.await;
}
