//! Archives of scene files, a frame a file: ZIP, tar, and tar compressed by gzip.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use flate2::read::MultiGzDecoder;
use zip::ZipArchive;
use zip::read::ZipFile;

use super::names::natural_order;
use super::{Frames, Source, tar_index};
use crate::error::SceneError;
use crate::format::{EXTENSIONS, is_gzip, is_zip, read_whole};
use crate::limits::{Budget, refused};
use splatstream_gaussians::GaussianFrame;

const MEMBER: &str = "a member of the archive";
const DAMAGED: &str = "the archive is damaged; pack it again";

/// Scenes are compressed to a tenth or so: what becomes more than this many times as long is no archive of scenes.
const MOST_RATIO: u64 = 64;

/// A file of a tar archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Member {
    pub(super) name: String,
    /// Where its content begins, and its bytes.
    pub(super) at: u64,
    pub(super) size: u64,
}

/// The frames of an archive, whose content says of what kind it is.
pub(super) fn open(mut source: Box<dyn Source>, budget: &mut Budget) -> Result<Box<dyn Frames>, SceneError> {
    let mut head = Vec::new();
    source.by_ref().take(4).read_to_end(&mut head)?;
    source.rewind()?;
    if is_zip(&head) {
        return Ok(Box::new(Zip::open(source)?));
    }
    let source = if is_gzip(&head) { unpacked(source)? } else { source };
    Ok(Box::new(Tar::open(source, budget)?))
}

/// The names that are frames, in their order, each with its place in the archive. All must be of one format.
fn frames<'a>(
    names: impl Iterator<Item = (usize, Cow<'a, str>)>,
) -> Result<Vec<(usize, String)>, SceneError> {
    let mut frames = Vec::new();
    let mut kinds = BTreeSet::new();
    for (place, name) in names {
        if let Some(kind) = kind(&name) {
            kinds.insert(kind);
            frames.push((place, name.into_owned()));
        }
    }
    let kinds: Vec<&str> = kinds.into_iter().collect();
    match kinds.as_slice() {
        [] => {
            let what = "the archive holds no frames";
            Err(SceneError::inconsistent(
                what,
                "pack .ply, .compressed.ply, .spz, .sog, .splat, .ksplat or .glb files",
            ))
        }
        [_] => {
            frames.sort_by(|(_, a), (_, b)| natural_order(a, b));
            Ok(frames)
        }
        kinds => {
            let what = format!("the archive holds frames of several formats ({})", kinds.join(", "));
            Err(SceneError::inconsistent(what, "pack files of one format"))
        }
    }
}

/// Whether the name of a member is that of a frame.
pub(crate) fn is_frame(name: &str) -> bool {
    kind(name).is_some()
}

/// Whether a member is what systems put beside files.
pub(crate) fn is_hidden(name: &str) -> bool {
    let file = Path::new(name).file_name();
    file.is_some_and(|file| file.as_encoded_bytes().starts_with(b".")) || name.starts_with("__MACOSX/")
}

/// The format that the name of a member promises; none for folders and for what systems put beside files.
fn kind(name: &str) -> Option<&'static str> {
    let extension = Path::new(name).extension()?.to_str()?;
    // The buffers of a .gltf would be other members.
    let known =
        EXTENSIONS.into_iter().find(|known| extension.eq_ignore_ascii_case(known) && *known != "gltf");
    known.filter(|_| !is_hidden(name) && !name.ends_with('/'))
}

/// The bytes of a member of a ZIP archive, as many as it says.
pub(crate) fn read_member<R: Read>(
    mut member: ZipFile<'_, R>,
    budget: &mut Budget,
) -> Result<Vec<u8>, SceneError> {
    let refuse = |what: String| SceneError::inconsistent(what, DAMAGED);
    let name = member.name().map_or_else(|_| MEMBER.to_owned(), |name| name.escape_default().to_string());
    let size = member.size();
    let mut content = budget.room(size, MEMBER)?;
    let read = (&mut member).take(size).read_to_end(&mut content);
    // The checksum is compared when the member ends.
    let over = read.and_then(|_| member.read(&mut [0]));
    if over.map_err(|error| refuse(format!("{name}: {error}")))? > 0 || (content.len() as u64) < size {
        return Err(refuse(format!("{name} is not as long as the archive says, {size} bytes")));
    }
    Ok(content)
}

struct Zip {
    archive: ZipArchive<Box<dyn Source>>,
    frames: Vec<(usize, String)>,
}

impl Zip {
    fn open(source: Box<dyn Source>) -> Result<Self, SceneError> {
        let refuse = |error| SceneError::inconsistent(format!("cannot list the archive: {error}"), DAMAGED);
        let archive = ZipArchive::new(source).map_err(refuse)?;
        let name = |place| Some((place, archive.name_for_index(place)?.ok()?));
        let names = (0..archive.len()).filter_map(name);
        let frames = frames(names)?;
        Ok(Self { archive, frames })
    }
}

impl Frames for Zip {
    fn len(&self) -> u32 {
        self.frames.len() as u32
    }

    fn member(&self, frame: u32) -> Option<&str> {
        self.frames.get(frame as usize).map(|(_, name)| name.as_str())
    }

    fn read(&mut self, frame: u32, budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
        let (place, name) = self.frames.get(frame as usize).cloned().unwrap_or_default();
        let refuse = |error| SceneError::inconsistent(format!("cannot read it: {error}"), DAMAGED);
        let bytes = read_member(self.archive.by_index(place).map_err(refuse)?, budget)?;
        read_whole(&bytes, Path::new(&name), None, budget)
    }
}

struct Tar {
    source: Box<dyn Source>,
    members: Vec<Member>,
    frames: Vec<(usize, String)>,
}

impl Tar {
    fn open(mut source: Box<dyn Source>, budget: &mut Budget) -> Result<Self, SceneError> {
        let members = tar_index::members(&mut source, budget)?;
        let frames = frames(members.iter().map(|member| Cow::from(&member.name)).enumerate())?;
        Ok(Self { source, members, frames })
    }
}

impl Frames for Tar {
    fn len(&self) -> u32 {
        self.frames.len() as u32
    }

    fn member(&self, frame: u32) -> Option<&str> {
        self.frames.get(frame as usize).map(|(_, name)| name.as_str())
    }

    fn read(&mut self, frame: u32, budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
        let place = self.frames.get(frame as usize).map_or(usize::MAX, |&(place, _)| place);
        let Some(member) = self.members.get(place) else { return Err(refused(0, MEMBER)) };
        let end = self.source.seek(SeekFrom::End(0))?;
        let there = end.saturating_sub(member.at);
        if member.size > there {
            return Err(SceneError::truncated(member.at as usize, MEMBER, member.size, there as usize));
        }
        self.source.seek(SeekFrom::Start(member.at))?;
        let mut bytes = budget.room(member.size, MEMBER)?;
        self.source.by_ref().take(member.size).read_to_end(&mut bytes)?;
        read_whole(&bytes, Path::new(&member.name), None, budget)
    }
}

/// What gzip has compressed, in a temporary file that nobody else sees and that goes with the program.
fn unpacked(mut source: Box<dyn Source>) -> Result<Box<dyn Source>, SceneError> {
    let packed = source.seek(SeekFrom::End(0))?;
    source.rewind()?;
    let most = packed.saturating_mul(MOST_RATIO).max(1 << 20);
    let mut file = tempfile::tempfile()?;
    let mut content = MultiGzDecoder::new(io::BufReader::new(source)).take(most.saturating_add(1));
    let refuse =
        |error: io::Error| SceneError::inconsistent(format!("cannot unpack the archive: {error}"), DAMAGED);
    let length = io::copy(&mut content, &mut file).map_err(refuse)?;
    if length > most {
        let what = format!("the archive becomes more than {MOST_RATIO} times as long as it is");
        return Err(SceneError::unsupported(what, "unpack it, and give the folder of frames"));
    }
    file.flush()?;
    file.rewind()?;
    Ok(Box::new(file))
}
