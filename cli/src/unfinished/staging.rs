//! Files that come into a directory together, when all of them are whole. Until then they are in a directory of their own
//! below it, on the same disk, so that files of an earlier run stay as they were until the new ones take their place.

use super::{State, listen, lock};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// How the names of such directories begin: they are hidden, and nobody takes them for frames.
pub(crate) const STAGING: &str = ".splatstream-run-";
/// What is in one: files of this run, and those of an earlier one while they are replaced.
pub(crate) const NEW: &str = "new";
pub(crate) const EARLIER: &str = "earlier";

/// A directory for files that have no names yet where they belong. It goes away with all of them unless they are moved.
pub(crate) struct Staging {
    /// Where they belong.
    home: PathBuf,
    path: PathBuf,
}

/// A file that was moved, from where to where.
type Moved = (PathBuf, PathBuf);

impl Staging {
    /// One below a directory.
    pub(crate) fn create(home: &Path) -> io::Result<Self> {
        let mut state = lock();
        // Where signals cannot be listened to, files that are left over are the smaller evil.
        let _deaf = listen(&mut state);
        let path = tempfile::Builder::new().prefix(STAGING).tempdir_in(home)?.keep();
        state.stagings.push(path.clone());
        // Dropping, which waits for the lock, removes it if anything fails from here on.
        let staging = Self { home: home.to_path_buf(), path };
        let made = fs::create_dir(staging.files());
        drop(state);
        made.map(|()| staging)
    }

    /// Where files are until they are moved.
    pub(crate) fn files(&self) -> PathBuf {
        self.path.join(NEW)
    }

    /// Moves all files to where they belong, in place of `earlier` files of that directory and below it. It is done as a
    /// whole or not at all: where a file cannot be moved, those that were go back. No signal comes between.
    pub(crate) fn replace(self, earlier: &[PathBuf]) -> io::Result<()> {
        let mut state = lock();
        let mut moved = Vec::new();
        let result = self.move_all(earlier, &mut moved, &mut state);
        if result.is_ok() {
            state.remove_staging(&self.path);
        } else {
            // In the other order, so that no name is taken. What cannot go back stays where it is.
            let back = moved.iter().rev().filter(|(from, to)| fs::rename(to, from).is_ok());
            if back.count() < moved.len() {
                state.stagings.retain(|other| *other != self.path);
                drop(state);
                return result.map_err(|error| self.stranded(&error));
            }
        }
        drop(state);
        result
    }

    /// The error of files that could not go back either.
    fn stranded(&self, error: &io::Error) -> io::Error {
        let earlier = self.path.join(EARLIER);
        io::Error::new(
            error.kind(),
            format!("{error}; files of the earlier run that could not go back are in {}", earlier.display()),
        )
    }

    /// First earlier files out of the way, then new ones to their places.
    fn move_all(&self, earlier: &[PathBuf], moved: &mut Vec<Moved>, state: &mut State) -> io::Result<()> {
        let (new, old) = (self.files(), self.path.join(EARLIER));
        let aside = |file: &Path| old.join(file.strip_prefix(&self.home).unwrap_or(file));
        for file in earlier.iter().filter(|file| is_there(file)) {
            move_file(file, &aside(file), moved, state)?;
        }
        for file in files_below(&new)? {
            let place = self.home.join(file.strip_prefix(&new).unwrap_or(&file));
            // One that has come meanwhile. A directory stays, and nothing is moved.
            if is_there(&place) && !place.is_dir() {
                move_file(&place, &aside(&place), moved, state)?;
            }
            move_file(&file, &place, moved, state)?;
        }
        Ok(())
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        let mut state = lock();
        if state.stagings.contains(&self.path) {
            state.remove_staging(&self.path);
            state.kept.push(self.home.clone());
        }
    }
}

impl State {
    /// Removes such a directory with all that is in it.
    fn remove_staging(&mut self, path: &Path) {
        let _gone_already = fs::remove_dir_all(path);
        self.stagings.retain(|other| other != path);
    }

    /// Removes all of them.
    pub(super) fn remove_stagings(&mut self) {
        for path in self.stagings.drain(..) {
            let _gone_already = fs::remove_dir_all(&path);
            self.kept.extend(path.parent().map(Path::to_path_buf));
        }
    }
}

/// What to tell of a directory whose earlier files have stayed.
pub(super) fn kept_text(home: &Path) -> String {
    format!(
        "{}: files of an earlier run stay as they were, and this run leaves none; what a run makes before it fails stays in \
         a directory without such files",
        home.display()
    )
}

/// Moves a file on its disk, and takes note of it. Directories that it needs are made.
fn move_file(from: &Path, to: &Path, moved: &mut Vec<Moved>, state: &mut State) -> io::Result<()> {
    to.parent().map_or(Ok(()), |parent| state.make_directory(parent))?;
    fs::rename(from, to)?;
    moved.push((from.to_path_buf(), to.to_path_buf()));
    Ok(())
}

/// Whether there is something, a link without an end too.
fn is_there(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// All files below a directory.
pub(crate) fn files_below(directory: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut directories = vec![directory.to_path_buf()];
    while let Some(directory) = directories.pop() {
        for entry in fs::read_dir(&directory)? {
            let path = entry?.path();
            let list = if path.is_dir() { &mut directories } else { &mut files };
            list.push(path);
        }
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A directory with a file of an earlier run, and new ones that are still apart from it.
    fn staged(home: &Path) -> (PathBuf, Staging) {
        let earlier = home.join("a/old");
        fs::create_dir(home.join("a")).unwrap();
        fs::write(&earlier, "old").unwrap();
        let staging = Staging::create(home).unwrap();
        fs::create_dir(staging.files().join("b")).unwrap();
        for name in ["b/1", "b/2", "c"] {
            fs::write(staging.files().join(name), "new").unwrap();
        }
        (earlier, staging)
    }

    fn names(home: &Path) -> Vec<String> {
        let files = files_below(home).unwrap();
        files
            .iter()
            .map(|file| file.strip_prefix(home).unwrap().display().to_string().replace('\\', "/"))
            .collect()
    }

    #[test]
    fn new_files_come_together_and_in_place_of_others() {
        let home = tempfile::tempdir().unwrap();
        let (earlier, staging) = staged(home.path());
        // One that has come since the earlier ones were looked for is replaced too.
        fs::write(home.path().join("c"), "meanwhile").unwrap();
        staging.replace(&[earlier, home.path().join("gone")]).unwrap();
        assert_eq!(names(home.path()), ["b/1", "b/2", "c"]);
        assert_eq!(fs::read(home.path().join("c")).unwrap(), b"new");
    }

    #[test]
    fn where_one_cannot_come_none_does() {
        let home = tempfile::tempdir().unwrap();
        let (earlier, staging) = staged(home.path());
        // No file takes the place of a directory; those before it in order are moved by then.
        fs::create_dir(home.path().join("c")).unwrap();
        fs::write(home.path().join("c/mine"), "mine").unwrap();
        assert!(staging.replace(&[earlier]).is_err());
        assert_eq!(names(home.path()), ["a/old", "c/mine"]);
        assert_eq!(fs::read(home.path().join("a/old")).unwrap(), b"old");
    }

    #[test]
    fn those_that_are_given_up_are_gone() {
        let home = tempfile::tempdir().unwrap();
        let (_, staging) = staged(home.path());
        drop(staging);
        assert_eq!(names(home.path()), ["a/old"]);
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);
    }
}
