//! Which format a file is in.

use std::fs::{self, File};
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use zip::ZipArchive;

use crate::error::{SceneError, SceneErrorKind};
use crate::limits::{Budget, ReadLimits};
use crate::{compressed_ply, gltf, ksplat, ply, sog, splat, spz};
use splatstream_gaussians::GaussianFrame;

/// Bytes of a file by which [`detect`] tells its format: the longest header of a PLY file that is read, and one more, which says
/// whether a header goes on.
pub const HEAD: u64 = ply::MOST_HEADER as u64 + 1;

/// What a `.splatv` file begins with.
pub(crate) const SPLATV: [u8; 4] = [0x4b, 0x67, 0, 0];

/// What a `.splat4d` file begins with.
pub(crate) const SPLAT4D: [u8; 4] = *b"SP4D";

/// Where a tar archive has its name, and that.
const TAR: (usize, &[u8]) = (257, b"ustar");

/// What to give where a file is of no known format.
const GIVE: &str = "give a .ply, .compressed.ply, .spz, .sog, .splat, .ksplat, .glb or .gltf file, a SOG directory, or a \
                    sequence: .splatv, .splat4d, .zip, .tar or .tar.gz";

/// The formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SceneFormat {
    /// Standard Gaussian splatting PLY: [`ply`].
    Ply,
    /// PLY with packed vertices: [`compressed_ply`].
    CompressedPly,
    /// 32-byte records: [`splat`].
    Splat,
    /// Versions 1 to 4: [`spz`].
    Spz,
    /// A directory of images, or a ZIP archive of them or of their directory: [`sog`].
    Sog,
    /// `.glb` and `.gltf` with Gaussians: [`gltf`].
    Gltf,
    /// Sections of Gaussians at three levels of compression: [`ksplat`].
    Ksplat,
    /// Gaussians in continuous time: a [`Sequence`](crate::sequence::Sequence).
    Splatv,
    /// Frames of one count: a [`Sequence`](crate::sequence::Sequence).
    Splat4d,
    /// A ZIP or tar archive of scene files: a [`Sequence`](crate::sequence::Sequence).
    Archive,
}

/// The format of the file or directory at `path`: its content decides, and its extension only where content
/// cannot (`.splat`, `.ksplat`).
///
/// # Errors
/// A path that cannot be read, an empty file, or content of no known format.
pub fn detect(path: &Path) -> Result<SceneFormat, SceneError> {
    if sog_directory(path).is_some() {
        return Ok(SceneFormat::Sog);
    }
    let find = || {
        let mut file = File::open(path)?;
        let mut head = Vec::new();
        file.by_ref().take(HEAD).read_to_end(&mut head)?;
        if head.is_empty() {
            return Err(SceneErrorKind::Empty.into());
        }
        format_of(&head, path, file)
    };
    find().map_err(|error| error.in_file(path))
}

/// Reads a scene that is in memory, of any format but sequences; values are not checked. Its name decides where content
/// cannot, and files that it refers to are those of the directory.
pub(crate) fn read_whole(
    bytes: &[u8],
    name: &Path,
    directory: Option<&Path>,
    budget: &mut Budget,
) -> Result<GaussianFrame, SceneError> {
    if bytes.is_empty() {
        return Err(SceneErrorKind::Empty.into());
    }
    match format_of(bytes, name, std::io::Cursor::new(bytes))? {
        SceneFormat::Ply => ply::read_as_is(bytes, budget),
        SceneFormat::CompressedPly => compressed_ply::read_as_is(bytes, budget),
        SceneFormat::Splat => splat::read_as_is(bytes, budget),
        SceneFormat::Spz => spz::read_as_is(bytes, budget),
        SceneFormat::Sog => sog::read_zip_as_is(std::io::Cursor::new(bytes), budget),
        SceneFormat::Gltf => gltf::read_as_is(bytes, directory, budget),
        SceneFormat::Ksplat => ksplat::read_as_is(bytes, budget),
        SceneFormat::Splatv | SceneFormat::Splat4d | SceneFormat::Archive => Err(SceneError::unsupported(
            "a sequence inside of an archive",
            "unpack the archive, and give the sequence",
        )),
    }
}

/// The directory of a SOG scene: `path` itself, or that of a `meta.json`.
pub(crate) fn sog_directory(path: &Path) -> Option<PathBuf> {
    if path.file_name().is_some_and(|name| name == sog::META) {
        return Some(path.parent()?.to_path_buf());
    }
    fs::metadata(path).is_ok_and(|found| found.is_dir()).then(|| path.to_path_buf())
}

/// The format of a file, by how it begins and by its name; `whole` is the file, which is listed if it is an archive.
fn format_of(head: &[u8], path: &Path, whole: impl Read + Seek) -> Result<SceneFormat, SceneError> {
    let has_extension = |known: &str| path.extension().is_some_and(|found| found.eq_ignore_ascii_case(known));
    if ply::is_ply(head) {
        let header = ply::parse_header(head, &mut Budget::new(&ReadLimits::default()))?;
        let packed = header.element("vertex").is_some_and(ply::is_packed);
        return Ok(if packed { SceneFormat::CompressedPly } else { SceneFormat::Ply });
    }
    if is_gzip(head) {
        let mut start = Vec::new();
        // What is damaged is said when it is read.
        let _ = GzDecoder::new(head).take(512).read_to_end(&mut start);
        return Ok(if is_tar(&start) { SceneFormat::Archive } else { SceneFormat::Spz });
    }
    if is_zip(head) {
        let has_scene = ZipArchive::new(whole).is_ok_and(|archive| sog::folder_in(&archive).is_some());
        let is_sog = has_scene || has_extension("sog");
        return Ok(if is_sog { SceneFormat::Sog } else { SceneFormat::Archive });
    }
    if is_tar(head) {
        return Ok(SceneFormat::Archive);
    }
    if spz::is_spz(head) {
        return Ok(SceneFormat::Spz);
    }
    if gltf::is_glb(head) || has_extension("gltf") && gltf::is_json(head) {
        return Ok(SceneFormat::Gltf);
    }
    if head.starts_with(&SPLAT4D) {
        return Ok(SceneFormat::Splat4d);
    }
    if head.starts_with(&SPLATV) && !has_extension("splat") {
        return Ok(SceneFormat::Splatv);
    }
    match [("splat", SceneFormat::Splat), ("ksplat", SceneFormat::Ksplat)]
        .iter()
        .find(|(name, _)| has_extension(name))
    {
        Some(&(_, format)) => Ok(format),
        None => Err(SceneError::unsupported("the content is of no known scene format", GIVE)),
    }
}

/// Whether `bytes` begin as a ZIP archive does.
pub(crate) fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

/// Whether `bytes` begin as gzip does.
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

fn is_tar(bytes: &[u8]) -> bool {
    let (at, name) = TAR;
    bytes.get(at..).is_some_and(|rest| rest.starts_with(name))
}
