//! Sections of a `.ksplat` file: their headers, buckets and rows.

use std::ops::Range;

use super::{Header, NOT_KSPLAT};
use crate::cursor::Cursor;
use crate::error::SceneError;
use crate::half::float_of_half;
use crate::limits::Budget;
use crate::walk::{Walk, part};
use splatstream_gaussians::{MAX_SH_DEGREE, sh_planes};

/// Bytes of the header of a section.
const HEADER: usize = 1024;

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

/// What the header of a section says, and where its parts are in the file, which has them all.
pub(crate) struct Layout {
    /// Where the header is in the file.
    pub(super) at: usize,
    pub(super) count: u64,
    pub(super) sh_degree: u8,
    level: Level,
    /// Gaussians of each bucket that is full, and how many of these there are.
    full: (u64, u64),
    /// Lengths of the buckets that are not full.
    partial: Range<u64>,
    centres: Range<u64>,
    /// Bytes from one centre to the next.
    centre_stride: usize,
    /// What an offset of 0 stands for, in steps, and the step.
    range: f32,
    step: f32,
    data: Range<u64>,
}

/// The part of a file that follows all headers, as far as no section has it yet.
struct Body {
    at: u64,
    end: u64,
}

impl Body {
    /// The next `rows` records of `stride` bytes each.
    fn rows(&mut self, rows: u32, stride: u64, what: &'static str) -> Result<Range<u64>, SceneError> {
        let (from, needed) = (self.at, u64::from(rows).saturating_mul(stride));
        let left = self.end.saturating_sub(from);
        if needed > left {
            return Err(SceneError::truncated(from, what, needed, left));
        }
        self.at = from.saturating_add(needed);
        Ok(from..self.at)
    }
}

/// The sections whose headers are next, each with its share of what follows all headers.
pub(super) fn all(
    walk: &mut impl Walk,
    header: &Header,
    budget: &mut Budget,
) -> Result<Vec<Layout>, SceneError> {
    let headers = u64::from(header.sections).saturating_mul(HEADER as u64);
    walk.require(headers, "the headers of sections")?;
    let at = walk.at().saturating_add(headers);
    let mut body = Body { at, end: walk.at().saturating_add(walk.left()) };
    let mut sections = budget.room(header.sections.into(), "the sections")?;
    for _ in 0..header.sections {
        let at = walk.at() as usize;
        let fields = walk.array::<HEADER>("the header of a section")?;
        sections.push(Layout::read(at, &mut Cursor::new(&fields), &mut body, header.level)?);
    }
    Ok(sections)
}

impl Layout {
    fn read(at: usize, fields: &mut Cursor<'_>, body: &mut Body, level: Level) -> Result<Self, SceneError> {
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
        let partial = body.rows(partial, 4, "the lengths of buckets")?;
        let centres = body.rows(buckets, centre_stride.into(), "the centres of buckets")?;
        let data = body.rows(capacity, stride(level, sh_degree) as u64, "the Gaussians of a section")?;
        Ok(Self {
            at,
            count: count.into(),
            sh_degree,
            level,
            full: (bucket_size.into(), full.into()),
            partial,
            centres,
            centre_stride: centre_stride.into(),
            range,
            step: block / 2.0 / range,
            data,
        })
    }

    /// The section, of the bytes of the whole file.
    pub(super) fn section<'a>(&'a self, bytes: &'a [u8]) -> Section<'a> {
        let [partial, centres, data] =
            [&self.partial, &self.centres, &self.data].map(|range| part(bytes, range));
        Section { layout: self, partial, centres, data }
    }
}

/// A section: its layout, and its bytes, which are all there.
pub(crate) struct Section<'a> {
    pub(super) layout: &'a Layout,
    partial: &'a [u8],
    centres: &'a [u8],
    data: &'a [u8],
}

impl<'a> Section<'a> {
    /// Coefficients of a Gaussian.
    pub(super) fn sh_values(&self) -> usize {
        sh_planes(self.layout.sh_degree)
    }

    /// The Gaussians.
    pub(super) fn rows(&self) -> impl Iterator<Item = Row<'a>> {
        let Layout { level, count, sh_degree, .. } = *self.layout;
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        self.data.chunks_exact(stride(level, sh_degree)).take(count).map(move |bytes| Row { level, bytes })
    }

    /// The centre of the bucket of one Gaussian after another; no centre ends them, where there are too few.
    pub(super) fn buckets(&self) -> impl Iterator<Item = [f32; 3]> {
        let Layout { full: (size, full), centre_stride, level, count, .. } = *self.layout;
        let partial = self.partial.as_chunks().0.iter().map(|&length| u64::from(u32::from_le_bytes(length)));
        let lengths = (0..full).map(move |_| size).chain(partial);
        let centres = self.centres.chunks_exact(centre_stride.max(1)).map(|bytes| {
            let mut centre = [0.0; 3];
            let parts = bytes.as_chunks().0.iter().map(|&part| f32::from_le_bytes(part));
            centre.iter_mut().zip(parts).for_each(|(to, from)| *to = from);
            centre
        });
        let in_buckets = lengths.zip(centres).flat_map(|(length, centre)| (0..length).map(move |_| centre));
        let has_none = level == Level::Floats;
        let none = (0..if has_none { count } else { 0 }).map(|_| [0.0; 3]);
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
        (steps - section.layout.range) * section.layout.step + bucket.get(axis).copied().unwrap_or(0.0)
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
