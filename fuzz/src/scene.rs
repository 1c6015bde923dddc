//! The readers of scene files, on any bytes.

use splatstream_files::{ReadLimits, SceneError, compressed_ply, ply, sog, splat, spz};
use splatstream_gaussians::GaussianFrame;

/// Small, so that an input which keeps within them is cheap.
pub const LIMITS: ReadLimits = ReadLimits { max_memory: 1 << 21 };

type Reader = fn(&[u8], &ReadLimits) -> Result<GaussianFrame, SceneError>;

/// The first byte of the input chooses one.
pub const READERS: [Reader; 5] = [ply::read, spz::read, splat::read, sog::read_zip, compressed_ply::read];

/// A reader refuses, or gives a frame that passes the checks of frames; what is then written reads again.
pub fn run(data: &[u8]) {
    let Some((choice, bytes)) = data.split_first() else { return };
    let Ok(frame) = READERS[usize::from(*choice) % READERS.len()](bytes, &LIMITS) else { return };
    assert_eq!(frame.validate(), Ok(()));
    // What is written may be longer than what was read.
    let limits = ReadLimits { max_memory: u64::MAX };
    let written = ply::write(&frame);
    let back = ply::read(&written, &limits).expect("a PLY file of our own reads");
    assert!(ply::write(&back) == written, "PLY changes a frame");
    if let Ok(written) = splat::write(&frame) {
        let back = splat::read(&written, &limits).expect("a .splat file of our own reads");
        assert_eq!(back.len(), frame.len());
    }
    if let Ok(written) = spz::write(&frame) {
        let back = spz::read(&written, &limits).expect("an SPZ file of our own reads");
        assert_eq!((back.len(), back.sh_degree()), (frame.len(), frame.sh_degree()));
    }
}
