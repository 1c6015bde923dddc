//! Where decoded frames go: a file or standard output for one frame, a directory for any number.

use super::clamped::Losses;
use super::format::Format;
use crate::encode::warnings::Warning;
use crate::failure::Failure;
use crate::frame_name::{frame_name, is_frame_name};
use crate::kept_settings::settings_in;
use crate::output_directory::{OutputDirectory, files_in};
use crate::output_file::{OutputFile, ends_with_separator, refuse_terminal};
use crate::standard::{STANDARD, is_standard};
use splatstream_gaussians::GaussianFrame;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

/// Where frames go.
pub(crate) struct Target {
    place: Place,
    format: Format,
    losses: Losses,
}

/// A directory, or a file of one frame.
enum Place {
    Directory(OutputDirectory),
    File(SingleFile),
}

/// A file of one frame, which is written when it is known that there is no second one.
struct SingleFile {
    path: PathBuf,
    /// What it may not replace.
    inputs: Vec<PathBuf>,
    /// The frame.
    bytes: Option<Vec<u8>>,
}

/// What a user says about the files.
#[derive(Clone, Copy)]
pub(crate) struct Wanted<'a> {
    /// A file, a directory, or `-`.
    pub(crate) path: &'a Path,
    /// The stream.
    pub(crate) input: &'a Path,
    /// Their format.
    pub(crate) format: Option<Format>,
    /// How many there will be; 0 if that is not known.
    pub(crate) frames: u32,
    /// Whether frames of an earlier run are replaced.
    pub(crate) force: bool,
}

impl Target {
    /// The file or directory that a user named.
    pub(crate) fn new(wanted: Wanted<'_>) -> Result<Self, Failure> {
        let Wanted { path, format, frames, .. } = wanted;
        let is_directory = !is_standard(path) && is_directory(path)?;
        let named = Format::of_name(path).filter(|_| !is_directory);
        if !is_directory && frames > 1 {
            return Err(too_many(path, &format!("{frames} frames")));
        }
        if let (Some(format), Some(named)) = (format, named)
            && format != named
        {
            let asked = format.extension();
            let name = path.display();
            return Err(Failure::Usage(format!("{name}: --format {asked} contradicts the name of the file")));
        }
        if is_standard(path) {
            refuse_terminal(io::stdout().is_terminal(), path)?;
        }
        let inputs = vec![wanted.input.to_path_buf()];
        Ok(Self {
            place: match is_directory {
                true => Place::Directory(frame_directory(path, &inputs, wanted.force)?),
                false => Place::File(SingleFile { path: path.to_path_buf(), inputs, bytes: None }),
            },
            format: format.or(named).unwrap_or(Format::Ply),
            losses: Losses::default(),
        })
    }

    /// Writes one frame.
    ///
    /// # Errors
    /// A file that cannot be written, and a second frame where there is one file.
    pub(crate) fn write(&mut self, number: u32, frame: &GaussianFrame) -> Result<(), Failure> {
        let name = format!("{}.{}", frame_name(number), self.format.extension());
        let bytes = self.format.bytes(frame).map_err(|error| {
            let path = match &self.place {
                Place::Directory(directory) => directory.path_of(&name),
                Place::File(file) => file.path.clone(),
            };
            Failure::other(format!("{}: {error}", path.display()))
        })?;
        match &mut self.place {
            Place::Directory(directory) => directory.write(name, &bytes)?,
            Place::File(file) if file.bytes.is_some() => {
                return Err(too_many(&file.path, "the frames of this stream"));
            }
            Place::File(file) => file.bytes = Some(bytes),
        }
        self.losses.add(number, frame, self.format);
        Ok(())
    }

    /// Whether frames of an earlier run stay where this one does not finish.
    pub(crate) fn replaces(&self) -> bool {
        matches!(&self.place, Place::Directory(directory) if directory.replaces())
    }

    /// All frames are written.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        match self.place {
            Place::Directory(directory) => directory.finish(),
            Place::File(SingleFile { path, inputs, bytes }) => {
                bytes.map_or(Ok(()), |bytes| OutputFile::write_apart(&path, &inputs, &bytes))
            }
        }
    }

    /// What the format could not keep.
    pub(crate) fn warnings(&self) -> Vec<Warning> {
        self.losses.warnings(self.format)
    }
}

/// The failure of frames that are to go into one file.
fn too_many(path: &Path, frames: &str) -> Failure {
    let path = path.display();
    Failure::Usage(format!(
        "{path}: {frames} do not fit in one file; give a directory, or choose one with --frames 0..1"
    ))
}

/// Whether a name is that of a directory, there or not; one that is neither that nor a file that can be written is
/// refused.
fn is_directory(path: &Path) -> Result<bool, Failure> {
    if path.is_dir() || ends_with_separator(path) {
        return Ok(true);
    }
    let is_device = path.metadata().is_ok_and(|found| !found.is_file());
    if is_device || Format::of_name(path).is_some() {
        return Ok(false);
    }
    if path.extension().is_some() || path.exists() {
        let path = path.display();
        return Err(Failure::Usage(format!(
            "{path}: decode cannot write this format; end the name of a file in .ply, .spz, .splat, .glb, .sog or \
             .compressed.ply, and that of a directory in /; {STANDARD} is standard output"
        )));
    }
    Ok(true)
}

/// A directory for frames, in the places of those of an earlier run if they may be replaced (`force`); none of them may be
/// among `inputs`.
pub(crate) fn frame_directory(
    path: &Path,
    inputs: &[PathBuf],
    force: bool,
) -> Result<OutputDirectory, Failure> {
    let mut directory = OutputDirectory::new(path, |path| files_in(path, is_frame), "frames", inputs, force)?;
    directory.replace_too(settings_in(path))?;
    Ok(directory)
}

/// Whether there are frames in a directory.
pub(crate) fn has_frames(path: &Path) -> bool {
    !files_in(path, is_frame).is_empty()
}

/// Whether a file has a name that frames are given.
fn is_frame(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    let (Some(name), Some(format)) = (name, Format::of_name(path)) else { return false };
    let stem = name.get(..name.len().saturating_sub(format.extension().len() + 1));
    stem.is_some_and(is_frame_name)
}
