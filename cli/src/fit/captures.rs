//! The captures that a user named: one, or a sequence of them.

use crate::failure::Failure;
use crate::frame_name::frame_name;
use splatstream_files::natural_order;
use splatstream_render::camera::{CameraError, Capture, read_capture};
use std::path::{Path, PathBuf};

/// Captures in the order of their frames.
pub(super) struct Captures {
    paths: Vec<PathBuf>,
    is_sequence: bool,
}

impl Captures {
    /// A camera file, a directory with a capture, or a directory of such directories, in natural order of their names.
    pub(super) fn find(path: &Path) -> Result<Self, Failure> {
        if !path.is_dir() || is_capture(path) {
            return Ok(Self { paths: vec![path.to_path_buf()], is_sequence: false });
        }
        let failed = |error: std::io::Error| Failure::file("read", path, &error);
        let entries = path.read_dir().map_err(failed)?.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let mut paths: Vec<PathBuf> =
            entries.iter().map(std::fs::DirEntry::path).filter(|path| is_capture(path)).collect();
        if paths.is_empty() {
            let (path, why) = (path.display(), CameraError::Directory);
            return Err(Failure::other(format!("{path}: {why}, or a directory of such directories")));
        }
        paths.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
        Ok(Self { paths, is_sequence: true })
    }

    pub(super) fn len(&self) -> u32 {
        self.paths.len() as u32
    }

    pub(super) fn is_sequence(&self) -> bool {
        self.is_sequence
    }

    /// Where a capture is, for messages.
    pub(super) fn path(&self, number: u32) -> &Path {
        self.paths.get(number as usize).map_or(Path::new(""), PathBuf::as_path)
    }

    /// The file of a frame.
    pub(super) fn output(&self, out: &Path, number: u32) -> PathBuf {
        if self.is_sequence { out.join(Self::file(number)) } else { out.to_path_buf() }
    }

    /// The name of the file of a frame of a sequence.
    pub(super) fn file(number: u32) -> String {
        format!("{}.ply", frame_name(number))
    }

    pub(super) fn read(&self, number: u32) -> Result<Capture, Failure> {
        let path = self.path(number);
        read_capture(path).map_err(|error| Failure::other(format!("{}: {error}", path.display())))
    }
}

/// Whether a directory has cameras, as [`read_capture`] finds them.
fn is_capture(path: &Path) -> bool {
    let places = ["", "sparse/0", "sparse"];
    let has = |place: &str| {
        ["bin", "txt"].iter().any(|ending| path.join(place).join(format!("images.{ending}")).is_file())
    };
    path.is_dir() && (path.join("transforms.json").is_file() || places.iter().any(|place| has(place)))
}
