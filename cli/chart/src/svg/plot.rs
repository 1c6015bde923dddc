//! Curves and points over two axes.

use super::labels::{Area, LETTER, Placer};
use super::scale::Scale;
use super::{Figure, coordinate};
use maud::{Markup, html};

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 400.0;
/// Most numbers on the ordinate.
const Y_TICKS: usize = 7;
/// Colours of `figure.css`.
const COLOURS: usize = 8;

/// How points are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Line {
    /// Drawn through.
    Solid,
    /// Dashed.
    Dashed,
    /// Not at all.
    None,
    /// A broad band behind everything: the best there is.
    Front,
}

/// A point and what is said about it.
#[derive(Debug, Clone)]
pub(crate) struct Dot {
    /// Abscissa and ordinate.
    pub(crate) at: (f64, f64),
    /// Words beside it.
    pub(crate) label: Option<String>,
    /// Words that appear when it is pointed at.
    pub(crate) hint: String,
}

/// Points that belong together.
#[derive(Debug, Clone)]
pub(crate) struct Series {
    /// One of eight colours, and the shape of the marks.
    pub(crate) style: usize,
    /// How the points are joined.
    pub(crate) line: Line,
    /// The points.
    pub(crate) dots: Vec<Dot>,
}

/// A figure with axes.
#[derive(Debug, Clone)]
pub(crate) struct Plot {
    /// Stem of its file.
    pub(crate) id: String,
    /// One line.
    pub(crate) title: String,
    /// What there is to see.
    pub(crate) description: String,
    /// Quantity and unit of the abscissa.
    pub(crate) x: String,
    /// Quantity and unit of the ordinate.
    pub(crate) y: String,
    /// The abscissa in another unit, along the top: factor and name.
    pub(crate) top: Option<(f64, String)>,
    /// What is drawn.
    pub(crate) series: Vec<Series>,
}

/// Both axes.
struct Axes {
    x: Scale,
    y: Scale,
    frame: Area,
}

impl Plot {
    /// Draws it. None without a point.
    pub(crate) fn figure(&self) -> Option<Figure> {
        let dots = || self.series.iter().flat_map(|series| &series.dots).map(|dot| dot.at);
        dots().next()?;
        let top = if self.top.is_some() { 46.0 } else { 14.0 };
        let y = Scale::over(dots().map(|(_, y)| y), false, (HEIGHT - 50.0, top));
        let widest = y.ticks(Y_TICKS).iter().map(|(_, text)| text.chars().count()).max().unwrap_or(0);
        // The name of the axis, a gap, and the numbers.
        let left = (widest as f64).mul_add(LETTER, 36.0).max(64.0);
        let frame = Area(left, top, WIDTH - 14.0, HEIGHT - 50.0);
        let axes = Axes { x: Scale::over(dots().map(|(x, _)| x), true, (frame.0, frame.2)), y, frame };
        let body = html! {
            (self.grid(&axes))
            @for series in &self.series { (curve(series, &axes)) }
            @for series in self.series.iter().filter(|series| series.line != Line::Front) { (marks(series, &axes)) }
            (self.labels(&axes))
        };
        let (id, title, description) = (self.id.clone(), self.title.clone(), self.description.clone());
        Some(Figure { id, title, description, size: (WIDTH, HEIGHT), body })
    }

    fn grid(&self, axes: &Axes) -> Markup {
        let Area(left, top, right, bottom) = axes.frame;
        let middle = ((left + right) / 2.0, (top + bottom) / 2.0);
        html! {
            @for (value, text) in axes.y.ticks(Y_TICKS) {
                @let y = coordinate(axes.y.place(value));
                path.grid d=(format!("M{left} {y}H{right}")) {}
                text.tick x=(left - 7.0) y=(y) dy="4" text-anchor="end" { (text) }
            }
            @for (value, text) in axes.x.ticks(8) {
                @let x = coordinate(axes.x.place(value));
                path.grid d=(format!("M{x} {top}V{bottom}")) {}
                text.tick x=(x) y=(bottom + 18.0) text-anchor="middle" { (text) }
            }
            path.axis d=(format!("M{left} {top}V{bottom}H{right}")) {}
            text.name x=(middle.0) y=(HEIGHT - 10.0) text-anchor="middle" { (self.x) }
            text.name transform=(format!("translate(16 {}) rotate(-90)", coordinate(middle.1))) text-anchor="middle" { (self.y) }
            @if let Some((factor, name)) = &self.top {
                @let scale = axes.x.times(*factor);
                path.axis d=(format!("M{left} {top}H{right}")) {}
                @for (value, text) in scale.ticks(8) {
                    @let x = coordinate(scale.place(value));
                    path.axis d=(format!("M{x} {top}v-4")) {}
                    text.tick x=(x) y=(top - 8.0) text-anchor="middle" { (text) }
                }
                text.name x=(middle.0) y=(top - 29.0) text-anchor="middle" { (name) }
            }
        }
    }

    /// Words beside points, all at once: so that they make room for each other.
    fn labels(&self, axes: &Axes) -> Markup {
        let Area(left, top, right, bottom) = axes.frame;
        let mut placer = Placer::new(Area(left + 2.0, top + 2.0, right, bottom - 2.0));
        for series in &self.series {
            let points: Vec<(f64, f64)> = series.dots.iter().map(|dot| axes.place(dot.at)).collect();
            points.iter().for_each(|&point| placer.point(point));
            if matches!(series.line, Line::Solid | Line::Dashed) {
                placer.line(&points);
            }
        }
        let labelled = self.series.iter().flat_map(|series| {
            series.dots.iter().filter_map(|dot| Some((series.style % COLOURS, dot.at, dot.label.as_ref()?)))
        });
        let placed: Vec<_> =
            labelled.map(|(style, at, label)| (style, label, placer.place(axes.place(at), label))).collect();
        html! {
            @for (_, _, place) in &placed {
                @if let Some(leader) = place.leader { path.leader d=(path(&leader)) {} }
            }
            @for (style, label, place) in &placed {
                text class=(format!("label fill c{style}")) x=(coordinate(place.start.0)) y=(coordinate(place.start.1)) { (label) }
            }
        }
    }
}

impl Axes {
    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.x.place(x), self.y.place(y))
    }
}

fn curve(series: &Series, axes: &Axes) -> Markup {
    let points: Vec<(f64, f64)> = series.dots.iter().map(|dot| axes.place(dot.at)).collect();
    let class = match series.line {
        Line::None => return html! {},
        Line::Solid => format!("line c{}", series.style % COLOURS),
        Line::Dashed => format!("line dashed c{}", series.style % COLOURS),
        Line::Front => "front".to_owned(),
    };
    html! { @if points.len() > 1 { path class=(class) d=(path(&points)) {} } }
}

fn path(points: &[(f64, f64)]) -> String {
    let step = |(place, (x, y)): (usize, &(f64, f64))| {
        format!("{}{} {}", if place == 0 { "M" } else { "L" }, coordinate(*x), coordinate(*y))
    };
    points.iter().enumerate().map(step).collect()
}

fn marks(series: &Series, axes: &Axes) -> Markup {
    let style = series.style % COLOURS;
    html! {
        @for dot in &series.dots {
            @let (x, y) = axes.place(dot.at);
            path class=(format!("mark fill c{style}")) transform=(format!("translate({x:.1} {y:.1})")) d=(mark(style)) {
                title { (dot.hint) }
            }
        }
    }
}

/// A shape for each style: colour is not all that tells curves apart.
fn mark(style: usize) -> &'static str {
    match style {
        0 => "M-4.6 0a4.6 4.6 0 1 0 9.2 0a4.6 4.6 0 1 0-9.2 0z",
        1 => "M-4.2-4.2h8.4v8.4h-8.4z",
        2 => "M0-5.4L5.2 3.8H-5.2z",
        3 => "M0-5.8L5.8 0L0 5.8L-5.8 0z",
        4 => "M0 5.4L5.2-3.8H-5.2z",
        5 => "M-1.8-5.4h3.6v3.6h3.6v3.6h-3.6v3.6h-3.6v-3.6h-3.6v-3.6h3.6z",
        6 => "M-5.6-2.2H5.6V2.2H-5.6z",
        _ => "M-6 0a6 6 0 1 0 12 0a6 6 0 1 0-12 0zM-3 0a3 3 0 1 1 6 0a3 3 0 1 1-6 0z",
    }
}
