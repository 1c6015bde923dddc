//! Files appear whole or not at all: written under another name beside it, then renamed. None replaces what a command
//! reads, a directory or a device; what is at the end of a symbolic link is replaced, not the link.

use crate::failure::Failure;
use crate::standard::{STANDARD, behind_input, behind_output, is_standard};
use crate::unfinished::{self, Unfinished};
use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// The links that a name may go through.
const MAX_LINKS: usize = 40;

/// A file that is being written. Dropped before [`OutputFile::finish`], it leaves nothing on the disk.
pub(crate) struct OutputFile {
    /// Before the file, so that it is closed first.
    writer: BufWriter<Box<dyn Write>>,
    /// The file until it is whole, and its final path; none for standard output, devices and pipes.
    unfinished: Option<(Unfinished, PathBuf)>,
    path: PathBuf,
}

impl OutputFile {
    /// A file that will be at `path`, or standard output; not in the place of what is read. `inputs` are files that the
    /// command reads.
    pub(crate) fn create(path: &Path, inputs: &[PathBuf]) -> Result<Self, Failure> {
        let (writer, unfinished): (Box<dyn Write>, _) = if is_standard(path) {
            refuse_terminal(io::stdout().is_terminal(), path)?;
            refuse_inputs(path, inputs)?;
            (Box::new(io::stdout()), None)
        } else {
            refuse_inputs(path, inputs)?;
            match path.metadata() {
                Ok(found) if found.is_dir() => return Err(is_directory(path)),
                Ok(found) if !found.is_file() => (Box::new(open_device(path, &found)?), None),
                found => {
                    let target = end_of_links(path)?;
                    let (file, unfinished) = beside(path, &target, found.ok().as_ref())?;
                    (Box::new(file), Some((unfinished, target)))
                }
            }
        };
        let writer = BufWriter::with_capacity(1 << 20, writer);
        Ok(Self { writer, unfinished, path: path.to_path_buf() })
    }

    /// A file that will be at `place` for now, and at `path` when all files are there that belong together. `inputs` are not
    /// replaced by it then.
    pub(crate) fn stage(path: &Path, place: &Path, inputs: &[PathBuf]) -> Result<Self, Failure> {
        refuse_inputs(path, inputs)?;
        if path.is_dir() {
            return Err(is_directory(path));
        }
        let (file, unfinished) = beside(path, place, None)?;
        let writer: BufWriter<Box<dyn Write>> = BufWriter::with_capacity(1 << 20, Box::new(file));
        Ok(Self { writer, unfinished: Some((unfinished, place.to_path_buf())), path: path.to_path_buf() })
    }

    /// Where it will be.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its name, in place of one that may be there.
    pub(crate) fn finish(mut self) -> Result<(), Failure> {
        let failed = |error: io::Error| Failure::file("write", &self.path, &error);
        self.writer.flush().map_err(failed)?;
        match self.unfinished {
            None => Ok(()),
            Some((unfinished, target)) => unfinished.rename(&target).map_err(failed),
        }
    }

    /// Writes a whole file that is made of nothing that a user named.
    pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        Self::write_apart(path, &[], bytes)
    }

    /// Writes a whole file, not in the place of `inputs`.
    pub(crate) fn write_apart(path: &Path, inputs: &[PathBuf], bytes: &[u8]) -> Result<(), Failure> {
        Self::create(path, inputs)?.finish_with(bytes)
    }

    /// Writes the last bytes, and gives the file its name.
    pub(crate) fn finish_with(mut self, bytes: &[u8]) -> Result<(), Failure> {
        let written = self.writer.write_all(bytes);
        written.map_err(|error| Failure::file("write", &self.path, &error))?;
        self.finish()
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Refuses standard output for a file whose command reports there.
pub(crate) fn refuse_standard(path: &Path) -> Result<(), Failure> {
    match is_standard(path) {
        true => Err(Failure::Usage(format!("{}: the report goes there; give a file", path.display()))),
        false => Ok(()),
    }
}

/// Nobody wants to lose what a command reads to what it writes, also where a shell has opened either.
pub(crate) fn refuse_inputs(path: &Path, inputs: &[PathBuf]) -> Result<(), Failure> {
    if inputs.iter().any(|input| is_same_file(path, input)) {
        let what = match is_standard(path) {
            true => "this command reads the file that standard output goes to; send it to another",
            false => "this command reads that file; give the output another name",
        };
        return Err(Failure::Usage(format!("{}: {what}", path.display())));
    }
    Ok(())
}

/// Refuses a name for a stream that promises another format, or none that there is.
pub(crate) fn check_stream_name(path: &Path) -> Result<(), Failure> {
    if !has_other_ending(path, "gss") {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "{}: the output is a stream; give it a name that ends in .gss; \
         `splatstream decode` writes .ply, .spz, .splat, .glb, .sog and .compressed.ply",
        path.display()
    )))
}

/// Refuses a name that promises another format than that of `what`, whose names end in `.ending`.
pub(crate) fn check_ending(path: &Path, ending: &str, what: &str) -> Result<(), Failure> {
    match has_other_ending(path, ending) {
        true => Err(Failure::Usage(format!(
            "{}: the output is {what}; give it a name that ends in .{ending}",
            path.display()
        ))),
        false => Ok(()),
    }
}

/// Whether the name of a file promises another format; devices and pipes have any name, as has a file without an ending.
fn has_other_ending(path: &Path, ending: &str) -> bool {
    let is_other = path.extension().is_some_and(|found| !found.eq_ignore_ascii_case(ending));
    is_other && !path.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Refuses a name that is not a directory, or that looks like that of a file; `what` goes there.
pub(crate) fn check_directory(path: &Path, what: &str) -> Result<(), Failure> {
    let name = path.display();
    if is_standard(path) || path.exists() && !path.is_dir() {
        return Err(Failure::Usage(format!(
            "{name}: this is not a directory; {what} are written to a directory"
        )));
    }
    if path.is_dir() || path.extension().is_none() || ends_with_separator(path) {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "{name}: this looks like the name of a file, but {what} are written to a directory; for a directory of this name, write {name}/"
    )))
}

/// Whether a path says that it is a directory.
pub(crate) fn ends_with_separator(path: &Path) -> bool {
    path.to_string_lossy().ends_with(std::path::is_separator)
}

/// Binary data spoil a terminal.
pub(crate) fn refuse_terminal(is_terminal: bool, path: &Path) -> Result<(), Failure> {
    if is_terminal {
        let path = path.display();
        return Err(Failure::Usage(format!(
            "{path}: is a terminal, which cannot show this; give a file, or pipe it into another command"
        )));
    }
    Ok(())
}

/// Makes a directory and those above it; what stays empty goes away where the command fails.
pub(crate) fn make_directory(path: &Path) -> Result<(), Failure> {
    unfinished::make_directory(path).map_err(|error| Failure::file("make the directory", path, &error))
}

/// Devices and pipes are written to as they are.
fn open_device(path: &Path, found: &Metadata) -> Result<File, Failure> {
    if is_block_device(found) {
        let path = path.display();
        return Err(Failure::Usage(format!("{path}: is a disk; give the name of a file")));
    }
    let file = OpenOptions::new().write(true).open(path);
    let file = file.map_err(|error| Failure::file("write", path, &error))?;
    refuse_terminal(file.is_terminal(), path)?;
    Ok(file)
}

/// A file beside `target`, which `path` leads to, with the permissions of the one that it will replace.
fn beside(path: &Path, target: &Path, old: Option<&Metadata>) -> Result<(File, Unfinished), Failure> {
    let parent = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !parent.is_dir() {
        let (path, parent) = (path.display(), parent.display());
        return Err(Failure::other(format!(
            "{path}: cannot write: there is no directory {parent}\n  create it first"
        )));
    }
    let failed = |error: io::Error| Failure::file("write", path, &without_path(error));
    if old.is_some() {
        // A file that may not be written may not be replaced either.
        OpenOptions::new().write(true).open(target).map_err(failed)?;
    }
    let (file, unfinished) = Unfinished::create(parent, true).map_err(failed)?;
    if let Some(old) = old {
        file.set_permissions(old.permissions()).map_err(failed)?;
    }
    Ok((file, unfinished))
}

/// An error of the system without the name of a temporary file, which says nothing to anybody.
fn without_path(error: io::Error) -> io::Error {
    match error.to_string().split_once(" at path ") {
        Some((text, _)) => io::Error::new(error.kind(), text.to_owned()),
        None => error,
    }
}

/// Where a name leads by symbolic links, whether or not there is something.
fn end_of_links(path: &Path) -> Result<PathBuf, Failure> {
    let mut target = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        let Ok(next) = std::fs::read_link(&target) else { return Ok(target) };
        target = target.parent().unwrap_or(Path::new("")).join(next);
    }
    Err(Failure::other(format!("{}: too many symbolic links", path.display())))
}

/// Whether the names of an output and of an input lead to one file; devices are no files that could be lost.
fn is_same_file(output: &Path, input: &Path) -> bool {
    let found = if is_standard(output) { behind_output() } else { output.metadata().ok() };
    let Some(found) = found.filter(Metadata::is_file) else { return false };
    let redirected = if input == Path::new(STANDARD) { behind_input() } else { None };
    let is_named = |named: Metadata| {
        let is_one = || output.canonicalize().is_ok_and(|path| input.canonicalize().ok() == Some(path));
        is_same_inode(&found, &named) || is_one()
    };
    redirected.is_some_and(|redirected| is_same_inode(&found, &redirected))
        || input.metadata().is_ok_and(is_named)
}

#[cfg(unix)]
fn is_same_inode(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn is_same_inode(_: &Metadata, _: &Metadata) -> bool {
    false
}

#[cfg(unix)]
fn is_block_device(found: &Metadata) -> bool {
    std::os::unix::fs::FileTypeExt::is_block_device(&found.file_type())
}

#[cfg(not(unix))]
fn is_block_device(_: &Metadata) -> bool {
    false
}

fn is_directory(path: &Path) -> Failure {
    Failure::other(format!("{} is a directory: give the name of a file", path.display()))
}
