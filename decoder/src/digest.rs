//! Clause 7.9: the digests of lists of Gaussians.

use crate::cores;
use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use core::ops::Range;
use std::borrow::Cow;
use xxhash_rust::xxh64::xxh64;

/// The XXH64 digests of the canonical planes of one list, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListDigest(Vec<u64>);

/// The digest of the list that the Gaussians `range` of some planes are; none if there are no such Gaussians. Plane p is
/// hashed with seed p.
pub fn list_digest(frame: &QuantizedFrame, range: Range<usize>) -> Option<ListDigest> {
    list_digest_unless(Interrupt::NEVER, frame, range)
}

/// The same; where an interrupt is requested, the digest means nothing.
pub(crate) fn list_digest_unless(
    interrupt: &Interrupt,
    frame: &QuantizedFrame,
    range: Range<usize>,
) -> Option<ListDigest> {
    let positions = frame.position.iter().map(|plane| plane.get(range.clone()).map(Plane::Unsigned));
    let others = frame.signed_planes().map(|plane| plane.get(range.clone()).map(Plane::Signed));
    let planes: Option<Vec<Plane<'_>>> = positions.chain(others).collect();
    planes.map(|planes| hashed(interrupt, range.len(), planes))
}

/// The digest of the list that all Gaussians of some planes are. Where an interrupt is requested, it means nothing.
pub(crate) fn whole_digest_unless(interrupt: &Interrupt, frame: &QuantizedFrame) -> ListDigest {
    let positions = frame.position.iter().map(|plane| Plane::Unsigned(plane));
    let others = frame.signed_planes().map(|plane| Plane::Signed(plane));
    hashed(interrupt, frame.len(), positions.chain(others).collect())
}

/// The digests of planes of so many values.
fn hashed(interrupt: &Interrupt, count: usize, planes: Vec<Plane<'_>>) -> ListDigest {
    let digest = |(seed, plane): (u64, Plane<'_>)| match interrupt.is_requested() {
        true => 0,
        false => plane.digest(seed),
    };
    let values = count.saturating_mul(planes.len());
    ListDigest(cores::map(values, (0_u64..).zip(planes).collect(), digest))
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
        let digest = |frame: &QuantizedFrame| lists_digest(&[list_digest(frame, 0..3000).unwrap()]);
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
    fn all_gaussians_are_the_list_of_their_range_and_others_are_none() {
        let frame = frame();
        assert_eq!(list_digest(&frame, 0..3000), Some(whole_digest_unless(Interrupt::NEVER, &frame)));
        assert_eq!([2999..3001, 3001..3001].map(|range| list_digest(&frame, range)), [None, None]);
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
