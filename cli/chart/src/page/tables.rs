//! The tables of a scene.

use super::elements::{Heading, NOT_MEASURED, figure, how_to_read, made_by, signed, size, speed, table};
use crate::numbers::grouped;
use crate::scene_chart::{METRICS, SceneChart};
use crate::sweep::Group;
use crate::tables::Mode;
use crate::variant_comparison::Standing;
use maud::{Markup, html};
use splatstream_render::metrics::Comparison;

/// Frames whose units have columns of their own.
const COLUMNS: usize = 4;

/// Headings of the metrics.
pub(super) const METRIC_HEADINGS: [Heading<'_>; 3] =
    [Heading::Numbers("PSNR, dB"), Heading::Numbers("SSIM"), Heading::Numbers("ST-LPIPS")];

/// The metrics of row `row` of `rows`; one cell for all rows says why there is no learned metric.
pub(super) fn metric_cells(chart: &SceneChart, figures: &Comparison, row: usize, rows: usize) -> Markup {
    let [psnr, ssim, learned] = &METRICS;
    html! {
        td { (figure(psnr, figures)) }
        td { (figure(ssim, figures)) }
        @if chart.has_learned() {
            td { (figure(learned, figures)) }
        } @else if row == 0 {
            td.absent rowspan=(rows) { (NOT_MEASURED) }
        }
    }
}

/// Refinement levels of intra frames.
pub(super) fn refinements(chart: &SceneChart, command: &str) -> Markup {
    let rows = chart.refinement_rows();
    let columns = rows.first().map_or(0, |row| row.unit_bytes.len()).min(COLUMNS);
    let frames: Vec<String> = (0..columns).map(|frame| format!("I{frame} size")).collect();
    let mut headings = vec![Heading::Words("Level")];
    headings.extend(frames.iter().map(|name| Heading::Numbers(name)));
    let rest = ["Added size", "Total size", "Gaussians", "Cumulative bits per Gaussian"];
    headings.extend(rest.map(Heading::Numbers));
    headings.extend(METRIC_HEADINGS);
    let body = html! {
        @for (place, row) in rows.iter().enumerate() {
            tr {
                th scope="row" { (row.percent) " %" }
                @for bytes in row.unit_bytes.iter().take(columns) { td { (size(*bytes)) } }
                td { (size(row.added_bytes)) }
                td { (size(row.total_bytes)) }
                td { (grouped(row.gaussians)) }
                td { (format!("{:.2}", row.bpg)) }
                (metric_cells(chart, &row.figures, place, rows.len()))
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
        (made_by(command))
    }
}

/// Operating points of intra frames.
pub(super) fn bandwidth(chart: &SceneChart, command: &str) -> Markup {
    let rows = chart.bandwidth_rows();
    let mut headings: Vec<Heading<'_>> = ["Mode", "Units"].map(Heading::Words).to_vec();
    headings.extend([Heading::Numbers("Frames shown"), Heading::Words("Playback")]);
    let numbers = ["Refine\u{ad}ment", "Size per GOP", "Required bandwidth", "Gaussians"];
    headings.extend(numbers.map(Heading::Numbers));
    headings.extend(METRIC_HEADINGS);
    let body = html! {
        @for (place, row) in rows.iter().enumerate() {
            tr {
                (mode_cells(row))
                (metric_cells(chart, &row.figures, place, rows.len()))
            }
        }
    };
    html! {
        h3 { "Operating points by bandwidth" @if chart.gop.is_some() { ", every frame by itself" } }
        (how_to_read(
            "each row is a way to play the stream, least bandwidth first: find the last row that your network carries; \
             the bandwidth is 8 × the size of a GOP over its duration."
        ))
        (table(&headings, &body))
        (made_by(command))
    }
}

/// What a mode of playback is, and what it takes.
pub(super) fn mode_cells(mode: &Mode) -> Markup {
    html! {
        th scope="row" { (mode.name) }
        td.text { (mode.units) }
        td { (mode.frames) }
        td.text { (mode.playback) }
        td { @if let Some(percent) = mode.percent { (percent) " %" } @else { "–" } }
        td { (size(mode.bytes)) }
        td { (format!("{:.1} Mbit/s", mode.mbit_s)) }
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
