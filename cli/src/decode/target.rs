//! Where decoded frames go: a file or standard output for one frame, a directory for any number.

use super::clamped::Losses;
use super::format::Format;
use crate::earlier::{Earlier, files_in};
use crate::encode::warnings::Warning;
use crate::failure::Failure;
use crate::frame_name::{frame_name, is_frame_name};
use crate::output_file::{OutputFile, ends_with_separator, make_directory, refuse_terminal};
use crate::standard::{STANDARD, is_standard};
use splatstream_gaussians::GaussianFrame;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

/// Where frames go.
pub(crate) struct Target {
    path: PathBuf,
    format: Format,
    is_directory: bool,
    /// What no frame may replace.
    inputs: Vec<PathBuf>,
    /// Frames of an earlier run, removed with the first frame that is written.
    stale: Earlier,
    losses: Losses,
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
    /// Whether frames of an earlier run are removed.
    pub(crate) force: bool,
}

impl Target {
    /// The file or directory that a user named.
    pub(crate) fn new(wanted: Wanted<'_>) -> Result<Self, Failure> {
        let Wanted { path, format, frames, .. } = wanted;
        let name = path.display();
        let is_directory = !is_standard(path) && is_directory(path)?;
        let named = Format::of_name(path).filter(|_| !is_directory);
        if !is_directory && frames > 1 {
            return Err(Failure::Usage(format!(
                "{name}: {frames} frames do not fit in one file; give a directory, or choose one with --frames 0..1"
            )));
        }
        if let (Some(format), Some(named)) = (format, named)
            && format != named
        {
            let asked = format.extension();
            return Err(Failure::Usage(format!("{name}: --format {asked} contradicts the name of the file")));
        }
        if is_standard(path) {
            refuse_terminal(io::stdout().is_terminal(), path)?;
        }
        let inputs = vec![wanted.input.to_path_buf()];
        Ok(Self {
            path: path.to_path_buf(),
            format: format.or(named).unwrap_or(Format::Ply),
            is_directory,
            stale: if is_directory {
                earlier_frames(path, &inputs, wanted.force)?
            } else {
                Earlier::default()
            },
            inputs,
            losses: Losses::default(),
        })
    }

    /// Writes one frame; the directory is made, or cleared, with the first.
    pub(crate) fn write(&mut self, number: u32, frame: &GaussianFrame) -> Result<(), Failure> {
        if self.is_directory {
            make_directory(&self.path)?;
        }
        self.stale.remove()?;
        let path = self.path_of(number);
        let bytes = self
            .format
            .bytes(frame)
            .map_err(|error| Failure::other(format!("{}: {error}", path.display())))?;
        OutputFile::write_apart(&path, &self.inputs, &bytes)?;
        self.losses.add(number, frame, self.format);
        Ok(())
    }

    /// What the format could not keep.
    pub(crate) fn warnings(&self) -> Vec<Warning> {
        self.losses.warnings(self.format)
    }

    fn path_of(&self, number: u32) -> PathBuf {
        if !self.is_directory {
            return self.path.clone();
        }
        self.path.join(format!("{}.{}", frame_name(number), self.format.extension()))
    }
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

/// The frames of an earlier run in a directory, if they may be removed (`force`); none of them may be among `inputs`.
pub(crate) fn earlier_frames(path: &Path, inputs: &[PathBuf], force: bool) -> Result<Earlier, Failure> {
    Earlier::of(path, files_in(path, is_frame), "frames", inputs, force)
}

/// Whether a file has a name that frames are given.
fn is_frame(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    let (Some(name), Some(format)) = (name, Format::of_name(path)) else { return false };
    let stem = name.get(..name.len().saturating_sub(format.extension().len() + 1));
    stem.is_some_and(is_frame_name)
}
