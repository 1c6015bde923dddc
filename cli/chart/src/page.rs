//! The page: one file with everything in it, for people who have read nothing else.

pub(super) mod elements;
mod glossary;
mod gop;
mod peers;
mod pictures;
mod scene;

use super::csv_files;
use super::scene_chart::SceneChart;
use super::svg::{Figure, STYLE as FIGURE_STYLE};
use super::sweep::{Group, Sweep};
use crate::columns;
use crate::summary::Baseline;
use elements::NOT_MEASURED;
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page/style.css");

/// The figures of a scene.
pub(super) struct SceneFigures {
    /// Quality against rate.
    pub(super) rates: Vec<Figure>,
    /// Size and quality against speed.
    pub(super) speeds: Vec<Figure>,
    /// Where the bits go.
    pub(super) costs: Vec<Figure>,
}

impl SceneFigures {
    /// All of them.
    pub(super) fn all(&self) -> impl Iterator<Item = &Figure> {
        self.rates.iter().chain(&self.speeds).chain(&self.costs)
    }
}

/// A page with nothing from outside, as text.
pub(super) fn document(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(FIGURE_STYLE)) }
            }
            body { (body) }
        }
    };
    page.into_string() + "\n"
}

/// What the page is made of.
pub(super) struct Page<'a> {
    /// The scenes.
    pub(super) charts: &'a [SceneChart],
    /// The figures of each.
    pub(super) figures: &'a [SceneFigures],
    /// What was swept.
    pub(super) sweep: &'a Sweep,
    /// The command that made it.
    pub(super) command: &'a str,
}

impl Page<'_> {
    /// The page as text.
    pub(super) fn html(&self) -> String {
        let names: Vec<&str> = self.charts.iter().map(|chart| chart.name.as_str()).collect();
        let body = html! {
            (self.top())
            main {
                (self.summary())
                (self.conditions())
                @for (chart, figures) in self.charts.iter().zip(self.figures) {
                    (scene::section(chart, figures))
                }
                (glossary::section())
            }
        };
        document(&format!("SplatStream: {}", names.join(", ")), &body)
    }

    fn top(&self) -> Markup {
        html! {
            header {
                h1 { "What quality costs" }
                p.lead {
                    "SplatStream compresses scenes made of 3D Gaussians. This page shows how large the compressed \
                     scenes are, how close they come to their source, and how fast that is. It was measured by \
                     one command on one machine; "
                    a href="#terms" { "terms are explained at the end" } "."
                }
                p.narrow.note { "On a narrow screen, figures and tables scroll sideways." }
                nav aria-label="Scenes" {
                    @for chart in self.charts { a href=(format!("#{}", chart.name)) { (chart.name) } }
                    a href="#conditions" { "conditions" }
                    a href="#terms" { "terms" }
                }
            }
        }
    }

    fn summary(&self) -> Markup {
        let rows: Vec<Baseline> = self.charts.iter().filter_map(Baseline::new).collect();
        html! {
            section {
                h2 { "In short" }
                (elements::how_to_read(
                    "each row is one scene with the baseline settings and all Gaussians sent: fewer bits and \
                     more dB are better; speeds are thousands (k) or millions (M) of Gaussians per second."
                ))
                (columns::html(&rows))
                @if !self.charts.iter().any(SceneChart::has_learned) {
                    p.note { "ST-LPIPS, the learned metric: " (NOT_MEASURED) "." }
                }
            }
        }
    }

    fn conditions(&self) -> Markup {
        let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
        let threads = rayon::current_num_threads();
        let (system, processor) = (std::env::consts::OS, std::env::consts::ARCH);
        let build = if cfg!(debug_assertions) { ", not built for speed (debug)" } else { "" };
        let list = |group: Group| -> Vec<String> {
            let of_group = self.sweep.variants.iter().filter(|variant| variant.group == group);
            of_group.map(|variant| variant.name.clone()).collect()
        };
        let qualities: Vec<String> =
            self.sweep.qualities.iter().map(|quality| quality.name().to_owned()).collect();
        let percents: Vec<String> =
            self.sweep.refinements.iter().map(|percent| format!("{percent} %")).collect();
        html! {
            section #conditions {
                h2 { "Conditions" }
                dl.facts {
                    dt { "Command" } dd { (elements::command_line(self.command)) }
                    dt { "Program" } dd { "splatstream " (env!("CARGO_PKG_VERSION")) (build) }
                    dt { "Machine" } dd { (cores) " processors (" (system) ", " (processor) "), threads used: " (threads) }
                    dt { "Timing" } dd {
                        "median of " (self.sweep.repeat) " at quality " (self.sweep.quality().name()) ", once at others; by the clock, but for speed against size, where \
                         it is processor time of all threads, and an encoding of more than 2 seconds is timed once for each of two qualities. Encoding is from Gaussians in memory to bytes in \
                         memory; decoding is back again, every digest verified. Neither reads or writes a file."
                    }
                    dt { "Pictures" } dd {
                        "source and decoded scene are rendered by the same renderer over black; metrics compare \
                         the two renderings, not photographs, and are means over all cameras and frames."
                    }
                    @for chart in self.charts {
                        dt { (chart.name) } dd { (scene::facts(chart)) }
                    }
                    dt { "Baseline" } dd { (self.sweep.variants.iter().map(|variant| variant.name.as_str()).take(1).collect::<String>()) ", quality " (self.sweep.quality().name()) }
                    dt { "Swept" } dd {
                        "qualities " (qualities.join(", ")) "; refinement levels " (percents.join(", "))
                        @if !list(Group::Without).is_empty() { "; " (list(Group::Without).join(", ")) }
                        ". All of these code every frame by itself; spatial and temporal layers and predictors are in the \
                         tables of the first GOP of each sequence."
                    }
                    dt { "Speed against size" } dd {
                        (self.sweep.efforts.iter().map(|variant| variant.name.as_str()).collect::<Vec<_>>().join("; "))
                        "; each for 2 dB less and 2 dB more than the quality of comparison."
                    }
                    dt { "Numbers" } dd {
                        @for name in csv_files::names() {
                            a href=(name) { (name) } " "
                        }
                        "lie beside this page, as does every figure (SVG) and picture (PNG). All but the timings are \
                         the same on every machine."
                    }
                }
            }
        }
    }
}
