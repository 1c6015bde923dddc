//! How fast the machine is now. Times that targets allow are those of a machine of slowness 1.

use crate::measured::measured;
use crate::streams;
use splatstream::Decoder;
use splatstream_format::Limits;
use splatstream_format::inspect::inspect;
use std::hint::black_box;
use std::sync::LazyLock;
use std::time::Duration;

/// Processor time for inspecting and decoding each of the valid streams, in a program that is built for fuzzing.
const NOMINAL: Duration = Duration::from_millis(15);

/// The shortest of so many times counts: what else the machine does makes some longer.
const TIMES: u32 = 3;

/// How many times as long as nominal this program takes on this machine: once for all inputs, or [now](slowness_now).
pub fn slowness() -> f64 {
    static AT_START: LazyLock<f64> = LazyLock::new(slowness_now);
    *AT_START
}

/// As [`slowness`], at this moment. One where times are not known.
pub fn slowness_now() -> f64 {
    let shortest = (0..TIMES).map(|_| measured(read_streams).1.time).min().unwrap_or_default();
    if shortest.is_zero() { 1.0 } else { shortest.as_secs_f64() / NOMINAL.as_secs_f64() }
}

fn read_streams() {
    for stream in streams::ALL {
        black_box(inspect(stream, &Limits::default(), &mut |_| ()));
        black_box(Decoder::from_bytes(stream).map_while(Result::ok).count());
    }
}
