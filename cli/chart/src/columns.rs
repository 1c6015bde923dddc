//! Tables, described once: rows of one type, and columns that have a name, a heading and a value. CSV files, JSON, the
//! terminal and the page print the same columns.

mod metrics;
mod print;
mod value;

pub(crate) use metrics::{metrics, other_metrics};
pub(crate) use print::{csv, html, object, objects, text};
use std::borrow::Cow;
pub(crate) use value::{Value, short};

/// What a table is printed for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Medium {
    /// A CSV file.
    File,
    /// An object of JSON.
    Json,
    /// Text in columns.
    Terminal,
    /// A table of HTML.
    Page,
}

/// Files and JSON.
pub(crate) const PROGRAMS: &[Medium] = &[Medium::File, Medium::Json];
/// The terminal and the page.
pub(crate) const PEOPLE: &[Medium] = &[Medium::Terminal, Medium::Page];
const EVERYWHERE: &[Medium] = &[Medium::File, Medium::Json, Medium::Terminal, Medium::Page];

/// A column of rows `R`.
pub(crate) struct Column<R> {
    /// Name for programs, with the unit.
    name: Cow<'static, str>,
    /// Heading for people, with the unit unless cells have it.
    heading: Cow<'static, str>,
    media: &'static [Medium],
    /// Whether people are spared it where no row has a value.
    optional: bool,
    value: Box<dyn Fn(&R) -> Value>,
}

impl<R> Column<R> {
    /// A column that is printed everywhere.
    pub(crate) fn new(
        name: impl Into<Cow<'static, str>>,
        heading: impl Into<Cow<'static, str>>,
        value: impl Fn(&R) -> Value + 'static,
    ) -> Self {
        let (name, heading, value) = (name.into(), heading.into(), Box::new(value));
        Self { name, heading, media: EVERYWHERE, optional: false, value }
    }

    /// A column of CSV files only.
    pub(crate) fn of_file(name: impl Into<Cow<'static, str>>, value: impl Fn(&R) -> Value + 'static) -> Self {
        Self::new(name, "", value).on(&[Medium::File])
    }

    /// A column for people only.
    pub(crate) fn of_people(
        heading: impl Into<Cow<'static, str>>,
        value: impl Fn(&R) -> Value + 'static,
    ) -> Self {
        Self::new("", heading, value).on(PEOPLE)
    }

    /// Printed for some media only.
    pub(crate) fn on(self, media: &'static [Medium]) -> Self {
        Self { media, ..self }
    }

    /// Left out for people where no row has a value.
    pub(crate) fn if_measured(self) -> Self {
        Self { optional: true, ..self }
    }
}

/// A row of a table.
pub(crate) trait Row: Sized {
    /// The columns of a table of some rows, in order.
    fn columns(rows: &[Self]) -> Vec<Column<Self>>;

    /// Whether the page sets the row apart.
    fn stands_out(&self) -> bool {
        false
    }

    /// The part of the page that the first cell leads to.
    fn part_of_page(&self) -> Option<&str> {
        None
    }
}
