//! Which format a file is in, and reading it without being told.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::error::{SceneError, SceneErrorKind};
use crate::limits::{Budget, ReadLimits};
use crate::reading::{checked, read_file};
use crate::{compressed_ply, ply, sog, splat, spz};
use splatstream_gaussians::GaussianFrame;

/// A PLY header must fit in this many bytes for [`detect`] to tell packed vertices from plain ones.
const HEAD: u64 = 64 << 10;

/// The formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneFormat {
    /// Standard Gaussian splatting PLY: [`ply`].
    Ply,
    /// PLY with packed vertices: [`compressed_ply`].
    CompressedPly,
    /// 32-byte records: [`splat`].
    Splat,
    /// Versions 1 to 4: [`spz`].
    Spz,
    /// A directory or a ZIP archive of images: [`sog`].
    Sog,
}

/// The format of the file or directory at `path`: its content decides, and its extension only where content
/// cannot (`.splat`).
///
/// # Errors
/// A path that cannot be read, or content of no known format.
pub fn detect(path: &Path) -> Result<SceneFormat, SceneError> {
    if sog_directory(path).is_some() {
        return Ok(SceneFormat::Sog);
    }
    let mut head = Vec::new();
    File::open(path)
        .and_then(|file| file.take(HEAD).read_to_end(&mut head))
        .map_err(|error| SceneError::from(error).in_file(path))?;
    format_of(&head, path).map_err(|error| error.in_file(path))
}

/// Reads the scene at `path`: a file of any supported format, a SOG directory, or the `meta.json` in one.
///
/// # Errors
/// Those of [`detect`] and of the format's reader, with the path.
pub fn read_scene(path: &Path, limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_scene_as_is(path, limits)?).map_err(|error| error.in_file(path))
}

/// As [`read_scene`], but with all values as they are, even those that no frame may hold: see
/// [`GaussianFrame::defects`].
///
/// # Errors
/// As [`read_scene`], without those of values.
pub fn read_scene_as_is(path: &Path, limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    let mut budget = Budget::new(limits);
    if let Some(directory) = sog_directory(path) {
        return sog::read_dir_as_is(&directory, &mut budget);
    }
    let mut read = || {
        let budget = &mut budget;
        let bytes = read_file(path, budget)?;
        match format_of(&bytes, path)? {
            SceneFormat::Ply => ply::read_as_is(&bytes, budget),
            SceneFormat::CompressedPly => compressed_ply::read_as_is(&bytes, budget),
            SceneFormat::Splat => splat::read_as_is(&bytes, budget),
            SceneFormat::Spz => spz::read_as_is(&bytes, budget),
            SceneFormat::Sog => sog::read_zip_as_is(&bytes, budget),
        }
    };
    read().map_err(|error| error.in_file(path))
}

/// The directory of a SOG scene: `path` itself, or that of a `meta.json`.
fn sog_directory(path: &Path) -> Option<PathBuf> {
    if path.file_name().is_some_and(|name| name == sog::META) {
        return Some(path.parent()?.to_path_buf());
    }
    fs::metadata(path).is_ok_and(|found| found.is_dir()).then(|| path.to_path_buf())
}

fn format_of(bytes: &[u8], path: &Path) -> Result<SceneFormat, SceneError> {
    if ply::is_ply(bytes) {
        let header = ply::parse_header(bytes, &mut Budget::new(&ReadLimits::default()))?;
        let packed = header.element("vertex").is_some_and(ply::is_packed);
        return Ok(if packed { SceneFormat::CompressedPly } else { SceneFormat::Ply });
    }
    if spz::is_spz(bytes) {
        return Ok(SceneFormat::Spz);
    }
    if sog::is_zip(bytes) {
        return Ok(SceneFormat::Sog);
    }
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("splat")) {
        return Ok(SceneFormat::Splat);
    }
    Err(SceneErrorKind::Unsupported {
        what: "the content is of no known scene format".to_owned(),
        advice: "give a .ply, .compressed.ply, .spz, .sog or .splat file, or a SOG directory",
    }
    .into())
}
