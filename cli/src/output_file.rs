//! Files appear whole or not at all: written under another name beside it, then renamed.

use crate::failure::Failure;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::TempPath;

/// A file that is being written. Dropped before [`OutputFile::finish`], it leaves nothing on the disk.
pub(crate) struct OutputFile {
    writer: BufWriter<File>,
    /// The name that it has until it is whole.
    temporary: TempPath,
    path: PathBuf,
}

impl OutputFile {
    /// A file that will be at `path`.
    pub(crate) fn create(path: &Path) -> Result<Self, Failure> {
        let parent = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if !parent.is_dir() {
            let (path, parent) = (path.display(), parent.display());
            return Err(Failure::other(format!(
                "{path}: cannot write: there is no directory {parent}\n  make it first"
            )));
        }
        if path.is_dir() {
            return Err(Failure::other(format!(
                "{} is a directory: give the name of a file",
                path.display()
            )));
        }
        let file = builder().tempfile_in(parent).map_err(|error| Failure::file("write", path, &error))?;
        let (file, temporary) = file.into_parts();
        Ok(Self { writer: BufWriter::with_capacity(1 << 20, file), temporary, path: path.to_path_buf() })
    }

    /// Gives the file its name, in place of one that may be there.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        let failed = |error: std::io::Error| Failure::file("write", &self.path, &error);
        self.writer.into_inner().map_err(|error| failed(error.into_error()))?;
        self.temporary.persist(&self.path).map_err(|error| failed(error.error))
    }

    /// Writes a whole file.
    pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        let mut file = Self::create(path)?;
        file.writer.write_all(bytes).map_err(|error| Failure::file("write", path, &error))?;
        file.finish()
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.flush()
    }
}

/// Temporary files are private to their owner; what becomes a result has the permissions of any other file.
fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".splatstream-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder
}

/// Makes a directory and those above it.
pub(crate) fn make_directory(path: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(path).map_err(|error| Failure::file("make the directory", path, &error))
}
