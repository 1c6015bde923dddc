//! SPZ in the versions that are read and not written.

use std::io::{Read, Write};

use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use splatstream_files::spz;
use splatstream_gaussians::GaussianFrame;

use super::samples::{LIMITS, small_frame};

fn gunzip(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    GzDecoder::new(bytes).read_to_end(&mut out).unwrap();
    out
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn header(version: u32, gaussians: u32, degree: u8, flags: u8) -> Vec<u8> {
    let mut out = b"NGSP".to_vec();
    out.extend(version.to_le_bytes());
    out.extend(gaussians.to_le_bytes());
    out.extend([degree, 12, flags, 0]);
    out
}

/// `frame` as version 4, with an extension to pass over.
pub(crate) fn version_4(frame: &GaussianFrame) -> Vec<u8> {
    version_4_with(frame, 0x0001_0001, 7)
}

/// `frame` as version 4 with one extension of four bytes.
fn version_4_with(frame: &GaussianFrame, extension: u32, value: u32) -> Vec<u8> {
    let content = gunzip(&spz::write(frame).unwrap());
    let (start, mut rest) = content.split_at(16);
    let sizes = [9, 1, 3, 3, 4, frame.sh().len()].map(|bytes| bytes * frame.len());
    let mut out = start.to_vec();
    out[4] = 4;
    out[14] = 2;
    out[15] = sizes.iter().filter(|&&size| size > 0).count() as u8;
    out.extend(44_u32.to_le_bytes());
    out.extend([0; 12]);
    [extension, 4, value].iter().for_each(|word| out.extend(word.to_le_bytes()));
    let mut frames = Vec::new();
    for size in sizes.into_iter().filter(|&size| size > 0) {
        let (stream, after) = rest.split_at(size);
        let compressed = compress_to_vec(stream, CompressionLevel::Fastest);
        out.extend((compressed.len() as u64).to_le_bytes());
        out.extend((size as u64).to_le_bytes());
        frames.extend(compressed);
        rest = after;
    }
    out.extend(frames);
    out
}

#[test]
fn version_4_holds_what_version_3_holds() {
    let frame = small_frame();
    let three = spz::read(&spz::write(&frame).unwrap(), &LIMITS).unwrap();
    assert_eq!(spz::read(&version_4(&frame), &LIMITS).unwrap(), three);
}

#[test]
fn an_extension_that_names_the_axes_is_obeyed() {
    let frame = small_frame();
    let usual = spz::read(&version_4(&frame), &LIMITS).unwrap();
    // 6 is right, down, forward, as frames are: nothing flips, so y and z are the other way than usual.
    let other = spz::read(&version_4_with(&frame, 0xadbe_0003, 6), &LIMITS).unwrap();
    assert_eq!(other.position()[0], usual.position()[0]);
    for (other, usual) in other.position()[1].iter().zip(&usual.position()[1]) {
        assert_eq!(*other, -usual);
    }
    let error = spz::read(&version_4_with(&frame, 0xadbe_0003, 11), &LIMITS).unwrap_err();
    assert!(error.to_string().contains("exchanges y and z"), "{error}");
}

#[test]
fn version_2_stores_x_y_z_of_the_rotation() {
    let mut content = header(2, 1, 0, 0);
    // Centre (1, 2, −3) in 12 fractional bits; y and z flip on reading.
    content.extend([0x00, 0x10, 0x00, 0x00, 0x20, 0x00, 0x00, 0xd0, 0xff]);
    content.extend([128, 255, 128, 0, 160, 160, 160, 255, 128, 128]);
    let frame = spz::read(&gzip(&content), &LIMITS).unwrap();
    assert_eq!(frame.position().each_ref().map(|plane| plane[0]), [1.0, -2.0, 3.0]);
    assert_eq!(frame.log_scale()[0][0], 0.0);
    // x is 1, so the rest is next to nothing.
    assert!(frame.rotation()[1][0] > 0.999 && frame.rotation()[0][0].abs() < 0.1);
}

#[test]
fn version_1_has_half_floats() {
    let mut content = header(1, 1, 0, 0);
    content.extend([0x00, 0x3c, 0x00, 0xc0, 0x00, 0x38]);
    content.extend([128, 255, 128, 0, 160, 160, 160, 128, 128, 128]);
    let frame = spz::read(&gzip(&content), &LIMITS).unwrap();
    assert_eq!(frame.position().each_ref().map(|plane| plane[0]), [1.0, 2.0, -0.5]);
}

#[test]
fn a_count_beyond_the_bytes_is_refused_without_room_for_it() {
    let error = spz::read(&gzip(&header(3, 1 << 13, 3, 0)), &LIMITS).unwrap_err();
    assert!(error.to_string().contains("positions needs 73728 bytes, 0 are left"), "{error}");
    let error = spz::read(&gzip(&header(3, u32::MAX, 0, 0)), &LIMITS).unwrap_err();
    assert!(error.to_string().contains("max_memory"), "{error}");
}
