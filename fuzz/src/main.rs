//! All targets in one program: libFuzzer calls the chosen one. Without libFuzzer, the files named as arguments are
//! replayed.
#![cfg_attr(fuzzing, no_main)]

use splatstream_fuzz::targets::{self, Target};

#[cfg(fuzzing)]
static TARGET: std::sync::LazyLock<Target> = std::sync::LazyLock::new(|| {
    splatstream_fuzz::stay_on_this_thread();
    targets::chosen().unwrap_or_else(|message| {
        eprintln!("{message}");
        std::process::exit(2)
    })
});

#[cfg(fuzzing)]
libfuzzer_sys::fuzz_target!(init: std::sync::LazyLock::force(&TARGET), |data: &[u8]| (TARGET.run)(data));

#[cfg(not(fuzzing))]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let Target { run, .. } = targets::chosen()?;
    for path in std::env::args_os().skip(1) {
        run(&std::fs::read(path)?);
    }
    Ok(())
}
