//! All machines calculate the same.

use super::*;
use proptest::prelude::*;

/// The vectors of this machine.
#[cfg(target_arch = "x86_64")]
fn wide() -> Option<Avx2<pulp::x86::V3>> {
    pulp::x86::V3::try_new().map(Avx2::new)
}

/// The vectors of this machine.
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
fn wide() -> Option<Simd128> {
    Some(Simd128)
}

/// There are no others to compare.
#[cfg(not(any(target_arch = "x86_64", all(target_arch = "wasm32", target_feature = "simd128"))))]
fn wide() -> Option<Portable> {
    None
}

/// Values of all sizes, signed and not.
fn vector() -> impl Strategy<Value = [u32; WIDE]> {
    proptest::array::uniform8(prop_oneof![0..STATE_LOW, any::<u32>(), Just(1 << 31)])
}

/// Values near 0, near the ends of 16 bits, and any.
fn signed() -> impl Strategy<Value = [u32; WIDE]> {
    let value = prop_oneof![-40_i32..40, -32_780..-32_750, 32_750..32_780, any::<i32>()];
    proptest::array::uniform8(value.prop_map(i32::cast_unsigned))
}

proptest! {
    #[test]
    fn vectors_calculate_as_the_text_says(a in vector(), b in vector()) {
        let (Some(wide), plain) = (wide(), Portable) else { return Ok(()) };
        let [x, y] = [a, b].map(|values| wide.load(values));
        prop_assert_eq!(wide.store(wide.add(x, y)), plain.add(a, b));
        prop_assert_eq!(wide.store(wide.sub(x, y)), plain.sub(a, b));
        prop_assert_eq!(wide.store(wide.mul(x, y)), plain.mul(a, b));
        prop_assert_eq!(wide.store(wide.dot(x, y)), plain.dot(a, b));
        prop_assert_eq!(wide.store(wide.and(x, y)), plain.and(a, b));
        prop_assert_eq!(wide.store(wide.or(x, y)), plain.or(a, b));
        prop_assert_eq!(wide.store(wide.xor(x, y)), plain.xor(a, b));
        prop_assert_eq!(wide.store(wide.shr::<12>(x)), plain.shr::<12>(a));
        prop_assert_eq!(wide.store(wide.greater(x, y)), plain.greater(a, b));
        prop_assert_eq!(wide.store(wide.magnitude(x)), plain.magnitude(a));
        prop_assert_eq!(wide.any(x), plain.any(a));
    }

    #[test]
    fn vectors_count_the_thresholds_that_values_reach(
        values in proptest::array::uniform4(signed()),
        thresholds in proptest::collection::vec(prop_oneof![-40_i16..40, -32_767..=i16::MAX, Just(-32_767)], 0..64),
    ) {
        let is_reached = |value: u32, threshold: i16| u32::from(i32::from(threshold) <= value.cast_signed());
        let count = |value: u32| thresholds.iter().map(|&threshold| is_reached(value, threshold)).sum();
        let expected = values.map(|values| values.map(count));
        prop_assert_eq!(Portable.reached(values, &thresholds), expected);
        let Some(wide) = wide() else { return Ok(()) };
        let counts = wide.reached(values.map(|values| wide.load(values)), &thresholds);
        prop_assert_eq!(counts.map(|counts| wide.store(counts)), expected);
    }

    #[test]
    fn vectors_take_the_words_that_lanes_take(
        states in vector(), next in vector(), lanes in 0_u32..256, words in any::<[u16; WIDE]>(),
    ) {
        let Some(wide) = wide() else { return Ok(()) };
        let mask: [u32; WIDE] = core::array::from_fn(|lane| (lanes >> lane & 1).wrapping_neg());
        let expected = Portable.advance(states, next, mask, &words);
        let (advanced, taken) = wide.advance(wide.load(states), wide.load(next), wide.load(mask), &words);
        prop_assert_eq!((wide.store(advanced), taken), expected);
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = pulp::x86::V4::try_new().map(Avx2::with_avx512) {
            let (advanced, taken) = wide.advance(wide.load(states), wide.load(next), wide.load(mask), &words);
            prop_assert_eq!((wide.store(advanced), taken), expected);
        }
    }

    #[test]
    fn rows_become_columns(rows in proptest::array::uniform8(vector())) {
        let Some(wide) = wide() else { return Ok(()) };
        let columns = wide.transpose(rows.map(|row| wide.load(row))).map(|column| wide.store(column));
        prop_assert_eq!(columns, Portable.transpose(rows));
        prop_assert_eq!(Portable.transpose(columns), rows);
    }
}
