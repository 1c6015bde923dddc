//! Directories for files that get names of their own, such as frames and pictures. Between files of an earlier run nobody
//! could tell which are which: they are refused, or replaced all together if that is asked for.

use crate::failure::Failure;
use crate::numbers::counted;
use crate::output_file::{OutputFile, make_directory, refuse_inputs};
use crate::unfinished::{EARLIER, NEW, STAGING, Staging, files_below};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// A directory that a run writes to.
pub(crate) struct OutputDirectory {
    path: PathBuf,
    /// What no file may replace.
    inputs: Vec<PathBuf>,
    /// Files of an earlier run. Where there are any, new ones take their places when all of them are whole.
    earlier: Vec<PathBuf>,
    staging: Option<Staging>,
    /// Held, so that no two runs mix their files.
    _lock: Option<File>,
}

impl OutputDirectory {
    /// The directory at a path, which is made. `find` gives the files of an earlier run in it, which are `what` to people, if
    /// they may be replaced (`force`); none of them may be among `inputs`.
    pub(crate) fn new(
        path: &Path,
        find: impl FnOnce(&Path) -> Vec<PathBuf>,
        what: &str,
        inputs: &[PathBuf],
        force: bool,
    ) -> Result<Self, Failure> {
        make_directory(path)?;
        let lock = lock(path)?;
        let mut earlier = find(path);
        earlier.extend(cut_off(path));
        earlier.iter().try_for_each(|path| refuse_inputs(path, inputs))?;
        if !earlier.is_empty() && !force {
            let (directory, files) = (path.display(), counted(earlier.len() as u64, "file"));
            return Err(Failure::Usage(format!(
                "{directory}: the directory has {files} with names of {what}, probably from an earlier run; \
                 give another directory, or --force to replace them"
            )));
        }
        earlier.iter().try_for_each(|file| refuse_other_disk(file, path))?;
        if force {
            clear_killed(path);
        }
        Ok(Self { path: path.to_path_buf(), inputs: inputs.to_vec(), earlier, staging: None, _lock: lock })
    }

    /// One to which an earlier run has written, and that this one goes on with, perhaps beside others.
    pub(crate) fn resumed(path: &Path, inputs: &[PathBuf]) -> Result<Self, Failure> {
        make_directory(path)?;
        let (path, inputs) = (path.to_path_buf(), inputs.to_vec());
        Ok(Self { path, inputs, earlier: Vec::new(), staging: None, _lock: None })
    }

    /// Whether files of an earlier run are replaced at the end, and stay until then.
    pub(crate) fn replaces(&self) -> bool {
        !self.earlier.is_empty()
    }

    /// Files that go with those of the earlier run, or at once where it has left no others.
    pub(crate) fn replace_too(&mut self, files: impl Iterator<Item = PathBuf>) -> Result<(), Failure> {
        if self.replaces() {
            self.earlier.extend(files);
            return Ok(());
        }
        let remove = |file: PathBuf| {
            std::fs::remove_file(&file).map_err(|error| Failure::file("remove", &file, &error))
        };
        files.into_iter().try_for_each(remove)
    }

    /// The directory.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Where a file is in the end.
    pub(crate) fn path_of(&self, name: impl AsRef<Path>) -> PathBuf {
        self.path.join(name)
    }

    /// Where a file that was written is now.
    pub(crate) fn place_of(&self, name: impl AsRef<Path>) -> PathBuf {
        self.staging.as_ref().map_or_else(|| self.path_of(&name), |staging| staging.files().join(&name))
    }

    /// A file with a name in the directory, or below it.
    pub(crate) fn create(&mut self, name: impl AsRef<Path>) -> Result<OutputFile, Failure> {
        if self.replaces() {
            refuse_other_disk(&self.path_of(&name), &self.path)?;
        }
        if self.replaces() && self.staging.is_none() {
            let staging = Staging::create(&self.path);
            self.staging = Some(staging.map_err(|error| Failure::file("write to", &self.path, &error))?);
        }
        let (path, place) = (self.path_of(&name), self.place_of(&name));
        place.parent().map_or(Ok(()), make_directory)?;
        match self.staging {
            Some(_) => OutputFile::stage(&path, &place, &self.inputs),
            None => OutputFile::create(&path, &self.inputs),
        }
    }

    /// Writes a whole file.
    pub(crate) fn write(&mut self, name: impl AsRef<Path>, bytes: &[u8]) -> Result<(), Failure> {
        self.create(name)?.finish_with(bytes)
    }

    /// The run is complete: its files take the places of those of the earlier run, all at once. Directories that are empty
    /// then go away.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        let Some(staging) = self.staging else { return Ok(()) };
        let failed = |error| Failure::file("replace the files of an earlier run in", &self.path, &error);
        staging.replace(&self.earlier).map_err(failed)?;
        self.earlier.iter().for_each(|file| remove_empty(&self.path, file));
        Ok(())
    }

    /// Removes the files of an earlier run before the first new one comes. Nothing happens the second time.
    pub(crate) fn clear(&mut self) -> Result<(), Failure> {
        for file in self.earlier.drain(..) {
            std::fs::remove_file(&file).map_err(|error| Failure::file("remove", &file, &error))?;
            remove_empty(&self.path, &file);
        }
        Ok(())
    }
}

/// Refuses a file in a directory below another that is on another disk, as a link may lead there: it could not be moved, which would
/// be known only when all files are made.
#[cfg(unix)]
fn refuse_other_disk(file: &Path, directory: &Path) -> Result<(), Failure> {
    use std::os::unix::fs::MetadataExt;
    let disk_of = |path: &Path| path.metadata().map(|found| found.dev());
    let below = file.parent().unwrap_or(directory);
    match (disk_of(below), disk_of(directory)) {
        (Ok(disk), Ok(other)) if disk != other => Err(Failure::other(format!(
            "{}: it is on another disk than {}, and files of an earlier run are replaced by moving new ones there\n  \
             give another directory, or put both on one disk",
            below.display(),
            directory.display()
        ))),
        _ => Ok(()),
    }
}

#[cfg(not(unix))]
fn refuse_other_disk(_: &Path, _: &Path) -> Result<(), Failure> {
    Ok(())
}

/// Removes the directories below one that a file was in, if they are empty. One with other files stays, and so do those above it.
fn remove_empty(directory: &Path, file: &Path) {
    let below = |folder: &&Path| folder.starts_with(directory) && *folder != directory;
    let _none_left = file.ancestors().skip(1).take_while(below).try_for_each(std::fs::remove_dir);
}

/// Keeps other runs out of a directory. None where the system cannot lock it: that is no reason to write nothing.
fn lock(directory: &Path) -> Result<Option<File>, Failure> {
    let Ok(file) = File::open(directory) else { return Ok(None) };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::Error(_)) => Ok(None),
        Err(TryLockError::WouldBlock) => Err(Failure::other(format!(
            "{}: another run is writing to this directory\n  wait until it has ended, or give another directory",
            directory.display()
        ))),
    }
}

/// Directories of runs that were killed. No other run is there: the directory is locked.
fn killed(directory: &Path) -> impl Iterator<Item = PathBuf> {
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    let is_one = |name: &str| name.starts_with(STAGING);
    entries
        .filter(move |entry| entry.file_name().to_str().is_some_and(is_one))
        .map(|entry| entry.path())
        .filter(|path| path.is_dir() && !path.is_symlink())
}

/// Files of an earlier run that one was about to replace when it was killed.
fn cut_off(directory: &Path) -> Vec<PathBuf> {
    killed(directory).flat_map(|path| files_below(&path.join(EARLIER)).unwrap_or_default()).collect()
}

/// Removes what runs that were killed have left, but for files of runs before them.
fn clear_killed(directory: &Path) {
    for path in killed(directory) {
        let _gone_already = std::fs::remove_dir_all(path.join(NEW));
        let _has_earlier = std::fs::remove_dir(path);
    }
}

/// Refuses a directory in which there is something of these `names`, that a command chooses itself, but nothing of `marks`, which
/// every run of it leaves before: it is of somebody else, and nobody has said that it may be replaced.
pub(crate) fn refuse_others(directory: &Path, names: &[&str], marks: &[&str]) -> Result<(), Failure> {
    let is_own = marks.iter().any(|mark| directory.join(mark).exists());
    let others = names.iter().map(|name| directory.join(name)).find(|path| path.exists());
    match others.filter(|_| !is_own) {
        None => Ok(()),
        Some(path) => Err(Failure::Usage(format!(
            "{}: this command writes there, and no earlier run of it has; give another directory",
            path.display()
        ))),
    }
}

/// The files directly in a directory whose paths are meant; none where there is no such directory.
pub(crate) fn files_in(directory: &Path, is_meant: impl Fn(&Path) -> bool) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(directory) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| is_meant(path) && !path.is_dir());
    files.sort();
    files
}

/// Whether a name is a number of so many digits or more between two texts.
pub(crate) fn is_numbered(name: &str, before: &str, digits: usize, after: &str) -> bool {
    let number = name.strip_prefix(before).and_then(|rest| rest.strip_suffix(after));
    number.is_some_and(|number| number.len() >= digits && number.bytes().all(|byte| byte.is_ascii_digit()))
}
