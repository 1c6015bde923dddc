//! The cases: each takes the most that a level allows of one kind of work, with as few bytes as it can.

use crate::healing::heal;
use crate::stream::{SH, SH_RANK, Writer, cells, constant, crowded, sequence};
use splatstream_format::Limits;
use splatstream_format::entropy::layout::{Attribute, PlaneInfo, Section, ShCoding};
use splatstream_format::payload::{Codebook, Layer, Network, Part, SectionBytes, Weights};
use splatstream_format::syntax::{
    CodebookHeader, GopHeader, IncrementHeader, NetworkHeader, Profile, ShMode, UnitId, UnitType,
};

/// A stream and what annex A.3 says of it.
pub(crate) struct Case {
    pub(crate) bytes: Vec<u8>,
    /// Frames that the work is divided by.
    pub(crate) frames: u32,
    /// What is counted in a frame, and of what.
    pub(crate) work: u64,
    pub(crate) unit: &'static str,
    /// Bytes of the Gaussians that are kept.
    pub(crate) memory: u64,
    /// Whether the stream has errors on purpose.
    pub(crate) is_damaged: bool,
}

type Make = fn(u8, &Limits) -> Case;

pub(crate) const ALL: [(&str, Make); 18] = [
    ("static", of_intra_frames),
    ("codebooks", codebooks),
    ("layers", spatial_layers),
    ("parents", parents),
    ("move-neighbours", |level, limits| moved(level, limits, &[100])),
    ("move-neighbours-10", |level, limits| moved(level, limits, &TENTHS)),
    ("replaced", |level, limits| replaced(level, limits, 0, &[100])),
    ("neighbours", |level, limits| replaced(level, limits, 2, &[100])),
    ("neighbours-10", |level, limits| replaced(level, limits, 2, &TENTHS)),
    ("network", |level, limits| replaced(level, limits, 3, &[50, 100])),
    ("carried-16", |level, limits| carried(level, limits, 16)),
    ("carried-64", |level, limits| carried(level, limits, 64)),
    ("late-128", |level, limits| late(level, limits, 128)),
    ("late-1024", |level, limits| late(level, limits, 1024)),
    ("references", references),
    ("tables", tables),
    ("units", empty_units),
    ("scans", scans),
];

const TENTHS: [u8; 10] = [10, 20, 30, 40, 50, 60, 70, 80, 90, 100];
/// log2 of the values of a block: so long that the states of a block are just enough bytes for new Gaussians.
const BLOCK_LOG2: u8 = 11;
/// Bytes of a Gaussian, and what its carried copy adds, by A.3.
const EXACT: u64 = 233;
const CARRIED: u64 = 28;
/// Parents that are moved and changed.
const MODE_BOTH: i32 = 3;
const MODE_REMOVED: i32 = 4;
/// Parents that are moved only, and the move predictor that looks for neighbours.
const MODE_MOVED: i32 = 1;
const NEIGHBOURS_OF_MOVES: i32 = 2;

/// A section in which every Gaussian is like the others.
fn section(section: Section, count: u32, mode: i32, predictor: i32) -> SectionBytes {
    constant((section, SH), count, BLOCK_LOG2, |plane: PlaneInfo| match plane.attribute {
        Attribute::Mode => mode,
        Attribute::Predictor => predictor,
        Attribute::MovePredictor => NEIGHBOURS_OF_MOVES,
        Attribute::Move | Attribute::Position => 0,
        _ => 1,
    })
}

/// New Gaussians, with spherical harmonics.
fn new(new_count: u32) -> IncrementHeader {
    IncrementHeader { new_count, sh_mode: ShMode::Coefficients.code(), ..IncrementHeader::PLAIN }
}

/// Parents that all are moved and changed.
fn changed(parent_count: u32) -> IncrementHeader {
    IncrementHeader { parent_count, move_count: parent_count, update_count: parent_count, ..new(0) }
}

/// The I frame of a predicted GOP: all Gaussians new, at one spatial layer.
fn anchor(writer: &mut Writer, gaussians: u32) {
    writer.frame(0, gaussians, None, None);
    for r in 0..writer.sequence.refinement_count {
        let count = writer.sequence.refinement_length(r, gaussians);
        writer.increment(0, (0, r), new(count), |kind, count| section(kind, count, 0, 0));
    }
}

fn case(
    writer: Writer,
    limits: &Limits,
    frames: u32,
    (work, unit): (u64, &'static str),
    memory: u64,
) -> Case {
    let mut bytes = writer.finish();
    heal(&mut bytes, limits);
    Case { bytes, frames, work, unit, memory, is_damaged: false }
}

fn of_intra_frames(level: u8, limits: &Limits) -> Case {
    let n = limits.max_gaussians;
    let frames = 3;
    let mut writer = Writer::new(Profile::Intra, level, sequence(1, 1, &[100], BLOCK_LOG2));
    writer.gop(0, GopHeader::intra(0, frames));
    for frame in 0..frames {
        writer.frame(frame, n, None, None);
        writer.increment(frame, (0, 0), new(n), |kind, count| section(kind, count, 0, 0));
    }
    case(writer, limits, frames, (56 * u64::from(n), "symbols"), EXACT * u64::from(n))
}

/// Every frame brings codebooks as large as they may be, and uses four of them for every Gaussian.
fn codebooks(level: u8, limits: &Limits) -> Case {
    let n = limits.max_gaussians;
    let frames = 3;
    let entries = (limits.max_codebook_values / u32::from(SH_RANK) / 4).min(1 << 16);
    let mut writer = Writer::new(Profile::Intra, level, sequence(1, 1, &[100], BLOCK_LOG2));
    writer.gop(0, GopHeader::intra(0, frames));
    for frame in 0..frames {
        for codebook_id in 0..4 {
            let entry_count_minus1 = (entries - 1) as u16;
            let header =
                CodebookHeader { codebook_id, component_count: SH_RANK, entry_count_minus1, value_bytes: 1 };
            writer.codebook(&Codebook { header, entries: vec![1; header.value_count() as usize] });
        }
        writer.frame(frame, n, None, None);
        let sh_mode = ShMode::VectorQuantised.code();
        let header = IncrementHeader { sh_mode, vq_stage_count: 4, codebook_ids: [0, 1, 2, 3], ..new(n) };
        writer.increment(frame, (0, 0), header, |kind, count| {
            constant((kind, ShCoding::VectorQuantised { stages: 4 }), count, BLOCK_LOG2, |_| 1)
        });
    }
    let memory = EXACT * u64::from(n) + 2 * u64::from(limits.max_codebook_values);
    case(writer, limits, frames, (15 * u64::from(n), "symbols"), memory)
}

/// An I frame of four spatial layers, each of which changes every Gaussian of the one below.
fn spatial_layers(level: u8, limits: &Limits) -> Case {
    let n = limits.max_gaussians;
    let mut writer = Writer::new(Profile::Dynamic, level, sequence(4, 1, &[100], BLOCK_LOG2));
    writer.gop(0, GopHeader::intra(0, 1));
    anchor(&mut writer, n);
    for layer in 1..4 {
        writer.increment(0, (layer, 0), changed(n), |kind, count| section(kind, count, MODE_BOTH, 0));
    }
    case(writer, limits, 1, ((3 * 59 + 56) * u64::from(n), "symbols"), EXACT * u64::from(n))
}

/// P frames of a few bytes, each of which changes every Gaussian of the one before.
fn parents(level: u8, limits: &Limits) -> Case {
    let n = limits.max_gaussians;
    let frames = 4;
    let mut writer = Writer::new(Profile::Dynamic, level, sequence(1, 1, &[100], BLOCK_LOG2));
    writer.gop(0, GopHeader::predicted(0, frames, 0));
    anchor(&mut writer, n);
    for frame in 1..frames {
        writer.frame(frame, n, None, None);
        writer.increment(frame, (0, 0), changed(n), |kind, count| section(kind, count, MODE_BOTH, 0));
    }
    case(writer, limits, frames, (59 * u64::from(n), "symbols"), 2 * (EXACT + CARRIED) * u64::from(n))
}

/// P frames that move every Gaussian of the one before, as its neighbours moved. All Gaussians are at one position.
fn moved(level: u8, limits: &Limits, percents: &[u8]) -> Case {
    let n = limits.max_gaussians;
    let frames = 3;
    let mut writer = Writer::new(Profile::Dynamic, level, sequence(1, 1, percents, BLOCK_LOG2));
    writer.gop(0, GopHeader::predicted(0, frames, 0));
    anchor(&mut writer, n);
    for frame in 1..frames {
        writer.frame(frame, n, None, None);
        for r in 0..writer.sequence.refinement_count {
            let count = writer.sequence.refinement_length(r, n);
            let plain = IncrementHeader::PLAIN;
            let header =
                IncrementHeader { parent_count: count, move_count: count, move_block_log2: 16, ..plain };
            writer.increment(frame, (0, r), header, |kind, count| section(kind, count, MODE_MOVED, 0));
        }
    }
    let memory = 2 * (EXACT + CARRIED) * u64::from(n);
    case(writer, limits, frames - 1, (32 * u64::from(n), "distances"), memory)
}

/// P frames that replace every Gaussian of the one before by a predicted one. All Gaussians are at one position.
fn replaced(level: u8, limits: &Limits, predictor: i32, percents: &[u8]) -> Case {
    let n = limits.max_gaussians;
    // The network takes long, and half of a frame is all that it may predict of an increment.
    let (frames, lists) = if predictor == 3 { (2, 1) } else { (3, percents.len() as u8) };
    let mut writer = Writer::new(Profile::Dynamic, level, sequence(1, 1, percents, BLOCK_LOG2));
    writer.gop(0, GopHeader::predicted(0, frames, 0));
    if predictor == 3 {
        writer.weights(&Weights::Carried(Box::new(largest_network())));
    }
    anchor(&mut writer, n);
    for frame in 1..frames {
        writer.frame(frame, n, None, None);
        for r in 0..lists {
            let count = writer.sequence.refinement_length(r, n);
            let mut header = IncrementHeader { parent_count: count, remove_count: count, ..new(count) };
            if predictor > 0 {
                (header.predictor_block_log2, header.neighbour_count) = (16, 16);
                (header.bilateral_spatial, header.bilateral_feature) = (1, 1);
            }
            writer.increment(frame, (0, r), header, |kind, count| {
                section(kind, count, MODE_REMOVED, predictor)
            });
        }
    }
    let work = match predictor {
        0 => (57, "symbols"),
        3 => (1, "Gaussians through the network"),
        _ => (32, "distances"),
    };
    let memory = 2 * (EXACT + CARRIED) * u64::from(n);
    let count = if predictor == 3 { limits.max_learned } else { n };
    case(writer, limits, frames - 1, (work.0 * u64::from(count), work.1), memory)
}

/// A network that has everything.
fn largest_network() -> Network {
    let header = NetworkHeader {
        network_flags: NetworkHeader::flags(true, true, true, false),
        width_log2: 6,
        feed_forward_width: 128,
        geometry_width: 32,
        fourier_count: 4,
        rank_count: 16,
        dc_count: 3,
        sh_count: 16,
        token_shift: 0,
        output_shift: 0,
        layer_shift: [8; 8],
    };
    let layers = Part::ALL.map(|part| {
        let (weights, biases) = part.lengths(&header);
        Layer { weights: vec![3; weights], bias: vec![5; biases] }
    });
    Network::new(header, layers).expect("it is in range")
}

/// Cells that move in every frame, and no increment: all Gaussians are carried from frame to frame.
fn carried(level: u8, limits: &Limits, frames: u32) -> Case {
    let n = limits.max_gaussians;
    let mut writer = Writer::new(Profile::Dynamic, level, sequence(1, 1, &[100], BLOCK_LOG2));
    writer.gop(0, GopHeader::predicted(0, frames, 0));
    anchor(&mut writer, n);
    let cells = cells(limits.max_cells, 0, BLOCK_LOG2);
    for frame in 1..frames {
        writer.frame(frame, n, None, Some(&cells));
    }
    case(writer, limits, frames, (u64::from(n), "displaced"), 2 * (EXACT + CARRIED) * u64::from(n))
}

/// Frames that are complete, so that nobody asks for carried lists, up to the highest temporal layer, whose frames have no
/// increment. A hundredth of the Gaussians of the level, and one cell that moves.
fn late(level: u8, limits: &Limits, frames: u32) -> Case {
    let n = limits.max_gaussians / 64;
    let mut writer = Writer::new(Profile::Dynamic, level, sequence(1, 4, &[100], BLOCK_LOG2));
    let header = GopHeader::predicted(0, frames, 3);
    writer.gop(0, header);
    anchor(&mut writer, n);
    let cells = cells(1, 10, BLOCK_LOG2);
    for frame in 1..frames {
        writer.frame(frame, n, None, Some(&cells));
        if header.role(frame).temporal_layer < 3 {
            let skipped = IncrementHeader { parent_count: n, ..IncrementHeader::PLAIN };
            writer.increment(frame, (0, 0), skipped, |kind, count| section(kind, count, 0, 0));
        }
    }
    case(writer, limits, frames, (2 * u64::from(n), "displaced"), 4 * (EXACT + CARRIED) * u64::from(n))
}

/// Four temporal layers, in which every frame that is kept has as many exact Gaussians and as many carried ones as it may,
/// all of them its own.
fn references(level: u8, limits: &Limits) -> Case {
    let n = limits.max_gaussians;
    let frames = 9;
    let header = GopHeader::predicted(0, frames, 3);
    let mut writer = Writer::new(Profile::Dynamic, level, sequence(1, 4, &[50, 100], BLOCK_LOG2));
    writer.gop(0, header);
    anchor(&mut writer, n);
    let cells = cells(limits.max_cells, 0, BLOCK_LOG2);
    for frame in 1..frames {
        writer.frame(frame, n, Some(0), Some(&cells));
        // List 0 of the I frame is half of it; in other frames it is all that a frame may have.
        let new_count = if header.role(frame).reference == Some(0) { n / 2 } else { 0 };
        let increment = IncrementHeader { new_count, ..changed(n - new_count) };
        writer.increment(frame, (0, 0), increment, |kind, count| section(kind, count, MODE_BOTH, 0));
    }
    case(writer, limits, frames, (2 * u64::from(n), "displaced"), 4 * (EXACT + CARRIED) * u64::from(n))
}

/// Ten Gaussians, and in every unit 64 tables for each plane, taken over from the unit before.
fn tables(level: u8, limits: &Limits) -> Case {
    let frames = 50;
    let mut writer = Writer::new(Profile::Dynamic, level, sequence(1, 1, &TENTHS, BLOCK_LOG2));
    writer.gop(0, GopHeader::predicted(0, frames, 0));
    anchor(&mut writer, 10);
    for frame in 1..frames {
        writer.frame(frame, 10, None, None);
        for r in 0..10 {
            let is_first = (frame, r) == (1, 0);
            writer.increment(frame, (0, r), changed(1), |kind, count| {
                crowded(kind, count, is_first, MODE_BOTH)
            });
        }
    }
    case(writer, limits, frames, (10 * 59 * 64, "tables"), 5 * 4_060_000)
}

/// Units of a private type, and frames without Gaussians.
fn empty_units(level: u8, limits: &Limits) -> Case {
    let frames = 1 << 16;
    let mut writer = Writer::new(Profile::Intra, level, sequence(1, 1, &[100], BLOCK_LOG2));
    writer.gop(0, GopHeader::intra(0, frames));
    for frame in 0..frames {
        writer.frame(frame, 0, None, None);
        writer.increment(frame, (0, 0), IncrementHeader::PLAIN, |kind, count| section(kind, count, 0, 0));
        for _ in 0..4 {
            writer.unit(UnitId::stream(UnitType::User(200)), &[]);
        }
    }
    case(writer, limits, frames, (6, "units"), 0)
}

/// A gop_header that cannot be taken, and after it a byte that is no unit, again and again: each is found by a scan.
fn scans(level: u8, _: &Limits) -> Case {
    let count = 1 << 18;
    let mut writer = Writer::new(Profile::Intra, level, sequence(1, 1, &[100], BLOCK_LOG2));
    writer.gop(0, GopHeader::intra(0, 1));
    let start = writer.bytes.len();
    writer.unit(
        UnitId::of_frame(UnitType::GopHeader, 0),
        &GopHeader::intra(0, 1).to_bytes().expect("a gop_header"),
    );
    let unit = [&writer.bytes[start..], &[2]].concat();
    writer.bytes.extend(unit.repeat(count));
    let (bytes, work) = (writer.bytes, 33);
    Case { bytes, frames: count as u32, work, unit: "bytes a scan", memory: 0, is_damaged: true }
}
