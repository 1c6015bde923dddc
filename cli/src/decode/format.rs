//! The formats of files that decoded frames are written in.

use clap::ValueEnum;
use splatstream_files::{SceneError, compressed_ply, gltf, ply, sog, splat, spz};
use splatstream_gaussians::GaussianFrame;
use std::path::Path;

/// The formats that can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Standard Gaussian splatting PLY: keeps everything.
    Ply,
    /// SPZ: quantises what it keeps.
    Spz,
    /// 32 bytes per Gaussian: no spherical harmonics.
    Splat,
    /// glTF 2.0 with KHR_gaussian_splatting: keeps everything, as floats.
    Glb,
    /// SOG version 2: images that GPUs take as they are; Gaussians come in another order.
    Sog,
    /// PLY of packed vertices: quantises; Gaussians come in another order.
    CompressedPly,
}

impl Format {
    /// The format that the end of a file's name stands for.
    pub(super) fn of_name(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?.to_ascii_lowercase();
        // Compressed PLY before PLY.
        let known = [Self::CompressedPly, Self::Ply, Self::Spz, Self::Splat, Self::Glb, Self::Sog];
        known.into_iter().find(|format| name.ends_with(&format!(".{}", format.extension())))
    }

    /// The end of a file's name.
    pub(super) fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Spz => "spz",
            Self::Splat => "splat",
            Self::Glb => "glb",
            Self::Sog => "sog",
            Self::CompressedPly => "compressed.ply",
        }
    }

    pub(super) fn bytes(self, frame: &GaussianFrame) -> Result<Vec<u8>, SceneError> {
        match self {
            Self::Ply => Ok(ply::write(frame)),
            Self::Spz => spz::write(frame),
            Self::Splat => splat::write(frame),
            Self::Glb => gltf::write(frame),
            Self::Sog => sog::write_zip(frame),
            Self::CompressedPly => compressed_ply::write(frame),
        }
    }
}
