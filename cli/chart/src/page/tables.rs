//! The tables of a scene.

use super::elements::{Heading, figure, how_to_read, signed, size, speed, table};
use crate::numbers::grouped;
use crate::scene_chart::{METRICS, SceneChart};
use crate::sweep::Group;
use crate::tables::Mode;
use crate::variant_comparison::Standing;
use maud::{Markup, html};
use splatstream_render::metrics::Comparison;

/// Frames whose units have columns of their own.
const COLUMNS: usize = 4;

/// Headings of the metrics that were measured.
pub(super) fn metric_headings<'a>(has_learned: bool) -> impl Iterator<Item = Heading<'a>> {
    let measured = METRICS.iter().zip(["PSNR, dB", "SSIM", "ST-LPIPS"]);
    measured
        .filter(move |(metric, _)| has_learned || !metric.is_learned())
        .map(|(_, name)| Heading::Numbers(name))
}

/// The cells under them.
pub(super) fn metric_cells(has_learned: bool, figures: &Comparison) -> Markup {
    html! {
        @for metric in METRICS.iter().filter(|metric| has_learned || !metric.is_learned()) {
            td { (figure(metric, figures)) }
        }
    }
}

/// Refinement levels of intra frames.
pub(super) fn refinements(chart: &SceneChart) -> Markup {
    let rows = chart.refinement_rows();
    let columns = rows.first().map_or(0, |row| row.unit_bytes.len()).min(COLUMNS);
    let frames: Vec<String> = (0..columns).map(|frame| format!("I{frame} size")).collect();
    let mut headings = vec![Heading::Words("Level")];
    headings.extend(frames.iter().map(|name| Heading::Numbers(name)));
    let rest = ["Added size", "Total size", "Gaussians", "Cumulative bits per Gaussian"];
    headings.extend(rest.map(Heading::Numbers));
    headings.extend(metric_headings(chart.has_learned()));
    let body = html! {
        @for row in &rows {
            tr {
                th scope="row" { (row.percent) " %" }
                @for bytes in row.unit_bytes.iter().take(columns) { td { (size(*bytes)) } }
                td { (size(row.added_bytes)) }
                td { (size(row.total_bytes)) }
                td { (grouped(row.gaussians)) }
                td { (format!("{:.2}", row.bpg)) }
                (metric_cells(chart.has_learned(), &row.figures))
            }
        }
    };
    html! {
        h3 { "Refinement levels" @if chart.gop.is_some() { ", every frame by itself" } }
        (how_to_read(
            "each row adds Gaussians to the row above: sizes are of all units up to the level, by frame (I0 is the first), \
             then together, then with headers and tables; bits are per Gaussian shown at the level."
        ))
        (table(&headings, &body))
        @if chart.frames.0 > COLUMNS { p.note { "Frames after the first " (COLUMNS) " are in refinements.csv." } }
    }
}

/// Operating points of intra frames; those of a still take no bandwidth.
pub(super) fn bandwidth(chart: &SceneChart) -> Markup {
    let is_still = chart.is_still();
    let mut headings: Vec<Heading<'_>> = ["Mode", "Units"].map(Heading::Words).to_vec();
    if !is_still {
        headings.extend([Heading::Numbers("Frames shown"), Heading::Words("Playback")]);
    }
    headings
        .extend(["Refine\u{ad}ment", if is_still { "Size" } else { "Size per GOP" }].map(Heading::Numbers));
    if !is_still {
        headings.push(Heading::Numbers("Required bandwidth"));
    }
    headings.push(Heading::Numbers("Gaussians"));
    headings.extend(metric_headings(chart.has_learned()));
    let body = html! {
        @for row in &chart.bandwidth_rows() {
            tr {
                (mode_cells(row, is_still))
                (metric_cells(chart.has_learned(), &row.figures))
            }
        }
    };
    html! {
        h3 {
            "Operating points by " (if is_still { "size" } else { "bandwidth" })
            @if chart.gop.is_some() { ", every frame by itself" }
        }
        @if is_still {
            (how_to_read("each row is a part of the stream that shows the scene, the smallest first."))
        } @else {
            (how_to_read(
                "each row is a way to play the stream, least bandwidth first: find the last row that your network \
                 carries; the bandwidth is 8 × the size of a GOP over its duration."
            ))
        }
        (table(&headings, &body))
    }
}

/// What a mode of playback is, and what it takes.
pub(super) fn mode_cells(mode: &Mode, is_still: bool) -> Markup {
    html! {
        th scope="row" { (mode.name) }
        td.text { (mode.units) }
        @if !is_still {
            td { (mode.frames) }
            td.text { (mode.playback) }
        }
        td { @if let Some(percent) = mode.percent { (percent) " %" } @else { "–" } }
        td { (size(mode.bytes)) }
        @if !is_still { td { (format!("{:.1} Mbit/s", mode.mbit_s)) } }
        td { (grouped(mode.gaussians)) }
    }
}

/// Variants beside the baseline.
pub(super) fn variants(chart: &SceneChart) -> Markup {
    let standings = chart.standings();
    let base = standings.first().and_then(|standing| standing.psnr_at_rate);
    let gain = |standing: &Standing| Some(standing.psnr_at_rate? - base?);
    let numbers = ["Encoding", "Decoding", "PSNR at the baseline's rate", "Against the baseline", "BD-rate"];
    let mut headings = vec![Heading::Words("Variant")];
    headings.extend(numbers.map(Heading::Numbers));
    let body = html! {
        @for standing in &standings {
            tr.baseline[standing.group == Group::Baseline] {
                th scope="row" { (standing.name) @if standing.group == Group::Baseline { " (baseline)" } }
                td { (speed(standing.encode_speed)) }
                td { (speed(standing.decode_speed)) }
                td { (standing.psnr_at_rate.map_or_else(|| "not reached".to_owned(), |psnr| format!("{psnr:.2} dB"))) }
                td { (signed(gain(standing), " dB")) }
                td { (signed(standing.bd_rate, " %")) }
            }
        }
    };
    table(&headings, &body)
}
