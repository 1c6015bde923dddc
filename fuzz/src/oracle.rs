//! The decoder beside the independent one of `conformance/oracle`, a program in Python of its own, on small streams.
//!
//! A stream that was changed has wrong digests, and so never shows a frame. Here they are put right with what the
//! decoder itself reconstructs: then the other one has to reconstruct the same.

mod client;
mod healed;

use crate::decode::{choice, stream_of};
use crate::laws::arrival::ends;
use crate::laws::{Decoded, VERIFIED};
use client::{Answer, Oracle, Request};
use healed::healed;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::Options;
use splatstream_format::syntax::UnitHeader;
use splatstream_format::{Class, Limits};
use std::sync::{LazyLock, Mutex, PoisonError};

/// What takes the independent decoder no more than a second.
const LIMITS: Limits = Limits { max_gaussians: 300, max_learned: 4, max_payload: 1 << 13, ..crate::LIMITS };
/// Gaussians of all frames.
const MAX_GAUSSIANS: usize = 600;

/// One process for all inputs.
static ORACLE: LazyLock<Mutex<Oracle>> = LazyLock::new(|| Mutex::new(Oracle::start()));

/// An input is a stream, or edits of one, as for `decode`; its bytes choose the operating point and the mode too.
pub fn run(data: &[u8]) {
    let choice = choice(data);
    let stream = healed(stream_of(data).into_owned());
    if cfg!(fuzzing) && !is_sealed(&stream) {
        return;
    }
    let request = Request { stream: &stream, point: point(choice), subset: choice >> 28 & 1 == 1 };
    let Some(mine) = mine(&request) else { return };
    let theirs = ORACLE.lock().unwrap_or_else(PoisonError::into_inner).ask(&request);
    // Within one unit, a decoder may report any fault that is there, also of what is missing at its end.
    let before = |at: u64| ends(&stream).take_while(|end| (*end as u64) < at).count();
    let units = |answer: &Answer| answer.error_at.map(|at| [before(at), before(at.saturating_add(1))]);
    let agree = match (units(&mine), units(&theirs)) {
        (Some([first, last]), Some([low, high])) => first <= high && low <= last,
        (mine, theirs) => mine == theirs,
    };
    assert!(agree, "{request:?}: {mine:?}, {theirs:?}");
    assert_eq!(mine.lost, theirs.lost, "{request:?}");
    let names = |answer: &Answer| answer.planes.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&mine), names(&theirs), "{request:?}");
    for (name, planes) in &mine.planes {
        assert!(theirs.planes.get(name) == Some(planes), "{name} differs, {request:?}");
    }
}

/// Whether units follow each other to the end, so that all of them have checksums that fit. What a scan finds inside a unit
/// that is cut short has not, and a decoder that is built for fuzzing does not mind.
fn is_sealed(stream: &[u8]) -> bool {
    let end = ends(stream).last().unwrap_or(0);
    stream.len().saturating_sub(end) < UnitHeader::SIZE
}

/// Often everything.
fn point(choice: u32) -> OperatingPoint {
    if choice & 1 == 0 {
        return OperatingPoint { spatial: 3, temporal: 3, refinement: 9 };
    }
    let at = |shift: u32, most: u32| ((choice >> shift) % (most + 1)) as u8;
    OperatingPoint { spatial: at(1, 3), temporal: at(9, 3), refinement: at(17, 9) }
}

/// What the decoder answers; none if the stream takes the other one too long.
fn mine(request: &Request<'_>) -> Option<Answer> {
    let options =
        Options { limits: LIMITS, operating_point: request.point, subset: request.subset, ..VERIFIED };
    let decoded = Decoded::of(request.stream, &options);
    let gaussians: usize = decoded.frames.iter().map(|frame| frame.planes.len()).sum();
    let is_large = decoded.errors.iter().any(|error| error.class() == Class::OverLimit);
    (gaussians <= MAX_GAUSSIANS && !is_large).then(|| Answer::of(decoded))
}
