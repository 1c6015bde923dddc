//! Files that are being written, and what happens to them when somebody ends the program: they go away. Where the system
//! can, they have no name until they are whole, so that nothing is left of them however it ends.

#[cfg(target_os = "linux")]
mod nameless;
mod staging;

pub(crate) use staging::{EARLIER, NEW, STAGING, Staging, files_below};

use crate::failure::Failure;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What the handler of signals has to know. Whoever holds the lock makes, renames or removes files; the handler takes
/// it for good, so that no file is made after it has looked.
static STATE: Mutex<State> = Mutex::new(State {
    is_listening: false,
    files: Vec::new(),
    directories: Vec::new(),
    stagings: Vec::new(),
    kept: Vec::new(),
    advice: None,
    stop: None,
    tell: None,
});

/// Says how a command failed.
type Teller = Box<dyn Fn(&Failure) + Send>;

struct State {
    is_listening: bool,
    /// Files without their final names.
    files: Vec<PathBuf>,
    /// Directories that the command has made, each after those above it.
    directories: Vec<PathBuf>,
    /// Directories of files that take the places of others together.
    stagings: Vec<PathBuf>,
    /// Directories in which nothing was replaced after all.
    kept: Vec<PathBuf>,
    /// What to do next.
    advice: Option<String>,
    /// Ends a command that can stop by itself and tell how far it came.
    stop: Option<Box<dyn Fn() + Send>>,
    /// Says that the command was interrupted.
    tell: Option<Teller>,
}

/// A file that goes away unless it is given a name.
pub(crate) struct Unfinished {
    path: PathBuf,
    /// The file, if it has no name to be removed by.
    #[cfg(target_os = "linux")]
    nameless: Option<nameless::Nameless>,
}

impl Unfinished {
    /// A new file in a directory. Unlike other temporary files those with `is_result` can be read by others than their
    /// owner, as any file that a program writes.
    pub(crate) fn create(directory: &Path, is_result: bool) -> io::Result<(File, Self)> {
        let mut state = lock();
        // Where signals cannot be listened to, a file that is left over is the smaller evil.
        let _deaf = listen(&mut state);
        #[cfg(target_os = "linux")]
        if let Some((file, nameless)) = nameless::Nameless::create(directory, mode(is_result)) {
            return Ok((file, Self { path: nameless.path(), nameless: Some(nameless) }));
        }
        Self::named(directory, is_result, &mut state)
    }

    /// One with a name that is not its final one.
    fn named(directory: &Path, is_result: bool, state: &mut State) -> io::Result<(File, Self)> {
        let (file, path) = builder(is_result).tempfile_in(directory)?.keep().map_err(|error| error.error)?;
        state.files.push(path.clone());
        let unfinished = Self {
            path,
            #[cfg(target_os = "linux")]
            nameless: None,
        };
        Ok((file, unfinished))
    }

    /// Where this program finds it.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Gives it its name, in place of a file that may have it.
    pub(crate) fn rename(self, name: &Path) -> io::Result<()> {
        // Dropping waits for the lock.
        let state = lock();
        let result = self.give_name(name);
        drop(state);
        result
    }

    fn give_name(&self, name: &Path) -> io::Result<()> {
        #[cfg(target_os = "linux")]
        if let Some(nameless) = &self.nameless {
            return nameless.link(name, &builder(true));
        }
        std::fs::rename(&self.path, name)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let mut state = lock();
        // One without a name is not among them.
        if state.files.contains(&self.path) {
            let _gone_already = std::fs::remove_file(&self.path);
            state.files.retain(|path| *path != self.path);
        }
    }
}

/// Makes a directory and those above it. Where nothing is in them when the command fails, they go away.
pub(crate) fn make_directory(path: &Path) -> io::Result<()> {
    let mut state = lock();
    let _deaf = listen(&mut state);
    state.make_directory(path)
}

/// The command has ended, and does what it was told (`is_done`) or has failed. Gives what is to be told of files that stay.
pub(crate) fn end(is_done: bool) -> Vec<String> {
    let mut state = lock();
    match is_done {
        true => state.directories.clear(),
        false => state.remove_empty_directories(),
    }
    state.kept_texts()
}

/// From now on a signal calls `stop`, and the command ends when it is ready to.
pub(crate) fn stop_by(stop: impl Fn() + Send + 'static) -> Result<(), Failure> {
    let mut state = lock();
    state.stop = Some(Box::new(stop));
    listen(&mut state).map_err(|error| Failure::other(format!("cannot listen to signals: {error}")))
}

/// From now on `tell` says that a signal has ended the command: of one that has written files, and of one whose report is `awaited`,
/// which may have none.
pub(crate) fn tell_by(is_awaited: bool, tell: impl Fn(&Failure) + Send + 'static) {
    let mut state = lock();
    state.tell = Some(Box::new(tell));
    if is_awaited {
        // Where signals cannot be listened to, the exit code tells.
        let _deaf = listen(&mut state);
    }
}

/// From now on whoever ends the command is told what to do next.
pub(crate) fn advise(advice: String) {
    lock().advice = Some(advice);
}

impl State {
    fn make_directory(&mut self, path: &Path) -> io::Result<()> {
        let is_missing = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
        let mut missing: Vec<PathBuf> = path.ancestors().take_while(is_missing).map(PathBuf::from).collect();
        missing.reverse();
        self.directories.extend(missing);
        std::fs::create_dir_all(path)
    }

    /// What to tell of directories in which nothing was replaced.
    fn kept_texts(&mut self) -> Vec<String> {
        self.kept.drain(..).map(|home| staging::kept_text(&home)).collect()
    }

    /// Removes the directories that the command has made, where nothing is in them.
    fn remove_empty_directories(&mut self) {
        for path in self.directories.drain(..).rev() {
            let _is_used = std::fs::remove_dir(path);
        }
    }
}

fn lock() -> MutexGuard<'static, State> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Listens to Ctrl-C and to requests to end, from the first file on.
fn listen(state: &mut State) -> Result<(), ctrlc::Error> {
    if !state.is_listening {
        ctrlc::set_handler(interrupted)?;
        state.is_listening = true;
    }
    Ok(())
}

fn interrupted() {
    let mut state = lock();
    if let Some(stop) = &state.stop {
        return stop();
    }
    for path in &state.files {
        let _gone_already = std::fs::remove_file(path);
    }
    state.remove_stagings();
    state.remove_empty_directories();
    let kept = state.kept_texts();
    let advice: String = kept.iter().chain(&state.advice).map(|line| format!("\n  {line}")).collect();
    let failure = Failure::Interrupted(format!("interrupted: unfinished files are removed{advice}"));
    if let Some(tell) = &state.tell {
        tell(&failure);
    }
    std::process::exit(failure.exit_code().into());
}

fn builder(is_result: bool) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".splatstream-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode(is_result)));
    builder
}

/// Who may do what with a file, as far as the user of the program lets them.
#[cfg(unix)]
fn mode(is_result: bool) -> u32 {
    if is_result { 0o666 } else { 0o600 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::io::Write;

    /// What is in a directory.
    fn names(directory: &Path) -> Vec<String> {
        let entries = fs::read_dir(directory).unwrap().map(Result::unwrap);
        let mut names: Vec<_> = entries.map(|entry| entry.file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    type Make = fn(&Path) -> io::Result<(File, Unfinished)>;

    #[test]
    fn a_file_is_there_when_it_is_finished_and_gone_when_it_is_not() {
        let makes: [Make; 2] = [
            |directory| Unfinished::create(directory, true),
            |directory| Unfinished::named(directory, true, &mut lock()),
        ];
        for make in makes {
            let directory = tempfile::tempdir().unwrap();
            let (path, name) = (directory.path(), directory.path().join("result"));
            drop(make(path).unwrap());
            assert!(names(path).is_empty());
            // The second takes the place of the first.
            for content in ["first", "second"] {
                let (mut file, unfinished) = make(path).unwrap();
                file.write_all(content.as_bytes()).unwrap();
                assert_eq!(fs::read_to_string(unfinished.path()).unwrap(), content);
                unfinished.rename(&name).unwrap();
                assert_eq!(fs::read_to_string(&name).unwrap(), content);
                assert_eq!(names(path), ["result"]);
            }
        }
    }
}
