//! Values of GOPs, frames and units of profile 1, and the payloads that carry them.

use super::cells::Cell;
use super::network::Network;
use crate::crafted::coding::{Coding, Row};
use crate::crafted::scene::{Gaussian, Shape, Tools};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_format::entropy::layout::{Layout, PlaneInfo, Section, ShCoding};
use splatstream_format::entropy::model::{PlaneModel, write_models};
use splatstream_format::payload::{Codebook, Transform, write_leb128};
use splatstream_format::syntax::{GopHeader, IncrementHeader, SequenceParameters};
use std::collections::BTreeMap;

/// An increment: what its header says apart from counts and digests, and the values of its sections.
#[derive(Debug, Clone)]
pub(crate) struct Unit {
    pub(crate) spatial: u8,
    pub(crate) refinement: u8,
    pub(crate) header: IncrementHeader,
    pub(crate) cells: Vec<Cell>,
    pub(crate) modes: Vec<i64>,
    pub(crate) moves: Vec<[i64; 3]>,
    pub(crate) updates: Vec<Gaussian>,
    pub(crate) predictors: Vec<i64>,
    pub(crate) new: Vec<Gaussian>,
    /// By section and plane; the default for planes that are not named.
    pub(crate) shapes: BTreeMap<(Section, usize), Shape>,
    pub(crate) lanes_log2: u8,
    /// Models in force, where they can code the values of the plane.
    pub(crate) reuse: bool,
    /// In place of the models and blocks of a section that follow from the values.
    pub(crate) models: BTreeMap<Section, Vec<u8>>,
    pub(crate) blocks: BTreeMap<Section, Vec<Vec<u8>>>,
    /// Changes the header when counts and digests stand in it.
    pub(crate) edit: fn(&mut IncrementHeader),
}

/// A frame, and the codebook units that stand before it.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    /// k of 7.13.1.
    pub(crate) place: u32,
    /// With their temporal layers.
    pub(crate) codebooks: Vec<(u8, Codebook)>,
    pub(crate) dc_transform: u8,
    pub(crate) sh_transform: u8,
    /// In place of the Gaussians there are.
    pub(crate) count: Option<u32>,
    pub(crate) units: Vec<Unit>,
}

#[derive(Debug, Clone)]
pub(crate) struct Gop {
    pub(crate) header: GopHeader,
    pub(crate) transforms: Vec<Transform>,
    pub(crate) network: Option<Network>,
    pub(crate) frames: Vec<Frame>,
}

#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) level: u8,
    pub(crate) sequence: SequenceParameters,
    pub(crate) gops: Vec<Gop>,
    /// The entries of an operating_points unit, if there is one.
    pub(crate) points: Option<Vec<OperatingPoint>>,
    pub(crate) index: bool,
}

/// The models in force for a unit, SS-PM-010.
pub(crate) type InForce = BTreeMap<Section, (Layout, Vec<PlaneModel>)>;

impl Gop {
    /// The place of the frame that a frame refers to, by the table of 7.13.1: the nearest earlier one of a lower
    /// layer, in layer 0 of that layer.
    pub(crate) fn reference(&self, place: u32) -> Option<u32> {
        let layer = self.layer(place);
        (0..place)
            .rev()
            .find(|&earlier| self.layer(earlier) < layer || layer == 0 && self.layer(earlier) == 0)
            .filter(|_| self.is_predicted())
    }

    /// A place that many levels divide is of a low layer.
    pub(crate) fn layer(&self, place: u32) -> u8 {
        let depth = self.header.temporal_depth;
        let divides = |&level: &u8| place.is_multiple_of(1 << (depth - level));
        if self.is_predicted() { (0..=depth).find(divides).unwrap() } else { 0 }
    }

    pub(crate) fn is_predicted(&self) -> bool {
        self.header.gop_structure == 1
    }

    /// The codebooks in force for a frame: of each identifier the last one defined before it.
    pub(crate) fn codebooks(&self, frame: usize) -> Vec<Codebook> {
        let mut books: BTreeMap<u8, Codebook> = BTreeMap::new();
        for (_, book) in self.frames[..=frame].iter().flat_map(|frame| &frame.codebooks) {
            books.insert(book.header.codebook_id, book.clone());
        }
        books.into_values().collect()
    }

    pub(crate) fn tools<'a>(&'a self, frame: &Frame, codebooks: &'a [Codebook]) -> Option<Tools<'a>> {
        let find = |kind: u8, id: u8| {
            let mut transforms = self.transforms.iter();
            transforms.find(|it| (it.header.transform_kind, it.header.transform_id) == (kind, id))
        };
        Some(Tools { dc: find(0, frame.dc_transform)?, sh: find(1, frame.sh_transform), codebooks })
    }
}

impl Default for Unit {
    fn default() -> Self {
        Self {
            spatial: 0,
            refinement: 0,
            header: IncrementHeader::PLAIN,
            cells: Vec::new(),
            modes: Vec::new(),
            moves: Vec::new(),
            updates: Vec::new(),
            predictors: Vec::new(),
            new: Vec::new(),
            shapes: BTreeMap::new(),
            lanes_log2: 0,
            reuse: false,
            models: BTreeMap::new(),
            blocks: BTreeMap::new(),
            edit: |_| (),
        }
    }
}

impl Unit {
    /// The header with the counts that the sections have.
    pub(crate) fn counted(&self) -> IncrementHeader {
        let count = |length: usize| u32::try_from(length).unwrap();
        IncrementHeader {
            parent_count: count(self.modes.len()),
            cell_count: count(self.cells.len()),
            move_count: count(self.moves.len()),
            update_count: count(self.updates.len()),
            remove_count: count(self.modes.iter().filter(|&&mode| mode == 4).count()),
            new_count: count(self.new.len()),
            ..self.header
        }
    }

    /// The values of the entries of a section.
    fn rows(&self, section: Section, block_log2: u8) -> Vec<Row> {
        let signed = |signed: &[i64]| Row { delta: None, signed: signed.to_vec() };
        match section {
            Section::Cells => cell_rows(&self.cells, 1 << block_log2),
            Section::Modes => self.modes.iter().map(|&mode| signed(&[mode])).collect(),
            Section::Moves => self.moves.iter().map(|by| signed(by)).collect(),
            Section::Updates => {
                self.updates.iter().map(|update| Row { delta: None, ..update.row() }).collect()
            }
            Section::Predictors => self.predictors.iter().map(|&code| signed(&[code])).collect(),
            Section::New => self.new.iter().map(Gaussian::row).collect(),
        }
    }

    /// The payload; `in_force` are the models for the unit and become those after it.
    pub(crate) fn payload(
        &self,
        sequence: &SequenceParameters,
        tools: &Tools<'_>,
        in_force: &mut InForce,
        digests: [u64; 2],
    ) -> Vec<u8> {
        let [refinement_digest, carried_digest] = digests;
        let mut header = IncrementHeader { refinement_digest, carried_digest, ..self.counted() };
        (self.edit)(&mut header);
        let mut bytes = header_bytes(&header);
        let sh = match self.header.sh_mode {
            1 => ShCoding::Coefficients { rank: tools.sh.map_or(0, |transform| transform.header.rank) },
            2 => ShCoding::VectorQuantised { stages: self.header.vq_stage_count },
            _ => ShCoding::None,
        };
        for section in Section::ALL {
            let rows = self.rows(section, sequence.block_log2);
            let layout = Layout::of_section(section, tools.dc.header.rank, sh);
            if !rows.is_empty() {
                self.section(section, layout, &rows, in_force, sequence.block_log2, &mut bytes);
            }
        }
        bytes
    }

    /// 5.15.
    fn section(
        &self,
        section: Section,
        layout: Layout,
        rows: &[Row],
        in_force: &mut InForce,
        block_log2: u8,
        bytes: &mut Vec<u8>,
    ) {
        let of_section = |((at, plane), shape): (&(Section, usize), &Shape)| {
            (*at == section).then(|| (*plane, shape.clone()))
        };
        let shapes = self.shapes.iter().filter_map(of_section).collect();
        let planes = layout.planes();
        let coding = Coding { planes, rows, shapes: &shapes, lanes_log2: self.lanes_log2, block_log2 };
        let earlier = in_force.get(&section).filter(|_| self.reuse);
        let earlier: Vec<Option<PlaneModel>> =
            planes.iter().map(|plane| earlier.and_then(|known| same_plane(known, plane))).collect();
        let own = coding.models().into_iter().zip(&earlier).enumerate();
        let models: Vec<PlaneModel> = own
            .map(|(plane, (own, earlier))| {
                earlier.clone().filter(|model| coding.suits(plane, model)).unwrap_or(own)
            })
            .collect();
        let model_bytes = self.models.get(&section).cloned().unwrap_or_else(|| {
            // A model that no plane has stands for none.
            let none = PlaneModel { table_of_context: Vec::new(), ..models[0].clone() };
            let earlier: Vec<PlaneModel> =
                earlier.into_iter().map(|model| model.unwrap_or_else(|| none.clone())).collect();
            write_models(&models, &layout.alphabets(), Some(&earlier))
        });
        let blocks = self.blocks.get(&section).cloned().unwrap_or_else(|| coding.blocks(&models));
        bytes.push(self.lanes_log2);
        write_leb128(model_bytes.len() as u32, bytes);
        bytes.extend(model_bytes);
        blocks.iter().for_each(|block| write_leb128(block.len() as u32, bytes));
        bytes.extend(blocks.concat());
        in_force.insert(section, (layout, models));
    }
}

fn same_plane((layout, models): &(Layout, Vec<PlaneModel>), plane: &PlaneInfo) -> Option<PlaneModel> {
    let place = layout.planes().iter().position(|known| known == plane)?;
    Some(models[place].clone())
}

/// 7.15.1 from the other side: differences, anew in each block.
fn cell_rows(cells: &[Cell], block: usize) -> Vec<Row> {
    let row = |(place, cell): (usize, &Cell)| {
        let before = if place % block == 0 { Cell::default() } else { cells[place - 1] };
        let by = |now: [i64; 3], before: [i64; 3]| [0, 1, 2].map(|axis| now[axis] - before[axis]);
        let motion = by(cell.translation, before.translation).into_iter().chain(by(cell.turn, before.turn));
        let delta = cell.code.checked_sub(before.code).unwrap();
        Row { delta: Some(delta), signed: [cell.stale].into_iter().chain(motion).collect() }
    };
    cells.iter().enumerate().map(row).collect()
}

/// 5.14, element by element, whatever their values.
pub(crate) fn header_bytes(header: &IncrementHeader) -> Vec<u8> {
    let digests = [header.refinement_digest, header.carried_digest];
    let IncrementHeader { parent_count, cell_count, move_count, update_count, .. } = *header;
    let counts = [parent_count, cell_count, move_count, update_count, header.remove_count, header.new_count];
    let digests = digests.into_iter().flat_map(u64::to_le_bytes);
    let counts = counts.into_iter().flat_map(u32::to_le_bytes);
    let mut bytes: Vec<u8> = digests.chain(counts).collect();
    bytes.push(header.position_shift);
    bytes.extend(header.attribute_shift);
    bytes.extend([header.cell_log2, header.predictor_block_log2, header.neighbour_count]);
    bytes.extend([header.bilateral_spatial, header.bilateral_feature]);
    bytes.extend([header.sh_mode, header.vq_stage_count]);
    bytes.extend(header.codebook_ids);
    bytes
        .extend([header.compensation_log_scale.cast_unsigned(), header.compensation_opacity.cast_unsigned()]);
    bytes
}
