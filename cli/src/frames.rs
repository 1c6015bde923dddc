//! The frames of a stream, a scene file or a directory, one after the other.

use crate::encode::warnings::Warning;
use crate::failure::{Failure, StreamFault};
use crate::frame_files::{FrameFiles, STANDARD_INPUT, spool};
use crate::input_args::InputArgs;
use crate::standard::STANDARD;
use crate::stream_file::{StreamFile, is_stream};
use crate::unfinished::Unfinished;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream;
use splatstream_encoder::FrameSource;
use splatstream_format::payload::SceneDescription;
use splatstream_format::syntax::SIGNATURE;
use splatstream_format::{Error, Limits};
use splatstream_gaussians::GaussianFrame;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Frames that a user named: a stream, or files.
pub(crate) enum Opened {
    /// The bytes of a stream.
    Stream(StreamFile),
    /// A scene file, a file of many frames or a directory of frames, and how it is read.
    Scene(PathBuf, InputArgs),
    /// A scene file or a file of many frames that came by standard input.
    Spooled(Arc<Unfinished>, InputArgs),
}

/// The frames, in order.
pub(crate) enum Frames<'a> {
    /// Decoded as they are asked for.
    Stream(Box<Decoding<'a>>),
    /// Read as they are asked for.
    Files {
        files: Box<FrameFiles>,
        next: u32,
        /// Their display indices, where these are not just those of their order.
        numbers: Option<Vec<u32>>,
    },
}

/// A stream that is decoded frame by frame; decoding goes on after errors.
pub(crate) struct Decoding<'a> {
    file: &'a StreamFile,
    frames: stream::Frames<'a>,
    expected: u32,
}

impl Opened {
    /// What a user named; its content decides what it is.
    pub(crate) fn open(path: &Path, reading: InputArgs) -> Result<Self, Failure> {
        match path == Path::new(STANDARD) {
            true => Self::of_standard_input(reading),
            false if is_stream(path) => StreamFile::read(path).map(Self::Stream),
            false => Ok(Self::Scene(path.to_path_buf(), reading)),
        }
    }

    /// What comes by standard input: a stream, or else a scene, which is kept in a file.
    fn of_standard_input(reading: InputArgs) -> Result<Self, Failure> {
        let start = StreamFile::read(Path::new(STANDARD))?;
        if start.bytes.starts_with(&SIGNATURE) {
            return Ok(Self::Stream(start));
        }
        let mut whole = start.bytes.chain(io::stdin().lock());
        let spooled = spool(&mut whole, reading.most())?;
        Ok(Self::Spooled(Arc::new(spooled), reading))
    }

    /// What a stream says about its scene.
    pub(crate) fn description(&self, limits: &Limits) -> Option<SceneDescription> {
        match self {
            Self::Stream(file) => file.description(limits),
            Self::Scene(..) | Self::Spooled(..) => None,
        }
    }

    /// Its frames, from the first; of a stream those of an operating point, which files do not have.
    pub(crate) fn frames(
        &self,
        options: &Options,
        point: Option<OperatingPoint>,
    ) -> Result<Frames<'_>, Failure> {
        match self {
            Self::Stream(file) => {
                let operating_point = point.unwrap_or(OperatingPoint::ALL);
                let options = Options { operating_point, ..*options };
                file.check_point(operating_point, &options.limits)?;
                let expected = file.frame_count(&options.limits);
                let frames =
                    stream::Frames::open(&file.bytes, &options).map_err(|error| file.fault(error))?;
                Ok(Frames::Stream(Box::new(Decoding { file, frames, expected })))
            }
            Self::Scene(path, _) if point.is_some() => Err(without_points(&path.to_string_lossy())),
            Self::Spooled(..) if point.is_some() => Err(without_points(STANDARD_INPUT)),
            Self::Scene(path, reading) => {
                FrameFiles::find(std::slice::from_ref(path), *reading).map(Frames::of_files)
            }
            Self::Spooled(spooled, reading) => {
                FrameFiles::of_spooled(Arc::clone(spooled), *reading).map(Frames::of_files)
            }
        }
    }
}

/// Files are asked for those of an operating point.
fn without_points(name: &str) -> Failure {
    Failure::Usage(format!("{name}: only a stream has operating points; leave --op out"))
}

impl Frames<'_> {
    /// Those of files, from the first.
    fn of_files(files: FrameFiles) -> Self {
        Self::Files { files: Box::new(files), next: 0, numbers: None }
    }

    /// Takes the numbers in the names of files for display indices, if these are all below `end` and not those of their order
    /// anyhow. Says whether it does.
    pub(crate) fn number_by_name(&mut self, end: u32) -> bool {
        let Self::Files { files, numbers, .. } = self else { return false };
        let is_other = |found: &Vec<u32>| found.iter().zip(0..).any(|(&number, at)| number != at);
        *numbers =
            files.numbers().filter(|found| found.iter().all(|&number| number < end) && is_other(found));
        numbers.is_some()
    }

    /// How many there should be; 0 if that is not known.
    pub(crate) fn expected(&self) -> u32 {
        match self {
            Self::Stream(decoding) => decoding.expected,
            Self::Files { files, .. } => files.len(),
        }
    }

    /// The files that are read.
    pub(crate) fn inputs(&self) -> Vec<PathBuf> {
        match self {
            Self::Stream(decoding) => vec![decoding.file.path.clone()],
            Self::Files { files, .. } => files.inputs(),
        }
    }

    /// The next frame and its display index. A stream may lack frames, in particular at an operating point; those of which
    /// nothing is known are left out.
    pub(crate) fn next(&mut self) -> Result<Option<(u32, GaussianFrame)>, Failure> {
        match self {
            Self::Stream(decoding) => decoding.next(),
            Self::Files { files, next, numbers } => {
                let place = *next;
                if place >= files.len() {
                    return Ok(None);
                }
                let frame = files.frame(place).map_err(|error| Failure::other(error.to_string()))?;
                *next += 1;
                let number = numbers.as_ref().and_then(|numbers| numbers.get(place as usize).copied());
                Ok(Some((number.unwrap_or(place), frame)))
            }
        }
    }

    /// What readers of files have changed on the way, as far as frames have been read.
    pub(crate) fn warnings(&self) -> Vec<Warning> {
        match self {
            Self::Stream(_) => Vec::new(),
            Self::Files { files, .. } => files.warnings(),
        }
    }

    /// What is wrong with the stream, as far as it has been decoded.
    pub(crate) fn faults(&self) -> Vec<StreamFault> {
        self.errors().into_iter().map(StreamFault::from).collect()
    }

    /// The verdict on the stream, as far as it has been decoded.
    pub(crate) fn verdict(&self) -> Result<(), Failure> {
        match (self, self.errors().first().copied()) {
            (Self::Stream(decoding), Some(error)) => Err(decoding.file.fault(error)),
            _ => Ok(()),
        }
    }

    fn errors(&self) -> Vec<Error> {
        match self {
            Self::Stream(decoding) => decoding.frames.summary().errors,
            Self::Files { .. } => Vec::new(),
        }
    }
}

impl Decoding<'_> {
    fn next(&mut self) -> Result<Option<(u32, GaussianFrame)>, Failure> {
        while let Some(frame) = self.frames.next_frame() {
            if let (false, Some(sequence)) = (frame.is_lost, self.frames.sequence()) {
                return Ok(Some((frame.index, to_gaussians(frame.into_shown(), sequence)?)));
            }
        }
        Ok(None)
    }
}
