//! SPZ files of what an input says: a header as it is, attributes that fit it, compressed, with checksums.

use super::bytes::{Bytes, deflated, repeated};

/// Bits of the first byte.
const FITS: u8 = 1;
const IS_COMPRESSED: u8 = 2;
const HAS_WRONG_END: u8 = 4;
const HAS_WRONG_TABLE: u8 = 8;

/// More Gaussians than these are claimed, not there, unless they are all alike.
const MAX_GAUSSIANS: u32 = 1 << 10;
/// The same of Gaussians that are all alike: those of a large scene compress a thousand times and more.
const MAX_EQUAL_GAUSSIANS: u32 = 1 << 14;

/// Versions 1 to 3: flags, the header of 16 bytes, a length and that many bytes of extensions, attributes.
pub fn gzip(input: &[u8]) -> Vec<u8> {
    let mut input = Bytes(input);
    let flags = input.u8();
    let header: [u8; 16] = input.array();
    let extensions = extensions(&mut input);
    let mut content = header.to_vec();
    match is_set(flags, FITS) {
        true => {
            content.extend(strides(&header).iter().flat_map(|stride| attribute(&mut input, &header, *stride)))
        }
        false => content.extend(input.0),
    }
    content.extend(extensions);
    let mut out = vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255];
    match is_set(flags, IS_COMPRESSED) {
        true => out.extend(deflated(&content)),
        false => stored(&content, &mut out),
    }
    let wrong = u32::from(is_set(flags, HAS_WRONG_END));
    out.extend((crc32fast::hash(&content) ^ wrong).to_le_bytes());
    out.extend((content.len() as u32).to_le_bytes());
    out
}

/// Version 4: flags, the first 20 bytes of the header, a length and that many bytes of extensions, a wrong entry for the
/// table of contents, a window for the frames of Zstandard, attributes.
pub fn zstd(input: &[u8]) -> Vec<u8> {
    let mut input = Bytes(input);
    let flags = input.u8();
    let header: [u8; 16] = input.array();
    let mut contents_at: [u8; 4] = input.array();
    let extensions = extensions(&mut input);
    let (wrong_at, wrong): (u8, [u8; 8]) = (input.u8(), input.array());
    let window = input.u8();
    if is_set(flags, FITS) {
        contents_at = (32 + extensions.len() as u32).to_le_bytes();
    }
    let (mut table, mut frames) = (Vec::new(), Vec::new());
    for stride in strides(&header).into_iter().filter(|stride| *stride > 0) {
        let content = attribute(&mut input, &header, stride);
        let frame = zstd_frame(&content, window, is_set(flags, IS_COMPRESSED));
        table.extend([frame.len() as u64, content.len() as u64].map(u64::to_le_bytes));
        frames.extend(frame);
    }
    if is_set(flags, HAS_WRONG_TABLE) {
        let count = table.len();
        table[usize::from(wrong_at) % count] = wrong;
    }
    let parts = [&header[..], &contents_at, &[0; 12], &extensions, table.as_flattened(), &frames];
    parts.concat()
}

fn is_set(flags: u8, flag: u8) -> bool {
    flags & flag != 0
}

fn extensions(input: &mut Bytes<'_>) -> Vec<u8> {
    let length = input.u8();
    input.take(length.into()).to_vec()
}

/// Bytes of a Gaussian in each attribute, as a header says.
fn strides(header: &[u8; 16]) -> [usize; 6] {
    let [version, degree] = [header[4], header[12]];
    let coefficients = [0, 3, 8, 15][usize::from(degree % 4)];
    [if version == 1 { 6 } else { 9 }, 1, 3, 3, if version < 3 { 3 } else { 4 }, 3 * coefficients]
}

/// An attribute of all Gaussians: the next bytes of the input for some of them, again and again.
fn attribute(input: &mut Bytes<'_>, header: &[u8; 16], stride: usize) -> Vec<u8> {
    let count = u32::from_le_bytes([header[8], header[9], header[10], header[11]]);
    let pattern = input.take(stride * count.min(MAX_GAUSSIANS) as usize);
    let most = if pattern.is_empty() { MAX_EQUAL_GAUSSIANS } else { MAX_GAUSSIANS };
    repeated(pattern, stride * count.min(most) as usize)
}

/// Blocks of deflate that are stored.
fn stored(content: &[u8], out: &mut Vec<u8>) {
    let mut blocks = content.chunks(0xffff).peekable();
    if blocks.peek().is_none() {
        out.extend([1, 0, 0, 0xff, 0xff]);
    }
    while let Some(block) = blocks.next() {
        let length = block.len() as u16;
        out.push(u8::from(blocks.peek().is_none()));
        out.extend(length.to_le_bytes());
        out.extend((!length).to_le_bytes());
        out.extend(block);
    }
}

/// A frame of Zstandard of blocks that are stored, or of which each repeats its first byte.
pub(super) fn zstd_frame(content: &[u8], window: u8, is_repeated: bool) -> Vec<u8> {
    // No checksum, no dictionary, no content size: a window descriptor.
    let mut out = vec![0x28, 0xb5, 0x2f, 0xfd, 0, window];
    let mut blocks = content.chunks(1 << 17).peekable();
    while let Some(block) = blocks.next() {
        let kind = u32::from(is_repeated) << 1;
        let word = (block.len() as u32) << 3 | kind | u32::from(blocks.peek().is_none());
        out.extend(&word.to_le_bytes()[..3]);
        out.extend(if is_repeated { &block[..1] } else { block });
    }
    if content.is_empty() {
        out.extend([1, 0, 0]);
    }
    out
}
