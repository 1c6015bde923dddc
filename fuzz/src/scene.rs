//! The readers of scene files and of files of many frames: on any bytes, and on files that are packed from what an input says, so that what lies
//! behind compression and checksums is read.

use crate::allowance::{Allowance, within};
use splatstream_files::{
    ReadLimits, SceneError, SceneFormat, Sequence, SequenceOptions, compressed_ply, gltf, ksplat, ply, sog,
    splat, spz,
};
use splatstream_gaussians::GaussianFrame;
use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;
use std::time::Duration;

mod bytes;
pub mod gltf_file;
pub mod ksplat_file;
pub mod ply_file;
pub mod sequence_file;
pub mod sog_archive;
pub mod spz_file;
mod webp;

/// Small, so that an input which keeps within them is cheap.
pub const LIMITS: ReadLimits = ReadLimits { max_memory: 1 << 21 };
/// Larger, so that what a reader takes beyond its limit shows, and what it takes for each byte.
pub const WIDE_LIMITS: ReadLimits = ReadLimits { max_memory: 1 << 23 };

type Reader = fn(&[u8], &ReadLimits) -> Result<GaussianFrame, SceneError>;

type Pack = fn(&[u8]) -> Vec<u8>;

/// How an input becomes a file, and who reads it.
#[derive(Debug, Clone, Copy)]
pub struct Form {
    /// The word for it.
    pub name: &'static str,
    /// The reader.
    pub read: Reader,
    /// What makes a file of the input; none if the input is one.
    pub pack: Option<Pack>,
}

/// The first byte of the input chooses one, and limits.
pub const FORMS: [Form; 20] = [
    Form { name: "ply", read: ply::read, pack: None },
    Form { name: "spz", read: spz::read, pack: None },
    Form { name: "splat", read: splat::read, pack: None },
    Form { name: "sog", read: sog::read_zip, pack: None },
    Form { name: "compressed-ply", read: compressed_ply::read, pack: None },
    Form { name: "packed-spz-gzip", read: spz::read, pack: Some(spz_file::gzip) },
    Form { name: "packed-spz-zstd", read: spz::read, pack: Some(spz_file::zstd) },
    Form { name: "packed-sog", read: sog::read_zip, pack: Some(sog_archive::pack) },
    Form { name: "packed-ply", read: ply::read, pack: Some(ply_file::pack) },
    Form { name: "packed-compressed-ply", read: compressed_ply::read, pack: Some(ply_file::pack) },
    Form { name: "gltf", read: gltf::read, pack: None },
    Form { name: "packed-gltf", read: gltf::read, pack: Some(gltf_file::pack) },
    Form { name: "ksplat", read: ksplat::read, pack: None },
    Form { name: "packed-ksplat", read: ksplat::read, pack: Some(ksplat_file::pack) },
    Form { name: "splatv", read: splatv, pack: None },
    Form { name: "packed-splatv", read: splatv, pack: Some(sequence_file::splatv) },
    Form { name: "splat4d", read: splat4d, pack: None },
    Form { name: "packed-splat4d", read: splat4d, pack: Some(sequence_file::splat4d) },
    Form { name: "archive", read: archive, pack: None },
    Form { name: "packed-tar", read: archive, pack: Some(sequence_file::tar) },
];

fn splatv(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    some_frames(bytes, SceneFormat::Splatv, limits)
}

fn splat4d(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    some_frames(bytes, SceneFormat::Splat4d, limits)
}

fn archive(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    some_frames(bytes, SceneFormat::Archive, limits)
}

/// The last frame of a sequence, after the first and the one before the last: forwards and backwards.
fn some_frames(bytes: &[u8], format: SceneFormat, limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    let options = SequenceOptions { samples: 3 };
    let mut sequence =
        Sequence::of(Cursor::new(bytes.to_vec()), format, Path::new("input"), limits, &options)?;
    let last = sequence.len().saturating_sub(1);
    let mut read = |number| {
        let frame = sequence.frame(number)?.frame;
        frame.validate()?;
        Ok(frame)
    };
    let whole = read(last);
    // A damaged frame does not change what others are.
    let _ = (read(0), read(last.saturating_sub(1)));
    let again = read(last);
    assert!(
        whole.is_ok() == again.is_ok() && (whole.is_err() || whole.as_ref().ok() == again.as_ref().ok()),
        "{format:?}"
    );
    again
}

impl Form {
    /// The file that an input stands for, without its first byte.
    pub fn file(self, input: &[u8]) -> Cow<'_, [u8]> {
        self.pack.map_or(Cow::Borrowed(input), |pack| Cow::Owned(pack(input)))
    }
}

/// A reader refuses, or gives a frame that passes the checks of frames, within its limits; what is then written reads
/// again.
pub fn run(data: &[u8]) {
    let Some((&choice, input)) = data.split_first() else { return };
    let choice = usize::from(choice);
    let (form, choice) = (FORMS[choice % FORMS.len()], choice / FORMS.len());
    let limits = if choice % 2 == 0 { LIMITS } else { WIDE_LIMITS };
    let file = form.file(input);
    let read = within(form.name, &allowance(file.len(), &limits), || (form.read)(&file, &limits));
    let Ok(frame) = read else { return };
    assert_eq!(frame.validate(), Ok(()));
    // Writing takes longer than reading: not every time.
    if choice % 4 == 0 {
        reads_again(&frame);
    }
}

/// What reading a file of so many bytes may take.
pub fn allowance(length: usize, limits: &ReadLimits) -> Allowance {
    let length = length as u64;
    Allowance {
        peak: limits.max_memory + FIXED + length * BYTES_PER_BYTE,
        time: Duration::from_millis(100)
            + Duration::from_nanos(length * NANOSECONDS_PER_BYTE + limits.max_memory * NANOSECONDS_OF_LIMIT),
    }
}

/// Tables of decompression and of messages, which do not grow with a file.
const FIXED: u64 = 1 << 19;
/// What is kept of each byte of the file without being counted.
const BYTES_PER_BYTE: u64 = 4;
/// Time for each byte of a file, and for each byte of memory that it may become.
const NANOSECONDS_PER_BYTE: u64 = 5_000;
const NANOSECONDS_OF_LIMIT: u64 = 50;

/// A frame that was read can be written in each format, and reads again.
fn reads_again(frame: &GaussianFrame) {
    // What is written may be longer than what was read.
    let limits = ReadLimits { max_memory: u64::MAX };
    let written = ply::write(frame);
    let back = ply::read(&written, &limits).expect("a PLY file of our own reads");
    assert!(ply::write(&back) == written, "PLY changes a frame");
    if let Ok(written) = splat::write(frame) {
        let back = splat::read(&written, &limits).expect("a .splat file of our own reads");
        assert_eq!(back.len(), frame.len());
    }
    if let Ok(written) = gltf::write(frame) {
        let back = gltf::read(&written, &limits).expect("a .glb file of our own reads");
        assert_eq!((back.len(), back.sh_degree()), (frame.len(), frame.sh_degree()));
    }
    if let Ok(written) = compressed_ply::write(frame) {
        let back = compressed_ply::read(&written, &limits).expect("a compressed PLY of our own reads");
        assert_eq!((back.len(), back.sh_degree()), (frame.len(), frame.sh_degree()));
    }
    if let Ok(written) = sog::write_zip(frame) {
        let back = sog::read_zip(&written, &limits).expect("a SOG archive of our own reads");
        assert_eq!((back.len(), back.sh_degree()), (frame.len(), frame.sh_degree()));
    }
    if let Ok(written) = spz::write(frame) {
        let back = spz::read(&written, &limits).expect("an SPZ file of our own reads");
        assert_eq!((back.len(), back.sh_degree()), (frame.len(), frame.sh_degree()));
    }
}
