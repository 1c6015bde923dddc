//! Annex A.2: the limits of a level and those of the caller.

use crate::write::{Plan, Script, decoded};
use splatstream_decoder::process::Options;
use splatstream_format::syntax::{FrameHeader, UnitType};
use splatstream_format::{ErrorKind, Limits};

fn asked(script: &Script, limits: Limits) -> Vec<&'static str> {
    let (summary, _) = decoded(&script.bytes(), &Options { limits, ..Options::default() });
    let limit = |kind: ErrorKind| match kind {
        ErrorKind::OverLimit { limit, .. } => limit,
        kind => kind.code(),
    };
    summary.errors.into_iter().map(|error| limit(error.kind)).collect()
}

#[test]
fn a_caller_may_lower_every_limit() {
    let script = Plan { gops: vec![2], ..Plan::predicted(1) }.script();
    let lowered = |edit: fn(&mut Limits)| {
        let mut limits = Limits::default();
        edit(&mut limits);
        asked(&script, limits)
    };
    assert_eq!(lowered(|_| ()), [""; 0]);
    assert_eq!(lowered(|limits| limits.max_gaussians = 59), ["max_gaussians"]);
    assert_eq!(lowered(|limits| limits.max_gaussian_rate = 1799), ["max_gaussian_rate"]);
    assert_eq!(lowered(|limits| limits.max_cells = 5), ["max_cells"]);
    assert_eq!(lowered(|limits| limits.max_codebook_values = 9), ["max_codebook_values"]);
    assert_eq!(lowered(|limits| limits.max_units = 18), ["max_units"]);
    assert_eq!(lowered(|limits| limits.max_payload = 75), ["max_payload"]);
}

#[test]
fn a_level_bounds_what_the_caller_allows() {
    let plan = Plan { gops: vec![1], ..Plan::intra(2) };
    let mut script = plan.script();
    let frame = script.indices(UnitType::FrameHeader)[0];
    let header = |count| FrameHeader::intra(3, Some(4), count).to_bytes().unwrap();
    script.parts[frame].payload = header((1 << 18) + 1);
    assert_eq!(asked(&script, Limits::of_level(4)), ["max_gaussians"]);
    script.level = 2;
    assert_eq!(asked(&script, Limits::of_level(4)).first(), Some(&"MISMATCH"));
    // 30 frames in a second.
    script.parts[frame].payload = header((1 << 26) / 30 / 4);
    assert_eq!(asked(&script, Limits::of_level(4)).first(), Some(&"MISMATCH"));
}
