//! What a reader changed on the way into a frame, where a user should know of it.

use std::fmt;

/// The highest SH degree that any format has; frames hold up to degree 3.
pub(crate) const MOST_SH_DEGREE: u8 = 4;

/// Something that a file has and a frame cannot hold, or that a file lacks and a frame needs. The frame is good, and not all
/// that the file is.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Note {
    /// Spherical harmonics were cut to degree 3.
    ShDegree {
        /// The degree of the file, 4.
        found: u8,
    },
    /// The Gaussians of the file are flat (2DGS): they have two semi-axes, and were given a third.
    Flat {
        /// Natural log of the third semi-axis, the same for all.
        log_scale: f32,
    },
    /// Meshes and points that are no Gaussians were left out.
    OtherPrimitives {
        /// How many primitives.
        count: u64,
    },
    /// Gaussians that nothing can show were left out: values that are not finite, no opacity, no size or no rotation.
    Unusable {
        /// How many.
        count: u64,
    },
    /// Opacities were exactly 0 or 1, and were taken half a step of 8 bits inside.
    ExactOpacity {
        /// Of how many Gaussians.
        count: u64,
    },
    /// Colours are in linear light, and were encoded as sRGB.
    LinearColours,
    /// Something follows what the file says it has, and was left out.
    TrailingBytes {
        /// How many bytes.
        count: u64,
    },
}

impl Note {
    /// A word for programs, which does not change: `sh-reduced`, `flat`, `other-primitives`, `unusable`,
    /// `exact-opacity`, `linear-colours`, `trailing-bytes`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::ShDegree { .. } => "sh-reduced",
            Self::Flat { .. } => "flat",
            Self::OtherPrimitives { .. } => "other-primitives",
            Self::Unusable { .. } => "unusable",
            Self::ExactOpacity { .. } => "exact-opacity",
            Self::LinearColours => "linear-colours",
            Self::TrailingBytes { .. } => "trailing-bytes",
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |count: u64, one: &str, more: &str| match count {
            1 => format!("1 {one} was"),
            _ => format!("{count} {more} were"),
        };
        match self {
            Self::ShDegree { found } => write!(
                f,
                "spherical harmonics of degree {found} were reduced to degree 3; the coefficients of higher degrees were \
                 left out"
            ),
            Self::Flat { log_scale } => write!(
                f,
                "Gaussians have two semi-axes (2DGS); each was given a third of {:.0e}, and is drawn as a thin ellipsoid",
                libm::exp(f64::from(*log_scale))
            ),
            Self::OtherPrimitives { count } => {
                write!(f, "{} left out: only Gaussians are read", number(*count, "mesh primitive", "mesh primitives"))
            }
            Self::Unusable { count } => write!(
                f,
                "{} left out: their values are not finite, or they have no opacity, size or rotation",
                number(*count, "Gaussian", "Gaussians")
            ),
            Self::ExactOpacity { count } => write!(
                f,
                "{} exactly 0 or 1 (an infinite logit), and taken half a step of 8 bits inside",
                number(*count, "opacity", "opacities")
            ),
            Self::LinearColours => f.write_str(
                "colours are in linear light and were encoded as sRGB, each by itself; pictures differ where translucent \
                 Gaussians cover each other, since sRGB is blended otherwise",
            ),
            Self::TrailingBytes { count } => write!(
                f,
                "{} left out: they follow the last element of the header; where files were joined, give each by itself",
                number(*count, "byte", "bytes")
            ),
        }
    }
}
