//! The page: where each tool fails.

use super::figures::id;
use super::files::FILE;
use super::rows::{BaseReport, CaseReport, Row, Verdict, count, strength};
use super::tools::Tool;
use crate::page::document;
use crate::page::elements::{self, Heading, how_to_read, made_by, table};
use crate::svg::Figure;
use maud::{Markup, html};

const TERMS: [(&str, &str); 8] = [
    (
        "ok",
        "pictures are at most 3 dB below those that the same tool gives without the case, over the whole picture or over \
         the pixels that the scene covers: a case may change how many these are.",
    ),
    ("warned", "they are further below, or there are none, and the tool says that something is wrong."),
    ("silent failure", "they are further below, and nobody says so."),
    (
        "PSNR",
        "of the decoded frames against the source with the case in it, from cameras around the scene without it, means over cameras and frames; at most 100.",
    ),
    ("bits per Gaussian", "of the source, over all frames."),
    (
        "all intra",
        "SplatStream with every frame by itself: nothing is predicted, so nothing can be mispredicted.",
    ),
    ("SPZ, .splat", "what our own writers of these formats make, read again."),
    ("SOG", "its quantisers, without its images: there is no size."),
];

/// The page as text.
pub(super) fn html(reports: &[BaseReport], figures: &[Figure], command: &str) -> String {
    let body = html! {
        header {
            h1 { "Where codecs fail" }
            p.lead {
                "Each case changes a scene or a sequence in a way that captures and editors do, more and more of it. \
                 This page shows what each tool makes of it, whether it says so when the result is bad, and what this \
                 encoder does instead; " a href="#terms" { "terms are explained at the end" } "."
            }
            p.narrow.note { "On a narrow screen, figures and tables scroll sideways." }
            nav aria-label="Scenes" {
                @for report in reports { a href=(format!("#{}", report.name)) { (report.name) } }
                a href="#terms" { "terms" }
            }
        }
        main {
            (summary(reports, command))
            @for report in reports { (base(report, figures)) }
            (terms())
        }
    };
    document("SplatStream: stability", &body)
}

fn summary(reports: &[BaseReport], command: &str) -> Markup {
    let mut headings = vec![Heading::Words("Tool")];
    headings.extend(Verdict::ALL.map(|verdict| Heading::Numbers(verdict.name())));
    let rows = html! {
        @for tool in Tool::ALL {
            tr {
                th scope="row" { (tool.name()) }
                @for verdict in Verdict::ALL { td { (count(reports, tool, verdict)) } }
            }
        }
    };
    html! {
        section {
            h2 { "In short" }
            (how_to_read(
                "each number counts cases and strengths; a silent failure is worse than a warning, as nobody looks again."
            ))
            (table(&headings, &rows))
            p.note { "All numbers are in " a href=(FILE) { (FILE) } "." }
            (made_by(command))
        }
    }
}

fn base(report: &BaseReport, figures: &[Figure]) -> Markup {
    html! {
        section.scene #(report.name) {
            h2 { (report.name) }
            p { (report.facts) }
            @for case in &report.cases { (part(report, case, figures)) }
        }
    }
}

fn part(report: &BaseReport, case: &CaseReport, figures: &[Figure]) -> Markup {
    let id = id(&report.name, case);
    let drawn = figures.iter().position(|figure| figure.id == id);
    html! {
        h3 { (case.case.title) }
        p { "The case: " (case.case.what) "." }
        @if let Some(drawing) = drawn.and_then(|at| figures.get(at..=at)) { (elements::figures(drawing)) }
        (rows(case))
    }
}

fn rows(report: &CaseReport) -> Markup {
    let mut axis = report.case.axis.to_owned();
    if let Some(first) = axis.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    let headings = [
        Heading::Words("Tool"),
        Heading::Numbers(&axis),
        Heading::Numbers("PSNR, dB"),
        Heading::Numbers("Without the case"),
        Heading::Numbers("Bits per Gaussian"),
        Heading::Words("Detected"),
        Heading::Words("Fallback"),
        Heading::Words("Verdict"),
    ];
    table(&headings, &html! { @for row in &report.rows { (line(row)) } })
}

fn line(row: &Row) -> Markup {
    let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}"));
    let words = |words: &str| if words.is_empty() { "–".to_owned() } else { words.to_owned() };
    html! {
        tr.baseline[row.verdict != Verdict::Ok] {
            th scope="row" { (row.tool.name()) }
            td { (strength(row.strength)) }
            td { (number(row.quality.map(|quality| quality.psnr))) }
            td { (number(Some(row.wanted.psnr))) }
            td { (number(row.bpg)) }
            td.text { (words(&row.detected)) }
            td.text { (words(&row.fallback)) }
            td.text { @if row.verdict == Verdict::Ok { (row.verdict.name()) } @else { strong { (row.verdict.name()) } } }
        }
    }
}

fn terms() -> Markup {
    html! {
        section #terms {
            h2 { "Terms" }
            dl.terms { @for (term, meaning) in TERMS { dt { (term) } dd { (meaning) } } }
        }
    }
}
