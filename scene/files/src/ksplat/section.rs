//! Sections of a `.ksplat` file: their headers, buckets and rows.

use super::{Header, NOT_KSPLAT};
use crate::cursor::Cursor;
use crate::error::SceneError;
use crate::half::float_of_half;
use crate::limits::Budget;
use splatstream_gaussians::{MAX_SH_DEGREE, sh_planes};

/// Bytes of the header of a section.
const HEADER: u64 = 1024;

/// Bytes of the centre of a bucket.
const CENTRE: u64 = 12;

/// How values are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    /// 0: floats.
    Floats,
    /// 1: 16-bit floats.
    Halves,
    /// 2: 16-bit floats, spherical harmonics in bytes.
    HalvesAndBytes,
}

impl Level {
    pub(super) fn of(level: u16) -> Result<Self, SceneError> {
        match level {
            0 => Ok(Self::Floats),
            1 => Ok(Self::Halves),
            2 => Ok(Self::HalvesAndBytes),
            _ => Err(SceneError::malformed(
                20,
                format!("compression level {level}, 0 to 2 are known"),
                NOT_KSPLAT,
            )),
        }
    }

    /// Bytes of a value that is no coefficient, and of a coefficient.
    fn sizes(self) -> [usize; 2] {
        match self {
            Self::Floats => [4, 4],
            Self::Halves => [2, 2],
            Self::HalvesAndBytes => [2, 1],
        }
    }
}

/// A section: its layout, and its bytes, which are all there.
pub(crate) struct Section<'a> {
    /// Where its header is in the file.
    pub(super) at: usize,
    pub(super) count: u64,
    pub(super) sh_degree: u8,
    level: Level,
    /// Gaussians of each bucket that is full, and how many of these there are.
    full: (u64, u64),
    /// Lengths of the buckets that are not full.
    partial: &'a [u8],
    centres: &'a [u8],
    /// Bytes from one centre to the next.
    centre_stride: usize,
    /// What an offset of 0 stands for, in steps, and the step.
    range: f32,
    step: f32,
    data: &'a [u8],
}

/// The sections whose headers are next, with the bytes that follow all headers.
pub(super) fn all<'a>(
    cursor: &mut Cursor<'a>,
    header: &Header,
    budget: &mut Budget,
) -> Result<Vec<Section<'a>>, SceneError> {
    let mut headers = *cursor;
    cursor.take_rows(header.sections.into(), HEADER, "the headers of sections")?;
    let mut sections = budget.room(header.sections.into(), "the sections")?;
    for _ in 0..header.sections {
        let at = headers.at();
        let mut fields = Cursor::new(headers.take(HEADER, "the header of a section")?);
        sections.push(Section::read(at, &mut fields, cursor, header.level)?);
    }
    Ok(sections)
}

impl<'a> Section<'a> {
    fn read(
        at: usize,
        fields: &mut Cursor<'_>,
        body: &mut Cursor<'a>,
        level: Level,
    ) -> Result<Self, SceneError> {
        const WHAT: &str = "the header of a section";
        let [count, capacity, bucket_size, buckets] =
            [fields.u32(WHAT)?, fields.u32(WHAT)?, fields.u32(WHAT)?, fields.u32(WHAT)?];
        let block = f32::from_bits(fields.u32(WHAT)?);
        let centre_stride = fields.u32(WHAT)? as u16;
        let range = fields.u32(WHAT)?;
        fields.take(4, WHAT)?;
        let [full, partial, degree] = [fields.u32(WHAT)?, fields.u32(WHAT)?, fields.u32(WHAT)? as u16 as u32];
        let refuse = |what: String| Err(SceneError::malformed(at, what, NOT_KSPLAT));
        if count > capacity {
            return refuse(format!("a section has {count} Gaussians in room for {capacity}"));
        }
        let Some(sh_degree) = u8::try_from(degree).ok().filter(|&degree| degree <= MAX_SH_DEGREE) else {
            return refuse(format!("a section of SH degree {degree}, 0 to 3 are known"));
        };
        let has_buckets = level != Level::Floats && count > 0;
        if has_buckets && (u64::from(full).saturating_add(partial.into()) > buckets.into()) {
            return refuse(format!("{full} full buckets and {partial} others, of {buckets}"));
        }
        if has_buckets && u64::from(centre_stride) < CENTRE {
            return refuse(format!("the centre of a bucket has {centre_stride} bytes, 12 are needed"));
        }
        let range = if range == 0 { 32767.0 } else { range as f32 };
        let lengths = body.take_rows(partial.into(), 4, "the lengths of buckets")?;
        let centres = body.take_rows(buckets.into(), centre_stride.into(), "the centres of buckets")?;
        let data =
            body.take_rows(capacity.into(), stride(level, sh_degree) as u64, "the Gaussians of a section")?;
        Ok(Self {
            at,
            count: count.into(),
            sh_degree,
            level,
            full: (bucket_size.into(), full.into()),
            partial: lengths,
            centres,
            centre_stride: centre_stride.into(),
            range,
            step: block / 2.0 / range,
            data,
        })
    }

    /// Coefficients of a Gaussian.
    pub(super) fn sh_values(&self) -> usize {
        sh_planes(self.sh_degree)
    }

    /// The Gaussians.
    pub(super) fn rows(&self) -> impl Iterator<Item = Row<'a>> {
        let (level, count) = (self.level, usize::try_from(self.count).unwrap_or(usize::MAX));
        self.data
            .chunks_exact(stride(level, self.sh_degree))
            .take(count)
            .map(move |bytes| Row { level, bytes })
    }

    /// The centre of the bucket of one Gaussian after another; no centre ends them, where there are too few.
    pub(super) fn buckets(&self) -> impl Iterator<Item = [f32; 3]> {
        let (size, full) = self.full;
        let partial = self.partial.as_chunks().0.iter().map(|&length| u64::from(u32::from_le_bytes(length)));
        let lengths = (0..full).map(move |_| size).chain(partial);
        let centres = self.centres.chunks_exact(self.centre_stride.max(1)).map(|bytes| {
            let mut centre = [0.0; 3];
            let parts = bytes.as_chunks().0.iter().map(|&part| f32::from_le_bytes(part));
            centre.iter_mut().zip(parts).for_each(|(to, from)| *to = from);
            centre
        });
        let in_buckets = lengths.zip(centres).flat_map(|(length, centre)| (0..length).map(move |_| centre));
        let has_none = self.level == Level::Floats;
        let none = (0..if has_none { self.count } else { 0 }).map(|_| [0.0; 3]);
        in_buckets.take(if has_none { 0 } else { usize::MAX }).chain(none)
    }
}

/// Bytes of one Gaussian.
fn stride(level: Level, sh_degree: u8) -> usize {
    let [value, coefficient] = level.sizes();
    let values = value.saturating_mul(10).saturating_add(4);
    coefficient.saturating_mul(sh_planes(sh_degree)).saturating_add(values)
}

/// The bytes of one Gaussian.
pub(super) struct Row<'a> {
    level: Level,
    bytes: &'a [u8],
}

impl Row<'_> {
    /// A coordinate of the centre.
    pub(super) fn centre(&self, axis: usize, section: &Section<'_>, bucket: [f32; 3]) -> f32 {
        if self.level == Level::Floats {
            return self.value(axis);
        }
        let steps = f32::from(u16::from_le_bytes(self.array(axis.saturating_mul(2))));
        (steps - section.range) * section.step + bucket.get(axis).copied().unwrap_or(0.0)
    }

    /// A semi-axis.
    pub(super) fn scale(&self, axis: usize) -> f32 {
        self.value(axis.saturating_add(3))
    }

    /// A part of the quaternion w, x, y, z.
    pub(super) fn rotation(&self, part: usize) -> f32 {
        self.value(part.saturating_add(6))
    }

    /// Red, green, blue, opacity.
    pub(super) fn colour(&self) -> [u8; 4] {
        let [value, _] = self.level.sizes();
        self.array(value.saturating_mul(10))
    }

    /// The coefficient of a plane of a frame, which has coefficients in turn, and of each its channels; the file has degrees
    /// in turn, and of each its channels. At level 2 a byte stands for a value of a range.
    pub(super) fn sh(&self, plane: usize, [least, most]: [f32; 2]) -> f32 {
        let (coefficient, channel) = (plane / 3, plane % 3);
        // Where a degree begins, and its coefficients.
        let (first, count) = match coefficient {
            0..3 => (0_usize, 3_usize),
            3..8 => (3, 5),
            _ => (8, 7),
        };
        let within = channel.saturating_mul(count).saturating_add(coefficient.saturating_sub(first));
        let at = first.saturating_mul(3).saturating_add(within);
        let [value, size] = self.level.sizes();
        let at = value.saturating_mul(10).saturating_add(4).saturating_add(at.saturating_mul(size));
        match self.level {
            Level::Floats => f32::from_le_bytes(self.array(at)),
            Level::Halves => float_of_half(u16::from_le_bytes(self.array(at))),
            Level::HalvesAndBytes => {
                let [byte] = self.array(at);
                least + f32::from(byte) / 255.0 * (most - least)
            }
        }
    }

    /// A value of those before the colour.
    fn value(&self, index: usize) -> f32 {
        match self.level {
            Level::Floats => f32::from_le_bytes(self.array(index.saturating_mul(4))),
            _ => float_of_half(u16::from_le_bytes(self.array(index.saturating_mul(2)))),
        }
    }

    /// Some bytes, which are there: a row has as many as its layout has.
    fn array<const N: usize>(&self, at: usize) -> [u8; N] {
        self.bytes.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
    }
}
