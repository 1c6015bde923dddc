//! Requests that run beside playback, one after the other.

use super::source::Source;
use crate::playback::{ByteRequest, Fault};
use std::io::{ErrorKind, Read};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

/// What has happened.
#[derive(Debug)]
pub(super) enum Event {
    /// A request is sent.
    Sent,
    /// A response begins.
    Begun,
    /// More bytes, which follow those before.
    Bytes(Vec<u8>),
    /// The requests end here.
    Failed(Fault),
}

/// Bytes that are read at once.
const CHUNK: usize = 1 << 16;

/// Chunks that wait for the player: so the memory is bounded.
const WAITING: usize = 16;

/// Requests that run. To drop it is to give them up: the connection is closed when its next bytes come, or its time
/// is over.
#[derive(Debug)]
pub(super) struct Download {
    events: Receiver<Event>,
    /// Those who fetch see when it is gone.
    _waiting: Arc<()>,
}

impl Download {
    /// Begins to fetch.
    pub(super) fn start(source: Source, requests: Vec<ByteRequest>) -> Self {
        let (sender, events) = sync_channel(WAITING);
        let failed = sender.clone();
        let waiting = Arc::new(());
        let seen = Arc::downgrade(&waiting);
        let work = move || {
            for request in &requests {
                match fetch(&source, request, &sender, &|| seen.strong_count() > 0) {
                    Ok(true) => {}
                    Ok(false) => return,
                    Err(fault) => {
                        let _given_up = sender.send(Event::Failed(fault));
                        return;
                    }
                }
            }
        };
        if let Err(error) = std::thread::Builder::new().name("download".into()).spawn(work) {
            let _nobody_listens = failed.try_send(Event::Failed(error.into()));
        }
        Self { events, _waiting: waiting }
    }

    /// What happens next, within a time.
    pub(super) fn next(&self, timeout: Duration) -> Option<Event> {
        match self.events.recv_timeout(timeout) {
            Ok(event) => Some(event),
            Err(RecvTimeoutError::Timeout) => None,
            // All was sent, which the player counts itself.
            Err(RecvTimeoutError::Disconnected) => Some(Event::Failed(Fault::Short(0))),
        }
    }
}

/// One request. Gives false if nobody wants it any more.
fn fetch(
    source: &Source,
    request: &ByteRequest,
    sender: &SyncSender<Event>,
    is_wanted: &dyn Fn() -> bool,
) -> Result<bool, Fault> {
    if sender.send(Event::Sent).is_err() {
        return Ok(false);
    }
    let mut reader = source.range(request, is_wanted)?;
    if sender.send(Event::Begun).is_err() {
        return Ok(false);
    }
    let mut got = 0_u64;
    loop {
        let mut chunk = vec![0; CHUNK];
        let count = match reader.read(&mut chunk) {
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Err(Fault::Short(got)),
            Err(error) => return Err(error.into()),
        };
        // To read to the end lets the next request have the connection.
        if count == 0 {
            return if got == request.size { Ok(true) } else { Err(Fault::Short(got)) };
        }
        got = got.saturating_add(u64::try_from(count).unwrap_or(u64::MAX));
        if got > request.size {
            return Err(Fault::Wrong("the response has more bytes than were asked for"));
        }
        chunk.truncate(count);
        if sender.send(Event::Bytes(chunk)).is_err() {
            return Ok(false);
        }
    }
}
