//! The frames of the last operating point, which is everything: written, and compared with what they should be.

use super::frame_path;
use crate::compare::errors::{AttributeErrors, ErrorSums};
use crate::compare::{Match, compare_frames};
use crate::failure::Failure;
use crate::output_file::{OutputFile, make_directory};
use splatstream_files::ply;
use splatstream_gaussians::GaussianFrame;
use std::path::PathBuf;

/// What the decoded frames leave behind.
pub(super) struct Everything<'a> {
    /// Where the frames go.
    directory: PathBuf,
    /// The first frame of the source: it says enough about the errors of a scene like this one.
    first: Option<&'a GaussianFrame>,
    errors: ErrorSums,
    /// Those of the decoder, of all frames so far.
    digests: Vec<u64>,
}

impl<'a> Everything<'a> {
    /// Makes the directory.
    pub(super) fn start(directory: PathBuf, first: Option<&'a GaussianFrame>) -> Result<Self, Failure> {
        make_directory(&directory)?;
        Ok(Self { directory, first, errors: ErrorSums::default(), digests: Vec::new() })
    }

    /// Takes a decoded frame: writes it, and compares the first with that of the source.
    pub(super) fn take(
        &mut self,
        number: u32,
        digest: Option<u64>,
        frame: &GaussianFrame,
    ) -> Result<(), Failure> {
        OutputFile::write(&frame_path(&self.directory, number as usize), &ply::write(frame))?;
        self.digests.extend(digest);
        if let Some(first) = self.first.filter(|_| number == 0) {
            compare_frames(first, frame, Match::Auto, &mut self.errors);
        }
        Ok(())
    }

    /// The errors, if the digests are those that the encoder says they are.
    pub(super) fn verified(&self, digests: &[u64]) -> Result<AttributeErrors, Failure> {
        if self.digests != digests {
            return Err(Failure::other("the decoder's digests are not the encoder's: please report this"));
        }
        Ok(self.errors.errors())
    }
}
