//! SS-TR-001 and SS-TR-002: what the network sees of the neighbours of new Gaussians.
//!
//! No sum overflows (annex F.6). Neighbours and lanes are within what the batch was made for, and others change nothing.

use super::{INPUTS_MAX, RANKS, act};
use splatstream_format::syntax::NetworkHeader;

/// Gaussians of a batch.
pub const LANES: usize = 16;

/// Tokens and relative positions of the neighbours of some new Gaussians, one a lane. Values are in -127..=127.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Batch {
    /// Neighbours of each Gaussian.
    neighbours: usize,
    /// Inputs of a token.
    inputs: usize,
    /// Row `j * inputs + k` is input k of neighbour j.
    tokens: Vec<[i8; LANES]>,
    /// Row `3 * j + a` is coordinate a of neighbour j.
    near: Vec<[i8; LANES]>,
}

/// A neighbour as a token is made of it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seen<'t> {
    /// The differences of the components of dc and sh to the base, in step/64 times 2^12.
    pub components: &'t [i64],
    /// log_scale, opacity and rotation less those of the new Gaussian.
    pub geometry: [i32; 7],
    /// Low bits of both that are ignored, 0 to 7.
    pub feature_shift: u8,
    /// Weight of 7.7.4 for dc.
    pub affinity: i64,
    /// Squared distance.
    pub distance: u64,
}

impl Batch {
    /// A batch of Gaussians that all have `neighbours` neighbours, 1 to 16; all values 0.
    pub fn new(header: &NetworkHeader, neighbours: usize) -> Self {
        let (neighbours, inputs) = (neighbours.min(RANKS), header.inputs());
        Self {
            neighbours,
            inputs,
            tokens: vec![[0; LANES]; neighbours.wrapping_mul(inputs)],
            near: vec![[0; LANES]; neighbours.wrapping_mul(3)],
        }
    }

    /// Neighbours of each Gaussian.
    pub fn neighbours(&self) -> usize {
        self.neighbours
    }

    /// The inputs of a neighbour, lane by lane.
    pub fn token(&self, neighbour: usize) -> &[[i8; LANES]] {
        let start = neighbour.wrapping_mul(self.inputs);
        self.tokens.get(start..start.wrapping_add(self.inputs)).unwrap_or_default()
    }

    /// The relative position of a neighbour, lane by lane.
    pub fn near(&self, neighbour: usize) -> &[[i8; LANES]] {
        let start = neighbour.wrapping_mul(3);
        self.near.get(start..start.wrapping_add(3)).unwrap_or_default()
    }

    /// Writes the token of a neighbour; `farthest` is the squared distance of the last one. SS-TR-001.
    pub fn set_token(
        &mut self,
        header: &NetworkHeader,
        (lane, neighbour): (usize, usize),
        seen: &Seen<'_>,
        farthest: u64,
    ) {
        let start = neighbour.wrapping_mul(self.inputs);
        let Some(rows) = self.tokens.get_mut(start..start.wrapping_add(self.inputs)) else { return };
        let ignored = u32::from(seen.feature_shift);
        let shift = u32::from(header.token_shift).wrapping_add(12).wrapping_add(ignored);
        let half = 1_i64.wrapping_shl(shift.wrapping_sub(1));
        let mut token = [0; INPUTS_MAX];
        let (components, rest) = token.split_at_mut_checked(header.outputs()).unwrap_or_default();
        for (input, sum) in components.iter_mut().zip(seen.components) {
            *input = sum.wrapping_add(half).wrapping_shr(shift).clamp(-127, 127) as i32;
        }
        let apart = seen.distance.wrapping_mul(127).checked_div(farthest.wrapping_add(1)).unwrap_or(0);
        let units = [4, 4, 4, 2, 1, 1, 1].into_iter().zip(seen.geometry);
        let rounded = |value: i32| value.wrapping_add(1_i32.wrapping_shl(ignored) >> 1).wrapping_shr(ignored);
        let geometry = units.map(|(unit, value)| rounded(value).wrapping_mul(unit).clamp(-127, 127));
        rest.iter_mut().zip(geometry.chain([apart as i32])).for_each(|(input, value)| *input = value);
        if header.gated() {
            let weight = seen.affinity as i32;
            token.iter_mut().for_each(|input| *input = act(input.wrapping_mul(weight), 12));
        }
        for (row, value) in rows.iter_mut().zip(token) {
            if let Some(slot) = row.get_mut(lane) {
                *slot = value as i8;
            }
        }
    }

    /// Writes the relative positions of all neighbours of a Gaussian: lattice steps from it. SS-TR-002.
    pub fn set_near(&mut self, lane: usize, offsets: &[[i32; 3]]) {
        let largest = offsets.iter().flatten().map(|offset| offset.abs()).max().unwrap_or(0).max(1);
        for (row, &offset) in self.near.iter_mut().zip(offsets.iter().flatten()) {
            let scaled = offset.wrapping_mul(254).wrapping_add(largest);
            let value = scaled.checked_div_euclid(largest.wrapping_mul(2)).unwrap_or(0);
            if let Some(slot) = row.get_mut(lane) {
                *slot = value as i8;
            }
        }
    }
}
