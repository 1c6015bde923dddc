//! SOG with codebooks and, in its first version, with ranges.

use std::io::{Cursor, Read, Write};

use splatstream_files::{SceneFormat, detect, ply, read_scene, sog};

use super::samples::{LIMITS, meta, small_frame, sog_with};

#[test]
fn codebooks_give_values_to_bytes() {
    let frame = sog::read_zip(&sog_with(&meta(), 252), &LIMITS).unwrap();
    assert_eq!((frame.len(), frame.sh_degree()), (4, 1));
    // Red of the pixels is 0, 60, 120, 180; entry `code` of the codebook is code / 64 − 2.
    assert_eq!(frame.log_scale()[0], [-2.0, -1.0625, -0.125, 0.8125]);
    assert_eq!(frame.dc()[0], frame.log_scale()[0]);
    // Entry 1 of the palette starts at pixel 3, whose red is 12 × 7; its green is 13 × 7.
    assert_eq!(frame.sh()[0][1], 84.0 / 64.0 - 2.0);
    assert_eq!(frame.sh()[1][1], 91.0 / 64.0 - 2.0);
    // Both bytes 0 is the low end, −1, of the log: −(e − 1).
    assert_eq!(frame.position()[0][0], -(1.0_f64.exp_m1()) as f32);
}

#[test]
fn version_1_has_ranges_and_a_logit_for_opacity() {
    let files = |name: &str| format!(r#""files":["{name}.webp"]"#);
    let meta = format!(
        r#"{{"means":{{"shape":[4,3],"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]}},
        "scales":{{"mins":[-5,-5,-5],"maxs":[0,0,0],{}}},"quats":{{{}}},
        "sh0":{{"mins":[-1,-1,-1,-8],"maxs":[1,1,1,8],{}}},
        "shN":{{"mins":-0.5,"maxs":0.5,"files":["centroids.webp","labels.webp"]}}}}"#,
        files("s"),
        files("q"),
        files("c")
    );
    let frame = sog::read_zip(&sog_with(&meta, 255), &LIMITS).unwrap();
    assert_eq!(frame.log_scale()[0][0], -5.0);
    assert_eq!(frame.opacity_logit()[0], (-8.0 + 16.0 * 200.0 / 255.0) as f32);
    assert_eq!(frame.sh()[0][0], -0.5);
    // Alpha 255 puts the component left out last.
    assert!(frame.rotation()[3].iter().all(|&z| z >= 0.0));
}

/// An archive with the members of another in a folder, and some more.
fn in_folder(archive: &[u8], folder: &str, more: &[(&str, &[u8])]) -> Vec<u8> {
    let mut from = zip::ZipArchive::new(Cursor::new(archive)).unwrap();
    let mut to = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let mut add = |name: &str, content: &[u8]| {
        to.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        to.write_all(content).unwrap();
    };
    for place in 0..from.len() {
        let mut member = from.by_index(place).unwrap();
        let mut content = Vec::new();
        member.read_to_end(&mut content).unwrap();
        add(&format!("{folder}{}", member.name().unwrap()), &content);
    }
    more.iter().for_each(|(name, content)| add(name, content));
    to.finish().unwrap().into_inner()
}

#[test]
fn an_archive_of_a_sog_directory_is_that_scene() {
    let plain = sog_with(&meta(), 252);
    let beside: [(&str, &[u8]); 2] = [("garden/notes.txt", b"text"), ("__MACOSX/garden/meta.json", b"{}")];
    let nested = in_folder(&plain, "garden/sog/", &beside);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("garden.zip");
    std::fs::write(&path, &nested).unwrap();
    assert_eq!(detect(&path).unwrap(), SceneFormat::Sog);
    let frame = sog::read_zip(&plain, &LIMITS).unwrap();
    assert_eq!(read_scene(&path, &LIMITS).unwrap(), frame);
    // What else is in there may make it something else.
    let ply = ply::write(&small_frame());
    let others: [(&str, &[u8]); 2] = [("frame_0.ply", &ply), ("second/meta.json", b"{}")];
    for other in others {
        std::fs::write(&path, in_folder(&plain, "garden/", &[other])).unwrap();
        assert_eq!(detect(&path).unwrap(), SceneFormat::Archive, "{}", other.0);
    }
}
