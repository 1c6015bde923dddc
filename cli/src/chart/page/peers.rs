//! Other codecs on the same scene.

use super::tables::{metric_cells, metric_headings};
use super::words::{how_to_read, made_by, millions, size, table};
use crate::chart::peers::PeerPoint;
use crate::chart::scene_chart::SceneChart;
use crate::chart::standing::bytes_for_the_same;
use maud::{Markup, html};

/// What others did, and who is missing; nothing without either.
pub(super) fn part(chart: &SceneChart, command: &str) -> Markup {
    html! {
        @if !chart.peers.is_empty() {
            h3 { "Other codecs" }
            (how_to_read(
                "each row is another codec's output, rendered and compared exactly as ours; the last but two columns say what \
                 SplatStream's baseline needs for the same PSNR, so below 100 % it is smaller."
            ))
            (results(chart))
            (commands(chart))
            (made_by(command))
        }
        @if !chart.missing.is_empty() {
            h4 { "Not measured" }
            ul { @for missing in &chart.missing { li { strong { (missing.peer) } ": " (missing.why) } } }
        }
    }
}

fn results(chart: &SceneChart) -> Markup {
    let [psnr, ssim, learned] = metric_headings(chart);
    let headings = [
        "Codec",
        "Options",
        "Size per frame",
        "Bits per Gaussian of the source",
        &psnr,
        &ssim,
        &learned,
        "Our size at its PSNR",
        "Encoding",
        "Decoding",
    ];
    let anchor = chart.anchor();
    let ours = |peer: &PeerPoint| match bytes_for_the_same(&anchor, peer.rate_point()) {
        Some(percent) => format!("{percent:.0} %"),
        None => "PSNR outside our qualities".to_owned(),
    };
    let speed = |speed: Option<f64>| speed.map_or_else(|| "–".to_owned(), millions);
    let body = html! {
        @for peer in &chart.peers {
            tr {
                th scope="row" { (peer.peer) }
                td.text { (peer.details) }
                td { (size(peer.bytes / u64::from(peer.frames.max(1)))) }
                td { (format!("{:.2}", peer.bpg)) }
                (metric_cells(&peer.figures))
                td { (ours(peer)) }
                td { (speed(peer.encode_speed)) }
                td { (speed(peer.decode_speed)) }
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
