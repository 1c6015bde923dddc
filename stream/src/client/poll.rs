//! The manifest of a presentation that grows, read beside playback.

use super::source::Source;
use crate::manifest::Manifest;
use crate::package::Package;
use crate::playback::Fault;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

/// What came: a manifest and its version, or nothing if it is the one that is known.
pub(super) type Polled = Result<Option<(Manifest, Option<String>)>, Fault>;

/// A manifest that is being read.
#[derive(Debug)]
pub(super) struct Poll {
    read: Receiver<Polled>,
}

impl Poll {
    /// Begins to read the manifest, with some layers, unless it is the version that is known.
    pub(super) fn start(source: Source, layers: (u8, u8), known: Option<String>) -> Self {
        let (sender, read) = sync_channel(1);
        let failed = sender.clone();
        let work = move || {
            let _nobody_listens = sender.send(poll(&source, layers, known.as_deref()));
        };
        if let Err(error) = std::thread::Builder::new().name("manifest".into()).spawn(work) {
            let _nobody_listens = failed.try_send(Err(error.into()));
        }
        Self { read }
    }

    /// What came, as soon as that is known.
    pub(super) fn take(&self) -> Option<Polled> {
        match self.read.try_recv() {
            Ok(polled) => Some(polled),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(Fault::Wrong("the manifest was not read"))),
        }
    }
}

fn poll(source: &Source, layers: (u8, u8), known: Option<&str>) -> Polled {
    let Some((bytes, tag)) = source.whole(Package::MANIFEST, Manifest::MAX_BYTES, known)? else {
        return Ok(None);
    };
    // It may be whole the next time.
    let manifest = Manifest::parse(&bytes).map_err(|error| Fault::Failed(error.to_string()))?;
    source.expect(&manifest);
    Ok(Some((manifest.up_to(layers), tag)))
}
