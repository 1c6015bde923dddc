//! The bytes of one unit beside its elements.

use super::element::Alone;
use super::tree::{Branch, Part, each_part, offset};
use super::{Shown, span};
use crate::console::Console;
use crate::failure::Failure;
use crate::stream_file::StreamFile;
use serde::{Serialize, Serializer};
use splatstream_format::Limits;
use splatstream_format::inspect::Element;
use std::fmt::Write;
use std::ops::ControlFlow;

/// Bytes a line.
const WIDTH: usize = 16;

/// What `--json` prints.
#[derive(Serialize)]
struct Dump {
    unit: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    at: u64,
    bytes: u64,
    #[serde(serialize_with = "with_bytes")]
    elements: Vec<Bytes>,
}

/// One element and its bytes.
struct Bytes {
    element: Element,
    hex: String,
}

fn with_bytes<S: Serializer>(elements: &[Bytes], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(elements.iter().map(|Bytes { element, hex }| Alone { element, hex }))
}

/// Dumps one unit.
pub(super) fn show(stream: &StreamFile, number: usize, limits: &Limits, console: &Console) -> Shown {
    let (mut found, mut count) = (None, 0);
    let visited = each_part(&mut stream.bytes.as_slice(), limits, &mut |part| {
        if let Part::Unit(unit) = part {
            count += 1;
            found = found.take().or((unit.unit == number).then_some(unit));
        }
        ControlFlow::Continue(())
    });
    let Some(Branch { unit, kind, at, bytes, header, elements }) = found else {
        if visited.error.is_some() {
            return Ok(visited.error);
        }
        let path = stream.path.display();
        return Err(Failure::Usage(format!("{path}: there is no unit {number}, the stream has {count}")));
    };
    let elements = header.into_iter().chain(elements);
    let elements = elements.map(|element| Ok(Bytes { hex: hex(stream, &element)?, element }));
    let elements = elements.collect::<Result<_, Failure>>()?;
    let dump = Dump { unit, kind, at, bytes, elements };
    console.report(&dump, || dump.text())?;
    Ok(visited.error)
}

/// The bytes that an element touches, as the inspector found them within the stream.
fn hex(stream: &StreamFile, row: &Element) -> Result<String, Failure> {
    let start = usize::try_from(row.at_bit / 8).unwrap_or(usize::MAX);
    let end = usize::try_from((row.at_bit + row.bits).div_ceil(8)).unwrap_or(usize::MAX);
    let Some(bytes) = stream.bytes.get(start..end) else {
        let (path, name) = (stream.path.display(), &row.name);
        return Err(Failure::other(format!(
            "{path}: {name} is said to end beyond the stream; please report this"
        )));
    };
    let mut text = String::with_capacity(bytes.len() * 2);
    for byte in bytes {
        // Writing to a string cannot fail.
        let _infallible = write!(text, "{byte:02x}");
    }
    Ok(text)
}

impl Dump {
    fn text(&self) -> String {
        let mut text = format!("unit {} {}  {}\n", self.unit, self.kind, span(self.at, self.bytes));
        self.elements.iter().for_each(|element| element.push(&mut text));
        text
    }
}

impl Bytes {
    /// The lines of an element: its name and value stand beside the first.
    fn push(&self, text: &mut String) {
        let row = &self.element;
        let name = format!("{}.{} = {} ({})", row.record, row.name, row.value, row.clause);
        let lines = self.hex.as_bytes().chunks(2 * WIDTH);
        for (line, digits) in lines.enumerate() {
            let pairs: Vec<&str> = digits.chunks(2).filter_map(|pair| str::from_utf8(pair).ok()).collect();
            let at = row.at_bit + (line * WIDTH * 8) as u64;
            let beside = if line == 0 { name.as_str() } else { "" };
            let shown = format!("{:<10} {:<47}  {beside}", offset(at), pairs.join(" "));
            *text += shown.trim_end();
            text.push('\n');
        }
    }
}
