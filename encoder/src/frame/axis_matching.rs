//! The way to write a target Gaussian that is nearest to how its reference is written.

use crate::canonical::{permutation, product};

/// The orders of three axes.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];

/// The largest difference, in steps, that is left of an attribute. Rounding would leave half a step; a residual of one step
/// takes about two bits more than none.
pub(crate) const LEFT: f32 = 0.55;

/// What a difference that has to be sent counts, in squared steps: more than all that are left can.
const SENT: f32 = 16.0;

/// Log-scales and quaternion (w first) of a Gaussian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    pub(crate) log_scale: [f32; 3],
    pub(crate) rotation: [f32; 4],
}

/// The 24 ways to name the axes of a Gaussian, as orders and turns.
pub(crate) struct Namings(Vec<([usize; 3], [f32; 4])>);

impl Namings {
    pub(crate) fn new() -> Self {
        const HALF_TURNS: [[f32; 4]; 4] =
            [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let with =
            |order: [usize; 3]| HALF_TURNS.map(|half_turn| (order, product(permutation(order), half_turn)));
        Self(ORDERS.into_iter().flat_map(with).collect())
    }

    /// The pose among those that render like `target` which differs least from `reference`, differences counted in
    /// `steps` of log-scales and of quaternion components. Its w is not negative.
    #[expect(clippy::indexing_slicing, reason = "axes and parts are constants or a permutation of them")]
    pub(crate) fn nearest(&self, target: Pose, reference: Pose, steps: (f32, f32)) -> Pose {
        let mut best = (f32::INFINITY, target);
        for &(order, turn) in &self.0 {
            let log_scale = order.map(|axis| target.log_scale[axis]);
            let rotation = product(target.rotation, turn);
            let rotation = if rotation[0] < 0.0 { rotation.map(|part| -part) } else { rotation };
            let square = |a: f32, b: f32, step: f32| {
                let steps = ((a - b) / step).abs();
                steps * steps + if steps > LEFT { SENT } else { 0.0 }
            };
            let scales: f32 = (0..3).map(|k| square(log_scale[k], reference.log_scale[k], steps.0)).sum();
            let turns: f32 = (1..4).map(|k| square(rotation[k], reference.rotation[k], steps.1)).sum();
            if scales + turns < best.0 {
                best = (scales + turns, Pose { log_scale, rotation });
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_written_otherwise_comes_back() {
        let namings = Namings::new();
        let reference = Pose { log_scale: [1.0, 0.0, -2.0], rotation: [0.8, 0.4, 0.2, 0.4] };
        for &(order, turn) in &namings.0 {
            // The same Gaussian with its axes named otherwise.
            let written = Pose {
                log_scale: order.map(|axis| reference.log_scale[axis]),
                rotation: product(reference.rotation, turn),
            };
            let found = namings.nearest(written, reference, (0.1, 0.02));
            let off: f32 = (0..4).map(|k| (found.rotation[k] - reference.rotation[k]).abs()).sum();
            assert!(off < 1e-5 && found.log_scale == reference.log_scale, "{order:?} {turn:?} {found:?}");
        }
    }
}
