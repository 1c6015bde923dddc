//! PSNR against strength, one figure a case, one line a tool.

use super::rows::{BaseReport, CaseReport, Row};
use super::tools::Tool;
use crate::columns::short;
use crate::svg::Figure;
use crate::svg::plot::{Dot, Line, Plot, Series};

/// The figures of all cases of all bases. A case in which no tool shows anything has none.
pub(super) fn figures(reports: &[BaseReport]) -> Vec<Figure> {
    let of_base = |report: &BaseReport| -> Vec<Figure> {
        report.cases.iter().filter_map(|case| plot(&report.name, case).figure()).collect()
    };
    reports.iter().flat_map(of_base).collect()
}

/// The stem of the file of a figure.
pub(super) fn id(base: &str, report: &CaseReport) -> String {
    format!("{base}-stability-{}", report.case.id)
}

fn plot(base: &str, report: &CaseReport) -> Plot {
    let case = report.case;
    let series = Tool::ALL.into_iter().filter_map(|tool| series(tool, report)).collect();
    Plot {
        id: id(base, report),
        title: format!("{base}: {}", case.title),
        description: format!(
            "PSNR in the views of the inner scene against the {}, one line a tool: {}.",
            case.axis, case.what
        ),
        x: case.axis.to_owned(),
        y: "PSNR in the views of the inner scene, dB".to_owned(),
        top: None,
        series,
    }
}

/// A tool; where it shows nothing, its line has a gap that is bridged.
fn series(tool: Tool, report: &CaseReport) -> Option<Series> {
    let rows: Vec<(&Row, f64)> = report
        .rows
        .iter()
        .filter(|row| row.tool == tool)
        .filter_map(|row| Some((row, row.quality?.psnr)))
        .collect();
    let last = rows.len().checked_sub(1)?;
    let dot = |(place, (row, psnr)): (usize, &(&Row, f64))| {
        let (at, words) = (short(row.strength), row.verdict.name());
        Dot {
            at: (row.strength, *psnr),
            label: (place == last).then(|| tool.name().to_owned()),
            hint: format!("{}, {at}: {psnr:.2} dB, {words}", tool.name()),
        }
    };
    let dots = rows.iter().enumerate().map(dot).collect();
    Some(Series { style: tool.style(), line: Line::Solid, dots })
}
