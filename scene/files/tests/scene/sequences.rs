//! Files of many frames: archives, `.splatv`, `.splat4d`.

use std::io::{Cursor, Read, Write};
use std::path::Path;

use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use splatstream_files::{
    Note, ReadLimits, SceneError, SceneFormat, Sequence, SequenceOptions, detect, ply, read_scene, splat,
};
use splatstream_gaussians::GaussianFrame;

use super::samples::{LIMITS, small_files, small_frame};

fn open(bytes: &[u8], format: SceneFormat, samples: u32) -> Result<Sequence, SceneError> {
    Sequence::of(
        Cursor::new(bytes.to_vec()),
        format,
        Path::new("talk"),
        &LIMITS,
        &SequenceOptions { samples },
    )
}

/// Frames whose first centre tells them apart.
fn frames(count: usize) -> Vec<GaussianFrame> {
    let frame = |number: usize| {
        let mut frame = small_frame().with_unit_rotations();
        frame.planes_mut().position[0][0] = number as f32;
        frame
    };
    (0..count).map(frame).collect()
}

fn zip_of(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in files {
        archive.start_file(name.as_str(), zip::write::SimpleFileOptions::default()).unwrap();
        archive.write_all(content).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn tar_of(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut archive = tar::Builder::new(Vec::new());
    for (name, content) in files {
        let mut header = tar::Header::new_ustar();
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        archive.append_data(&mut header, name, content.as_slice()).unwrap();
    }
    archive.into_inner().unwrap()
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(bytes).unwrap();
    gzip.finish().unwrap()
}

/// Frames out of order, and what systems put beside them.
fn files() -> Vec<(String, Vec<u8>)> {
    let name = |number: usize| format!("talk/frame_{number}.ply");
    let mut files: Vec<_> =
        frames(11).iter().enumerate().map(|(at, frame)| (name(at), ply::write(frame))).collect();
    files.reverse();
    files.push(("talk/readme.txt".to_owned(), b"not a frame".to_vec()));
    files.push(("__MACOSX/talk/._frame_0.ply".to_owned(), vec![0; 8]));
    files
}

#[test]
fn archives_give_their_frames_in_natural_order() {
    let (zip, tar) = (zip_of(&files()), tar_of(&files()));
    for (name, archive) in [("a.zip", zip), ("a.tar", tar.clone()), ("a.tgz", gzip(&tar))] {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(name);
        std::fs::write(&path, &archive).unwrap();
        assert_eq!(detect(&path).unwrap(), SceneFormat::Archive, "{name}");
        let mut sequence = Sequence::open(&path, &LIMITS, &SequenceOptions::default()).unwrap();
        assert_eq!(sequence.len(), 11);
        assert!(sequence.name(10).ends_with(&format!("{name}/talk/frame_10.ply")), "{}", sequence.name(10));
        // Any order.
        for number in [0, 1, 10, 9, 3] {
            assert_eq!(sequence.frame(number).unwrap().frame, frames(11)[number as usize], "{name}");
        }
        assert!(sequence.frame(11).unwrap_err().to_string().contains("there is no frame 11, 11 are there"));
        let error = read_scene(&path, &LIMITS).unwrap_err().to_string();
        assert!(error.contains("the file holds 11 frames; read it as a sequence"), "{error}");
    }
}

#[test]
fn long_names_in_tar_are_whole() {
    let name = format!("{}/frame_1.ply", "folder".repeat(30));
    let archive = tar_of(&[(name.clone(), ply::write(&small_frame()))]);
    let sequence = open(&archive, SceneFormat::Archive, 1).unwrap();
    assert_eq!(sequence.name(0), format!("talk/{name}"));
}

#[test]
fn every_format_of_one_scene_is_a_frame() {
    for (name, bytes) in small_files().into_iter().filter(|(name, _)| !name.ends_with("gltf")) {
        for archive in
            [zip_of(&[(name.to_owned(), bytes.clone())]), tar_of(&[(name.to_owned(), bytes.clone())])]
        {
            let mut sequence = open(&archive, SceneFormat::Archive, 1).unwrap();
            assert!(!sequence.frame(0).unwrap().frame.is_empty(), "{name}");
        }
    }
}

#[test]
fn what_is_wrong_with_an_archive_is_named() {
    let refused = |bytes: &[u8]| open(bytes, SceneFormat::Archive, 1).err().unwrap().to_string();
    let mixed = [("a.ply".to_owned(), vec![1]), ("b.spz".to_owned(), vec![1])];
    assert!(
        refused(&zip_of(&mixed)).contains("talk: the archive holds frames of several formats (ply, spz)")
    );
    assert!(refused(&zip_of(&[])).contains("talk: "));
    assert!(refused(&tar_of(&[("a.txt".to_owned(), vec![1])])).contains("the archive holds no frames"));
    // A frame that is damaged is named.
    let damaged = zip_of(&[("a.ply".to_owned(), b"ply\nx".to_vec())]);
    let error = open(&damaged, SceneFormat::Archive, 1).unwrap().frame(0).unwrap_err().to_string();
    assert!(error.starts_with("talk/a.ply: byte 4: no PLY header line"), "{error}");
    let empty = zip_of(&[("a.splat".to_owned(), Vec::new())]);
    let error = open(&empty, SceneFormat::Archive, 1).unwrap().frame(0).unwrap_err().to_string();
    assert!(error.starts_with("talk/a.splat: it is empty"), "{error}");
    // A member that says more than there is.
    let mut cut = tar_of(&[("a.ply".to_owned(), ply::write(&small_frame()))]);
    cut.truncate(1000);
    let error = open(&cut, SceneFormat::Archive, 1).and_then(|mut sequence| sequence.frame(0)).err().unwrap();
    assert!(!error.to_string().is_empty());
}

#[test]
fn names_in_archives_are_shown_without_what_steers_terminals() {
    let files = [("a\u{1b}[2J\u{202e}\u{e9}.ply".to_owned(), b"ply\nx".to_vec())];
    for archive in [zip_of(&files), tar_of(&files)] {
        let mut sequence = open(&archive, SceneFormat::Archive, 1).unwrap();
        let shown = "talk/a\\u{1b}[2J\\u{202e}\u{e9}.ply";
        assert_eq!(sequence.name(0), shown);
        let said = sequence.frame(0).unwrap_err().to_string();
        assert!(said.starts_with(&format!("{shown}: byte 4")), "{said:?}");
    }
}

#[test]
fn archives_that_stand_for_much_are_refused() {
    // 64 MiB of zeros in some ten kilobytes.
    let bomb = gzip(&tar_of(&[("a.splat".to_owned(), vec![0; 32 << 20])]));
    let error = open(&bomb, SceneFormat::Archive, 1).err().unwrap().to_string();
    assert!(error.contains("more than 64 times as long"), "{error}");
    let bomb = zip_of(&[("a.splat".to_owned(), vec![0; 32 << 20])]);
    let error = open(&bomb, SceneFormat::Archive, 1).unwrap().frame(0).unwrap_err().to_string();
    assert!(error.contains("max_memory"), "{error}");
}

/// A `.splatv` of records.
fn splatv(records: &[[u8; 64]]) -> Vec<u8> {
    let json = format!(r#"[{{"type":"splat","size":{},"cameras":[]}}]"#, records.len() * 64 + 1024);
    let head = [&[0x4b, 0x67, 0, 0], &(json.len() as u32).to_le_bytes()[..], json.as_bytes()].concat();
    [head, records.concat()].concat()
}

/// 1 in 16 bits, and a half, and 2.
const ONE: u16 = 0x3c00;
const HALF: u16 = 0x3800;
const TWO: u16 = 0x4000;

fn moving(centre: u16, width: u16) -> [u8; 64] {
    let mut record = [0; 64];
    record[..4].copy_from_slice(&5.0_f32.to_le_bytes());
    let mut put = |at: usize, half: u16| record[at..at + 2].copy_from_slice(&half.to_le_bytes());
    // No rotation; semi-axes 1; speed 2 along x, acceleration 1 along y; half a turn a length about z.
    for (at, half) in [
        (12, ONE),
        (20, ONE),
        (22, ONE),
        (24, HALF),
        (32, TWO),
        (40, ONE),
        (58, ONE),
        (60, centre),
        (62, width),
    ] {
        put(at, half);
    }
    record[28..32].copy_from_slice(&[255, 0, 128, 255]);
    record
}

#[test]
fn gaussians_follow_their_paths() {
    let mut unusable = moving(0, 0);
    unusable[13] = 0x7c;
    let file = splatv(&[moving(0, 0), unusable, moving(HALF, HALF), [0; 64]]);
    let mut sequence = open(&file, SceneFormat::Splatv, 4).unwrap();
    assert_eq!(sequence.len(), 4);
    let scene = sequence.frame(2).unwrap();
    assert_eq!(scene.notes, [Note::Unusable { count: 1 }]);
    let frame = scene.frame;
    assert_eq!(frame.len(), 2);
    // Half a length after its time, and at its time.
    assert_eq!(frame.position().each_ref().map(|plane| plane[0]), [6.0, 0.25, 0.0]);
    assert_eq!(frame.position()[0][1], 5.0);
    assert!((frame.rotation()[3][0] / frame.rotation()[0][0] - 0.5).abs() < 1e-6);
    let opacity =
        |frame: &GaussianFrame, row: usize| 1.0 / (1.0 + libm::exp(-f64::from(frame.opacity_logit()[row])));
    assert!(opacity(&frame, 0) > 0.99 && opacity(&frame, 1) > 0.99);
    let first = sequence.frame(0).unwrap().frame;
    assert!((opacity(&first, 1) - libm::exp(-1.0)).abs() < 1e-4);
    assert!((first.log_scale()[2][0] + std::f32::consts::LN_2).abs() < 1e-6);
}

#[test]
fn broken_splatv_is_refused() {
    let good = splatv(&[moving(0, 0)]);
    for length in 0..good.len() - 64 {
        assert!(open(&good[..length], SceneFormat::Splatv, 2).is_err(), "{length}");
    }
    let error = open(
        &good.iter().map(|byte| if *byte == b'p' { b'q' } else { *byte }).collect::<Vec<_>>(),
        SceneFormat::Splatv,
        2,
    );
    assert!(error.err().unwrap().to_string().starts_with("talk: byte 8: "));
    let limits = ReadLimits { max_memory: 100 };
    let options = SequenceOptions::default();
    let error = Sequence::of(Cursor::new(good), SceneFormat::Splatv, Path::new("a"), &limits, &options);
    assert!(error.err().unwrap().to_string().contains("max_memory"));
}

/// A stream of integers of one byte each.
fn stream(values: &[u8]) -> ([u8; 8], Vec<u8>) {
    let packed =
        if values.is_empty() { Vec::new() } else { compress_to_vec(values, CompressionLevel::Fastest) };
    let mut sizes = [0; 8];
    sizes[..4].copy_from_slice(&(values.len() as u32).to_le_bytes());
    sizes[4..].copy_from_slice(&(packed.len() as u32).to_le_bytes());
    (sizes, packed)
}

/// Two Gaussians in three frames, two groups: the second moves along x, the first stays.
pub(crate) fn splat4d() -> Vec<u8> {
    let still = [0b1000_0000, 0b1100_0000, 0b1100_0000, 0b1100_0000, 0b1100_0000].map(|mask| vec![mask]);
    // Differences from the row before, signs in the lowest bit.
    let base = [vec![2, 4, 6, 1, 0, 0], vec![3, 3, 3, 0, 0, 0], vec![255, 0, 128, 1, 2, 3], vec![200, 100]];
    let rotation = vec![255, 128, 128, 128, 128, 255, 128, 128];
    let section: Vec<u8> = still
        .into_iter()
        .chain(base)
        .chain([rotation])
        .flat_map(|values| {
            let (sizes, packed) = stream(&values);
            [&[0, 2, 1][..], &sizes, &packed].concat()
        })
        .collect();
    let group = |streams: &[(u8, Vec<u8>)]| {
        let (mut heads, mut contents) = ((streams.len() as u16).to_le_bytes().to_vec(), Vec::new());
        for (kind, values) in streams {
            let (sizes, packed) = stream(values);
            heads.extend([&[0, *kind, 1][..], &sizes].concat());
            contents.extend(packed);
        }
        [heads, contents].concat()
    };
    let groups = [group(&[(0, vec![2, 0, 0]), (1, vec![4, 0, 1])]), group(&[(0, vec![20, 0, 0])])];
    let json = |length: usize| {
        let first = 12 + length;
        let (second, third) = (first + section.len(), first + section.len() + groups[0].len());
        format!(
            r#"{{"n":2,"t":3,"fps":30.0,"gop":2,"steps":{{"pos":0.5,"scale_log":0.25,"rgb":1,"alpha":1,"rot":1,"base_pos":0.125,
            "base_scale_log":0.5}},"static_section":{{"offset":{first:6},"len":{}}},"gops":[
            {{"offset":{second:6},"len":{},"f0":0,"f1":1}},{{"offset":{third:6},"len":{},"f0":2,"f1":2}}]}}"#,
            section.len(),
            groups[0].len(),
            groups[1].len()
        )
    };
    let length = json(0).len();
    let json = json(length);
    assert_eq!(json.len(), length);
    [
        b"SP4D\x01\0\0\0".as_slice(),
        &(length as u32).to_le_bytes(),
        json.as_bytes(),
        &section,
        &groups.concat(),
    ]
    .concat()
}

#[test]
fn frames_of_splat4d_add_up_in_any_order() {
    let mut sequence = open(&splat4d(), SceneFormat::Splat4d, 1).unwrap();
    assert_eq!(sequence.len(), 3);
    // Multiples of the step: 1, 1 + 2, 10; of y 0, 0 + 0, 0, of z 0, -1.
    for (number, x, z) in [(0, 0.5, 0.0), (1, 1.5, -0.5), (2, 5.0, 0.0), (1, 1.5, -0.5), (0, 0.5, 0.0)] {
        let frame = sequence.frame(number).unwrap().frame;
        assert_eq!([frame.position()[0][1], frame.position()[2][1]], [x, z], "frame {number}");
        assert_eq!(frame.position().each_ref().map(|plane| plane[0]), [0.125, 0.25, 0.375]);
        assert_eq!(frame.log_scale()[0], [-1.0, -1.0]);
        assert!(frame.rotation()[0][0] > 0.99 && frame.rotation()[1][1] > 0.99);
        assert!(frame.dc()[0][0] > 1.7 && frame.dc()[1][0] < -1.7);
    }
}

#[test]
fn broken_splat4d_is_refused() {
    let good = splat4d();
    let read_all = |bytes: &[u8]| -> Result<(), SceneError> {
        let mut sequence = open(bytes, SceneFormat::Splat4d, 1)?;
        (0..sequence.len()).try_for_each(|frame| sequence.frame(frame).map(drop))
    };
    assert!(read_all(&good).is_ok());
    for length in 0..good.len() {
        assert!(read_all(&good[..length]).is_err(), "{length}");
    }
    for at in 0..good.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut changed = good.clone();
            changed[at] ^= flip;
            let _ = read_all(&changed);
        }
    }
}

#[test]
fn splat_inside_of_an_archive_is_known_by_its_name() {
    let archive = gzip(&tar_of(&[("a.splat".to_owned(), splat::write(&small_frame()).unwrap())]));
    let mut head = Vec::new();
    flate2::read::GzDecoder::new(archive.as_slice()).take(4).read_to_end(&mut head).unwrap();
    assert_eq!(open(&archive, SceneFormat::Archive, 1).unwrap().frame(0).unwrap().frame.len(), 3);
}
