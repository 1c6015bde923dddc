//! The page: where each tool fails.

use super::FILE;
use super::figures::id;
use super::rows::{BaseReport, CaseReport, Count};
use crate::columns;
use crate::page::document;
use crate::page::elements::{self, how_to_read};
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
    html! {
        section {
            h2 { "In short" }
            (how_to_read(
                "each number counts cases and strengths; a silent failure is worse than a warning, as nobody looks again."
            ))
            (columns::html(&Count::of_all(reports)))
            p.note { "All numbers are in " a href=(FILE) { (FILE) } "." }
            p.note { "The command: " (elements::command_line(command)) }
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
        (columns::html(&case.rows))
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
