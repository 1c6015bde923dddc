//! Scenes and sequences made to break codecs, and where each tool fails.
//!
//! A case (`cases`) turns a base (`base`) into a sample (`sample`) of a strength; each tool (`tools`) codes it; the
//! result is judged by its pictures from cameras around the inner scene, against what the same tool gives for the base itself.
//! What is missed without a word of the tool is a silent failure.

mod attempt;
mod base;
mod cases;
mod dice;
mod edits;
mod figures;
mod loss;
mod measure;
mod ours;
mod page;
mod peers;
mod rows;
mod sample;
mod scenes;
mod sequences;
mod sog;
mod summary;
mod tools;

use crate::columns::csv;
use crate::report::{File, Report};
use crate::scenes::Scene;
use crate::svg::Figure;
use crate::{Error, Progress};
use base::Base;
pub use base::{Size, builtin};
use rows::{BaseReport, Row};
use splatstream_encoder::{Report as Encoded, Settings};
pub use summary::Summary;

/// The file of all rows.
const FILE: &str = "stability.csv";

/// Rows of a picture, unless the user says otherwise.
const HEIGHT: u32 = 120;

/// A warning of the encoder's front end, with the code that programs know it by.
pub struct Warning {
    /// The code.
    pub code: &'static str,
    /// In words.
    pub message: String,
}

/// What a user is told of a stream that was encoded without an error.
pub type Warnings<'a> = &'a dyn Fn(&Encoded, &Settings) -> Vec<Warning>;

/// How cases are measured.
pub struct Stability<'a> {
    /// How much is measured.
    pub size: Size,
    /// Rows of a picture; none: 120.
    pub height: Option<u32>,
    /// What a user is told of a stream.
    pub warnings: Warnings<'a>,
    /// The command that makes the page, for people to repeat.
    pub command: String,
}

impl Stability<'_> {
    /// Bytes that [`Stability::run`] takes at most beside the frames of the scenes.
    pub fn memory(&self, scenes: &[Scene]) -> u64 {
        scenes.iter().map(|scene| self.size.memory(scene)).max().unwrap_or(0)
    }

    /// Measures every case on every scene; `start` is told the steps of progress before the first.
    ///
    /// # Errors
    /// A table cannot be written as CSV.
    pub fn run<P: Progress>(
        &self,
        scenes: &[Scene],
        start: impl Fn(u32) -> P,
    ) -> Result<Report<Summary>, Error> {
        let bases: Vec<Base> = scenes.iter().map(|scene| Base::new(scene, self.size)).collect();
        let progress = start(bases.iter().map(|base| measure::steps(base, self.size)).sum());
        let reports: Vec<BaseReport> =
            bases.iter().map(|base| measure::measure(base, self, &progress)).collect();
        let figures = figures::figures(&reports);
        let rows = reports.iter().map(|report| (report.name.as_str(), report.rows().cloned().collect()));
        let mut files = vec![File { name: FILE.to_owned(), bytes: csv::<Row>(rows)? }];
        files.extend(figures.iter().map(Figure::file));
        let page = page::html(&reports, &figures, &self.command);
        Ok(Report { files, pictures: Vec::new(), page, summary: Summary::new(&reports) })
    }
}
