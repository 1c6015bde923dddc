//! SOG archives of what an input says: `meta.json` as text with some abbreviations, images pixel by pixel, and an archive
//! with checksums, in which one thing may be wrong.

use super::bytes::{Bytes, deflated};
use super::webp::{Coding, image};

/// Names of the images, in the order in which an input has them.
pub const IMAGES: [&str; 7] =
    ["l.webp", "u.webp", "s.webp", "q.webp", "c.webp", "labels.webp", "centroids.webp"];

/// Bits of the first byte of a file: how its pixels are coded, whether it is deflated.
const IS_PLAIN: u8 = 1;
const IS_DEFLATED: u8 = 2;
/// The file has that many zeros more, in 4 KiB, when this bit is set.
const IS_LONG: u8 = 4;

/// What may be wrong with an archive: a number of its headers, or a file.
#[derive(Clone, Copy)]
struct Wrong {
    /// The file that it concerns.
    file: usize,
    /// Which number it is; with most bytes, none.
    what: u8,
    value: u32,
}

/// What is wrong, six bytes; of `meta.json` flags, version, count, and the length of its text, and this, unless it is one
/// of the usual ones; for each image: flags, width, height, the length of its pixels, the pixels.
pub fn pack(input: &[u8]) -> Vec<u8> {
    let mut input = Bytes(input);
    let wrong = Wrong { file: input.u8().into(), what: input.u8(), value: u32::from_le_bytes(input.array()) };
    let (flags, version, count, length) = (input.u8(), input.u8(), input.u16(), input.u16());
    let meta = match length {
        0 => expanded(usual(version, count).as_bytes()),
        _ => expanded(input.take(length.into())),
    };
    let mut files = vec![("meta.json", flags, meta)];
    for name in IMAGES {
        let flags = input.u8();
        let (width, height, length) = (input.u16(), input.u16(), input.u16());
        let coding = if flags & IS_PLAIN != 0 { Coding::Plain } else { Coding::Literal };
        files.push((name, flags, image(width, height, coding, input.take(length.into()))));
    }
    archive(&files, wrong)
}

/// What `meta.json` is where an input does not have it: with codebooks of all, or ranges, or without spherical harmonics.
fn usual(version: u8, count: u16) -> String {
    let ranges = r#""mins":[-1,-1,-1,-4],"maxs":[1,1,1,4]"#;
    let codes = ["\"codebook\":#", ranges, "\"codebook\":~"][usize::from(version / 4 % 3)];
    let rest = match version / 16 % 2 {
        0 => format!(r#","shN":{{{codes},"files":["labels.webp","centroids.webp"]}}"#),
        _ => String::new(),
    };
    format!(
        r#"{{"version":{},"count":{count},"means":{{"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]}},
"scales":{{{codes},"files":["s.webp"]}},"quats":{{"files":["q.webp"]}},"sh0":{{{codes},"files":["c.webp"]}}{rest}}}"#,
        version % 4
    )
}

/// The text with a codebook of 256 numbers for each `#`, and one of 255 for each `~`.
fn expanded(text: &[u8]) -> Vec<u8> {
    let codebook = |codes: u8| {
        let values: Vec<String> =
            (0..=codes).map(|code| format!("{}", f32::from(code) / 64.0 - 2.0)).collect();
        format!("[{}]", values.join(",")).into_bytes()
    };
    let byte = |byte: &u8| match byte {
        b'#' => codebook(255),
        b'~' => codebook(254),
        other => vec![*other],
    };
    text.iter().flat_map(byte).collect()
}

/// A ZIP archive: local headers and content, the directory, its end.
fn archive(files: &[(&str, u8, Vec<u8>)], wrong: Wrong) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    let mut count = 0_u16;
    for (index, (name, flags, content)) in files.iter().enumerate() {
        let wrong = Some(wrong).filter(|wrong| wrong.file % files.len() == index);
        let pad = if flags & IS_LONG != 0 { wrong.map_or(0, |wrong| wrong.value % 4096) } else { 0 };
        let content = [content.as_slice(), &vec![0; pad as usize * 4096]].concat();
        let is_deflated = flags & IS_DEFLATED != 0;
        let stored = if is_deflated { deflated(&content) } else { content.clone() };
        let number = |what: u8, value: u32| match wrong {
            Some(wrong) if wrong.what == what => wrong.value,
            _ => value,
        };
        let sizes = [
            number(1, crc32fast::hash(&content)),
            number(2, stored.len() as u32),
            number(3, content.len() as u32),
        ];
        let method = number(4, if is_deflated { 8 } else { 0 }) as u16;
        // Version needed, flags, method, time, date.
        let head = [20, number(5, 0) as u16, method, 0, 0x21].map(u16::to_le_bytes).concat();
        let head = [head, sizes.map(u32::to_le_bytes).concat()].concat();
        let name = if wrong.is_some_and(|wrong| wrong.what == 6) { "../meta.json" } else { name };
        let length = (name.len() as u16).to_le_bytes();
        let at = number(7, out.len() as u32);
        out.extend([b"PK\x03\x04", &head[..], &length, &[0; 2], name.as_bytes(), &stored].concat());
        let entry =
            [b"PK\x01\x02\x14\0", &head[..], &length, &[0; 12], &at.to_le_bytes(), name.as_bytes()].concat();
        // A file may lack, or come twice.
        let times = wrong.filter(|wrong| wrong.what == 8).map_or(1, |wrong| wrong.value as usize % 3);
        directory.extend(entry.repeat(times));
        count += times as u16;
    }
    let number = |what: u8, value: u32| if wrong.what == what { wrong.value } else { value };
    let (size, at) = (number(9, directory.len() as u32), number(10, out.len() as u32));
    let counts = [0, 0, count, number(11, count.into()) as u16].map(u16::to_le_bytes).concat();
    let end = [b"PK\x05\x06", &counts[..], &size.to_le_bytes(), &at.to_le_bytes(), &[0; 2]].concat();
    [out, directory, end].concat()
}
