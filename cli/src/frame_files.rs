//! Frames in files: which files, in which order, each read when it is needed.

use crate::encode::warnings::Warning;
use crate::failure::Failure;
use crate::input_args::{InputArgs, size_of, with_advice};
use crate::likeness::Likeness;
use crate::missing_frames::{missing_frames, numbers};
use crate::over_limit::of_encoding;
use crate::read_notes::ReadNotes;
use crate::standard::STANDARD;
use crate::stream_file::is_stream;
use crate::unfinished::Unfinished;
use splatstream_encoder::{FrameSource, Settings};
use splatstream_files::{
    EXTENSIONS, HEAD, Scene, SceneError, SceneErrorKind, SceneFormat, Sequence, detect, natural_order,
    read_scene_as_is,
};
use splatstream_gaussians::GaussianFrame;
use std::collections::BTreeSet;
use std::fmt;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The file that makes a directory a SOG scene.
const SOG_META: &str = "meta.json";

/// Frames in natural order of their names: a frame a file, or all in one file.
pub(crate) struct FrameFiles {
    paths: Vec<PathBuf>,
    /// The one file, if it holds many frames.
    sequence: Option<Sequence>,
    reading: InputArgs,
    /// The frame read last: of a single frame, the encoder's second pass needs no second reading.
    last: Option<(u32, GaussianFrame)>,
    /// Whether there is memory for it.
    keeps_last: bool,
    /// Whether values that no frame may hold are left to whoever asks for the frames.
    as_is: bool,
    /// What came by standard input, until it is read.
    spooled: Option<Arc<Unfinished>>,
    /// Whether the frames read so far look like frames of one sequence.
    likeness: Likeness,
    /// What readers have noted.
    notes: ReadNotes,
    /// What to say of frames that a directory seems to lack.
    missing: Option<Warning>,
}

/// A frame that cannot be read, in words.
#[derive(Debug)]
struct Unread {
    message: String,
    is_over_memory: bool,
}

impl fmt::Display for Unread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Unread {}

impl From<&Unread> for Failure {
    fn from(unread: &Unread) -> Self {
        let message = unread.message.clone();
        if unread.is_over_memory { Self::Memory(message) } else { Self::Other(message) }
    }
}

/// The failure of a frame that a source does not give.
pub(crate) fn unread(error: &(dyn std::error::Error + Send + Sync + 'static)) -> Failure {
    error.downcast_ref::<Unread>().map_or_else(|| Failure::other(error.to_string()), Failure::from)
}

/// What standard input is called in messages.
pub(crate) const STANDARD_INPUT: &str = "standard input";

impl FrameFiles {
    /// The frames that the arguments of a command name: files, or one directory of frames, or one file of many.
    pub(crate) fn find(inputs: &[PathBuf], reading: InputArgs) -> Result<Self, Failure> {
        let mut paths = match inputs {
            [only] if only.as_path() == Path::new(STANDARD) => {
                let spooled = spool(&mut io::stdin().lock(), reading.most())?;
                return Self::of_spooled(Arc::new(spooled), reading);
            }
            [directory] if is_folder(directory) => frames_in(directory)?,
            files => {
                files.iter().try_for_each(|path| check_file(path))?;
                if let (2.., Some(path)) = (files.len(), files.iter().find(|path| is_sequence(path))) {
                    let path = path.display();
                    return Err(Failure::Usage(format!(
                        "{path}: holds many frames; give it by itself, or use --each"
                    )));
                }
                files.to_vec()
            }
        };
        paths.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
        // Who names files one by one has chosen them.
        let missing = if inputs.len() == paths.len() { None } else { missing_frames(&paths) };
        Ok(Self { missing, ..Self::of(paths, None, reading)? })
    }

    /// The frames that came by standard input: see [`spool`].
    pub(crate) fn of_spooled(spooled: Arc<Unfinished>, reading: InputArgs) -> Result<Self, Failure> {
        Self::of(vec![spooled.path().to_path_buf()], Some(spooled), reading)
    }

    /// The frames of files in their order.
    fn of(
        paths: Vec<PathBuf>,
        spooled: Option<Arc<Unfinished>>,
        reading: InputArgs,
    ) -> Result<Self, Failure> {
        let sequence =
            match paths.as_slice() {
                [only] if is_sequence(only) => {
                    let opened = Sequence::open(only, &reading.limits(only), &reading.sequence());
                    Some(opened.map_err(|error| {
                        Failure::from(&unreadable(&error, only, spooled.is_some(), &reading))
                    })?)
                }
                _ => None,
            };
        let (last, keeps_last, as_is) = (None, true, false);
        let (likeness, notes) = (Likeness::default(), ReadNotes::default());
        Ok(Self {
            paths,
            sequence,
            reading,
            last,
            keeps_last,
            as_is,
            spooled,
            likeness,
            notes,
            missing: None,
        })
    }

    /// Values are not checked.
    pub(crate) fn unchecked(self) -> Self {
        Self { as_is: true, ..self }
    }

    /// Each frame is asked for once, and none is kept.
    pub(crate) fn once(self) -> Self {
        Self { keeps_last: false, ..self }
    }

    /// What encoding with these settings may take of some memory: what is left beside the frame that is kept and the files that
    /// are read again. No frame is kept where that alone makes it enough.
    pub(crate) fn left_for(&mut self, settings: &Settings, memory: u64) -> u64 {
        let Some((_, frame)) = &self.last else { return memory };
        let frames = self.len();
        let taken = settings.memory(frame.len() as u64, frame.sh_degree(), frames);
        let kept: u64 = frame.planes().iter().map(|plane| size_of_val(plane.as_slice()) as u64).sum();
        let file = self.paths.iter().map(|path| size_of(path)).max().unwrap_or(0);
        // While a frame is read the encoder holds a part of what it takes: what reading takes may be more than the rest.
        let reading = kept.saturating_add(file).saturating_sub(taken / 3);
        // A single frame that is kept is not read again.
        let beside = if frames > 1 { kept.saturating_add(reading) } else { kept };
        let is_enough = |beside: u64| taken.saturating_add(beside) <= memory;
        if !is_enough(beside) && is_enough(reading) {
            (self.last, self.keeps_last) = (None, false);
            return memory.saturating_sub(reading);
        }
        memory.saturating_sub(beside)
    }

    /// The files that are read, which no output may replace: those of scenes that are directories one by one.
    pub(crate) fn inputs(&self) -> Vec<PathBuf> {
        let standard = self.spooled.iter().map(|_| PathBuf::from(STANDARD));
        self.paths.iter().flat_map(|path| files_of(path)).chain(standard).collect()
    }

    /// Whether the frames that were read look like frames of one sequence.
    pub(crate) fn likeness(&self) -> &Likeness {
        &self.likeness
    }

    /// What readers have changed on the way, in the frames that were read, and frames that seem to be missing.
    pub(crate) fn warnings(&self) -> Vec<Warning> {
        let mut warnings = self.notes.warnings(&|frame| self.name(frame));
        warnings.extend(self.missing.clone());
        warnings
    }

    /// The numbers of the frames in the names of their files, see [`numbers`].
    pub(crate) fn numbers(&self) -> Option<Vec<u32>> {
        if self.sequence.is_some() { None } else { numbers(&self.paths) }
    }

    /// What a frame is called in messages.
    pub(crate) fn name(&self, frame: u32) -> String {
        if let Some(sequence) = self.sequence.as_ref().filter(|_| self.spooled.is_none()) {
            return sequence.name(frame);
        }
        match self.paths.get(frame as usize) {
            Some(_) if self.spooled.is_some() => STANDARD_INPUT.to_owned(),
            Some(path) => path.display().to_string(),
            None => format!("frame {frame}"),
        }
    }
}

/// The files of scenes and sequences that a user named, which no output may replace: those of directories one by one. None
/// is opened, and standard input is not read.
///
/// # Errors
/// A directory that cannot be read or has no frames.
pub(crate) fn inputs_of(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut inputs = Vec::new();
    for path in named {
        let frames = if is_folder(path) { frames_in(path)? } else { vec![path.clone()] };
        inputs.extend(frames.iter().flat_map(|path| files_of(path)));
    }
    Ok(inputs)
}

/// Whether a path is that of a directory of frames.
fn is_folder(path: &Path) -> bool {
    path.is_dir() && !is_sog(path)
}

/// Standard input in a file: scenes are read more than once. What is no scene is refused by how it begins, and of what is
/// one no more than `most` bytes are kept: it may have no end.
pub(crate) fn spool(input: &mut dyn Read, most: u64) -> Result<Unfinished, Failure> {
    let directory = std::env::temp_dir();
    let failed = |error| Failure::file("keep standard input in", &directory, &error);
    let (mut file, unfinished) = Unfinished::create(&directory, false).map_err(failed)?;
    let mut count = io::copy(&mut input.take(HEAD), &mut file).map_err(failed)?;
    if is_stream(unfinished.path()) {
        return Err(is_encoded(STANDARD_INPUT));
    }
    detect(unfinished.path()).map_err(|error| Failure::other(named(&error, unfinished.path(), true)))?;
    count +=
        io::copy(&mut input.take(most.saturating_add(1).saturating_sub(count)), &mut file).map_err(failed)?;
    if count > most {
        return Err(Failure::other(format!(
            "{STANDARD_INPUT}: it has more than {most} bytes, which a scene may take to read\n  if you trust it, give a \
             larger --max-input-memory, or give it as a file"
        )));
    }
    Ok(unfinished)
}

/// A stream that is given to `encode`.
fn is_encoded(name: &str) -> Failure {
    Failure::other(format!(
        "{name}: is a stream already\n  `splatstream extract` writes a part of it, \
         `splatstream decode` the frames, which can be encoded again"
    ))
}

impl FrameSource for FrameFiles {
    fn len(&self) -> u32 {
        self.sequence.as_ref().map_or(self.paths.len() as u32, Sequence::len)
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        if let Some((last, frame)) = &self.last
            && *last == number
        {
            return Ok(frame.clone());
        }
        // Not beside the next.
        self.last = None;
        let Scene { frame, notes } = self.read(number)?;
        if !self.as_is {
            frame.validate().map_err(|defect| format!("{}: {defect}", self.name(number)))?;
        }
        self.notes.add(number, notes);
        self.likeness.add(number, &frame);
        self.last = self.keeps_last.then(|| (number, frame.clone()));
        Ok(frame)
    }
}

impl FrameFiles {
    /// Reads a frame as it is.
    fn read(&mut self, number: u32) -> Result<Scene, Unread> {
        let place = if self.sequence.is_some() { 0 } else { number as usize };
        let none = || Unread { message: format!("there is no frame {number}"), is_over_memory: false };
        let path = self.paths.get(place).ok_or_else(none)?;
        let read = match &mut self.sequence {
            Some(sequence) => sequence.frame(number),
            None => read_scene_as_is(path, &self.reading.limits(path)),
        };
        read.map_err(|error| unreadable(&error, path, self.spooled.is_some(), &self.reading))
    }
}

/// A frame that cannot be read.
fn unreadable(error: &SceneError, path: &Path, is_spooled: bool, reading: &InputArgs) -> Unread {
    if !reading.is_over_memory(error) {
        return Unread { message: named(error, path, is_spooled), is_over_memory: false };
    }
    let advice = match error.kind {
        SceneErrorKind::OverLimit { asked, .. } => of_encoding(asked),
        _ => "close other programs, or raise what limits this one, as ulimit -v shows it".to_owned(),
    };
    let name = if is_spooled { STANDARD_INPUT.to_owned() } else { path.display().to_string() };
    Unread { message: format!("{name}: {}\n  {advice}", error.kind), is_over_memory: true }
}

/// An error of reading, with advice; what came by standard input is called that.
fn named(error: &SceneError, path: &Path, is_spooled: bool) -> String {
    match is_spooled {
        true => with_advice(error).replace(&*path.to_string_lossy(), STANDARD_INPUT),
        false => with_advice(error),
    }
}

/// Whether a file holds many frames.
fn is_sequence(path: &Path) -> bool {
    detect(path).is_ok_and(SceneFormat::is_sequence)
}

/// A file or a SOG directory: one frame, or a file of many if it is the only one.
fn check_file(path: &Path) -> Result<(), Failure> {
    if path.is_dir() && !is_sog(path) {
        let path = path.display();
        return Err(Failure::Usage(format!("{path}: give one directory of frames by itself, or only files")));
    }
    if path == Path::new(STANDARD) {
        return Err(Failure::Usage("-: only one scene can come by standard input, and by itself".to_owned()));
    }
    match path.metadata() {
        Ok(_) if is_stream(path) => Err(is_encoded(&path.display().to_string())),
        Ok(_) => Ok(()),
        Err(error) => Err(Failure::file("read", path, &error)),
    }
}

/// The frames of a directory: scene files and SOG directories, of one kind.
fn frames_in(directory: &Path) -> Result<Vec<PathBuf>, Failure> {
    let failed = |error| Failure::file("read", directory, &error);
    let mut paths = Vec::new();
    let mut kinds = BTreeSet::new();
    for entry in std::fs::read_dir(directory).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if let Some(kind) = kind_of(&path) {
            kinds.insert(kind);
            paths.push(path);
        }
    }
    let folder = directory.display();
    match kinds.len() {
        0 => Err(Failure::other(format!(
            "{folder}: no frames here\n  give a directory with .ply, .compressed.ply, .spz, .sog, .splat, .ksplat, .glb or .gltf files, or with SOG directories"
        ))),
        1 => Ok(paths),
        _ => {
            let kinds: Vec<&str> = kinds.into_iter().collect();
            let kinds = kinds.join(", ");
            Err(Failure::other(format!(
                "{folder}: frames of several formats ({kinds})\n  give the files themselves, as in {folder}/*.ply"
            )))
        }
    }
}

/// The format that a name promises; none for what is no scene, and for hidden files, which systems put beside others.
fn kind_of(path: &Path) -> Option<&'static str> {
    if path.file_name()?.to_string_lossy().starts_with('.') {
        return None;
    }
    if is_sog(path) {
        return Some("sog");
    }
    let extension = path.extension()?.to_str()?;
    let known = EXTENSIONS.into_iter().find(|known| extension.eq_ignore_ascii_case(known));
    known.filter(|_| path.is_file())
}

/// A file, or the files of a SOG directory.
fn files_of(path: &Path) -> Vec<PathBuf> {
    match std::fs::read_dir(path) {
        Ok(entries) => entries.flatten().map(|entry| entry.path()).collect(),
        Err(_) => vec![path.to_path_buf()],
    }
}

fn is_sog(path: &Path) -> bool {
    path.join(SOG_META).is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_named_without_being_opened() {
        let directory = tempfile::tempdir().unwrap();
        let folder = directory.path().join("frames");
        let sog = folder.join("a.sog");
        std::fs::create_dir_all(&sog).unwrap();
        let [archive, meta] = [directory.path().join("broken.zip"), sog.join(SOG_META)];
        [&archive, &meta].into_iter().for_each(|path| std::fs::write(path, "no scene").unwrap());
        let named = [Path::new(STANDARD), &archive, &folder, &sog].map(Path::to_path_buf);
        assert_eq!(inputs_of(&named).unwrap(), [Path::new(STANDARD), &archive, &meta, &meta]);
        assert!(inputs_of(&[directory.path().join("frames/a.sog/none"), folder]).is_ok());
    }
}
