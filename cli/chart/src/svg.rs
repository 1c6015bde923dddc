//! Figures as SVG: a small set of what the page needs, drawn with the classes of `figure.css`.

pub(super) mod bars;
mod labels;
pub(super) mod plot;
mod scale;

use crate::report::File;
use maud::{Markup, PreEscaped, html};

/// Styles of every figure, for light and dark.
pub(super) const STYLE: &str = include_str!("svg/figure.css");

/// A drawing with a title and a description for those who cannot see it.
pub(super) struct Figure {
    /// Unique on the page, and the stem of its file.
    pub(super) id: String,
    /// One line.
    pub(super) title: String,
    /// What there is to see.
    pub(super) description: String,
    /// Units of the drawing.
    size: (f64, f64),
    body: Markup,
}

impl Figure {
    /// The figure as an element of the page.
    pub(super) fn inline(&self) -> Markup {
        let (title, description) = (format!("{}-title", self.id), format!("{}-desc", self.id));
        html! {
            svg.figure viewBox=(self.view_box()) role="img" aria-labelledby=(format!("{title} {description}")) {
                title id=(title) { (self.title) }
                desc id=(description) { (self.description) }
                (self.body)
            }
        }
    }

    /// The figure as a file.
    pub(super) fn file(&self) -> File {
        let (width, height) = self.size;
        let drawing = html! {
            svg.figure xmlns="http://www.w3.org/2000/svg" viewBox=(self.view_box()) width=(width) height=(height) role="img" {
                title { (self.title) }
                desc { (self.description) }
                style { (PreEscaped(STYLE)) }
                rect.paper width=(width) height=(height) {}
                (self.body)
            }
        };
        let text = drawing.into_string() + "\n";
        File { name: format!("{}.svg", self.id), bytes: text.into_bytes() }
    }

    fn view_box(&self) -> String {
        format!("0 0 {} {}", self.size.0, self.size.1)
    }
}

/// A coordinate with as many digits as can be seen.
fn coordinate(value: f64) -> String {
    format!("{:.1}", value)
}
