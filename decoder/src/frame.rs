//! Clause 7.9: the canonical integer planes of a frame.

use crate::cores;
use crate::interrupt::Interrupt;
use splatstream_gaussians::{FrameError, MAX_SH_DEGREE, sh_planes};

/// Planes of a frame beside those of SH: positions, and others.
pub(crate) const PLANES: usize = 3 + SIGNED;
pub(crate) const SIGNED: usize = 10;

/// A reconstructed frame: integers on the grids of the sequence, Gaussians in coded order.
///
/// All planes have the same length.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct QuantizedFrame {
    /// Grid position x, y, z; below 2^position_bits.
    pub position: [Vec<u32>; 3],
    /// Log-scales in units of log_scale_step.
    pub log_scale: [Vec<i32>; 3],
    /// Opacity logit in units of opacity_step.
    pub opacity: Vec<i32>,
    /// Quaternion x, y, z in units of rotation_step; w follows from them.
    pub rotation: [Vec<i32>; 3],
    /// Red, green, blue in units of dc_step / 64.
    pub dc: [Vec<i32>; 3],
    /// SH planes in units of sh_step / 64; plane 3c + channel holds coefficient c.
    pub sh: Vec<Vec<i32>>,
}

/// A run of Gaussians of a frame, to be written.
#[derive(Debug)]
pub(crate) struct FrameSlice<'a> {
    /// Grid position x, y, z.
    pub(crate) position: Vec<&'a mut [u32]>,
    /// The other planes in canonical order: log-scale, opacity, rotation, dc, sh.
    pub(crate) planes: Vec<&'a mut [i32]>,
}

impl FrameSlice<'_> {
    /// Copies values into one of `planes`.
    pub(crate) fn write(&mut self, plane: usize, values: &[i32]) {
        for (slot, &value) in
            self.planes.get_mut(plane).into_iter().flat_map(|plane| plane.iter_mut()).zip(values)
        {
            *slot = value;
        }
    }
}

/// Splits the first `length` values off `rest`; none if there are fewer.
fn take<'a, T>(rest: &mut &'a mut [T], length: usize) -> Option<&'a mut [T]> {
    let (first, after) = core::mem::take(rest).split_at_mut_checked(length)?;
    *rest = after;
    Some(first)
}

impl QuantizedFrame {
    /// A frame of `count` Gaussians, every integer 0, with `sh_planes` SH planes.
    pub fn zeroed(count: usize, sh_planes: usize) -> Self {
        let position = [(); 3].map(|()| vec![0; count]);
        Self::of_planes(position, vec![vec![0; count]; SIGNED.saturating_add(sh_planes)])
    }

    /// A frame of planes in canonical order.
    pub(crate) fn of_planes(position: [Vec<u32>; 3], planes: Vec<Vec<i32>>) -> Self {
        let mut planes = planes.into_iter();
        // As many as were asked for.
        let mut next = || planes.next().unwrap_or_default();
        Self {
            position,
            log_scale: [next(), next(), next()],
            opacity: next(),
            rotation: [next(), next(), next()],
            dc: [next(), next(), next()],
            sh: planes.collect(),
        }
    }

    /// Divides the frame in runs of the given lengths, so that each can be written by itself; none if it is shorter than
    /// these together.
    pub(crate) fn slices(&mut self, lengths: &[usize]) -> Option<Vec<FrameSlice<'_>>> {
        let planes = SIGNED.saturating_add(self.sh.len());
        let mut slices: Vec<FrameSlice<'_>> = lengths
            .iter()
            .map(|_| FrameSlice { position: Vec::with_capacity(3), planes: Vec::with_capacity(planes) })
            .collect();
        let Self { position, log_scale, opacity, rotation, dc, sh } = self;
        for plane in position {
            let mut rest = plane.as_mut_slice();
            for (slice, &length) in slices.iter_mut().zip(lengths) {
                slice.position.push(take(&mut rest, length)?);
            }
        }
        let others = log_scale.iter_mut().chain([opacity]).chain(rotation).chain(dc).chain(sh);
        for plane in others {
            let mut rest = plane.as_mut_slice();
            for (slice, &length) in slices.iter_mut().zip(lengths) {
                slice.planes.push(take(&mut rest, length)?);
            }
        }
        Some(slices)
    }

    /// Checks what clause 7.10 builds on: all planes have one length, and there are the SH planes of a degree.
    ///
    /// # Errors
    /// The first plane that is of another length than x, other SH planes, or no such degree.
    pub fn check(&self, sh_degree: u8) -> Result<(), FrameError> {
        if sh_degree > MAX_SH_DEGREE {
            return Err(FrameError::ShDegree(sh_degree));
        }
        let (expected, found) = (sh_planes(sh_degree), self.sh.len());
        if found != expected {
            return Err(FrameError::ShPlanes { degree: sh_degree, expected, found });
        }
        let [x, y, z] = self.position.each_ref().map(Vec::len);
        let lengths = [x, y, z].into_iter().chain(self.signed_planes().map(Vec::len));
        match lengths.enumerate().find(|&(_, length)| length != x) {
            Some((plane, found)) => {
                Err(FrameError::Length { property: format!("canonical plane {plane}"), expected: x, found })
            }
            None => Ok(()),
        }
    }

    /// Gaussians in the frame.
    pub fn len(&self) -> usize {
        self.opacity.len()
    }

    /// Values of all planes.
    pub(crate) fn values(&self) -> usize {
        self.len().saturating_mul(self.sh.len().saturating_add(PLANES))
    }

    /// True if the frame has no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.opacity.is_empty()
    }

    /// Keeps the first `count` Gaussians.
    pub fn truncate(&mut self, count: usize) {
        self.position.iter_mut().for_each(|plane| plane.truncate(count));
        self.signed_planes_mut().for_each(|plane| plane.truncate(count));
    }

    /// A copy of the Gaussians in a range; none if there are no such Gaussians.
    #[must_use]
    pub fn part(&self, range: core::ops::Range<usize>) -> Option<Self> {
        self.part_unless(Interrupt::NEVER, range)
    }

    /// The same; where an interrupt is requested, planes are empty.
    pub(crate) fn part_unless(&self, interrupt: &Interrupt, range: core::ops::Range<usize>) -> Option<Self> {
        let range = || if interrupt.is_requested() { 0..0 } else { range.clone() };
        let mut part = Self::zeroed(0, self.sh.len());
        for (own, plane) in part.position.iter_mut().zip(&self.position) {
            own.extend_from_slice(plane.get(range())?);
        }
        for (own, plane) in part.signed_planes_mut().zip(self.signed_planes()) {
            own.extend_from_slice(plane.get(range())?);
        }
        Some(part)
    }

    /// Keeps the Gaussians whose flag is set.
    pub fn retain(&mut self, keep: &[bool]) {
        self.retain_unless(Interrupt::NEVER, keep);
    }

    /// The same; where an interrupt is requested, planes are left as they are.
    pub(crate) fn retain_unless(&mut self, interrupt: &Interrupt, keep: &[bool]) {
        let values = self.values();
        cores::for_each(interrupt, values, self.position.iter_mut(), |plane| retain(plane, keep));
        cores::for_each(interrupt, values, self.signed_planes_mut(), |plane| retain(plane, keep));
    }

    /// Appends the Gaussians of another frame with as many SH planes.
    pub fn append(&mut self, other: &Self) {
        self.append_unless(Interrupt::NEVER, other);
    }

    /// The same; where an interrupt is requested, planes are missing.
    pub(crate) fn append_unless(&mut self, interrupt: &Interrupt, other: &Self) {
        for (plane, more) in self.position.iter_mut().zip(&other.position) {
            plane.extend_from_slice(more);
        }
        let planes = self.signed_planes_mut().zip(other.signed_planes());
        cores::for_each(interrupt, other.values(), planes, |(plane, more)| plane.extend_from_slice(more));
    }

    /// The Gaussians of several frames, one after the other, in the memory of `all`, which has as many SH planes as they, and loses
    /// its own. Where an interrupt is requested, they mean nothing.
    pub(crate) fn joined(mut all: Self, parts: &[&Self], interrupt: &Interrupt) -> Self {
        let values = parts.iter().map(|part| part.values()).fold(0, usize::saturating_add);
        let positions: Vec<_> = parts.iter().map(|part| part.position.iter().collect()).collect();
        let joined = all.position.iter_mut().enumerate();
        cores::for_each(interrupt, values, joined, |(index, plane)| join(plane, &positions, index));
        let others: Vec<_> = parts.iter().map(|part| part.signed_planes().collect()).collect();
        let joined = all.signed_planes_mut().enumerate();
        cores::for_each(interrupt, values, joined, |(index, plane)| join(plane, &others, index));
        all
    }

    /// The planes after the positions, in canonical order: log-scale, opacity, rotation, dc, sh.
    pub fn signed_planes(&self) -> impl Iterator<Item = &Vec<i32>> {
        self.log_scale.iter().chain([&self.opacity]).chain(&self.rotation).chain(&self.dc).chain(&self.sh)
    }

    /// The same, to be changed.
    pub fn signed_planes_mut(&mut self) -> impl Iterator<Item = &mut Vec<i32>> {
        self.log_scale
            .iter_mut()
            .chain([&mut self.opacity])
            .chain(&mut self.rotation)
            .chain(&mut self.dc)
            .chain(&mut self.sh)
    }
}

/// Makes a plane of those at its index of all parts.
fn join<T: Copy>(plane: &mut Vec<T>, parts: &[Vec<&Vec<T>>], index: usize) {
    plane.clear();
    let own = || parts.iter().filter_map(|part| part.get(index));
    plane.reserve_exact(own().map(|part| part.len()).fold(0, usize::saturating_add));
    own().for_each(|part| plane.extend_from_slice(part));
}

/// Values that are moved at once where all of them are kept.
const KEPT: usize = 32;

/// Keeps the values whose flag is set; values without a flag stay.
///
/// Most are kept: groups of which all are move as a whole.
pub(crate) fn retain<T: Copy>(values: &mut Vec<T>, keep: &[bool]) {
    let (mut end, count) = (0_usize, values.len());
    let mut start = 0_usize;
    // Of more flags than values those beyond the last value say nothing.
    for flags in keep.get(..count).unwrap_or(keep).chunks(KEPT) {
        let next = start.saturating_add(flags.len());
        if flags == [true; KEPT] {
            values.copy_within(start..next, end);
            end = end.saturating_add(flags.len());
        } else {
            for (from, _) in (start..next).zip(flags).filter(|(_, keep)| **keep) {
                let value = values.get(from).copied();
                values.get_mut(end).zip(value).into_iter().for_each(|(slot, value)| *slot = value);
                end = end.saturating_add(1);
            }
        }
        start = next;
    }
    values.copy_within(start.., end);
    values.truncate(end.saturating_add(count.saturating_sub(start)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn values_without_a_flag_and_those_with_a_set_one_stay(
            count in 0_u32..300,
            mut keep in proptest::collection::vec(any::<bool>(), 0..300),
            all in 0_usize..300,
        ) {
            keep.iter_mut().skip(all).for_each(|keep| *keep = true);
            let mut values: Vec<u32> = (0..count).collect();
            let mut expected = values.clone();
            let mut flags = keep.iter();
            expected.retain(|_| flags.next().copied().unwrap_or(true));
            retain(&mut values, &keep);
            prop_assert_eq!(values, expected);
        }
    }
}
