//! JSON as it comes: objects whose keys are taken one by one, lists up to a limit, and matrices.

use super::MAX_VIEWS;
use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// What takes the values of an object by their keys; of a key that comes twice, the last.
///
/// It is what `#[serde(flatten)]` is for, which first copies every value that it meets.
pub(super) trait Taken: Default {
    /// Takes the value of a key, which is next in `map`; a value that is not known is read and not kept.
    fn take<'de, A: MapAccess<'de>>(&mut self, key: &str, map: &mut A) -> Result<(), A::Error>;

    /// A key that is needed and did not come.
    fn missing(&self) -> Option<&'static str> {
        None
    }
}

/// Reads an object.
pub(super) struct Object<T> {
    what: &'static str,
    of: PhantomData<T>,
}

impl<T> Object<T> {
    /// `what` is what an error says was expected.
    pub(super) fn new(what: &'static str) -> Self {
        Self { what, of: PhantomData }
    }
}

impl<'de, T: Taken> Visitor<'de> for Object<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.what)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<T, A::Error> {
        let mut object = T::default();
        while let Some(key) = map.next_key::<String>()? {
            object.take(&key, &mut map)?;
        }
        match object.missing() {
            Some(key) => Err(A::Error::missing_field(key)),
            None => Ok(object),
        }
    }
}

/// A list of up to [`MAX_VIEWS`] elements; those that follow are read and not kept.
pub(super) struct Limited<T> {
    elements: Vec<T>,
    is_whole: bool,
}

impl<T> Limited<T> {
    /// The elements, if they were not too many.
    pub(super) fn all(self) -> Option<Vec<T>> {
        self.is_whole.then_some(self.elements)
    }
}

impl<T> Default for Limited<T> {
    fn default() -> Self {
        Self { elements: Vec::new(), is_whole: true }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Limited<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Elements(PhantomData))
    }
}

struct Elements<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Elements<T> {
    type Value = Limited<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Limited<T>, A::Error> {
        let mut limited = Limited::default();
        while limited.elements.len() < MAX_VIEWS {
            match list.next_element()? {
                Some(element) => limited.elements.push(element),
                None => return Ok(limited),
            }
        }
        while list.next_element::<IgnoredAny>()?.is_some() {
            limited.is_whole = false;
        }
        Ok(limited)
    }
}

/// The first three rows of a matrix of 4 x 4, and how many rows and columns came.
#[derive(Clone, Copy, Default)]
pub(super) struct Matrix {
    rows: [Row; 3],
    count: usize,
}

/// The first four numbers of a row.
#[derive(Clone, Copy, Default)]
struct Row {
    values: [f32; 4],
    count: usize,
}

impl Matrix {
    /// The columns of its first three rows.
    ///
    /// # Errors
    /// Another number of rows than 4, or less than 4 numbers in one of the first three.
    pub(super) fn columns(&self) -> Result<[[f32; 3]; 4], &'static str> {
        match self.count {
            0 => return Err("transform_matrix has no rows: it must have 4"),
            4 if self.rows.iter().all(|row| row.count >= 4) => {}
            _ => return Err("transform_matrix must have 4 rows of 4 numbers"),
        }
        let mut columns = [[0.0; 3]; 4];
        for (axis, row) in self.rows.iter().enumerate() {
            for (column, value) in columns.iter_mut().zip(row.values) {
                if let Some(place) = column.get_mut(axis) {
                    *place = value;
                }
            }
        }
        Ok(columns)
    }
}

impl<'de> Deserialize<'de> for Matrix {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Rows;
        impl<'de> Visitor<'de> for Rows {
            type Value = Matrix;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of rows")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Matrix, A::Error> {
                let (rows, count) = firsts(&mut list)?;
                Ok(Matrix { rows, count })
            }
        }
        deserializer.deserialize_seq(Rows)
    }
}

impl<'de> Deserialize<'de> for Row {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Numbers;
        impl<'de> Visitor<'de> for Numbers {
            type Value = Row;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of numbers")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Row, A::Error> {
                let (values, count) = firsts(&mut list)?;
                Ok(Row { values, count })
            }
        }
        deserializer.deserialize_seq(Numbers)
    }
}

/// The first `N` elements of a list, all of which are of one type, and how many it has.
fn firsts<'de, T: Deserialize<'de> + Copy + Default, A: SeqAccess<'de>, const N: usize>(
    list: &mut A,
) -> Result<([T; N], usize), A::Error> {
    let mut kept = [T::default(); N];
    let mut count = 0_usize;
    while let Some(element) = list.next_element()? {
        if let Some(place) = kept.get_mut(count) {
            *place = element;
        }
        count = count.saturating_add(1);
    }
    Ok((kept, count))
}
