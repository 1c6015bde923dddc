//! What an error resembles.

use serde::{Deserialize, Serialize};

/// What an error resembles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Symptom {
    /// No files were written at all.
    NothingWritten,
    /// The files are right for another operating point.
    OtherPoint,
    /// The files are right for the other mode.
    OtherMode,
    /// The frames are right, but their files have the names of other frames.
    OtherNumbers,
    /// All frames of a type are missing, and no others.
    TypeMissing,
    /// A frame has more or fewer Gaussians.
    OtherCount,
    /// The same Gaussians in another order.
    OtherOrder,
    /// The same planes in another order.
    OtherPlanes,
    /// Gaussian after Gaussian instead of plane after plane.
    Interleaved,
    /// The bytes of each value in reverse order.
    BigEndian,
    /// Values of two bytes.
    TwoBytes,
    /// A length that is not a multiple of four.
    PartOfValue,
    /// The values are those before compensation (7.8.3).
    Uncompensated,
    /// Every value that differs does so by one.
    OffByOne,
    /// Almost nothing is right.
    Unrelated,
}

impl Symptom {
    /// For people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::NothingWritten => "nothing was written",
            Self::OtherPoint => "the files are right for another operating point",
            Self::OtherMode => "the files are right for the other mode",
            Self::OtherNumbers => {
                "the frames are right under other indices; %04d is the display index, from 0"
            }
            Self::TypeMissing => "all frames of one type are missing",
            Self::OtherCount => "another number of Gaussians",
            Self::OtherOrder => "the same Gaussians in another order",
            Self::OtherPlanes => "the same planes in another order",
            Self::Interleaved => "the values stand Gaussian after Gaussian; write plane after plane",
            Self::BigEndian => "the values are big-endian; write little-endian",
            Self::TwoBytes => "the values have two bytes; write i32",
            Self::PartOfValue => "the length is not a whole number of i32 values",
            Self::Uncompensated => "the values are those before compensation (7.8.3)",
            Self::OffByOne => "what differs is off by one",
            Self::Unrelated => "almost nothing is right",
        }
    }
}
