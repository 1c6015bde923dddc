//! What a decoder shall say of a stream.

use super::Script;
use super::sample;
use super::scene::Scene;
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_decoder::stream::decode_stream;
use splatstream_format::Error;
use splatstream_format::syntax::UnitType;
use std::ops::ControlFlow;

/// What came of decoding.
#[derive(Debug)]
pub(crate) struct Decoded {
    pub(crate) frames: Vec<DecodedFrame>,
    pub(crate) end: Option<Error>,
}

impl Decoded {
    /// The first error, 9.3: what a frame lost stands before what ends the stream.
    pub(crate) fn verdict(&self) -> Option<Error> {
        self.frames.iter().find_map(|frame| frame.lost).or(self.end)
    }

    /// Display index and refinements of each frame.
    pub(crate) fn shown(&self) -> Vec<(u32, u8)> {
        self.frames.iter().map(|frame| (frame.number, frame.refinements)).collect()
    }
}

pub(crate) fn decode_with(bytes: &[u8], options: &Options) -> Decoded {
    let mut frames = Vec::new();
    let summary = decode_stream(bytes, options, |_, frame| {
        frames.push(frame);
        ControlFlow::Continue(())
    });
    assert_eq!(summary.frames as usize, frames.len());
    Decoded { frames, end: summary.end }
}

pub(crate) fn decode(bytes: &[u8]) -> Decoded {
    decode_with(bytes, &Options::default())
}

pub(crate) fn decode_tolerant(bytes: &[u8]) -> Decoded {
    decode_with(bytes, &Options { tolerant: true, ..Options::default() })
}

pub(crate) const fn point(refinement: u8) -> OperatingPoint {
    OperatingPoint { spatial: 0, temporal: 0, refinement }
}

pub(crate) fn decode_at(bytes: &[u8], refinement: u8) -> Decoded {
    decode_with(bytes, &Options { operating_point: point(refinement), ..Options::default() })
}

/// The canonical planes of a frame as a list.
pub(crate) fn planes(frame: &QuantizedFrame) -> Vec<Vec<i32>> {
    let positions = frame.position.iter().map(|plane| plane.iter().map(|&q| q as i32).collect());
    positions.chain(frame.signed_planes().cloned()).collect()
}

/// Decodes a scene and compares every frame at every refinement with the reference.
pub(crate) fn assert_decodes(name: &str, scene: &Scene) {
    let bytes = scene.bytes();
    let whole = decode(&bytes);
    assert_eq!(whole.end, None, "{name}");
    let mut shown = whole.frames.iter();
    for (g, gop) in scene.gops.iter().enumerate() {
        for (f, frame) in gop.frames.iter().enumerate() {
            let last = frame.units.len() - 1;
            let decoded = shown.next().unwrap();
            assert_eq!(decoded.refinements as usize, frame.units.len(), "{name}");
            assert_eq!(planes(&decoded.planes), scene.planes(g, f, last), "{name}, frame {f} of GOP {g}");
        }
    }
    assert!(shown.next().is_none(), "{name}");
    for r in 0..scene.sequence.refinement_count {
        let at = decode_at(&bytes, r);
        assert_eq!(at.end, None, "{name} at r{r}");
        let all = scene.gops.iter().enumerate();
        let frames = all.flat_map(|(g, gop)| gop.frames.iter().enumerate().map(move |frame| (g, frame)));
        for ((g, (f, frame)), decoded) in frames.zip(&at.frames) {
            let last = usize::from(r).min(frame.units.len() - 1);
            assert_eq!(planes(&decoded.planes), scene.planes(g, f, last), "{name} at r{r}");
        }
    }
}

/// A broken rule: what is done to the sample, and what is said about it.
pub(crate) struct Case {
    name: &'static str,
    scene: fn(&mut Scene),
    script: fn(&mut Script),
    code: &'static str,
    clause: &'static str,
    /// A unit and the offset in it, counted from its header.
    at: (UnitType, usize, u64),
    /// Anywhere in the payload from there on.
    anywhere: bool,
    confined: bool,
}

/// A case whose error ends decoding; its offset counts from the header of the unit.
pub(crate) const fn fatal(
    name: &'static str,
    code: &'static str,
    clause: &'static str,
    at: (UnitType, usize, u64),
) -> Case {
    Case { name, scene: |_| (), script: |_| (), code, clause, at, anywhere: false, confined: false }
}

/// A case whose error ends only the refinements of a frame.
pub(crate) const fn confined(
    name: &'static str,
    code: &'static str,
    clause: &'static str,
    at: (UnitType, usize, u64),
) -> Case {
    Case { confined: true, ..fatal(name, code, clause, at) }
}

impl Case {
    pub(crate) const fn scene(self, edit: fn(&mut Scene)) -> Self {
        Self { scene: edit, ..self }
    }

    pub(crate) const fn script(self, edit: fn(&mut Script)) -> Self {
        Self { script: edit, ..self }
    }

    /// The offset may be any from the given one to the end of the unit.
    pub(crate) const fn or_later(self) -> Self {
        Self { anywhere: true, ..self }
    }

    fn check(&self, base: &Scene) {
        let mut scene = base.clone();
        (self.scene)(&mut scene);
        let mut script = scene.script();
        (self.script)(&mut script);
        let bytes = script.bytes();
        let strict = decode(&bytes);
        let tolerant = decode_tolerant(&bytes);
        let name = self.name;
        let Some(error) = strict.verdict() else { panic!("{name}: accepted, {} was expected", self.code) };
        let found = (error.class().name(), error.kind.code(), error.clause);
        assert_eq!(found, (class_of(self.code), self.code, self.clause), "{name}: {error}");
        let (kind, n, offset) = self.at;
        let part = script.find(kind, n);
        let (start, next) = (script.at(part) + offset, script.at(part + 1));
        let places = if self.anywhere { start..=next } else { start..=start };
        assert!(places.contains(&error.at), "{name}: {error} is not at {places:?}");
        assert_eq!(tolerant.verdict(), Some(error), "{name}: the verdict does not depend on tolerance");
        let frames: usize = scene.gops.iter().map(|gop| gop.frames.len()).sum();
        if self.confined {
            assert_eq!((tolerant.end, tolerant.frames.len()), (None, frames), "{name}: decoding goes on");
        } else {
            assert_eq!(tolerant.end, Some(error), "{name}: decoding stops");
        }
    }
}

/// Checks cases that change a scene.
pub(crate) fn assert_refused_in(base: &Scene, cases: &[Case]) {
    assert_eq!(decode(&base.bytes()).verdict(), None, "the scene before any change");
    cases.iter().for_each(|case| case.check(base));
}

/// Checks cases that change the sample.
pub(crate) fn assert_refused(cases: &[Case]) {
    assert_refused_in(&sample::scene(), cases);
}

/// The class of a code, as the table of 9.2 has it.
pub(crate) fn class_of(code: &str) -> &'static str {
    match code {
        "TRUNCATED" => "truncated",
        "SIGNATURE"
        | "CHECK_SUM"
        | "SHORT_SECTION"
        | "TRAILING_BYTES"
        | "NUMBER"
        | "PADDING"
        | "ENTROPY_FINAL_STATE" => "malformed",
        "RESERVED_BITS" | "RESERVED" => "unsupported",
        "OVER_LIMIT" => "over-limit",
        _ => "invalid",
    }
}
