//! Values of elements in words.

use crate::payload::{ColourSpace, Sorting, UpAxis, leb128};
use crate::syntax::{FrameType, IncrementHeader, Profile, ShMode, TransformKind, UnitType};

/// The value of an element of a type from its bytes, with what it stands for where it is a code.
pub(super) fn of(record: &str, element: &str, type_name: &str, raw: &[u8]) -> String {
    if (record, element) == ("scene_description", "title") {
        return format!("{:?}", String::from_utf8_lossy(raw));
    }
    let base = type_name.split('[').next().unwrap_or_default();
    if base == "leb128" {
        return leb128(raw, 0, "", "")
            .map_or_else(|_| "no number".to_owned(), |(number, _)| number.to_string());
    }
    let bits: usize = base.trim_start_matches(['u', 'i', 'f']).parse().unwrap_or(8);
    let numbers: Vec<u64> = raw.chunks(bits.div_ceil(8).max(1)).map(little_endian).collect();
    let text: Vec<String> = numbers.iter().map(|number| one(base, element, *number)).collect();
    match (numbers.as_slice(), text.as_slice(), type_name == base) {
        ([number], [text], true) => match named(record, element, *number) {
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

fn one(base: &str, element: &str, number: u64) -> String {
    if base == "f32" {
        return u32::try_from(number).map(f32::from_bits).unwrap_or_default().to_string();
    }
    match base {
        "i8" => return u8::try_from(number).map(u8::cast_signed).unwrap_or_default().to_string(),
        "i16" => return u16::try_from(number).map(u16::cast_signed).unwrap_or_default().to_string(),
        "i32" => return u32::try_from(number).map(u32::cast_signed).unwrap_or_default().to_string(),
        _ => {}
    }
    match element {
        "signature" => format!("{number:02X}"),
        "header_crc" | "payload_crc" => format!("{number:#010x}"),
        "header_check" => format!("{number:#06x}"),
        "refinement_digest" | "carried_digest" => format!("{number:#018x}"),
        _ => number.to_string(),
    }
}

/// What a code or a set of flags stands for.
fn named(record: &str, element: &str, number: u64) -> Option<String> {
    const NETWORK_FLAGS: [&str; 4] = ["full_attention", "gated", "normalised", "knn_base"];
    const DESCRIPTION_FLAGS: [&str; 5] =
        ["has_metres", "has_background", "has_bounds", "has_title", "has_cameras"];
    match (record, element) {
        ("unit_header", "unit_flags") => return flags(number, &["critical"]),
        ("sequence_parameters", "sequence_flags") => {
            return flags(number, &["canonical_axes", "antialiased", "whole_anchor"]);
        }
        ("frame_header", "frame_flags") => return flags(number, &["has_carried_digest", "has_cells"]),
        ("increment", "increment_flags") => return flags(number, &IncrementHeader::FLAG_NAMES),
        ("scene_description", "description_flags") => return flags(number, &DESCRIPTION_FLAGS),
        ("network", "network_flags") => return flags(number, &NETWORK_FLAGS),
        _ => {}
    }
    let code = u8::try_from(number).ok()?;
    let name = match (record, element) {
        ("file_header", "profile") => Profile::from_code(code).map(Profile::name),
        ("unit_header", "unit_type") => Some(UnitType::from_code(code).name()),
        ("gop_header", "gop_structure") => match code {
            0 => Some("all intra"),
            1 => Some("predicted"),
            _ => None,
        },
        ("frame_header", "frame_type") => FrameType::from_code(code).map(FrameType::name),
        ("frame_header", "sh_transform_id") => (code == crate::syntax::NO_TRANSFORM).then_some("none"),
        ("transform", "transform_kind") => TransformKind::from_code(code).map(TransformKind::name),
        ("scene_description", "up_axis") => UpAxis::from_code(code).map(UpAxis::name),
        ("scene_description", "colour_space") => ColourSpace::from_code(code).map(ColourSpace::name),
        ("scene_description", "sorting") => Sorting::from_code(code).map(Sorting::name),
        ("increment", "sh_mode") => ShMode::from_code(code).map(ShMode::name),
        _ => None,
    };
    name.map(str::to_owned)
}

/// The names of the flags that are set; `names` holds those of bit 0, 1, ...
fn flags(number: u64, names: &[&str]) -> Option<String> {
    let set = |(bit, name): (u32, &&str)| (number.wrapping_shr(bit) & 1 == 1).then(|| (*name).to_owned());
    let set: Vec<String> = (0..).zip(names).filter_map(set).collect();
    (!set.is_empty()).then(|| set.join(", "))
}
