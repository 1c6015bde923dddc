//! Values of elements in words.

use crate::syntax::{FrameType, Profile, Row, ShMode, TransformKind, UnitType};

/// The value of an element from its bytes, with what it stands for where it is a code.
pub(super) fn of_row(record: &str, row: &Row, raw: &[u8]) -> String {
    let width = row.bytes.checked_div(row.places).unwrap_or(1).max(1);
    let numbers: Vec<u64> = raw.chunks(width).map(little_endian).collect();
    let text: Vec<String> = numbers.iter().map(|number| one(row, *number)).collect();
    match (numbers.as_slice(), text.as_slice()) {
        ([number], [text]) => match named(record, row.name, *number) {
            Some(name) => format!("{text} ({name})"),
            None => text.clone(),
        },
        _ => format!("[{}]", text.join(", ")),
    }
}

/// How many values there are and between which two they lie.
pub(super) fn summary<T: Ord + core::fmt::Display>(values: &[T]) -> String {
    match (values.iter().min(), values.iter().max()) {
        (Some(min), Some(max)) => format!("{} values, {min} to {max}", values.len()),
        _ => "no values".to_owned(),
    }
}

fn little_endian(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, byte| number.wrapping_shl(8) | u64::from(*byte))
}

fn one(row: &Row, number: u64) -> String {
    if row.type_name.starts_with("f32") {
        return u32::try_from(number).map(f32::from_bits).unwrap_or_default().to_string();
    }
    if row.type_name == "i8" {
        return u8::try_from(number).map(u8::cast_signed).unwrap_or_default().to_string();
    }
    match row.name {
        "signature" => format!("{number:02X}"),
        "header_crc" | "payload_crc" => format!("{number:#010x}"),
        "header_check" => format!("{number:#06x}"),
        "refinement_digest" | "carried_digest" => format!("{number:#018x}"),
        _ => number.to_string(),
    }
}

/// What a code stands for.
fn named(record: &str, element: &str, number: u64) -> Option<&'static str> {
    let code = u8::try_from(number).ok()?;
    match (record, element) {
        ("file_header", "profile") => Profile::from_code(code).map(Profile::name),
        ("unit_header", "unit_type") => Some(UnitType::from_code(code).name()),
        ("unit_header", "unit_flags") => flags(code, &["critical"]),
        ("sequence_parameters", "sequence_flags") => {
            flags(code, &["canonical_axes", "antialiased", "canonical_axes and antialiased"])
        }
        ("gop_header", "gop_structure") => match code {
            0 => Some("all intra"),
            1 => Some("predicted"),
            _ => None,
        },
        ("frame_header", "frame_type") => FrameType::from_code(code).map(FrameType::name),
        ("frame_header", "sh_transform_id") => (code == crate::syntax::NO_TRANSFORM).then_some("none"),
        ("transform", "transform_kind") => TransformKind::from_code(code).map(TransformKind::name),
        ("refinement" | "increment", "sh_mode") => ShMode::from_code(code).map(ShMode::name),
        _ => None,
    }
}

/// The name of a set of flags; `names` holds those of 1, 2, ...
fn flags(code: u8, names: &[&'static str]) -> Option<&'static str> {
    usize::from(code).checked_sub(1).and_then(|place| names.get(place)).copied()
}
