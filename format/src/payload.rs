//! Clauses 5.7 to 5.10 and 5.14 to 5.17: payloads whose extent depends on their elements, divided into sections.
//!
//! The fixed record in front is deku's ([`crate::syntax`]), the division behind it nom's. A section cannot be
//! read past its end, and what is left over is an error.

use crate::syntax::{Table, after, nothing_after};
use crate::{Class, Error, ErrorKind, Result};
use nom::multi::count;
use nom::{IResult, Offset, Parser};

mod codebook;
mod increment;
mod index;
mod number;
mod operating_points;
mod refinement;
mod transform;
mod weights;

pub use codebook::Codebook;
pub use increment::{CodedSection, Increment, SectionBytes, write_increment};
pub use index::Index;
pub use number::{leb128, write_leb128};
pub use operating_points::OperatingPoints;
pub use refinement::{Refinement, write_refinement};
pub use transform::Transform;
pub use weights::{Layer, Network, Part, REGISTRY, Weights};

/// A row of a syntax table whose extent depends on other elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VariableRow {
    /// The record it belongs to.
    pub record: &'static str,
    /// The syntax element, as the specification spells it.
    pub name: &'static str,
    /// Its type, as the specification spells it.
    pub type_name: &'static str,
    /// What it is, in a line.
    pub meaning: &'static str,
    /// The clause of its syntax table.
    pub clause: &'static str,
}

const fn row(
    clause: &'static str,
    record: &'static str,
    name: &'static str,
    type_name: &'static str,
    meaning: &'static str,
) -> VariableRow {
    VariableRow { record, name, type_name, meaning, clause }
}

/// The rows behind the fixed part of the records, in the order of clause 5.
pub const VARIABLE_ROWS: [VariableRow; 17] = [
    row("5.7", "transform", "mean", "i32[dimension]", "output of components 0, step/64"),
    row("5.7", "transform", "basis", "i16[rank*dimension]", "weights, Q12, component by component"),
    row(
        "5.8",
        "codebook",
        "entries",
        "u8[(entry_count_minus1 + 1) * component_count * value_bytes]",
        "values, entry by entry",
    ),
    row("5.9", "refinement", "model_length", "leb128", "bytes of models"),
    row("5.9", "refinement", "models", "u8[model_length]", "the models of the planes"),
    row("5.9", "refinement", "block_length", "leb128[block_count]", "bytes of each block"),
    row("5.9", "refinement", "blocks", "u8[...]", "entropy-coded Gaussians"),
    row("5.10", "index", "entries", "index_entry[entry_count]", "one for each group"),
    row("5.14", "increment", "sections", "section[...]", "sections with a count above 0"),
    row("5.15", "section", "lanes_log2", "u8", "log2 of the entropy states of a block, 0 to 5"),
    row("5.15", "section", "model_length", "leb128", "bytes of models"),
    row("5.15", "section", "models", "u8[model_length]", "the models of the planes"),
    row("5.15", "section", "block_length", "leb128[block_count]", "bytes of each block"),
    row("5.15", "section", "blocks", "u8[...]", "entropy-coded values"),
    row("5.16", "operating_points", "entries", "operating_point[point_count]", "one for each point"),
    row("5.17", "weights", "model", "u8[...]", "a network, or the SHA-256 of one"),
    row("5.17.1", "network", "parameters", "u8[...]", "weights and biases, part by part"),
];

/// What nom carries: the bytes from the offending element on stand for its offset.
#[derive(Debug)]
struct Fault<'a> {
    rest: &'a [u8],
    /// `None` until [`element`] names what did not fit.
    kind: Option<ErrorKind>,
}

impl<'a> nom::error::ParseError<&'a [u8]> for Fault<'a> {
    fn from_error_kind(rest: &'a [u8], _: nom::error::ErrorKind) -> Self {
        // The parsers of nom in use here fail in one way only: too few bytes.
        Self { rest, kind: None }
    }

    fn append(_: &'a [u8], _: nom::error::ErrorKind, other: Self) -> Self {
        other
    }
}

type Parsed<'a, T> = IResult<&'a [u8], T, Fault<'a>>;

/// Fails at `rest`.
fn fault<T>(rest: &[u8], kind: ErrorKind) -> Parsed<'_, T> {
    Err(nom::Err::Failure(Fault { rest, kind: Some(kind) }))
}

/// Names an element: when it does not fit, the error stands at its first byte.
fn element<'a, T>(
    name: &'static str,
    mut parser: impl Parser<&'a [u8], Output = T, Error = Fault<'a>>,
) -> impl Parser<&'a [u8], Output = T, Error = Fault<'a>> {
    move |input: &'a [u8]| {
        parser.parse(input).map_err(|error| {
            error.map(|cause| match cause.kind {
                Some(_) => cause,
                None => Fault { rest: input, kind: Some(ErrorKind::ShortSection { element: name }) },
            })
        })
    }
}

/// Runs a parser on the variable part of a payload, which starts at offset `at` and ends with its slice.
fn whole<'a, T>(
    table: &Table,
    section: &'a [u8],
    at: u64,
    mut parser: impl Parser<&'a [u8], Output = T, Error = Fault<'a>>,
) -> Result<T> {
    let (rest, value) = parser.parse(section).map_err(|error| located(table, section, at, error))?;
    nothing_after(table, rest, after(at, section.offset(rest)))?;
    Ok(value)
}

/// The place of an error in the stream.
fn located(table: &Table, section: &[u8], at: u64, error: nom::Err<Fault<'_>>) -> Error {
    let short = ErrorKind::ShortSection { element: table.name };
    match error {
        nom::Err::Error(fault) | nom::Err::Failure(fault) => {
            let kind = fault.kind.unwrap_or(short);
            let clause = if kind.class() == Class::Malformed { table.syntax } else { table.semantics };
            Error::new(after(at, section.offset(fault.rest)), clause, kind)
        }
        // Only `complete` parsers are used: this one does not occur.
        nom::Err::Incomplete(_) => Error::new(at, table.syntax, short),
    }
}

/// The lengths of the blocks of a section. nom asks for little room before it has seen them.
fn block_lengths(block_count: usize, input: &[u8]) -> Parsed<'_, Vec<u32>> {
    let element = "block_length";
    let lengths = count(number::number(element), block_count).parse(input);
    let short = ErrorKind::ShortSection { element };
    match lengths {
        // Every length takes a byte: where there are too few, all of them are missed.
        Err(nom::Err::Failure(Fault { kind, .. })) if kind == Some(short) && block_count > input.len() => {
            fault(input, short)
        }
        lengths => lengths,
    }
}

/// `usize` of a number that the bytes present bound anyway: too large a one does not fit there either.
fn length(value: u32) -> usize {
    usize::try_from(value).unwrap_or(usize::MAX)
}
