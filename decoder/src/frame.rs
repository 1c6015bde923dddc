//! Clause 7.9: the canonical integer planes of a frame.

use rayon::prelude::*;

/// A reconstructed frame: integers on the lattices of the sequence, Gaussians in coded order.
///
/// All planes have the same length.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct QuantizedFrame {
    /// Lattice position x, y, z; below 2^position_bits.
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

impl QuantizedFrame {
    /// An empty frame with `sh_planes` SH planes and room for `count` Gaussians.
    pub fn with_capacity(count: usize, sh_planes: usize) -> Self {
        let planes = || [(); 3].map(|()| Vec::with_capacity(count));
        Self {
            position: [(); 3].map(|()| Vec::with_capacity(count)),
            log_scale: planes(),
            opacity: Vec::with_capacity(count),
            rotation: planes(),
            dc: planes(),
            sh: (0..sh_planes).map(|_| Vec::with_capacity(count)).collect(),
        }
    }

    /// Gaussians in the frame.
    pub fn len(&self) -> usize {
        self.opacity.len()
    }

    /// True if the frame has no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.opacity.is_empty()
    }

    /// Appends blocks that have as many SH planes, one plane a task.
    pub fn append(&mut self, blocks: &[Self]) {
        for (axis, plane) in self.position.iter_mut().enumerate() {
            for more in blocks.iter().filter_map(|block| block.position.get(axis)) {
                plane.extend_from_slice(more);
            }
        }
        let mut parts: Vec<(&mut Vec<i32>, Vec<&[i32]>)> =
            self.signed_planes_mut().map(|plane| (plane, Vec::with_capacity(blocks.len()))).collect();
        for block in blocks {
            for ((_, parts), part) in parts.iter_mut().zip(block.signed_planes()) {
                parts.push(part);
            }
        }
        parts
            .into_par_iter()
            .for_each(|(plane, parts)| parts.iter().for_each(|part| plane.extend_from_slice(part)));
    }

    /// Keeps the first `count` Gaussians.
    pub fn truncate(&mut self, count: usize) {
        self.position.iter_mut().for_each(|plane| plane.truncate(count));
        self.signed_planes_mut().for_each(|plane| plane.truncate(count));
    }

    /// The planes after the positions, in canonical order: log-scale, opacity, rotation, dc, sh.
    pub fn signed_planes(&self) -> impl Iterator<Item = &Vec<i32>> {
        self.log_scale.iter().chain([&self.opacity]).chain(&self.rotation).chain(&self.dc).chain(&self.sh)
    }

    fn signed_planes_mut(&mut self) -> impl Iterator<Item = &mut Vec<i32>> {
        self.log_scale
            .iter_mut()
            .chain([&mut self.opacity])
            .chain(&mut self.rotation)
            .chain(&mut self.dc)
            .chain(&mut self.sh)
    }
}
