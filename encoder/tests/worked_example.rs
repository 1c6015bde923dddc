//! Annexes D and E: small streams, element by element. These tests write the annexes, and fail where they differ.
//!
//! `BLESS=1 cargo test -p splatstream-encoder --test worked_example` writes streams and annexes again.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a panic is a failed test"
)]

use splatstream_decoder::operating_point::{OperatingPoint, extract};
use splatstream_decoder::output::to_gaussians;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_encoder::{Preset, Settings, Steps, encode};
use splatstream_format::Limits;
use splatstream_format::inspect::{Element, inspect};
use splatstream_format::syntax::SequenceParameters;
use splatstream_gaussians::{GaussianFrame, Planes};
use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

#[path = "worked_example/symbols.rs"]
mod symbols;
#[path = "worked_example/temporal/mod.rs"]
mod temporal;

fn spec(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../spec").join(name)
}

/// Four Gaussians: a large disc, two smaller ones beside it, a needle.
fn scene() -> GaussianFrame {
    let planes = Planes {
        position: [vec![0.0, 1.0, 1.0, 2.0], vec![0.0, 0.5, 0.5, 1.0], vec![0.0, 0.0, 0.25, 2.0]],
        log_scale: [vec![-1.0, -2.0, -2.5, -4.0], vec![-1.0, -2.5, -2.5, -1.5], vec![-4.0, -4.0, -4.0, -4.0]],
        rotation: [
            vec![1.0, 0.9, 1.0, 0.6],
            vec![0.0, 0.3, 0.0, 0.0],
            vec![0.0, 0.1, 0.0, 0.8],
            vec![0.0, 0.3, 0.0, 0.0],
        ],
        opacity_logit: vec![4.0, 2.0, 0.0, -1.0],
        dc: [vec![0.5, -0.2, 0.1, 1.0], vec![0.4, -0.3, 0.0, 0.8], vec![0.1, -0.4, 0.3, 0.6]],
        sh: Vec::new(),
    };
    GaussianFrame::from_planes(0, planes).unwrap()
}

fn stream() -> Vec<u8> {
    // Steps of its own: the annex does not change with what a quality is.
    let steps =
        Steps { position_bits: 12.0, log_scale: 0.25, rotation: 0.04, opacity: 0.8, dc: 0.1, sh: 0.4 };
    let settings =
        Settings { preset: Preset::Fast, steps, refinements: vec![50, 100], ..Settings::default() };
    let mut bytes = Vec::new();
    encode(&mut vec![scene()], &settings, &mut bytes, &mut |_, _| {}).unwrap();
    bytes
}

fn decoded(bytes: &[u8]) -> (SequenceParameters, DecodedFrame) {
    let mut result = None;
    let summary = decode_stream(bytes, &Options::default(), |sequence, frame| {
        result = Some((*sequence, frame));
        ControlFlow::Continue(())
    });
    assert_eq!(summary.verdict(), None);
    result.unwrap()
}

#[test]
fn annex_d_is_the_stream_byte_by_byte() {
    let bytes = stream();
    check("d-worked-example.md", &annex(&bytes), "worked-example.gss", &bytes);
}

#[test]
fn annex_e_is_the_stream_increment_by_increment() {
    let (bytes, common, frames) = temporal::written();
    let annex = temporal::annex(&bytes, &common, &frames);
    check("e-worked-temporal-example.md", &annex, "worked-temporal-example.gss", &bytes);
}

/// Compares an annex and its stream with the files of the specification, or writes them.
fn check(name: &str, annex: &str, data: &str, bytes: &[u8]) {
    let data = spec("data").join(data);
    if std::env::var_os("BLESS").is_some() {
        std::fs::create_dir_all(spec("data")).unwrap();
        std::fs::write(&data, bytes).unwrap();
        std::fs::write(spec(name), annex).unwrap();
    }
    let advice = "the encoder or the text changed: read the difference, then run with BLESS=1";
    assert!(std::fs::read(&data).unwrap() == bytes, "{advice}");
    assert!(std::fs::read_to_string(spec(name)).unwrap() == annex, "{advice}");
}

fn annex(bytes: &[u8]) -> String {
    let mut text = String::from(
        "# Annex D Worked example\n\n\
         Informative. Every byte of a small stream with the element it belongs to, its blocks symbol by symbol, and \
         what comes out. The stream is `data/worked-example.gss`. This annex is written by a test of the reference \
         encoder, which fails when stream and annex differ. Where a table here and clauses 2 to 9 disagree, the \
         clauses are right.\n\n",
    );
    scene_table(&mut text);
    text.push_str("\n## D.2 The file\n");
    hexadecimal(&mut text, bytes, 0);
    text.push_str(
        "\n## D.3 Every element\n\nOffsets are in bytes from the start of the file; `+3` is bit 3 of the byte, counted \
         from the least significant. The elements follow each other without gaps.\n",
    );
    elements(&mut text, bytes, |_| true, |_| true);
    symbols::blocks(&mut text, bytes);
    planes(&mut text, bytes);
    extraction(&mut text, bytes);
    text
}

fn scene_table(text: &mut String) {
    text.push_str(
        "## D.1 The scene\n\nFour Gaussians, SH degree 0, as the encoder was given them. Log-scales and \
         quaternion are not yet in canonical form.\n\n\
         | Gaussian | Position | Log-scale | Quaternion w, x, y, z | Opacity logit | dc |\n|---|---|---|---|---|---|\n",
    );
    let scene = scene();
    let row = |planes: &[Vec<f32>], i: usize| {
        planes.iter().map(|plane| plane[i].to_string()).collect::<Vec<_>>().join(", ")
    };
    for i in 0..scene.len() {
        let parts = [
            row(scene.position(), i),
            row(scene.log_scale(), i),
            row(scene.rotation(), i),
            scene.opacity_logit()[i].to_string(),
            row(scene.dc(), i),
        ];
        writeln!(text, "| {i} | {} |", parts.join(" | ")).unwrap();
    }
}

/// Sixteen bytes a line; the first stands at offset `start`.
fn hexadecimal(text: &mut String, bytes: &[u8], start: usize) {
    text.push_str("\n```text\n");
    for (line, part) in bytes.chunks(16).enumerate() {
        let digits: Vec<String> = part.iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(text, "{:04x}  {}", start + line * 16, digits.join(" ")).unwrap();
    }
    text.push_str("```\n");
}

/// A byte offset, and the bit within the byte if that is not 0.
fn offset(bit: u64) -> String {
    if bit.is_multiple_of(8) { format!("{:#06x}", bit / 8) } else { format!("{:#06x}+{}", bit / 8, bit % 8) }
}

fn width(bits: u64) -> String {
    if bits.is_multiple_of(8) { format!("{} B", bits / 8) } else { format!("{bits} b") }
}

/// A table per unit, of the types and records that are chosen.
fn elements(
    text: &mut String,
    bytes: &[u8],
    shows_unit: impl Fn(u8) -> bool,
    shows_record: impl Fn(&str) -> bool,
) {
    let mut list: Vec<Element> = Vec::new();
    assert_eq!(inspect(bytes, &Limits::default(), &mut |element| list.push(element)), None);
    let (mut units, mut end, mut shows) = (0, 0, shows_unit(0));
    for element in &list {
        let Element { at_bit, bits, record, name, value, meaning, .. } = element;
        assert_eq!(*at_bit, end, "elements follow each other without gaps");
        end = at_bit + bits;
        let starts_unit = *record == "unit_header" && name == "unit_type";
        if starts_unit {
            shows = shows_unit(bytes[(at_bit / 8) as usize]);
        }
        if shows && (*at_bit == 0 || starts_unit) {
            let title = if starts_unit { format!("Unit {units}: {value}") } else { "file_header".to_owned() };
            let head = "| Offset | Width | Record | Element | Value | Meaning |\n|---|---|---|---|---|---|";
            write!(text, "\n### {title}\n\n{head}\n").unwrap();
        }
        units += u32::from(starts_unit);
        if shows && shows_record(record) {
            let (offset, width) = (offset(*at_bit), width(*bits));
            writeln!(text, "| {offset} | {width} | {record} | `{name}` | {value} | {meaning} |").unwrap();
        }
    }
    assert_eq!(end, bytes.len() as u64 * 8, "every byte is named");
}

fn planes(text: &mut String, bytes: &[u8]) {
    let (sequence, frame) = decoded(bytes);
    let gaussians = to_gaussians(frame.planes.clone(), &sequence).unwrap();
    let columns: String = (0..gaussians.len()).map(|i| format!(" Gaussian {i} |")).collect();
    let rule = "---|".repeat(gaussians.len());
    text.push_str("\n## D.5 Canonical planes and output\n\nGaussians in coded order.\n\n");
    writeln!(text, "| Plane |{columns}\n|---|{rule}").unwrap();
    let positions = frame.planes.position.iter().map(|plane| plane.iter().map(|q| q.to_string()).collect());
    let others = frame.planes.signed_planes().map(|plane| plane.iter().map(|q| q.to_string()).collect());
    for (number, plane) in positions.chain(others).enumerate() {
        let plane: Vec<String> = plane;
        writeln!(text, "| {number} | {} |", plane.join(" | ")).unwrap();
    }
    let digest = frame.digest.unwrap();
    write!(text, "\nThe digest of the frame is `{digest:#018x}`.\n\n| Output |{columns}\n|---|{rule}\n")
        .unwrap();
    let mut row = |name: String, plane: &[f32]| {
        let cells: Vec<String> = plane.iter().map(|v| format!("{v} (`{:08x}`)", v.to_bits())).collect();
        writeln!(text, "| {name} | {} |", cells.join(" | ")).unwrap();
    };
    let groups: [(&str, &[Vec<f32>]); 4] = [
        ("position x, y, z", gaussians.position()),
        ("log_scale", gaussians.log_scale()),
        ("rotation w, x, y, z", gaussians.rotation()),
        ("dc red, green, blue", gaussians.dc()),
    ];
    for (name, group) in groups {
        for (index, plane) in group.iter().enumerate() {
            row(format!("{name} [{index}]"), plane);
        }
    }
    row("opacity".to_owned(), gaussians.opacity_logit());
}

fn extraction(text: &mut String, bytes: &[u8]) {
    let point = OperatingPoint { spatial: 0, temporal: 0, refinement: 0 };
    let small = extract(bytes, point, &Limits::default()).unwrap();
    let (_, frame) = decoded(&small);
    write!(
        text,
        "\n## D.6 Extraction at {point}\n\nThe extracted stream has {} bytes, {} Gaussians and the frame digest \
         `{:#018x}`. It is the file without the increment of refinement 1, and with these last bytes:\n",
        small.len(),
        frame.planes.len(),
        frame.digest.unwrap()
    )
    .unwrap();
    let same = small.iter().zip(bytes).take_while(|(a, b)| a == b).count() / 16 * 16;
    hexadecimal(text, &small[same..], same);
}
