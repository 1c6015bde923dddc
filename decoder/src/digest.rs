//! Clause 7.9: the digests of lists of Gaussians.

use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use rayon::prelude::*;
use xxhash_rust::xxh64::xxh64;

/// The XXH64 digests of the canonical planes of one list, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListDigest(Vec<u64>);

/// The digest of the list that the Gaussians `range` of some planes are; plane p is hashed with seed p.
pub fn list_digest(frame: &QuantizedFrame, range: core::ops::Range<usize>) -> ListDigest {
    list_digest_unless(Interrupt::NEVER, frame, range)
}

/// The same; where an interrupt is requested, the digest means nothing.
pub(crate) fn list_digest_unless(
    interrupt: &Interrupt,
    frame: &QuantizedFrame,
    range: core::ops::Range<usize>,
) -> ListDigest {
    let positions = frame.position.iter().map(|plane| {
        let part = plane.get(range.clone()).unwrap_or_default();
        Plane::Unsigned(part)
    });
    let others =
        frame.signed_planes().map(|plane| Plane::Signed(plane.get(range.clone()).unwrap_or_default()));
    let planes: Vec<(u64, Plane<'_>)> = (0_u64..).zip(positions.chain(others)).collect();
    let digest = |(seed, plane): &(u64, Plane<'_>)| match interrupt.is_requested() {
        true => 0,
        false => plane.digest(*seed),
    };
    ListDigest(planes.par_iter().map(digest).collect())
}

enum Plane<'a> {
    Unsigned(&'a [u32]),
    Signed(&'a [i32]),
}

impl Plane<'_> {
    fn digest(&self, seed: u64) -> u64 {
        match self {
            Self::Unsigned(values) => digest_words(values, seed, |value| value),
            Self::Signed(values) => digest_words(values, seed, i32::cast_unsigned),
        }
    }
}

const PRIMES: [u64; 5] = [
    0x9E37_79B1_85EB_CA87,
    0xC2B2_AE3D_27D4_EB4F,
    0x1656_67B1_9E37_79F9,
    0x85EB_CA77_C2B2_AE63,
    0x27D4_EB2F_1656_67C5,
];

/// XXH64 of words as little-endian bytes, the same on any machine. The words are hashed where they are: a function of bytes
/// would need them copied first.
fn digest_words<T: Copy>(values: &[T], seed: u64, word: impl Fn(T) -> u32 + Copy) -> u64 {
    let [first, second, _, _, fifth] = PRIMES;
    let pair = |low: T, high: T| u64::from(word(low)) | u64::from(word(high)).wrapping_shl(32);
    let (stripes, rest) = values.as_chunks::<8>();
    let mut sums = [seed.wrapping_add(first).wrapping_add(second), seed.wrapping_add(second), seed];
    let mut last = seed.wrapping_sub(first);
    for &[a, b, c, d, e, f, g, h] in stripes {
        let [x, y, z] = sums;
        sums = [round(x, pair(a, b)), round(y, pair(c, d)), round(z, pair(e, f))];
        last = round(last, pair(g, h));
    }
    let mut hash = seed.wrapping_add(fifth);
    if !stripes.is_empty() {
        let [x, y, z] = sums;
        hash = x.rotate_left(1).wrapping_add(y.rotate_left(7));
        hash = hash.wrapping_add(z.rotate_left(12)).wrapping_add(last.rotate_left(18));
        hash = [x, y, z, last].into_iter().fold(hash, merged);
    }
    hash = hash.wrapping_add((values.len() as u64).wrapping_mul(4));
    finished(hash, rest, word, pair)
}

/// The words after the last whole stripe, fewer than 8, and the end of the hash.
fn finished<T: Copy>(mut hash: u64, rest: &[T], word: impl Fn(T) -> u32, pair: impl Fn(T, T) -> u64) -> u64 {
    let [first, second, third, fourth, _] = PRIMES;
    let (pairs, single) = rest.as_chunks::<2>();
    for &[low, high] in pairs {
        hash ^= round(0, pair(low, high));
        hash = hash.rotate_left(27).wrapping_mul(first).wrapping_add(fourth);
    }
    for &value in single {
        hash ^= u64::from(word(value)).wrapping_mul(first);
        hash = hash.rotate_left(23).wrapping_mul(second).wrapping_add(third);
    }
    hash = (hash ^ hash >> 33).wrapping_mul(second);
    hash = (hash ^ hash >> 29).wrapping_mul(third);
    hash ^ hash >> 32
}

#[inline(always)]
fn round(sum: u64, lane: u64) -> u64 {
    let [first, second, ..] = PRIMES;
    sum.wrapping_add(lane.wrapping_mul(second)).rotate_left(31).wrapping_mul(first)
}

fn merged(hash: u64, sum: u64) -> u64 {
    let [first, _, _, fourth, _] = PRIMES;
    (hash ^ round(0, sum)).wrapping_mul(first).wrapping_add(fourth)
}

/// The digest of several lists, one after the other.
pub fn lists_digest(lists: &[ListDigest]) -> u64 {
    let bytes: Vec<u8> =
        lists.iter().flat_map(|list| list.0.iter().flat_map(|digest| digest.to_le_bytes())).collect();
    xxh64(&bytes, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> QuantizedFrame {
        let mut frame = QuantizedFrame::zeroed(0, 0);
        let plane: Vec<i32> = (0..3000).collect();
        frame.position = [(); 3].map(|()| (0..3000).collect());
        frame.log_scale = [(); 3].map(|()| plane.clone());
        frame.opacity.clone_from(&plane);
        frame.rotation = [(); 3].map(|()| plane.clone());
        frame.dc = [(); 3].map(|()| plane.clone());
        frame
    }

    // covers: SS-DG-001
    #[test]
    fn any_change_of_value_order_or_plane_changes_the_digest() {
        let original = frame();
        let digest = |frame: &QuantizedFrame| lists_digest(&[list_digest(frame, 0..3000)]);
        let mut changed = original.clone();
        changed.dc[2][2999] ^= 1;
        assert_ne!(digest(&original), digest(&changed));
        let mut swapped = original.clone();
        swapped.rotation[1].swap(5, 6);
        assert_ne!(digest(&original), digest(&swapped));
        let mut planes = original.clone();
        planes.opacity[0] = 7;
        let mut other = original.clone();
        other.dc[0][0] = 7;
        assert_ne!(digest(&planes), digest(&other));
    }

    #[test]
    fn a_plane_is_hashed_as_one_run_of_little_endian_words() {
        let values: Vec<i32> = (-1500..1500).map(|value: i32| value.wrapping_mul(0x0123_4567)).collect();
        for (count, seed) in (0..70).chain([2999, 3000]).zip([0, 9, u64::MAX].into_iter().cycle()) {
            let bytes: Vec<u8> = values[..count].iter().flat_map(|value| value.to_le_bytes()).collect();
            assert_eq!(Plane::Signed(&values[..count]).digest(seed), xxh64(&bytes, seed), "{count}");
        }
    }
}
