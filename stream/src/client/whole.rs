//! Files of a server that does not answer with ranges of bytes: each is fetched whole, once, and kept.

use crate::control::number::size;
use crate::playback::Fault;
use std::collections::HashMap;
use std::io::{self, Cursor, Read};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The bytes of a file, once they are there. Who fetches it holds the lock, so that nobody fetches it a second time.
type Slot = Arc<Mutex<Option<Arc<[u8]>>>>;

/// What was fetched whole.
#[derive(Debug)]
pub(super) struct WholeFiles {
    /// Whether the server has sent a whole file in place of a range.
    is_needed: AtomicBool,
    /// Bytes of all files together, at most.
    memory: u64,
    files: Mutex<HashMap<String, Slot>>,
}

impl WholeFiles {
    pub(super) fn new(memory: u64) -> Self {
        Self { is_needed: AtomicBool::new(false), memory, files: Mutex::default() }
    }

    /// Whether files are to be looked for here first.
    pub(super) fn is_needed(&self) -> bool {
        self.is_needed.load(Ordering::Relaxed)
    }

    /// The place of a file, which says from now on that files are kept.
    pub(super) fn slot(&self, file: &str) -> Slot {
        self.is_needed.store(true, Ordering::Relaxed);
        self.all().entry(file.to_owned()).or_default().clone()
    }

    fn all(&self) -> MutexGuard<'_, HashMap<String, Slot>> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Forgets all files.
    pub(super) fn forget(&self) {
        self.all().clear();
    }

    /// Reads a file to its end into its place and gives a range of it. Files that were kept before go where there is no room
    /// for all of them; one that is itself too large is read up to the range, each time.
    pub(super) fn keep(
        &self,
        kept: &mut Option<Arc<[u8]>>,
        mut body: impl Read + Send + 'static,
        length: Option<u64>,
        (offset, count): (u64, u64),
    ) -> Result<Box<dyn Read + Send>, Fault> {
        if length.is_some_and(|length| length > self.memory) {
            io::copy(&mut body.by_ref().take(offset), &mut io::sink())?;
            return Ok(Box::new(body.take(count)));
        }
        let mut bytes = Vec::new();
        body.take(self.memory.saturating_add(1)).read_to_end(&mut bytes)?;
        if size(bytes.len()) > self.memory {
            return Err(Fault::Wrong(
                "the server does not answer with ranges of bytes, and the file is too large to be kept whole",
            ));
        }
        self.make_room(size(bytes.len()));
        let bytes: Arc<[u8]> = bytes.into();
        *kept = Some(bytes.clone());
        Ok(range_of(bytes, offset, count))
    }

    /// Lets go of all files, if so many bytes do not fit beside them. Those that are being fetched count with their next bytes.
    fn make_room(&self, bytes: u64) {
        let mut files = self.all();
        let length = |slot: &Slot| {
            let kept = slot.try_lock().ok()?;
            kept.as_ref().map(|kept| size(kept.len()))
        };
        let all = files.values().filter_map(length).fold(bytes, u64::saturating_add);
        if all > self.memory {
            files.clear();
        }
    }
}

/// A range of a file that has been kept, if all of it is there: files of a presentation that grows may have become longer.
pub(super) fn kept_range(kept: &Option<Arc<[u8]>>, offset: u64, count: u64) -> Option<Box<dyn Read + Send>> {
    let bytes = kept.as_ref().filter(|bytes| size(bytes.len()) >= offset.saturating_add(count))?;
    Some(range_of(bytes.clone(), offset, count))
}

fn range_of(bytes: Arc<[u8]>, offset: u64, count: u64) -> Box<dyn Read + Send> {
    let mut cursor = Cursor::new(bytes);
    cursor.set_position(offset);
    Box::new(cursor.take(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(mut reader: Box<dyn Read + Send>) -> Vec<u8> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).expect("it is in memory");
        bytes
    }

    #[test]
    fn files_are_kept_within_the_memory() {
        let files = WholeFiles::new(10);
        assert!(!files.is_needed());
        let keep = |name: &str, bytes: &'static [u8], range| {
            let slot = files.slot(name);
            let mut kept = slot.lock().expect("nobody panics");
            files.keep(&mut kept, bytes, Some(size(bytes.len())), range).map(read)
        };
        let kept = |name: &str, offset, count| {
            kept_range(&files.slot(name).lock().expect("nobody panics"), offset, count).map(read)
        };
        assert_eq!(keep("a", b"012345", (1, 2)), Ok(b"12".to_vec()));
        assert!(files.is_needed());
        assert_eq!(kept("a", 4, 2), Some(b"45".to_vec()));
        // It may have grown since.
        assert_eq!(kept("a", 4, 3), None);
        assert_eq!(keep("b", b"abcde", (4, 1)), Ok(b"e".to_vec()));
        assert_eq!(kept("a", 0, 1), None);
        // What is too large is read through, or refused if nobody has said how large it is.
        assert_eq!(keep("c", b"0123456789x", (9, 2)), Ok(b"9x".to_vec()));
        assert_eq!(kept("c", 0, 1), None);
        let slot = files.slot("c");
        let refused = files.keep(&mut slot.lock().expect("nobody panics"), &b"0123456789x"[..], None, (0, 1));
        assert!(matches!(refused, Err(Fault::Wrong(_))));
    }
}
