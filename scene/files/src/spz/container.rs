//! The two containers of SPZ: one gzip stream, or a header with a zstd frame for each attribute.

use std::io::{BufReader, Read, Seek, Write};
use std::ops::Range;

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;

use crate::axes::Flip;
use crate::cursor::Cursor;
use crate::decompress;
use crate::error::SceneError;
use crate::limits::{Budget, bytes_of_planes};
use crate::note::{MOST_SH_DEGREE, Note};
use crate::walk::{FileWalk, Walk, part};
use splatstream_gaussians::{MAX_SH_DEGREE, Planes, sh_planes};

/// "NGSP" as the first four bytes.
const MAGIC: u32 = 0x5053_474e;
const GZIP: [u8; 2] = [0x1f, 0x8b];
const ANTIALIASED: u8 = 1;
const HAS_EXTENSIONS: u8 = 2;
/// The one extension that changes what the attributes mean: a coordinate system.
const COORDINATE_SYSTEM: u32 = 0xadbe_0003;
/// Extensions are descriptions of a few bytes: more than this is not looked at.
const EXTENSIONS: u64 = 64 << 10;

const CONTENTS: &str = "the table of contents";
const HEADER: &str = "the header";
const ALL: &str = "all its Gaussians";
const NOT_SPZ: &str = "this is no SPZ file, or it is damaged";

/// Header of versions 1 to 3, at the start of the decompressed stream; the first half of version 4's,
/// where it is at the start of the file and `reserved` is the number of streams.
struct StreamHeader {
    magic: u32,
    version: u32,
    gaussians: u32,
    sh_degree: u8,
    fractional_bits: u8,
    flags: u8,
    reserved: u8,
}

impl StreamHeader {
    fn read(walk: &mut impl Walk) -> Result<Self, SceneError> {
        let [magic, version, gaussians] = [walk.u32(HEADER)?, walk.u32(HEADER)?, walk.u32(HEADER)?];
        let [sh_degree, fractional_bits, flags, reserved] = walk.array(HEADER)?;
        Ok(Self { magic, version, gaussians, sh_degree, fractional_bits, flags, reserved })
    }

    fn write(&self) -> Vec<u8> {
        let mut out = [self.magic, self.version, self.gaussians].map(u32::to_le_bytes).concat();
        out.extend([self.sh_degree, self.fractional_bits, self.flags, self.reserved]);
        out
    }
}

/// What the header says that the attributes need to be understood.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    pub(crate) version: u32,
    pub(crate) gaussians: usize,
    /// Of the planes, 3 at most.
    pub(crate) sh_degree: u8,
    /// Of the file, whose coefficients of degree 4 are ignored.
    pub(crate) stored_degree: u8,
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
        [position, 1, 3, 3, rotation, sh_planes(self.stored_degree)]
    }

    /// Checks a header: nothing in it is used before.
    fn of_header(header: &StreamHeader) -> Result<Self, SceneError> {
        if header.magic != MAGIC {
            return Err(SceneError::malformed(0, format!("magic is {:#010x}", header.magic), NOT_SPZ));
        }
        if header.sh_degree > MOST_SH_DEGREE {
            let what = format!("SPZ with SH degree {}", header.sh_degree);
            return Err(SceneError::unsupported(what, "convert it to degree 4 or less"));
        }
        if header.fractional_bits > 31 {
            let what = format!("fractional_bits is {}, at most 31 make sense", header.fractional_bits);
            return Err(SceneError::malformed(13, what, NOT_SPZ));
        }
        let shape = Self {
            version: header.version,
            gaussians: header.gaussians as usize,
            sh_degree: header.sh_degree.min(MAX_SH_DEGREE),
            stored_degree: header.sh_degree,
            fractional_bits: header.fractional_bits,
            antialiased: header.flags & ANTIALIASED != 0,
            flip: Flip::default(),
        };
        Ok(shape)
    }

    /// Counts all the attributes, and makes room for the planes they turn into: nothing is decompressed before.
    fn room(&self, budget: &mut Budget) -> Result<Planes, SceneError> {
        budget.take(self.bytes(), ALL)?;
        budget.give_back(bytes_of_planes(self.sh_degree, self.gaussians as u64));
        if self.stored_degree > self.sh_degree {
            budget.note(Note::ShDegree { found: self.stored_degree });
        }
        budget.planes(self.sh_degree, self.gaussians as u64)
    }

    /// Bytes of the attributes and of the planes.
    fn bytes(&self) -> u64 {
        let streams: u64 = self.strides().into_iter().map(|stride| self.size(stride)).sum();
        streams.saturating_add(bytes_of_planes(self.sh_degree, self.gaussians as u64))
    }

    fn size(&self, stride: usize) -> u64 {
        (self.gaussians as u64).saturating_mul(stride as u64)
    }
}

/// Whether `bytes` begin as an SPZ file of any version does.
pub(crate) fn is_spz(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC.to_le_bytes()) || bytes.starts_with(&GZIP)
}

/// Checks what the header and the table of contents announce: the version, that the attributes are there, and that there is room
/// for the file, its attributes and its frame.
pub(crate) fn check<R: Read + Seek>(walk: &mut FileWalk<R>, budget: &mut Budget) -> Result<(), SceneError> {
    let size = walk.left();
    let is_gzip = size >= 2 && walk.array(HEADER)? == GZIP;
    let source = walk.source()?;
    let shape = match is_gzip {
        true => {
            source.rewind()?;
            gzip_header(&mut GzDecoder::new(BufReader::new(source)))?.0
        }
        false => Contents::read(&mut FileWalk::new(source)?)?.shape,
    };
    budget.check(size.saturating_add(shape.bytes()), ALL)
}

/// The attributes of a file, and empty planes with room for what they hold.
pub(crate) fn read(bytes: &[u8], budget: &mut Budget) -> Result<(Shape, Streams, Planes), SceneError> {
    if bytes.starts_with(&GZIP) { read_gzip(bytes, budget) } else { read_zstd(bytes, budget) }
}

fn read_gzip(bytes: &[u8], budget: &mut Budget) -> Result<(Shape, Streams, Planes), SceneError> {
    let mut content = GzDecoder::new(bytes);
    let (mut shape, flags) = gzip_header(&mut content)?;
    let planes = shape.room(budget)?;
    let mut streams = Streams::default();
    let mut at = 16;
    for ((stream, stride), name) in streams.iter_mut().zip(shape.strides()).zip(NAMES) {
        *stream = decompress::read_exactly(&mut content, shape.size(stride), at, name)?;
        at = stream.len().saturating_add(at);
    }
    // Read in any case: gzip's checksum lies behind the last byte.
    let extensions = decompress::read_up_to(&mut content, EXTENSIONS, at, "what follows the attributes")?;
    if flags & HAS_EXTENSIONS != 0 {
        shape.flip = flip_of(&extensions)?;
    }
    Ok((shape, streams, planes))
}

/// The header at the start of what a file of versions 1 to 3 decompresses to, checked, and its flags.
fn gzip_header(content: &mut impl Read) -> Result<(Shape, u8), SceneError> {
    let header = decompress::read_exactly(content, 16, 0, HEADER)?;
    let header = StreamHeader::read(&mut Cursor::new(&header))?;
    if !(1..=3).contains(&header.version) {
        let what = format!("gzip SPZ of version {}", header.version);
        return Err(SceneError::unsupported(what, "versions 1 to 3 are known in gzip, 4 without"));
    }
    Ok((Shape::of_header(&header)?, header.flags))
}

fn read_zstd(bytes: &[u8], budget: &mut Budget) -> Result<(Shape, Streams, Planes), SceneError> {
    let Contents { mut shape, extensions, frames } = Contents::read(&mut Cursor::new(bytes))?;
    let planes = shape.room(budget)?;
    if let Some(extensions) = extensions {
        shape.flip = flip_of(part(bytes, &extensions))?;
    }
    let mut streams = Streams::default();
    let attributes = streams.iter_mut().zip(shape.strides()).zip(NAMES).zip(frames);
    for (((stream, stride), name), frame) in attributes {
        if let Some(frame) = frame {
            let at = frame.start as usize;
            *stream = decompress::zstd(part(bytes, &frame), shape.size(stride), budget.left(), at, name)?;
        }
    }
    Ok((shape, streams, planes))
}

/// What version 4 says before its first attribute, and where its parts are in the file, which has them all.
struct Contents {
    shape: Shape,
    /// None where the header says that there are none.
    extensions: Option<Range<u64>>,
    /// The zstd frame of each attribute; one without bytes has none.
    frames: [Option<Range<u64>>; 6],
}

impl Contents {
    fn read(walk: &mut impl Walk) -> Result<Self, SceneError> {
        let header = StreamHeader::read(walk)?;
        if header.magic == MAGIC && header.version != 4 {
            let what = format!("SPZ of version {} without gzip", header.version);
            return Err(SceneError::unsupported(what, "versions 1 to 3 are known in gzip, 4 without"));
        }
        let shape = Shape::of_header(&header)?;
        let contents_at = walk.u32(HEADER)?;
        walk.pass(12, HEADER)?;
        let extensions = u64::from(contents_at).checked_sub(32).ok_or_else(|| {
            SceneError::malformed(16, "the table of contents lies inside the header", NOT_SPZ)
        })?;
        let extensions = walk.pass(extensions, "extensions")?;
        let extensions = (header.flags & HAS_EXTENSIONS != 0).then_some(extensions);
        let sizes = shape.strides().map(|stride| shape.size(stride));
        let lengths = compressed_sizes(walk, &sizes, header.reserved)?;
        let mut frames = [const { None }; 6];
        for ((frame, length), name) in frames.iter_mut().zip(lengths).zip(NAMES) {
            *frame = length.map(|length| walk.pass(length, name)).transpose()?;
        }
        Ok(Self { shape, extensions, frames })
    }
}

/// The table of contents with its `count` rows: how long the zstd frame of each attribute is, whose own sizes are known.
fn compressed_sizes(
    walk: &mut impl Walk,
    sizes: &[u64; 6],
    count: u8,
) -> Result<[Option<u64>; 6], SceneError> {
    // An attribute without bytes has no stream.
    let present = sizes.iter().filter(|&&size| size > 0).count();
    if usize::from(count) != present {
        let what = format!("{count} streams, these attributes are {present}");
        return Err(SceneError::malformed(15, what, NOT_SPZ));
    }
    let mut lengths = [None; 6];
    for ((length, &size), name) in
        lengths.iter_mut().zip(sizes).zip(NAMES).filter(|((_, size), _)| **size > 0)
    {
        *length = Some(walk.u64(CONTENTS)?);
        let at = walk.at() as usize;
        let decompressed = walk.u64(CONTENTS)?;
        if decompressed != size {
            let what = format!("{name} is {decompressed} bytes, its Gaussians have {size}");
            return Err(SceneError::malformed(at, what, NOT_SPZ));
        }
    }
    Ok(lengths)
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
        sh_degree: shape.stored_degree,
        fractional_bits: shape.fractional_bits,
        flags: if shape.antialiased { ANTIALIASED } else { 0 },
        reserved: 0,
    };
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(&header.write())?;
    streams.iter().try_for_each(|stream| gzip.write_all(stream))?;
    Ok(gzip.finish()?)
}
