//! Clauses 5.12 and 8.5: the model of a plane - bias, token split, contexts, frequency tables.

use super::frequencies::{Frequencies, mantissa, token_bits};
use super::parametric::Parametric;
use super::token::Alphabet;
use crate::bits::{BitReader, BitWriter};
use crate::{Error, ErrorKind, Result};

pub use super::axis::{AxisLookup, ContextAxis, MAX_CONTEXTS, MAX_THRESHOLDS, Source};

/// The model with which a plane is coded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlaneModel {
    /// Added to every coded value; 0 for positions and codebook indices.
    pub bias: i32,
    /// Values below 2^direct_log2 have tokens of their own; 2 to 7.
    pub direct_log2: u8,
    /// The two context axes; the second has a source only if the first has.
    pub axes: [ContextAxis; 2],
    /// The distinct tables, in order of first use.
    pub tables: Vec<Frequencies>,
    /// For each context, `first * contexts of the second axis + second`, the place of its table.
    pub table_of_context: Vec<u8>,
}

/// Receives every element of a model section as it is read; `()` ignores them.
pub trait ModelTrace {
    /// One element: name, first bit within the section, width, value.
    fn element(&mut self, name: &'static str, bit: u64, bits: u64, value: i64);
}

impl ModelTrace for () {
    fn element(&mut self, _: &'static str, _: u64, _: u64, _: i64) {}
}

/// Writes the models of a unit, clause 5.12. A plane whose model equals the previous unit's is one bit.
pub fn write_models(
    models: &[PlaneModel],
    alphabets: &[Alphabet],
    previous: Option<&[PlaneModel]>,
) -> Vec<u8> {
    let mut bits = BitWriter::new();
    for (plane, (model, &alphabet)) in models.iter().zip(alphabets).enumerate() {
        let reuse = previous.and_then(|models| models.get(plane)) == Some(model);
        bits.bits(u64::from(reuse), 1);
        if !reuse {
            write_model(&mut bits, model, alphabet);
        }
    }
    bits.into_bytes()
}

fn write_model(bits: &mut BitWriter, model: &PlaneModel, alphabet: Alphabet) {
    if alphabet == Alphabet::Attribute {
        bits.signed_exp_golomb(model.bias);
    }
    bits.bits(u64::from(model.direct_log2.wrapping_sub(2)), 3);
    let [first, second] = &model.axes;
    write_axis(bits, first);
    if first.source != Source::None {
        write_axis(bits, second);
    }
    let largest = alphabet.last_token(model.direct_log2).unwrap_or(u8::MAX);
    let mut defined = 0_u8;
    let mut previous = None;
    for &place in &model.table_of_context {
        if previous == Some(place) {
            bits.bits(2, 2);
            continue;
        }
        previous = Some(place);
        if place < defined {
            bits.bits(1, 2);
            bits.bits(1, 1);
            bits.bits(u64::from(place), 6);
            continue;
        }
        defined = defined.wrapping_add(1);
        let Some(table) = model.tables.get(usize::from(place)) else { continue };
        match table.single_token() {
            Some(0) => bits.bits(0, 2),
            Some(token) => {
                bits.bits(1, 2);
                bits.bits(0, 1);
                bits.bits(u64::from(token), token_bits(largest));
            }
            None => {
                bits.bits(3, 2);
                table.write(bits, alphabet, largest);
            }
        }
    }
}

fn write_axis(bits: &mut BitWriter, axis: &ContextAxis) {
    bits.bits(u64::from(axis.source.code()), 4);
    let mut previous: Option<i32> = None;
    for &threshold in &axis.thresholds {
        match previous {
            None => {
                bits.bits(u64::try_from(axis.thresholds.len().wrapping_sub(1)).unwrap_or(0), 4);
                bits.signed_exp_golomb(threshold);
            }
            Some(before) => {
                bits.exp_golomb(threshold.wrapping_sub(before).wrapping_sub(1).cast_unsigned());
            }
        }
        previous = Some(threshold);
    }
}

/// Reads the models of a unit, one for each of `alphabets`; `reusable` are the models that reuse refers to.
///
/// # Errors
/// Malformed or invalid by clauses 5.12 and 6.12; offsets count from `at`, the section's first byte.
pub fn read_models(
    section: &[u8],
    at: u64,
    alphabets: &[Alphabet],
    reusable: &[Option<&PlaneModel>],
    trace: &mut impl ModelTrace,
) -> Result<Vec<PlaneModel>> {
    let mut reader = ModelReader { bits: BitReader::new(section), at, trace };
    let mut models = Vec::with_capacity(alphabets.len());
    for (plane, &alphabet) in alphabets.iter().enumerate() {
        if reader.element("reuse", 1)? == 1 {
            let model = reusable.get(plane).copied().flatten();
            models.push(model.ok_or(reader.broken("reuse without a model to reuse"))?.clone());
        } else {
            models.push(reader.model(alphabet)?);
        }
    }
    reader.bits.finish(at, "plane_model", "5.12")?;
    Ok(models)
}

/// The names of an axis's elements in clause 5.12.
struct AxisNames {
    source: &'static str,
    count: &'static str,
    first: &'static str,
    step: &'static str,
}

const AXIS_A: AxisNames = AxisNames {
    source: "source_a",
    count: "threshold_a_count_minus1",
    first: "threshold_a_first",
    step: "threshold_a_step_minus1",
};
const AXIS_B: AxisNames = AxisNames {
    source: "source_b",
    count: "threshold_b_count_minus1",
    first: "threshold_b_first",
    step: "threshold_b_step_minus1",
};

struct ModelReader<'a, 't, T> {
    bits: BitReader<'a>,
    at: u64,
    trace: &'t mut T,
}

impl<T: ModelTrace> ModelReader<'_, '_, T> {
    /// The byte at which reading has arrived, at most the end of the section.
    fn here(&self) -> u64 {
        self.at.wrapping_add(self.bits.position().min(self.bits.available()) / 8)
    }

    fn broken(&self, rule: &'static str) -> Error {
        Error::new(self.here(), "6.12", ErrorKind::Constraint { rule })
    }

    fn note(&mut self, name: &'static str, from: u64, value: i64) -> Result<()> {
        self.trace.element(name, from, self.bits.position().wrapping_sub(from), value);
        if self.bits.overran() {
            return Err(Error::new(self.here(), "5.12", ErrorKind::ShortSection { element: name }));
        }
        Ok(())
    }

    fn element(&mut self, name: &'static str, width: u32) -> Result<u8> {
        let from = self.bits.position();
        let value = self.bits.small(width);
        self.note(name, from, i64::from(value))?;
        Ok(value)
    }

    fn signed(&mut self, name: &'static str) -> Result<i32> {
        let from = self.bits.position();
        let value = self.bits.signed_exp_golomb();
        self.note(name, from, i64::from(value.unwrap_or(0)))?;
        value.ok_or(Error::new(self.here(), "5.12", ErrorKind::Number { element: name }))
    }

    fn unsigned(&mut self, name: &'static str) -> Result<u32> {
        let from = self.bits.position();
        let value = self.bits.exp_golomb();
        self.note(name, from, i64::from(value.unwrap_or(0)))?;
        value.ok_or(Error::new(self.here(), "5.12", ErrorKind::Number { element: name }))
    }

    fn model(&mut self, alphabet: Alphabet) -> Result<PlaneModel> {
        let bias = if alphabet == Alphabet::Attribute { self.signed("bias")? } else { 0 };
        if i16::try_from(bias).is_err() {
            return Err(self.broken("bias is a 16-bit value"));
        }
        let direct_log2 = self.element("direct_log2_minus2", 3)?.wrapping_add(2);
        let last_token = alphabet
            .last_token(direct_log2)
            .ok_or(self.broken("direct_log2 leaves no room for the longest values"))?;
        let first = self.axis(&AXIS_A)?;
        let second = if first.source == Source::None { ContextAxis::NONE } else { self.axis(&AXIS_B)? };
        let contexts = first.contexts().wrapping_mul(second.contexts());
        if contexts > MAX_CONTEXTS {
            return Err(self.broken("a plane has at most 64 contexts"));
        }
        let (tables, table_of_context) = self.tables(contexts, alphabet, direct_log2, last_token)?;
        Ok(PlaneModel { bias, direct_log2, axes: [first, second], tables, table_of_context })
    }

    fn axis(&mut self, names: &AxisNames) -> Result<ContextAxis> {
        let code = self.element(names.source, 4)?;
        let source = Source::from_code(code).ok_or(Error::new(
            self.here(),
            "6.12",
            ErrorKind::Reserved { element: names.source, value: u64::from(code) },
        ))?;
        if source == Source::None {
            return Ok(ContextAxis::NONE);
        }
        let more = self.element(names.count, 4)?;
        let mut thresholds = vec![self.signed(names.first)?];
        for _ in 0..more {
            let step = self.unsigned(names.step)?;
            let above = |before: &i32| i64::from(*before).wrapping_add(i64::from(step)).wrapping_add(1);
            let next = thresholds.last().map(above).and_then(|next| i32::try_from(next).ok());
            thresholds.push(next.ok_or(self.broken("thresholds are 32-bit values"))?);
        }
        Ok(ContextAxis { source, thresholds })
    }

    fn tables(
        &mut self,
        contexts: usize,
        alphabet: Alphabet,
        direct_log2: u8,
        last_token: u8,
    ) -> Result<(Vec<Frequencies>, Vec<u8>)> {
        let mut tables: Vec<Frequencies> = Vec::new();
        let mut table_of_context: Vec<u8> = Vec::with_capacity(contexts);
        while table_of_context.len() < contexts {
            let next = u8::try_from(tables.len()).unwrap_or(u8::MAX);
            let place = match self.element("table_kind", 2)? {
                0 => {
                    tables.push(Frequencies::single(0));
                    next
                }
                1 if self.element("is_reference", 1)? == 0 => {
                    let token = self.element("token", token_bits(last_token))?;
                    if token > last_token {
                        return Err(self.broken("token beyond the largest value of the plane"));
                    }
                    tables.push(Frequencies::single(token));
                    next
                }
                1 => {
                    let place = self.element("table_index", 6)?;
                    if place >= next {
                        return Err(self.broken("table_index names a table not yet defined"));
                    }
                    place
                }
                2 => *table_of_context.last().ok_or(self.broken("no context before the first"))?,
                _ => {
                    tables.push(self.carried_table(alphabet, direct_log2, last_token)?);
                    next
                }
            };
            table_of_context.push(place);
        }
        Ok((tables, table_of_context))
    }

    /// Clause 8.3, `table_kind` 3.
    fn carried_table(&mut self, alphabet: Alphabet, direct_log2: u8, last_token: u8) -> Result<Frequencies> {
        let is_parametric = self.element("is_parametric", 1)? == 1;
        let last = self.element("last", token_bits(last_token))?;
        if last > last_token {
            return Err(self.broken("token beyond the largest value of the plane"));
        }
        if !is_parametric {
            return self.explicit_table(last);
        }
        let shape = self.element("shape", 2)?;
        let zero_level = self.element("zero_level", 4)?;
        let scale = self.element("scale", 6)?;
        let centre = if alphabet == Alphabet::Attribute { self.signed("centre")? } else { 0 };
        if i16::try_from(centre).is_err() {
            return Err(self.broken("centre is a 16-bit value"));
        }
        let parameters = Parametric { last, shape, zero_level, scale, centre };
        Ok(Frequencies::parametric(parameters, alphabet, direct_log2))
    }

    /// Clause 8.3, the explicit form.
    fn explicit_table(&mut self, last: u8) -> Result<Frequencies> {
        let mode = self.element("mode", token_bits(last))?;
        if mode > last {
            return Err(self.broken("mode is not above last"));
        }
        let mut of_token = Vec::with_capacity(usize::from(last).wrapping_add(1));
        let mut length = 0_i32;
        for token in 0..=last {
            if token == mode {
                of_token.push(0);
                continue;
            }
            length = length.saturating_add(self.signed("length_delta")?);
            let Some(length) = u32::try_from(length).ok().filter(|&length| length <= 12) else {
                return Err(self.broken("a frequency has 0 to 12 bits"));
            };
            of_token.push(self.frequency(length)?);
        }
        Frequencies::with_implied(of_token, mode).ok_or(self.broken("frequencies do not sum to 4096"))
    }

    /// A frequency of `length` bits: leading one, carried mantissa, zeros.
    fn frequency(&mut self, length: u32) -> Result<u16> {
        let Some(leading) = length.checked_sub(1) else { return Ok(0) };
        let (carried, shift) = mantissa(length);
        let below = u16::from(self.element("mantissa", carried)?).wrapping_shl(shift);
        Ok(1_u16.wrapping_shl(leading) | below)
    }
}
