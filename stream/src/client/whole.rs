//! Files of a server that does not answer with ranges of bytes: each is fetched whole, once, and kept.
//!
//! Nobody knows how long such an answer is before it ends, and there may be many files. So the bytes of all of them count
//! together, kept or on their way, as they come; no file may be longer than the manifest lets expect; and one
//! that nobody waits for any more is read no further, until somebody does.

use crate::control::number::size;
use crate::manifest::Manifest;
use crate::playback::Fault;
use std::collections::HashMap;
use std::fmt;
use std::io::{self, ErrorKind, Read};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The bytes of a file, once they are there. Who fetches it holds the lock, so that nobody fetches it a second time.
type Slot = Arc<Mutex<Kept>>;

/// What there is of a file.
#[derive(Default)]
pub(super) struct Kept {
    /// All of it.
    whole: Option<Arc<Blocks>>,
    /// The beginning, for which nobody waited any more: who wants the file next goes on with it.
    paused: Option<Coming>,
}

impl fmt::Debug for Kept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Kept").field("whole", &self.whole).finish_non_exhaustive()
    }
}

/// A file on its way: what has come, and where the rest comes from.
struct Coming {
    blocks: Blocks,
    body: Box<dyn Read + Send>,
}

/// Bytes that are read at once, and that lie together in memory.
const BLOCK: usize = 1 << 16;

/// Why a file is not kept.
const TOO_LARGE: Fault = Fault::Wrong(
    "the server does not answer with ranges of bytes, and the file is too large to be kept whole",
);

/// Why a file is not what the package has.
const UNEXPECTED: Fault = Fault::Wrong("the file is larger than the manifest says");

/// Why a file is not read on.
const UNWANTED: Fault = Fault::Wrong("nobody waits for the file any more");

/// What was fetched whole.
#[derive(Debug)]
pub(super) struct WholeFiles {
    /// Whether the server has sent a whole file in place of a range.
    is_needed: AtomicBool,
    /// Bytes of all files together, at most.
    memory: u64,
    /// Bytes that are held: of what is kept, of what is being fetched and of what is being read after it was let go of.
    held: Arc<AtomicU64>,
    files: Mutex<HashMap<String, Slot>>,
    /// Bytes of files, at most, as the manifest has them.
    expected: Mutex<HashMap<String, u64>>,
}

/// A file that is to be kept: what the server said of its length, and who waits for it.
pub(super) struct Wanted<'a> {
    pub(super) file: &'a str,
    pub(super) length: Option<u64>,
    /// First byte and count.
    pub(super) range: (u64, u64),
    /// Whether somebody waits for it.
    pub(super) is_wanted: &'a dyn Fn() -> bool,
}

impl WholeFiles {
    pub(super) fn new(memory: u64) -> Self {
        Self {
            is_needed: AtomicBool::new(false),
            memory,
            held: Arc::default(),
            files: Mutex::default(),
            expected: Mutex::default(),
        }
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

    /// Takes from a manifest how large files can be. Files of a live package end with what is listed of them, as only GOPs
    /// to which nothing comes any more are fetched.
    pub(super) fn expect(&self, manifest: &Manifest) {
        let mut expected: HashMap<String, u64> = HashMap::new();
        let mut raise = |file: &str, bytes: u64| match expected.get_mut(file) {
            Some(known) => *known = bytes.max(*known),
            None => drop(expected.insert(file.to_owned(), bytes)),
        };
        for one in &manifest.representations {
            raise(&one.file, one.bytes);
        }
        let all = manifest.gops.iter().flat_map(|gop| &gop.subsegments);
        for (file, level) in all.filter_map(|one| one.file.as_deref().zip(one.levels.last())) {
            raise(file, level.bytes.offset.saturating_add(level.bytes.size));
        }
        *self.expected.lock().unwrap_or_else(PoisonError::into_inner) = expected;
    }

    /// Bytes of a file, at most.
    fn limit(&self, file: &str) -> u64 {
        let expected = self.expected.lock().unwrap_or_else(PoisonError::into_inner);
        expected.get(file).copied().unwrap_or(u64::MAX)
    }

    /// Reads a file to its end into its place and gives a range of it. Files that were kept before go where there is no room
    /// for all of them; one that is itself too large is read up to the range, each time.
    pub(super) fn keep(
        &self,
        kept: &mut Kept,
        mut body: impl Read + Send + 'static,
        wanted: &Wanted<'_>,
    ) -> Result<Box<dyn Read + Send>, Fault> {
        if wanted.length.is_some_and(|length| length > self.limit(wanted.file)) {
            return Err(UNEXPECTED);
        }
        if wanted.length.is_some_and(|length| length > self.memory) {
            skip(&mut body, wanted.range.0, wanted)?;
            return Ok(Box::new(body.take(wanted.range.1)));
        }
        let blocks = Blocks { held: self.held.clone(), length: 0, blocks: Vec::new() };
        // What is there of an earlier length of the file makes room for it.
        *kept = Kept { whole: None, paused: Some(Coming { blocks, body: Box::new(body) }) };
        self.go_on(kept, wanted).unwrap_or(Err(TOO_LARGE))
    }

    /// Does so with a file that is on its way; nothing if none is.
    pub(super) fn go_on(
        &self,
        kept: &mut Kept,
        wanted: &Wanted<'_>,
    ) -> Option<Result<Box<dyn Read + Send>, Fault>> {
        let mut coming = kept.paused.take()?;
        let is_whole = self.read(&mut coming, wanted);
        Some(is_whole.and_then(|is_whole| {
            if !is_whole {
                kept.paused = Some(coming);
                return Err(UNWANTED);
            }
            let blocks = Arc::new(coming.blocks);
            kept.whole = Some(blocks.clone());
            Ok(range_of(blocks, wanted.range.0, wanted.range.1))
        }))
    }

    /// Reads a body, whose bytes are counted before they are held, to its end or as long as somebody waits for it.
    fn read(&self, coming: &mut Coming, wanted: &Wanted<'_>) -> Result<bool, Fault> {
        let limit = self.limit(wanted.file);
        let Coming { blocks, body } = coming;
        let mut read = vec![0; BLOCK];
        while (wanted.is_wanted)() {
            let count = read_some(body, &mut read)?;
            if count == 0 {
                blocks.close();
                return Ok(true);
            }
            let bytes = read.get(..count).unwrap_or_default();
            if blocks.length.saturating_add(size(count)) > limit {
                return Err(UNEXPECTED);
            }
            self.count(size(count))?;
            blocks.append(bytes);
        }
        Ok(false)
    }

    /// Counts bytes. Where there is no room for them, what was kept makes room.
    fn count(&self, bytes: u64) -> Result<(), Fault> {
        let with = |held: u64| held.checked_add(bytes).filter(|held| *held <= self.memory);
        let fits = || self.held.fetch_update(Ordering::Relaxed, Ordering::Relaxed, with).is_ok();
        if fits() {
            return Ok(());
        }
        self.make_room();
        if fits() { Ok(()) } else { Err(TOO_LARGE) }
    }

    /// Lets go of all files but those that are being fetched now. What is read of them meanwhile counts until that has ended.
    fn make_room(&self) {
        self.all().retain(|_, slot| slot.try_lock().is_err());
    }
}

/// The bytes of a file, in blocks, so that nothing is copied where they become more. They count as long as somebody has them.
#[derive(Debug)]
pub(super) struct Blocks {
    /// Where they count.
    held: Arc<AtomicU64>,
    length: u64,
    /// All have [`BLOCK`] bytes but the last.
    blocks: Vec<Vec<u8>>,
}

impl Blocks {
    /// Appends bytes that have been counted.
    fn append(&mut self, mut bytes: &[u8]) {
        self.length = self.length.saturating_add(size(bytes.len()));
        while !bytes.is_empty() {
            let last = self.blocks.pop_if(|last| last.len() < BLOCK);
            let mut last = last.unwrap_or_else(|| Vec::with_capacity(BLOCK));
            let (now, later) = bytes.split_at(bytes.len().min(BLOCK.saturating_sub(last.len())));
            last.extend_from_slice(now);
            self.blocks.push(last);
            bytes = later;
        }
    }

    /// Nothing is appended any more.
    fn close(&mut self) {
        if let Some(last) = self.blocks.last_mut() {
            last.shrink_to_fit();
        }
    }

    /// The bytes from one on that lie together.
    fn from(&self, offset: u64) -> &[u8] {
        let Ok(offset) = usize::try_from(offset) else { return &[] };
        let (block, within) = (offset.checked_div(BLOCK), offset.checked_rem(BLOCK));
        let block = block.and_then(|block| self.blocks.get(block));
        block.zip(within).and_then(|(block, within)| block.get(within..)).unwrap_or_default()
    }
}

impl Drop for Blocks {
    fn drop(&mut self) {
        self.held.fetch_sub(self.length, Ordering::Relaxed);
    }
}

/// Bytes of a file from one on.
struct Reader {
    blocks: Arc<Blocks>,
    at: u64,
}

impl Read for Reader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.blocks.from(self.at).read(buffer)?;
        self.at = self.at.saturating_add(size(count));
        Ok(count)
    }
}

/// A range of a file that has been kept, if all of it is there: files of a presentation that grows may have become longer.
pub(super) fn kept_range(kept: &Kept, offset: u64, count: u64) -> Option<Box<dyn Read + Send>> {
    let blocks = kept.whole.as_ref().filter(|blocks| blocks.length >= offset.saturating_add(count))?;
    Some(range_of(blocks.clone(), offset, count))
}

fn range_of(blocks: Arc<Blocks>, at: u64, count: u64) -> Box<dyn Read + Send> {
    Box::new(Reader { blocks, at }.take(count))
}

/// The next bytes of a body.
fn read_some(body: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    loop {
        match body.read(buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            read => return read,
        }
    }
}

/// Reads bytes that are not kept.
fn skip(body: &mut impl Read, bytes: u64, wanted: &Wanted<'_>) -> Result<(), Fault> {
    let mut body = body.take(bytes);
    let mut buffer = vec![0; BLOCK];
    while (wanted.is_wanted)() {
        if read_some(&mut body, &mut buffer)? == 0 {
            return Ok(());
        }
    }
    Err(UNWANTED)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::package::{Options as Packaging, Package};
    use std::io::Cursor;

    fn wanted(file: &str, length: Option<u64>, range: (u64, u64)) -> Wanted<'_> {
        Wanted { file, length, range, is_wanted: &|| true }
    }

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
            files.keep(&mut kept, bytes, &wanted(name, Some(size(bytes.len())), range)).map(read)
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
        let refused = files.keep(
            &mut slot.lock().expect("nobody panics"),
            &b"0123456789x"[..],
            &wanted("c", None, (0, 1)),
        );
        assert_eq!(refused.map(read), Err(TOO_LARGE));
        // Nothing counts any more but what is kept.
        files.forget();
        assert_eq!(files.held.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn files_that_are_on_their_way_count() {
        let files = WholeFiles::new(10);
        let (first, second) = (files.slot("a"), files.slot("b"));
        let mut first = first.lock().expect("nobody panics");
        let mut second = second.lock().expect("nobody panics");
        // Both are being fetched, so neither makes room for the other.
        assert!(files.keep(&mut first, &b"012345"[..], &wanted("a", None, (0, 1))).is_ok());
        let refused = files.keep(&mut second, &b"01234"[..], &wanted("b", None, (0, 1)));
        assert_eq!(refused.map(read), Err(TOO_LARGE));
        // What is let go of counts until nobody reads it any more.
        let reader = kept_range(&first, 0, 6);
        first.whole = None;
        assert_eq!(files.held.load(Ordering::Relaxed), 6);
        drop(reader);
        assert!(files.keep(&mut second, &b"01234"[..], &wanted("b", None, (0, 1))).is_ok());
    }

    #[test]
    fn files_have_as_many_bytes_as_the_manifest_says() {
        let stream = include_bytes!("../../../spec/data/worked-temporal-example.gss");
        let limits = splatstream_format::Limits::default();
        let package = Package::of(stream, &Packaging::default(), &limits).expect("it conforms");
        let (file, bytes) = package
            .manifest
            .representations
            .first()
            .map(|one| (&one.file, one.bytes))
            .expect("it has a base");
        let files = WholeFiles::new(1 << 30);
        files.expect(&package.manifest);
        let keep = |length, count| {
            let mut kept = Kept::default();
            files.keep(&mut kept, io::repeat(1).take(count), &wanted(file, length, (0, 1))).map(read)
        };
        assert_eq!(keep(None, bytes), Ok(vec![1]));
        assert_eq!(keep(Some(bytes + 1), 0), Err(UNEXPECTED));
        // It is read no further than to the first byte that cannot be.
        assert_eq!(keep(None, u64::MAX), Err(UNEXPECTED));
        assert_eq!(files.held.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn long_files_are_read_across_blocks() {
        let files = WholeFiles::new(1 << 30);
        let bytes: Vec<u8> = (0..200_000_u32).flat_map(u32::to_le_bytes).collect();
        let mut kept = Kept::default();
        let body = Cursor::new(bytes.clone());
        let range = files.keep(&mut kept, body, &wanted("a", None, (65_530, 300_000))).map(read);
        assert!(range == Ok(bytes[65_530..365_530].to_vec()));
        assert!(kept_range(&kept, 0, 800_000).map(read) == Some(bytes));
    }

    #[test]
    fn what_nobody_waits_for_is_read_when_somebody_does() {
        let files = WholeFiles::new(1 << 30);
        let reads = AtomicU64::new(2);
        let is_wanted =
            || reads.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_ok();
        let some = Wanted { file: "a", length: None, range: (0, 1), is_wanted: &is_wanted };
        let mut kept = Kept::default();
        assert!(files.go_on(&mut kept, &some).is_none());
        // Two reads of an endless body, and two more of it.
        for held in [2, 4] {
            reads.store(2, Ordering::Relaxed);
            let result = match files.go_on(&mut kept, &some) {
                Some(result) => result,
                None => files.keep(&mut kept, io::repeat(0), &some),
            };
            assert_eq!(result.map(read), Err(UNWANTED));
            assert_eq!(files.held.load(Ordering::Relaxed), held * size(BLOCK));
        }
        drop(kept);
        assert_eq!(files.held.load(Ordering::Relaxed), 0);
        // A beginning makes room for others.
        let files = WholeFiles::new(10);
        let slot = files.slot("a");
        let body = b"012345".chain(io::repeat(0));
        reads.store(1, Ordering::Relaxed);
        assert_eq!(
            files.keep(&mut slot.lock().expect("nobody panics"), body, &some).map(read),
            Err(UNWANTED)
        );
        drop(slot);
        assert!(files.keep(&mut Kept::default(), &b"01234"[..], &wanted("b", None, (0, 1))).is_ok());
    }
}
