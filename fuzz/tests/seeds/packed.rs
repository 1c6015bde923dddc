//! What the packed forms of scene files are made of: see `scene::spz_file` and `scene::sog_archive`.

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

/// The same scene in codebooks or, as version 1 has it, in ranges.
pub(crate) fn sog(has_ranges: bool) -> Vec<u8> {
    let nothing_wrong = [0, 255, 0, 0, 0, 0];
    let meta = if has_ranges { RANGES } else { CODEBOOKS };
    let mut out = [&nothing_wrong[..], &[0], &(meta.len() as u16).to_le_bytes(), meta.as_bytes()].concat();
    let rows =
        |last: u8| (0..ROWS).flat_map(move |row| [row * 50, row * 40, row * 30, last]).collect::<Vec<u8>>();
    let labels: Vec<u8> = (0..ROWS).flat_map(|row| [row, 0, 0, 255]).collect();
    let palette: Vec<u8> = (0..64 * 3_u8).flat_map(|pixel| [pixel; 4]).collect();
    let images =
        [(2, 2, rows(255)), (2, 2, rows(255)), (2, 2, rows(255)), (2, 2, rows(253)), (2, 2, rows(200))];
    for (width, height, pixels) in images.into_iter().chain([(2, 2, labels), (64 * 3, 1, palette)]) {
        out.push(0);
        // An image of n pixels says n - 1.
        out.extend([width - 1, height - 1, pixels.len() as u16].map(u16::to_le_bytes).concat());
        out.extend(pixels);
    }
    out
}

const CODEBOOKS: &str = r#"{"version":2,"count":4,"means":{"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]},
"scales":{"codebook":#,"files":["s.webp"]},"quats":{"files":["q.webp"]},
"sh0":{"codebook":#,"files":["c.webp"]},"shN":{"codebook":#,"files":["labels.webp","centroids.webp"]}}"#;

const RANGES: &str = r#"{"means":{"shape":[4,3],"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]},
"scales":{"mins":-8,"maxs":-1,"files":["s.webp"]},"quats":{"files":["q.webp"]},
"sh0":{"mins":[-1,-1,-1,-4],"maxs":[1,1,1,4],"files":["c.webp"]},
"shN":{"mins":-1,"maxs":1,"files":["labels.webp","centroids.webp"]}}"#;
