//! The two conversions between counts and the 64-bit floats of the controller. All else that the controller computes is
//! addition, multiplication, division and comparison, and logarithms in software, so that decisions are the same on every
//! machine.

/// A count as a float, rounded to the nearest from 2^53.
pub(crate) fn real(count: u64) -> f64 {
    let high = u32::try_from(count >> 32).unwrap_or(u32::MAX);
    let low = u32::try_from(count & 0xffff_ffff).unwrap_or(u32::MAX);
    f64::from(high) * 4_294_967_296.0 + f64::from(low)
}

/// The largest count up to a float; 0 for what is negative or no number.
#[allow(clippy::as_conversions, reason = "a conversion to an integer saturates; there is no other one")]
pub(crate) fn count(real: f64) -> u64 {
    real as u64
}

/// Microseconds as seconds.
pub(crate) fn seconds(us: u64) -> f64 {
    real(us) / 1e6
}

/// Seconds as microseconds, rounded down; 0 if negative.
pub(crate) fn microseconds(seconds: f64) -> u64 {
    count(seconds * 1e6)
}

/// An index or a length as a count.
pub(crate) fn size(length: usize) -> u64 {
    u64::try_from(length).unwrap_or(u64::MAX)
}
