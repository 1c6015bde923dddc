//! Pieces that every part of the page uses.

use crate::svg::Figure;
use maud::{Markup, html};

/// Why there is no learned metric.
pub(super) const NOT_MEASURED: &str = "not measured: no weights given";

/// One sentence that says what to look at.
pub(crate) fn how_to_read(sentence: &str) -> Markup {
    html! { p.read { strong { "How to read: " } (sentence) } }
}

/// The command that makes the page, which breaks between words only.
pub(crate) fn command_line(command: &str) -> Markup {
    html! { code.command { @for word in command.split(' ') { span { (word) } " " } } }
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
