//! The part of a scene.

use super::elements::{NOT_MEASURED, figures, how_to_read};
use super::{SceneFigures, gop, peers, pictures, tables};
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
            @if let Some(measured) = &chart.gop { (gop::part(chart, measured)) }
            (tables::refinements(chart))
            (tables::bandwidth(chart))
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
        (cameras) " cameras, " (width) " × " (height) " pixels"
        @if chart.is_still() { "." } @else { "; " (chart.fps) " frames per second." }
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
        h3 { "Speed against accuracy" }
        (how_to_read(
            "each point is a variant of the encoder at equal rate: further right is faster; higher PSNR or lower \
             BD-rate is better; the broad band is the Pareto front, and what lies off it is beaten in both."
        ))
        (figures(&drawn.speeds))
        (tables::variants(chart))
    }
}
