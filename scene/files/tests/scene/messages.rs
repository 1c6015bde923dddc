//! Errors say which file, where, what, and what to do.

use std::fs;

use splatstream_files::{
    HEAD, Note, ReadLimits, Scene, SceneErrorKind, SceneFormat, compressed_ply, detect, ply, read_scene,
    read_scene_as_is, sog, splat,
};
use splatstream_gaussians::activation::sigmoid;

use super::samples::{LIMITS, meta, small_files, small_frame, sog_with};

/// `small_frame` as PLY, with the value of one property of one row replaced.
fn ply_with(row: usize, property: usize, value: f32) -> Vec<u8> {
    let frame = small_frame();
    let mut bytes = ply::write(&frame);
    let stride = (17 + frame.sh().len()) * 4;
    let at = bytes.len() - (frame.len() - row) * stride + property * 4;
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    bytes
}

fn message(bytes: &[u8]) -> String {
    ply::read(bytes, &LIMITS).unwrap_err().to_string()
}

#[test]
fn values_that_no_frame_may_hold_are_named_by_row_and_property() {
    // x is the first property, opacity follows 9 others and 9 of f_rest.
    assert!(
        message(&ply_with(1, 0, f32::NAN)).starts_with("Gaussian 1: x is NaN: every value must be finite")
    );
    assert!(message(&ply_with(2, 18, f32::NAN)).starts_with("Gaussian 2: opacity is NaN"));
    assert!(message(&ply_with(0, 10, f32::NEG_INFINITY)).starts_with("Gaussian 0: f_rest_1 is -inf"));
    let mut bytes = ply_with(1, 22, 0.0);
    let length = bytes.len();
    bytes[length - 26 * 4 - 16..length - 26 * 4].fill(0);
    assert!(message(&bytes).starts_with("Gaussian 1: rot_0..rot_3 is 0: a rotation must have a length"));
}

#[test]
fn an_empty_file_is_called_empty() {
    let directory = tempfile::tempdir().unwrap();
    for name in
        ["a.ply", "a.spz", "a.sog", "a.splat", "a.ksplat", "a.gltf", "a.zip", "a.tar", "a.splat4d", "a"]
    {
        let path = directory.path().join(name);
        fs::write(&path, []).unwrap();
        let message = read_scene(&path, &LIMITS).unwrap_err().to_string();
        assert_eq!(
            message,
            format!("{}: it is empty; check what wrote it, or copy it again", path.display())
        );
        assert!(matches!(detect(&path).unwrap_err().kind, SceneErrorKind::Empty), "{name}");
    }
}

#[test]
fn an_unused_property_may_hold_anything() {
    assert!(ply::read(&ply_with(1, 3, f32::NAN), &LIMITS).is_ok());
}

#[test]
fn infinite_opacities_are_opacities_of_0_and_1() {
    for (value, opacity) in [(f32::INFINITY, 255), (f32::NEG_INFINITY, 0)] {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.ply");
        fs::write(&path, ply_with(2, 18, value)).unwrap();
        let Scene { frame, notes } = read_scene_as_is(&path, &LIMITS).unwrap();
        let logit = frame.opacity_logit()[2];
        let nearest = (255.0 * sigmoid(logit.into())).round() as u8;
        assert!(logit.is_finite() && nearest.abs_diff(opacity) <= 1, "{logit}");
        assert_eq!(notes, [Note::ExactOpacity { count: 1 }]);
    }
}

#[test]
fn what_follows_the_last_element_is_told() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.ply");
    let notes = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        read_scene_as_is(&path, &LIMITS).unwrap().notes
    };
    for file in [ply::write(&small_frame()), compressed_ply::write(&small_frame()).unwrap()] {
        assert_eq!(notes(&file), []);
        assert_eq!(notes(&[&file[..], b"\n"].concat()), []);
        assert_eq!(notes(&[&file[..], &file].concat()), [Note::TrailingBytes { count: file.len() as u64 }]);
    }
}

#[test]
fn long_headers_of_files_are_read_up_to_a_limit() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.ply");
    let with_comment = |length: usize| {
        let text = format!("format binary_little_endian 1.0\ncomment {}\n", "x".repeat(length));
        let plain = ply::write(&small_frame());
        let rest = plain.splitn(3, |&byte| byte == b'\n').last().unwrap();
        fs::write(&path, [b"ply\n", text.as_bytes(), rest].concat()).unwrap();
        read_scene(&path, &LIMITS)
    };
    assert_eq!(with_comment(200_000).unwrap().len(), small_frame().len());
    let said = with_comment(HEAD as usize).unwrap_err().to_string();
    assert!(said.contains(": byte 1048576: the PLY header goes on after 1048576 bytes"), "{said}");
    fs::write(&path, "ply\nformat ascii 1.0\n").unwrap();
    let said = read_scene(&path, &LIMITS).unwrap_err().to_string();
    assert!(said.contains(": byte 21: the file ends before the line \"end_header\""), "{said}");
}

#[test]
fn all_missing_properties_are_listed() {
    let text = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nend_header\n";
    let message = message(text.as_bytes());
    for name in ["z", "f_dc_0", "opacity", "scale_2", "rot_3"] {
        assert!(message.contains(name), "{name} is not in: {message}");
    }
    assert!(!message.contains("lacks x"), "{message}");
}

#[test]
fn a_number_of_rest_properties_between_degrees_is_refused() {
    let bytes = ply::write(&small_frame());
    let text = String::from_utf8_lossy(&bytes).replacen("property float f_rest_8\n", "", 1);
    assert!(message(text.as_bytes()).contains("element vertex has 8 f_rest properties"));
}

#[test]
fn a_count_beyond_the_bytes_says_how_many_are_missing() {
    let bytes = ply::write(&small_frame());
    let message = message(&bytes[..bytes.len() - 1]);
    assert!(message.contains("the element's data needs 312 bytes, 311 are left"), "{message}");
}

#[test]
fn memory_beyond_the_limit_names_the_limit() {
    let bytes = ply::write(&small_frame());
    let error = ply::read(&bytes, &ReadLimits { max_memory: 6000 }).unwrap_err();
    assert!(matches!(error.kind, SceneErrorKind::OverLimit { allowed: 6000, .. }), "{error}");
    assert!(error.to_string().contains("at most 6000 are allowed (max_memory)"), "{error}");
}

#[test]
fn splat_says_how_many_bytes_are_over() {
    let error = splat::read(&[0; 69], &LIMITS).unwrap_err();
    assert!(error.to_string().starts_with("byte 64: 5 bytes over the last whole 32-byte record"), "{error}");
}

#[test]
fn sog_names_the_gaussian_and_the_file() {
    let error = sog::read_zip(&sog_with(&meta(), 100), &LIMITS).unwrap_err();
    assert!(error.to_string().contains("Gaussian 0: rotation alpha is 100"), "{error}");
    let error =
        sog::read_zip(&sog_with(&meta().replace("\"count\":4", "\"count\":5"), 252), &LIMITS).unwrap_err();
    assert!(error.to_string().contains("l.webp has 4 pixels for 5 Gaussians"), "{error}");
}

#[test]
fn a_sog_directory_cannot_name_files_elsewhere() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("meta.json"), meta().replace("l.webp", "../l.webp")).unwrap();
    let error = read_scene(directory.path(), &LIMITS).unwrap_err();
    assert!(error.to_string().contains("no plain file name"), "{error}");
}

#[test]
fn names_from_files_do_not_reach_terminals_as_they_are() {
    let directory = tempfile::tempdir().unwrap();
    let quiet = |said: String, name: &str| {
        assert!(said.contains(name) && !said.contains(char::is_control), "{said:?}");
    };
    let refused = |name: &str, bytes: &[u8]| {
        fs::write(directory.path().join(name), bytes).unwrap();
        read_scene(&directory.path().join(name), &LIMITS).unwrap_err().to_string()
    };
    // A buffer that is not there, and one that is elsewhere.
    for uri in ["\\u001b]0;a\\u0007.bin", "/\\u001b]0;a\\u0007.bin"] {
        let text = String::from_utf8(super::gltf_files::with_data_uri(&small_frame())).unwrap();
        let start = text.find("data:").unwrap();
        let end = start + text[start..].find('"').unwrap();
        quiet(
            refused("a.gltf", [&text[..start], uri, &text[end..]].concat().as_bytes()),
            "\\u{1b}]0;a\\u{7}.bin",
        );
    }
    let named = |name: &str| meta().replace("l.webp", name);
    quiet(refused("meta.json", named("\\u001b[2J.webp").as_bytes()), "\\u{1b}[2J.webp");
    quiet(refused("meta.json", named("../\\u001b[2J.webp").as_bytes()), "\\u{1b}[2J.webp");
    let error = sog::read_zip(&sog_with(&named("\\u001b[2J.webp"), 252), &LIMITS).unwrap_err();
    quiet(error.to_string(), "\\u{1b}[2J.webp");
}

#[test]
fn content_decides_the_format_and_errors_carry_the_path() {
    let directory = tempfile::tempdir().unwrap();
    for (name, bytes) in small_files() {
        // A wrong extension does not matter where the content says enough.
        let (_, suffix) = name.split_once('.').unwrap();
        let needs_name = matches!(suffix, "splat" | "ksplat" | "gltf");
        let path = directory.path().join(if needs_name { name } else { "scene.bin" });
        fs::write(&path, &bytes).unwrap();
        let expected = match suffix {
            "ply" => SceneFormat::Ply,
            "compressed.ply" => SceneFormat::CompressedPly,
            "splat" => SceneFormat::Splat,
            "sog" => SceneFormat::Sog,
            "glb" | "gltf" => SceneFormat::Gltf,
            "ksplat" => SceneFormat::Ksplat,
            _ => SceneFormat::Spz,
        };
        assert_eq!(detect(&path).unwrap(), expected, "{name}");
        assert!(read_scene(&path, &LIMITS).is_ok(), "{name}");
    }
    let path = directory.path().join("text.txt");
    fs::write(&path, "hello").unwrap();
    for error in [detect(&path).unwrap_err(), read_scene(&path, &LIMITS).unwrap_err()] {
        assert_eq!(error.path.as_deref(), Some(path.as_path()));
        assert!(error.to_string().contains("text.txt: the content is of no known scene format"), "{error}");
    }
    assert!(read_scene(&directory.path().join("absent.ply"), &LIMITS).unwrap_err().path.is_some());
}
