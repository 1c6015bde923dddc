//! The order to draw Gaussians in: farthest first.

use splatstream::Planes;

/// Depths are told apart by so many bits of a binary32, sign excluded: to 1 part in 16,384.
const KEY_BITS: u32 = 22;
/// Bits that are sorted by at a time.
const DIGIT: u32 = 11;
const DIGIT_MASK: u32 = (1 << DIGIT) - 1;
/// The key of a slot that is not drawn: it is sorted behind all others.
const ABSENT: u32 = (1 << KEY_BITS) - 1;
/// Bits that are left for a slot beside a digit.
const SLOT_BITS: u32 = 32 - DIGIT;
/// What is nearer than this share of the mean depth is not drawn.
const NEAR: f32 = 1.0 / 256.0;

/// Slots, farthest first, and the room to sort them in.
#[derive(Default)]
pub struct Order {
    /// Slots with a Gaussian in front of the camera, farthest first.
    pub slots: Vec<u32>,
    /// Depth from which Gaussians are drawn: 1/256 of the geometric mean of those in front of the camera, as the renderer
    /// of this repository has it.
    pub near: f32,
    /// By slot; a small one is far.
    keys: Vec<u32>,
    other: Vec<u32>,
}

/// How many keys have each digit.
type Counts = [u32; 1 << DIGIT];

impl Order {
    /// Sorts by the depth along `ahead`, a unit vector, from `position`.
    ///
    /// By the low digit first. Between both passes a slot and its high digit share a word, where slots are few enough.
    pub fn sort(&mut self, planes: &Planes, position: [f32; 3], ahead: [f32; 3]) {
        let visible = self.find(planes, position, ahead);
        let Self { slots, keys, other, .. } = self;
        let (low, high) = counted(keys);
        other.resize(keys.len(), 0);
        slots.resize(keys.len(), 0);
        if keys.len() <= 1 << SLOT_BITS {
            let both = (0..)
                .zip(keys.iter())
                .map(|(slot, key)| (key & DIGIT_MASK, key >> DIGIT << SLOT_BITS | slot));
            scatter(both, low, other);
            scatter(other.iter().map(|both| (both >> SLOT_BITS, both & ((1 << SLOT_BITS) - 1))), high, slots);
        } else {
            scatter((0..).zip(keys.iter()).map(|(slot, key)| (key & DIGIT_MASK, slot)), low, other);
            let digit = |&slot: &u32| keys.get(slot as usize).map_or(0, |key| key >> DIGIT);
            scatter(other.iter().map(|slot| (digit(slot), *slot)), high, slots);
        }
        slots.truncate(visible);
    }

    /// Finds the keys, and how many Gaussians are in front of the camera.
    fn find(&mut self, planes: &Planes, position: [f32; 3], ahead: [f32; 3]) -> usize {
        let [x, y, z] = &planes.position;
        let offset: f32 = position.iter().zip(ahead).map(|(position, ahead)| position * ahead).sum();
        self.keys.clear();
        let (mut sum, mut visible) = (0_u64, 0_u32);
        let places = x.iter().zip(y).zip(z).zip(&planes.opacity_logit);
        self.keys.extend(places.map(|(((x, y), z), logit)| {
            let depth = x * ahead[0] + y * ahead[1] + z * ahead[2] - offset;
            let is_visible = depth > 0.0 && depth < f32::INFINITY && *logit > f32::NEG_INFINITY;
            // Bits of positive floats order as their values.
            let bits = depth.to_bits() & u32::MAX >> 1;
            sum += u64::from(if is_visible { bits } else { 0 });
            visible += u32::from(is_visible);
            if is_visible { ((bits ^ u32::MAX >> 1) >> (31 - KEY_BITS)).min(ABSENT - 1) } else { ABSENT }
        }));
        // The mean of the bits is close to the logarithm of the geometric mean.
        let mean = sum.checked_div(visible.into()).unwrap_or_default();
        self.near = (NEAR * f32::from_bits(mean as u32)).max(f32::MIN_POSITIVE);
        visible as usize
    }
}

/// How many keys have each low and each high digit.
fn counted(keys: &[u32]) -> (Counts, Counts) {
    let (mut low, mut high) = ([0; 1 << DIGIT], [0; 1 << DIGIT]);
    for key in keys {
        // Masks show that a digit is in range.
        low[(key & DIGIT_MASK) as usize] += 1;
        high[(key >> DIGIT & DIGIT_MASK) as usize] += 1;
    }
    (low, high)
}

/// Puts entries where their digits go: those with smaller ones first, and equals in their order.
fn scatter(entries: impl Iterator<Item = (u32, u32)>, mut counts: Counts, to: &mut [u32]) {
    let mut start = 0;
    for count in &mut counts {
        start += core::mem::replace(count, start);
    }
    for (digit, value) in entries {
        let place = &mut counts[(digit & DIGIT_MASK) as usize];
        if let Some(entry) = to.get_mut(*place as usize) {
            *entry = value;
        }
        *place += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_farthest_comes_first_and_what_is_behind_or_absent_does_not_come() {
        let depths = vec![3.0, -1.0, 100.0, 0.5, 7.0, 2.0];
        let mut planes = Planes { opacity_logit: vec![0.0; 6], ..Planes::default() };
        planes.position = [vec![0.0; 6], vec![0.0; 6], depths];
        planes.opacity_logit[4] = f32::NEG_INFINITY;
        let mut order = Order::default();
        order.sort(&planes, [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]);
        assert_eq!(order.slots, [2, 0, 5, 3]);
        assert!(order.near > 0.0 && order.near < 1.0);
    }

    /// Order of so many depths, seen from a place that all are in front of.
    fn sorted(count: u32) -> Vec<f32> {
        let depths: Vec<f32> =
            (0..count).map(|number| (number.wrapping_mul(2_654_435_761) % 9973) as f32).collect();
        let mut planes = Planes { opacity_logit: vec![0.0; depths.len()], ..Planes::default() };
        planes.position = [depths.clone(), vec![0.0; depths.len()], vec![0.0; depths.len()]];
        let mut order = Order::default();
        order.sort(&planes, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
        let mut slots = order.slots.clone();
        slots.sort_unstable();
        assert!(slots.into_iter().eq(0..count), "every slot is there once");
        order.slots.iter().map(|&slot| depths[slot as usize] + 1.0).collect()
    }

    #[test]
    fn many_depths_are_in_order() {
        for count in [1, 10_000, (1 << SLOT_BITS) + 1] {
            assert!(sorted(count).windows(2).all(|pair| pair[0] * 1.0002 >= pair[1]));
        }
    }
}
