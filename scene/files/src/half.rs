//! 16-bit floats, which several formats store.

/// A 16-bit float, exactly; `f16` is not stable.
pub(crate) fn float_of_half(half: u16) -> f32 {
    let sign = if half >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (half >> 10 & 0x1f, f32::from(half & 0x3ff));
    // Powers of two built from their bits are exact.
    let power = |exponent: u32| f32::from_bits(exponent << 23);
    sign * match exponent {
        0 => fraction * power(127 - 24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1024.0 + fraction) * power(127 - 25 + u32::from(exponent)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_exact() {
        let pairs = [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x0001, 5.960_464_5e-8),
            (0x7bff, 65504.0),
            (0x0400, 6.103_515_6e-5),
        ];
        for (half, float) in pairs {
            assert_eq!(float_of_half(half), float, "{half:#06x}");
        }
        assert!(float_of_half(0x7c00).is_infinite() && float_of_half(0x7e00).is_nan());
    }
}
