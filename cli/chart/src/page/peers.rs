//! Other codecs on the same scene.

use super::elements::how_to_read;
use crate::columns;
use crate::scene_chart::SceneChart;
use maud::{Markup, html};

/// What others did, and who is missing; nothing without either.
pub(super) fn part(chart: &SceneChart) -> Markup {
    html! {
        @if !chart.peers.is_empty() {
            h3 { "Other codecs" }
            (how_to_read(
                "each row is another codec's output, rendered and compared exactly as ours; the last column says what SplatStream's \
                 baseline needs for the same PSNR, so below 100 % it is smaller; – outside the range of its qualities."
            ))
            (columns::html(&chart.peers))
            (commands(chart))
        }
        @if !chart.missing.is_empty() {
            h4 { "Not measured" }
            ul { @for missing in &chart.missing { li { strong { (missing.peer) } ": " (missing.why) } } }
        }
    }
}

/// How their results were made and timed.
fn commands(chart: &SceneChart) -> Markup {
    html! {
        details {
            summary { "How these were made and timed" }
            ul {
                @for peer in &chart.peers {
                    li {
                        strong { (peer.peer) } " " (peer.details) ": " code { (peer.command) }
                        @if !peer.timing.is_empty() { ", timed " (peer.timing) }
                        @if (peer.judged as u32) < peer.frames { ", " (peer.judged) " of " (peer.frames) " frames judged" }
                    }
                }
            }
        }
    }
}
