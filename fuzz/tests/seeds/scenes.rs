//! A scene file of every format, in front of it the byte that chooses the reader.

use crate::packed;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::{gltf, ply, splat, spz};
use splatstream_fuzz::scene;
use splatstream_gaussians::GaussianFrame;
use std::io::{Cursor, Read, Write};
use zip::write::SimpleFileOptions;

/// Gaussians of a file.
const ROWS: u32 = 4;
/// Pixels in a row of a SOG image of rows.
const WIDTH: u32 = 2;

/// Name, and choice and file.
pub(crate) fn all() -> Vec<(String, Vec<u8>)> {
    let frame = frame(1);
    let files = [
        ("ply", 0, ply::write(&frame)),
        ("ply-without-sh", 0, ply::write(&self::frame(0))),
        ("ply-of-text", 0, plain_ply("ascii", |value| format!("{value} ").into_bytes())),
        ("ply-big-endian", 0, plain_ply("binary_big_endian", |value| value.to_be_bytes().to_vec())),
        ("spz", 1, spz::write(&frame).unwrap()),
        ("spz-version-2", 1, old_spz(2)),
        ("spz-version-4", 1, new_spz(&frame)),
        ("splat", 2, splat::write(&frame).unwrap()),
        ("sog", 3, sog(&codebooks())),
        ("sog-version-1", 3, sog(RANGES)),
        ("compressed-ply", 4, compressed_ply()),
        ("packed-spz-version-1", 5, packed::spz_gzip(1)),
        ("packed-spz-version-3", 5, packed::spz_gzip(3)),
        ("packed-spz-version-4", 6, packed::spz_zstd()),
        ("packed-sog", 7, packed::sog(None)),
        ("packed-sog-of-text", 7, packed::sog(Some(packed::CODEBOOKS))),
        ("packed-sog-version-1", 7, packed::sog(Some(packed::RANGES))),
        ("packed-ply", 8, packed::ply(0)),
        ("packed-ply-of-text", 8, packed::ply(1)),
        ("packed-compressed-ply", 9, packed::compressed_ply()),
        ("gltf", 10, gltf::write(&frame).unwrap()),
        ("packed-gltf", 11, packed::gltf(2)),
        ("packed-gltf-of-text", 11, packed::gltf(1)),
        ("packed-gltf-spz", 11, packed::gltf_of_spz(&spz::write(&frame).unwrap())),
        ("ksplat", 12, scene::ksplat_file::pack(&packed::ksplat(1))),
        ("packed-ksplat-level-0", 13, packed::ksplat(0)),
        ("packed-ksplat-level-1", 13, packed::ksplat(1)),
        ("packed-ksplat-level-2", 13, packed::ksplat(2)),
        ("splatv", 14, scene::sequence_file::splatv(&packed::splatv())),
        ("packed-splatv", 15, packed::splatv()),
        ("splat4d", 16, scene::sequence_file::splat4d(&packed::splat4d())),
        ("packed-splat4d", 17, packed::splat4d()),
        ("archive-zip", 18, zip(&[("a_2.splat", &splat::write(&frame).unwrap()), ("a_10.splat", &[1; 32])])),
        ("archive-tgz", 18, gzip(&scene::sequence_file::tar(&packed::tar()))),
        ("packed-tar", 19, packed::tar()),
    ];
    files.into_iter().map(|(name, choice, file)| (name.to_owned(), [vec![choice], file].concat())).collect()
}

fn frame(sh_degree: u8) -> GaussianFrame {
    let scene = BuiltinScene { gaussians: 100, sh_degree, ..BuiltinScene::default() };
    scene.frame(0).select(&(0..ROWS).collect::<Vec<_>>())
}

/// Two vertices in the box of one chunk.
fn compressed_ply() -> Vec<u8> {
    let mut header = String::from("ply\nformat binary_little_endian 1.0\nelement chunk 1\n");
    for (what, axes) in [("", "xyz"), ("scale_", "xyz")] {
        for end in ["min", "max"] {
            axes.chars().for_each(|axis| header += &format!("property float {end}_{what}{axis}\n"));
        }
    }
    header += "element vertex 2\n";
    for what in ["position", "rotation", "scale", "color"] {
        header += &format!("property uint packed_{what}\n");
    }
    header += "element sh 2\n";
    (0..9).for_each(|number| header += &format!("property uchar f_rest_{number}\n"));
    header += "end_header\n";
    let ends = [-1.0_f32, -1.0, -1.0, 1.0, 1.0, 1.0, -8.0, -8.0, -8.0, -2.0, -2.0, -2.0];
    let words = [0_u32, 0x8008_0200, 0, 0x8080_80ff, u32::MAX, 0x4008_0200, 0x1234_5678, 0x10ff_807f];
    let mut bytes = header.into_bytes();
    bytes.extend(ends.iter().flat_map(|value| value.to_le_bytes()));
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    bytes.extend((0..18_u8).map(|value| value * 14));
    bytes
}

/// One vertex after an element that is skipped.
fn plain_ply(encoding: &str, cell: impl Fn(f64) -> Vec<u8>) -> Vec<u8> {
    let names = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let mut header = format!("ply\nformat {encoding} 1.0\nelement camera 1\nproperty double focus\n");
    header += "element vertex 1\n";
    names.split(' ').for_each(|name| header += &format!("property double {name}\n"));
    header += "element face 0\nproperty list uchar int indices\nend_header\n";
    let values = (0..15).flat_map(|number| cell(f64::from(number) / 4.0));
    header.into_bytes().into_iter().chain(values).collect()
}

/// One Gaussian of degree 0 in an old version.
fn old_spz(version: u8) -> Vec<u8> {
    let header = [b'N', b'G', b'S', b'P', version, 0, 0, 0, 1, 0, 0, 0, 0, 12, 0, 0];
    // Centre 9, opacity 1, colour 3, scale 3, rotation 3.
    gzip(&[header.as_slice(), &[1; 19]].concat())
}

/// The streams of a frame as version 4 has them: a header, a table, and a Zstandard frame each.
fn new_spz(frame: &GaussianFrame) -> Vec<u8> {
    let mut content = Vec::new();
    GzDecoder::new(spz::write(frame).unwrap().as_slice()).read_to_end(&mut content).unwrap();
    let (header, mut rest) = content.split_at(16);
    let mut out = header.to_vec();
    (out[4], out[15]) = (4, 6);
    // No extensions: the table stands behind the header.
    out.extend(32_u32.to_le_bytes());
    out.extend([0; 12]);
    let mut frames = Vec::new();
    for size in [9, 1, 3, 3, 4, frame.sh().len()].map(|bytes| bytes * frame.len()) {
        let (stream, behind) = rest.split_at(size);
        let compressed = compress_to_vec(stream, CompressionLevel::Fastest);
        out.extend((compressed.len() as u64).to_le_bytes());
        out.extend((size as u64).to_le_bytes());
        frames.extend(compressed);
        rest = behind;
    }
    out.extend(frames);
    out
}

/// An archive of files.
fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in files {
        archive.start_file(*name, SimpleFileOptions::default()).unwrap();
        archive.write_all(content).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn gzip(content: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(content).unwrap();
    encoder.finish().unwrap()
}

/// What version 1 of SOG says of its bytes.
const RANGES: &str = r#"{"means":{"shape":[4,3],"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]},
"scales":{"mins":-8,"maxs":-1,"files":["s.webp"]},"quats":{"files":["q.webp"]},
"sh0":{"mins":[-1,-1,-1,-4],"maxs":[1,1,1,4],"files":["c.webp"]},
"shN":{"mins":-1,"maxs":1,"files":["labels.webp","centroids.webp"]}}"#;

/// What version 2 says.
fn codebooks() -> String {
    let codes: Vec<f32> = (0..=255_u8).map(|code| f32::from(code) / 100.0 - 1.5).collect();
    format!(
        r#"{{"version":2,"count":{ROWS},"means":{{"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]}},
"scales":{{"codebook":{codes:?},"files":["s.webp"]}},"quats":{{"files":["q.webp"]}},
"sh0":{{"codebook":{codes:?},"files":["c.webp"]}},"shN":{{"codebook":{codes:?},"files":["labels.webp","centroids.webp"]}}}}"#
    )
}

/// An archive of images with a palette of one row.
fn sog(meta: &str) -> Vec<u8> {
    let rows = |last: u8| {
        webp(WIDTH, ROWS / WIDTH, |pixel, channel| if channel == 3 { last } else { pixel as u8 * 50 })
    };
    let labels =
        webp(
            WIDTH,
            ROWS / WIDTH,
            |pixel, channel| if channel == 0 { pixel as u8 } else { 255 * u8::from(channel == 3) },
        );
    let files = [
        ("meta.json", meta.as_bytes().to_vec()),
        ("l.webp", rows(255)),
        ("u.webp", rows(255)),
        ("s.webp", rows(255)),
        ("q.webp", rows(253)),
        ("c.webp", rows(200)),
        ("labels.webp", labels),
        // Three pixels to an entry of degree 1, 64 entries in a row.
        ("centroids.webp", webp(64 * 3, 1, |pixel, _| pixel as u8)),
    ];
    let files: Vec<(&str, &[u8])> = files.iter().map(|(name, content)| (*name, content.as_slice())).collect();
    zip(&files)
}

fn webp(width: u32, height: u32, value: impl Fn(u32, u32) -> u8) -> Vec<u8> {
    let pixels: Vec<u8> =
        (0..width * height).flat_map(|pixel| [0, 1, 2, 3].map(|channel| value(pixel, channel))).collect();
    let mut out = Vec::new();
    WebPEncoder::new_lossless(&mut out)
        .write_image(&pixels, width, height, ExtendedColorType::Rgba8)
        .unwrap();
    out
}
