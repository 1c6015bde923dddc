//! Clause 7.5: a cell that moves, and the integers that its rotation is made of.
//!
//! A shift is at most 100, so that nothing leaves 128 bits.

/// The largest integer of a rotation component, and of the unit of rotations. Clause 7.6.3.
pub(crate) const UNIT_MAX: i64 = 32_767;

/// The square root, rounded down. Clause 7.5.
pub fn isqrt(value: u64) -> u64 {
    value.isqrt()
}

/// U: the integer that stands for 1 in units of rotation_step, min(32767, floor(1 / rotation_step + 1 / 2)).
/// Clause 7.5.
///
/// `rotation_step` is the bit pattern of the element, a binary32 of 2^-40 to 1.
pub fn rotation_unit(rotation_step: u32) -> i64 {
    // The step is mantissa / 2^shift; below 2^-76, where the unit is long 32767, the shift is cut.
    let mantissa = u128::from(rotation_step & 0x7F_FFFF | 0x80_0000);
    let shift = 150_u32.saturating_sub(rotation_step >> 23 & 0xFF).min(100);
    let unit = 2_u128.wrapping_shl(shift).wrapping_add(mantissa).checked_div(mantissa << 1).unwrap_or(0);
    i64::try_from(unit).unwrap_or(UNIT_MAX).min(UNIT_MAX)
}

/// A cell of the position grid and its motion. Clause 7.5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cell {
    /// Cell coordinates x, y, z: grid coordinates divided by 2^cell_log2.
    pub coordinates: [u32; 3],
    /// True if carried Gaussians in this cell are dropped once the frame has units that replace them.
    pub stale: bool,
    /// Shift in eighths of a grid step; -2^20 to 2^20.
    pub translation: [i32; 3],
    /// Vector part of a unit quaternion of positive real part, times 2^14; -8192 to 8192.
    pub rotation: [i32; 3],
}
