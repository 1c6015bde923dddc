//! Archives of scene files, a frame a file: ZIP, tar, and tar compressed by gzip.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use flate2::read::MultiGzDecoder;
use zip::ZipArchive;

use super::names::natural_order;
use super::tar_index::{self, Member};
use super::{Frames, Source};
use crate::error::SceneError;
use crate::format::{is_gzip, is_zip, read_whole};
use crate::limits::{Budget, refused};
use crate::members::{DAMAGED, MEMBER, kind, read_member};
use splatstream_gaussians::GaussianFrame;

/// Scenes are compressed to a tenth or so: what becomes more than this many times as long is no archive of scenes.
const MOST_RATIO: u64 = 64;

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
            return Err(SceneError::truncated(member.at, MEMBER, member.size, there));
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
