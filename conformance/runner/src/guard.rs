//! The limits of a case while its decoder runs.

use crate::answer::Ending;
use crate::group::Group;
use crate::limits::Limits;
use crate::stop::Stop;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// Between two looks at memory and output.
const LOOK: Duration = Duration::from_millis(20);
/// The shortest and the longest wait for an answer. Most come at once; one that takes long is not hurried by asking.
const WAIT: [Duration; 2] = [Duration::from_micros(300), Duration::from_millis(5)];

/// Looks after one case.
pub(crate) struct Guard<'a> {
    limits: &'a Limits,
    stop: &'a Stop,
    /// The folder with all that the decoder writes in this case.
    folder: &'a Path,
    start: Instant,
    looked: Instant,
    wait: Duration,
}

impl<'a> Guard<'a> {
    /// A guard for a case that starts now.
    pub(crate) fn new(limits: &'a Limits, stop: &'a Stop, folder: &'a Path) -> Self {
        let now = Instant::now();
        Self { limits, stop, folder, start: now, looked: now, wait: WAIT[0] }
    }

    /// How long to wait for an answer before the next look.
    pub(crate) fn wait(&mut self) -> Duration {
        let wait = self.wait;
        self.wait = wait.saturating_mul(3).min(WAIT[1]);
        wait
    }

    /// Time since the case started.
    pub(crate) fn took(&self) -> Duration {
        self.start.elapsed()
    }

    /// Why the decoder is not to go on, if so: a limit that it has passed, or the end of the run.
    pub(crate) fn look(&mut self, group: &Group) -> Option<Ending> {
        if self.stop.is_set() {
            return Some(Ending::Stopped);
        }
        if self.took() > self.limits.time {
            return Some(Ending::TimedOut);
        }
        if self.looked.elapsed() < LOOK {
            return None;
        }
        self.looked = Instant::now();
        if group.memory() > self.limits.memory {
            return Some(Ending::TooMuchMemory);
        }
        self.look_at_output()
    }

    /// Whether too much was written, the last look included: the kernel may have stopped the decoder in between.
    pub(crate) fn look_at_output(&self) -> Option<Ending> {
        (size_of(self.folder) >= self.limits.output).then_some(Ending::TooMuchOutput)
    }
}

/// Bytes of the files in a folder. Links are not followed.
fn size_of(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let size = |entry: fs::DirEntry| match entry.metadata() {
        Ok(metadata) if metadata.is_dir() => size_of(&entry.path()),
        Ok(metadata) => metadata.len(),
        Err(_) => 0,
    };
    entries.map(size).sum()
}
