//! Every element, unit by unit. Nothing but the unit in hand is kept: a stream of a few megabytes has millions of elements.

use super::{Shown, span};
use crate::console::Console;
use crate::failure::StreamFault;
use crate::stream_file::StreamFile;
use serde::ser::{SerializeSeq, SerializeStruct};
use serde::{Serialize, Serializer};
use splatstream_format::inspect::{Element, inspect};
use splatstream_format::syntax::{FileHeader, UnitHeader};
use splatstream_format::{Error, Limits};
use std::cell::Cell;
use std::io::{self, Write};

/// What `--json` prints: `file`, `bytes`, `file_header`, `units`, `error`.
struct Tree<'a> {
    stream: &'a StreamFile,
    limits: &'a Limits,
    /// The first error, once the units have been visited.
    error: Cell<Option<Error>>,
}

/// The units of a tree, visited when they are written.
struct Branches<'a>(&'a Tree<'a>);

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
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) at_bit: u64,
    pub(super) bits: u64,
    pub(super) record: &'static str,
    pub(super) name: String,
    pub(super) value: String,
    pub(super) meaning: String,
    pub(super) clause: &'static str,
}

/// Shows all of a stream.
pub(super) fn show(stream: &StreamFile, limits: &Limits, console: &Console) -> Shown {
    let tree = Tree { stream, limits, error: Cell::new(None) };
    console.stream(&tree, |out| tree.write(out))?;
    Ok(tree.error.get())
}

/// Visits the units of a stream; gives its first error.
pub(super) fn each_unit(
    stream: &StreamFile,
    limits: &Limits,
    visit: &mut dyn FnMut(Branch),
) -> Option<Error> {
    let mut current: Option<Branch> = None;
    let error = inspect(&stream.bytes, limits, &mut |element| {
        if is_start_of_unit(&element) {
            let next = Branch::new(current.as_ref().map_or(0, |unit| unit.unit + 1), &element);
            if let Some(mut done) = current.replace(next) {
                // The payload of a damaged unit has no elements, and still takes its bytes.
                done.bytes = (element.at_bit / 8).saturating_sub(done.at);
                visit(done);
            }
        }
        if let Some(unit) = &mut current {
            unit.push(element);
        }
    });
    current.into_iter().for_each(visit);
    error
}

/// The elements of the file header.
fn file_header(stream: &StreamFile, limits: &Limits) -> Vec<Row> {
    let start = stream.bytes.get(..FileHeader::SIZE).unwrap_or(&stream.bytes);
    let mut rows = Vec::new();
    inspect(start, limits, &mut |element| rows.push(Row::from(element)));
    rows
}

impl Serialize for Tree<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tree = serializer.serialize_struct("Tree", 5)?;
        tree.serialize_field("file", &self.stream.path)?;
        tree.serialize_field("bytes", &self.stream.bytes.len())?;
        tree.serialize_field("file_header", &file_header(self.stream, self.limits))?;
        tree.serialize_field("units", &Branches(self))?;
        tree.serialize_field("error", &self.error.get().map(StreamFault::from))?;
        tree.end()
    }
}

impl Serialize for Branches<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(Tree { stream, limits, error }) = self;
        let mut units = serializer.serialize_seq(None)?;
        let mut written = Ok(());
        error.set(each_unit(stream, limits, &mut |branch| {
            if written.is_ok() {
                written = units.serialize_element(&branch);
            }
        }));
        written?;
        units.end()
    }
}

impl Tree<'_> {
    /// The tree for people.
    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        write_rows(out, &file_header(self.stream, self.limits))?;
        let mut written = Ok(());
        self.error.set(each_unit(self.stream, self.limits, &mut |unit| {
            if written.is_ok() {
                written = writeln!(out, "unit {} {}  {}", unit.unit, unit.kind, span(unit.at, unit.bytes))
                    .and_then(|()| write_rows(out, &unit.elements));
            }
        }));
        written?;
        match self.error.get() {
            Some(error) => writeln!(out, "the first error is at {}", StreamFault::from(error)),
            None => Ok(()),
        }
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

    /// Adds an element. The frequencies of a table, two elements each, become one row.
    fn push(&mut self, element: Element) {
        let row = Row::from(element);
        let end = row.at_bit + row.bits;
        self.bytes = self.bytes.max(end.div_ceil(8).saturating_sub(self.at));
        match self.elements.last_mut() {
            Some(last) if last.is_frequencies() && row.is_frequency() => last.bits = end - last.at_bit,
            _ => self.elements.push(row.folded()),
        }
    }
}

impl Row {
    fn is_frequency(&self) -> bool {
        matches!(self.name.as_str(), "length_delta" | "mantissa")
    }

    fn is_frequencies(&self) -> bool {
        self.name == FREQUENCIES
    }

    /// The first frequency of a table stands for all of them.
    fn folded(self) -> Self {
        if !self.is_frequency() {
            return self;
        }
        Self { name: FREQUENCIES.to_owned(), value: "frequencies of the tokens".to_owned(), ..self }
    }
}

/// The name of a row for the frequencies of a table.
const FREQUENCIES: &str = "length_delta, mantissa";

impl From<Element> for Row {
    fn from(element: Element) -> Self {
        let Element { at_bit, bits, record, name, value, meaning, clause } = element;
        Self { at_bit, bits, record, name: name.into_owned(), value, meaning: meaning.into_owned(), clause }
    }
}

/// Rows under the name of their record, which is given once.
fn write_rows(out: &mut dyn Write, rows: &[Row]) -> io::Result<()> {
    let mut record = "";
    for row in rows {
        if row.record != record {
            record = row.record;
            writeln!(out, "  {record}")?;
        }
        writeln!(
            out,
            "    {:<12} {:>8}  {:<24} {:<26}  {} ({})",
            offset(row.at_bit),
            length(row.at_bit, row.bits),
            row.name,
            row.value,
            row.meaning,
            row.clause
        )?;
    }
    Ok(())
}

/// 0x1a4, or 0x1a4+3 for a bit inside a byte.
pub(super) fn offset(at_bit: u64) -> String {
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
