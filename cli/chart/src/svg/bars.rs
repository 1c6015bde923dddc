//! Stacked bars: where the bits go.

use super::scale::Scale;
use super::{Figure, coordinate};
use crate::numbers::fixed;
use maud::{Markup, html};

const WIDTH: f64 = 560.0;
const LEFT: f64 = 118.0;
const RIGHT: f64 = 500.0;
const ROW: f64 = 34.0;
const BAR: f64 = 24.0;
/// Mean width of a letter of the legend.
const LETTER: f64 = 7.2;

/// A bar and its parts, in the order of the legend.
#[derive(Debug, Clone)]
pub(crate) struct Bar {
    /// What it stands for.
    pub(crate) name: String,
    /// Values of the parts.
    pub(crate) parts: Vec<f64>,
}

/// Bars with the same parts.
#[derive(Debug, Clone)]
pub(crate) struct Bars {
    /// Stem of its file.
    pub(crate) id: String,
    /// One line.
    pub(crate) title: String,
    /// What there is to see.
    pub(crate) description: String,
    /// Quantity and unit.
    pub(crate) x: String,
    /// Names of the parts.
    pub(crate) parts: Vec<String>,
    /// The bars, from the top.
    pub(crate) bars: Vec<Bar>,
}

impl Bars {
    /// Draws them. None without a bar.
    pub(crate) fn figure(&self) -> Option<Figure> {
        let total = |bar: &Bar| bar.parts.iter().sum::<f64>();
        let most = self.bars.iter().map(total).fold(0.0, f64::max);
        self.bars.first()?;
        let scale = Scale::from_zero(most, (LEFT, RIGHT));
        let (legend, top) = self.legend();
        let bottom = top + ROW * self.bars.len() as f64;
        let body = html! {
            (legend)
            @for (value, text) in scale.ticks(6) {
                @let x = coordinate(scale.place(value));
                path.grid d=(format!("M{x} {top}V{bottom}")) {}
                text.tick x=(x) y=(bottom + 17.0) text-anchor="middle" { (text) }
            }
            @for (row, bar) in self.bars.iter().enumerate() {
                (self.bar(bar, top + ROW * row as f64 + (ROW - BAR) / 2.0, &scale))
            }
            path.axis d=(format!("M{LEFT} {top}V{bottom}")) {}
            text.name x=((LEFT + RIGHT) / 2.0) y=(bottom + 38.0) text-anchor="middle" { (self.x) }
        };
        let (id, title, description) = (self.id.clone(), self.title.clone(), self.description.clone());
        Some(Figure { id, title, description, size: (WIDTH, bottom + 48.0), body })
    }

    /// Names of the parts in lines, and where they end.
    fn legend(&self) -> (Markup, f64) {
        let (mut x, mut y) = (14.0, 18.0);
        let mut places = Vec::new();
        for (style, name) in self.parts.iter().enumerate() {
            let width = 34.0 + LETTER * name.chars().count() as f64;
            if x + width > WIDTH {
                (x, y) = (14.0, y + 20.0);
            }
            places.push((style, name, x, y));
            x += width;
        }
        let legend = html! {
            @for (style, name, x, y) in places {
                rect class=(format!("fill c{style}")) x=(coordinate(x)) y=(coordinate(y - 10.0)) width="12" height="12" {}
                text.name x=(coordinate(x + 18.0)) y=(coordinate(y)) { (name) }
            }
        };
        (legend, y + 14.0)
    }

    fn bar(&self, bar: &Bar, top: f64, scale: &Scale) -> Markup {
        let mut sum = 0.0;
        let base = coordinate(top + BAR / 2.0 + 4.5);
        let parts: Vec<(usize, f64, f64, f64)> = bar
            .parts
            .iter()
            .enumerate()
            .map(|(style, &value)| {
                let start = scale.place(sum);
                sum += value;
                (style, value, start, scale.place(sum) - start)
            })
            .collect();
        html! {
            text.name x=(LEFT - 8.0) y=(base) text-anchor="end" { (bar.name) }
            @for (style, value, start, width) in parts {
                rect class=(format!("fill c{style}")) x=(coordinate(start)) y=(coordinate(top)) width=(coordinate((width - 1.0).max(0.3))) height=(BAR) {
                    title { (format!("{}: {}", self.parts.get(style).map_or("", String::as_str), fixed(value, 3))) }
                }
                @if width > 30.0 {
                    text.share x=(coordinate(start + width / 2.0)) y=(base) text-anchor="middle" { (format!("{value:.1}")) }
                }
            }
            text.name x=(coordinate(scale.place(sum) + 7.0)) y=(base) { (format!("{sum:.1}")) }
        }
    }
}
