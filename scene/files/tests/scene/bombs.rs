//! Small files that stand for much memory are refused before it is taken, and what they ask for is said.

use std::fmt::Write as _;
use std::io::{Cursor, Write};

use splatstream_files::{
    ReadLimits, SceneError, SceneErrorKind, SceneFormat, Sequence, SequenceOptions, ply, read_scene, sog,
    splat, spz,
};

use super::samples::{LIMITS, small_frame};

/// Bytes that `error` says reading takes at least.
fn asked(error: SceneError) -> u64 {
    let SceneErrorKind::OverLimit { asked, allowed, .. } = error.kind else { panic!("{error}") };
    assert!(asked > allowed && error.to_string().contains("max_memory"), "{error}");
    asked
}

/// A Zstandard frame of `size` equal bytes: four bytes for each 128 KiB.
fn zstd(size: usize) -> Vec<u8> {
    let mut out = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 10 << 3];
    for start in (0..size).step_by(1 << 17) {
        let length = (size - start).min(1 << 17);
        let word = (length << 3 | 2 | usize::from(start + length == size)) as u32;
        let [a, b, c, _] = word.to_le_bytes();
        out.extend([a, b, c, 128]);
    }
    out
}

/// SPZ version 4 of degree 3.
fn spz_4(gaussians: u32) -> Vec<u8> {
    let sizes = [9, 1, 3, 3, 4, 45].map(|stride| stride * gaussians as usize);
    let frames = sizes.map(zstd);
    let mut out = [0x5053_474e_u32, 4, gaussians].map(u32::to_le_bytes).concat();
    out.extend([3, 12, 0, 6]);
    out.extend([32_u32, 0, 0, 0].map(u32::to_le_bytes).concat());
    for (frame, size) in frames.iter().zip(sizes) {
        out.extend((frame.len() as u64).to_le_bytes());
        out.extend((size as u64).to_le_bytes());
    }
    out.extend(frames.concat());
    out
}

/// A WebP image of one colour, red, green and blue 0: some twenty bytes whatever its size.
fn webp(width: u32, height: u32, alpha: u8) -> Vec<u8> {
    let (mut bits, mut length) = (0_u128, 0);
    let mut put = |value: u32, count: u32| {
        bits |= u128::from(value) << length;
        length += count;
    };
    let header = [(0x2f, 8), (width - 1, 14), (height - 1, 14), (1, 1), (0, 3), (0, 1), (0, 1), (0, 1)];
    header.into_iter().for_each(|(value, count)| put(value, count));
    // Five prefix codes of one symbol each: green, red, blue, alpha, distance.
    for symbol in [0, 0, 0, u32::from(alpha), 0] {
        [(1, 1), (0, 1), (1, 1), (symbol, 8)].into_iter().for_each(|(value, count)| put(value, count));
    }
    let data = &bits.to_le_bytes()[..length.div_ceil(16) as usize * 2];
    let chunk = [&b"WEBPVP8L"[..], &(data.len() as u32).to_le_bytes(), data].concat();
    [&b"RIFF"[..], &(chunk.len() as u32).to_le_bytes(), &chunk].concat()
}

/// A SOG archive that says it has so many Gaussians, of images of one size.
fn sog_of(count: u64, width: u32, height: u32) -> Vec<u8> {
    let coded = r#""mins":0,"maxs":1,"files":["a"]"#;
    let meta = format!(
        r#"{{"version":2,"count":{count},"means":{{"mins":[0,0,0],"maxs":[1,1,1],"files":["a","a"]}},
        "scales":{{{coded}}},"quats":{{"files":["a"]}},"sh0":{{{coded}}}}}"#
    );
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in [("meta.json", meta.as_bytes()), ("a", &webp(width, height, 252))] {
        archive.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        archive.write_all(content).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// One Gaussian of `.splat4d` that stays as it is, in one group of so many frames, and the bytes of it.
fn splat4d_of(frames: u32) -> (usize, Result<Sequence, SceneError>) {
    // Masks of what changes, whose first bit is 1: nothing; then positions, scales, colours, opacity and rotation.
    let still: Vec<u8> = [1, 1, 1, 1, 1, 3, 3, 3, 1, 4]
        .into_iter()
        .flat_map(|count: u32| {
            let packed = zstd(count as usize);
            [&[0, 0, 1][..], &count.to_le_bytes(), &(packed.len() as u32).to_le_bytes(), &packed].concat()
        })
        .collect();
    let json = |length: usize| {
        let (first, last) = (12 + length, frames - 1);
        let steps = r#""pos":1,"scale_log":1,"rgb":1,"alpha":1,"rot":1,"base_pos":1,"base_scale_log":1"#;
        format!(
            r#"{{"n":1,"t":{frames},"steps":{{{steps}}},"static_section":{{"offset":{first:6},"len":{}}},
            "gops":[{{"offset":{:6},"len":2,"f0":0,"f1":{last}}}]}}"#,
            still.len(),
            first + still.len()
        )
    };
    let json = json(json(0).len());
    // A group of no streams.
    let length = (json.len() as u32).to_le_bytes();
    let file = [b"SP4D\x01\0\0\0".as_slice(), &length, json.as_bytes(), &still, &[0, 0]].concat();
    let (size, options) = (file.len(), SequenceOptions::default());
    (size, Sequence::of(Cursor::new(file), SceneFormat::Splat4d, "talk".as_ref(), &LIMITS, &options))
}

#[test]
fn splat4d_has_no_more_frames_than_bytes() {
    let (size, few) = splat4d_of(400);
    let mut few = few.unwrap();
    assert!(few.len() == 400 && size < 600, "{size}");
    assert_eq!(few.frame(399).unwrap().frame.len(), 1);
    let (size, many) = splat4d_of(u32::MAX);
    let said = many.err().unwrap().to_string();
    assert!(said.contains(&format!("4294967295 frames in a file of {size} bytes")), "{said}");
}

#[test]
fn spz_that_stands_for_millions_is_refused_before_anything_is_decompressed() {
    let bytes = spz_4(1 << 19);
    assert!(bytes.len() < 1500, "{}", bytes.len());
    assert_eq!(spz::read(&spz_4(1000), &LIMITS).unwrap().len(), 1000);
    // 65 bytes of attributes and 59 planes of a Gaussian.
    assert_eq!(asked(spz::read(&bytes, &LIMITS).unwrap_err()), (65 + 59 * 4) << 19);
    let twice = ReadLimits { max_memory: (65 + 59 * 4 - 1) << 19 };
    assert_eq!(asked(spz::read(&bytes, &twice).unwrap_err()), (65 + 59 * 4) << 19);
}

#[test]
fn sog_is_refused_for_its_count_and_for_its_images() {
    assert_eq!(sog::read_zip(&sog_of(40, 8, 8), &LIMITS).unwrap().len(), 40);
    let counted = sog_of(32 << 20, 16383, 2048);
    assert!(counted.len() < 600, "{}", counted.len());
    assert!(asked(sog::read_zip(&counted, &LIMITS).unwrap_err()) > (32 << 20) * 56);
    // Each of the five images has a pixel for each Gaussian, and as many again and some for padding.
    let drawn = sog_of(1 << 16, 512, 256);
    assert!(asked(sog::read_zip(&drawn, &ReadLimits { max_memory: 5 << 20 }).unwrap_err()) > 5 << 20);
    assert!(sog::read_zip(&drawn, &ReadLimits { max_memory: 16 << 20 }).is_ok());
}

#[test]
fn a_long_header_takes_memory_in_proportion() {
    // A long name of an element, which each property must not repeat.
    let mut text = format!("ply\nformat ascii 1.0\nelement {} 0\n", "e".repeat(1 << 16));
    (0..1 << 14).for_each(|number| writeln!(text, "property char p{number}").unwrap());
    text.push_str("end_header\n");
    let error = ply::read(text.as_bytes(), &LIMITS).unwrap_err();
    assert!(error.to_string().starts_with("no element is called vertex"), "{error}");
    assert!(asked(ply::read(text.as_bytes(), &ReadLimits { max_memory: 1 << 20 }).unwrap_err()) > 1 << 20);
}

#[test]
fn all_that_a_plain_file_takes_counts() {
    let frame = small_frame();
    let planes = (14 + frame.sh().len() as u64) * 4 * frame.len() as u64;
    let splat = splat::write(&frame).unwrap();
    let allowed = |max_memory: u64| splat::read(&splat, &ReadLimits { max_memory });
    assert!(allowed(14 * 4 * frame.len() as u64).is_ok());
    assert_eq!(asked(allowed(14 * 4 * frame.len() as u64 - 1).unwrap_err()), 14 * 4 * frame.len() as u64);
    let ply = ply::write(&frame);
    let least =
        (0..1 << 16).step_by(64).find(|&max| ply::read(&ply, &ReadLimits { max_memory: max }).is_ok());
    assert!(least.unwrap() > planes, "{least:?}");
}

#[test]
fn a_file_of_records_is_refused_by_its_size_and_not_read() {
    let file = tempfile::Builder::new().suffix(".splat").tempfile().unwrap();
    // Sparse, and with a byte too much, which would be said after reading.
    file.as_file().set_len((32 << 20) + 1).unwrap();
    let limits = ReadLimits { max_memory: 64 << 20 };
    assert_eq!(asked(read_scene(file.path(), &limits).unwrap_err()), (88 << 20) + 1);
    let enough = ReadLimits { max_memory: (88 << 20) + 1 };
    let SceneErrorKind::Malformed { .. } = read_scene(file.path(), &enough).unwrap_err().kind else {
        panic!("it is read where there is room");
    };
}
