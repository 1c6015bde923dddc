//! A web server for packages and streams: single ranges of files, over HTTP/1.1 and 2, and bad networks for tests.
//!
//! ```
//! use splatstream_stream::server::{Server, Settings};
//!
//! let mut settings = Settings::new("src");
//! settings.address.set_port(0);
//! let server = Server::bind(&settings, |entry| assert!(entry.complete))?;
//! println!("http://{}/", server.address());
//! server.stopper().stop();
//! assert_eq!(server.run().requests, 0);
//! # Ok::<(), splatstream_stream::server::ServerError>(())
//! ```
//!
//! What ordinary web servers do for the same folder, the file `nginx.conf` of this crate shows.

mod answer;
mod connection;
mod faults;
mod folder;
mod link;
mod log;
mod range;
mod shaper;
mod tls;
mod transfer;

pub use faults::Network;
pub use log::{Entry, Statistics};
pub use shaper::Bucket;
pub use tls::Tls;

use axum::Router;
use axum::body::Bytes;
use folder::Folder;
use hyper::Method;
use hyper::header::{ACCEPT_RANGES, CONTENT_LENGTH, CONTENT_RANGE, ETAG, HeaderValue, IF_RANGE, RANGE};
use link::Link;
use log::Counters;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tokio::net::{TcpListener, TcpSocket};
use tokio::runtime::Runtime;
use tokio::sync::{Semaphore, watch};
use tokio_rustls::TlsAcceptor;
use tower_http::cors::{AllowOrigin, Any, CorsLayer};

/// What is served, and to whom.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Settings {
    /// The folder. Its files are served, but for hidden ones; there are no listings.
    pub folder: PathBuf,
    /// Where to listen; port 0 is any free one.
    pub address: SocketAddr,
    /// Origins of pages that may read the files; none are all.
    pub origins: Vec<String>,
    /// A certificate; without one there is no TLS.
    pub tls: Option<Tls>,
    /// What one client may cost.
    pub limits: Limits,
    /// What happens to answers on their way, for tests.
    pub network: Network,
    /// Threads that serve; none is one per processor.
    pub threads: Option<usize>,
    /// A page in HTML that `/` is answered with, in place of the folder's `index.html`. The network does not hold it up.
    pub page: Option<String>,
}

impl Settings {
    /// A folder on port 8080 of this machine alone, for pages of any origin.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self {
            folder: folder.into(),
            address: (Ipv4Addr::LOCALHOST, 8080).into(),
            origins: Vec::new(),
            tls: None,
            limits: Limits::default(),
            network: Network::default(),
            threads: None,
            page: None,
        }
    }
}

/// What clients may cost. An answer in progress takes less than 200 KiB, so the default is bounded by 200 MiB.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Limits {
    /// Connections at one time; others wait until one is closed. 1 or more, 1024 by default.
    pub connections: usize,
    /// Requests at one time, over all connections; others are answered with 503. 1024 by default.
    pub requests: usize,
    /// Requests at one time on a connection of HTTP/2. 64 by default.
    pub streams: u32,
    /// Bytes of a request's headers; more are answered with 431. 8 KiB or more, 16 KiB by default.
    pub header_bytes: usize,
    /// Time from a connection to the end of its first request's headers, with TLS. 10 seconds by default.
    pub first_request: Duration,
    /// Time from the end of an answer to the end of the next request's headers. 60 seconds by default.
    pub idle: Duration,
    /// Time within which a client has to take the next 64 KiB. 60 seconds by default.
    pub stalled: Duration,
    /// Time that answers have to come to their end when the server stops. 10 seconds by default.
    pub shutdown: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            connections: 1024,
            requests: 1024,
            streams: 64,
            header_bytes: 16 << 10,
            first_request: Duration::from_secs(10),
            idle: Duration::from_secs(60),
            stalled: Duration::from_secs(60),
            shutdown: Duration::from_secs(10),
        }
    }
}

/// Why a server does not start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServerError {
    /// The folder cannot be read, or it is none.
    #[error("{path}: cannot serve it: {why}")]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        why: io::Error,
    },
    /// Nothing can listen there.
    #[error("cannot listen on {address}: {why}")]
    Address {
        /// Where.
        address: SocketAddr,
        /// What the system says.
        why: io::Error,
    },
    /// A certificate or a key is not what it should be.
    #[error("{path}: not usable for TLS: {why}")]
    Pem {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// A header cannot have an origin.
    #[error("{0}: not an origin; one is like https://example.org")]
    Origin(String),
    /// A trace never carries anything.
    #[error("the trace has a bandwidth of 0 throughout: nothing would ever arrive")]
    Bandwidth,
    /// There are no threads to be had.
    #[error("cannot start threads: {0}")]
    Threads(io::Error),
}

/// How far a server is to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stop {
    No,
    /// When answers in progress have ended.
    Soon,
    Now,
}

/// Stops a server from another thread.
#[derive(Debug, Clone)]
pub struct Stopper(watch::Sender<Stop>);

impl Stopper {
    /// Lets the server end: answers in progress may come to their end within [`Limits::shutdown`]. A second call ends them
    /// at once.
    pub fn stop(&self) {
        self.0.send_modify(|stop| *stop = if *stop == Stop::No { Stop::Soon } else { Stop::Now });
    }
}

/// A server that listens; [`Server::run`] makes it answer.
pub struct Server {
    runtime: Runtime,
    listener: TcpListener,
    address: SocketAddr,
    shared: Arc<Shared>,
    router: Router,
    stop: watch::Sender<Stop>,
}

/// What all connections have in common.
struct Shared {
    folder: Folder,
    page: Option<Bytes>,
    tls: Option<TlsAcceptor>,
    limits: Limits,
    network: Network,
    link: Option<Link>,
    requests: Arc<Semaphore>,
    begun: AtomicU64,
    counters: Counters,
    log: Box<dyn Fn(&Entry) + Send + Sync>,
}

impl Server {
    /// Listens, and answers nobody yet. `log` is called when a request has ended.
    ///
    /// # Errors
    ///
    /// [`ServerError`], if the settings cannot be followed.
    pub fn bind(
        settings: &Settings,
        log: impl Fn(&Entry) + Send + Sync + 'static,
    ) -> Result<Self, ServerError> {
        let folder = Folder::new(&settings.folder)
            .map_err(|why| ServerError::Folder { path: settings.folder.clone(), why })?;
        let link = settings.network.bucket().map(Link::new);
        if link.is_none() && settings.network.bandwidth.is_some() {
            return Err(ServerError::Bandwidth);
        }
        let shared = Arc::new(Shared {
            folder,
            page: settings.page.clone().map(Bytes::from),
            tls: settings.tls.as_ref().map(Tls::acceptor).transpose()?,
            limits: settings.limits.clone(),
            network: settings.network.clone(),
            link,
            requests: Arc::new(Semaphore::new(settings.limits.requests.min(Semaphore::MAX_PERMITS))),
            begun: AtomicU64::new(0),
            counters: Counters::default(),
            log: Box::new(log),
        });
        let cors = cross_origin(&settings.origins)?;
        let router = Router::new().fallback(answer::answer).with_state(Arc::clone(&shared)).layer(cors);
        let runtime = runtime(settings.threads).map_err(ServerError::Threads)?;
        let listener = {
            let _context = runtime.enter();
            listen(settings.address)
        };
        let bound = listener.and_then(|listener| Ok((listener.local_addr()?, listener)));
        let (address, listener) =
            bound.map_err(|why| ServerError::Address { address: settings.address, why })?;
        Ok(Self { runtime, listener, address, shared, router, stop: watch::Sender::new(Stop::No) })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// What stops it.
    pub fn stopper(&self) -> Stopper {
        Stopper(self.stop.clone())
    }

    /// Serves until it is stopped.
    pub fn run(self) -> Statistics {
        let start = Instant::now();
        let Self { runtime, listener, shared, router, stop, .. } = self;
        runtime.block_on(serve(listener, &shared, &router, stop.subscribe()));
        // Answers that are still in progress are counted as incomplete.
        runtime.shutdown_timeout(Duration::from_secs(1));
        shared.counters.statistics(start)
    }
}

fn runtime(threads: Option<usize>) -> io::Result<Runtime> {
    let mut builder = tokio::runtime::Builder::new_multi_thread();
    if let Some(threads) = threads {
        builder.worker_threads(threads.max(1));
    }
    // Reading files takes few threads, however many clients there are.
    builder.enable_all().max_blocking_threads(16).build()
}

fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4()? } else { TcpSocket::new_v6()? };
    // A server that is started again does not wait for the connections of the one before.
    #[cfg(unix)]
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(1024)
}

/// Which pages may read files, and which headers of answers they see.
fn cross_origin(origins: &[String]) -> Result<CorsLayer, ServerError> {
    let origins: Vec<HeaderValue> = origins
        .iter()
        .map(|origin| origin.parse().map_err(|_| ServerError::Origin(origin.clone())))
        .collect::<Result<_, _>>()?;
    let allowed = if origins.is_empty() { AllowOrigin::from(Any) } else { AllowOrigin::list(origins) };
    let layer = CorsLayer::new().allow_origin(allowed).allow_methods([Method::GET, Method::HEAD]);
    Ok(layer
        .allow_headers([RANGE, IF_RANGE])
        .expose_headers([CONTENT_RANGE, CONTENT_LENGTH, ETAG, ACCEPT_RANGES])
        .max_age(Duration::from_secs(86_400)))
}

/// Accepts connections until it is told to stop, then lets them end.
async fn serve(
    listener: TcpListener,
    shared: &Arc<Shared>,
    router: &Router,
    mut stop: watch::Receiver<Stop>,
) {
    let most = shared.limits.connections.clamp(1, Semaphore::MAX_PERMITS);
    let free = Arc::new(Semaphore::new(most));
    let signals = stop.clone();
    tokio::select! {
        () = accept(&listener, &free, shared, router, &signals) => {}
        _ = stop.wait_for(|stop| *stop != Stop::No) => {}
    }
    // Nobody is let in any more.
    drop(listener);
    tokio::select! {
        // Then all connections have ended.
        _ = free.acquire_many(u32::try_from(most).unwrap_or(u32::MAX)) => {}
        () = tokio::time::sleep(shared.limits.shutdown) => {}
        _ = stop.wait_for(|stop| *stop == Stop::Now) => {}
    }
}

async fn accept(
    listener: &TcpListener,
    free: &Arc<Semaphore>,
    shared: &Arc<Shared>,
    router: &Router,
    stop: &watch::Receiver<Stop>,
) {
    // It fails only when it is closed.
    while let Ok(permit) = Arc::clone(free).acquire_owned().await {
        let Ok((socket, peer)) = listener.accept().await else {
            // Too many files are open, or the client has left: others may come.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        let (shared, router, stop) = (Arc::clone(shared), router.clone(), stop.clone());
        tokio::spawn(async move {
            connection::serve(socket, peer, shared, router, stop).await;
            drop(permit);
        });
    }
}

impl Shared {
    fn next_number(&self) -> u64 {
        self.begun.fetch_add(1, Ordering::Relaxed)
    }

    fn ended(&self, entry: &Entry) {
        self.counters.ended(entry);
        (self.log)(entry);
    }
}
