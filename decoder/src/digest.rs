//! Clause 7.9: the digests of lists of Gaussians.

use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use rayon::prelude::*;
use xxhash_rust::xxh64::{Xxh64, xxh64};

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
            Self::Unsigned(values) => digest_words(values, seed, |&value| value.to_le_bytes()),
            Self::Signed(values) => digest_words(values, seed, |&value| value.to_le_bytes()),
        }
    }
}

/// Hashes words as little-endian bytes, a buffer at a time: the same on any machine.
fn digest_words<T>(values: &[T], seed: u64, bytes_of: impl Fn(&T) -> [u8; 4]) -> u64 {
    let mut hasher = Xxh64::new(seed);
    let mut buffer = [0_u8; 4096];
    for chunk in values.chunks(1024) {
        for (bytes, value) in buffer.chunks_exact_mut(4).zip(chunk) {
            bytes.copy_from_slice(&bytes_of(value));
        }
        hasher.update(buffer.get(..chunk.len().wrapping_mul(4)).unwrap_or_default());
    }
    hasher.digest()
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
        let values: Vec<i32> = (-1500..1500).collect();
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        assert_eq!(Plane::Signed(&values).digest(9), xxh64(&bytes, 9));
    }
}
