//! The two containers of SPZ: one gzip stream, or a header with a zstd frame for each attribute.

use std::io::Write;

use deku::prelude::{DekuContainerRead, DekuContainerWrite, DekuRead, DekuWrite};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;

use super::axes::Flip;
use crate::cursor::Cursor;
use crate::decompress;
use crate::error::SceneError;
use crate::limits::ReadLimits;
use splatstream_gaussians::{MAX_SH_DEGREE, sh_coefficients};

/// "NGSP" as the first four bytes.
const MAGIC: u32 = 0x5053_474e;
const GZIP: [u8; 2] = [0x1f, 0x8b];
const ANTIALIASED: u8 = 1;
const HAS_EXTENSIONS: u8 = 2;
/// The one extension that changes what the attributes mean: a coordinate system.
const COORDINATE_SYSTEM: u32 = 0xadbe_0003;
/// Extensions are descriptions of a few bytes: more than this is not looked at.
const EXTENSIONS: u64 = 64 << 10;

const NOT_SPZ: &str = "this is no SPZ file, or it is damaged";

/// Header of versions 1 to 3, at the start of the decompressed stream; the first half of version 4's.
#[derive(DekuRead, DekuWrite)]
#[deku(endian = "little")]
struct StreamHeader {
    magic: u32,
    version: u32,
    gaussians: u32,
    sh_degree: u8,
    fractional_bits: u8,
    flags: u8,
    reserved: u8,
}

/// What follows in version 4, where the header is at the start of the file and `reserved` above is the
/// number of streams.
#[derive(DekuRead)]
#[deku(endian = "little")]
struct FileHeader {
    contents_at: u32,
    _reserved: [u8; 12],
}

/// One row of version 4's table of contents.
#[derive(DekuRead)]
#[deku(endian = "little")]
struct Entry {
    compressed: u64,
    decompressed: u64,
}

/// What the header says that the attributes need to be understood.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    pub(crate) version: u32,
    pub(crate) gaussians: usize,
    pub(crate) sh_degree: u8,
    pub(crate) fractional_bits: u8,
    pub(crate) antialiased: bool,
    pub(crate) flip: Flip,
}

/// The attributes in the order of the file: centres, opacities, colours, scales, rotations, SH.
pub(crate) type Streams = [Vec<u8>; 6];

const NAMES: [&str; 6] = ["positions", "alphas", "colors", "scales", "rotations", "sh"];

impl Shape {
    /// Bytes of one Gaussian in each stream.
    pub(crate) fn strides(&self) -> [usize; 6] {
        let position = if self.version == 1 { 6 } else { 9 };
        let rotation = if self.version < 3 { 3 } else { 4 };
        [position, 1, 3, 3, rotation, sh_coefficients(self.sh_degree) * 3]
    }

    /// Checks a header: nothing in it is used before.
    fn of_header(header: &StreamHeader, limits: &ReadLimits) -> Result<Self, SceneError> {
        if header.magic != MAGIC {
            return Err(SceneError::malformed(0, format!("magic is {:#010x}", header.magic), NOT_SPZ));
        }
        if header.sh_degree > MAX_SH_DEGREE {
            let what = format!("SPZ with SH degree {}", header.sh_degree);
            return Err(SceneError::unsupported(what, "convert it to degree 3 or less"));
        }
        if header.fractional_bits > 31 {
            let what = format!("fractional_bits is {}, at most 31 make sense", header.fractional_bits);
            return Err(SceneError::malformed(13, what, NOT_SPZ));
        }
        let shape = Self {
            version: header.version,
            gaussians: limits.gaussians(u64::from(header.gaussians))?,
            sh_degree: header.sh_degree,
            fractional_bits: header.fractional_bits,
            antialiased: header.flags & ANTIALIASED != 0,
            flip: Flip::default(),
        };
        shape.strides().iter().try_for_each(|&stride| limits.bytes(shape.size(stride)).map(|_| ()))?;
        Ok(shape)
    }

    fn size(&self, stride: usize) -> u64 {
        self.gaussians as u64 * stride as u64
    }
}

/// Whether `bytes` begin as an SPZ file of any version does.
pub(crate) fn is_spz(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC.to_le_bytes()) || bytes.starts_with(&GZIP)
}

pub(crate) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<(Shape, Streams), SceneError> {
    if bytes.starts_with(&GZIP) { read_gzip(bytes, limits) } else { read_zstd(bytes, limits) }
}

fn read_gzip(bytes: &[u8], limits: &ReadLimits) -> Result<(Shape, Streams), SceneError> {
    let mut content = GzDecoder::new(bytes);
    let header: StreamHeader = parse(&decompress::read_exactly(&mut content, 16, 0, "the header")?, 0)?;
    if !(1..=3).contains(&header.version) {
        let what = format!("gzip SPZ of version {}", header.version);
        return Err(SceneError::unsupported(what, "versions 1 to 3 are known in gzip, 4 without"));
    }
    let mut shape = Shape::of_header(&header, limits)?;
    let mut streams = Streams::default();
    let mut at = 16;
    for ((stream, stride), name) in streams.iter_mut().zip(shape.strides()).zip(NAMES) {
        *stream = decompress::read_exactly(&mut content, shape.size(stride), at, name)?;
        at += stream.len();
    }
    // Read in any case: gzip's checksum lies behind the last byte.
    let extensions = decompress::read_up_to(&mut content, EXTENSIONS, at, "what follows the attributes")?;
    if header.flags & HAS_EXTENSIONS != 0 {
        shape.flip = flip_of(&extensions)?;
    }
    Ok((shape, streams))
}

fn read_zstd(bytes: &[u8], limits: &ReadLimits) -> Result<(Shape, Streams), SceneError> {
    let mut cursor = Cursor::new(bytes);
    let header: StreamHeader = parse(cursor.take(16, "the header")?, 0)?;
    if header.magic == MAGIC && header.version != 4 {
        let what = format!("SPZ of version {} without gzip", header.version);
        return Err(SceneError::unsupported(what, "versions 1 to 3 are known in gzip, 4 without"));
    }
    let mut shape = Shape::of_header(&header, limits)?;
    let tail: FileHeader = parse(cursor.take(16, "the header")?, 16)?;
    let extensions = u64::from(tail.contents_at)
        .checked_sub(32)
        .ok_or_else(|| SceneError::malformed(16, "the table of contents lies inside the header", NOT_SPZ))?;
    let extensions = cursor.take(extensions, "extensions")?;
    if header.flags & HAS_EXTENSIONS != 0 {
        shape.flip = flip_of(extensions)?;
    }
    Ok((shape, read_frames(&mut cursor, &shape, header.reserved)?))
}

/// The table of contents with its `count` rows, and the zstd frames that follow it.
fn read_frames(cursor: &mut Cursor<'_>, shape: &Shape, count: u8) -> Result<Streams, SceneError> {
    let sizes = shape.strides().map(|stride| shape.size(stride));
    // An attribute without bytes has no stream.
    let present = || sizes.into_iter().zip(NAMES).enumerate().filter(|(_, (size, _))| *size > 0);
    if usize::from(count) != present().count() {
        let what = format!("{count} streams, these attributes are {}", present().count());
        return Err(SceneError::malformed(15, what, NOT_SPZ));
    }
    let at = cursor.at();
    let entries = cursor.take_rows(u64::from(count), 16, "the table of contents")?.as_chunks::<16>().0;
    let mut streams = Streams::default();
    for ((row, entry), (place, (size, name))) in entries.iter().enumerate().zip(present()) {
        let entry: Entry = parse(entry, at + row * 16)?;
        if entry.decompressed != size {
            let what = format!("{name} is {} bytes, its Gaussians have {size}", entry.decompressed);
            return Err(SceneError::malformed(at + row * 16 + 8, what, NOT_SPZ));
        }
        let at = cursor.at();
        streams[place] = decompress::zstd(cursor.take(entry.compressed, name)?, size, at, name)?;
    }
    Ok(streams)
}

/// A fixed-size record; `bytes` has that size.
fn parse<'a, T: DekuContainerRead<'a>>(bytes: &'a [u8], at: usize) -> Result<T, SceneError> {
    T::from_bytes((bytes, 0))
        .map(|(_, record)| record)
        .map_err(|error| SceneError::malformed(at, error.to_string(), NOT_SPZ))
}

/// The flip that extensions ask for. Each is a type, a length and that many bytes; unknown ones describe
/// what does not concern a frame, and are passed over.
fn flip_of(extensions: &[u8]) -> Result<Flip, SceneError> {
    let mut cursor = Cursor::new(extensions);
    let word = |bytes: &[u8]| bytes.first_chunk().map_or(0, |&word| u32::from_le_bytes(word));
    while cursor.remaining().len() >= 8 {
        let kind = word(cursor.take(4, "extension")?);
        let length = word(cursor.take(4, "extension")?);
        let payload = cursor.take(u64::from(length), "extension")?;
        if kind == COORDINATE_SYSTEM {
            return Flip::of_system(word(payload));
        }
    }
    Ok(Flip::default())
}

/// Writes versions 1 to 3.
pub(crate) fn write(shape: &Shape, streams: &Streams) -> Result<Vec<u8>, SceneError> {
    let gaussians = u32::try_from(shape.gaussians).map_err(|_| {
        SceneError::unsupported(
            format!("{} Gaussians", shape.gaussians),
            "SPZ counts them in 32 bits; split the scene",
        )
    })?;
    let header = StreamHeader {
        magic: MAGIC,
        version: shape.version,
        gaussians,
        sh_degree: shape.sh_degree,
        fractional_bits: shape.fractional_bits,
        flags: if shape.antialiased { ANTIALIASED } else { 0 },
        reserved: 0,
    };
    let header = header.to_bytes().map_err(|error| SceneError::malformed(0, error.to_string(), NOT_SPZ))?;
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(&header)?;
    streams.iter().try_for_each(|stream| gzip.write_all(stream))?;
    Ok(gzip.finish()?)
}
