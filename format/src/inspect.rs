//! Every syntax element of a stream with its place, for people who look for a mistake.
//!
//! The rows of the syntax tables give names, widths and meanings, so that what is printed cannot drift from
//! what is read. A damaged stream gives the elements up to the damage, and the first error.

use crate::levels::Levels;
use crate::payload::{
    Codebook, Index, OperatingPoints, Refinement, Transform, VARIABLE_ROWS, VariableRow, Weights, leb128,
};
use crate::syntax::{
    CodebookHeader, EndOfStream, FileHeader, FrameHeader, GopHeader, IndexEntry, IndexHeader, NetworkHeader,
    OperatingPointEntry, OperatingPointsHeader, Profile, RefinementHeader, Row, SequenceParameters, Table,
    TransformHeader, UnitHeader, UnitType, WeightsHeader, after,
};
use crate::unit::{Delivery, Unit, Units};
use crate::{Error, ErrorKind, Limits, Result};
use section::Coding;
use std::borrow::Cow;

mod increment;
mod section;
mod value;

/// One syntax element of a stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Element {
    /// Absolute place of the first bit.
    pub at_bit: u64,
    /// How many bits it takes.
    pub bits: u64,
    /// The record it belongs to, as the specification spells it.
    pub record: &'static str,
    /// The element, as the specification spells it.
    pub name: Cow<'static, str>,
    /// Its value; an array in brackets, a long section in a summary.
    pub value: String,
    /// What it is, in a line.
    pub meaning: Cow<'static, str>,
    /// The clause of its syntax table.
    pub clause: &'static str,
}

/// Visits every element of a stream in order, and gives the first error. Behind a damaged payload it goes on
/// with the next unit.
pub fn inspect(bytes: &[u8], limits: &Limits, visit: &mut dyn FnMut(Element)) -> Option<Error> {
    let mut inspector = Inspector {
        visit,
        // The units of a damaged file header are shown whatever layers they name.
        profile: Profile::Dynamic,
        limits: *limits,
        sequence: None,
        coding: Coding::default(),
        levels: Levels::default(),
        first: None,
    };
    inspector.stream(bytes);
    inspector.first
}

struct Inspector<'v> {
    visit: &'v mut dyn FnMut(Element),
    profile: Profile,
    limits: Limits,
    sequence: Option<SequenceParameters>,
    coding: Coding,
    levels: Levels,
    first: Option<Error>,
}

impl Inspector<'_> {
    fn stream(&mut self, bytes: &[u8]) {
        self.fixed(&FileHeader::TABLE, bytes, 0);
        let header = FileHeader::parse(bytes);
        match header {
            Ok((header, _)) => self.profile = header.profile(),
            Err(error) => {
                self.note(Err(error));
                // Units describe themselves, but not those of another file format.
                if matches!(error.kind, ErrorKind::Signature | ErrorKind::Truncated { .. }) {
                    return;
                }
            }
        }
        let mut units = Units::starting_at(bytes, after(0, FileHeader::SIZE), self.profile, &self.limits);
        loop {
            let at = units.position();
            if units.is_open() {
                let rest = usize::try_from(at).ok().and_then(|start| bytes.get(start..));
                self.fixed(&UnitHeader::TABLE, rest.unwrap_or_default(), at);
            }
            match units.next_unit() {
                Some(Ok(Delivery::Intact(unit))) => {
                    self.levels.follow(&unit, self.profile);
                    let checked = self.payload(&unit);
                    self.note(checked);
                }
                Some(Ok(Delivery::Damaged(damaged))) if damaged.passed_over => {}
                Some(Ok(Delivery::Damaged(damaged))) => self.note(Err(damaged.error)),
                Some(Err(error)) => self.note(Err(error)),
                None => return,
            }
        }
    }

    /// The elements of a payload, and then the checks of its parser.
    fn payload(&mut self, unit: &Unit<'_>) -> Result<()> {
        let (payload, at) = (unit.payload, unit.payload_at);
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                self.fixed(&SequenceParameters::TABLE, payload, at);
                self.sequence = Some(SequenceParameters::parse_payload(payload, at, self.profile)?);
            }
            UnitType::GopHeader => {
                self.fixed(&GopHeader::TABLE, payload, at);
                let header = GopHeader::parse_payload(payload, at, self.profile)?;
                self.coding = Coding::of_gop(header, unit.header.frame);
                header.validate_from(at, unit.header.frame)?;
            }
            UnitType::FrameHeader => {
                self.fixed(&FrameHeader::TABLE, payload, at);
                let header = FrameHeader::parse_payload(payload, at, self.profile)?;
                self.coding.start_frame(&header, unit.header.frame);
                header.within(at, &self.limits)?;
            }
            UnitType::Transform => self.transform(payload, at)?,
            UnitType::Codebook => self.codebook(payload, at)?,
            UnitType::Refinement => self.refinement(payload, at)?,
            UnitType::Weights if self.profile == Profile::Dynamic => self.weights(payload, at)?,
            UnitType::Increment if self.profile == Profile::Dynamic => self.increment(unit)?,
            UnitType::OperatingPoints => self.operating_points(payload, at)?,
            UnitType::Index => self.index(payload, at)?,
            UnitType::End => {
                self.fixed(&EndOfStream::TABLE, payload, at);
                EndOfStream::parse_payload(payload, at)?;
            }
            unknown @ (UnitType::Weights
            | UnitType::Increment
            | UnitType::Reserved(_)
            | UnitType::User(_)) => {
                let value = format!("{} bytes", payload.len());
                let meaning = "skipped by decoders of this version";
                self.show(at, payload.len(), "payload".into(), value, meaning, "5.3", unknown.name());
            }
        }
        Ok(())
    }

    fn transform(&mut self, payload: &[u8], at: u64) -> Result<()> {
        self.fixed(&TransformHeader::TABLE, payload, at);
        let transform = Transform::parse(payload, at, &self.sequence_at(at)?)?;
        self.coding.define(&transform.header);
        let mean_at = after(at, TransformHeader::SIZE);
        let mean_bytes = size_of_val(transform.mean.as_slice());
        self.variable("transform", "mean", mean_at, mean_bytes, value::summary(&transform.mean));
        let basis_bytes = size_of_val(transform.basis.as_slice());
        let basis = value::summary(&transform.basis);
        self.variable("transform", "basis", after(mean_at, mean_bytes), basis_bytes, basis);
        Ok(())
    }

    fn codebook(&mut self, payload: &[u8], at: u64) -> Result<()> {
        self.fixed(&CodebookHeader::TABLE, payload, at);
        let codebook = Codebook::parse(payload, at, &self.limits)?;
        let bytes = payload.len().saturating_sub(CodebookHeader::SIZE);
        let entries = value::summary(&codebook.entries);
        self.variable("codebook", "entries", after(at, CodebookHeader::SIZE), bytes, entries);
        Ok(())
    }

    fn weights(&mut self, payload: &[u8], at: u64) -> Result<()> {
        self.fixed(&WeightsHeader::TABLE, payload, at);
        let (header, model) = WeightsHeader::parse(payload, at)?;
        let model_at = after(at, WeightsHeader::SIZE);
        if header == WeightsHeader::CARRIED {
            self.fixed(&NetworkHeader::TABLE, model, model_at);
        }
        let weights = Weights::parse_behind(header, model, at)?;
        match &weights {
            Weights::Carried(_) => {
                let bytes = model.len().saturating_sub(NetworkHeader::SIZE);
                let value = format!("{bytes} bytes");
                let at = after(model_at, NetworkHeader::SIZE);
                self.variable("network", "parameters", at, bytes, value);
            }
            Weights::Registered(digest) => {
                let value = digest.iter().map(|byte| format!("{byte:02x}")).collect();
                self.variable("weights", "model", model_at, model.len(), value);
            }
        }
        weights.network(at).map(drop)
    }

    /// Walks the sections itself: before an error there are elements to show.
    fn refinement(&mut self, payload: &[u8], at: u64) -> Result<()> {
        self.fixed(&RefinementHeader::TABLE, payload, at);
        let sequence = self.sequence_at(at)?;
        let parsed = Refinement::parse(payload, at, &sequence, &self.limits);
        let mut rest = payload.get(RefinementHeader::SIZE..).unwrap_or_default();
        let place = |rest: &[u8]| after(at, payload.len().saturating_sub(rest.len()));
        let model_length = self.number("refinement", "model_length", None, &mut rest, place)?;
        let model = usize::try_from(model_length).ok().and_then(|length| rest.split_at_checked(length));
        let Some((model, after_model)) = model else {
            return parsed.map(drop);
        };
        self.refinement_models(&parsed, model, place(rest));
        rest = after_model;
        // The count of a header that was refused is not to be trusted.
        let Refinement { header, blocks, .. } = parsed?;
        let lanes_log2 = header.lanes_log2;
        for block in 0..blocks.len() {
            self.number("refinement", "block_length", Some(block), &mut rest, place)?;
        }
        for (place, (block, at)) in blocks.into_iter().enumerate() {
            self.block("refinement", place, block, at, lanes_log2);
        }
        Ok(())
    }

    fn index(&mut self, payload: &[u8], at: u64) -> Result<()> {
        self.fixed(&IndexHeader::TABLE, payload, at);
        let entries = payload.get(IndexHeader::SIZE..).unwrap_or_default();
        let mut entry_at = after(at, IndexHeader::SIZE);
        for entry in entries.chunks(IndexEntry::SIZE) {
            self.fixed(&IndexEntry::TABLE, entry, entry_at);
            entry_at = after(entry_at, IndexEntry::SIZE);
        }
        Index::parse(payload, at).map(drop)
    }

    fn operating_points(&mut self, payload: &[u8], at: u64) -> Result<()> {
        self.fixed(&OperatingPointsHeader::TABLE, payload, at);
        let entries = payload.get(OperatingPointsHeader::SIZE..).unwrap_or_default();
        let mut entry_at = after(at, OperatingPointsHeader::SIZE);
        for entry in entries.chunks(OperatingPointEntry::SIZE) {
            self.fixed(&OperatingPointEntry::TABLE, entry, entry_at);
            entry_at = after(entry_at, OperatingPointEntry::SIZE);
        }
        OperatingPoints::parse(payload, at).map(drop)
    }

    /// One LEB128 element of a record; `rest` moves behind it.
    fn number(
        &mut self,
        record: &'static str,
        name: &'static str,
        place: Option<usize>,
        rest: &mut &[u8],
        at: impl Fn(&[u8]) -> u64,
    ) -> Result<u32> {
        let start = at(rest);
        let row = variable_row(record, name);
        let syntax = row.map_or(RefinementHeader::TABLE.syntax, |row| row.clause);
        let (value, behind) = leb128(rest, start, name, syntax)?;
        let bytes = rest.len().saturating_sub(behind.len());
        *rest = behind;
        if let Some(row) = row {
            let name = place.map_or(name.into(), |place| format!("{name}[{place}]").into());
            self.show(start, bytes, name, value.to_string(), row.meaning, row.clause, row.record);
        }
        Ok(value)
    }

    /// The rows of a record that lie within `bytes`.
    fn fixed(&mut self, table: &Table, bytes: &[u8], at: u64) {
        let (mut rest, mut at) = (bytes, at);
        for row in table.rows {
            let Some((raw, behind)) = rest.split_at_checked(row.bytes) else {
                return;
            };
            let value = value::of_row(table.name, row, raw);
            let Row { name, meaning, clause, .. } = *row;
            self.show(at, row.bytes, name.into(), value, meaning, clause, table.name);
            rest = behind;
            at = after(at, row.bytes);
        }
    }

    fn variable(&mut self, record: &str, name: &'static str, at: u64, bytes: usize, value: String) {
        if let Some(row) = variable_row(record, name) {
            self.show(at, bytes, name.into(), value, row.meaning, row.clause, row.record);
        }
    }

    #[expect(clippy::too_many_arguments, reason = "they are the columns of the inspector")]
    fn show(
        &mut self,
        at: u64,
        bytes: usize,
        name: Cow<'static, str>,
        value: String,
        meaning: &'static str,
        clause: &'static str,
        record: &'static str,
    ) {
        let (at_bit, bits) = (at.saturating_mul(8), after(0, bytes).saturating_mul(8));
        (self.visit)(Element { at_bit, bits, record, name, value, meaning: meaning.into(), clause });
    }

    fn sequence_at(&self, at: u64) -> Result<SequenceParameters> {
        let kind = ErrorKind::UnexpectedUnit { unit: "sequence-dependent" };
        self.sequence.ok_or(Error::new(at, "7.1.2", kind))
    }

    fn note(&mut self, checked: Result<()>) {
        self.first = self.first.or(checked.err());
    }
}

fn variable_row(record: &str, name: &str) -> Option<&'static VariableRow> {
    VARIABLE_ROWS.iter().find(|row| row.record == record && row.name == name)
}
