//! What a decoder may take.

use splatstream_decoder::process::Budget;
use splatstream_format::Limits as FormatLimits;

/// What a [`Decoder`](crate::Decoder) may take. It refuses a stream that asks for more before it allocates anything.
///
/// The defaults are for a server that decodes what strangers send: no stream takes more than 2 GiB and some minutes of a core.
/// They are written `Limits { max_memory: .., ..Limits::default() }`: fields may be added in a version that breaks nothing else.
///
/// ```
/// use splatstream::Limits;
///
/// // A browser on a telephone.
/// let limits = Limits { max_memory: 256 << 20, ..Limits::default() };
/// assert!(limits.max_gaussians < Limits::UNLIMITED.max_gaussians);
/// // A broadcast that somebody watches: each frame is bounded, all frames together are not.
/// let endless = Limits::default().without_totals();
/// assert_eq!(endless.max_memory, Limits::default().max_memory);
/// ```
///
/// Three of the limits are totals. They count the frames from the first on, or from where a [seek](crate::Decoder::seek) went:
/// what a caller asks for again is no fault of the stream. A stream without an end reaches any total, so that a player takes
/// [`Limits::without_totals`]; what paces it is the clock, and it can [cancel](crate::Cancel).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes that are held at the same time: planes, frames that later ones refer to, values of units, the frame that is
    /// given out and its conversion to f32, and bytes of the stream that wait. Default 2 GiB. A static frame takes 300 bytes a
    /// Gaussian with spherical harmonics of degree 2 and 468 with degree 3, so that 4 Mi Gaussians of degree 3 take 1.9 GiB;
    /// in a predicted GOP of two temporal layers it is 1.7 KB of degree 2, for 1.2 million Gaussians.
    pub max_memory: u64,
    /// Gaussians of a frame. Default 4 Mi, as level 3 has them; level 4 allows 16 Mi, which take 7.3 GiB.
    pub max_gaussians: u32,
    /// Gaussians of all frames together. Default 2^28: 64 frames of 4 Mi, or a minute and a half of 100,000, 30 a second.
    pub max_total_gaussians: u64,
    /// Bytes of a unit, of which a frame has one for each refinement and layer. Default 64 MiB: 4 million Gaussians of degree 2
    /// at 50 dB take 32 MB in five units.
    pub max_unit: u32,
    /// Bytes of all frames together as planes of f32. Default 32 GiB: 53 frames of 4 Mi Gaussians of degree 2, each of 608 MiB, or
    /// 3,700 of 100,000 of degree 1.
    pub max_output: u64,
    /// Work on all frames together: values that are decoded, moved, hashed or predicted. Default 2^34. One core did 2 * 10^8 a
    /// second (4 million static Gaussians of degree 2, 1.7 * 10^8 values, in 0.86 s), which makes a minute and a half. Fuzzing
    /// allows a stream 30 nanoseconds a value besides what its bytes take, which would make nine minutes.
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

    /// The same for a stream of any length: without what bounds all frames together. Memory, Gaussians of a frame and bytes of a
    /// unit stay bounded, and so does what a frame takes.
    #[must_use]
    pub const fn without_totals(self) -> Self {
        Self { max_total_gaussians: u64::MAX, max_output: u64::MAX, max_work: u64::MAX, ..self }
    }

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
    /// For a server that decodes what strangers send. What each stands for is said at the fields.
    fn default() -> Self {
        Self {
            max_memory: 2 << 30,
            max_gaussians: 1 << 22,
            max_total_gaussians: 1 << 28,
            max_unit: 64 << 20,
            max_output: 32 << 30,
            max_work: 1 << 34,
        }
    }
}
