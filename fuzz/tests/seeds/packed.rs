//! What the packed forms of scene files are made of: see `scene::spz_file` and its neighbours.

/// Gaussians of a seed, and pixels of an image of them.
const ROWS: u8 = 4;
/// Attributes fit the header; nothing is compressed or wrong.
const FITS: u8 = 1;

/// The header, extensions that name a coordinate system, and attributes of degree 1.
fn spz_header(version: u8) -> [u8; 16] {
    let has_extensions = 2;
    [b'N', b'G', b'S', b'P', version, 0, 0, 0, ROWS, 0, 0, 0, 1, 12, has_extensions, 0]
}

/// One extension of 12 bytes: a type, a length, a coordinate system.
const EXTENSION: [u8; 13] = [12, 3, 0, 0xbe, 0xad, 4, 0, 0, 0, 6, 0, 0, 0];

fn attributes() -> Vec<u8> {
    (0..ROWS * 29).map(|value| value.wrapping_mul(7)).collect()
}

pub(crate) fn spz_gzip(version: u8) -> Vec<u8> {
    [&[FITS], &spz_header(version)[..], &EXTENSION, &attributes()].concat()
}

pub(crate) fn spz_zstd() -> Vec<u8> {
    let mut header = spz_header(4);
    header[15] = 6;
    let (contents_at, wrong, window) = ([0; 4], [0; 9], [0]);
    [&[FITS], &header[..], &contents_at, &EXTENSION, &wrong, &window, &attributes()].concat()
}

/// The same scene with `meta.json` as text, in codebooks or, as version 1 has it, in ranges; or with a usual one.
pub(crate) fn sog(meta: Option<&str>) -> Vec<u8> {
    let nothing_wrong = [0, 255, 0, 0, 0, 0];
    let (flags, version, count) = (0, 2, u16::from(ROWS));
    let meta = meta.unwrap_or_default();
    let [count, length] = [count, meta.len() as u16].map(u16::to_le_bytes);
    let mut out = [&nothing_wrong[..], &[flags, version], &count, &length, meta.as_bytes()].concat();
    let rows =
        |last: u8| (0..ROWS).flat_map(move |row| [row * 50, row * 40, row * 30, last]).collect::<Vec<u8>>();
    let labels: Vec<u8> = (0..ROWS).flat_map(|row| [row, 0, 0, 255]).collect();
    let literal = [rows(255), rows(255), rows(255), rows(253), rows(200), labels];
    for pixels in literal {
        image(0, [2, 2], &pixels, &mut out);
    }
    // A palette of degree 1 whose entries are all alike takes one pixel.
    image(1, [64 * 3, 1], &[100, 120, 140, 255], &mut out);
    out
}

fn image(flags: u8, [width, height]: [u16; 2], pixels: &[u8], out: &mut Vec<u8>) {
    out.push(flags);
    // An image of n pixels says n - 1.
    out.extend([width - 1, height - 1, pixels.len() as u16].map(u16::to_le_bytes).concat());
    out.extend(pixels);
}

/// A camera, and vertices of degree 0.
pub(crate) fn ply(flags: u8) -> Vec<u8> {
    let elements = [[4, 1, 0, 0], [0, 2, 0, 0]];
    [&[flags, 2], elements.as_flattened(), &[0x3c; 16]].concat()
}

/// A chunk, vertices, and coefficients of degree 1.
pub(crate) fn compressed_ply() -> Vec<u8> {
    let elements = [[2, 1, 0, 0], [1, 2, 0, 0], [3, 2, 0, 1]];
    [&[0, 3], elements.as_flattened(), &[0x3c; 16]].concat()
}

pub(crate) const CODEBOOKS: &str = r#"{"version":2,"count":4,"means":{"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]},
"scales":{"codebook":#,"files":["s.webp"]},"quats":{"files":["q.webp"]},
"sh0":{"codebook":#,"files":["c.webp"]},"shN":{"codebook":#,"files":["labels.webp","centroids.webp"]}}"#;

pub(crate) const RANGES: &str = r#"{"means":{"shape":[4,3],"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]},
"scales":{"mins":-8,"maxs":-1,"files":["s.webp"]},"quats":{"files":["q.webp"]},
"sh0":{"mins":[-1,-1,-1,-4],"maxs":[1,1,1,4],"files":["c.webp"]},
"shN":{"mins":-1,"maxs":1,"files":["labels.webp","centroids.webp"]}}"#;

/// A glTF of degree 1, in a GLB or as text, with transforms or not; nothing is wrong.
pub(crate) fn gltf(flags: u8) -> Vec<u8> {
    let values = (0..16).flat_map(|value| (value as f32 / 16.0 + 0.1).to_le_bytes());
    // As text the document has no buffer, and is read where it has no Gaussians either.
    let (count, text) = if flags & 1 == 0 { (ROWS, "") } else { (0, TEXT) };
    let head = [flags, count, 0, 1, 255, 0, 0, 0, 0, text.len() as u8, (text.len() >> 8) as u8];
    head.into_iter().chain(text.bytes()).chain(values).collect()
}

/// One Gaussian, in a buffer inside of the text.
const TEXT: &str = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,
"KHR_gaussian_splatting:ROTATION":1,"KHR_gaussian_splatting:SCALE":0,"KHR_gaussian_splatting:OPACITY":2,
"KHR_gaussian_splatting:SH_DEGREE_0_COEF_0":0},"extensions":{"KHR_gaussian_splatting":{}}}]}],"accessors":[
{"bufferView":0,"componentType":5126,"count":1,"type":"VEC3"},{"bufferView":0,"componentType":5126,"count":1,"type":"VEC4"},
{"bufferView":0,"componentType":5121,"normalized":true,"count":1,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":16}],
"buffers":[{"byteLength":16,"uri":"data:;base64,AAAAPwAAAD8AAAA/AAAAPw=="}]}"#;

/// A GLB whose primitive is an SPZ file.
pub(crate) fn gltf_of_spz(file: &[u8]) -> Vec<u8> {
    let spz = 4;
    [&[spz, ROWS, 0, 1, 255, 0, 0, 0, 0, 0, 0][..], file].concat()
}

/// Two sections of degrees 1 and 2, the first with a bucket that is not full.
pub(crate) fn ksplat(level: u8) -> Vec<u8> {
    let sections = [[5, 0, 1, 2, 1, 0], [4, 0, 0, 2, 2, 0]];
    [&[FITS, 1, level, 2, 0, 0, 0, 0], sections.as_flattened(), &[0x3c; 16]].concat()
}

/// Two records of 64 bytes.
pub(crate) fn splatv() -> Vec<u8> {
    let record: Vec<u8> = (0..64_u8).map(|at| if at % 2 == 0 { at } else { 0x38 }).collect();
    [&128_u64.to_le_bytes()[..], &record, &record].concat()
}

/// Four Gaussians in five frames of groups of two; positions and opacities change.
pub(crate) fn splat4d() -> Vec<u8> {
    [&[ROWS, 0, 5, 1, 255, 0, 0, 0, 0], &[1, 0, 0, 1, 0][..], &[3, 4, 5, 6, 7, 8, 9]].concat()
}

/// Two frames, what a folder is, and a long name.
pub(crate) fn tar() -> Vec<u8> {
    let frame = |name: u8| [&[0, name, 0, 32, 0][..], &[0x3c; 32]].concat();
    let folder = [4, 4, 0, 0, 0];
    let name = [&[1, 4, 0, 14, 0][..], b"frame_20.splat"].concat();
    [&[5][..], &frame(2), &folder, &frame(1), &name, &frame(0)].concat()
}
