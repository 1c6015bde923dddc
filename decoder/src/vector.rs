//! Loops compiled for the vectors of the machine. What they compute is the same everywhere.

use pulp::{Scalar, Simd, WithSimd};

/// A loop. What it calls is compiled for each kind of machine as far as it is inlined.
pub(crate) trait Task {
    /// Runs the loop; `#[inline(always)]`.
    fn run(self);
}

struct OnMachine<T>(T);

impl<T: Task> WithSimd for OnMachine<T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.run();
    }
}

/// Runs a loop with the instructions of this machine.
#[inline]
pub(crate) fn vectorized(task: impl Task) {
    #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
    if let Some(v3) = pulp::x86::V3::try_new() {
        return Simd::vectorize(v3, OnMachine(task));
    }
    Scalar::new().vectorize(OnMachine(task));
}
