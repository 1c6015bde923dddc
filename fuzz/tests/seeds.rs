//! Where fuzzing starts. `BLESS=1 cargo test --test seeds` writes the seeds again, after a change of the bitstream;
//! without it, they are checked to be still good.

use arbitrary::Unstructured;
use splatstream_decoder::process::Options;
use splatstream_decoder::stream::decode_stream;
use splatstream_format::arbitrary_stream as random;
use splatstream_format::payload::{Index, OperatingPoints, write_increment};
use splatstream_format::syntax::{
    EndOfStream, FrameHeader, GopHeader, IncrementHeader, IndexEntry, OperatingPointEntry, Profile,
    SequenceParameters, TransformKind, UnitId,
};
use splatstream_format::unit::{write_file_header, write_unit};
use splatstream_fuzz::records::{LAWS, SEQUENCE};
use splatstream_fuzz::{scene, streams};
use splatstream_gaussians::random::SplitMix64;
use splatstream_stream::package::{Options as PackageOptions, Package};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

#[path = "seeds/contexts.rs"]
mod contexts;
#[path = "seeds/learned.rs"]
mod learned;
#[path = "seeds/packed.rs"]
mod packed;
#[path = "seeds/scenes.rs"]
mod scenes;
#[path = "seeds/valid_streams.rs"]
mod valid_streams;

/// The seeds of a target: they are part of every clone.
const MAX_BYTES: usize = 50_000;

fn folder(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds").join(target)
}

fn bless(target: &str, seeds: &[(String, Vec<u8>)]) {
    if std::env::var_os("BLESS").is_none() {
        return;
    }
    let folder = folder(target);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    for (name, bytes) in seeds {
        std::fs::write(folder.join(name).with_extension("bin"), bytes).unwrap();
    }
}

fn saved(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let files = std::fs::read_dir(folder(target)).unwrap().map(|entry| entry.unwrap().path());
    let files: Vec<_> = files.map(|path| (path.clone(), std::fs::read(path).unwrap())).collect();
    let bytes: usize = files.iter().map(|(_, bytes)| bytes.len()).sum();
    assert!(bytes <= MAX_BYTES, "the seeds of {target} take {bytes} bytes");
    files
}

/// Bytes without pattern, the same on every machine.
fn noise(seed: u64, length: usize) -> Vec<u8> {
    let mut random = SplitMix64::new(seed);
    (0..length).map(|_| random.bits() as u8).collect()
}

#[test]
fn streams_decode_with_all_their_digests() {
    if std::env::var_os("BLESS").is_some() {
        bless("units", &valid_streams::all());
    }
    let saved = saved("units");
    assert_eq!(saved.len(), streams::ALL.len(), "src/streams.rs names them all");
    for (path, bytes) in saved {
        let summary = decode_stream(&bytes, &Options::default(), |_, _| ControlFlow::Continue(()));
        assert_eq!(summary.errors, [], "{}: write the seeds again, with BLESS=1", path.display());
    }
}

#[test]
fn edits_are_seeds_of_decode() {
    let edits = |count: usize| {
        (0..streams::ALL.len() as u8).map(move |choice| {
            let edits = if count == 0 { Vec::new() } else { noise(u64::from(choice), count * 5) };
            (format!("{count}-edits-of-{choice}"), [vec![choice], edits].concat())
        })
    };
    bless("decode", &edits(0).chain(edits(1)).chain(edits(4)).collect::<Vec<_>>());
    assert_eq!(saved("decode").len(), 3 * streams::ALL.len());
}

#[test]
fn streams_and_repetitions_are_seeds_of_cost() {
    let seeds = (0..streams::ALL.len() as u8).map(|stream| (format!("{stream}"), vec![stream, 0, stream]));
    bless("cost", &seeds.collect::<Vec<_>>());
    assert_eq!(saved("cost").len(), streams::ALL.len());
}

/// Noise is a seed of targets that make something of any bytes: long enough that they have what they want.
fn noise_is_seed_of(target: &str, lengths: impl Iterator<Item = usize>) {
    let seeds: Vec<_> =
        lengths.map(|length| (format!("{length}-bytes"), noise(length as u64 + 500, length))).collect();
    bless(target, &seeds);
    let saved = saved(target);
    assert_eq!(saved.len(), seeds.len());
}

#[test]
fn noise_is_coded_and_encoded() {
    noise_is_seed_of("entropy", (1..=8).map(|part| part * 500));
    noise_is_seed_of("synthetic", (1..=16).map(|part| part * 100));
    noise_is_seed_of("encode", (1..=12).map(|part| part * 250));
}

#[test]
fn packages_are_seeds() {
    let mut seeds = Vec::new();
    for stream in 0..streams::ALL.len() as u8 {
        seeds.push((format!("stream-{stream}"), vec![0, stream]));
        seeds.push((format!("files-{stream}"), vec![1, stream]));
        let edits = [vec![1, stream + 128], noise(u64::from(stream) + 900, 20)].concat();
        seeds.push((format!("edits-{stream}"), edits));
    }
    let plain = Package::of(streams::ALL[0], &PackageOptions::default(), &splatstream_fuzz::LIMITS).unwrap();
    let mut file = vec![2];
    plain.write("s0.mp4", &mut file).unwrap();
    seeds.push(("file".to_owned(), file));
    seeds.push(("manifest".to_owned(), [&[3], plain.manifest.to_json().as_bytes()].concat()));
    bless("packages", &seeds);
    assert_eq!(saved("packages").len(), seeds.len());
}

#[test]
fn scene_files_read() {
    bless("scene", &scenes::all());
    for (path, bytes) in saved("scene") {
        let (choice, input) = bytes.split_first().unwrap();
        let form = scene::FORMS[usize::from(*choice)];
        let read = (form.read)(&form.file(input), &scene::LIMITS);
        assert!(!read.unwrap_or_else(|error| panic!("{}: {error}", path.display())).is_empty());
    }
}

#[test]
fn records_are_seeds() {
    let mut seeds = Vec::new();
    for seed in 1..=2_u64 {
        let head = noise(seed + 100, SEQUENCE);
        let sequence = random::sequence_parameters(&mut Unstructured::new(&head), Profile::Dynamic).unwrap();
        let records = fixed_records(&head, &sequence).into_iter().chain(payloads(seed, &sequence));
        for (name, record) in records {
            seeds.push((format!("{name}-{seed}"), [choice(name), head.clone(), record].concat()));
        }
    }
    for (index, section) in valid_streams::model_sections().into_iter().enumerate() {
        seeds.push((format!("models-{index}"), [choice("models"), vec![0; SEQUENCE], section].concat()));
    }
    for (name, _) in LAWS {
        assert!(seeds.iter().any(|(seed, _)| seed.starts_with(name)), "{name} has no seed");
    }
    bless("records", &seeds);
    assert_eq!(saved("records").len(), seeds.len());
}

/// The byte that chooses a law, and where the record stands.
fn choice(name: &str) -> Vec<u8> {
    let law = LAWS.iter().position(|(known, _)| *known == name).unwrap();
    vec![law as u8, 0, 0, 0, 0]
}

fn fixed_records(head: &[u8], sequence: &SequenceParameters) -> [(&'static str, Vec<u8>); 12] {
    let mut unit = Vec::new();
    write_unit(&mut unit, UnitId::of_increment(3, 1), &[]).unwrap();
    let entry = OperatingPointEntry {
        spatial_layer: 1,
        temporal_layer: 2,
        refinement: 3,
        reserved_zero: 0,
        frame_count: 4,
        gaussian_count: 5,
        byte_count: 6,
    };
    let codebook = random::codebook(&mut Unstructured::new(head), 1, 2).unwrap();
    [
        ("file-header", write_file_header(Profile::Dynamic, 2).unwrap()),
        ("unit-header", unit),
        ("sequence-parameters", sequence.to_bytes().unwrap()),
        ("gop-header", GopHeader::predicted(1, 8, 2).to_bytes().unwrap()),
        ("frame-header", FrameHeader::intra(1, Some(2), 300).to_bytes().unwrap()),
        ("codebook-header", codebook.header.to_bytes().unwrap()),
        ("index-header", vec![2, 0, 0, 0]),
        ("index-entry", IndexEntry { frame: 1, reserved_zero: 0, offset: 112 }.to_bytes().unwrap()),
        ("end", EndOfStream { frame_count: 1, unit_count: 7, index_offset: 0 }.to_bytes().unwrap()),
        ("operating-points-header", vec![1, 0, 0, 0]),
        ("operating-point", entry.to_bytes().unwrap()),
        ("weights-header", vec![1]),
    ]
}

/// One payload of each kind of more than one record.
fn payloads(seed: u64, sequence: &SequenceParameters) -> Vec<(&'static str, Vec<u8>)> {
    let noise = noise(seed + 200, 3000);
    let mut u = Unstructured::new(&noise);
    let kind = if sequence.sh_degree > 0 { TransformKind::Sh } else { TransformKind::Dc };
    let transform = random::transform(&mut u, 1, kind, sequence).unwrap();
    let codebook = random::codebook(&mut u, 2, 5).unwrap();
    let entries = (0..2).map(|gop| IndexEntry { frame: gop, reserved_zero: 0, offset: 112 + u64::from(gop) });
    let increment = IncrementHeader { parent_count: 300, compensation_opacity: 3, ..IncrementHeader::PLAIN };
    vec![
        ("scene-description", random::scene_description(&mut u).unwrap().to_bytes().unwrap()),
        ("transform", transform.to_bytes(sequence).unwrap()),
        ("codebook", codebook.to_bytes().unwrap()),
        ("weights", random::weights(&mut u).unwrap().to_bytes().unwrap()),
        ("frame", FrameHeader::intra(1, None, 300).to_bytes().unwrap()),
        ("increment", write_increment(&increment.with_flags(), sequence, &[]).unwrap()),
        ("index", Index { entries: entries.collect() }.to_bytes().unwrap()),
        ("operating-points", OperatingPoints { entries: Vec::new() }.to_bytes().unwrap()),
    ]
}
