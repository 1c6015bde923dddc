//! Clause 7.9: the digests of lists of Gaussians.

use crate::cores;
use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use std::borrow::Cow;
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
    let digest = |(seed, plane): (u64, Plane<'_>)| match interrupt.is_requested() {
        true => 0,
        false => plane.digest(seed),
    };
    ListDigest(cores::map(range.len().saturating_mul(planes.len()), planes, digest))
}

enum Plane<'a> {
    Unsigned(&'a [u32]),
    Signed(&'a [i32]),
}

impl Plane<'_> {
    fn digest(&self, seed: u64) -> u64 {
        match self {
            Self::Unsigned(values) => digest_words(values, seed),
            Self::Signed(values) => digest_words(bytemuck::cast_slice(values), seed),
        }
    }
}

/// XXH64 of words as little-endian bytes, the same on any machine. Where words are so in memory they are hashed where they are.
fn digest_words(values: &[u32], seed: u64) -> u64 {
    let little = match cfg!(target_endian = "little") {
        true => Cow::Borrowed(values),
        false => Cow::Owned(values.iter().map(|value| value.to_le()).collect()),
    };
    xxh64(bytemuck::cast_slice(&little), seed)
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
