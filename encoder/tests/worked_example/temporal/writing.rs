//! The stream of annex E: sections to bytes, units to a file.

use super::scene::{Planned, frames, gop, increments, sequence, transform};
use super::walk::{Common, Walked};
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::layout::{Layout, Section, ShCoding};
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::in_force::{ModelsInForce, SectionModels};
use splatstream_format::entropy::model::{ContextAxis, PlaneModel, write_models};
use splatstream_format::entropy::token::{Alphabet, split, zigzag};
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};
use splatstream_format::payload::{CellsBytes, Index, SectionBytes, write_frame, write_increment};
use splatstream_format::syntax::{EndOfStream, FrameHeader, IndexEntry, Profile, UnitId, UnitType};
use splatstream_format::unit::{write_file_header, write_unit};

/// Components of the dc transform.
const RANK: u8 = 3;

/// The stream, and what stands between its units and its frames.
pub(crate) fn written() -> (Vec<u8>, Common, Vec<Walked>) {
    let common = Common { sequence: sequence(), gop: gop(), transform: transform() };
    let mut file = File { bytes: write_file_header(Profile::Dynamic, 1).unwrap(), units: 0 };
    file.unit(UnitId::stream(UnitType::SequenceParameters), &common.sequence.to_bytes().unwrap());
    let gop_at = file.bytes.len() as u64;
    file.unit(UnitId::of_frame(UnitType::GopHeader, 0), &common.gop.to_bytes().unwrap());
    let transform = common.transform.to_bytes(&common.sequence).unwrap();
    file.unit(UnitId::of_frame(UnitType::Transform, 0), &transform);
    let mut walked: Vec<Walked> = Vec::new();
    let mut units = increments().into_iter().peekable();
    for (index, plan) in (0..).zip(frames()) {
        let mut frame = common.start(&walked, index, plan);
        file.frame_header(&common, &mut frame);
        while let Some(unit) = units.next_if(|unit| unit.id.frame == index) {
            file.increment(&common, &walked, &mut frame, unit);
        }
        walked.push(frame);
    }
    let index_offset = file.bytes.len() as u64;
    let entries = vec![IndexEntry { frame: 0, reserved_zero: 0, offset: gop_at }];
    file.unit(UnitId::stream(UnitType::Index), &Index { entries }.to_bytes().unwrap());
    let end = EndOfStream { frame_count: walked.len() as u32, unit_count: file.units, index_offset };
    file.unit(UnitId::stream(UnitType::End), &end.to_bytes().unwrap());
    (file.bytes, common, walked)
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

    fn frame_header(&mut self, common: &Common, frame: &mut Walked) {
        let role = common.gop.role(frame.index);
        let header = FrameHeader::new(role.frame_type, 0, None, frame.plan.gaussian_count);
        let cell_count = frame.plan.cells.deltas.len() as u32;
        let cells = (cell_count > 0).then(|| CellsBytes {
            cell_count,
            cell_log2: frame.plan.cell_log2,
            section: coded(Section::Cells, &frame.plan.cells, &mut frame.models.first),
        });
        let payload = write_frame(&header, None, cells.as_ref(), &common.sequence).unwrap();
        let id = UnitId::of_frame(UnitType::FrameHeader, frame.index).on_layers(0, role.temporal_layer);
        self.unit(id, &payload);
    }

    fn increment(&mut self, common: &Common, walked: &[Walked], frame: &mut Walked, unit: Planned) {
        let Planned { id, header, values } = unit;
        common.step(walked, frame, id, header, values);
        let step = frame.steps.last().unwrap();
        let mut models = frame.models.before(id.refinement).clone();
        let present = Section::OF_INCREMENT.into_iter().filter(|&section| step.header.count(section) > 0);
        let sections: Vec<SectionBytes> =
            present.map(|section| coded(section, step.values.section(section), &mut models)).collect();
        self.unit(id, &write_increment(&step.header, &common.sequence, &sections).unwrap());
        frame.models.follow(id.refinement, models);
    }
}

/// One block and one table per plane; models in force are used again where they have a frequency for every token.
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
