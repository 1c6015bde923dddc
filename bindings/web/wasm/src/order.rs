//! The order to draw Gaussians in: farthest first.

use splatstream::Planes;

/// Depths are told apart by so many bits of a binary32, sign excluded: to 1 part in 16,384.
const KEY_BITS: u32 = 22;
/// Bits that are sorted by at a time.
const DIGIT: u32 = 11;
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
    keys: Vec<u32>,
    other: Vec<(u32, u32)>,
}

impl Order {
    /// Sorts by the depth along `ahead`, a unit vector, from `position`.
    pub fn sort(&mut self, planes: &Planes, position: [f32; 3], ahead: [f32; 3]) {
        self.find(planes, position, ahead);
        let mask = (1 << DIGIT) - 1;
        let low = starts(self.keys.iter().map(|key| key & mask));
        let high = starts(self.keys.iter().map(|key| key >> DIGIT));
        self.other.clear();
        self.other.resize(self.keys.len(), (0, 0));
        scatter(self.keys.iter().copied().zip(self.slots.iter().copied()), low, &mut self.other, |entry| {
            (entry.0 & mask, entry)
        });
        scatter(self.other.iter().copied(), high, &mut self.slots, |(key, slot)| (key >> DIGIT, slot));
    }

    /// Finds the slots in front of the camera, and their keys: a small one is far.
    fn find(&mut self, planes: &Planes, position: [f32; 3], ahead: [f32; 3]) {
        let [x, y, z] = &planes.position;
        let offset: f32 = position.iter().zip(ahead).map(|(position, ahead)| position * ahead).sum();
        self.slots.clear();
        self.keys.clear();
        let mut sum = 0_u64;
        let places = x.iter().zip(y).zip(z).zip(&planes.opacity_logit);
        for (slot, (((x, y), z), logit)) in (0..).zip(places) {
            let depth = x * ahead[0] + y * ahead[1] + z * ahead[2] - offset;
            if depth > 0.0 && depth.is_finite() && *logit > f32::NEG_INFINITY {
                sum = sum.saturating_add(depth.to_bits().into());
                self.slots.push(slot);
                // Bits of positive floats order as their values.
                self.keys.push((u32::MAX >> 1 ^ depth.to_bits()) >> (31 - KEY_BITS));
            }
        }
        // The mean of the bits is close to the logarithm of the geometric mean.
        let mean = sum.checked_div(self.slots.len() as u64).unwrap_or_default();
        self.near = (NEAR * f32::from_bits(mean as u32)).max(f32::MIN_POSITIVE);
    }
}

/// Where the entries of each digit start.
fn starts(digits: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut counts = vec![0_u32; 1 << DIGIT];
    for digit in digits {
        if let Some(count) = counts.get_mut(digit as usize) {
            *count += 1;
        }
    }
    let mut start = 0;
    for count in &mut counts {
        let here = *count;
        *count = start;
        start += here;
    }
    counts
}

/// Puts entries where their digits go.
fn scatter<T: Copy, U>(
    entries: impl Iterator<Item = T>,
    mut starts: Vec<u32>,
    to: &mut [U],
    part: impl Fn(T) -> (u32, U),
) {
    for entry in entries {
        let (digit, value) = part(entry);
        let Some(start) = starts.get_mut(digit as usize) else { continue };
        if let Some(place) = to.get_mut(*start as usize) {
            *place = value;
        }
        *start += 1;
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

    #[test]
    fn many_depths_are_in_order() {
        let depths: Vec<f32> =
            (0..10_000_u32).map(|number| (number.wrapping_mul(2_654_435_761) % 9973) as f32).collect();
        let mut planes = Planes { opacity_logit: vec![0.0; depths.len()], ..Planes::default() };
        planes.position = [depths.clone(), vec![0.0; depths.len()], vec![0.0; depths.len()]];
        let mut order = Order::default();
        order.sort(&planes, [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
        assert_eq!(order.slots.len(), depths.len());
        let sorted: Vec<f32> = order.slots.iter().map(|&slot| depths[slot as usize] + 1.0).collect();
        assert!(sorted.windows(2).all(|pair| pair[0] * 1.0002 >= pair[1]));
    }
}
