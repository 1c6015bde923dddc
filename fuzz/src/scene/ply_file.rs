//! PLY files, plain and compressed, of what an input says: elements by their kind and number of rows, and a body that fits.

use super::bytes::{Bytes, repeated};
use std::fmt::Write as _;

/// Most elements of a file, and most rows of one that are there.
const MAX_ELEMENTS: u8 = 8;
const MAX_ROWS: u64 = 1 << 10;

const PLAIN: &str = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
const PACKED: &str = "packed_position packed_rotation packed_scale packed_color";
const RANGES: &str = "min_x min_y min_z max_x max_y max_z min_scale_x min_scale_y min_scale_z max_scale_x max_scale_y \
                      max_scale_z min_r min_g min_b max_r max_g max_b";
const TYPES: [&str; 8] = ["float", "uchar", "uint", "double", "char", "short", "ushort", "int"];
const SIZES: [u64; 8] = [4, 1, 4, 8, 1, 2, 2, 4];

/// What an element is.
struct Element {
    kind: u8,
    /// Rows as a number of the input and a power of two, so that a few bits say a great many.
    rows: u64,
    /// Another type of its properties than the usual one, and the property that lacks.
    change: u8,
    /// Degree of the spherical harmonics.
    degree: u8,
}

/// Flags, the number of elements, four bytes for each, and the body: values of one element after another.
pub fn pack(input: &[u8]) -> Vec<u8> {
    let mut input = Bytes(input);
    let (flags, count) = (input.u8(), input.u8() % (MAX_ELEMENTS + 1));
    let elements: Vec<Element> = (0..count).map(|_| element(&mut input)).collect();
    let encoding = ["binary_little_endian", "ascii", "binary_big_endian"][usize::from(flags % 3)];
    let mut text = format!("ply\nformat {encoding} 1.0\n");
    let mut length = 0_u64;
    for (index, element) in elements.iter().enumerate() {
        length += describe(element, index, &mut text) * element.rows.min(MAX_ROWS);
    }
    text.push_str("end_header\n");
    let mut out = text.into_bytes();
    // A body that is cut short, as it comes, or as long as it has to be.
    let body =
        if flags & 0x10 == 0 { repeated(input.0, length.min(1 << 16) as usize) } else { input.0.to_vec() };
    match encoding {
        "ascii" => body.iter().for_each(|byte| out.extend(format!("{} ", byte.cast_signed()).into_bytes())),
        _ => out.extend(body),
    }
    out
}

fn element(input: &mut Bytes<'_>) -> Element {
    let [kind, rows, change, degree] = input.array();
    Element {
        kind: kind % 6,
        rows: u64::from(rows % 16) << (4 * (rows / 16) % 40),
        change,
        degree: degree % 4,
    }
}

/// Adds an element to a header; gives the bytes of a row, of lists those of an empty one.
fn describe(element: &Element, index: usize, text: &mut String) -> u64 {
    let (name, properties, usual) = match element.kind {
        0 => ("vertex", PLAIN, 0),
        1 => ("vertex", PACKED, 2),
        2 => ("chunk", RANGES, 0),
        3 => ("sh", "", 1),
        4 => ("camera", "focus", 3),
        _ => ("face", "", 1),
    };
    // Two elements of one name are refused: others come after one that is skipped.
    let number = if name == "camera" || name == "face" { index.to_string() } else { String::new() };
    let _ = writeln!(text, "element {name}{number} {}", element.rows);
    if name == "face" {
        let _ =
            writeln!(text, "property list {} {} indices", TYPES[usize::from(element.change % 8)], TYPES[5]);
        return SIZES[usize::from(element.change % 8)];
    }
    let kind = if element.change & 0x80 == 0 { usual } else { usize::from(element.change % 8) };
    let missing = if element.change & 0x40 == 0 { usize::MAX } else { usize::from(element.change % 32) };
    let rest = if matches!(element.kind, 0 | 3) { [0, 9, 24, 45][usize::from(element.degree)] } else { 0 };
    let names =
        properties.split_whitespace().map(str::to_owned).chain((0..rest).map(|at| format!("f_rest_{at}")));
    let mut size = 0;
    for (_, name) in names.enumerate().filter(|(at, _)| *at != missing) {
        let _ = writeln!(text, "property {} {name}", TYPES[kind]);
        size += SIZES[kind];
    }
    size
}
