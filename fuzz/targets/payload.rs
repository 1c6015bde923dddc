//! libFuzzer calls [`splatstream_fuzz::payload::run`]; without libFuzzer, the files named as arguments are replayed.
#![cfg_attr(fuzzing, no_main)]

#[cfg(fuzzing)]
libfuzzer_sys::fuzz_target!(|data: &[u8]| splatstream_fuzz::payload::run(data));

#[cfg(not(fuzzing))]
fn main() -> std::io::Result<()> {
    splatstream_fuzz::replay(splatstream_fuzz::payload::run)
}
