//! Clause 8.4 step by step, written again: the table of D.4, and a check of the fast reader.

use splatstream_decoder::block::{BufferPool, Workspace};
use splatstream_decoder::context::{delta_contexts, plane_contexts};
use splatstream_decoder::increment::values::{PreparedSections, SectionCoding};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::steps::StepRule;
use splatstream_format::Limits;
use splatstream_format::bits::BitReader;
use splatstream_format::entropy::in_force::{ModelsInForce, SectionModels};
use splatstream_format::entropy::layout::{Attribute, PlaneInfo, ShCoding};
use splatstream_format::entropy::model::PlaneModel;
use splatstream_format::entropy::token::{Alphabet, join, unzigzag};
use splatstream_format::payload::Increment;
use splatstream_format::syntax::{Profile, SequenceParameters, UnitType};
use splatstream_format::unit::Stream;
use std::fmt::Write as _;

/// Appends one table per block.
pub(crate) fn blocks(text: &mut String, bytes: &[u8]) {
    text.push_str(
        "\n## D.4 The blocks symbol by symbol\n\nStates in hexadecimal. The coded value of the position plane is the \
         Morton delta, of the others `e` of 8.1; the bias is not yet added.\n",
    );
    let limits = Limits::default();
    let mut sequence = None;
    let mut in_force = ModelsInForce::default();
    for unit in Stream::open(bytes, &limits).unwrap().units() {
        let unit = unit.unwrap();
        let (payload, at) = (unit.payload, unit.payload_at);
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                sequence = Some(SequenceParameters::parse_payload(payload, at, Profile::Intra).unwrap());
            }
            UnitType::Increment => {
                let sequence = sequence.as_ref().unwrap();
                let increment = Increment::parse(payload, at, sequence, Profile::Intra, &limits).unwrap();
                let steps = StepRule::new(sequence, increment.header.attribute_step);
                let coding = SectionCoding { dc_rank: 3, sh: ShCoding::None, steps };
                let prepared =
                    PreparedSections::new(&increment.sections, &coding, &mut in_force, &mut ()).unwrap();
                let (coded, models) = prepared.sections().next().unwrap();
                let workspace = Workspace { buffers: &BufferPool::default(), interrupt: Interrupt::NEVER };
                let fast = prepared.blocks(coded, models, sequence, workspace).unwrap();
                let ([fast], [(block, _)]) = (fast.as_slice(), coded.blocks.as_slice()) else {
                    panic!("one block")
                };
                write!(text, "\n### The block of increment {}\n", unit.header.refinement).unwrap();
                assert_eq!(coded.lanes_log2, 0, "a small block has one lane");
                let slow = one(text, models, block, coded.count as usize, steps);
                assert_eq!(slow, (fast.deltas.clone(), fast.coded[1..].to_vec()), "two readers of a block");
            }
            _ => {}
        }
    }
}

/// The deltas and the coded planes of a block.
type Values = (Vec<u64>, Vec<Vec<i32>>);

fn one(text: &mut String, section: &SectionModels, block: &[u8], count: usize, steps: StepRule) -> Values {
    assert!(block[0] < 128, "a small block has a one-byte word_count");
    let mut bytes = block[1..].iter().copied();
    let mut number =
        |size: usize| (0..size).fold(0, |sum, index| sum | u32::from(bytes.next().unwrap()) << (8 * index));
    let mut state = number(4);
    let words: Vec<u32> = (0..block[0]).map(|_| number(2)).collect();
    let mut raw = BitReader::new(&block[1 + 4 + 2 * words.len()..]);
    let mut next_word = words.into_iter();
    text.push_str(
        "\n| Plane | i | Context | State before | Slot | Token | Word | Raw bits | State after | Coded value |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    let (mut deltas, mut planes) = (Vec::new(), vec![Vec::new()]);
    let mut known = splatstream_decoder::block::CodedBlock::new(vec![0; count], 0, steps);
    for (plane, (&info, model)) in section.layout.planes().iter().zip(&section.models).enumerate() {
        for i in 0..count {
            let context = context(model, plane, info, &known, &deltas, &planes[plane]);
            let table = &model.tables[usize::from(model.table_of_context[context])];
            let slot = state % 4096;
            let (token, first) = token_of(table.of_token(), slot);
            let mut after = u32::from(table.of_token()[token]) * (state >> 12) + slot - first;
            let mut word = String::new();
            if after < 65_536 {
                let taken = next_word.next().unwrap();
                after = (after << 16) + taken;
                word = format!("{taken:04x}");
            }
            let (base, raw_bits) = join(token as u8, model.direct_log2);
            let value = base + raw.bits(raw_bits);
            let coded = match info.alphabet {
                Alphabet::Attribute => i64::from(unzigzag(value as u32)),
                _ => value as i64,
            };
            let name = format!("{} {}", info.attribute.name(), info.index);
            writeln!(
                text,
                "| {name} | {i} | {context} | {state:08x} | {slot} | {token} | {word} | {raw_bits} | {after:08x} | {coded} |"
            )
            .unwrap();
            state = after;
            if info.attribute == Attribute::Position {
                deltas.push(value);
            } else {
                planes[plane].push(coded as i32);
            }
        }
        known.deltas.clone_from(&deltas);
        known.push(info, planes[plane].clone(), model.bias);
        planes.push(Vec::new());
    }
    assert!(state == 65_536 && next_word.next().is_none());
    planes.pop();
    (deltas, planes.split_off(1))
}

/// The context of the next value of a plane of which `values` are known.
fn context(
    model: &PlaneModel,
    plane: usize,
    info: PlaneInfo,
    known: &splatstream_decoder::block::CodedBlock,
    deltas: &[u64],
    values: &[i32],
) -> usize {
    let contexts = if info.is_position() {
        let mut with_next = deltas.to_vec();
        with_next.push(0);
        delta_contexts(&model.axes, &with_next, known.segments())
    } else {
        let mut with_next = values.to_vec();
        with_next.push(0);
        plane_contexts(&model.axes, plane, info, known, &with_next)
    };
    let next = if info.is_position() { deltas.len() } else { values.len() };
    contexts.get(next).copied().unwrap_or(0).into()
}

/// The token whose interval holds the slot, and the first slot of the interval.
fn token_of(frequencies: &[u16], slot: u32) -> (usize, u32) {
    let mut first = 0;
    for (token, &frequency) in frequencies.iter().enumerate() {
        if slot < first + u32::from(frequency) {
            return (token, first);
        }
        first += u32::from(frequency);
    }
    panic!("a table has 4096 slots");
}
