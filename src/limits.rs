//! What a decoder may take.

use splatstream_decoder::budget::Budget;
use splatstream_format::Limits as FormatLimits;

/// What a [`Decoder`](crate::Decoder) may take. It refuses a stream that asks for more before it allocates anything.
///
/// ```
/// use splatstream::Limits;
///
/// // A browser on a telephone.
/// let limits = Limits { max_memory: 256 << 20, ..Limits::default() };
/// assert!(limits.max_gaussians < Limits::UNLIMITED.max_gaussians);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes that are held at the same time: planes, frames that later ones refer to, values of units, the frame that is
    /// given out and its conversion to f32, and bytes of the stream that wait.
    pub max_memory: u64,
    /// Gaussians of a frame.
    pub max_gaussians: u32,
    /// Gaussians of all frames together.
    pub max_total_gaussians: u64,
    /// Bytes of a unit, of which a frame has one for each refinement and layer.
    pub max_unit: u32,
    /// Bytes of all frames together as planes of f32.
    pub max_output: u64,
    /// Work on all frames together: values that are decoded, moved, hashed or predicted. A core does some 10^8 a second.
    pub max_work: u64,
}

impl Limits {
    /// What the highest level of the specification allows.
    pub const UNLIMITED: Self = {
        let level = FormatLimits::of_level(4);
        Self {
            max_memory: u64::MAX,
            max_gaussians: level.max_gaussians,
            max_total_gaussians: u64::MAX,
            max_unit: level.max_payload,
            max_output: u64::MAX,
            max_work: u64::MAX,
        }
    };

    pub(crate) fn of_format(&self) -> FormatLimits {
        let allowed = FormatLimits::of_level(4);
        FormatLimits {
            max_gaussians: self.max_gaussians.min(allowed.max_gaussians),
            max_payload: self.max_unit.min(allowed.max_payload),
            max_learned: self.max_gaussians.min(allowed.max_gaussians) / 2,
            ..allowed
        }
    }

    pub(crate) const fn budget(&self) -> Budget {
        Budget {
            memory: self.max_memory,
            gaussians: self.max_total_gaussians,
            output: self.max_output,
            work: self.max_work,
        }
    }
}

impl Default for Limits {
    /// For a server that decodes what strangers send: 2 GiB of memory, 4 Mi Gaussians in a frame, 2^32 in all, units of
    /// 64 MiB, 256 GiB of output, and an hour or so of work for a core.
    fn default() -> Self {
        Self {
            max_memory: 2 << 30,
            max_gaussians: 1 << 22,
            max_total_gaussians: 1 << 32,
            max_unit: 64 << 20,
            max_output: 256 << 30,
            max_work: 1 << 38,
        }
    }
}
