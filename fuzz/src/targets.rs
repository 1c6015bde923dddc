//! The targets by name. One program holds them all: linking it once is much of what building costs.

use crate::{cost, decode, encode, entropy, oracle, packages, records, scene, synthetic, units};
use std::ffi::OsStr;
use std::path::Path;

/// What is done with an input.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// The word that chooses it: the name of its folders in `seeds/` and `regressions/`, and of its program.
    pub name: &'static str,
    /// Returns, or panics on a finding.
    pub run: fn(&[u8]),
}

/// Every target, cheap ones first.
pub const ALL: [Target; 10] = [
    Target { name: "units", run: units::run },
    Target { name: "records", run: records::run },
    Target { name: "entropy", run: entropy::run },
    Target { name: "packages", run: packages::run },
    Target { name: "scene", run: scene::run },
    Target { name: "decode", run: decode::run },
    Target { name: "cost", run: cost::run },
    Target { name: "synthetic", run: synthetic::run },
    Target { name: "encode", run: encode::run },
    Target { name: "oracle", run: oracle::run },
];

/// Not a target but a fault: a request as large as the input says. It shows that the [`ceiling`](crate::ceiling) holds
/// in the program that the targets are in.
pub const PLANTED: Target = Target { name: "planted", run: planted };

fn planted(data: &[u8]) {
    let count = data.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    std::hint::black_box(Vec::<u8>::with_capacity(count as usize));
}

/// The variable that names the target of a program that is not called as one.
const VARIABLE: &str = "FUZZ_TARGET";

/// The target that this program is called as, or that `FUZZ_TARGET` names.
///
/// # Errors
/// What to say where there is none.
pub fn chosen() -> Result<Target, String> {
    let program = std::env::args_os().next();
    let called = program.as_deref().and_then(|program| Path::new(program).file_name()).and_then(named);
    let asked = || std::env::var_os(VARIABLE).as_deref().and_then(named);
    called.or_else(asked).ok_or_else(|| {
        let names = ALL.map(|target| target.name).join(", ");
        format!("no target: set {VARIABLE}, or call this program by the name of one: {names}")
    })
}

fn named(name: &OsStr) -> Option<Target> {
    ALL.into_iter().chain([PLANTED]).find(|target| name == target.name)
}
