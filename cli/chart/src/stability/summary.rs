//! What `chart --stability` says on the terminal.

use super::rows::{BaseReport, CaseReport, Count, Row, Verdict, count};
use super::tools::Tool;
use crate::columns::{objects, short, text};
use serde::Serialize;

/// Bits that a sequence may take beyond all intra, percent, before it is said.
const LARGER_PERCENT: f64 = 1.0;

/// What is said of the cases. As JSON it is what `chart --stability --json` says of them.
#[derive(Serialize)]
pub struct Summary {
    silent_failures: usize,
    larger_than_intra: Vec<String>,
    #[serde(serialize_with = "objects")]
    tools: Vec<Count>,
    #[serde(serialize_with = "objects")]
    rows: Vec<Row>,
}

impl Summary {
    pub(super) fn new(reports: &[BaseReport]) -> Self {
        let larger = |report: &BaseReport| -> Vec<String> {
            report.cases.iter().flat_map(|case| larger(&report.name, case)).collect()
        };
        Self {
            silent_failures: count(reports, Tool::SplatStream, Verdict::Silent)
                + count(reports, Tool::AllIntra, Verdict::Silent),
            larger_than_intra: reports.iter().flat_map(larger).collect(),
            tools: Count::of_all(reports).into_iter().filter(Count::was_measured).collect(),
            rows: reports.iter().flat_map(BaseReport::rows).cloned().collect(),
        }
    }

    /// For people: what is not well, then the counts.
    pub fn text(&self) -> String {
        let is_ours = |row: &&Row| [Tool::SplatStream, Tool::AllIntra].contains(&row.tool);
        let ours = self.rows.iter().filter(is_ours);
        let failures: Vec<Row> = ours.filter(|row| row.verdict != Verdict::Ok).cloned().collect();
        let larger: String =
            self.larger_than_intra.iter().map(|words| format!("larger than all intra: {words}\n")).collect();
        format!(
            "{}\n{larger}{}\nsilent failures of SplatStream: {}\n",
            text(&failures),
            text(&self.tools),
            self.silent_failures
        )
    }
}

/// Where predicted frames take more than all intra, in words.
fn larger(scene: &str, report: &CaseReport) -> Vec<String> {
    let bits = |tool: Tool, at: f64| {
        report.rows.iter().find(|row| row.tool == tool && row.strength == at).and_then(|row| row.bpg)
    };
    let ours = report.rows.iter().filter(|row| row.tool == Tool::SplatStream);
    let one = |row: &Row| {
        let more = 100.0 * (row.bpg? / bits(Tool::AllIntra, row.strength)? - 1.0);
        let at = short(row.strength);
        (more > LARGER_PERCENT).then(|| format!("{scene}, {} {at}: {more:.1} %", report.case.id))
    };
    ours.filter_map(one).collect()
}
