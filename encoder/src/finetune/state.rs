//! How far fitting to pictures has come, kept in a directory, so that another run can go on where one was ended.
//!
//! A run does everything again but the descents: steps are looked for, Gaussians are ordered and coded as before, which gives the
//! same values to fit. Each fit of a layer of a frame has a file of its own, named by what it starts from, with the descent as it
//! was when its judges were about to look, or with what has come of it. So one directory serves several I frames, GOPs that are
//! coded at the same time, and a frame that is fitted several times while steps are looked for.
//!
//! A file that is there is whole: it is written under another name, brought to the disk, and renamed.

pub(super) mod entry;
mod exchange;

use super::state_error::StateError;
use crate::value_digest::digest_of;
use core::fmt;
use entry::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// The file of the settings, and what it begins with.
const SETTINGS: &str = "settings";
const FORMAT: &str = "splatstream-finetune-state-1";

/// What the files of fits end in, and those that are not whole yet.
const OF_FIT: &str = ".fit";
const UNFINISHED: &str = ".new";

/// A setting that values follow from: its name, and what it is in a line.
pub(super) type Named = (&'static str, String);

/// Where it is kept how far [fitting to pictures](crate::Finetune) has come; by default nowhere.
///
/// A run that was ended, whoever or whatever ended it, goes on with its state and gives the bytes that it would have given. What
/// is lost is less than 20 iterations, and the time since the last state was written: each is written before judges look, but
/// no more than a twentieth of the time goes into writing. Of each Gaussian a state takes sixteen bytes of each value while it is
/// fitted, and four once that is done.
///
/// The settings have to be those that are then encoded with. Nothing that is encoded depends on the state, so that any two are
/// equal, and look the same.
///
/// ```no_run
/// use splatstream_encoder::{Finetune, FinetuneState, Settings, encode};
/// use splatstream_files::builtin::BuiltinScene;
///
/// let mut settings = Settings { finetune: Some(Finetune::default()), ..Settings::default() };
/// // Goes on if an earlier run has left something there.
/// let state = FinetuneState::resume("talk-state".as_ref(), &settings)?;
/// settings.finetune.iter_mut().for_each(|finetune| finetune.state = state.clone());
/// let mut frames = vec![BuiltinScene::default().frame(0)];
/// let mut stream = Vec::new();
/// encode(&mut frames, &settings, &mut stream, &mut |_, _| ())?;
/// std::fs::write("talk.gss", stream)?;
/// state.remove()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Default)]
pub struct FinetuneState(Option<Arc<Kept>>);

/// A directory with a state.
struct Kept {
    directory: PathBuf,
    /// What distinguishes the settings, and the text of their file.
    settings: u64,
    text: String,
    /// The files of fits that an earlier run has left.
    found: BTreeSet<String>,
    /// Those that this one has asked for.
    own: Mutex<BTreeSet<String>>,
}

impl FinetuneState {
    /// In a directory without one, for a run with these settings. Nothing is written before the first fit begins: what is refused
    /// before leaves nothing.
    pub(super) fn create_for(directory: &Path, settings: &[Named]) -> Result<Self, StateError> {
        let state = Kept::open(directory, settings)?;
        match state.found.is_empty() {
            true => Ok(Self(Some(Arc::new(state)))),
            false => Err(StateError::Exists { directory: directory.to_path_buf() }),
        }
    }

    /// As an earlier run with these settings has left it, or new where it has left no fit.
    pub(super) fn resume_for(directory: &Path, settings: &[Named]) -> Result<Self, StateError> {
        let state = Kept::open(directory, settings)?;
        if !state.found.is_empty() {
            state.check(settings)?;
        }
        Ok(Self(Some(Arc::new(state))))
    }

    /// Removes the files that belong to this run, and the directory if nothing else is in it: once the stream is where it shall
    /// be, nobody needs them.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove(&self) -> Result<(), StateError> {
        let Some(kept) = &self.0 else { return Ok(()) };
        let own = core::mem::take(&mut *kept.own.lock().unwrap_or_else(PoisonError::into_inner));
        own.iter().map(|name| kept.directory.join(name)).filter(|path| path.exists()).try_for_each(remove)?;
        // Another run, of another part of the sequence, may keep its fits beside.
        if !own.is_empty() && fits_in(&kept.directory)?.is_empty() {
            remove(kept.directory.join(SETTINGS))?;
            let _others_are_in_it = fs::remove_dir(&kept.directory);
        }
        Ok(())
    }

    /// Whether there is one.
    pub(crate) fn is_kept(&self) -> bool {
        self.0.is_some()
    }

    /// Where the fit of a layer is kept: of a frame of this number, whose values have this digest as they are read, that starts
    /// from what `key` distinguishes. None where no state is kept.
    ///
    /// # Errors
    /// An earlier run has read a frame of that number with other values; the directory cannot be written.
    pub(super) fn entry(
        &self,
        (frame, source): (u32, u64),
        layer: u8,
        key: u64,
    ) -> Result<Option<Entry>, StateError> {
        let Some(kept) = &self.0 else { return Ok(None) };
        let of_frame = format!("frame-{frame:04}-");
        let of_source = format!("{of_frame}{source:016x}-");
        let of_others = |name: &&String| name.starts_with(&of_frame) && !name.starts_with(&of_source);
        if kept.found.iter().any(|name| of_others(&name)) {
            return Err(StateError::OtherFrame { directory: kept.directory.clone(), frame });
        }
        let key = digest_of(&(kept.settings, key, layer));
        let name = format!("{of_source}layer-{layer}-{key:016x}{OF_FIT}");
        let entry = Entry::new(kept.directory.join(&name), key);
        let mut own = kept.own.lock().unwrap_or_else(PoisonError::into_inner);
        if own.is_empty() {
            kept.begin()?;
        }
        own.insert(name);
        Ok(Some(entry))
    }
}

impl Kept {
    /// What is in a directory, if it is there.
    fn open(directory: &Path, settings: &[Named]) -> Result<Self, StateError> {
        let mut text = format!("{FORMAT}\n");
        settings.iter().for_each(|(name, value)| text += &format!("{name}: {value}\n"));
        Ok(Self {
            directory: directory.to_path_buf(),
            settings: digest_of(&settings),
            text,
            found: fits_in(directory)?,
            own: Mutex::default(),
        })
    }

    /// Makes the directory, and writes down what the state belongs to.
    fn begin(&self) -> Result<(), StateError> {
        let failed = |source| StateError::File { path: self.directory.clone(), what: "kept", source };
        fs::create_dir_all(&self.directory).map_err(failed)?;
        replace(&self.directory.join(SETTINGS), |file| file.write_all(self.text.as_bytes()))
    }

    /// Whether the state belongs to these settings.
    fn check(&self, settings: &[Named]) -> Result<(), StateError> {
        let path = self.directory.join(SETTINGS);
        let failed = |source: io::Error| match source.kind() {
            io::ErrorKind::InvalidData => damaged(&self.directory, "its settings are not text"),
            io::ErrorKind::NotFound => damaged(&self.directory, "its settings are not there"),
            _ => StateError::File { path: path.clone(), what: "read", source },
        };
        let text = fs::read_to_string(&path).map_err(failed)?;
        if !text.ends_with('\n') {
            return Err(damaged(&self.directory, "its settings are cut"));
        }
        let mut lines = text.lines();
        if lines.next() != Some(FORMAT) {
            return Err(damaged(&self.directory, "its settings are none of this version"));
        }
        let lines: BTreeMap<&str, &str> = lines.filter_map(|line| line.split_once(": ")).collect();
        for (name, found) in settings {
            let kept = *lines.get(name).ok_or_else(|| damaged(&self.directory, "its settings lack one"))?;
            if kept != found {
                let (directory, name) = (self.directory.clone(), (*name).to_owned());
                let (kept, found) = (kept.to_owned(), found.clone());
                return Err(StateError::OtherSetting { directory, name, kept, found });
            }
        }
        Ok(())
    }
}

/// The names of the files of fits in a directory; none where it is not there.
fn fits_in(directory: &Path) -> Result<BTreeSet<String>, StateError> {
    let failed = |source| StateError::File { path: directory.to_path_buf(), what: "read", source };
    let name = |entry: io::Result<fs::DirEntry>| entry.map(|entry| entry.file_name());
    let entries = match fs::read_dir(directory) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(BTreeSet::new()),
        entries => entries.map_err(failed)?,
    };
    let names = entries.map(name).collect::<Result<Vec<_>, _>>();
    let names = names.map_err(failed)?.into_iter().filter_map(|name| name.into_string().ok());
    Ok(names.filter(|name| name.starts_with("frame-") && name.ends_with(OF_FIT)).collect())
}

/// Writes a file under another name, and gives it its own once it is on the disk.
fn replace(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), StateError> {
    let mut unfinished = path.as_os_str().to_owned();
    unfinished.push(UNFINISHED);
    let replaced = || {
        let mut file = io::BufWriter::with_capacity(1 << 20, fs::File::create(&unfinished)?);
        write(&mut file)?;
        file.into_inner()?.sync_all()?;
        fs::rename(&unfinished, path)
    };
    replaced().map_err(|source| {
        let _is_not_there = fs::remove_file(&unfinished);
        StateError::File { path: path.to_path_buf(), what: "written", source }
    })
}

fn remove(path: PathBuf) -> Result<(), StateError> {
    fs::remove_file(&path).map_err(|source| StateError::File { path, what: "removed", source })
}

fn damaged(path: &Path, what: &'static str) -> StateError {
    StateError::Damaged { path: path.to_path_buf(), what }
}

impl PartialEq for FinetuneState {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl fmt::Debug for FinetuneState {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("FinetuneState")
    }
}
