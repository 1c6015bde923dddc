//! The reference decoder with the interface of the protocol. The runner takes right values from it, and tests it if no
//! other decoder is given.

use crate::attribute::{Attribute, to_bytes};
use crate::capabilities::Capabilities;
use crate::inside;
use crate::output::{entropy_name, floats_name};
use crate::protocol::{Diagnosis, Request};
use crate::vector::Mode;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::{decode_stream, decode_stream_inside};
use splatstream_format::syntax::SequenceParameters;
use splatstream_format::unit::{Stream, Unit};
use splatstream_format::{Error, Limits};
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::ops::ControlFlow;
use std::path::Path;

/// What the reference decoder makes of a stream.
#[derive(Debug, Default)]
pub struct Decoded {
    /// Frames, in output order.
    pub frames: Vec<DecodedFrame>,
    /// The sequence parameters; none if no frame is output.
    pub sequence: Option<SequenceParameters>,
    /// The verdict: the first error.
    pub error: Option<Error>,
    /// Display indices of lost frames that are not output.
    pub lost: Vec<[u32; 2]>,
    /// Entropy states with the indices of their units.
    pub entropy: Vec<(usize, u64)>,
}

impl Decoded {
    /// Decodes a stream in a mode, also after errors.
    pub fn of(bytes: &[u8], operating_point: OperatingPoint, mode: Mode) -> Self {
        let subset = mode == Mode::Subset;
        let limits = Limits::of_level(4);
        let options = Options { limits, operating_point, subset, entropy: true, ..Options::default() };
        let mut decoded = Self::default();
        let on_frame = |sequence: &SequenceParameters, frame| {
            decoded.sequence.get_or_insert(*sequence);
            decoded.frames.push(frame);
            ControlFlow::Continue(())
        };
        let summary = match mode {
            Mode::Full | Mode::Subset => decode_stream(bytes, &options, on_frame),
            Mode::Inside => decode_stream_inside(bytes, inside::first_gop(bytes), &options, on_frame),
        };
        decoded.entropy = entropy_states(bytes, &decoded.frames);
        decoded.error = summary.verdict();
        decoded.lost = summary.lost.iter().map(|range| [*range.start(), *range.end()]).collect();
        decoded
    }

    /// Writes the files of the protocol: planes, output of 7.10 and entropy states.
    ///
    /// # Errors
    /// A file cannot be written, or the planes of a frame are broken.
    pub fn write(self, folder: &Path) -> io::Result<()> {
        for (unit, state) in &self.entropy {
            fs::write(folder.join(entropy_name(*unit)), format!("{state:016x}"))?;
        }
        let Some(sequence) = self.sequence else { return Ok(()) };
        // Frames have the attributes of their sequence, even frames without Gaussians.
        let has_sh = sequence.sh_dimension() > 0;
        for frame in self.frames {
            let index = frame.index;
            let shown = frame.into_shown();
            for attribute in
                Attribute::ALL.into_iter().filter(|&attribute| attribute != Attribute::Sh || has_sh)
            {
                fs::write(folder.join(attribute.file_name(index)), to_bytes(&attribute.values(&shown)))?;
            }
            let gaussians = to_gaussians(shown, &sequence).map_err(io::Error::other)?;
            let planes = gaussians.planes();
            let shapes = planes.position.iter().chain(planes.log_scale).chain([planes.opacity_logit]);
            let planes = shapes.chain(planes.rotation).chain(planes.dc).chain(planes.sh);
            let bytes: Vec<u8> = planes.flatten().flat_map(|value| value.to_le_bytes()).collect();
            fs::write(folder.join(floats_name(index)), bytes)?;
        }
        Ok(())
    }

    /// The answer: exit code and diagnosis.
    pub fn verdict(&self) -> (i32, Option<Diagnosis>) {
        let Some(error) = self.error else { return (0, None) };
        let diagnosis = Diagnosis {
            class: Some(error.class().name().to_owned()),
            code: Some(error.kind.code().to_owned()),
            clause: Some(error.clause.to_owned()),
            unit: None,
            byte: Some(error.at),
            lost: Some(self.lost.clone()),
        };
        (error.class().exit_code().into(), Some(diagnosis))
    }
}

/// What the reference decoder claims: everything.
pub fn capabilities() -> Capabilities {
    Capabilities {
        entropy: true,
        output: true,
        ..Capabilities::everything(concat!("reference ", env!("CARGO_PKG_VERSION")))
    }
}

/// Answers a request; makes the output folder if it does not exist.
///
/// # Errors
/// The stream cannot be read, files cannot be written, or the operating point is not valid.
pub fn answer(request: &Request) -> io::Result<(i32, Option<Diagnosis>)> {
    let decoded = decode(request)?;
    let verdict = decoded.verdict();
    fs::create_dir_all(&request.out).map_err(naming("make", &request.out))?;
    decoded.write(&request.out).map_err(naming("write into", &request.out))?;
    Ok(verdict)
}

/// The entropy states of frames with the indices of their units, in stream order.
fn entropy_states(bytes: &[u8], frames: &[DecodedFrame]) -> Vec<(usize, u64)> {
    let Ok(stream) = Stream::open(bytes, &Limits::of_level(4)) else { return Vec::new() };
    let states: BTreeMap<u64, u64> =
        frames.iter().flat_map(|frame| &frame.entropy).map(|unit| (unit.payload_at, unit.state)).collect();
    let mut units = stream.units();
    let units = std::iter::from_fn(|| units.next_unit()).map_while(Result::ok).enumerate();
    let state = |(index, unit): (usize, Unit<'_>)| Some((index, *states.get(&unit.payload_at)?));
    units.filter_map(state).collect()
}

/// Decodes the stream of a request.
///
/// # Errors
/// The stream cannot be read, or the operating point is not valid.
pub fn decode(request: &Request) -> io::Result<Decoded> {
    let point = request.op.parse().map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
    let stream = fs::read(&request.input).map_err(naming("read", &request.input))?;
    Ok(Decoded::of(&stream, point, request.mode))
}

/// For `map_err`: the error with the path that it is about.
fn naming(what: &'static str, path: &Path) -> impl FnOnce(io::Error) -> io::Error {
    let path = path.display();
    move |error| io::Error::new(error.kind(), format!("{path}: cannot {what}: {error}"))
}
