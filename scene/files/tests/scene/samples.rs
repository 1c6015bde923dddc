//! Small files of every format, and frames for property tests.

use std::io::{Cursor, Write};

use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder};
use proptest::collection::vec;
use proptest::prelude::*;
use splatstream_files::{ReadLimits, compressed_ply, gltf, ply, sog, splat, spz};
use splatstream_gaussians::{GaussianFrame, Planes, sh_coefficients};

/// Small, so that a test of broken files cannot take all memory.
pub(crate) const LIMITS: ReadLimits = ReadLimits { max_memory: 1 << 22 };

/// The values of one Gaussian: position, log scale, rotation, opacity logit, DC, SH.
pub(crate) type Row = ([f32; 3], [f32; 3], [f32; 4], f32, [f32; 3], Vec<f32>);

/// Frames of up to 12 Gaussians and any SH degree, with values as scenes have them. No rotation is zero.
pub(crate) fn frames() -> impl Strategy<Value = GaussianFrame> {
    let rotation = prop::array::uniform4(-1.0_f32..1.0)
        .prop_filter("a rotation", |q| q.iter().any(|part| part.abs() > 0.1));
    let row = (
        prop::array::uniform3(-100.0_f32..100.0),
        prop::array::uniform3(-9.5_f32..5.0),
        rotation,
        -8.0_f32..8.0,
        prop::array::uniform3(-1.5_f32..1.5),
        vec(-0.9_f32..0.8, 45),
    );
    (0..=3_u8, vec(row, 0..12)).prop_map(|(degree, rows)| frame_of(degree, &rows))
}

pub(crate) fn frame_of(degree: u8, rows: &[Row]) -> GaussianFrame {
    let planes = Planes {
        position: [0, 1, 2].map(|at| rows.iter().map(|row| row.0[at]).collect()),
        log_scale: [0, 1, 2].map(|at| rows.iter().map(|row| row.1[at]).collect()),
        rotation: [0, 1, 2, 3].map(|at| rows.iter().map(|row| row.2[at]).collect()),
        opacity_logit: rows.iter().map(|row| row.3).collect(),
        dc: [0, 1, 2].map(|at| rows.iter().map(|row| row.4[at]).collect()),
        sh: (0..sh_coefficients(degree) * 3).map(|at| rows.iter().map(|row| row.5[at]).collect()).collect(),
    };
    GaussianFrame::from_planes(degree, planes).unwrap()
}

/// Three Gaussians of degree 1.
pub(crate) fn small_frame() -> GaussianFrame {
    let row = |at: f32| -> Row {
        (
            [at, -at, 2.0],
            [-3.0, -2.0, -4.0],
            [1.0, at, 0.0, 0.5],
            1.0 - at,
            [0.5, at, -0.5],
            vec![0.1 * at; 45],
        )
    };
    frame_of(1, &[row(0.0), row(1.0), row(2.0)])
}

/// A file of every format, by name.
pub(crate) fn small_files() -> Vec<(&'static str, Vec<u8>)> {
    let frame = small_frame();
    vec![
        ("a.ply", ply::write(&frame)),
        ("a.compressed.ply", compressed_ply()),
        ("b.compressed.ply", compressed_ply::write(&frame).unwrap()),
        ("a.splat", splat::write(&frame).unwrap()),
        ("a.spz", spz::write(&frame).unwrap()),
        ("four.spz", super::spz_versions::version_4(&frame)),
        ("a.sog", sog()),
        ("b.sog", sog::write_zip(&frame).unwrap()),
        ("a.glb", gltf::write(&frame).unwrap()),
        ("a.gltf", super::gltf_files::with_data_uri(&frame)),
        ("a.ksplat", super::ksplat_files::ksplat(&frame, 0, 2)),
        ("b.ksplat", super::ksplat_files::ksplat(&frame, 1, 2)),
        ("c.ksplat", super::ksplat_files::ksplat(&frame, 2, 2)),
    ]
}

/// One chunk, two vertices, SH degree 1. The first is at the low end of every range, the second at the high.
pub(crate) fn compressed_ply() -> Vec<u8> {
    let ranges = [
        "min_x",
        "min_y",
        "min_z",
        "max_x",
        "max_y",
        "max_z",
        "min_scale_x",
        "min_scale_y",
        "min_scale_z",
        "max_scale_x",
        "max_scale_y",
        "max_scale_z",
    ];
    let mut text = String::from("ply\nformat binary_little_endian 1.0\nelement chunk 1\n");
    ranges.iter().for_each(|name| text.push_str(&format!("property float {name}\n")));
    text.push_str("element vertex 2\n");
    for name in ["packed_position", "packed_rotation", "packed_scale", "packed_color"] {
        text.push_str(&format!("property uint {name}\n"));
    }
    text.push_str("element sh 2\n");
    (0..9).for_each(|at| text.push_str(&format!("property uchar f_rest_{at}\n")));
    text.push_str("end_header\n");
    let mut bytes = text.into_bytes();
    for value in [-1.0_f32, -2.0, -3.0, 1.0, 2.0, 3.0, -9.0, -8.0, -7.0, -3.0, -2.0, -1.0] {
        bytes.extend(value.to_le_bytes());
    }
    let middle = 2 << 30 | 512 << 20 | 512 << 10 | 512;
    for word in [0, middle, 0, 0, u32::MAX, middle, u32::MAX, u32::MAX] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend([0, 1, 2, 3, 4, 5, 6, 7, 8, 255, 254, 253, 252, 251, 250, 249, 248, 128]);
    bytes
}

/// Four Gaussians of degree 1 as a ZIP archive.
pub(crate) fn sog() -> Vec<u8> {
    sog_with(&meta(), 252)
}

pub(crate) fn meta() -> String {
    let codebook: Vec<f32> = (0..=255_u8).map(|code| f32::from(code) / 64.0 - 2.0).collect();
    format!(
        r#"{{"version":2,"count":4,"means":{{"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]}},
        "scales":{{"codebook":{codebook:?},"files":["s.webp"]}},"quats":{{"files":["q.webp"]}},
        "sh0":{{"codebook":{codebook:?},"files":["c.webp"]}},
        "shN":{{"codebook":{codebook:?},"files":["labels.webp","centroids.webp"]}}}}"#
    )
}

/// An archive with this `meta.json`, and rotations that have this alpha.
pub(crate) fn sog_with(meta: &str, alpha: u8) -> Vec<u8> {
    let pixels =
        |alpha: u8| -> Vec<u8> { (0..4_u8).flat_map(|at| [at * 60, 128, 255 - at, alpha]).collect() };
    let palette: Vec<u8> = (0..192 * 4_u32).map(|at| (at * 7 % 256) as u8).collect();
    let labels = vec![0, 0, 0, 255, 1, 0, 0, 255, 63, 0, 0, 255, 5, 0, 0, 255];
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let mut add = |name: &str, content: &[u8]| {
        archive.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        archive.write_all(content).unwrap();
    };
    add("meta.json", meta.as_bytes());
    for name in ["l.webp", "u.webp", "s.webp"] {
        add(name, &webp(&pixels(255), 2));
    }
    add("q.webp", &webp(&pixels(alpha), 2));
    add("c.webp", &webp(&pixels(200), 2));
    add("labels.webp", &webp(&labels, 2));
    add("centroids.webp", &webp(&palette, 192));
    archive.finish().unwrap().into_inner()
}

fn webp(rgba: &[u8], width: u32) -> Vec<u8> {
    let mut out = Vec::new();
    let height = rgba.len() as u32 / 4 / width;
    WebPEncoder::new_lossless(&mut out).write_image(rgba, width, height, ExtendedColorType::Rgba8).unwrap();
    out
}
