//! glTF of what an input says: JSON as text, or a usual document of which one number is wrong, and a buffer that fits it.

use super::bytes::{Bytes, repeated};

/// Bits of the first byte: the container is JSON alone, nodes have transforms, the primitive is an SPZ file.
const IS_TEXT: u8 = 1;
const HAS_TRANSFORMS: u8 = 2;
const IS_SPZ: u8 = 4;

/// More Gaussians than these are claimed, not there.
const MAX_GAUSSIANS: u32 = 1 << 10;

/// Flags, Gaussians, degree, which number is wrong and its value, the length of a text for the JSON and that text, unless it
/// is a usual one; the buffer.
pub fn pack(input: &[u8]) -> Vec<u8> {
    let mut input = Bytes(input);
    let (flags, count, degree) = (input.u8(), u32::from(input.u16()), input.u8() % 4);
    let (wrong_at, wrong) = (usize::from(input.u8()), i32::from_le_bytes(input.array()));
    let length = input.u16();
    let text = input.take(length.into());
    let size = bytes_of(degree) * count.min(MAX_GAUSSIANS);
    let binary = if flags & IS_SPZ != 0 { input.0.to_vec() } else { repeated(input.0, size as usize) };
    let json = match text.len() {
        0 => with_one_wrong(&document(flags, count, degree, binary.len()), wrong_at, wrong).into_bytes(),
        _ => text.to_vec(),
    };
    if flags & IS_TEXT != 0 {
        return json;
    }
    let padded = [json.as_slice(), &vec![b' '; json.len().next_multiple_of(4) - json.len()]].concat();
    let words =
        [2, (28 + padded.len() + binary.len()) as u32, padded.len() as u32].map(u32::to_le_bytes).concat();
    let head = [b"glTF", &words[..], b"JSON", &padded].concat();
    [&head[..], &(binary.len() as u32).to_le_bytes(), b"BIN\0", &binary].concat()
}

/// Bytes of a Gaussian.
fn bytes_of(degree: u8) -> u32 {
    let coefficients = [0, 3, 8, 15][usize::from(degree)];
    4 * (3 + 4 + 3 + 1 + 3 + 3 * coefficients)
}

/// Names of the attributes, and what a value of each has.
fn attributes(degree: u8) -> Vec<(String, &'static str, u32)> {
    let mut all = vec![
        ("POSITION".to_owned(), "VEC3", 12),
        ("KHR_gaussian_splatting:ROTATION".to_owned(), "VEC4", 16),
        ("KHR_gaussian_splatting:SCALE".to_owned(), "VEC3", 12),
        ("KHR_gaussian_splatting:OPACITY".to_owned(), "SCALAR", 4),
    ];
    for degree in 0..=degree {
        for at in 0..=2 * degree {
            all.push((format!("KHR_gaussian_splatting:SH_DEGREE_{degree}_COEF_{at}"), "VEC3", 12));
        }
    }
    all
}

/// A scene of two nodes that show one mesh of one primitive.
fn document(flags: u8, count: u32, degree: u8, bytes: usize) -> String {
    let all = attributes(degree);
    let (mut names, mut accessors, mut views, mut at) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for (index, (name, kind, size)) in all.iter().enumerate() {
        names.push(format!("\"{name}\":{index}"));
        accessors.push(format!(
            r#"{{"bufferView":{index},"componentType":5126,"count":{count},"type":"{kind}"}}"#
        ));
        let length = size * count.min(MAX_GAUSSIANS);
        views.push(format!(r#"{{"buffer":0,"byteOffset":{at},"byteLength":{length}}}"#));
        at += length;
    }
    let transforms = match flags & HAS_TRANSFORMS {
        0 => "",
        _ => r#","translation":[1,2,3],"rotation":[0,0.6,0,0.8],"scale":[2,2,1]"#,
    };
    let inside = match flags & IS_SPZ {
        0 => String::new(),
        _ => {
            views = vec![format!(r#"{{"buffer":0,"byteLength":{bytes}}}"#)];
            r#","extensions":{"KHR_gaussian_splatting_compression_spz_2":{"bufferView":0}}"#.to_owned()
        }
    };
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"children":[1]{transforms}}},{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{{}}},"extensions":{{"KHR_gaussian_splatting":{{"kernel":"ellipse"{inside}}}}}}}]}}],
"accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{bytes}}}]}}"#,
        names.join(","),
        accessors.join(","),
        views.join(",")
    )
}

/// The text with another value for one of the numbers behind colons and brackets; with most bytes, none.
fn with_one_wrong(text: &str, wrong_at: usize, value: i32) -> String {
    let mut number = 0;
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find([':', '[']) {
        let (before, after) = rest.split_at(at + 1);
        let digits = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
        let (found, behind) = after.split_at(digits);
        out.push_str(before);
        match found.is_empty() {
            true => {}
            false if number == wrong_at => out.push_str(&value.to_string()),
            false => out.push_str(found),
        }
        number += usize::from(!found.is_empty());
        rest = behind;
    }
    out + rest
}
