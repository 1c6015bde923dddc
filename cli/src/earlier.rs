//! Files that an earlier run has left in a directory: between new ones, nobody could tell which are which. Commands that
//! give their files names of their own refuse them, or remove them if they are told to.

use crate::failure::Failure;
use crate::numbers::counted;
use crate::output_file::refuse_inputs;
use std::path::{Path, PathBuf};

/// Files of an earlier run, which go when the first new one comes.
#[derive(Default)]
pub(crate) struct Earlier {
    directory: PathBuf,
    files: Vec<PathBuf>,
}

impl Earlier {
    /// `files` of a directory, which are `what` to people, if they may be removed (`force`); none of them may be among
    /// `inputs`.
    pub(crate) fn of(
        directory: &Path,
        files: Vec<PathBuf>,
        what: &str,
        inputs: &[PathBuf],
        force: bool,
    ) -> Result<Self, Failure> {
        files.iter().try_for_each(|path| refuse_inputs(path, inputs))?;
        if !files.is_empty() && !force {
            let (directory, files) = (directory.display(), counted(files.len() as u64, "file"));
            return Err(Failure::Usage(format!(
                "{directory}: the directory has {files} with names of {what}, probably from an earlier run; \
                 give another directory, or --force to remove them"
            )));
        }
        Ok(Self { directory: directory.to_path_buf(), files })
    }

    /// Removes them, and directories below the one of the run that are empty then. Nothing happens the second time.
    pub(crate) fn remove(&mut self) -> Result<(), Failure> {
        for path in self.files.drain(..) {
            std::fs::remove_file(&path).map_err(|error| Failure::file("remove", &path, &error))?;
            let below = |folder: &&Path| folder.starts_with(&self.directory) && *folder != self.directory;
            // A directory with other files stays, and so do those above it.
            let _none_left = path.ancestors().skip(1).take_while(below).try_for_each(std::fs::remove_dir);
        }
        Ok(())
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
