//! Files that are being written, and what happens to them when somebody ends the program: they go away.

use crate::failure::Failure;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What the handler of signals has to know. Whoever holds the lock makes, renames or removes files; the handler takes
/// it for good, so that no file is made after it has looked.
static STATE: Mutex<State> = Mutex::new(State { is_listening: false, files: Vec::new(), stop: None });

struct State {
    is_listening: bool,
    /// Files without their final names.
    files: Vec<PathBuf>,
    /// Ends a command that can stop by itself and tell how far it came.
    stop: Option<Box<dyn Fn() + Send>>,
}

/// A file that goes away unless it is given a name.
pub(crate) struct Unfinished {
    path: PathBuf,
}

impl Unfinished {
    /// A new file in a directory. Unlike other temporary files those with `is_result` can be read by others than their
    /// owner, as any file that a program writes.
    pub(crate) fn create(directory: &Path, is_result: bool) -> io::Result<(File, Self)> {
        let mut state = lock();
        // Where signals cannot be listened to, a file that is left over is the smaller evil.
        let _deaf = listen(&mut state);
        let (file, path) = builder(is_result).tempfile_in(directory)?.keep().map_err(|error| error.error)?;
        state.files.push(path.clone());
        Ok((file, Self { path }))
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Gives it its name, in place of a file that may have it.
    pub(crate) fn rename(self, name: &Path) -> io::Result<()> {
        // Dropping waits for the lock.
        let state = lock();
        let result = std::fs::rename(&self.path, name);
        drop(state);
        result
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let mut state = lock();
        let _gone_already = std::fs::remove_file(&self.path);
        state.files.retain(|path| *path != self.path);
    }
}

/// From now on a signal calls `stop`, and the command ends when it is ready to.
pub(crate) fn stop_by(stop: impl Fn() + Send + 'static) -> Result<(), Failure> {
    let mut state = lock();
    state.stop = Some(Box::new(stop));
    listen(&mut state).map_err(|error| Failure::other(format!("cannot listen to signals: {error}")))
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
    let state = lock();
    if let Some(stop) = &state.stop {
        return stop();
    }
    for path in &state.files {
        let _gone_already = std::fs::remove_file(path);
    }
    let _nobody_listens = writeln!(io::stderr().lock(), "interrupted: unfinished files are removed");
    std::process::exit(i32::from(Failure::Interrupted(String::new()).exit_code()));
}

fn builder(is_result: bool) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".splatstream-");
    #[cfg(unix)]
    if is_result {
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    }
    builder
}
