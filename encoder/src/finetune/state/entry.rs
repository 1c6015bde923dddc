//! The file of one fit: under way, or finished.

use super::super::state_error::StateError;
pub(in crate::finetune) use super::exchange::{Exchange, Keep};
use super::exchange::{Reading, Writing};
use super::{damaged, replace};
use std::fs::File;
use std::io::{self, BufReader};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What the file of a fit begins with.
const MAGIC: [u8; 8] = *b"SPLATFT3";

/// Writing takes no more than one part of so many of the time.
const PARTS: u32 = 20;

/// What a file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::finetune) enum Stage {
    UnderWay = 0,
    Finished = 1,
}

/// Where a fit is kept.
pub(in crate::finetune) struct Entry {
    path: PathBuf,
    /// What the fit starts from.
    key: u64,
    /// When it was written last, and what that took.
    written: Instant,
    took: Duration,
}

impl Entry {
    pub(super) fn new(path: PathBuf, key: u64) -> Self {
        Self { path, key, written: Instant::now(), took: Duration::ZERO }
    }

    /// Whether it may be written again.
    pub(in crate::finetune) fn is_due(&self) -> bool {
        self.written.elapsed() >= self.took.saturating_mul(PARTS)
    }

    /// Writes a fit in the place of what is there.
    ///
    /// # Errors
    /// Those of the file.
    pub(in crate::finetune) fn write(&mut self, stage: Stage, fit: &mut dyn Keep) -> Result<(), StateError> {
        let start = Instant::now();
        replace(&self.path, |file| {
            let mut file = Writing::new(file);
            self.head(&mut file, stage)?;
            fit.exchange(&mut file)?;
            file.finish()
        })?;
        (self.written, self.took) = (Instant::now(), start.elapsed());
        Ok(())
    }

    /// Reads a fit, if there is one at this stage; tells whether there was. What could not be read leaves it in no state to be
    /// used.
    ///
    /// # Errors
    /// A file that cannot be read, or that is not as it was written.
    pub(in crate::finetune) fn read(&self, stage: Stage, fit: &mut dyn Keep) -> Result<bool, StateError> {
        let failed = |source: io::Error| match source.kind() {
            io::ErrorKind::UnexpectedEof => damaged(&self.path, "it is too short"),
            io::ErrorKind::InvalidData => damaged(&self.path, "it has values that cannot be"),
            _ => StateError::File { path: self.path.clone(), what: "read", source },
        };
        let file = match File::open(&self.path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            file => file.map_err(failed)?,
        };
        let mut file = Reading::new(BufReader::with_capacity(1 << 20, file));
        let found = self.head(&mut file, stage).map_err(failed)?;
        if found != stage as u8 {
            // The other one: whatever else it may be, that is found when it is asked for.
            return match (stage, found) {
                (Stage::UnderWay, 1) | (Stage::Finished, 0) => Ok(false),
                _ => Err(damaged(&self.path, "it has values that cannot be")),
            };
        }
        fit.exchange(&mut file).map_err(failed)?;
        match file.finish().map_err(failed)? {
            true => Ok(true),
            false => Err(damaged(&self.path, "its checksum or its length is wrong")),
        }
    }

    /// What a file begins with; gives the stage that is found.
    fn head(&self, file: &mut dyn Exchange, stage: Stage) -> io::Result<u8> {
        let (mut magic, mut key, mut found) = (MAGIC, self.key.to_le_bytes(), [stage as u8]);
        file.bytes(&mut magic)?;
        file.bytes(&mut key)?;
        file.bytes(&mut found)?;
        let [found] = found;
        match (magic, u64::from_le_bytes(key)) == (MAGIC, self.key) {
            true => Ok(found),
            false => Err(io::ErrorKind::InvalidData.into()),
        }
    }
}
