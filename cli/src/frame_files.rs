//! Frames in files: which files, in which order, each read when it is needed.

use crate::failure::Failure;
use crate::input_args::{InputArgs, with_advice};
use crate::output_file::STANDARD;
use crate::stream_file::is_stream;
use crate::unfinished::Unfinished;
use splatstream_encoder::FrameSource;
use splatstream_files::{read_scene, read_scene_as_is};
use splatstream_gaussians::GaussianFrame;
use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// Extensions of the scene formats.
const EXTENSIONS: [&str; 4] = ["ply", "spz", "sog", "splat"];

/// The file that makes a directory a SOG scene.
const SOG_META: &str = "meta.json";

/// A frame a file, in natural order of their names.
pub(crate) struct FrameFiles {
    paths: Vec<PathBuf>,
    reading: InputArgs,
    /// The frame read last: of a single frame, the encoder's second pass needs no second reading.
    last: Option<(u32, GaussianFrame)>,
    /// Whether values that no frame may hold are left to whoever asks for the frames.
    as_is: bool,
    /// What came by standard input, until it is read.
    spooled: Option<Unfinished>,
    /// The fewest and the most Gaussians of the frames read so far.
    counts: Option<(usize, usize)>,
}

/// What standard input is called in messages.
const STANDARD_INPUT: &str = "standard input";

impl FrameFiles {
    /// The frames that the arguments of a command name: files, or one directory of frames.
    pub(crate) fn find(inputs: &[PathBuf], reading: InputArgs) -> Result<Self, Failure> {
        let mut spooled = None;
        let mut paths = match inputs {
            [only] if only.as_path() == Path::new(STANDARD) => {
                let file = spool()?;
                let path = file.path().to_path_buf();
                if is_stream(&path) {
                    return Err(is_encoded(STANDARD_INPUT));
                }
                spooled = Some(file);
                vec![path]
            }
            [directory] if directory.is_dir() && !is_sog(directory) => frames_in(directory)?,
            files => {
                files.iter().try_for_each(|path| check_file(path))?;
                files.to_vec()
            }
        };
        paths.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
        Ok(Self { paths, reading, last: None, as_is: false, spooled, counts: None })
    }

    /// Values are not checked.
    pub(crate) fn unchecked(self) -> Self {
        Self { as_is: true, ..self }
    }

    /// The files, in the order of the frames.
    pub(crate) fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// The fewest and the most Gaussians of the frames that were read.
    pub(crate) fn counts(&self) -> (usize, usize) {
        self.counts.unwrap_or_default()
    }

    /// What a frame is called in messages.
    pub(crate) fn name(&self, frame: u32) -> String {
        match self.paths.get(frame as usize) {
            Some(_) if self.spooled.is_some() => STANDARD_INPUT.to_owned(),
            Some(path) => path.display().to_string(),
            None => format!("frame {frame}"),
        }
    }
}

/// Standard input in a file: scenes are read more than once.
fn spool() -> Result<Unfinished, Failure> {
    let directory = std::env::temp_dir();
    let failed = |error| Failure::file("keep standard input in", &directory, &error);
    let (mut file, unfinished) = Unfinished::create(&directory, false).map_err(failed)?;
    io::copy(&mut io::stdin().lock(), &mut file).map_err(failed)?;
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
        self.paths.len() as u32
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        if let Some((last, frame)) = &self.last
            && *last == number
        {
            return Ok(frame.clone());
        }
        let path = self.paths.get(number as usize).ok_or_else(|| format!("there is no frame {number}"))?;
        let read = if self.as_is { read_scene_as_is } else { read_scene };
        let name = |error: splatstream_files::SceneError| match self.spooled {
            Some(_) => with_advice(&error).replace(&*path.to_string_lossy(), STANDARD_INPUT),
            None => with_advice(&error),
        };
        let frame = read(path, &self.reading.limits(path)).map_err(name)?;
        let (fewest, most) = self.counts.unwrap_or((frame.len(), frame.len()));
        self.counts = Some((fewest.min(frame.len()), most.max(frame.len())));
        self.last = Some((number, frame.clone()));
        Ok(frame)
    }
}

/// A file or a SOG directory: one frame.
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
            "{folder}: no frames here\n  give a directory with .ply, .compressed.ply, .spz, .sog or .splat files"
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

/// The format that a name promises; none for what is no scene.
fn kind_of(path: &Path) -> Option<&'static str> {
    if is_sog(path) {
        return Some("sog");
    }
    let extension = path.extension()?.to_str()?;
    let known = EXTENSIONS.into_iter().find(|known| extension.eq_ignore_ascii_case(known));
    known.filter(|_| path.is_file())
}

fn is_sog(path: &Path) -> bool {
    path.join(SOG_META).is_file()
}

/// Orders names as people count: frame_9 before frame_10.
pub(crate) fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    loop {
        let (text_a, number_a, rest_a) = split_number(left);
        let (text_b, number_b, rest_b) = split_number(right);
        let order = text_a
            .cmp(text_b)
            .then_with(|| number_a.len().cmp(&number_b.len()))
            .then_with(|| number_a.cmp(number_b));
        if order != Ordering::Equal {
            return order;
        }
        if rest_a.is_empty() || rest_b.is_empty() {
            // Names that differ only in leading zeros still have one order.
            return rest_a.len().cmp(&rest_b.len()).then_with(|| a.cmp(b));
        }
        (left, right) = (rest_a, rest_b);
    }
}

/// A name up to its first number, that number without leading zeros, and the rest.
fn split_number(name: &str) -> (&str, &str, &str) {
    let start = name.find(|c: char| c.is_ascii_digit()).unwrap_or(name.len());
    let (text, rest) = name.split_at(start);
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    let (number, rest) = rest.split_at(end);
    (text, number.trim_start_matches('0'), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_in_the_order_that_people_count_in() {
        let mut names = ["f10.ply", "f9.ply", "f010.ply", "f1b2.ply", "f1b10.ply", "a.ply"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["a.ply", "f1b2.ply", "f1b10.ply", "f9.ply", "f010.ply", "f10.ply"]);
    }

    #[test]
    fn the_order_of_names_is_total() {
        let names = ["", "1", "01", "1a", "a1", "a", "a1b", "a01b", "a2"];
        for a in names {
            for b in names {
                assert_eq!(natural_order(a, b), natural_order(b, a).reverse(), "{a} {b}");
                assert_eq!(natural_order(a, b) == Ordering::Equal, a == b, "{a} {b}");
            }
        }
    }
}
