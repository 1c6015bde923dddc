//! What came out: one row a case, strength and tool.

use super::cases::Case;
use super::sample::Quality;
use super::tools::Tool;
use crate::columns::{Column, Medium, Row as TableRow, Value};

/// How far pictures may be below those of the base before it counts, decibels.
const MISSED_DB: f64 = 3.0;

/// The page has a table for each case; files name the scene in their first column anyway.
const NOT_IN_TABLES_OF_CASES: &[Medium] = &[Medium::Json, Medium::Terminal];
const NOT_ON_PAGE: &[Medium] = &[Medium::File, Medium::Json, Medium::Terminal];
const NOT_IN_JSON: &[Medium] = &[Medium::File, Medium::Terminal, Medium::Page];

/// What a tool did about a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Pictures are as good as those of the base, or nearly.
    Ok,
    /// They are not, and the tool says that something is wrong.
    Warned,
    /// They are not, and nobody says so.
    Silent,
}

impl Verdict {
    /// All of them.
    pub(super) const ALL: [Self; 3] = [Self::Ok, Self::Warned, Self::Silent];

    /// Of pictures and of what is wanted of them.
    pub(super) fn of(quality: Option<Quality>, wanted: &Quality, said: bool) -> Self {
        match quality {
            Some(quality) if quality.below(wanted) <= MISSED_DB => Self::Ok,
            _ if said => Self::Warned,
            _ => Self::Silent,
        }
    }

    /// In words.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warned => "warned",
            Self::Silent => "silent failure",
        }
    }
}

/// A tool on a case at a strength.
#[derive(Clone)]
pub(super) struct Row {
    /// The name of the base.
    pub(super) scene: String,
    /// The case.
    pub(super) case: &'static Case,
    /// The tool.
    pub(super) tool: Tool,
    /// The strength.
    pub(super) strength: f64,
    /// Pictures in the views of the inner scene; none if the tool shows nothing.
    pub(super) quality: Option<Quality>,
    /// What the tool gives for the base.
    pub(super) wanted: Quality,
    /// Bits per Gaussian of the source; none if the tool packs nothing.
    pub(super) bpg: Option<f64>,
    /// Who noticed what.
    pub(super) detected: String,
    /// What was done instead.
    pub(super) fallback: String,
    /// What to think of it.
    pub(super) verdict: Verdict,
}

/// A case on a base.
pub(super) struct CaseReport {
    /// The case.
    pub(super) case: &'static Case,
    /// By strength, then by tool.
    pub(super) rows: Vec<Row>,
}

/// All cases on a base.
pub(super) struct BaseReport {
    /// What the page calls it.
    pub(super) name: String,
    /// What it is, in a sentence.
    pub(super) facts: String,
    /// The cases.
    pub(super) cases: Vec<CaseReport>,
}

impl BaseReport {
    /// All rows.
    pub(super) fn rows(&self) -> impl Iterator<Item = &Row> {
        self.cases.iter().flat_map(|case| &case.rows)
    }
}

/// Rows of a tool with a verdict, over all bases.
pub(super) fn count(reports: &[BaseReport], tool: Tool, verdict: Verdict) -> usize {
    let rows = reports.iter().flat_map(BaseReport::rows);
    rows.filter(|row| row.tool == tool && row.verdict == verdict).count()
}

impl TableRow for Row {
    fn columns(rows: &[Self]) -> Vec<Column<Self>> {
        let psnr = |quality: Option<Quality>| Value::number(quality.map(|quality| quality.psnr), 1);
        let covered = |quality: Option<Quality>| Value::number(quality.map(|quality| quality.covered), 1);
        let bpg = |row: &Self| Value::number(row.bpg, 1);
        vec![
            Column::new("scene", "Scene", |row: &Self| Value::words(&row.scene)).on(NOT_IN_TABLES_OF_CASES),
            Column::new("case", "Case", |row: &Self| Value::words(row.case.id)).on(NOT_ON_PAGE),
            Column::of_file("axis", |row: &Self| Value::words(row.case.axis)),
            Column::new("strength", strength_heading(rows), |row: &Self| Value::Short(row.strength)),
            Column::new("tool", "Tool", |row: &Self| Value::words(row.tool.name())),
            Column::new("psnr_db", "PSNR, dB", move |row: &Self| psnr(row.quality)),
            Column::of_file("psnr_masked_db", move |row: &Self| covered(row.quality)),
            Column::new("psnr_db_plain", "Without the case", move |row: &Self| psnr(Some(row.wanted))),
            Column::of_file("psnr_masked_db_plain", move |row: &Self| covered(Some(row.wanted))),
            Column::new("bpg", "", bpg).on(&[Medium::Json]),
            Column::new("bpg_source", "Bits per Gaussian", bpg).on(NOT_IN_JSON),
            Column::new("detected", "Detected", |row: &Self| Value::words(&row.detected)),
            Column::new("fallback", "Fallback", |row: &Self| Value::words(&row.fallback)),
            Column::new("verdict", "Verdict", |row: &Self| Value::words(row.verdict.name())),
        ]
    }

    fn stands_out(&self) -> bool {
        self.verdict != Verdict::Ok
    }
}

/// What the strength of rows of one case is.
fn strength_heading(rows: &[Row]) -> String {
    let Some(first) = rows.first() else { return "Strength".to_owned() };
    if rows.iter().any(|row| row.case.id != first.case.id) {
        return "Strength".to_owned();
    }
    let mut axis = first.case.axis.to_owned();
    if let Some(letter) = axis.get_mut(..1) {
        letter.make_ascii_uppercase();
    }
    axis
}

/// The verdicts on a tool, over all bases.
#[derive(Debug, Clone, Copy)]
pub(super) struct Count {
    tool: Tool,
    /// Rows by verdict, in the order of [`Verdict::ALL`].
    rows: [usize; 3],
}

impl Count {
    /// Of each tool.
    pub(super) fn of_all(reports: &[BaseReport]) -> [Self; 5] {
        Tool::ALL.map(|tool| Self { tool, rows: Verdict::ALL.map(|verdict| count(reports, tool, verdict)) })
    }

    /// Whether there is a row of the tool.
    pub(super) fn was_measured(&self) -> bool {
        self.rows.iter().any(|&rows| rows > 0)
    }
}

impl TableRow for Count {
    fn columns(_: &[Self]) -> Vec<Column<Self>> {
        let mut columns = vec![Column::new("tool", "Tool", |row: &Self| Value::words(row.tool.name()))];
        columns.extend(["ok", "warned", "silent"].into_iter().zip(Verdict::ALL).enumerate().map(
            |(index, (name, verdict))| {
                let rows = move |row: &Self| {
                    row.rows.get(index).map_or(Value::None, |&rows| Value::Count(rows as u64))
                };
                Column::new(name, verdict.name(), rows)
            },
        ));
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_missed_without_a_word_is_silent() {
        let quality = |psnr, covered| Quality { psnr, covered };
        let verdict =
            |quality, said| Verdict::of(quality, &Quality { psnr: 50.0, covered: 45.0 }, said).name();
        assert_eq!(verdict(Some(quality(47.5, 40.0)), false), "ok");
        assert_eq!(verdict(Some(quality(45.0, 45.0)), false), "ok");
        assert_eq!(verdict(Some(quality(46.9, 41.9)), false), "silent failure");
        assert_eq!(verdict(Some(quality(15.0, 15.0)), true), "warned");
        assert_eq!([verdict(None, true), verdict(None, false)], ["warned", "silent failure"]);
    }
}
