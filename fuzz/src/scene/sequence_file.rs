//! Files of many frames of what an input says: streams of `.splat4d` that are compressed, tar archives with checksums, and
//! `.splatv` with its list of chunks.

use super::bytes::{Bytes, repeated};
use super::spz_file::zstd_frame;

/// Records of `.splatv` after a usual header; flags say whether the chunk says another size.
pub fn splatv(input: &[u8]) -> Vec<u8> {
    let mut input = Bytes(input);
    let size = u64::from_le_bytes(input.array());
    let json = format!(r#"[{{"type":"camera","size":0}},{{"type":"splat","size":{size}}}]"#);
    [&[0x4b, 0x67, 0, 0], &(json.len() as u32).to_le_bytes()[..], json.as_bytes(), input.0].concat()
}

/// Streams of the static section, in their order: integers of a Gaussian; those of masks have a bit.
const STILL: [u32; 5] = [3, 3, 3, 1, 4];
/// Values of a Gaussian in each attribute of a group.
const CHANNELS: [u32; 5] = [3, 4, 3, 1, 3];

/// More Gaussians than these are claimed, not there.
const MAX_GAUSSIANS: u32 = 1 << 8;

/// Gaussians, frames and frames of a group; which stream is wrong and how; whether each attribute changes; the integers, again
/// and again.
pub fn splat4d(input: &[u8]) -> Vec<u8> {
    let mut input = Bytes(input);
    let (count, frames, group) =
        (u32::from(input.u16()), u32::from(input.u8() % 9), u32::from(input.u8() % 4) + 1);
    let (wrong_at, wrong) = (usize::from(input.u8()), u32::from_le_bytes(input.array()));
    let changes: [u8; 5] = input.array();
    let there = count.min(MAX_GAUSSIANS);
    let mut number = 0;
    let mut stream = |values: u32, pattern: &[u8]| {
        let content = repeated(pattern, values as usize);
        let packed = if content.is_empty() { Vec::new() } else { zstd_frame(&content, 0, false) };
        let said = if number == wrong_at { wrong } else { values };
        number += 1;
        let sizes = [said.to_le_bytes(), (packed.len() as u32).to_le_bytes()].concat();
        (sizes, packed)
    };
    let mut still = Vec::new();
    for change in changes {
        let (sizes, packed) = stream(there.div_ceil(8), &[if change & 1 == 0 { 255 } else { 0 }]);
        still.extend([&[0, 2, 1][..], &sizes, &packed].concat());
    }
    for values in STILL {
        let (sizes, packed) = stream(there * values, input.0);
        still.extend([&[0, 2, 1][..], &sizes, &packed].concat());
    }
    let mut groups = Vec::new();
    for first in (0..frames).step_by(group as usize) {
        let length = group.min(frames - first);
        let (mut heads, mut contents, mut streams) = (Vec::new(), Vec::new(), 0_u16);
        for (attribute, change) in changes.iter().enumerate().filter(|(_, change)| *change & 1 == 1) {
            for (kind, values) in [(0, 1), (1, length - 1)].into_iter().filter(|(_, frames)| *frames > 0) {
                let (sizes, packed) = stream(there * CHANNELS[attribute] * values, input.0);
                heads.extend([&[attribute as u8, kind, 1 + (change & 2) / 2 * 6][..], &sizes].concat());
                contents.extend(packed);
                streams += 1;
            }
        }
        groups.push((first, length, [&streams.to_le_bytes()[..], &heads, &contents].concat()));
    }
    file(count, frames, &still, &groups)
}

/// The header, the description, and all sections.
fn file(count: u32, frames: u32, still: &[u8], groups: &[(u32, u32, Vec<u8>)]) -> Vec<u8> {
    // Offsets have one width, so that the description is as long as it says.
    let describe = |length: usize| {
        let mut at = 12 + length + still.len();
        let gops: Vec<String> = groups
            .iter()
            .map(|(first, frames, bytes)| {
                let gop = format!(
                    r#"{{"offset":{at:9},"len":{},"f0":{first},"f1":{}}}"#,
                    bytes.len(),
                    first + frames - 1
                );
                at += bytes.len();
                gop
            })
            .collect();
        format!(
            r#"{{"n":{count},"t":{frames},"steps":{{"pos":0.5,"scale_log":0.1,"rgb":3,"alpha":3,"rot":1,"base_pos":0.2,"base_scale_log":0.1}},
"static_section":{{"offset":{:9},"len":{}}},"gops":[{}]}}"#,
            12 + length,
            still.len(),
            gops.join(",")
        )
    };
    let json = describe(describe(0).len());
    let chunks: Vec<u8> = groups.iter().flat_map(|(_, _, bytes)| bytes.clone()).collect();
    [b"SP4D\x01\0\0\0", &(json.len() as u32).to_le_bytes()[..], json.as_bytes(), still, &chunks].concat()
}

/// Files of an archive: of each its kind, its name by number, what is wrong with its size, and its content.
pub fn tar(input: &[u8]) -> Vec<u8> {
    let mut input = Bytes(input);
    let mut out = Vec::new();
    for _ in 0..input.u8() % 9 {
        let [kind, name, wrong] = input.array();
        let length = input.u16();
        let content = input.take(length.into());
        let names =
            ["frame_1.splat", "frame_2.splat", "frame_10.splat", "a/b.ply", "notes.txt", "frame_3.spz"];
        let mut header = [0; 512];
        let name = names[usize::from(name) % names.len()];
        header[..name.len()].copy_from_slice(name.as_bytes());
        let size = content.len() as u64 + (u64::from(wrong) << (wrong % 25));
        header[124..136].copy_from_slice(format!("{size:011o}\0").as_bytes());
        header[156] = [b'0', b'L', b'x', b'g', b'5', b'1', b'K', kind][usize::from(kind % 8)];
        header[257..265].copy_from_slice(b"ustar\x0000");
        header[148..156].fill(b' ');
        let sum: u32 = header.iter().map(|byte| u32::from(*byte)).sum();
        header[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
        out.extend(header);
        out.extend(content);
        out.resize(out.len().next_multiple_of(512), 0);
    }
    out.extend([0; 1024]);
    out
}
