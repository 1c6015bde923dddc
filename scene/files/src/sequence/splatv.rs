//! `.splatv`: Gaussians that move along cubic paths through time, which are shown at as many times as are wanted.
//!
//! A header (a magic number and the length of the JSON that follows), then records of 64 bytes:
//!
//! | byte | value |
//! |---|---|
//! | 0 | centre, 3 × `f32` |
//! | 12, 20 | rotation w, x, y, z; semi-axes: `f16` |
//! | 28 | red, green, blue, opacity |
//! | 32 | path: what the first, second and third power of time is multiplied by, 3 × 3 × `f16` |
//! | 52 | change of the rotation, 4 × `f16` |
//! | 60, 62 | the time at which opacity is highest, and how long it is there: `f16`; 0 means always |
//!
//! Time goes from 0 to 1. A Gaussian that is not there at a time has an opacity of next to nothing, so that row `i` is the
//! same Gaussian in every frame.

use std::io::{Read, Seek, SeekFrom};

use serde::Deserialize;

use super::{Frames, Source};
use crate::byte_values::{log_scale_of, logit_within};
use crate::cursor::Cursor;
use crate::error::SceneError;
use crate::format::SPLATV;
use crate::half::float_of_half;
use crate::limits::Budget;
use crate::note::Note;
use crate::reading::frame_of;
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::activation::dc_of_colour;

/// Bytes of one Gaussian.
const RECORD: usize = 64;
/// Opacities are this far from 0 and 1 at least.
const MARGIN: f64 = 1e-6;
/// Bytes that a byte of JSON turns into, at most.
const PARSED: u64 = 32;

const NOT_SPLATV: &str = "this is no .splatv file, or it is damaged";

/// A part of the body, as the JSON lists them.
#[derive(Deserialize)]
struct Chunk {
    #[serde(rename = "type")]
    kind: String,
    size: u64,
}

/// A scene in continuous time.
pub(super) struct Splatv {
    /// The records that can be shown.
    records: Vec<u8>,
    samples: u32,
    unusable: u64,
    /// Memory that it takes as long as it is open.
    used: u64,
}

impl Splatv {
    pub(super) fn open(
        mut source: Box<dyn Source>,
        samples: u32,
        budget: &mut Budget,
    ) -> Result<Self, SceneError> {
        if samples == 0 {
            return Err(SceneError::unsupported("0 frames of a .splatv", "ask for 1 frame or more"));
        }
        let length = source.seek(SeekFrom::End(0))?;
        source.rewind()?;
        let mut bytes: Vec<u8> = budget.room(length, "the file")?;
        source.take(length).read_to_end(&mut bytes)?;
        let mut cursor = Cursor::new(&bytes);
        if cursor.array("the header")? != SPLATV {
            return Err(SceneError::malformed(0, "the magic number is another", NOT_SPLATV));
        }
        let json = cursor.u32("the header")?;
        let json = cursor.take(json.into(), "the list of chunks")?;
        budget.take((json.len() as u64).saturating_mul(PARSED), "the list of chunks")?;
        let chunks: Vec<Chunk> = serde_json::from_slice(json)
            .map_err(|error| SceneError::malformed(8, error.to_string(), NOT_SPLATV))?;
        if !chunks.iter().any(|chunk| chunk.kind == "splat") {
            return Err(SceneError::malformed(8, "no chunk is of the type splat", NOT_SPLATV));
        }
        let (mut records, mut unusable) =
            (budget.room(cursor.remaining().len() as u64, "the Gaussians")?, 0_u64);
        for chunk in chunks {
            // The texture that a chunk is meant for is larger than the chunk.
            let size = chunk.size.min(cursor.remaining().len() as u64);
            let part = cursor.take(size, "a chunk")?;
            for record in part.as_chunks::<RECORD>().0.iter().filter(|_| chunk.kind == "splat") {
                match Record(record).is_usable() {
                    true => records.extend_from_slice(record),
                    false => {
                        unusable = unusable.saturating_add(u64::from(record.iter().any(|&byte| byte != 0)))
                    }
                }
            }
        }
        let used = records.capacity() as u64;
        Ok(Self { records, samples, unusable, used })
    }
}

impl Frames for Splatv {
    fn len(&self) -> u32 {
        self.samples
    }

    fn read(&mut self, frame: u32, budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
        budget.take(self.used, "the Gaussians")?;
        if self.unusable > 0 {
            budget.note(Note::Unusable { count: self.unusable });
        }
        let time = f64::from(frame) / f64::from(self.samples);
        let records = self.records.as_chunks::<RECORD>().0;
        let mut planes = budget.planes(0, records.len() as u64)?;
        for record in records.iter().map(Record) {
            let since = time - record.half(60);
            for (axis, plane) in planes.position.iter_mut().enumerate() {
                plane.push(record.centre(axis, since) as f32);
            }
            for (part, plane) in planes.rotation.iter_mut().enumerate() {
                plane.push((record.halves(12, part) + record.halves(52, part) * since) as f32);
            }
            for (axis, plane) in planes.log_scale.iter_mut().enumerate() {
                plane.push(log_scale_of(record.halves(20, axis) as f32));
            }
            let [red, green, blue, _] = record.colour();
            for (plane, byte) in planes.dc.iter_mut().zip([red, green, blue]) {
                plane.push(dc_of_colour(f64::from(byte) / 255.0));
            }
            planes.opacity_logit.push(logit_within(record.opacity(since), MARGIN));
        }
        frame_of(0, planes)
    }
}

/// The bytes of a Gaussian.
struct Record<'a>(&'a [u8; RECORD]);

impl Record<'_> {
    /// Whether it can be shown at all. Files have many that cannot: trainers leave overflowed values, and textures have
    /// places that nobody uses.
    fn is_usable(&self) -> bool {
        let of = |at: usize, count: usize| (0..count).map(move |index| self.halves(at, index));
        let centre = (0..3_usize).map(|axis| self.float(axis));
        let mut all = centre.chain(of(12, 7)).chain(of(32, 9)).chain(of(52, 6));
        let [.., opacity] = self.colour();
        all.all(f64::is_finite)
            && opacity > 0
            && of(20, 3).all(|scale| scale > 0.0)
            && of(12, 4).any(|part| part != 0.0)
    }

    /// A coordinate of the centre, so long after the time of the Gaussian.
    fn centre(&self, axis: usize, since: f64) -> f64 {
        let [first, second, third] = [32, 38, 44].map(|at| self.halves(at, axis));
        self.float(axis) + ((third * since + second) * since + first) * since
    }

    fn opacity(&self, since: f64) -> f64 {
        let ([.., opacity], width) = (self.colour(), self.half(62));
        let part = if width == 0.0 { 1.0 } else { libm::exp(-(since / width) * (since / width)) };
        part * f64::from(opacity) / 255.0
    }

    fn colour(&self) -> [u8; 4] {
        self.array(28)
    }

    fn float(&self, index: usize) -> f64 {
        f64::from(f32::from_le_bytes(self.array(index.saturating_mul(4))))
    }

    fn half(&self, at: usize) -> f64 {
        f64::from(float_of_half(u16::from_le_bytes(self.array(at))))
    }

    fn halves(&self, at: usize, index: usize) -> f64 {
        self.half(index.saturating_mul(2).saturating_add(at))
    }

    /// Some bytes, which are there.
    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        self.0.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
    }
}
