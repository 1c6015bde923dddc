//! Every syntax element of a stream with its offset, for people who look for a mistake.
//!
//! The rows of the syntax tables give names, widths and meanings, so that what is printed cannot drift from
//! what is read. A damaged stream gives the elements up to the damage, and the first error.

use crate::follower::{Follower, Standing};
use crate::payload::{
    Codebook, FramePayload, Increment, Index, OperatingPoints, SceneDescription, Transform, VARIABLE_ROWS,
    VariableRow, Weights,
};
use crate::syntax::reader::{Reader, Traced};
use crate::syntax::{
    Camera, CodebookHeader, EndOfStream, FileHeader, FrameHeader, GopHeader, IncrementHeader, IndexEntry,
    IndexHeader, NetworkHeader, OperatingPointEntry, OperatingPointsHeader, Profile, Row,
    SceneDescriptionHeader, SequenceParameters, TABLES, Table, TransformHeader, UnitHeader, UnitType,
    WeightsHeader, after,
};
use crate::unit::Unit;
use crate::unit_reader::{Event, UnitReader};
use crate::{Error, ErrorKind, Limits, Result};
use section::Coding;
use std::borrow::Cow;

mod decode_value;
mod section;
mod value;

pub use section::BLOCK_PARTS;
pub use value::{Number, Value};

/// One syntax element of a stream.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Absolute offset of the first bit.
    pub at_bit: u64,
    /// How many bits it takes.
    pub bits: u64,
    /// The record it belongs to, as the specification spells it.
    pub record: &'static str,
    /// The element, as the specification spells it.
    pub name: Cow<'static, str>,
    /// Its value; of a long section a summary.
    pub value: Value,
    /// What it is, in a line.
    pub meaning: Cow<'static, str>,
    /// The clause of its syntax table.
    pub clause: &'static str,
}

/// Visits every element of a stream in order, and gives the first error. After a damaged unit it goes on
/// with the next one, as long as its end is known.
pub fn inspect(bytes: &[u8], limits: &Limits, visit: &mut dyn FnMut(Element)) -> Option<Error> {
    let mut inspector = Inspector::new(limits, visit);
    inspector.read(bytes, true);
    inspector.error()
}

/// As [`inspect`], for a stream whose bytes arrive in pieces. It holds none of them.
///
/// ```
/// use splatstream_format::inspect::Inspector;
/// use splatstream_format::syntax::Profile;
/// use splatstream_format::unit::write_file_header;
///
/// let bytes = write_file_header(Profile::Dynamic, 1)?;
/// let mut names = Vec::new();
/// let mut visit = |element: splatstream_format::inspect::Element| names.push(element.name);
/// let mut inspector = Inspector::new(&Default::default(), &mut visit);
/// assert!(inspector.read(&bytes[..10], false), "the file header is not there yet");
/// assert!(inspector.read(&bytes, false) && inspector.position() == 16);
/// assert!(!inspector.read(&[], true) && inspector.error().is_some(), "there is no end unit");
/// assert_eq!(names[..2], ["signature", "version_major"]);
/// # Ok::<(), splatstream_format::Error>(())
/// ```
pub struct Inspector<'v> {
    visit: &'v mut dyn FnMut(Element),
    /// Delimits the units, once the file header has been shown.
    units: Option<UnitReader>,
    follower: Follower,
    limits: Limits,
    coding: Coding,
    first: Option<Error>,
}

impl<'v> Inspector<'v> {
    /// An inspector of a stream from its first byte on.
    pub fn new(limits: &Limits, visit: &'v mut dyn FnMut(Element)) -> Self {
        Self {
            visit,
            units: None,
            // The units of a damaged file header are shown whatever layers they name.
            follower: Follower::new(Profile::Dynamic),
            limits: *limits,
            coding: Coding::default(),
            first: None,
        }
    }

    /// Absolute offset of the first byte that it needs next.
    pub fn position(&self) -> u64 {
        self.units.as_ref().map_or(0, UnitReader::position)
    }

    /// The first error so far.
    pub const fn error(&self) -> Option<Error> {
        self.first
    }

    /// Visits the elements of the units that are there as a whole. `bytes` are those of the stream from
    /// [`Inspector::position`] on; `is_end` says that no more will come. Whether more are needed: not after the end, nor
    /// after a unit whose end is not known.
    pub fn read(&mut self, bytes: &[u8], is_end: bool) -> bool {
        let start = self.position();
        if self.units.is_none() {
            if bytes.len() < FileHeader::SIZE && !is_end {
                return true;
            }
            if !self.file_header(bytes) {
                return false;
            }
        }
        while let Some(mut units) = self.units.take() {
            let rest = usize::try_from(units.position().saturating_sub(start)).ok();
            let rest = rest.and_then(|from| bytes.get(from..)).unwrap_or_default();
            let (at, is_due) = (units.position(), units.is_open());
            let event = units.read(rest, is_end);
            self.units = Some(units);
            if is_due && !matches!(event, Ok(Event::NeedMoreData(_))) {
                self.fixed(&UnitHeader::TABLE, rest, at);
            }
            match event {
                Ok(Event::Unit(unit)) => {
                    let checked = self.unit(&unit);
                    self.note(checked);
                }
                Ok(Event::NeedMoreData(_)) => return true,
                Ok(_) => return false,
                Err(error) => self.note(Err(error)),
            }
        }
        false
    }

    /// Shows the file header; whether units follow.
    fn file_header(&mut self, bytes: &[u8]) -> bool {
        self.fixed(&FileHeader::TABLE, bytes, 0);
        match FileHeader::parse(bytes) {
            Ok((header, _)) => self.follower = Follower::new(header.profile()),
            Err(error) => {
                self.note(Err(error));
                // Units describe themselves, but not those of another file format.
                if matches!(error.kind, ErrorKind::Signature | ErrorKind::Truncated { .. }) {
                    return false;
                }
            }
        }
        self.units = Some(UnitReader::starting_at(after(0, FileHeader::SIZE), &self.limits));
        true
    }

    /// Checks of a unit and the elements of its payload, if it is the one that was written.
    fn unit(&mut self, unit: &Unit<'_>) -> Result<()> {
        match self.follower.take(unit)? {
            Standing::Taken => self.payload(unit),
            Standing::Discarded => {
                self.opaque(unit, "discarded: the reference frame has fewer refinements", "5.14");
                Ok(())
            }
        }
    }

    /// The elements of a payload, and then the checks of its parser.
    fn payload(&mut self, unit: &Unit<'_>) -> Result<()> {
        let (payload, at) = (unit.payload, unit.payload_at);
        match unit.header.unit_type() {
            UnitType::SequenceParameters => {
                self.fixed(&SequenceParameters::TABLE, payload, at);
                SequenceParameters::parse_payload(payload, at, self.follower.profile())?;
            }
            UnitType::GopHeader => {
                self.fixed(&GopHeader::TABLE, payload, at);
                let header = GopHeader::parse_payload(payload, at, self.follower.profile())?;
                self.coding = Coding::of_gop(header, unit.header.frame);
                header.validate_from(at, unit.header.frame)?;
            }
            UnitType::FrameHeader => self.frame_header(unit)?,
            UnitType::Transform => self.transform(payload, at)?,
            UnitType::Codebook => self.codebook(payload, at)?,
            UnitType::Weights => self.weights(payload, at)?,
            UnitType::Increment => self.increment(unit)?,
            UnitType::SceneDescription => self.scene_description(payload, at)?,
            UnitType::OperatingPoints => self.operating_points(payload, at)?,
            UnitType::Index => self.index(payload, at)?,
            UnitType::End => {
                self.fixed(&EndOfStream::TABLE, payload, at);
                EndOfStream::parse_payload(payload, at)?;
            }
            UnitType::Reserved(_) | UnitType::User(_) => {
                self.opaque(unit, "skipped by decoders of this version", "5.3");
            }
        }
        Ok(())
    }

    /// A payload that is not looked at.
    fn opaque(&mut self, unit: &Unit<'_>, meaning: &'static str, clause: &'static str) {
        let (bytes, record) = (unit.payload.len(), unit.header.unit_type().name());
        self.show(unit.payload_at, bytes, "payload".into(), Value::Bytes(bytes), meaning, clause, record);
    }

    fn transform(&mut self, payload: &[u8], at: u64) -> Result<()> {
        self.fixed(&TransformHeader::TABLE, payload, at);
        let transform = Transform::parse(payload, at, self.follower.sequence_at(at)?)?;
        self.coding.define(&transform.header);
        let mean_at = after(at, TransformHeader::SIZE);
        let mean_bytes = size_of_val(transform.mean.as_slice());
        self.variable("transform", "mean", mean_at, mean_bytes, Value::spread(&transform.mean));
        let basis_bytes = size_of_val(transform.basis.as_slice());
        let basis = Value::spread(&transform.basis);
        self.variable("transform", "basis", after(mean_at, mean_bytes), basis_bytes, basis);
        Ok(())
    }

    fn codebook(&mut self, payload: &[u8], at: u64) -> Result<()> {
        self.fixed(&CodebookHeader::TABLE, payload, at);
        let codebook = Codebook::parse(payload, at, &self.limits)?;
        let bytes = payload.len().saturating_sub(CodebookHeader::SIZE);
        let entries = Value::spread(&codebook.entries);
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
        let weights = Weights::parse_rest(header, model, at)?;
        match &weights {
            Weights::Carried(_) => {
                let bytes = model.len().saturating_sub(NetworkHeader::SIZE);
                let at = after(model_at, NetworkHeader::SIZE);
                self.variable("network", "parameters", at, bytes, Value::Bytes(bytes));
            }
            Weights::Registered(digest) => {
                let value = digest.iter().map(|byte| format!("{byte:02x}")).collect();
                self.variable("weights", "model", model_at, model.len(), Value::Words(value));
            }
        }
        weights.network(at).map(drop)
    }

    fn frame_header(&mut self, unit: &Unit<'_>) -> Result<()> {
        let mut trace = Vec::new();
        let mut reader = Reader::tracing(unit.payload, unit.payload_at, &mut trace);
        let sequence = self.follower.sequence_at(unit.payload_at);
        let parsed = sequence.and_then(|sequence| FramePayload::read(&mut reader, sequence, &self.limits));
        let frame = match parsed {
            Ok(frame) => frame,
            Err(error) => return self.broken(&FrameHeader::TABLE, unit, &trace, error),
        };
        self.coding.start_frame(&frame.header, unit.header.frame);
        let sections: Vec<_> = frame.cells.into_iter().map(|cells| cells.coded).collect();
        self.record_and_sections(&trace, |inspector, of_sections| {
            inspector.sections(of_sections, &sections, &IncrementHeader::PLAIN.sh(), None);
        });
        Ok(())
    }

    fn increment(&mut self, unit: &Unit<'_>) -> Result<()> {
        let mut trace = Vec::new();
        let mut reader = Reader::tracing(unit.payload, unit.payload_at, &mut trace);
        let profile = self.follower.profile();
        let sequence = self.follower.sequence_at(unit.payload_at);
        let parsed =
            sequence.and_then(|sequence| Increment::read(&mut reader, sequence, profile, &self.limits));
        let Increment { header, sections } = match parsed {
            Ok(increment) => increment,
            Err(error) => return self.broken(&IncrementHeader::TABLE, unit, &trace, error),
        };
        self.record_and_sections(&trace, |inspector, of_sections| {
            inspector.sections(of_sections, &sections, &header.sh(), Some(unit.header.refinement));
        });
        Ok(())
    }

    /// The elements of a record up to its sections, and then those.
    fn record_and_sections(&mut self, trace: &[Traced<'_>], sections: impl FnOnce(&mut Self, &[Traced<'_>])) {
        let start = trace.iter().position(|traced| traced.record == "section").unwrap_or(trace.len());
        let (record, of_sections) = trace.split_at_checked(start).unwrap_or_default();
        record.iter().for_each(|traced| self.plain(traced));
        sections(self, of_sections);
    }

    /// What was read of a payload before an error; of one that was not read at all, its fixed part.
    fn broken(&mut self, table: &Table, unit: &Unit<'_>, trace: &[Traced<'_>], error: Error) -> Result<()> {
        if trace.is_empty() {
            self.fixed(table, unit.payload, unit.payload_at);
        }
        trace.iter().for_each(|traced| self.plain(traced));
        Err(error)
    }

    fn scene_description(&mut self, payload: &[u8], at: u64) -> Result<()> {
        self.fixed(&SceneDescriptionHeader::TABLE, payload, at);
        let (header, rest) = SceneDescriptionHeader::parse(payload, at)?;
        let mut trace = Vec::new();
        let mut reader = Reader::tracing(rest, after(at, SceneDescriptionHeader::SIZE), &mut trace);
        let parsed = SceneDescription::read(&header, &mut reader);
        for traced in &trace {
            match traced.element {
                "cameras" => self.fixed(&Camera::TABLE, traced.bytes, traced.at),
                _ => self.plain(traced),
            }
        }
        parsed.map(drop)
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

    /// The rows of a record that lie within `bytes`.
    fn fixed(&mut self, table: &Table, bytes: &[u8], at: u64) {
        let (mut rest, mut at) = (bytes, at);
        for row in table.rows {
            let Some((raw, after_row)) = rest.split_at_checked(row.bytes) else {
                return;
            };
            let value = decode_value::of(table.name, row.name, row.type_name, raw);
            let Row { name, meaning, clause, .. } = *row;
            self.show(at, row.bytes, name.into(), value, meaning, clause, table.name);
            rest = after_row;
            at = after(at, row.bytes);
        }
    }

    /// An element with its value by its type.
    fn plain(&mut self, traced: &Traced<'_>) {
        let Traced { record, element, bytes, .. } = *traced;
        let value = match (element, columns(record, element)) {
            ("models" | "blocks", _) | (_, None) => Value::Bytes(bytes.len()),
            (_, Some((type_name, ..))) => decode_value::of(record, element, type_name, bytes),
        };
        self.traced(traced, value);
    }

    /// An element with a value.
    fn traced(&mut self, traced: &Traced<'_>, value: Value) {
        let Traced { record, element, index, at, bytes } = *traced;
        let name = index.map_or(element.into(), |index| format!("{element}[{index}]").into());
        let (_, meaning, clause) = columns(record, element).unwrap_or_default();
        self.show(at, bytes.len(), name, value, meaning, clause, record);
    }

    fn variable(&mut self, record: &str, name: &'static str, at: u64, bytes: usize, value: Value) {
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
        value: Value,
        meaning: &'static str,
        clause: &'static str,
        record: &'static str,
    ) {
        let (at_bit, bits) = (at.saturating_mul(8), after(0, bytes).saturating_mul(8));
        (self.visit)(Element { at_bit, bits, record, name, value, meaning: meaning.into(), clause });
    }

    fn note(&mut self, checked: Result<()>) {
        self.first = self.first.or(checked.err());
    }
}

fn variable_row(record: &str, name: &str) -> Option<&'static VariableRow> {
    VARIABLE_ROWS.iter().find(|row| row.record == record && row.name == name)
}

/// Type, meaning and clause of an element.
fn columns(record: &str, element: &str) -> Option<(&'static str, &'static str, &'static str)> {
    let variable = variable_row(record, element).map(|row| (row.type_name, row.meaning, row.clause));
    let table = TABLES.iter().find(|table| table.name == record);
    let fixed = || table?.rows.iter().find(|row| row.name == element);
    variable.or_else(|| fixed().map(|row| (row.type_name, row.meaning, row.clause)))
}
