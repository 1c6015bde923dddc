//! The values after a PLY header: elements in order, wanted columns of wanted elements.

use super::header::{Element, Encoding, Header, Kind, Scalar};
use crate::cursor::Cursor;
use crate::error::SceneError;
use crate::limits::Budget;
use crate::note::Note;

/// Rows read a column at a time, so that a block of them stays in the first-level caches.
const BLOCK_ROWS: usize = 128;

const COLUMNS: &str = "the values of all Gaussians";
const CUT_SHORT: &str = "the file is cut short or its header is wrong";

/// Reads the values of a PLY body in the order of the file.
pub(crate) struct Body<'a> {
    cursor: Cursor<'a>,
    encoding: Encoding,
}

/// A type that columns can be read into. Every PLY scalar is exact in `f64`.
pub(crate) trait Cell {
    fn from_f64(value: f64) -> Self;
}

impl Cell for f32 {
    fn from_f64(value: f64) -> Self {
        value as f32
    }
}

impl Cell for u32 {
    fn from_f64(value: f64) -> Self {
        value as u32
    }
}

impl Cell for u8 {
    fn from_f64(value: f64) -> Self {
        value as u8
    }
}

impl<'a> Body<'a> {
    /// The values that follow `header` in `file`, which starts with it.
    pub(crate) fn new(file: &'a [u8], header: &Header) -> Self {
        let mut cursor = Cursor::new(file);
        // The header was parsed from these bytes, so that many are there; if not, nothing is left to read.
        let _ = cursor.take(header.length as u64, "header");
        Self { cursor, encoding: header.encoding }
    }

    /// Passes over an element.
    pub(crate) fn skip(&mut self, element: &Element) -> Result<(), SceneError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        if let (Some(stride), false) = (stride(element), self.encoding == Encoding::Ascii) {
            return self.cursor.take_rows(element.count, stride as u64, "a skipped element").map(|_| ());
        }
        // Each row takes at least one byte, so this ends with the bytes whatever the count says.
        for _ in 0..element.count {
            for property in &element.properties {
                match property.kind {
                    Kind::Scalar(kind) => drop(self.scalar(kind)?),
                    Kind::List { count, item } => self.skip_list(count, item)?,
                }
            }
        }
        Ok(())
    }

    /// Passes over the elements after those that were read, and notes what follows the last. One that is not whole is of no
    /// interest.
    pub(crate) fn end<'e>(mut self, after: impl Iterator<Item = &'e Element>, budget: &mut Budget) {
        let is_whole = after.map(|element| self.skip(element)).all(|skipped| skipped.is_ok());
        let left = self.cursor.remaining().trim_ascii().len();
        if is_whole && left > 0 {
            budget.note(Note::TrailingBytes { count: left as u64 });
        }
    }

    fn skip_list(&mut self, count: Scalar, item: Scalar) -> Result<(), SceneError> {
        // `as` saturates: a negative or broken count is an empty list.
        let items = self.scalar(count)? as u64;
        if self.encoding != Encoding::Ascii {
            return self.cursor.take_rows(items, item.size() as u64, "a list").map(|_| ());
        }
        (0..items).try_for_each(|_| self.token().map(|_| ()))
    }

    /// Reads the columns `names` of `element`, which has them all and has no list.
    pub(crate) fn columns<T: Cell>(
        &mut self,
        element: &Element,
        names: &[String],
        budget: &mut Budget,
    ) -> Result<Vec<Vec<T>>, SceneError> {
        let stride = stride(element).ok_or_else(|| {
            let what = format!("element {} has a list property", element.name);
            SceneError::unsupported(what, "export it without list properties")
        })?;
        match self.encoding {
            Encoding::Ascii => self.text_columns(element, names, budget),
            Encoding::LittleEndian | Encoding::BigEndian => {
                self.binary_columns(element, names, stride, budget)
            }
        }
    }

    fn binary_columns<T: Cell>(
        &mut self,
        element: &Element,
        names: &[String],
        stride: usize,
        budget: &mut Budget,
    ) -> Result<Vec<Vec<T>>, SceneError> {
        let rows = self.cursor.take_rows(element.count, stride as u64, "the element's data")?;
        let places: Vec<_> = names.iter().filter_map(|name| place(element, name)).collect();
        let count = rows.len().checked_div(stride).unwrap_or(0);
        let room = places.iter().map(|_| budget.room(count as u64, COLUMNS));
        let mut columns: Vec<Vec<T>> = room.collect::<Result<_, _>>()?;
        for block in rows.chunks(BLOCK_ROWS.saturating_mul(stride.max(1))) {
            for (column, &(offset, kind)) in columns.iter_mut().zip(&places) {
                extend(column, block, stride, offset, kind, self.encoding);
            }
        }
        Ok(columns)
    }

    fn text_columns<T: Cell>(
        &mut self,
        element: &Element,
        names: &[String],
        budget: &mut Budget,
    ) -> Result<Vec<Vec<T>>, SceneError> {
        // A value takes a digit and a separator, the very last only a digit.
        let least =
            element.count.saturating_mul(element.properties.len() as u64).saturating_mul(2).saturating_sub(1);
        let left = self.cursor.remaining().len() as u64;
        if least > left {
            return Err(SceneError::truncated(self.cursor.at() as u64, "the element's data", least, left));
        }
        let target: Vec<Option<usize>> = element
            .properties
            .iter()
            .map(|property| names.iter().position(|name| *name == property.name))
            .collect();
        let room = names.iter().map(|_| budget.room(element.count, COLUMNS));
        let mut columns: Vec<Vec<T>> = room.collect::<Result<_, _>>()?;
        for _ in 0..element.count {
            for target in &target {
                let value = self.number()?;
                if let Some(column) = target.and_then(|target| columns.get_mut(target)) {
                    column.push(T::from_f64(value));
                }
            }
        }
        Ok(columns)
    }

    fn scalar(&mut self, kind: Scalar) -> Result<f64, SceneError> {
        if self.encoding == Encoding::Ascii {
            return self.number();
        }
        let bytes = self.cursor.take(kind.size() as u64, "a value")?;
        Ok(decode(bytes, kind, self.encoding))
    }

    fn number(&mut self) -> Result<f64, SceneError> {
        let at = self.cursor.at();
        let token = self.token()?;
        let text = std::str::from_utf8(token).unwrap_or_default();
        text.parse().map_err(|_| {
            let what = format!("\"{}\" is no number", token.escape_ascii());
            SceneError::malformed(at, what, "the ascii body holds numbers and blanks only")
        })
    }

    /// The next run of bytes between blanks.
    fn token(&mut self) -> Result<&'a [u8], SceneError> {
        let blanks = self.cursor.remaining().iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        self.cursor.take(blanks as u64, "blanks")?;
        let rest = self.cursor.remaining();
        let length = rest.iter().take_while(|byte| !byte.is_ascii_whitespace()).count();
        if length == 0 {
            return Err(SceneError::malformed(self.cursor.at(), "a number is missing", CUT_SHORT));
        }
        self.cursor.take(length as u64, "a number")
    }
}

/// Bytes of one row, unless a list makes them vary.
fn stride(element: &Element) -> Option<usize> {
    element.properties.iter().try_fold(0, |sum, property| match property.kind {
        Kind::Scalar(kind) => kind.size().checked_add(sum),
        Kind::List { .. } => None,
    })
}

/// Where in a row the property is, and of what type.
fn place(element: &Element, name: &str) -> Option<(usize, Scalar)> {
    let mut offset = 0;
    for property in &element.properties {
        let Kind::Scalar(kind) = property.kind else {
            return None;
        };
        if property.name == name {
            return Some((offset, kind));
        }
        offset = kind.size().checked_add(offset)?;
    }
    None
}

/// Appends one column of a block of rows.
fn extend<T: Cell>(
    column: &mut Vec<T>,
    block: &[u8],
    stride: usize,
    offset: usize,
    kind: Scalar,
    encoding: Encoding,
) {
    let cells = block.chunks_exact(stride).filter_map(|row| row.get(offset..)?.get(..kind.size()));
    // The common case has its own loop, free of the choice of type in each cell.
    if (kind, encoding) == (Scalar::F32, Encoding::LittleEndian) {
        let floats = cells.filter_map(|cell| cell.try_into().ok()).map(f32::from_le_bytes);
        column.extend(floats.map(|value| T::from_f64(f64::from(value))));
    } else {
        column.extend(cells.map(|cell| T::from_f64(decode(cell, kind, encoding))));
    }
}

/// The value of a cell, which has the size of its type.
fn decode(cell: &[u8], kind: Scalar, encoding: Encoding) -> f64 {
    let mut wide = [0; 8];
    for (to, from) in wide.iter_mut().zip(cell) {
        *to = *from;
    }
    if encoding == Encoding::BigEndian {
        wide.iter_mut().take(cell.len()).zip(cell.iter().rev()).for_each(|(to, &from)| *to = from);
    }
    let [a, b, c, d, ..] = wide;
    match kind {
        Scalar::I8 => f64::from(a as i8),
        Scalar::U8 => f64::from(a),
        Scalar::I16 => f64::from(i16::from_le_bytes([a, b])),
        Scalar::U16 => f64::from(u16::from_le_bytes([a, b])),
        Scalar::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
        Scalar::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
        Scalar::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
        Scalar::F64 => f64::from_le_bytes(wide),
    }
}
