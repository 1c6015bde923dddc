//! The dictionaries of libFuzzer: what stands in streams and in scene files, and is hard to hit byte by byte.
//! `BLESS=1 cargo test --test dictionaries` writes them again; without it, they are checked to be up to date.

use splatstream_files::ply;
use splatstream_format::Limits;
use splatstream_format::entropy::STATE_LOW;
use splatstream_format::payload::write_leb128;
use splatstream_format::syntax::{
    EndOfStream, FrameHeader, GopHeader, IncrementHeader, Profile, Row, SIGNATURE, TABLES, UnitHeader,
    UnitId, UnitType,
};
use splatstream_format::unit::{write_file_header, write_unit};
use splatstream_gaussians::{GaussianFrame, Planes};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Tokens by name.
type Tokens = BTreeMap<String, Vec<u8>>;

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

#[track_caller]
fn is_up_to_date(name: &str, head: &str, tokens: &Tokens) {
    let escaped = |bytes: &[u8]| bytes.iter().map(|byte| format!("\\x{byte:02x}")).collect::<String>();
    let lines = tokens.iter().map(|(name, bytes)| format!("{name}=\"{}\"\n", escaped(bytes)));
    let made = format!("# {head} Written by tests/dictionaries.rs.\n{}", lines.collect::<String>());
    let path = here("dictionaries").join(name).with_extension("dict");
    if std::env::var_os("BLESS").is_some() {
        std::fs::create_dir_all(here("dictionaries")).unwrap();
        std::fs::write(&path, &made).unwrap();
    }
    let saved = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(saved == made, "{}: write it again, with BLESS=1", path.display());
}

#[test]
fn the_dictionary_of_streams_is_up_to_date() {
    let tokens = [records(), units(), limits(), numbers(), ranges()].into_iter().flatten().collect();
    is_up_to_date(
        "stream",
        "Of the syntax tables, the ranges of their elements, the unit types and the limits.",
        &tokens,
    );
}

#[test]
fn the_dictionary_of_scene_files_is_up_to_date() {
    let signatures: [(&str, &[u8]); 5] = [
        ("zip_entry", b"PK\x03\x04"),
        ("zip_directory", b"PK\x01\x02"),
        ("zip_end", b"PK\x05\x06"),
        ("gzip", b"\x1f\x8b\x08"),
        ("spz", b"NGSP"),
    ];
    let signatures = signatures.map(|(name, bytes)| (name.to_owned(), bytes.to_vec()));
    let tokens = words_of_seeds().into_iter().chain(ply_lines()).chain(signatures).collect();
    is_up_to_date(
        "scene",
        "Of the headers that are written, the words of the seeds and the signatures.",
        &tokens,
    );
}

/// Records as short as they are, and the start of a stream.
fn records() -> Tokens {
    let mut tokens = Tokens::from([("signature".into(), SIGNATURE.to_vec())]);
    for profile in [Profile::Intra, Profile::Dynamic] {
        tokens.insert(format!("file_header_{}", profile.name()), write_file_header(profile, 1).unwrap());
    }
    let end = EndOfStream { frame_count: 0, unit_count: 1, index_offset: 0 };
    tokens.insert("gop_header_intra".into(), GopHeader::intra(0, 1).to_bytes().unwrap());
    tokens.insert("gop_header_predicted".into(), GopHeader::predicted(0, 2, 0).to_bytes().unwrap());
    tokens.insert("frame_header".into(), FrameHeader::intra(0, None, 0).to_bytes().unwrap());
    tokens.insert("end".into(), end.to_bytes().unwrap());
    for (bit, name) in IncrementHeader::FLAG_NAMES.into_iter().enumerate() {
        tokens.insert(format!("increment_{name}"), (1_u16 << bit).to_le_bytes().to_vec());
    }
    tokens
}

/// A unit of each type without a payload, and its type with its flags.
fn units() -> Tokens {
    let mut tokens = Tokens::new();
    for unit_type in (1..=11).chain([127, 128]).map(UnitType::from_code) {
        let mut unit = Vec::new();
        write_unit(&mut unit, UnitId::stream(unit_type), &[]).unwrap();
        let name = format!("unit_{}_{}", unit_type.code(), unit_type.name());
        tokens.insert(format!("{name}_flags"), unit[..UnitHeader::TABLE.offset("spatial_layer")].to_vec());
        tokens.insert(name, unit);
    }
    tokens
}

/// What annex A allows, and one more.
fn limits() -> Tokens {
    let mut tokens = Tokens::from([("state".into(), STATE_LOW.to_le_bytes().to_vec())]);
    for level in Limits::LEVELS {
        let Limits { max_gaussians, max_payload, max_units, max_codebook_values, max_cells, .. } =
            Limits::of_level(level);
        let named = [
            ("max_gaussians", max_gaussians),
            ("max_payload", max_payload),
            ("max_units", max_units),
            ("max_codebook_values", max_codebook_values),
            ("max_cells", max_cells),
        ];
        for (name, value) in named {
            tokens.extend(beside(&format!("{name}_of_level_{level}"), value.into(), 4));
        }
    }
    tokens
}

/// leb128 at the ends of each length, and too long.
fn numbers() -> Tokens {
    let mut tokens = Tokens::from([("leb128_too_long".into(), vec![0x80, 0])]);
    for bits in [7, 14, 21, 28] {
        for value in [(1 << bits) - 1, 1 << bits] {
            let mut bytes = Vec::new();
            write_leb128(value, &mut bytes);
            tokens.insert(format!("leb128_{value}"), bytes);
        }
    }
    let mut most = Vec::new();
    write_leb128(u32::MAX, &mut most);
    tokens.insert("leb128_most".into(), most);
    tokens
}

/// The ends of the ranges that clause 6 gives elements of two bytes and more, and what lies beyond.
fn ranges() -> Tokens {
    let clause_6 = std::fs::read_to_string(here("../spec/06-semantics.md")).unwrap();
    let mut tokens = Tokens::new();
    let rows: Vec<&Row> = TABLES.iter().flat_map(|table| table.rows).collect();
    let wide = rows.into_iter().filter(|row| row.bytes / row.count > 1);
    for (row, line) in wide.flat_map(|row| clause_6.lines().map(move |line| (row, line))) {
        let Some(range) = line.strip_prefix(&format!("| `{}` |", row.name)) else { continue };
        let cell = range.trim_end().trim_end_matches('|').rsplit('|').next().unwrap_or_default();
        let ends = cell.trim().split(',').next().unwrap_or_default().split_once("..");
        let Some((least, most)) = ends.and_then(|(least, most)| Some((number(least)?, number(most)?))) else {
            continue;
        };
        for (end, value) in [("least", least), ("most", most)] {
            let name = format!("{}_{end}", row.name);
            if row.type_name.starts_with("f32") {
                tokens.extend(beside(&name, i64::from((value as f32).to_bits()), 4));
            } else {
                tokens.extend(beside(&name, value as i64, row.bytes / row.count));
            }
        }
    }
    assert!(tokens.len() > 40, "clause 6 gives ranges as it did");
    tokens
}

/// `-2^40`, `2^32-1`, `16`.
fn number(text: &str) -> Option<f64> {
    let (text, minus_one) = text.trim().strip_suffix("-1").map_or((text.trim(), 0.0), |text| (text, 1.0));
    let (text, sign) = text.strip_prefix('-').map_or((text, 1.0), |text| (text, -1.0));
    let magnitude = match text.split_once('^') {
        Some((base, exponent)) => base.parse::<f64>().ok()?.powi(exponent.parse().ok()?),
        None => text.parse().ok()?,
    };
    Some(sign * magnitude - minus_one)
}

/// A value and its neighbours in so many bytes.
fn beside(name: &str, value: i64, bytes: usize) -> [(String, Vec<u8>); 3] {
    [("less", -1), ("is", 0), ("more", 1)]
        .map(|(side, by)| (format!("{name}_{side}"), value.wrapping_add(by).to_le_bytes()[..bytes].to_vec()))
}

/// The lines of a PLY header with every property.
fn ply_lines() -> Tokens {
    let planes = Planes { sh: vec![Vec::new(); 45], ..Planes::default() };
    let written = ply::write(&GaussianFrame::from_planes(3, planes).unwrap());
    let header = String::from_utf8(written).unwrap();
    header
        .lines()
        .enumerate()
        .map(|(index, line)| (format!("ply_{index}"), format!("{line}\n").into_bytes()))
        .collect()
}

/// Words of five letters and more that stand in seeds: property names, keys of JSON, names of files.
fn words_of_seeds() -> Tokens {
    let mut tokens = Tokens::new();
    for entry in std::fs::read_dir(here("seeds/scene")).unwrap() {
        let bytes = std::fs::read(entry.unwrap().path()).unwrap();
        let is_letter = |byte: &u8| matches!(byte, b'a'..=b'z' | b'_' | b'.');
        for word in bytes.split(|byte| !is_letter(byte)).filter(|word| word.len() > 4) {
            let name = String::from_utf8(word.to_vec()).unwrap().replace('.', "_");
            tokens.insert(format!("word_{name}"), word.to_vec());
        }
    }
    tokens
}
