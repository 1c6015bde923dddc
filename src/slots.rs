//! Frames for renderers: every Gaussian keeps its place, and what has changed is told.

use crate::error::{Error, Result};
use crate::frame::Frame;
use core::hash::{BuildHasherDefault, Hasher};
use core::ops::Range;
use splatstream_gaussians::{Planes, PlanesRef, sh_coefficients};
use std::collections::HashMap;
use std::sync::OnceLock;

/// Planes of a fixed number of slots. A Gaussian has the same slot in every frame from the one that it appears in to the
/// one that it disappears in; a slot without a Gaussian has opacity 0 (its logit is minus infinity) and is 0 otherwise.
///
/// ```
/// # let stream = include_bytes!("../examples/talk.gss").to_vec();
/// let mut slots = splatstream::Slots::new(1000);
/// for frame in splatstream::Decoder::from_bytes(stream) {
///     let update = slots.update(&frame?)?;
///     for range in update.dirty {
///         // What a renderer copies to its buffers.
///         let x = &slots.planes().position[0][range];
///         assert!(x.iter().all(|x| x.is_finite()));
///     }
/// }
/// assert_eq!(slots.planes().opacity_logit.len(), 1000);
/// # Ok::<(), splatstream::Error>(())
/// ```
#[derive(Debug)]
pub struct Slots {
    capacity: usize,
    sh_degree: u8,
    planes: Planes,
    /// The Gaussians of the last frame, row by row: their identities, and their slots.
    identities: Vec<u32>,
    rows: Vec<u32>,
    /// Room for the slots of the next frame.
    spare: Vec<u32>,
    /// The slot of each identity, once somebody asks.
    slot_of: OnceLock<ByIdentity>,
    /// Slots without a Gaussian; the lowest is taken first.
    free: Vec<u32>,
    is_dirty: Vec<bool>,
}

/// What a frame has changed.
#[derive(Debug, Clone, PartialEq, Eq)]
#[must_use]
#[non_exhaustive]
pub struct Update {
    /// Runs of slots of which some plane has another value than before, increasing.
    pub dirty: Vec<Range<usize>>,
    /// Gaussians that keep their slot.
    pub kept: usize,
    /// Gaussians that have appeared.
    pub appeared: usize,
    /// Gaussians that have disappeared.
    pub disappeared: usize,
    /// The degree of the spherical harmonics has changed: there are more or fewer planes.
    pub has_new_planes: bool,
}

/// Numbers by identity.
type ByIdentity = HashMap<u32, u32, BuildHasherDefault<Spread>>;

/// Rows of the last frame that are looked at for the next Gaussian. Most keep their order, and few disappear at once; the
/// others are found by their identity.
const AHEAD: usize = 16;

/// Opacity before the sigmoid of a slot without a Gaussian.
const ABSENT: f32 = f32::NEG_INFINITY;

/// The slot of a Gaussian that has none yet. Planes of as many values do not fit in memory.
const NONE: u32 = u32::MAX;

/// Slots that are looked at for changes at once.
const GROUP: usize = 32;

impl Slots {
    /// Slots for frames of at most so many Gaussians.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            sh_degree: 0,
            planes: empty(capacity),
            identities: Vec::new(),
            rows: Vec::new(),
            spare: Vec::new(),
            slot_of: OnceLock::new(),
            free: (0..u32::try_from(capacity).unwrap_or(NONE)).rev().collect(),
            is_dirty: vec![false; capacity],
        }
    }

    /// How many slots there are.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// The planes, each of which has as many values as there are slots.
    pub fn planes(&self) -> &Planes {
        &self.planes
    }

    /// The slot of the Gaussian with an identity, if it is in the last frame.
    pub fn slot(&self, identity: u32) -> Option<usize> {
        let pairs = || self.identities.iter().copied().zip(self.rows.iter().copied());
        self.slot_of.get_or_init(|| pairs().collect()).get(&identity).map(|&slot| slot as usize)
    }

    /// Shows a frame.
    ///
    /// # Errors
    /// [`Error::TooFewSlots`] if the frame has more Gaussians than there are slots. The slots are as they were.
    pub fn update(&mut self, frame: &Frame) -> Result<Update> {
        if frame.len() > self.capacity {
            return Err(Error::TooFewSlots { needed: frame.len(), capacity: self.capacity });
        }
        let gaussians = frame.gaussians();
        let has_new_planes = self.sh_degree != gaussians.sh_degree();
        if has_new_planes {
            self.sh_degree = gaussians.sh_degree();
            let count = 3 * sh_coefficients(self.sh_degree);
            self.planes.sh.resize_with(count, || vec![0.0; self.capacity]);
        }
        let (slots, gone) = self.found(frame.identities());
        let kept = slots.iter().filter(|&&slot| slot != NONE).count();
        self.free.extend_from_slice(&gone);
        // Two runs that are in order already, or nearly: what sorts stably merges them.
        self.free.sort_by(|a, b| b.cmp(a));
        self.place(frame.identities(), slots);
        // The lowest were taken again, and are written as a whole.
        let lowest = self.free.last().copied().unwrap_or(NONE);
        gone.iter().filter(|&&slot| slot >= lowest).for_each(|&slot| self.clear(slot));
        write(&mut self.planes, gaussians.planes(), &runs(&self.rows), &mut self.is_dirty);
        let (appeared, disappeared) = (frame.len() - kept, gone.len());
        Ok(Update { dirty: self.take_dirty(), kept, appeared, disappeared, has_new_planes })
    }

    /// The slots of those identities that were in the last frame, and the slots of Gaussians that are gone.
    fn found(&mut self, identities: &[u32]) -> (Vec<u32>, Vec<u32>) {
        let mut slots = core::mem::take(&mut self.spare);
        slots.clear();
        slots.resize(identities.len(), NONE);
        if are_others(&self.identities, identities) {
            return (slots, self.rows.clone());
        }
        let (mut left, mut missing) = (Vec::new(), Vec::new());
        let (mut rest, mut rest_slots) = (self.identities.as_slice(), self.rows.as_slice());
        for (identities, slots) in identities.chunks(GROUP).zip(slots.chunks_mut(GROUP)) {
            // Most come as they did in the last frame.
            let (same, after) = rest.split_at_checked(identities.len()).unwrap_or_default();
            if same == identities {
                let (same_slots, after_slots) = rest_slots.split_at_checked(same.len()).unwrap_or_default();
                slots.copy_from_slice(same_slots);
                (rest, rest_slots) = (after, after_slots);
                continue;
            }
            for (&identity, slot) in identities.iter().zip(slots) {
                match rest.iter().take(AHEAD).position(|&other| other == identity) {
                    Some(skipped) => {
                        let (passed, next) = rest.split_at_checked(skipped).unwrap_or_default();
                        let (passed_slots, next_slots) =
                            rest_slots.split_at_checked(skipped).unwrap_or_default();
                        left.extend(passed.iter().copied().zip(passed_slots.iter().copied()));
                        *slot = next_slots.first().copied().unwrap_or(NONE);
                        rest = next.get(1..).unwrap_or_default();
                        rest_slots = next_slots.get(1..).unwrap_or_default();
                    }
                    None => missing.push((identity, slot)),
                }
            }
        }
        left.extend(rest.iter().copied().zip(rest_slots.iter().copied()));
        let mut gone = Vec::new();
        let mut others = ByIdentity::default();
        for (identity, slot) in left {
            // Identities are numbers of 32 bits: two Gaussians may have the same one.
            gone.extend(others.insert(identity, slot));
        }
        missing.into_iter().for_each(|(identity, slot)| *slot = others.remove(&identity).unwrap_or(NONE));
        gone.extend(others.into_values());
        (slots, gone)
    }

    /// Gives the Gaussians that have none a slot.
    fn place(&mut self, identities: &[u32], mut slots: Vec<u32>) {
        self.slot_of.take();
        // There are as many as are needed: the frame fits.
        let without = slots.iter_mut().filter(|slot| **slot == NONE);
        without.for_each(|slot| *slot = self.free.pop().unwrap_or(NONE));
        self.spare = core::mem::replace(&mut self.rows, slots);
        self.identities.clear();
        self.identities.extend_from_slice(identities);
    }

    fn clear(&mut self, slot: u32) {
        let slot = slot as usize;
        let set = |plane: &mut Vec<f32>, value| plane.get_mut(slot).into_iter().for_each(|to| *to = value);
        self.planes.iter_mut().for_each(|plane| set(plane, 0.0));
        set(&mut self.planes.opacity_logit, ABSENT);
        self.is_dirty.get_mut(slot).into_iter().for_each(|dirty| *dirty = true);
    }

    /// Runs of slots that have changed; none has after that.
    fn take_dirty(&mut self) -> Vec<Range<usize>> {
        let mut ranges: Vec<Range<usize>> = Vec::new();
        let mut add = |slots: Range<usize>| match ranges.last_mut() {
            Some(last) if last.end == slots.start => last.end = slots.end,
            _ => ranges.push(slots),
        };
        for (number, group) in self.is_dirty.chunks_mut(GROUP).enumerate() {
            let first = number * GROUP;
            match &*group {
                all if *all == [true; GROUP] => add(first..first + GROUP),
                none if *none == [false; GROUP] => continue,
                some => {
                    let slots = some.iter().enumerate().filter(|(_, is_dirty)| **is_dirty);
                    slots.for_each(|(slot, _)| add(first + slot..first + slot + 1));
                }
            }
            group.fill(false);
        }
        ranges
    }
}

/// Whether no identity can be in both lists, as where a GOP begins: all of one are below all of the other.
fn are_others(before: &[u32], after: &[u32]) -> bool {
    let bounds = |identities: &[u32]| identities.iter().min().copied().zip(identities.iter().max().copied());
    let apart = |((low, high), (other_low, other_high))| high < other_low || other_high < low;
    bounds(before).zip(bounds(after)).is_some_and(apart)
}

/// Rows that follow each other in slots that do so too.
struct Run {
    rows: Range<usize>,
    /// The slot of the first.
    slot: usize,
}

/// The runs of the slots of all rows. Gaussians seldom change their order, so that there are few.
fn runs(slots: &[u32]) -> Vec<Run> {
    let mut first = 0;
    let follow = slots.chunk_by(|slot, next| slot.checked_add(1) == Some(*next));
    let run = |slots: &[u32]| {
        let rows = first..first + slots.len();
        first = rows.end;
        Run { rows, slot: slots.first().map_or(0, |&slot| slot as usize) }
    };
    follow.map(run).collect()
}

/// Writes Gaussians to their slots, and takes note of those that change.
fn write(to: &mut Planes, from: PlanesRef<'_>, runs: &[Run], is_dirty: &mut [bool]) {
    for (to, from) in to.iter_mut().zip(from.iter()) {
        for Run { rows, slot } in runs {
            let slots = *slot..slot.saturating_add(rows.len());
            if let (Some(to), Some(is_dirty), Some(from)) =
                (to.get_mut(slots.clone()), is_dirty.get_mut(slots), from.get(rows.clone()))
            {
                let groups = to.chunks_mut(GROUP).zip(is_dirty.chunks_mut(GROUP)).zip(from.chunks(GROUP));
                groups.for_each(|((to, is_dirty), from)| write_group(to, from, is_dirty));
            }
        }
    }
}

/// Writes a plane of at most [`GROUP`] slots.
fn write_group(to: &mut [f32], from: &[f32], is_dirty: &mut [bool]) {
    // What an earlier plane has changed is not compared again.
    if *is_dirty == [true; GROUP] {
        to.copy_from_slice(from);
        return;
    }
    for ((to, is_dirty), value) in to.iter_mut().zip(is_dirty).zip(from) {
        *is_dirty |= to.to_bits() != value.to_bits();
        *to = *value;
    }
}

fn empty(capacity: usize) -> Planes {
    let mut planes = Planes::default();
    planes.iter_mut().for_each(|plane| plane.resize(capacity, 0.0));
    planes.opacity_logit.fill(ABSENT);
    planes
}

/// Spreads identities, which are consecutive numbers, over a table.
#[derive(Debug, Default)]
struct Spread(u64);

impl Hasher for Spread {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u32(byte.into()));
    }

    fn write_u32(&mut self, value: u32) {
        // The golden ratio in 64 bits.
        self.0 = (self.0 ^ u64::from(value)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}
