//! Clauses 7.18 to 7.20: what a receiver shows of a scene, whatever units it has.

use super::frames::{Known, evaluate};
use super::gaussian::{Splat, planes};
use super::scene::{Frame, Gop, Scene};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_format::syntax::{UnitId, UnitType};
use std::collections::{BTreeMap, BTreeSet};

/// A unit by frame, spatial layer and refinement.
pub(crate) type Place = (u32, u8, u8);

/// One who decodes a scene at an operating point, without some units.
#[derive(Debug, Clone)]
pub(crate) struct Receiver {
    pub(crate) point: OperatingPoint,
    pub(crate) subset: bool,
    /// Units that arrive damaged, and that do not arrive.
    pub(crate) damaged: BTreeSet<Place>,
    pub(crate) missing: BTreeSet<Place>,
}

/// A frame as it is shown.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shown {
    pub(crate) number: u32,
    /// Refinements shown, 0 of a frozen frame.
    pub(crate) refinements: u8,
    pub(crate) exact: usize,
    pub(crate) planes: Vec<Vec<i32>>,
    /// The planes from which 7.10 computes: compensated.
    pub(crate) output: Vec<Vec<i32>>,
    /// Whether an error is reported of it.
    pub(crate) lost: bool,
}

/// A frame that later ones refer to.
#[derive(Default)]
struct Reference {
    level: u8,
    shown: Option<Shown>,
}

/// What of a frame was decoded.
#[derive(Default)]
struct Decoded {
    units: BTreeSet<(u8, u8)>,
    error: bool,
    stood: bool,
}

/// 7.19.
pub(crate) fn belongs(scene: &Scene, id: &UnitId, point: OperatingPoint) -> bool {
    let mut first = 0;
    let mut is_first_of_predicted = false;
    for gop in &scene.gops {
        is_first_of_predicted |= gop.is_predicted() && id.frame == first;
        first = first.wrapping_add(gop.header.gop_frame_count);
    }
    let whole = id.unit_type == UnitType::Increment && is_first_of_predicted && point.spatial >= scene.top();
    let in_layers = id.spatial_layer <= point.spatial && id.temporal_layer <= point.temporal;
    in_layers && (id.refinement <= point.refinement || whole)
}

impl Receiver {
    pub(crate) fn at(point: OperatingPoint) -> Self {
        Self { point, subset: false, damaged: BTreeSet::new(), missing: BTreeSet::new() }
    }

    /// The frames, in order.
    pub(crate) fn shown(&self, scene: &Scene) -> Vec<Shown> {
        let mut out = Vec::new();
        let mut first = 0;
        for gop in &scene.gops {
            let known = evaluate(&scene.sequence, gop);
            let mut references: BTreeMap<u32, Reference> = BTreeMap::new();
            for (frame, known) in gop.frames.iter().zip(&known) {
                let place = GopPlace { scene, gop, number: first + frame.place, frame };
                let spatial = if place.reference().is_some() { scene.top() } else { 0 };
                if gop.layer(frame.place) > self.point.temporal || spatial > self.point.spatial {
                    continue;
                }
                let reference = self.frame(&place, known, &references);
                out.extend(reference.shown.clone());
                references.insert(frame.place, reference);
            }
            first += gop.header.gop_frame_count;
        }
        out
    }

    fn frame(&self, place: &GopPlace<'_>, known: &Known, before: &BTreeMap<u32, Reference>) -> Reference {
        let refinements = place.scene.sequence.refinement_count;
        let reference = place.reference().map(|reference| before.get(&reference));
        let limit = reference.map_or(refinements, |reference| reference.map_or(0, |it| it.level));
        let decoded = self.decoded(place, limit);
        let mut shown = match reference {
            None => self.intra(place, known, &decoded),
            Some(reference) if decoded.units.is_empty() => place.frozen(reference),
            Some(_) => self.predicted(place, known, decoded.units.len() as u8),
        };
        let level = match reference {
            Some(_) => decoded.units.len() as u8,
            None if decoded.units.len() == usize::from(refinements * (place.scene.top() + 1)) => refinements,
            None => 0,
        };
        let no_reference = level == 0 && place.frame.place > 0 && place.gop.is_predicted();
        shown.lost = decoded.error || !decoded.stood || no_reference;
        Reference { level, shown: Some(shown) }
    }

    /// 7.13.3: the units from the first on, up to the first that is missed.
    fn decoded(&self, place: &GopPlace<'_>, limit: u8) -> Decoded {
        let mut decoded = Decoded::default();
        let mut last = None;
        for unit in &place.frame.units {
            let (s, r) = (unit.spatial, unit.refinement);
            let at = (place.number, s, r);
            if self.missing.contains(&at) {
                continue;
            }
            decoded.stood = true;
            let id = UnitId::of_frame(UnitType::Increment, place.number)
                .on_layers(s, place.gop.layer(place.frame.place));
            let id = UnitId { refinement: r, ..id };
            let is_beyond = limit <= r && r < place.scene.sequence.refinement_count;
            if decoded.error || is_beyond || !belongs(place.scene, &id, self.point) {
                continue;
            }
            let first = if place.reference().is_some() { place.scene.top() } else { 0 };
            let is_next = match last {
                None => (s, r) == (first, 0),
                Some((s0, r0)) => (s, r) == (s0, r0 + 1) || (s, r) == (s0 + 1, 0),
            };
            let has_parents = s == first || decoded.units.contains(&(s - 1, r));
            if self.damaged.contains(&at) || !is_next || !has_parents {
                decoded.error = true;
                continue;
            }
            decoded.units.insert((s, r));
            last = Some((s, r));
        }
        decoded
    }

    /// SS-LO-001.
    fn intra(&self, place: &GopPlace<'_>, known: &Known, decoded: &Decoded) -> Shown {
        let count = |s: u8| decoded.units.iter().filter(|(layer, _)| *layer == s).count() as u8;
        let s = (0..=place.scene.top()).rev().find(|&s| count(s) == count(0)).unwrap();
        let lists: Vec<Vec<Splat>> = (0..count(0)).map(|h| known.homes[&(s, h)].clone()).collect();
        let exact = lists.concat();
        let all = vec![true; exact.len()];
        place.shown(count(0), (s, &all), &exact, &[])
    }

    /// SS-CA-002.
    fn predicted(&self, place: &GopPlace<'_>, known: &Known, level: u8) -> Shown {
        let top = place.scene.top();
        let exact: Vec<Splat> = (0..level).flat_map(|h| known.homes[&(top, h)].clone()).collect();
        let compensated: Vec<bool> = exact.iter().map(|splat| self.subset || !splat.anchor).collect();
        let carried = if self.subset { Vec::new() } else { known.carried[usize::from(level)..].concat() };
        place.shown(level, (top, &compensated), &exact, &carried)
    }
}

/// A frame in its GOP and scene.
struct GopPlace<'a> {
    scene: &'a Scene,
    gop: &'a Gop,
    number: u32,
    frame: &'a Frame,
}

impl GopPlace<'_> {
    fn reference(&self) -> Option<u32> {
        self.gop.reference(self.frame.place)
    }

    /// SS-LO-004.
    fn frozen(&self, reference: Option<&Reference>) -> Shown {
        let shown = reference.and_then(|reference| reference.shown.clone());
        let shown = shown.unwrap_or_else(|| self.shown(0, (0, &[]), &[], &[]));
        Shown { number: self.number, refinements: 0, ..shown }
    }

    /// A list with the compensation of SS-CA-003.
    fn shown(&self, refinements: u8, (s, flags): (u8, &[bool]), exact: &[Splat], carried: &[Splat]) -> Shown {
        let sequence = &self.scene.sequence;
        let mut list = [exact, carried].concat();
        let canonical = planes(&list, sequence.sh_dimension());
        let last =
            self.frame.units.iter().find(|unit| (unit.spatial, unit.refinement + 1) == (s, refinements));
        if let Some(unit) = last.filter(|_| refinements < sequence.refinement_count) {
            for (splat, _) in list.iter_mut().zip(flags).filter(|(_, flag)| **flag) {
                let shift = |value: i64, by: i8| (value + i64::from(by)).clamp(-32768, 32767);
                splat.q = splat.q.map(|q| shift(q, unit.header.compensation_log_scale));
                splat.o = shift(splat.o, unit.header.compensation_opacity);
            }
        }
        Shown {
            number: self.number,
            refinements,
            exact: exact.len(),
            planes: canonical,
            output: planes(&list, sequence.sh_dimension()),
            lost: false,
        }
    }
}
