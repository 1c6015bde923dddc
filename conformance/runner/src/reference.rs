//! The reference decoder behind the protocol: what the runner compares values with, and what is tested if no other
//! decoder is given.

use crate::attribute::{Attribute, to_bytes};
use crate::capabilities::Capabilities;
use crate::output::{entropy_name, floats_name};
use crate::protocol::{Diagnosis, Request};
use crate::vector::Mode;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_format::syntax::SequenceParameters;
use splatstream_format::unit::{Delivery, Stream};
use splatstream_format::{Error, Limits};
use std::fs;
use std::io;
use std::ops::ControlFlow;
use std::path::Path;

/// A stream as the reference decoder shows it.
#[derive(Debug, Default)]
pub struct Decoded {
    /// Frames, in the order in which they came out.
    pub frames: Vec<DecodedFrame>,
    /// What holds for the whole sequence, once a frame came out.
    pub sequence: Option<SequenceParameters>,
    /// The verdict: the first error, confined or fatal.
    pub error: Option<Error>,
    /// Entropy states by unit, counted from 0.
    pub entropy: Vec<(usize, u64)>,
}

impl Decoded {
    /// Decodes a stream as far as it goes (clause 7.20).
    pub fn of(bytes: &[u8], operating_point: OperatingPoint, mode: Mode) -> Self {
        let limits = Limits { max_gaussians: Limits::gaussians_of_level(4), ..Limits::default() };
        let subset = mode == Mode::Subset;
        let options =
            Options { limits, operating_point, subset, tolerant: true, entropy: true, ..Options::default() };
        let mut decoded = Self::default();
        let summary = decode_stream(bytes, &options, |sequence, frame| {
            decoded.sequence.get_or_insert(*sequence);
            decoded.frames.push(frame);
            ControlFlow::Continue(())
        });
        decoded.entropy = entropy_states(bytes, &decoded.frames);
        decoded.error = decoded.frames.iter().find_map(|frame| frame.lost).or(summary.end);
        decoded
    }

    /// Writes every frame as the protocol says, planes and output of 7.10, and entropy states.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(self, folder: &Path) -> io::Result<()> {
        for (unit, state) in &self.entropy {
            fs::write(folder.join(entropy_name(*unit)), format!("{state:016x}"))?;
        }
        let Some(sequence) = self.sequence else { return Ok(()) };
        // Frames have the attributes of their sequence, even frames without Gaussians.
        let has_sh = sequence.sh_dimension() > 0;
        for frame in self.frames {
            let number = frame.number;
            let shown = frame.into_shown();
            for attribute in
                Attribute::ALL.into_iter().filter(|&attribute| attribute != Attribute::Sh || has_sh)
            {
                fs::write(folder.join(attribute.file_name(number)), to_bytes(&attribute.values(&shown)))?;
            }
            let gaussians = to_gaussians(shown, &sequence);
            let planes = gaussians.planes();
            let opacity = std::slice::from_ref(&planes.opacity_logit);
            let planes =
                [&planes.position[..], &planes.log_scale, opacity, &planes.rotation, &planes.dc, &planes.sh]
                    .concat();
            let bytes: Vec<u8> = planes.concat().into_iter().flat_map(f32::to_le_bytes).collect();
            fs::write(folder.join(floats_name(number)), bytes)?;
        }
        Ok(())
    }

    /// The answer: exit code, and what is wrong.
    pub fn verdict(&self) -> (i32, Option<Diagnosis>) {
        let Some(error) = self.error else { return (0, None) };
        let diagnosis = Diagnosis {
            class: Some(error.class().name().to_owned()),
            code: Some(error.kind.code().to_owned()),
            clause: Some(error.clause.to_owned()),
            unit: None,
            byte: Some(error.at),
        };
        (error.class().exit_code().into(), Some(diagnosis))
    }
}

/// What the reference decoder claims: everything.
pub fn capabilities() -> Capabilities {
    Capabilities { entropy: true, output: true, ..Capabilities::everything("reference") }
}

/// Does what is asked; makes the folder if it is not there.
///
/// # Errors
/// The stream cannot be read, what is shown cannot be written, or the operating point is none.
pub fn answer(request: &Request) -> io::Result<(i32, Option<Diagnosis>)> {
    let decoded = decode(request)?;
    let verdict = decoded.verdict();
    fs::create_dir_all(&request.out).map_err(naming("make", &request.out))?;
    decoded.write(&request.out).map_err(naming("write into", &request.out))?;
    Ok(verdict)
}

/// The entropy states of frames with the places of their units in the stream.
fn entropy_states(bytes: &[u8], frames: &[DecodedFrame]) -> Vec<(usize, u64)> {
    let Ok(stream) = Stream::open(bytes, &Limits::default()) else { return Vec::new() };
    let mut units = stream.units();
    let starts: Vec<u64> = std::iter::from_fn(|| units.next_unit())
        .map_while(|delivery| {
            delivery.ok().map(|delivery| match delivery {
                Delivery::Intact(unit) => unit.payload_at,
                // A damaged unit has no state.
                Delivery::Damaged(_) => 0,
            })
        })
        .collect();
    let states = frames.iter().flat_map(|frame| &frame.entropy);
    states
        .filter_map(|entropy| {
            let unit = starts.iter().position(|&start| start == entropy.payload_at)?;
            Some((unit, entropy.state))
        })
        .collect()
}

/// The stream of a request, decoded as it asks.
///
/// # Errors
/// The stream cannot be read, or the operating point is none.
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
