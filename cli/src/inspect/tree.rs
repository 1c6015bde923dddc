//! Every element, unit by unit. Nothing but the unit in hand is kept: a stream of a few megabytes has millions of elements,
//! and one that comes by a pipe may have any length.

use super::element::{Fields, Groups, Records, push};
use super::{Shown, span};
use crate::console::Console;
use crate::failure::{Failure, StreamFault};
use crate::stream_file::{feed, open_pieces};
use serde::ser::{SerializeSeq, SerializeStruct};
use serde::{Serialize, Serializer};
use splatstream_format::inspect::{Element, Inspector, Value};
use splatstream_format::syntax::UnitHeader;
use splatstream_format::{Error, Limits};
use std::cell::{Cell, RefCell};
use std::io::{self, Read, Write};
use std::ops::ControlFlow;
use std::path::Path;

/// What `--json` prints: `file`, `records`, `units`, `file_header`, `bytes`, `error`.
struct Tree<'a> {
    path: &'a Path,
    limits: &'a Limits,
    records: Records,
    /// Taken when the units are visited.
    reader: RefCell<Box<dyn Read>>,
    /// What is known once the units have been visited.
    file_header: RefCell<Vec<Element>>,
    visited: RefCell<Visited>,
}

/// What a visit of all units gives.
#[derive(Default)]
pub(super) struct Visited {
    /// Bytes that were read.
    bytes: u64,
    /// The first error.
    pub(super) error: Option<Error>,
    /// Why not everything could be read.
    failed: Option<io::Error>,
}

/// What is visited.
pub(super) enum Part {
    /// The elements of the file header, before the units.
    FileHeader(Vec<Element>),
    Unit(Branch),
}

/// The units of a tree, visited when they are written.
struct Branches<'a>(&'a Tree<'a>);

/// One unit and its elements.
pub(super) struct Branch {
    pub(super) unit: usize,
    pub(super) kind: &'static str,
    pub(super) at: u64,
    pub(super) bytes: u64,
    /// Those of its header.
    pub(super) header: Vec<Element>,
    /// Those of its payload.
    pub(super) elements: Vec<Element>,
}

/// A unit as JSON.
struct BranchJson<'a>(&'a Branch, &'a Records);

/// Shows all of a stream.
pub(super) fn show(path: &Path, limits: &Limits, console: &Console) -> Shown {
    let tree = Tree {
        path,
        limits,
        records: Records::new(),
        reader: RefCell::new(open_pieces(path)?),
        file_header: RefCell::default(),
        visited: RefCell::default(),
    };
    console.stream(&tree, |out| tree.write(out))?;
    let Visited { error, failed, .. } = tree.visited.take();
    match failed {
        Some(failed) => Err(Failure::file("read", path, &failed)),
        None => Ok(error),
    }
}

/// Visits the file header and the units of a stream, until somebody has seen enough.
pub(super) fn each_part(
    reader: &mut dyn Read,
    limits: &Limits,
    visit: &mut dyn FnMut(Part) -> ControlFlow<()>,
) -> Visited {
    let is_over = Cell::new(false);
    let mut visit = |part| is_over.set(is_over.get() || visit(part).is_break());
    let mut current = Part::FileHeader(Vec::new());
    let mut take = |element: Element| {
        if is_start_of_unit(&element) {
            let next = Branch::new(current.next(), &element);
            let done = std::mem::replace(&mut current, Part::Unit(next));
            // The payload of a damaged unit has no elements, and still takes its bytes.
            visit(done.ending_at(element.at_bit / 8));
        }
        current.push(element);
    };
    let mut inspector = Inspector::new(limits, &mut take);
    let fed = feed(reader, &mut |bytes, is_end| {
        let is_more = inspector.read(bytes, is_end) && !is_over.get();
        is_more.then(|| inspector.position())
    });
    let error = inspector.error();
    visit(current);
    let (bytes, failed) = fed.map_or_else(|error| (0, Some(error)), |bytes| (bytes, None));
    Visited { bytes, error, failed }
}

impl Part {
    /// The number of the unit after it.
    fn next(&self) -> usize {
        match self {
            Self::FileHeader(_) => 0,
            Self::Unit(unit) => unit.unit + 1,
        }
    }

    fn ending_at(mut self, end: u64) -> Self {
        if let Self::Unit(unit) = &mut self {
            unit.bytes = end.saturating_sub(unit.at);
        }
        self
    }

    fn push(&mut self, element: Element) {
        match self {
            Self::FileHeader(elements) => elements.push(element),
            Self::Unit(unit) => unit.push(element),
        }
    }
}

impl Serialize for Tree<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tree = serializer.serialize_struct("Tree", 6)?;
        tree.serialize_field("file", self.path)?;
        tree.serialize_field("records", &self.records)?;
        tree.serialize_field("units", &Branches(self))?;
        tree.serialize_field("file_header", &Groups(&self.file_header.borrow(), &self.records))?;
        let visited = self.visited.borrow();
        tree.serialize_field("bytes", &visited.bytes)?;
        tree.serialize_field("error", &visited.error.map(StreamFault::from))?;
        tree.end()
    }
}

impl Serialize for Branches<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(tree) = self;
        let mut units = serializer.serialize_seq(None)?;
        let mut written = Ok(());
        tree.visit(&mut |part| {
            match part {
                Part::FileHeader(elements) => drop(tree.file_header.replace(elements)),
                Part::Unit(branch) => written = units.serialize_element(&BranchJson(&branch, &tree.records)),
            }
            go_on_if(written.is_ok())
        });
        written?;
        units.end()
    }
}

impl Serialize for BranchJson<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(branch, records) = self;
        let mut unit = serializer.serialize_struct("Branch", 6)?;
        unit.serialize_field("unit", &branch.unit)?;
        unit.serialize_field("type", branch.kind)?;
        unit.serialize_field("at", &branch.at)?;
        unit.serialize_field("bytes", &branch.bytes)?;
        unit.serialize_field("header", &Fields(&branch.header))?;
        unit.serialize_field("records", &Groups(&branch.elements, records))?;
        unit.end()
    }
}

impl Tree<'_> {
    fn visit(&self, visit: &mut dyn FnMut(Part) -> ControlFlow<()>) {
        let visited = each_part(&mut **self.reader.borrow_mut(), self.limits, visit);
        self.visited.replace(visited);
    }

    /// The tree for people.
    fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut written = Ok(());
        self.visit(&mut |part| {
            written = write_part(out, &part);
            go_on_if(written.is_ok())
        });
        written?;
        match self.visited.borrow().error {
            Some(error) => writeln!(out, "the first error is at {}", StreamFault::from(error)),
            None => Ok(()),
        }
    }
}

/// Where nothing can be written any more, nothing needs to be read.
pub(super) fn go_on_if(is_written: bool) -> ControlFlow<()> {
    if is_written { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
}

fn write_part(out: &mut dyn Write, part: &Part) -> io::Result<()> {
    match part {
        Part::FileHeader(elements) => write_rows(out, elements),
        Part::Unit(unit) => {
            writeln!(out, "unit {} {}  {}", unit.unit, unit.kind, span(unit.at, unit.bytes))?;
            write_rows(out, &unit.header)?;
            write_rows(out, &unit.elements)
        }
    }
}

/// Rows under the name of their record, which is given once.
fn write_rows(out: &mut dyn Write, rows: &[Element]) -> io::Result<()> {
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
            row.value.to_string(),
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

fn is_start_of_unit(element: &Element) -> bool {
    let header = UnitHeader::TABLE;
    element.record == header.name && header.rows.first().is_some_and(|first| element.name == first.name)
}

impl Branch {
    fn new(unit: usize, first: &Element) -> Self {
        let kind = match first.value {
            Value::Code { name, .. } => name,
            _ => "",
        };
        Self { unit, kind, at: first.at_bit / 8, bytes: 0, header: Vec::new(), elements: Vec::new() }
    }

    fn push(&mut self, element: Element) {
        let end = element.at_bit + element.bits;
        self.bytes = self.bytes.max(end.div_ceil(8).saturating_sub(self.at));
        match element.record == UnitHeader::TABLE.name {
            true => self.header.push(element),
            false => push(&mut self.elements, element),
        }
    }
}
