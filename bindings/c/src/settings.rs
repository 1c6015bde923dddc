//! What a decoder is asked for.
#![expect(unsafe_code, reason = "an exported name may meet another one of the program")]

use splatstream::{Limits, OperatingPoint};

/// Which units of a stream are decoded. What the stream does not have is not missed: 255 on all axes takes everything.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct SplatstreamOperatingPoint {
    /// Highest spatial layer.
    pub spatial: u8,
    /// Highest temporal layer.
    pub temporal: u8,
    /// Highest refinement.
    pub refinement: u8,
}

impl From<OperatingPoint> for SplatstreamOperatingPoint {
    fn from(OperatingPoint { spatial, temporal, refinement }: OperatingPoint) -> Self {
        Self { spatial, temporal, refinement }
    }
}

impl From<SplatstreamOperatingPoint> for OperatingPoint {
    fn from(point: SplatstreamOperatingPoint) -> Self {
        let SplatstreamOperatingPoint { spatial, temporal, refinement } = point;
        Self { spatial, temporal, refinement }
    }
}

/// What a decoder may take. It refuses a stream that asks for more before it allocates anything.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct SplatstreamLimits {
    /// Bytes that are held at the same time, for planes, frames that later ones refer to, and input that waits.
    pub max_memory: u64,
    /// Gaussians of all frames together.
    pub max_total_gaussians: u64,
    /// Bytes of all frames together as planes of float.
    pub max_output: u64,
    /// Work on all frames together: values that are decoded, moved, hashed or predicted. A core does some 10^8 a second.
    pub max_work: u64,
    /// Gaussians of a frame.
    pub max_gaussians: u32,
    /// Bytes of a unit, of which a frame has one for each refinement and layer.
    pub max_unit: u32,
}

impl From<SplatstreamLimits> for Limits {
    fn from(limits: SplatstreamLimits) -> Self {
        Self {
            max_memory: limits.max_memory,
            max_gaussians: limits.max_gaussians,
            max_total_gaussians: limits.max_total_gaussians,
            max_unit: limits.max_unit,
            max_output: limits.max_output,
            max_work: limits.max_work,
        }
    }
}

/// The limits of a new decoder, which are for a server that decodes what strangers send: 2 GiB of memory, 4 Mi Gaussians
/// in a frame, 2^28 in all, 32 GiB of output, and some minutes of work for a core. A program that changes some starts with
/// these. A player of streams of any length sets the three totals to UINT64_MAX.
#[unsafe(no_mangle)]
pub extern "C" fn splatstream_limits_default() -> SplatstreamLimits {
    let limits = Limits::default();
    SplatstreamLimits {
        max_memory: limits.max_memory,
        max_total_gaussians: limits.max_total_gaussians,
        max_output: limits.max_output,
        max_work: limits.max_work,
        max_gaussians: limits.max_gaussians,
        max_unit: limits.max_unit,
    }
}
