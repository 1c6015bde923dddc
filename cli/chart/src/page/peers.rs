//! Other codecs on the same scene.

use super::elements::{Heading, how_to_read, size, speed, table};
use super::tables::{metric_cells, metric_headings};
use crate::peers::PeerPoint;
use crate::scene_chart::SceneChart;
use crate::variant_comparison::bytes_for_the_same;
use maud::{Markup, html};

/// What others did, and who is missing; nothing without either.
pub(super) fn part(chart: &SceneChart) -> Markup {
    html! {
        @if !chart.peers.is_empty() {
            h3 { "Other codecs" }
            (how_to_read(
                "each row is another codec's output, rendered and compared exactly as ours; the third column from the right says what \
                 SplatStream's baseline needs for the same PSNR, so below 100 % it is smaller."
            ))
            (results(chart))
            (commands(chart))
        }
        @if !chart.missing.is_empty() {
            h4 { "Not measured" }
            ul { @for missing in &chart.missing { li { strong { (missing.peer) } ": " (missing.why) } } }
        }
    }
}

fn results(chart: &SceneChart) -> Markup {
    let mut headings: Vec<Heading<'_>> = ["Codec", "Options"].map(Heading::Words).to_vec();
    headings.extend(["Size per frame", "Bits per Gaussian of the source"].map(Heading::Numbers));
    headings.extend(metric_headings(chart.has_learned()));
    headings.extend(["Our size at its PSNR", "Encoding", "Decoding"].map(Heading::Numbers));
    let anchor = chart.anchor();
    let ours = |peer: &PeerPoint| match bytes_for_the_same(&anchor, peer.rate_point()) {
        Some(percent) => format!("{percent:.0} %"),
        None => "outside our range".to_owned(),
    };
    let measured = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), speed);
    let body = html! {
        @for peer in &chart.peers {
            tr {
                th scope="row" { (peer.peer) }
                td.text { (peer.details) }
                td { (size(peer.bytes / u64::from(peer.frames.max(1)))) }
                td { (format!("{:.2}", peer.bpg)) }
                (metric_cells(chart.has_learned(), &peer.figures))
                td { (ours(peer)) }
                td { (measured(peer.encode_speed)) }
                td { (measured(peer.decode_speed)) }
            }
        }
    };
    table(&headings, &body)
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
