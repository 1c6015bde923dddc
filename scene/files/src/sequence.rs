//! Files that hold many frames, which are read one at a time.

mod archive;
mod names;
mod splats4d;
mod splatv;
mod tar_index;

use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

use crate::error::SceneError;
use crate::format::{SceneFormat, detect};
use crate::limits::{Budget, ReadLimits};
use crate::printable::Printable;
use crate::scene::Scene;
use splatstream_gaussians::GaussianFrame;

pub use names::natural_order;

/// How the frames of a sequence are chosen, where the file leaves that open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SequenceOptions {
    /// Frames that are taken of a scene in continuous time (`.splatv`): frame `f` shows time `f / samples` of its length.
    /// Default: 50.
    pub samples: u32,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self { samples: 50 }
    }
}

/// A file of many frames: an archive of scene files (ZIP, tar, tar.gz), `.splatv`, or `.splat4d`.
///
/// Memory holds one frame and what it is decoded from, within the limits: of `.splatv` all its Gaussians, of `.splat4d` one
/// group of frames, of archives the names of all files. A tar.gz is unpacked into a temporary file that has no name.
///
/// ```no_run
/// use splatstream_files::{ReadLimits, Sequence, SequenceOptions};
/// let mut frames = Sequence::open("talk.zip".as_ref(), &ReadLimits::default(), &SequenceOptions::default())?;
/// for number in 0..frames.len() {
///     println!("{}: {} Gaussians", frames.name(number), frames.frame(number)?.frame.len());
/// }
/// # Ok::<(), splatstream_files::SceneError>(())
/// ```
pub struct Sequence {
    path: PathBuf,
    limits: ReadLimits,
    frames: Box<dyn Frames>,
}

/// What reads the frames of one format.
trait Frames: Send {
    /// How many there are.
    fn len(&self) -> u32;

    /// The file inside the archive that a frame is; nothing where frames are no files.
    fn member(&self, _frame: u32) -> Option<&str> {
        None
    }

    /// Reads a frame, one of those that are there; values are not checked.
    fn read(&mut self, frame: u32, budget: &mut Budget) -> Result<GaussianFrame, SceneError>;
}

/// What a sequence is read from.
pub(crate) trait Source: Read + Seek + Send {}

impl<T: Read + Seek + Send> Source for T {}

impl SceneFormat {
    /// Whether files of the format hold many frames, and are read as a [`Sequence`].
    pub fn is_sequence(self) -> bool {
        matches!(self, Self::Archive | Self::Splatv | Self::Splat4d)
    }
}

impl Sequence {
    /// Opens the sequence at `path`, whose content decides its format.
    ///
    /// # Errors
    /// A file that cannot be read, that holds a single scene, or that is damaged; more than `limits` allow.
    pub fn open(path: &Path, limits: &ReadLimits, options: &SequenceOptions) -> Result<Self, SceneError> {
        let format = detect(path)?;
        let file = File::open(path).map_err(|error| SceneError::from(error).in_file(path))?;
        Self::of(file, format, path, limits, options)
    }

    /// The sequence in `source`, which is of a known format, and called `path` in messages.
    ///
    /// # Errors
    /// As [`Sequence::open`].
    pub fn of(
        source: impl Read + Seek + Send + 'static,
        format: SceneFormat,
        path: &Path,
        limits: &ReadLimits,
        options: &SequenceOptions,
    ) -> Result<Self, SceneError> {
        let source: Box<dyn Source> = Box::new(source);
        let mut budget = Budget::new(limits);
        let frames: Result<Box<dyn Frames>, SceneError> = match format {
            SceneFormat::Archive => archive::open(source, &mut budget),
            SceneFormat::Splatv => {
                splatv::Splatv::open(source, options.samples, &mut budget).map(|it| Box::new(it) as _)
            }
            SceneFormat::Splat4d => splats4d::Splat4d::open(source, &mut budget).map(|it| Box::new(it) as _),
            _ => Err(SceneError::unsupported(
                "the file holds one scene",
                "read it as a scene, not as a sequence",
            )),
        };
        let frames = frames.map_err(|error| error.in_file(path))?;
        Ok(Self { path: path.to_path_buf(), limits: *limits, frames })
    }

    /// How many frames.
    pub fn len(&self) -> u32 {
        self.frames.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What a frame is called in messages: the file, and the file in it, whose characters of control stand as their escapes.
    pub fn name(&self, frame: u32) -> String {
        match self.frames.member(frame) {
            Some(member) => Printable(&self.path.join(member).to_string_lossy()).to_string(),
            None => format!("frame {frame} of {}", self.path.display()),
        }
    }

    /// Reads a frame, counted from 0; any order is allowed, and rising numbers are the fastest. Values are not checked: see
    /// [`GaussianFrame::validate`].
    ///
    /// # Errors
    /// A number that is not below [`Sequence::len`], a frame that is damaged, or more than the limits allow.
    pub fn frame(&mut self, frame: u32) -> Result<Scene, SceneError> {
        let mut budget = Budget::new(&self.limits);
        let read = match frame < self.len() {
            true => self.frames.read(frame, &mut budget),
            false => {
                let what = format!("there is no frame {frame}, {} are there", self.len());
                Err(SceneError::inconsistent(what, "count frames from 0"))
            }
        };
        let path =
            self.frames.member(frame).map_or_else(|| self.path.clone(), |member| self.path.join(member));
        let frame = read.map_err(|error| error.in_file(&path))?;
        Ok(Scene { frame, notes: budget.into_notes() })
    }
}
