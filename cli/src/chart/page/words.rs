//! Pieces that every part of the page uses.

use crate::chart::scene_chart::Metric;
use crate::chart::svg::Figure;
use maud::{Markup, html};
use splatstream_render::metrics::Comparison;

/// Why there is no learned metric.
pub(super) const NOT_MEASURED: &str = "not measured: no weights given";

/// One sentence that says what to look at.
pub(super) fn how_to_read(sentence: &str) -> Markup {
    html! { p.read { strong { "How to read: " } (sentence) } }
}

/// The command behind a figure or a table.
pub(super) fn made_by(command: &str) -> Markup {
    html! { p.made { "made by " code { (command) } } }
}

/// A table that scrolls where it is wider than the screen.
pub(super) fn table(headings: &[&str], rows: &Markup) -> Markup {
    html! {
        div.scroll tabindex="0" {
            table {
                thead { tr { @for heading in headings { th scope="col" { (heading) } } } }
                tbody { (rows) }
            }
        }
    }
}

/// Figures side by side, each with its title and its file.
pub(super) fn figures(figures: &[Figure]) -> Markup {
    html! {
        div.figures {
            @for drawing in figures {
                figure {
                    div.scroll tabindex="0" { (drawing.inline()) }
                    figcaption { (drawing.title) " · " a href=(format!("{}.svg", drawing.id)) { "SVG" } }
                }
            }
        }
    }
}

/// A metric with its decimals, or a dash.
pub(super) fn figure(metric: &Metric, figures: &Comparison) -> String {
    (metric.of)(figures).map_or_else(|| "–".to_owned(), |value| format!("{value:.*}", metric.decimals))
}

/// Bytes in kB or MB.
pub(super) fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.2} MB", bytes as f64 / 1e6),
    }
}

/// Gaussians a second.
pub(super) fn millions(speed: f64) -> String {
    format!("{:.2} M/s", speed / 1e6)
}

/// A number with its sign, or a dash.
pub(super) fn signed(value: Option<f64>, unit: &str) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:+.2}{unit}").replace('-', "−"))
}
