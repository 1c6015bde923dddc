//! The part of a scene.

use super::elements::{NOT_MEASURED, figures, how_to_read};
use super::{SceneFigures, gop, peers, pictures};
use crate::columns;
use crate::levels::COLUMNS;
use crate::numbers::grouped;
use crate::scene_chart::SceneChart;
use maud::{Markup, html};

/// Everything about a scene.
pub(super) fn section(chart: &SceneChart, drawn: &SceneFigures) -> Markup {
    html! {
        section.scene #(chart.name) {
            h2 { (chart.name) }
            p { (facts(chart)) }
            (rates(chart, drawn))
            @if let Some(shown) = &chart.pictures { (pictures::part(shown)) }
            (speeds(chart, drawn))
            @if let Some(measured) = &chart.gop { (gop::part(measured)) }
            (refinements(chart))
            (bandwidth(chart))
            h3 { "Where the bits go" }
            (how_to_read(
                "each bar is one quality, its length the bits that a coded Gaussian takes on average; the parts are \
                 attributes on one side and kinds of units on the other."
            ))
            (figures(&drawn.costs))
            (peers::part(chart))
        }
    }
}

/// What was measured, in a sentence.
pub(super) fn facts(chart: &SceneChart) -> Markup {
    let (frames, of_source) = chart.frames;
    let (cameras, width, height) = chart.cameras;
    let per_frame = chart.gaussians / frames.max(1) as u64;
    let of =
        if frames as u32 == of_source { String::new() } else { format!(" of {}", grouped(of_source.into())) };
    html! {
        (chart.source) ": " (frames) (of) @if frames == 1 && of_source == 1 { " frame, " } @else { " frames, " }
        (grouped(per_frame)) " Gaussians per frame, spherical harmonics of degree " (chart.sh_degree) "; "
        (cameras) @if cameras == 1 { " camera, " } @else { " cameras, " } (width) " × " (height) " pixels" @if let Some(fps) = chart.frame_rate() { "; " (fps) " frames per second" } "."
    }
}

fn rates(chart: &SceneChart, drawn: &SceneFigures) -> Markup {
    html! {
        h3 { "Quality against rate" }
        (how_to_read(
            "each coloured curve is one quality, its points the refinement levels, so the further right, the more \
             Gaussians were received; the dashed curve in the colour of the text joins the qualities with all Gaussians, a dashed coloured one shows a quality with \
             Gaussians in another order; up and to \
             the left is better, but for ST-LPIPS down and to the left."
        ))
        (figures(&drawn.rates))
        @for peer in chart.peers.iter().filter(|peer| peer.is_lossless()) {
            p.note { (peer.peer) " gives the pictures of the source; it is in the table of other codecs, not in the figures." }
        }
        @if !chart.has_learned() { p.note { "ST-LPIPS: " (NOT_MEASURED) "." } }
    }
}

fn speeds(chart: &SceneChart, drawn: &SceneFigures) -> Markup {
    html! {
        h3 { "Speed against size" }
        (how_to_read(
            "each point is a setting, at the PSNR that the baseline has: further left is faster, further down is smaller. The broad \
             band is the Pareto front; what lies off it is beaten by a setting that is no slower and no larger, which the table \
             names. Times are of all processors together. For encoding presets and fitting to pictures are compared, for decoding \
             everything; what leaves out a tool or a choice gives something up for it. The last figure shows what pictures are \
             worth that take so long to decode."
        ))
        (figures(&drawn.speeds))
        @for rows in &chart.fronts {
            @if rows.iter().any(|row| row.is_predicted) { h4 { "The first GOP with predicted frames" } }
            (columns::html(rows))
        }
        h3 { "What tools are worth" }
        (how_to_read(
            "each row is a variant of the encoder over all qualities, compared at the rate of the baseline; – where its rates do \
             not reach there. Speeds are by the clock."
        ))
        (columns::html(&chart.standings()))
    }
}

/// Refinement levels of intra frames.
fn refinements(chart: &SceneChart) -> Markup {
    html! {
        h3 { "Refinement levels" @if chart.gop.is_some() { ", every frame by itself" } }
        (how_to_read(
            "each row adds Gaussians to the row above: sizes are of all units up to the level, by frame (I0 is the first), \
             then together, then with headers and tables; bits are per Gaussian shown at the level."
        ))
        (columns::html(&chart.intra_levels()))
        @if chart.frames.0 > COLUMNS { p.note { "Frames after the first " (COLUMNS) " are in refinements.csv." } }
    }
}

/// Operating points of intra frames.
fn bandwidth(chart: &SceneChart) -> Markup {
    html! {
        @if chart.frame_rate().is_some() {
            h3 { "Operating points by bandwidth" @if chart.gop.is_some() { ", every frame by itself" } }
            (how_to_read(
                "each row is a way to play the stream, least bandwidth first: find the last row that your network \
                 carries; Mbit/s are 8 × the size of a GOP over its duration."
            ))
        } @else {
            h3 { "Operating points by size" }
            (how_to_read("each row is a way to show the scene, smallest first."))
        }
        (columns::html(&chart.intra_modes()))
    }
}
