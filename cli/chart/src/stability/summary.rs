//! What `chart --stability` says on the terminal.

use super::rows::{BaseReport, CaseReport, Row, Verdict, count, strength};
use super::tools::Tool;
use crate::table::Table;
use serde::Serialize;

/// Bits that a sequence may take beyond all intra, percent, before it is said.
const LARGER_PERCENT: f64 = 1.0;

/// What is said of the cases. As JSON it is what `chart --stability --json` says of them.
#[derive(Serialize)]
pub struct Summary {
    silent_failures: usize,
    larger_than_intra: Vec<String>,
    tools: Vec<ToolSummary>,
    rows: Vec<RowSummary>,
}

/// Verdicts on a tool.
#[derive(Serialize)]
struct ToolSummary {
    tool: &'static str,
    ok: usize,
    warned: usize,
    silent: usize,
}

/// A tool on a case at a strength.
#[derive(Serialize)]
struct RowSummary {
    scene: String,
    case: &'static str,
    strength: f64,
    tool: &'static str,
    psnr_db: Option<f64>,
    psnr_db_plain: f64,
    bpg: Option<f64>,
    detected: String,
    fallback: String,
    verdict: &'static str,
}

impl Summary {
    pub(super) fn new(reports: &[BaseReport]) -> Self {
        let tool = |tool: Tool| {
            let [ok, warned, silent] = Verdict::ALL.map(|verdict| count(reports, tool, verdict));
            ToolSummary { tool: tool.name(), ok, warned, silent }
        };
        let cases = || reports.iter().flat_map(|report| report.cases.iter().map(move |case| (report, case)));
        let of_case = |(report, case): (&BaseReport, &CaseReport)| -> Vec<RowSummary> {
            case.rows.iter().map(|row| RowSummary::new(&report.name, case.case.id, row)).collect()
        };
        Self {
            silent_failures: count(reports, Tool::SplatStream, Verdict::Silent)
                + count(reports, Tool::AllIntra, Verdict::Silent),
            larger_than_intra: cases().flat_map(|(report, case)| larger(&report.name, case)).collect(),
            tools: Tool::ALL.map(tool).into_iter().filter(ToolSummary::was_measured).collect(),
            rows: cases().flat_map(of_case).collect(),
        }
    }

    /// For people: what is not well, then the counts.
    pub fn text(&self) -> String {
        let mut failures =
            Table::new(["scene", "case", "strength", "tool", "dB", "plain", "verdict", "detected"]);
        let ours = [Tool::SplatStream, Tool::AllIntra].map(Tool::name);
        let not_well = |row: &&RowSummary| row.verdict != Verdict::Ok.name() && ours.contains(&row.tool);
        for row in self.rows.iter().filter(not_well) {
            failures.row([
                row.scene.clone(),
                row.case.to_owned(),
                strength(row.strength),
                row.tool.to_owned(),
                row.psnr_db.map_or_else(|| "nothing".to_owned(), |psnr| format!("{psnr:.1}")),
                format!("{:.1}", row.psnr_db_plain),
                row.verdict.to_owned(),
                row.detected.clone(),
            ]);
        }
        let mut tools = Table::new(["tool", "ok", "warned", "silent failure"]);
        for tool in &self.tools {
            let counts = [tool.ok, tool.warned, tool.silent].map(|count| count.to_string());
            let [ok, warned, silent] = counts;
            tools.row([tool.tool.to_owned(), ok, warned, silent]);
        }
        let larger: String =
            self.larger_than_intra.iter().map(|words| format!("larger than all intra: {words}\n")).collect();
        format!(
            "{}\n{larger}{}\nsilent failures of SplatStream: {}\n",
            failures.text(),
            tools.text(),
            self.silent_failures
        )
    }
}

impl ToolSummary {
    fn was_measured(&self) -> bool {
        self.ok + self.warned + self.silent > 0
    }
}

impl RowSummary {
    fn new(scene: &str, case: &'static str, row: &Row) -> Self {
        Self {
            scene: scene.to_owned(),
            case,
            strength: row.strength,
            tool: row.tool.name(),
            psnr_db: row.quality.map(|quality| quality.psnr),
            psnr_db_plain: row.wanted.psnr,
            bpg: row.bpg,
            detected: row.detected.clone(),
            fallback: row.fallback.clone(),
            verdict: row.verdict.name(),
        }
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
        let at = strength(row.strength);
        (more > LARGER_PERCENT).then(|| format!("{scene}, {} {at}: {more:.1} %", report.case.id))
    };
    ours.filter_map(one).collect()
}
