//! What frames cannot hold is reduced, and noted.

use flate2::write::GzEncoder;
use splatstream_files::{Note, Scene, ply, read_scene_as_is, spz};
use std::fs;
use std::io::Write;

use super::samples::{LIMITS, small_frame};

fn read(name: &str, bytes: &[u8]) -> Scene {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    fs::write(&path, bytes).unwrap();
    read_scene_as_is(&path, &LIMITS).unwrap()
}

/// Text PLY of one Gaussian whose properties have their place as value.
fn text_ply(names: &[String]) -> Vec<u8> {
    let properties: String = names.iter().map(|name| format!("property float {name}\n")).collect();
    let values: Vec<String> = (0..names.len()).map(|at| (at as f32 / 100.0 + 0.01).to_string()).collect();
    format!("ply\nformat ascii 1.0\nelement vertex 1\n{properties}end_header\n{}\n", values.join(" "))
        .into_bytes()
}

fn names(rest: usize, scales: usize) -> Vec<String> {
    let numbered =
        |prefix: &str, count: usize| (0..count).map(|at| format!("{prefix}_{at}")).collect::<Vec<_>>();
    let plain = ["x", "y", "z", "opacity"].map(str::to_owned).to_vec();
    [plain, numbered("f_dc", 3), numbered("scale", scales), numbered("rot", 4), numbered("f_rest", rest)]
        .concat()
}

#[test]
fn degree_4_of_a_ply_is_reduced_to_3() {
    let scene = read("a.ply", &text_ply(&names(72, 3)));
    assert_eq!(scene.notes, [Note::ShDegree { found: 4 }]);
    assert_eq!(scene.frame.sh_degree(), 3);
    // f_rest_0 is the 15th property; green starts 24 later.
    let value = |plane: usize| scene.frame.sh()[plane][0];
    let expected = |rest: usize| (14 + rest) as f32 / 100.0 + 0.01;
    assert_eq!([value(0), value(1), value(44)], [expected(0), expected(24), expected(48 + 14)]);
}

#[test]
fn degree_4_of_an_spz_is_reduced_to_3() {
    // Two Gaussians of version 3; coefficients are their places.
    let mut content =
        [b"NGSP".as_slice(), &3_u32.to_le_bytes(), &2_u32.to_le_bytes(), &[4, 12, 0, 0]].concat();
    content.extend([0; 2 * 9]);
    content.extend([128; 2 + 6 + 6]);
    content.extend([0; 8]);
    content.extend((0..2 * 72).map(|at| (at % 72 + at / 72) as u8 + 100));
    let mut gzip = GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(&content).unwrap();
    let scene = read("a.spz", &gzip.finish().unwrap());
    assert_eq!(scene.notes, [Note::ShDegree { found: 4 }]);
    assert_eq!(scene.frame.sh_degree(), 3);
    let last = scene.frame.sh()[44].iter().map(|value| value.abs() * 128.0).collect::<Vec<_>>();
    assert_eq!(last, [100.0 + 44.0 - 128.0, 101.0 + 44.0 - 128.0]);
    // Nothing is noted of what a frame can hold.
    assert_eq!(read("b.spz", &spz::write(&small_frame()).unwrap()).notes, []);
}

#[test]
fn flat_gaussians_get_a_third_semi_axis() {
    let scene = read("a.ply", &text_ply(&names(0, 2)));
    let log = scene.frame.log_scale()[2][0];
    assert!((f64::from(log) - libm::log(1e-6)).abs() < 1e-6);
    assert_eq!(scene.notes, [Note::Flat { log_scale: log }]);
    assert!(scene.notes[0].to_string().contains("each was given a third of 1e-6"), "{}", scene.notes[0]);
    // A file that lacks more than the third scale is no file of flat Gaussians.
    let error = ply::read(&text_ply(&names(0, 1)), &LIMITS).unwrap_err().to_string();
    assert!(error.contains("lacks scale_1, scale_2"), "{error}");
}
