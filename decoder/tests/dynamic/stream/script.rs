//! The units of a scene.

use super::frames::{Known, evaluate_frame};
use super::scene::{Frame, Gop, InForce, Scene};
use super::shown::{Receiver, belongs};
use crate::crafted::{Part, Script, UNIT_HEADER};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_format::payload::OperatingPoints;
use splatstream_format::syntax::{OperatingPointEntry, Profile, UnitId, UnitType};
use std::collections::BTreeMap;

impl Frame {
    /// `gaussian_count`: what its highest layer has.
    pub(crate) fn gaussians(&self) -> u32 {
        let layer = self.units.iter().map(|unit| unit.spatial).max();
        let top = self.units.iter().filter(|unit| Some(unit.spatial) == layer);
        self.count.unwrap_or_else(|| top.map(|unit| unit.counted().home_count()).sum())
    }
}

/// The models after the units 0 that later frames refer to, by place; those of the frame itself, by unit.
#[derive(Default)]
struct Models {
    first: BTreeMap<u32, InForce>,
    units: BTreeMap<(u8, u8), InForce>,
}

impl Models {
    /// SS-PM-010.
    fn for_unit(&self, gop: &Gop, place: u32, (s, r): (u8, u8)) -> InForce {
        let known = match (gop.reference(place), r, s) {
            (_, 1.., _) => self.units.get(&(s, r - 1)),
            (None, 0, 0) => None,
            (None, 0, _) => self.units.get(&(s - 1, 0)),
            (Some(reference), 0, _) => self.first.get(&reference),
        };
        known.cloned().unwrap_or_default()
    }
}

impl Scene {
    pub(crate) fn top(&self) -> u8 {
        self.sequence.spatial_layer_count - 1
    }

    /// The units, in order.
    pub(crate) fn script(&self) -> Script {
        let sequence = self.sequence.to_bytes().unwrap();
        let mut parts = vec![Part::unit(UnitType::SequenceParameters, 0, sequence)];
        let mut first = 0;
        for gop in &self.gops {
            parts.push(Part::unit(UnitType::GopHeader, first, gop.header.to_bytes().unwrap()));
            for transform in &gop.transforms {
                let payload = transform.to_bytes(&self.sequence).unwrap();
                parts.push(Part::unit(UnitType::Transform, first, payload));
            }
            let weights = gop.network.iter().map(|network| network.payload());
            parts.extend(weights.map(|payload| Part::unit(UnitType::Weights, first, payload)));
            self.frames(gop, first, &mut parts);
            first = first.wrapping_add(gop.header.gop_frame_count);
        }
        if let Some(points) = &self.points {
            let payload = self.operating_points(points, &parts);
            parts.push(Part::unit(UnitType::OperatingPoints, 0, payload));
        }
        parts.extend(self.index.then_some(Part::Index));
        parts.push(Part::End);
        Script { profile: Profile::Dynamic, level: self.level, parts }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.script().bytes()
    }

    fn frames(&self, gop: &Gop, first: u32, parts: &mut Vec<Part>) {
        let (mut all, mut models) = (Vec::new(), Models::default());
        for (place, frame) in gop.frames.iter().enumerate() {
            for (layer, book) in &frame.codebooks {
                let id = UnitId::of_frame(UnitType::Codebook, first).on_layers(0, *layer);
                parts.push(Part::Unit(id, book.to_bytes().unwrap()));
            }
            let layers =
                (if gop.reference(frame.place).is_some() { self.top() } else { 0 }, gop.layer(frame.place));
            let number = first.wrapping_add(frame.place);
            let frame_type = if layers.1 > 0 { 2 } else { u8::from(gop.reference(frame.place).is_some()) };
            let mut header = vec![frame_type, frame.dc_transform, frame.sh_transform, 0];
            header.extend(frame.gaussians().to_le_bytes());
            let id = UnitId::of_frame(UnitType::FrameHeader, number).on_layers(layers.0, layers.1);
            parts.push(Part::Unit(id, header));
            let known = self.units(gop, place, number, (&all, &mut models), parts);
            all.push(known);
        }
    }

    /// The increments of a frame.
    fn units(
        &self,
        gop: &Gop,
        place: usize,
        number: u32,
        (before, models): (&[Known], &mut Models),
        parts: &mut Vec<Part>,
    ) -> Known {
        let frame = &gop.frames[place];
        let codebooks = gop.codebooks(place);
        let tools = gop.tools(frame, &codebooks);
        models.units.clear();
        let work = evaluate_frame(&self.sequence, gop, place, frame, before, |unit, digests| {
            let Some(tools) = &tools else { return };
            let at = (unit.spatial, unit.refinement);
            let mut in_force = models.for_unit(gop, frame.place, at);
            let payload = unit.payload(&self.sequence, tools, &mut in_force, digests);
            if unit.refinement == 0 {
                models.first.insert(frame.place, in_force.clone());
            }
            models.units.insert(at, in_force);
            let id =
                UnitId::of_frame(UnitType::Increment, number).on_layers(unit.spatial, gop.layer(frame.place));
            parts.push(Part::Unit(UnitId { refinement: unit.refinement, ..id }, payload));
        });
        work.known
    }

    /// The payload that SS-PL-002 asks for behind these units.
    fn operating_points(&self, points: &[OperatingPoint], parts: &[Part]) -> Vec<u8> {
        let entry = |&point: &OperatingPoint| {
            let frames = Receiver::at(point).shown(self);
            OperatingPointEntry {
                spatial_layer: point.spatial,
                temporal_layer: point.temporal,
                refinement: point.refinement,
                reserved_zero: 0,
                frame_count: frames.len() as u32,
                gaussian_count: frames.iter().map(|frame| frame.exact as u64).sum(),
                byte_count: parts.iter().map(|part| self.cost(part, point)).sum(),
            }
        };
        OperatingPoints { entries: points.iter().map(entry).collect() }.to_bytes().unwrap()
    }

    /// Bytes of a unit of the types that count, if it belongs to the point.
    fn cost(&self, part: &Part, point: OperatingPoint) -> u64 {
        match part {
            Part::Unit(id, payload) if [2, 3, 4, 5, 6, 9, 10].contains(&id.unit_type.code()) => {
                let takes = belongs(self, id, point);
                if takes { (UNIT_HEADER + payload.len()) as u64 } else { 0 }
            }
            _ => 0,
        }
    }
}
