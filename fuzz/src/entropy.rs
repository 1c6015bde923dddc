//! Entropy coding: symbols that are coded come back, and a block that is accepted is the only one for its symbols.

use arbitrary::{Result, Unstructured};
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::machine::Portable;
use splatstream_format::entropy::model::{ContextAxis, PlaneModel, Source, read_models, write_models};
use splatstream_format::entropy::reader::{BlockReader, Delta, Index, KnownContexts, PlaneDecoder, Signed};
use splatstream_format::entropy::token::{Alphabet, split, zigzag};
use splatstream_format::entropy::writer::{BlockWriter, PlaneEncoder};

/// More add time, not depth.
const MAX_VALUES: usize = 300;
const MAX_PLANES: usize = 4;
const MAX_CHANGES: usize = 4;

/// The input is what the planes and changes of a block are made of.
pub fn run(data: &[u8]) {
    // Fails only where the bytes do not suffice.
    let _ = coded(&mut Unstructured::new(data));
}

/// A plane of a block.
struct Plane {
    alphabet: Alphabet,
    model: PlaneModel,
    contexts: Vec<u8>,
    values: Vec<u64>,
}

fn coded(u: &mut Unstructured<'_>) -> Result<()> {
    let lanes_log2 = u.int_in_range(0..=5)?;
    let (plane_count, count) = (u.int_in_range(1..=MAX_PLANES)?, u.int_in_range(0..=MAX_VALUES)?);
    let planes = (0..plane_count).map(|_| plane(u, count)).collect::<Result<Vec<_>>>()?;
    models_come_back(&planes);
    let values: Vec<Vec<u64>> = planes.iter().map(|plane| plane.values.clone()).collect();
    let mut block = encoded(&planes, &values, lanes_log2);
    assert_eq!(decoded(&planes, &block, lanes_log2).as_ref(), Some(&values), "symbols come back");
    // Changed, it is mostly refused.
    for _ in 0..u.int_in_range(0..=MAX_CHANGES)? {
        let (index, value) = (u.choose_index(block.len())?, u.arbitrary::<u8>()?);
        block[index] ^= value;
    }
    if let Some(values) = decoded(&planes, &block, lanes_log2) {
        assert_eq!(encoded(&planes, &values, lanes_log2), block, "the same symbols are another block");
    }
    Ok(())
}

/// A plane whose tables have every token that occurs, and others.
fn plane(u: &mut Unstructured<'_>, count: usize) -> Result<Plane> {
    let alphabet = *u.choose(&[Alphabet::Attribute, Alphabet::Position, Alphabet::Index])?;
    let direct_log2 = u.int_in_range(2..=if alphabet == Alphabet::Position { 5 } else { 7 })?;
    let axes = axes(u)?;
    let context_count = axes[0].contexts() * axes[1].contexts();
    let most = alphabet.max_exponent() + 1;
    let mut counts = vec![vec![0_u64; 256]; context_count];
    for counts in &mut counts {
        for _ in 0..u.int_in_range(0..=3)? {
            let token = u.int_in_range(0..=alphabet.last_token(direct_log2).expect("it fits in a byte"))?;
            counts[usize::from(token)] += u64::from(u.arbitrary::<u16>()?);
        }
    }
    let (mut contexts, mut values) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let context = u.int_in_range(0..=context_count - 1)?;
        let value = u.arbitrary::<u64>()? & ((1 << u.int_in_range(0..=most)?) - 1);
        counts[context][usize::from(split(value, direct_log2).token)] += 1;
        contexts.push(context as u8);
        values.push(value);
    }
    let bias = if alphabet == Alphabet::Attribute { u.arbitrary::<i16>()?.into() } else { 0 };
    let (tables, table_of_context) = distinct(counts.iter().map(|counts| Frequencies::from_counts(counts)));
    let model = PlaneModel { bias, direct_log2, axes, tables, table_of_context };
    Ok(Plane { alphabet, model, contexts, values })
}

/// Up to 16 contexts, from one source or two.
fn axes(u: &mut Unstructured<'_>) -> Result<[ContextAxis; 2]> {
    let first = axis(u)?;
    let second = if first == ContextAxis::NONE { first.clone() } else { axis(u)? };
    Ok([first, second])
}

fn axis(u: &mut Unstructured<'_>) -> Result<ContextAxis> {
    let source = *u.choose(&Source::ALL)?;
    if source == Source::None {
        return Ok(ContextAxis::NONE);
    }
    let mut thresholds = vec![i32::from(u.arbitrary::<i16>()?)];
    for _ in 0..u.int_in_range(0..=2)? {
        let step = i32::from(u.arbitrary::<u8>()?) + 1;
        thresholds.extend(thresholds.last().map(|before| before + step));
    }
    Ok(ContextAxis { source, thresholds })
}

/// Each table once, in order of first use, and its index for each context.
fn distinct(of_context: impl Iterator<Item = Frequencies>) -> (Vec<Frequencies>, Vec<u8>) {
    let mut tables: Vec<Frequencies> = Vec::new();
    let indices = of_context.map(|table| {
        let index = tables.iter().position(|known| *known == table).unwrap_or(tables.len());
        if index == tables.len() {
            tables.push(table);
        }
        index as u8
    });
    let indices = indices.collect();
    (tables, indices)
}

fn models_come_back(planes: &[Plane]) {
    let models: Vec<PlaneModel> = planes.iter().map(|plane| plane.model.clone()).collect();
    let alphabets: Vec<Alphabet> = planes.iter().map(|plane| plane.alphabet).collect();
    let section = write_models(&models, &alphabets, None);
    let none = vec![None; models.len()];
    assert_eq!(read_models(&section, 0, &alphabets, &none, &mut ()), Ok(models));
}

fn encoded(planes: &[Plane], values: &[Vec<u64>], lanes_log2: u8) -> Vec<u8> {
    let mut block = BlockWriter::new(lanes_log2);
    for (plane, values) in planes.iter().zip(values) {
        let encoder = PlaneEncoder::new(&plane.model);
        let written = block.plane(&encoder, &plane.contexts, values.iter().copied());
        assert_eq!(written, Ok(()), "every token has a frequency");
    }
    block.finish()
}

/// The values of each plane, unless the block is refused.
fn decoded(planes: &[Plane], block: &[u8], lanes_log2: u8) -> Option<Vec<Vec<u64>>> {
    let mut reader = BlockReader::open(block, 0, lanes_log2).ok()?;
    let values = planes.iter().map(|plane| read(&mut reader, plane)).collect();
    reader.finish().ok()?;
    Some(values)
}

fn read(reader: &mut BlockReader<'_>, plane: &Plane) -> Vec<u64> {
    let decoder = PlaneDecoder::new(&plane.model);
    let mut contexts = KnownContexts(&plane.contexts);
    let mut values = vec![0_i32; plane.contexts.len()];
    match plane.alphabet {
        Alphabet::Attribute => {
            reader.plane::<Signed, _>(Portable, &decoder, &mut contexts, &mut values);
            values.into_iter().map(|value| zigzag(value).into()).collect()
        }
        Alphabet::Index => {
            reader.plane::<Index, _>(Portable, &decoder, &mut contexts, &mut values);
            values.into_iter().map(|value| u64::from(value.cast_unsigned())).collect()
        }
        Alphabet::Position => {
            let mut deltas = vec![0; plane.contexts.len()];
            reader.plane::<Delta, _>(Portable, &decoder, &mut contexts, &mut deltas);
            deltas
        }
    }
}
