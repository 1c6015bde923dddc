//! The first GOP of a sequence, with predicted frames: the two tables of the paper, and what tools are worth.

use super::elements::{Heading, figure, how_to_read, signed, size, table};
use super::tables::{metric_cells, metric_headings, mode_cells};
use crate::gop::{Gop, Level, ToolRow};
use crate::numbers::grouped;
use crate::scene_chart::{METRICS, SceneChart};
use crate::tables::Mode;
use maud::{Markup, html};

/// All three tables.
pub(super) fn part(chart: &SceneChart, gop: &Gop) -> Markup {
    html! {
        h3 { "Operating points of the first GOP" }
        (how_to_read(
            "each row is a way to play the stream: a client starts with the first spatial layer of the intra frame (I0), \
             completes that frame, then adds predicted frames (P, B), first at half the frame rate, then all of them \
             at ever more refinements; the bandwidth is 8 × the size over the duration of the GOP."
        ))
        (modes(chart, gop))
        h3 { "Refinement levels of predicted frames" }
        (how_to_read(
            "each row adds Gaussians to the row above: sizes are of all units up to the level; bits are per Gaussian \
             received. Carried: Gaussians that have not come are taken from the intra frame, as our decoder shows \
             them. Subset: each of these frames by itself, its largest and most opaque Gaussians and nothing else, \
             as the paper shows them."
        ))
        (levels(chart, gop))
        h3 { "What the tools of predicted frames are worth" }
        (how_to_read(
            "each row codes the same GOP with one tool left out or another choice of predictors; sizes and metrics \
             are of predicted frames, everything decoded."
        ))
        (tools(chart, gop))
        @if !gop.ablation.is_empty() {
            h3 { "What predictors of new Gaussians are worth" }
            (how_to_read(
                "each row codes the same GOP with another choice of predictors: one for every new Gaussian, or what \
                 saves bits (auto); below, the network with one of its parts changed or left out, trained again. Bits of \
                 dc and sh are per new Gaussian, the intra frame included; the network itself is counted apart."
            ))
            (ablation(chart, gop))
        }
    }
}

fn modes(chart: &SceneChart, gop: &Gop) -> Markup {
    let mut headings: Vec<Heading<'_>> = ["Mode", "Units"].map(Heading::Words).to_vec();
    headings.extend([Heading::Numbers("Frames shown"), Heading::Words("Playback")]);
    let numbers = ["Refine\u{ad}ment", "Size", "Required bandwidth", "Gaussians", "Bits per Gaussian"];
    headings.extend(numbers.map(Heading::Numbers));
    headings.extend(metric_headings(chart.has_learned()));
    let row = |mode: &Mode| {
        html! {
            tr {
                (mode_cells(mode, false))
                td { (format!("{:.2}", mode.bpg())) }
                (metric_cells(chart.has_learned(), &mode.figures))
            }
        }
    };
    table(&headings, &html! { @for mode in &gop.modes { (row(mode)) } })
}

fn levels(chart: &SceneChart, gop: &Gop) -> Markup {
    let names = gop.levels.first().map_or(&[][..], |level| level.units.as_slice());
    let frames: Vec<String> = names.iter().map(|(name, _)| format!("{name} size")).collect();
    let mut headings = vec![Heading::Words("Level")];
    headings.extend(frames.iter().map(|name| Heading::Numbers(name)));
    let rest = ["Added size", "Total size", "Gaussians", "Cumulative bits per Gaussian"];
    headings.extend(rest.map(Heading::Numbers));
    headings.extend(metric_headings(chart.has_learned()));
    let predicted = ["PSNR, predicted, carried", "SSIM", "PSNR, predicted, subset", "SSIM"];
    headings.extend(predicted.map(Heading::Numbers));
    let [psnr, ssim, _] = &METRICS;
    let row = |level: &Level| {
        html! {
            tr {
                th scope="row" { (level.percent) " %" }
                @for (_, bytes) in &level.units { td { (size(*bytes)) } }
                td { (size(level.added)) }
                td { (size(level.total)) }
                td { (grouped(level.gaussians)) }
                td { (format!("{:.2}", level.bpg)) }
                (metric_cells(chart.has_learned(), &level.all))
                @for figures in [&level.inter, &level.subset.figures] {
                    td { (figure(psnr, figures)) }
                    td { (figure(ssim, figures)) }
                }
            }
        }
    };
    table(&headings, &html! { @for level in &gop.levels { (row(level)) } })
}

fn tools(chart: &SceneChart, gop: &Gop) -> Markup {
    let mut headings = vec![Heading::Words("Tools")];
    headings.extend(["Size", "Bytes per Gaussian", "More"].map(Heading::Numbers));
    headings.extend(metric_headings(chart.has_learned()));
    let more = |tool: &ToolRow| gop.tools.first().map(|everything| tool.more_than(everything));
    table(
        &headings,
        &html! {
            @for (place, tool) in gop.tools.iter().enumerate() {
                tr.baseline[place == 0] {
                    th scope="row" { (tool.name) }
                    td { (size(tool.bytes)) }
                    td { (format!("{:.3}", tool.bytes_per_gaussian())) }
                    td { (signed(more(tool), " %")) }
                    (metric_cells(chart.has_learned(), &tool.figures))
                }
            }
        },
    )
}

fn ablation(chart: &SceneChart, gop: &Gop) -> Markup {
    let mut headings = vec![Heading::Words("Predictors")];
    let numbers = ["Size", "Network", "Learned", "Bits of dc", "Bits of sh", "Decoding"];
    headings.extend(numbers.map(Heading::Numbers));
    headings.extend(metric_headings(chart.has_learned()));
    table(
        &headings,
        &html! {
            @for row in &gop.ablation {
                tr {
                    th scope="row" { (row.name) }
                    td { (size(row.bytes)) }
                    td { (size(row.network_bytes)) }
                    td { (format!("{:.1} %", row.learned_percent)) }
                    td { (format!("{:.3}", row.dc_bits)) }
                    td { (format!("{:.3}", row.sh_bits)) }
                    td { (format!("{:.0} ms", row.decode_ms)) }
                    (metric_cells(chart.has_learned(), &row.figures))
                }
            }
        },
    )
}
