//! The stream of annex E: sections to bytes, units to a file, and back.

use super::scene::{COUNTS, Planned, gop, increments, sequence, transform};
use super::walk::{Common, Walked};
use splatstream_decoder::increment::values::{PreparedIncrement, SectionValues, UnitValues};
use splatstream_decoder::layout::{Layout, Section, ShCoding};
use splatstream_format::Limits;
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::in_force::{ModelsInForce, SectionModels};
use splatstream_format::entropy::model::{ContextAxis, PlaneModel, write_models};
use splatstream_format::entropy::token::{Alphabet, split, zigzag};
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};
use splatstream_format::payload::{Increment, Index, SectionBytes, Transform, write_increment};
use splatstream_format::syntax::{
    EndOfStream, FrameHeader, GopHeader, IncrementHeader, IndexEntry, Profile, SequenceParameters, UnitId,
    UnitType,
};
use splatstream_format::unit::{Stream, write_file_header, write_unit};

/// Components of the dc transform.
const RANK: u8 = 3;

/// The stream, its digests computed by the decoder.
pub(crate) fn stream() -> Vec<u8> {
    let common = Common { sequence: sequence(), gop: gop(), transform: transform() };
    let mut file = File { bytes: write_file_header(Profile::Dynamic, 1).unwrap(), units: 0 };
    let stream = |unit_type| UnitId::of_frame(unit_type, 0);
    file.unit(stream(UnitType::SequenceParameters), &common.sequence.to_bytes().unwrap());
    let gop_at = file.bytes.len() as u64;
    file.unit(stream(UnitType::GopHeader), &common.gop.to_bytes().unwrap());
    file.unit(stream(UnitType::Transform), &common.transform.to_bytes(&common.sequence).unwrap());
    let mut frames: Vec<Walked> = Vec::new();
    for unit in increments() {
        let number = unit.id.frame;
        if frames.len() <= number as usize {
            file.frame_header(&common, number);
            frames.push(common.start(&frames, number));
        }
        file.increment(&common, &mut frames, unit);
    }
    let index_offset = file.bytes.len() as u64;
    let entries = vec![IndexEntry { frame: 0, reserved_zero: 0, offset: gop_at }];
    file.unit(stream(UnitType::Index), &Index { entries }.to_bytes().unwrap());
    let end = EndOfStream { frame_count: COUNTS.len() as u32, unit_count: file.units, index_offset };
    file.unit(stream(UnitType::End), &end.to_bytes().unwrap());
    file.bytes
}

struct File {
    bytes: Vec<u8>,
    units: u32,
}

impl File {
    fn unit(&mut self, id: UnitId, payload: &[u8]) {
        write_unit(&mut self.bytes, id, payload).unwrap();
        self.units += 1;
    }

    fn frame_header(&mut self, common: &Common, number: u32) {
        let place = common.gop.place(number);
        let header = FrameHeader::new(place.frame_type, 0, None, COUNTS[number as usize]);
        let spatial = u8::from(place.reference.is_some());
        let id = UnitId::of_frame(UnitType::FrameHeader, number).on_layers(spatial, place.temporal_layer);
        self.unit(id, &header.to_bytes().unwrap());
    }

    fn increment(&mut self, common: &Common, frames: &mut Vec<Walked>, unit: Planned) {
        let mut frame = frames.pop().unwrap();
        let Planned { id, header, values } = unit;
        common.step(frames, &mut frame, id, header, values);
        let step = frame.steps.last().unwrap();
        let [refinement_digest, carried_digest] = step.digests;
        let header = IncrementHeader { refinement_digest, carried_digest, ..header };
        let mut models = frame.models[usize::from(id.refinement > 0)].clone();
        let present = Section::ALL.into_iter().filter(|&section| header.count(section) > 0);
        let sections: Vec<SectionBytes> =
            present.map(|section| coded(section, step.values.section(section), &mut models)).collect();
        frame.follow(id.refinement, models);
        self.unit(id, &write_increment(&header, &common.sequence, &sections).unwrap());
        frames.push(frame);
    }
}

impl Walked {
    /// Which models are in force, by clause 6.12.
    fn follow(&mut self, refinement: u8, models: ModelsInForce) {
        if refinement == 0 {
            self.models[0] = models.clone();
        }
        self.models[1] = models;
    }
}

/// One block and one table a plane; models in force are used again where they have a frequency for every token.
fn coded(section: Section, values: &SectionValues, in_force: &mut ModelsInForce) -> SectionBytes {
    let layout = Layout::of_section(section, RANK, ShCoding::None);
    let first = usize::from(layout.planes()[0].is_position());
    let symbols = |(plane, alphabet): (usize, &Alphabet)| -> Vec<u64> {
        match alphabet {
            Alphabet::Position => values.deltas.clone(),
            _ => values.planes[plane - first].iter().map(|&value| zigzag(value).into()).collect(),
        }
    };
    let symbols: Vec<Vec<u64>> = layout.alphabets().iter().enumerate().map(symbols).collect();
    let before = in_force.get(section).map(|known| known.models.as_slice());
    let model = |(plane, values): (usize, &Vec<u64>)| {
        let known = before.and_then(|before| before.get(plane)).filter(|known| suits(known, values));
        known.cloned().unwrap_or_else(|| own(values))
    };
    let models: Vec<PlaneModel> = symbols.iter().enumerate().map(model).collect();
    let mut block = BlockWriter::new(0);
    for (model, values) in models.iter().zip(&symbols) {
        block.plane(&PlaneEncoder::new(model), &[], values.iter().copied()).unwrap();
    }
    let model = write_models(&models, &layout.alphabets(), before);
    in_force.replace(section, SectionModels { layout, models });
    SectionBytes { lanes_log2: 0, model, blocks: vec![block.finish()] }
}

fn suits(model: &PlaneModel, values: &[u64]) -> bool {
    let frequency = |&value: &u64| {
        let token = split(value, model.direct_log2).token;
        model.tables[0].of_token().get(usize::from(token)).copied().unwrap_or(0)
    };
    values.iter().all(|value| frequency(value) > 0)
}

fn own(values: &[u64]) -> PlaneModel {
    let mut counts = vec![0; 256];
    values.iter().for_each(|&value| counts[usize::from(split(value, 3).token)] += 1);
    PlaneModel {
        bias: 0,
        direct_log2: 3,
        axes: [ContextAxis::NONE; 2],
        tables: vec![Frequencies::from_counts(&counts)],
        table_of_context: vec![0],
    }
}

/// The bytes of a stream taken apart again.
pub(crate) fn walked(bytes: &[u8]) -> (Common, Vec<Walked>) {
    let limits = Limits::default();
    let (mut sequence, mut gop, mut common) = (None, None, None);
    let mut frames: Vec<Walked> = Vec::new();
    for unit in Stream::open(bytes, &limits).unwrap().units() {
        let unit = unit.unwrap();
        let (payload, at) = (unit.payload, unit.payload_at);
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                sequence = SequenceParameters::parse_payload(payload, at, Profile::Dynamic).ok();
            }
            UnitType::GopHeader => gop = GopHeader::parse_payload(payload, at, Profile::Dynamic).ok(),
            UnitType::Transform => {
                let (sequence, gop) = (sequence.unwrap(), gop.unwrap());
                let transform = Transform::parse(payload, at, &sequence).unwrap();
                common = Some(Common { sequence, gop, transform });
            }
            UnitType::FrameHeader => {
                frames.push(common.as_ref().unwrap().start(&frames, unit.header.frame));
            }
            UnitType::Increment => {
                let mut frame = frames.pop().unwrap();
                one(common.as_ref().unwrap(), &frames, &mut frame, unit.header.id(), (payload, at));
                frames.push(frame);
            }
            _ => {}
        }
    }
    (common.unwrap(), frames)
}

fn one(common: &Common, frames: &[Walked], frame: &mut Walked, id: UnitId, (payload, at): (&[u8], u64)) {
    let increment = Increment::parse(payload, at, &common.sequence, &Limits::default()).unwrap();
    let mut models = frame.models[usize::from(id.refinement > 0)].clone();
    let prepared = PreparedIncrement::new(&increment, RANK, ShCoding::None, &mut models, &mut ()).unwrap();
    let values: UnitValues = prepared.decode(&common.sequence).unwrap();
    common.step(frames, frame, id, increment.header, values);
    frame.follow(id.refinement, models);
    let header = increment.header;
    let computed = frame.steps.last().unwrap().digests;
    assert_eq!(computed, [header.refinement_digest, header.carried_digest], "the digests of unit {id:?}");
}
