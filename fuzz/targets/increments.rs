//! libFuzzer calls [`splatstream_fuzz::increments::run`]; without libFuzzer, the files named as arguments are replayed.
#![cfg_attr(fuzzing, no_main)]

#[cfg(fuzzing)]
libfuzzer_sys::fuzz_target!(
    init: splatstream_fuzz::stay_on_this_thread(),
    |data: &[u8]| splatstream_fuzz::increments::run(data)
);

#[cfg(not(fuzzing))]
fn main() -> std::io::Result<()> {
    splatstream_fuzz::replay(splatstream_fuzz::increments::run)
}
