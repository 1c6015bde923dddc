//! Pieces that every part of the page uses.

use crate::numbers::rounded;
use crate::scene_chart::Metric;
use crate::svg::Figure;
use maud::{Markup, html};
use splatstream_render::metrics::Comparison;

/// Why there is no learned metric.
pub(super) const NOT_MEASURED: &str = "not measured: no weights given";

/// One sentence that says what to look at.
pub(crate) fn how_to_read(sentence: &str) -> Markup {
    html! { p.read { strong { "How to read: " } (sentence) } }
}

/// The command that makes a figure or a table.
pub(crate) fn made_by(command: &str) -> Markup {
    html! { p.made { "made by " code { @for word in command.split(' ') { span { (word) } " " } } } }
}

/// What stands over a column.
#[derive(Clone, Copy)]
pub(crate) enum Heading<'a> {
    /// Over words.
    Words(&'a str),
    /// Over numbers.
    Numbers(&'a str),
}

/// A table that scrolls where it is wider than the screen.
pub(crate) fn table(headings: &[Heading<'_>], rows: &Markup) -> Markup {
    html! {
        div.scroll tabindex="0" {
            table {
                thead {
                    tr {
                        @for heading in headings {
                            @match heading {
                                Heading::Words(name) => { th.text scope="col" { (name) } }
                                Heading::Numbers(name) => { th scope="col" { (name) } }
                            }
                        }
                    }
                }
                tbody { (rows) }
            }
        }
    }
}

/// Figures side by side, each with its title and its file.
pub(crate) fn figures(figures: &[Figure]) -> Markup {
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
    (metric.of)(figures).map_or_else(|| "–".to_owned(), |value| rounded(value, metric.decimals))
}

/// Bytes in kB or MB.
pub(super) fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.2} MB", bytes as f64 / 1e6),
    }
}

/// Gaussians per second.
pub(super) fn speed(speed: f64) -> String {
    match speed {
        0.0..1e6 => format!("{:.0} k/s", speed / 1e3),
        _ => format!("{:.2} M/s", speed / 1e6),
    }
}

/// A number with its sign, or a dash.
pub(super) fn signed(value: Option<f64>, unit: &str) -> String {
    let Some(value) = value else { return "–".to_owned() };
    let text = format!("{value:+.2}");
    let text = if ["+0.00", "-0.00"].contains(&text.as_str()) { "0.00".to_owned() } else { text };
    format!("{text}{unit}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_has_no_sign() {
        assert_eq!(signed(Some(-0.001), " dB"), "0.00 dB");
        assert_eq!(signed(Some(-1.5), " %"), "−1.50 %");
        assert_eq!(signed(Some(2.0), ""), "+2.00");
    }

    #[test]
    fn sizes_and_speeds_have_three_digits_or_so() {
        assert_eq!([999, 1500, 2_340_000].map(size), ["999 B", "1.5 kB", "2.34 MB"]);
        assert_eq!([21_700.0, 3.0e6].map(speed), ["22 k/s", "3.00 M/s"]);
    }
}
