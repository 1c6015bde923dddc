//! The frames and increments of annex E, in the values of their sections.

use splatstream_decoder::increment::values::{SectionValues, UnitValues};
use splatstream_decoder::layout::Section;
use splatstream_decoder::position::morton;
use splatstream_format::payload::Transform;
use splatstream_format::syntax::{GopHeader, IncrementHeader, SequenceParameters, TransformHeader, UnitId};

/// log2 of the entries of a block: no section here has more than one.
const BLOCK_LOG2: u8 = 6;

/// Values of the planes of an entry of updates or new: log_scale, opacity, rotation, dc.
type Values = [i32; 10];

/// An increment without counts and digests.
#[derive(Default)]
struct Plan {
    /// Frame, spatial layer, refinement.
    at: (u32, u8, u8),
    position_shift: u8,
    attribute_step: [u8; 5],
    modes: Vec<i32>,
    moves: Vec<[i32; 3]>,
    updates: Vec<Values>,
    predictor: Option<i32>,
    /// Coded position and values.
    new: Vec<([u32; 3], Values)>,
    compensation: (i8, i8),
}

/// A unit to be written; its digests are still 0.
pub(crate) struct Planned {
    pub(crate) id: UnitId,
    pub(crate) header: IncrementHeader,
    pub(crate) values: UnitValues,
}

pub(crate) fn sequence() -> SequenceParameters {
    SequenceParameters {
        sh_degree: 0,
        spatial_layer_count: 2,
        temporal_layer_count: 2,
        refinement_count: 2,
        refinement_percent: [50, 100, 0, 0, 0, 0, 0, 0, 0, 0],
        position_bits: 10,
        linear_log2: 8,
        segment_log2: 7,
        block_log2: BLOCK_LOG2,
        sequence_flags: SequenceParameters::flags(true, false, false),
        size_weight: [0, 1000, 0, 0, 0],
        anisotropy_weight: 4096,
        size_reference: 12,
        anisotropy_reference: 4,
        frame_count: 3,
        ticks_per_second: 30,
        ticks_per_frame: 1,
        position_offset: [(-8.0_f32).to_bits(), (-8.0_f32).to_bits(), 0],
        position_step: 0.015625_f32.to_bits(),
        log_scale_offset: (-6.0_f32).to_bits(),
        log_scale_step: 0.25_f32.to_bits(),
        rotation_step: 0.03125_f32.to_bits(),
        opacity_step: 0.5_f32.to_bits(),
        dc_step: 0.125_f32.to_bits(),
        ..SequenceParameters::PLAIN
    }
}

pub(crate) fn gop() -> GopHeader {
    GopHeader::predicted(0, 3, 1)
}

/// Grey, red against blue, green against both.
pub(crate) fn transform() -> Transform {
    let header = TransformHeader { transform_id: 0, transform_kind: 0, dimension: 3, rank: 3 };
    let basis = vec![2365, 2365, 2365, 2896, 0, -2896, 1672, -3344, 1672];
    Transform { header, mean: vec![64, 48, 32], basis }
}

/// A frame without its increments.
pub(crate) struct FramePlan {
    pub(crate) gaussian_count: u32,
    pub(crate) cell_log2: u8,
    pub(crate) cells: SectionValues,
}

/// All frames.
pub(crate) fn frames() -> [FramePlan; 3] {
    // Code; stale, translation, rotation.
    let second = [(10, [0, 12, -20, 5, 0, 0, 1024]), (17, [1, 0, 0, 0, 0, 0, 0])];
    let third = [(1, [0, 8, 0, -16, 0, 0, 0])];
    let plan = |gaussian_count, cell_log2, cells: &[(u64, [i32; 7])]| {
        let codes: Vec<u64> = cells.iter().map(|(code, _)| *code).collect();
        let (deltas, planes) = (deltas(&codes), planes(&cell_differences(cells)));
        FramePlan {
            gaussian_count,
            cell_log2,
            cells: SectionValues { deltas, planes, block: 1 << BLOCK_LOG2 },
        }
    };
    [plan(5, 0, &[]), plan(6, 8, &second), plan(5, 9, &third)]
}

/// All increments in stream order.
pub(crate) fn increments() -> Vec<Planned> {
    intra().into_iter().chain(enhancement()).chain(predicted()).map(Plan::into_unit).collect()
}

/// Frame 0: three Gaussians in layer 0 with steps twice as large, two more and finer steps in layer 1.
fn intra() -> [Plan; 4] {
    let coarse = || Plan { position_shift: 1, attribute_step: [1; 5], ..Plan::default() };
    [
        Plan {
            new: vec![
                ([50, 100, 150], [6, 1, 2, 2, 3, -2, 0, 9, -3, 1]),
                ([300, 202, 75], [5, 0, 1, 1, 0, 0, -5, 4, 2, 0]),
            ],
            compensation: (2, 1),
            ..coarse()
        },
        Plan { at: (0, 0, 1), new: vec![([305, 212, 70], [4, 1, 0, 1, 1, 0, -4, 5, 2, -1])], ..coarse() },
        Plan {
            at: (0, 1, 0),
            modes: vec![3, 1],
            moves: vec![[-1, -1, -1], [-1, 0, 1]],
            updates: vec![[1, -1, 1, 1, 0, 1, -1, 1, 0, 0]],
            new: vec![([320, 640, 70], [10, 2, 3, 6, -8, 4, 2, -6, 1, 4])],
            compensation: (2, 1),
            ..Plan::default()
        },
        Plan {
            at: (0, 1, 1),
            modes: vec![2],
            updates: vec![[0, 1, 0, -1, 1, 0, 0, 0, 1, 0]],
            predictor: Some(1),
            new: vec![([330, 650, 80], [1, 0, 1, -1, 2, 0, -1, 0, 1, -1])],
            ..Plan::default()
        },
    ]
}

/// Frame 1, a B frame: of list 0 the first Gaussian is removed, the second kept and displaced, the third moved.
fn enhancement() -> [Plan; 2] {
    [
        Plan {
            at: (1, 1, 0),
            modes: vec![4, 0, 1],
            moves: vec![[3, -2, 0]],
            predictor: Some(2),
            new: vec![([590, 400, 160], [-1, 1, 0, 2, 0, 1, 0, 1, 0, 0])],
            compensation: (1, 2),
            ..Plan::default()
        },
        Plan {
            at: (1, 1, 1),
            modes: vec![2, 0],
            updates: vec![[1, 0, -1, 1, 0, 2, 0, 0, 0, 1]],
            predictor: Some(1),
            new: vec![([325, 655, 90], [0, 0, 0, 1, 0, 0, 1, 1, -1, 0])],
            ..Plan::default()
        },
    ]
}

/// Frame 2, a P frame: it refers to frame 0 as well. Its residuals have larger steps.
fn predicted() -> [Plan; 2] {
    [
        Plan {
            at: (2, 1, 0),
            position_shift: 1,
            attribute_step: [1, 0, 0, 1, 0],
            modes: vec![3, 0, 1],
            moves: vec![[2, -1, 0], [-2, 3, 1]],
            updates: vec![[-1, 1, 0, 0, 1, 0, 0, 2, 0, -1]],
            compensation: (1, 1),
            ..Plan::default()
        },
        Plan {
            at: (2, 1, 1),
            position_shift: 1,
            attribute_step: [1, 0, 0, 1, 0],
            modes: vec![4, 2],
            updates: vec![[1, 0, 0, 2, 0, -1, 0, 0, 1, 0]],
            predictor: Some(1),
            new: vec![([150, 300, 50], [0, 1, 0, 0, 0, 1, 0, 0, 0, 1])],
            ..Plan::default()
        },
    ]
}

/// Entries as planes.
fn planes<const N: usize>(rows: &[[i32; N]]) -> Vec<Vec<i32>> {
    (0..N).map(|plane| rows.iter().map(|row| row[plane]).collect()).collect()
}

/// Differences, the first from 0.
fn deltas(codes: &[u64]) -> Vec<u64> {
    codes.iter().scan(0, |before, &code| Some(code - core::mem::replace(before, code))).collect()
}

/// What 7.5.1 adds up again: `stale` as it is, motions as differences from the cell before.
fn cell_differences(cells: &[(u64, [i32; 7])]) -> Vec<[i32; 7]> {
    let before = [[0; 7]].into_iter().chain(cells.iter().map(|(_, cell)| *cell));
    let row = |((_, cell), before): (&(u64, [i32; 7]), [i32; 7])| {
        core::array::from_fn(|plane| cell[plane] - if plane == 0 { 0 } else { before[plane] })
    };
    cells.iter().zip(before).map(row).collect()
}

impl Plan {
    fn into_unit(self) -> Planned {
        let (frame, spatial, refinement) = self.at;
        let layer = gop().role(frame).temporal_layer;
        let id = UnitId::of_increment(frame, refinement).on_layers(spatial, layer);
        Planned { id, header: self.header(), values: self.values() }
    }

    fn header(&self) -> IncrementHeader {
        let count = |holds: fn(i32) -> bool| self.modes.iter().filter(|&&mode| holds(mode)).count() as u32;
        let header = IncrementHeader {
            parent_count: self.modes.len() as u32,
            move_count: count(|mode| mode & 1 != 0),
            update_count: count(|mode| mode & 2 != 0),
            remove_count: count(|mode| mode == 4),
            new_count: self.new.len() as u32,
            position_shift: self.position_shift,
            attribute_step: self.attribute_step,
            compensation_log_scale: self.compensation.0,
            compensation_opacity: self.compensation.1,
            ..IncrementHeader::PLAIN
        };
        let predicted = IncrementHeader {
            predictor_block_log2: 0,
            neighbour_count: 3,
            bilateral_spatial: 32,
            bilateral_feature: 16,
            ..header
        };
        if self.predictor.is_some() { predicted.with_flags() } else { header.with_flags() }
    }

    fn values(&self) -> UnitValues {
        let mut values = UnitValues::default();
        let mut set = |section: Section, deltas: Vec<u64>, planes: Vec<Vec<i32>>| {
            if !planes.iter().all(Vec::is_empty) {
                values.set(section, SectionValues { deltas, planes, block: 1 << BLOCK_LOG2 });
            }
        };
        set(Section::Modes, Vec::new(), vec![self.modes.clone()]);
        set(Section::Moves, Vec::new(), planes(&self.moves));
        set(Section::Updates, Vec::new(), planes(&self.updates));
        let predictors = self.predictor.map_or(Vec::new(), |predictor| vec![predictor; self.new.len()]);
        set(Section::Predictors, Vec::new(), vec![predictors]);
        let codes: Vec<u64> = self.new.iter().map(|([x, y, z], _)| morton(*x, *y, *z)).collect();
        let rows: Vec<Values> = self.new.iter().map(|(_, values)| *values).collect();
        set(Section::New, deltas(&codes), planes(&rows));
        values
    }
}
