//! Every element, grouped by unit.

use super::{Shown, span};
use crate::console::Console;
use crate::failure::StreamFault;
use crate::stream_file::StreamFile;
use serde::Serialize;
use splatstream_format::Limits;
use splatstream_format::inspect::{Element, inspect};
use splatstream_format::syntax::UnitHeader;
use std::fmt::Write;
use std::path::PathBuf;

/// What `--json` prints.
#[derive(Serialize)]
struct Tree {
    file: PathBuf,
    bytes: u64,
    file_header: Vec<Row>,
    units: Vec<Branch>,
    error: Option<StreamFault>,
}

/// One unit and its elements.
#[derive(Serialize)]
pub(super) struct Branch {
    pub(super) unit: usize,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) at: u64,
    pub(super) bytes: u64,
    pub(super) elements: Vec<Row>,
}

/// One element.
#[derive(Clone, Serialize)]
pub(super) struct Row {
    pub(super) at_bit: u64,
    pub(super) bits: u64,
    pub(super) record: &'static str,
    pub(super) name: String,
    pub(super) value: String,
    pub(super) meaning: String,
    pub(super) clause: &'static str,
}

/// The elements of a stream and its first error.
pub(super) struct Elements {
    pub(super) file_header: Vec<Row>,
    pub(super) units: Vec<Branch>,
    pub(super) error: Option<splatstream_format::Error>,
}

/// Shows all of a stream.
pub(super) fn show(stream: &StreamFile, limits: &Limits, console: &Console) -> Shown {
    let elements = Elements::of(stream, limits);
    let error = elements.error;
    let tree = Tree {
        file: stream.path.clone(),
        bytes: stream.bytes.len() as u64,
        file_header: elements.file_header,
        units: elements.units,
        error: error.map(StreamFault::from),
    };
    console.report(&tree, || tree.text())?;
    Ok(error)
}

impl Elements {
    /// Collects the elements; a unit starts with the first element of its header.
    pub(super) fn of(stream: &StreamFile, limits: &Limits) -> Self {
        let mut file_header = Vec::new();
        let mut units: Vec<Branch> = Vec::new();
        let error = inspect(&stream.bytes, limits, &mut |element| {
            if is_start_of_unit(&element) {
                units.push(Branch::new(units.len(), &element));
            }
            match units.last_mut() {
                Some(unit) => unit.push(element),
                None => file_header.push(Row::from(element)),
            }
        });
        // The payload of a damaged unit has no elements, and still takes its bytes.
        let starts: Vec<u64> = units.iter().skip(1).map(|unit| unit.at).collect();
        for (unit, next) in units.iter_mut().zip(starts) {
            unit.bytes = next.saturating_sub(unit.at);
        }
        Self { file_header, units, error }
    }
}

fn is_start_of_unit(element: &Element) -> bool {
    let header = UnitHeader::TABLE;
    element.record == header.name && header.rows.first().is_some_and(|first| element.name == first.name)
}

impl Branch {
    fn new(unit: usize, first: &Element) -> Self {
        // The value of unit_type is the code, and in brackets the name.
        let name = first.value.split_once('(').map_or(first.value.as_str(), |(_, name)| name);
        let kind = name.trim_end_matches(')').to_owned();
        Self { unit, kind, at: first.at_bit / 8, bytes: 0, elements: Vec::new() }
    }

    fn push(&mut self, element: Element) {
        let row = Row::from(element);
        let end = (row.at_bit + row.bits).div_ceil(8);
        self.bytes = self.bytes.max(end.saturating_sub(self.at));
        self.elements.push(row);
    }
}

impl From<Element> for Row {
    fn from(element: Element) -> Self {
        let Element { at_bit, bits, record, name, value, meaning, clause } = element;
        Self { at_bit, bits, record, name: name.into_owned(), value, meaning: meaning.into_owned(), clause }
    }
}

impl Tree {
    fn text(&self) -> String {
        let mut text = String::new();
        push_rows(&mut text, &self.file_header);
        for unit in &self.units {
            text += &format!("unit {} {}  {}\n", unit.unit, unit.kind, span(unit.at, unit.bytes));
            push_rows(&mut text, &folded(&unit.elements));
        }
        if let Some(error) = &self.error {
            text += &format!("the first error is at {error}\n");
        }
        text
    }
}

/// The rows for people: the frequencies of a table, two elements a token, become one row. JSON has them all.
fn folded(rows: &[Row]) -> Vec<Row> {
    let is_frequency = |row: &Row| matches!(row.name.as_str(), "length_delta" | "mantissa");
    let mut result = Vec::new();
    for run in rows.chunk_by(|a, b| is_frequency(a) && is_frequency(b)) {
        match run {
            [first, .., last] => {
                let tokens = run.iter().filter(|row| row.name == "length_delta").count();
                result.push(Row {
                    bits: last.at_bit + last.bits - first.at_bit,
                    name: "length_delta, mantissa".to_owned(),
                    value: format!("{tokens} frequencies"),
                    ..first.clone()
                });
            }
            _ => result.extend_from_slice(run),
        }
    }
    result
}

/// Rows under the name of their record, which is given once.
fn push_rows(text: &mut String, rows: &[Row]) {
    let mut record = "";
    for row in rows {
        if row.record != record {
            record = row.record;
            *text += &format!("  {record}\n");
        }
        // Writing to a string cannot fail.
        let _infallible = writeln!(
            text,
            "    {:<12} {:>8}  {:<24} {:<26}  {} ({})",
            place(row.at_bit),
            length(row.at_bit, row.bits),
            row.name,
            row.value,
            row.meaning,
            row.clause
        );
    }
}

/// 0x1a4, or 0x1a4+3 for a bit inside a byte.
pub(super) fn place(at_bit: u64) -> String {
    match at_bit % 8 {
        0 => format!("{:#x}", at_bit / 8),
        bit => format!("{:#x}+{bit}", at_bit / 8),
    }
}

fn length(at_bit: u64, bits: u64) -> String {
    if at_bit.is_multiple_of(8) && bits.is_multiple_of(8) {
        format!("{} B", bits / 8)
    } else {
        format!("{bits} bit")
    }
}
