//! The frames of a stream, a scene file or a directory, one after the other.

use crate::failure::Failure;
use crate::frame_files::FrameFiles;
use crate::stream_file::{StreamFile, is_stream};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Decoder, Options};
use splatstream_encoder::FrameSource;
use splatstream_format::Limits;
use splatstream_format::unit::{Stream, Units};
use splatstream_scene::GaussianFrame;
use std::path::{Path, PathBuf};

/// Frames that a user named: a stream, or files.
pub(crate) enum Opened {
    /// The bytes of a stream.
    Stream(StreamFile),
    /// A scene file or a directory of frames.
    Scene(PathBuf),
}

/// The frames, in order.
pub(crate) enum Frames<'a> {
    /// Decoded as they are asked for.
    Stream { file: &'a StreamFile, units: Units<'a>, decoder: Box<Decoder<'a>>, expected: u32 },
    /// Read as they are asked for.
    Files { files: Box<FrameFiles>, next: u32 },
}

impl Opened {
    /// What a user named; its content decides what it is.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        if is_stream(path) {
            return StreamFile::read(path).map(Self::Stream);
        }
        Ok(Self::Scene(path.to_path_buf()))
    }

    /// Its frames, from the first; of a stream those of an operating point, which files do not have.
    pub(crate) fn frames(
        &self,
        limits: &Limits,
        point: Option<OperatingPoint>,
    ) -> Result<Frames<'_>, Failure> {
        match self {
            Self::Stream(file) => {
                let stream = Stream::open(&file.bytes, limits).map_err(|error| file.fault(error))?;
                let operating_point = point.unwrap_or(OperatingPoint::ALL);
                file.check_point(operating_point, limits)?;
                let options = Options { limits: *limits, operating_point, ..Options::default() };
                let expected = file.sequence(limits).map_or(0, |sequence| sequence.frame_count);
                let decoder = Box::new(Decoder::new(stream.header(), options));
                Ok(Frames::Stream { file, units: stream.units(), decoder, expected })
            }
            Self::Scene(path) if point.is_some() => Err(Failure::Usage(format!(
                "{}: only a stream has operating points; leave --op out",
                path.display()
            ))),
            Self::Scene(path) => {
                let files = Box::new(FrameFiles::find(std::slice::from_ref(path))?);
                Ok(Frames::Files { files, next: 0 })
            }
        }
    }
}

impl Frames<'_> {
    /// How many there should be; 0 if that is not known.
    pub(crate) fn expected(&self) -> u32 {
        match self {
            Self::Stream { expected, .. } => *expected,
            Self::Files { files, .. } => files.len(),
        }
    }

    /// The next frame and its display index. A stream may lack frames, in particular at an operating point.
    pub(crate) fn next(&mut self) -> Result<Option<(u32, GaussianFrame)>, Failure> {
        match self {
            Self::Stream { file, units, decoder, .. } => {
                let decoded = next_decoded(units, decoder).map_err(|error| file.fault(error))?;
                let shown = |(frame, sequence): (DecodedFrame, &_)| {
                    (frame.number, to_gaussians(frame.into_shown(), sequence))
                };
                Ok(decoded.zip(decoder.sequence()).map(shown))
            }
            Self::Files { files, next } => {
                if *next >= files.len() {
                    return Ok(None);
                }
                let frame = files.frame(*next).map_err(|error| Failure::other(error.to_string()))?;
                *next += 1;
                Ok(Some((*next - 1, frame)))
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
