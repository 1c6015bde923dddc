//! Values of elements from their bytes.

use super::{Number, Value};
use crate::payload::{ColourSpace, Sorting, UpAxis, leb128};
use crate::syntax::{FrameType, IncrementHeader, Profile, ShMode, TransformKind, UnitType};

/// The value of an element of a type from its bytes, with what it stands for where it is a code.
pub(super) fn of(record: &str, element: &str, type_name: &str, raw: &[u8]) -> Value {
    if (record, element) == ("scene_description", "title") {
        return Value::Text(String::from_utf8_lossy(raw).into_owned());
    }
    let base = type_name.split('[').next().unwrap_or_default();
    if base == "leb128" {
        return match leb128(raw, 0, "", "") {
            Ok((number, _)) => Value::Number(Number::Unsigned(number.into())),
            Err(_) => Value::Words("no number".to_owned()),
        };
    }
    let bits: usize = base.trim_start_matches(['u', 'i', 'f']).parse().unwrap_or(8);
    let bytes = bits.div_ceil(8).max(1);
    let numbers: Vec<u64> = raw.chunks(bytes).map(little_endian).collect();
    match (numbers.as_slice(), type_name == base) {
        (&[number], true) => one(record, element, base, number),
        _ if element == "signature" => Value::Hexadecimals { numbers, bytes },
        _ => Value::List(numbers.into_iter().map(|number| typed(base, number)).collect()),
    }
}

/// A single value.
fn one(record: &str, element: &str, base: &str, number: u64) -> Value {
    let bytes = match element {
        "header_crc" | "payload_crc" => Some(4),
        "header_check" => Some(2),
        "refinement_digest" | "carried_digest" => Some(8),
        _ => None,
    };
    if let Some(bytes) = bytes {
        return Value::Hexadecimal { number, bytes };
    }
    named(record, element, number).unwrap_or_else(|| Value::Number(typed(base, number)))
}

/// A number of `width` bytes or fewer.
pub(super) fn little_endian(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, byte| number.wrapping_shl(8) | u64::from(*byte))
}

/// The bits of a number of a type.
fn typed(base: &str, number: u64) -> Number {
    let signed = match base {
        "f32" => return Number::Float(u32::try_from(number).map(f32::from_bits).unwrap_or_default()),
        "i8" => u8::try_from(number).map(u8::cast_signed).ok().map(i64::from),
        "i16" => u16::try_from(number).map(u16::cast_signed).ok().map(i64::from),
        "i32" => u32::try_from(number).map(u32::cast_signed).ok().map(i64::from),
        _ => None,
    };
    signed.map_or(Number::Unsigned(number), Number::Signed)
}

/// What a code or a set of flags stands for.
fn named(record: &str, element: &str, number: u64) -> Option<Value> {
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
    name.map(|name| Value::code(number, name))
}

/// Flags, where some are set; `names` holds those of bit 0, 1, ...
fn flags(number: u64, names: &[&'static str]) -> Option<Value> {
    let set = |(bit, name): (u32, &&'static str)| (number.wrapping_shr(bit) & 1 == 1).then_some(*name);
    let names: Vec<&'static str> = (0..).zip(names).filter_map(set).collect();
    (!names.is_empty()).then_some(Value::Flags { number, names })
}
