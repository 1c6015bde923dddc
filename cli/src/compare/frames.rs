//! The frames of a stream, a scene file or a directory, one after the other.

use crate::failure::Failure;
use crate::frame_files::FrameFiles;
use crate::stream_file::{StreamFile, is_stream};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Decoder, Options};
use splatstream_encoder::FrameSource;
use splatstream_format::Limits;
use splatstream_format::unit::{Stream, Units};
use splatstream_scene::GaussianFrame;
use std::path::{Path, PathBuf};

/// One side of a comparison.
pub(super) enum Opened {
    /// The bytes of a stream.
    Stream(StreamFile),
    /// A scene file or a directory of frames.
    Scene(PathBuf),
}

/// The frames of one side, in order.
pub(super) enum Frames<'a> {
    /// Decoded as they are asked for.
    Stream { file: &'a StreamFile, units: Units<'a>, decoder: Box<Decoder<'a>>, expected: u32 },
    /// Read as they are asked for.
    Files { files: Box<FrameFiles>, next: u32 },
}

impl Opened {
    /// What a user named; its content decides what it is.
    pub(super) fn open(path: &Path) -> Result<Self, Failure> {
        if is_stream(path) {
            return StreamFile::read(path).map(Self::Stream);
        }
        Ok(Self::Scene(path.to_path_buf()))
    }

    /// Its frames, from the first.
    pub(super) fn frames(&self, limits: &Limits) -> Result<Frames<'_>, Failure> {
        match self {
            Self::Stream(file) => {
                let stream = Stream::open(&file.bytes, limits).map_err(|error| file.fault(error))?;
                let options = Options { limits: *limits, ..Options::default() };
                let expected = file.sequence(limits).map_or(0, |sequence| sequence.frame_count);
                let decoder = Box::new(Decoder::new(stream.header(), options));
                Ok(Frames::Stream { file, units: stream.units(), decoder, expected })
            }
            Self::Scene(path) => {
                let files = Box::new(FrameFiles::find(std::slice::from_ref(path))?);
                Ok(Frames::Files { files, next: 0 })
            }
        }
    }
}

impl Frames<'_> {
    /// How many there should be; 0 if that is not known.
    pub(super) fn expected(&self) -> u32 {
        match self {
            Self::Stream { expected, .. } => *expected,
            Self::Files { files, .. } => files.len(),
        }
    }

    /// The next frame.
    pub(super) fn next(&mut self) -> Result<Option<GaussianFrame>, Failure> {
        match self {
            Self::Stream { file, units, decoder, .. } => {
                let decoded = next_decoded(units, decoder).map_err(|error| file.fault(error))?;
                Ok(decoded
                    .zip(decoder.sequence())
                    .map(|(frame, sequence)| to_gaussians(frame.planes, sequence)))
            }
            Self::Files { files, next } => {
                if *next >= files.len() {
                    return Ok(None);
                }
                let frame = files.frame(*next).map_err(|error| Failure::other(error.to_string()))?;
                *next += 1;
                Ok(Some(frame))
            }
        }
    }
}

/// Feeds units until a frame is complete.
fn next_decoded<'a>(
    units: &mut Units<'a>,
    decoder: &mut Decoder<'a>,
) -> splatstream_format::Result<Option<DecodedFrame>> {
    for unit in units {
        if let Some(frame) = decoder.unit(&unit?)? {
            return Ok(Some(frame));
        }
    }
    Ok(None)
}
