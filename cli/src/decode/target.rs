//! Where decoded frames go: a file for one frame, a directory for any number.

use crate::failure::Failure;
use crate::output_file::{OutputFile, make_directory};
use clap::ValueEnum;
use splatstream_scene::{GaussianFrame, SceneError, ply, splat, spz};
use std::path::{Path, PathBuf};

/// The formats that can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Standard Gaussian splatting PLY: keeps everything.
    Ply,
    /// SPZ: quantises what it keeps.
    Spz,
    /// 32 bytes per Gaussian: no spherical harmonics.
    Splat,
}

/// Where frames go.
pub(crate) struct Target {
    path: PathBuf,
    format: Format,
    is_file: bool,
}

impl Target {
    /// The file or directory that a user named; `frames` frames are expected there, 0 if that is not known.
    pub(crate) fn new(path: &Path, format: Option<Format>, frames: u32) -> Result<Self, Failure> {
        let named = Format::of_name(path).filter(|_| !path.is_dir());
        let target = Self {
            path: path.to_path_buf(),
            format: format.or(named).unwrap_or(Format::Ply),
            is_file: named.is_some(),
        };
        if target.is_file && frames > 1 {
            return Err(Failure::Usage(format!(
                "{}: {frames} frames do not fit in one file; give a directory, or choose one with --frames 0..1",
                path.display()
            )));
        }
        if let (Some(format), Some(named)) = (format, named)
            && format != named
        {
            let (path, asked) = (path.display(), format.extension());
            return Err(Failure::Usage(format!("{path}: --format {asked} contradicts the name of the file")));
        }
        Ok(target)
    }

    /// Writes one frame; the directory is made with the first.
    pub(crate) fn write(&self, number: u32, frame: &GaussianFrame) -> Result<(), Failure> {
        if !self.is_file {
            make_directory(&self.path)?;
        }
        let path = self.path_of(number);
        let bytes = self
            .format
            .bytes(frame)
            .map_err(|error| Failure::other(format!("{}: {error}", path.display())))?;
        OutputFile::write(&path, &bytes)
    }

    fn path_of(&self, number: u32) -> PathBuf {
        if self.is_file {
            return self.path.clone();
        }
        self.path.join(format!("frame_{number:04}.{}", self.format.extension()))
    }
}

impl Format {
    /// The format that a file's extension names.
    fn of_name(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        [Self::Ply, Self::Spz, Self::Splat]
            .into_iter()
            .find(|format| extension.eq_ignore_ascii_case(format.extension()))
    }

    fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Spz => "spz",
            Self::Splat => "splat",
        }
    }

    fn bytes(self, frame: &GaussianFrame) -> Result<Vec<u8>, SceneError> {
        match self {
            Self::Ply => Ok(ply::write(frame)),
            Self::Spz => spz::write(frame),
            Self::Splat => splat::write(frame),
        }
    }
}
