//! Loops compiled for the vectors of the machine. What they compute is the same everywhere.

#[cfg(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")))]
use core::arch::wasm32::{f64x2_convert_low_i32x4, i32x4_shuffle, v128};
#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
use pulp::{Simd, WithSimd};
use splatstream_format::entropy::machine::Machine;

/// A loop. What it calls is compiled for each kind of machine as far as it is inlined.
pub(crate) trait Task {
    /// Runs the loop; `#[inline(always)]`.
    fn run(self, machine: impl Machine);
}

#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
struct OnMachine<T, M>(T, M);

#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
impl<T: Task, M: Machine> WithSimd for OnMachine<T, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.run(self.1);
    }
}

/// Runs a loop with the instructions of this machine.
#[inline]
pub(crate) fn vectorized(task: impl Task) {
    #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
    {
        use splatstream_format::entropy::machine::Avx2;
        if let Some(v4) = pulp::x86::V4::try_new() {
            return Simd::vectorize(v4, OnMachine(task, Avx2::with_avx512(v4)));
        }
        if let Some(v3) = pulp::x86::V3::try_new() {
            return Simd::vectorize(v3, OnMachine(task, Avx2::new(v3)));
        }
    }
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")))]
    task.run(splatstream_format::entropy::machine::Simd128);
    #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable"))))]
    task.run(splatstream_format::entropy::machine::Portable);
}

/// The first and the last two of four integers, as f64.
#[cfg(all(target_arch = "wasm32", target_feature = "simd128", not(feature = "portable")))]
#[inline(always)]
pub(crate) fn halves(values: v128) -> [v128; 2] {
    [f64x2_convert_low_i32x4(values), f64x2_convert_low_i32x4(i32x4_shuffle::<2, 3, 2, 3>(values, values))]
}
