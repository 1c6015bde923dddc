//! SOG: attributes as lossless WebP images with a `meta.json`, in a directory or a ZIP archive.
//!
//! One pixel a Gaussian, row by row. Version 2 has codebooks for scales, colours and spherical harmonics;
//! version 1 has ranges instead.
//!
//! | image | channels | value |
//! |---|---|---|
//! | `means` low, high | 3 + 3 | 16 bits over `mins`–`maxs`, then sign(e) (exp(abs e) − 1) |
//! | `quats` | 3 + 1 | the smallest three of w, x, y, z over ±1/√2; 252 + the place of the largest |
//! | `scales` | 3 | log scale by codebook or range |
//! | `sh0` | 3 + 1 | DC by codebook or range; opacity, or in version 1 its logit by range |
//! | `shN` labels | 2 | low and high byte of a row of the palette |
//! | `shN` centroids | 3 | the palette: 64 entries a row, 3, 8 or 15 pixels each; by codebook or range |

mod codebook;
mod image;
mod meta;
mod palette;
mod planes;
mod write;

use std::io::{Cursor, Read, Seek};
use std::path::Path;

use zip::ZipArchive;

use crate::error::SceneError;
use crate::limits::{Budget, ReadLimits};
use crate::members::{is_frame, is_hidden, read_member};
use crate::reading::{checked, read_file};
use splatstream_gaussians::GaussianFrame;

pub use write::write_zip;

/// The name of the file that describes the others.
pub(crate) const META: &str = "meta.json";

/// Reads the SOG scene in a directory, which holds a `meta.json`. Opacity 0 and 255 become finite logits.
///
/// # Errors
/// Files that are missing or not what `meta.json` says, more than `limits` allow, or a value that no frame
/// may hold. The error carries the path of the file at fault.
pub fn read_dir(directory: &Path, limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    let checked = checked(read_dir_as_is(directory, &mut Budget::new(limits))?);
    checked.map_err(|error| error.in_file(directory))
}

/// As [`read_dir`], with values as they are: none is checked.
pub(crate) fn read_dir_as_is(directory: &Path, budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
    let fetch = |name: &str, budget: &mut Budget| {
        // A name that leads elsewhere would let a scene read any file.
        if Path::new(name).file_name().is_none_or(|file| file != name) {
            let what = format!("{META} names \"{name}\", which is no plain file name");
            return Err(SceneError::inconsistent(what, "export the scene again").in_file(directory));
        }
        read_file(&directory.join(name), budget)
    };
    planes::read(fetch, budget).map_err(|error| error.in_file(directory))
}

/// Where a ZIP archive has the files of a SOG scene, as what their names begin with: nothing, or the one folder with a
/// `meta.json` of an archive without frames in other formats. None if the archive holds no scene, or several.
pub(crate) fn folder_in<R: Read + Seek>(archive: &ZipArchive<R>) -> Option<String> {
    if archive.index_for_name(META).is_some() {
        return Some(String::new());
    }
    let mut folder = None;
    for name in archive.file_names().filter_map(Result::ok).filter(|name| !is_hidden(name)) {
        match name.strip_suffix(META).filter(|folder| folder.ends_with('/')) {
            Some(_) if folder.is_some() => return None,
            Some(found) => folder = Some(found.to_owned()),
            None if is_frame(&name) => return None,
            None => {}
        }
    }
    folder
}

/// Reads a SOG scene bundled as a ZIP archive, by itself or in one folder. Opacity 0 and 255 become finite logits.
///
/// # Errors
/// Those of [`read_dir`]; the message names the member at fault.
pub fn read_zip(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_zip_as_is(Cursor::new(bytes), &mut Budget::new(limits))?)
}

/// As [`read_zip`], with values as they are: none is checked. Members are read one by one, `meta.json` first, and the archive is
/// never in memory as a whole unless it is there already.
pub(crate) fn read_zip_as_is(
    archive: impl Read + Seek,
    budget: &mut Budget,
) -> Result<GaussianFrame, SceneError> {
    let refuse = |what: String| SceneError::inconsistent(what, "this is no SOG archive, or it is damaged");
    let mut archive = ZipArchive::new(archive).map_err(|error| refuse(format!("cannot list it: {error}")))?;
    let folder = folder_in(&archive).unwrap_or_default();
    let fetch = |name: &str, budget: &mut Budget| {
        let name = format!("{folder}{name}");
        let member = archive.by_name(&name).map_err(|error| refuse(format!("{name}: {error}")))?;
        read_member(member, budget)
    };
    planes::read(fetch, budget)
}
