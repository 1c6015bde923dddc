//! What a decoder shall say of a stream of profile 1.

use super::scene::Scene;
use super::shown::{Receiver, Shown};
use crate::crafted::expect::{Decoded, class_of, decode_with, planes};
use crate::crafted::{Part, Script};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::{DecodedFrame, Options};
use splatstream_format::syntax::UnitType;

pub(crate) const fn point(spatial: u8, temporal: u8, refinement: u8) -> OperatingPoint {
    OperatingPoint { spatial, temporal, refinement }
}

/// The point to which every unit belongs, 7.19.
pub(crate) const ALL: OperatingPoint = point(3, 3, 9);

/// Every operating point of a sequence, the lowest first.
pub(crate) fn points(scene: &Scene) -> Vec<OperatingPoint> {
    let counts = &scene.sequence;
    let mut points = Vec::new();
    for s in 0..counts.spatial_layer_count {
        for t in 0..counts.temporal_layer_count {
            points.extend((0..counts.refinement_count).map(|r| point(s, t, r)));
        }
    }
    points
}

impl Receiver {
    pub(crate) fn options(&self) -> Options {
        Options { operating_point: self.point, tolerant: true, subset: self.subset, ..Options::default() }
    }

    /// Decodes a script as the receiver gets it.
    pub(crate) fn decode(&self, script: &Script) -> Decoded {
        let mut script = script.clone();
        script.parts.retain(|part| place(part).is_none_or(|place| !self.missing.contains(&place)));
        for part in 0..script.parts.len() {
            if place(&script.parts[part]).is_some_and(|place| self.damaged.contains(&place)) {
                script.damage_part(part);
            }
        }
        decode_with(&script.bytes(), &self.options())
    }

    /// Decodes a script of a scene and compares every frame with the reference.
    pub(crate) fn assert_shows(&self, name: &str, scene: &Scene, script: &Script) {
        let decoded = self.decode(script);
        assert_eq!(decoded.end, None, "{name} {self:?}");
        assert_same(&format!("{name} {self:?}"), &decoded.frames, &self.shown(scene));
    }
}

/// Frame, layer and refinement of an increment.
fn place(part: &Part) -> Option<(u32, u8, u8)> {
    match part {
        Part::Unit(id, _) if id.unit_type == UnitType::Increment => {
            Some((id.frame, id.spatial_layer, id.refinement))
        }
        _ => None,
    }
}

fn assert_same(name: &str, decoded: &[DecodedFrame], expected: &[Shown]) {
    let numbers = |frame: &DecodedFrame| (frame.number, frame.refinements, frame.lost.is_some());
    let found: Vec<_> = decoded.iter().map(numbers).collect();
    let wanted: Vec<_> = expected.iter().map(|frame| (frame.number, frame.refinements, frame.lost)).collect();
    assert_eq!(found, wanted, "{name}: {:?}", decoded.iter().find_map(|frame| frame.lost));
    for (decoded, expected) in decoded.iter().zip(expected) {
        let name = format!("{name}, frame {}", expected.number);
        assert_eq!(decoded.planes.len() - decoded.carried, expected.exact, "{name}");
        assert_planes(&name, &planes(&decoded.planes), &expected.planes);
        assert_planes(&format!("{name}, output"), &planes(&decoded.clone().into_shown()), &expected.output);
    }
}

fn assert_planes(name: &str, found: &[Vec<i32>], expected: &[Vec<i32>]) {
    let is_empty = |planes: &[Vec<i32>]| planes.iter().all(Vec::is_empty);
    // A frame without Gaussians need not say how many planes it has none in.
    if is_empty(found) && is_empty(expected) {
        return;
    }
    for (p, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert_eq!(found, expected, "{name}, plane {p}");
    }
    assert_eq!(found.len(), expected.len(), "{name}");
}

/// Decodes a scene at every operating point, whole and as subsets.
pub(crate) fn assert_decodes(name: &str, scene: &Scene) {
    let script = scene.script();
    let strict = decode_with(&script.bytes(), &Options::default());
    assert_eq!(strict.verdict(), None, "{name}");
    let all = points(scene).into_iter().chain([ALL]);
    for receiver in all.map(Receiver::at) {
        receiver.assert_shows(name, scene, &script);
        Receiver { subset: true, ..receiver }.assert_shows(name, scene, &script);
    }
}

/// A broken rule: what is done to a scene, and what is said about it.
pub(crate) struct Case {
    name: &'static str,
    scene: fn(&mut Scene),
    script: fn(&mut Script),
    code: &'static str,
    /// The unit at fault, or the one in front of which something is missed.
    at: (UnitType, usize),
    confined: bool,
}

/// A case whose error ends decoding.
pub(crate) const fn fatal(name: &'static str, code: &'static str, at: (UnitType, usize)) -> Case {
    Case { name, scene: |_| (), script: |_| (), code, at, confined: false }
}

/// A case whose error ends the units of a frame.
pub(crate) const fn confined(name: &'static str, code: &'static str, at: (UnitType, usize)) -> Case {
    Case { confined: true, ..fatal(name, code, at) }
}

impl Case {
    pub(crate) const fn scene(self, edit: fn(&mut Scene)) -> Self {
        Self { scene: edit, ..self }
    }

    pub(crate) const fn script(self, edit: fn(&mut Script)) -> Self {
        Self { script: edit, ..self }
    }

    fn check(&self, base: &Scene) {
        let name = self.name;
        let mut scene = base.clone();
        (self.scene)(&mut scene);
        let mut script = scene.script();
        (self.script)(&mut script);
        let bytes = script.bytes();
        let strict = decode_with(&bytes, &Options::default());
        let tolerant = decode_with(&bytes, &Options { tolerant: true, ..Options::default() });
        let Some(error) = strict.verdict() else { panic!("{name}: accepted, {} was expected", self.code) };
        assert_eq!(
            (error.class().name(), error.kind.code()),
            (class_of(self.code), self.code),
            "{name}: {error}"
        );
        let part = script.find(self.at.0, self.at.1);
        let places = script.at(part)..=script.at(part + 1);
        assert!(places.contains(&error.at), "{name}: {error} is not at {places:?}");
        assert_eq!(tolerant.verdict(), Some(error), "{name}: the verdict does not depend on tolerance");
        let frames: usize = scene.gops.iter().map(|gop| gop.frames.len()).sum();
        let (end, shown) = if self.confined { (None, frames) } else { (Some(error), tolerant.frames.len()) };
        assert_eq!((tolerant.end, tolerant.frames.len()), (end, shown), "{name}");
    }
}

/// Checks cases that change a scene.
pub(crate) fn assert_refused(base: &Scene, cases: &[Case]) {
    assert_eq!(decode_with(&base.bytes(), &Options::default()).verdict(), None, "before any change");
    cases.iter().for_each(|case| case.check(base));
}
