//! What the formats of files cannot keep of decoded frames.

use super::format::Format;
use crate::encode::warnings::Warning;
use crate::numbers::counted;
use splatstream_files::spz::WriteOptions;
use splatstream_files::{Clamped, compressed_ply, gltf, splat, spz};
use splatstream_gaussians::GaussianFrame;

/// What was lost in the files written so far.
#[derive(Default)]
pub(super) struct Losses {
    /// By property: the first frame, and all values.
    clamped: Vec<(u32, Clamped)>,
    /// The highest degree of spherical harmonics that was left out.
    sh_degree: u8,
}

impl Losses {
    /// Takes note of a frame that was written.
    pub(super) fn add(&mut self, number: u32, frame: &GaussianFrame, format: Format) {
        let found = match format {
            // SOG chooses its ranges by the frame.
            Format::Ply | Format::Sog => return,
            Format::Glb => gltf::clamped(frame),
            Format::CompressedPly => compressed_ply::clamped(frame),
            Format::Spz => spz::clamped(frame, &WriteOptions::default()),
            Format::Splat => {
                self.sh_degree = self.sh_degree.max(frame.sh_degree());
                splat::clamped(frame)
            }
        };
        for found in found {
            match self.clamped.iter_mut().find(|(_, known)| known.property == found.property) {
                Some((_, known)) => known.count += found.count,
                None => self.clamped.push((number, found)),
            }
        }
    }

    /// In words.
    pub(super) fn warnings(&self, format: Format) -> Vec<Warning> {
        let name = format.extension();
        let clamped = self.clamped.iter().map(|(frame, Clamped { property, count, row, value })| {
            let message = format!(
                "{} of {property} outside the range of .{name} {} replaced by the end of the range, first that of Gaussian \
                 {row} of frame {frame} with {value}; --format ply keeps all values",
                counted(*count, "value"),
                if *count == 1 { "was" } else { "were" },
            );
            Warning::new("clamped-values", message)
        });
        let degree = self.sh_degree;
        let dropped = (degree > 0).then(|| {
            let message = format!(
                ".{name} has no spherical harmonics: those of the stream, degree {degree}, were left out; \
                 --format ply, glb, sog and spz keep them"
            );
            Warning::new("sh-dropped", message)
        });
        clamped.chain(dropped).collect()
    }
}
