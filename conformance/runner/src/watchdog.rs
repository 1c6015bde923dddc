//! Enforces the limits of a case while its decoder runs.

use crate::answer::Ending;
use crate::cancel::Cancel;
use crate::limits::Limits;
use crate::process_group::ProcessGroup;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two checks of memory and output.
const INTERVAL: Duration = Duration::from_millis(20);
/// The shortest and the longest wait for an answer: most answers come at once.
const WAIT: [Duration; 2] = [Duration::from_micros(300), Duration::from_millis(5)];

/// The watchdog of one case.
pub(crate) struct Watchdog<'a> {
    limits: &'a Limits,
    cancel: &'a Cancel,
    /// The folder with all that the decoder writes in this case.
    folder: &'a Path,
    start: Instant,
    checked: Instant,
    wait: Duration,
}

impl<'a> Watchdog<'a> {
    /// A watchdog for a case that starts now.
    pub(crate) fn new(limits: &'a Limits, cancel: &'a Cancel, folder: &'a Path) -> Self {
        let now = Instant::now();
        Self { limits, cancel, folder, start: now, checked: now, wait: WAIT[0] }
    }

    /// How long to wait for an answer before the next check.
    pub(crate) fn wait(&mut self) -> Duration {
        let wait = self.wait;
        self.wait = wait.saturating_mul(3).min(WAIT[1]);
        wait
    }

    /// Time since the case started.
    pub(crate) fn took(&self) -> Duration {
        self.start.elapsed()
    }

    /// Why the decoder has to end, if so: a limit that it has exceeded, or the end of the run.
    pub(crate) fn check(&mut self, group: &ProcessGroup) -> Option<Ending> {
        if self.cancel.is_set() {
            return Some(Ending::Cancelled);
        }
        if self.took() > self.limits.time {
            return Some(Ending::TimedOut);
        }
        if self.checked.elapsed() < INTERVAL {
            return None;
        }
        self.checked = Instant::now();
        if group.memory() > self.limits.memory {
            return Some(Ending::TooMuchMemory);
        }
        self.check_output()
    }

    /// Whether too much was written. Also called after the decoder has ended: the kernel may have stopped it.
    pub(crate) fn check_output(&self) -> Option<Ending> {
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
