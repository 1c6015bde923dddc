//! What is fuzzed, as ordinary functions: libFuzzer calls them (`main.rs`), and `tests/regressions.rs` replays
//! with them what was found, on any toolchain.
//!
//! Each takes any bytes and returns. A panic is a finding, and so are a request for more memory than
//! [`ceiling`] allows and an input that takes seconds.

pub mod allowance;
pub mod ceiling;
pub mod cost;
pub mod decode;
pub mod edits;
pub mod encode;
pub mod entropy;
pub mod laws;
pub mod measured;
pub mod oracle;
pub mod packages;
pub mod records;
pub mod scene;
pub mod seal;
mod small_scene;
pub mod streams;
pub mod synthetic;
pub mod targets;
pub mod units;
pub mod yardstick;

use splatstream_format::Limits;

/// Small, so that an input which keeps within them is cheap.
pub const LIMITS: Limits = Limits {
    max_gaussians: 1 << 12,
    max_gaussian_rate: 1 << 30,
    max_payload: 1 << 18,
    max_units: 1 << 9,
    max_codebook_values: 1 << 16,
    max_cells: 1 << 12,
    max_learned: 1 << 8,
};

/// Lets parallel work happen on the calling thread, which must be the only one: coverage then depends on
/// the input alone, and no time goes into waking threads.
pub fn stay_on_this_thread() {
    // Fails only if there is a pool already, and that one serves as well.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
}
