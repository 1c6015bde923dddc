//! Clause 7.6.4: Morton deltas to grid positions.
//!
//! A code that has passed and a delta are below 2^60 each, so that no sum leaves 64 bits (annex F.3).

use splatstream_format::{Error, ErrorKind, Result};

/// Spreads the low 21 bits of `value` to every third bit.
pub fn spread(value: u32) -> u64 {
    let mut bits = u64::from(value) & 0x1F_FFFF;
    bits = (bits | bits << 32) & 0x001F_0000_0000_FFFF;
    bits = (bits | bits << 16) & 0x001F_0000_FF00_00FF;
    bits = (bits | bits << 8) & 0x100F_00F0_0F00_F00F;
    bits = (bits | bits << 4) & 0x10C3_0C30_C30C_30C3;
    (bits | bits << 2) & 0x1249_2492_4924_9249
}

/// Collects every third bit; the inverse of [`spread`].
#[inline(always)]
pub fn collect(code: u64) -> u32 {
    let mut bits = code & 0x1249_2492_4924_9249;
    bits = (bits | bits >> 2) & 0x10C3_0C30_C30C_30C3;
    bits = (bits | bits >> 4) & 0x100F_00F0_0F00_F00F;
    bits = (bits | bits >> 8) & 0x001F_0000_FF00_00FF;
    bits = (bits | bits >> 16) & 0x001F_0000_0000_FFFF;
    (bits | bits >> 32) as u32
}

/// The Morton code: bit 3b is bit b of x, 3b+1 of y, 3b+2 of z.
pub fn morton(x: u32, y: u32, z: u32) -> u64 {
    spread(x) | spread(y) << 1 | spread(z) << 2
}

/// The grid coordinate at the middle of a coarse cell.
#[inline(always)]
pub fn refine(coarse: u32, shift: u8) -> u32 {
    let shift = u32::from(shift);
    coarse.wrapping_shl(shift).wrapping_add(1_u32.wrapping_shl(shift) >> 1)
}

/// Writes the positions of a block from its Morton deltas: x, y, z.
///
/// `bits` is position_bits, `shift` position_shift of the unit; `at` goes into the error.
///
/// # Errors
/// Invalid if a code leaves the grid.
pub fn positions(deltas: &[u64], bits: u8, shift: u8, out: &mut [&mut [u32]], at: u64) -> Result<()> {
    let coarse_bits = u32::from(bits.saturating_sub(shift));
    let [xs, ys, zs] = out else { return Ok(()) };
    let mut code = 0_u64;
    let mut outside = 0_u64;
    for (((&delta, x), y), z) in deltas.iter().zip(xs.iter_mut()).zip(ys.iter_mut()).zip(zs.iter_mut()) {
        code = code.wrapping_add(delta);
        outside |= code.wrapping_shr(coarse_bits.wrapping_mul(3));
        *x = refine(collect(code), shift);
        *y = refine(collect(code >> 1), shift);
        *z = refine(collect(code >> 2), shift);
    }
    if outside != 0 {
        let rule = "a position lies outside the grid";
        return Err(Error::new(at, "7.6.4", ErrorKind::Constraint { rule }));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn collecting_undoes_spreading(x in 0_u32..1 << 20, y in 0_u32..1 << 20, z in 0_u32..1 << 20) {
            let code = morton(x, y, z);
            prop_assert_eq!([collect(code), collect(code >> 1), collect(code >> 2)], [x, y, z]);
        }
    }

    #[test]
    fn a_coarse_cell_is_shown_at_its_middle() {
        assert_eq!([refine(3, 0), refine(3, 1), refine(3, 2)], [3, 7, 14]);
    }
}
