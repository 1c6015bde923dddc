//! Files without a name: they go away with the program, whatever ends it, even where it cannot do anything about it.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, openat};

/// Where the system shows the files that a program has open. Whoever opens one of these, or links to it, has the file.
const OPEN_FILES: &str = "/proc/self/fd";

/// A file without a name.
pub(super) struct Nameless {
    /// Held, so that it stays.
    file: File,
}

impl Nameless {
    /// A file on the disk of a directory, and what writes to it. None where the file system has no such files, or the
    /// system does not show them.
    pub(super) fn create(directory: &Path, mode: u32) -> Option<(File, Self)> {
        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        let file = File::from(openat(CWD, directory, flags, Mode::from_raw_mode(mode)).ok()?);
        let nameless = Self { file };
        nameless.path().metadata().ok()?;
        Some((nameless.file.try_clone().ok()?, nameless))
    }

    /// Where this program finds it.
    pub(super) fn path(&self) -> PathBuf {
        Path::new(OPEN_FILES).join(self.file.as_raw_fd().to_string())
    }

    /// Gives it a name, in place of a file that may have it. A link replaces nothing: where a file has the name, this one
    /// gets another, made with `builder`, for the moment that renaming takes.
    pub(super) fn link(&self, name: &Path, builder: &tempfile::Builder<'_, '_>) -> io::Result<()> {
        let from = self.path();
        let link =
            |name: &Path| -> io::Result<()> { Ok(linkat(CWD, &from, CWD, name, AtFlags::SYMLINK_FOLLOW)?) };
        match link(name) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            linked => return linked,
        }
        let directory = name.parent().filter(|parent| !parent.as_os_str().is_empty());
        let other = builder.make_in(directory.unwrap_or(Path::new(".")), link)?.into_temp_path();
        other.persist(name).map_err(|error| error.error)
    }
}
