//! What the encoder says that its choices save, beside what they save.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

#[path = "common/mod.rs"]
mod common;

use common::{builtin, encoded};
use splatstream_encoder::{Basis, Report, Saving, Settings, ShChoice, Structure, Tool, Tools};
use splatstream_files::builtin::BuiltinScene;

fn saving(report: &Report, tool: Tool) -> Saving {
    let found: Vec<&Saving> = report.savings.iter().filter(|saving| saving.tool == tool).collect();
    assert_eq!(found.len(), 1, "{tool:?} in {:?}", report.savings);
    *found[0]
}

/// Bits per Gaussian of the first frame.
fn bits(report: &Report) -> f64 {
    8.0 * report.coded[0].bytes as f64 / f64::from(report.coded[0].gaussians)
}

#[test]
fn tables_of_the_refinement_before_save_what_is_told() {
    let frames = vec![builtin(3_000, 1)];
    let (_, with) = encoded(frames.clone(), &Settings::default());
    let tools = Tools { table_reuse: false, ..Tools::default() };
    let (_, without) = encoded(frames, &Settings { tools, ..Settings::default() });
    let told = saving(&with, Tool::TableReuse);
    let real = bits(&without) - bits(&with);
    assert!(
        told.basis == Basis::Measured && (told.bits - real).abs() < 0.02 && real > 0.0,
        "{told:?} {real}"
    );
    assert_eq!(saving(&without, Tool::TableReuse).bits, 0.0);
}

#[test]
fn contexts_save_nearly_what_is_estimated() {
    let frames = vec![builtin(20_000, 0)];
    let (_, with) = encoded(frames.clone(), &Settings::default());
    let tools = Tools { contexts: false, ..Tools::default() };
    let (_, without) = encoded(frames, &Settings { tools, ..Settings::default() });
    let (told, real) = (saving(&with, Tool::Contexts), bits(&without) - bits(&with));
    assert!(told.basis == Basis::Estimated && real > 0.3, "{told:?} {real}");
    assert!((told.bits - real).abs() < 0.15 * real + 0.05, "{told:?} {real}");
}

#[test]
fn refinements_cost_nearly_what_is_estimated() {
    let frames = vec![builtin(20_000, 0)];
    let (_, five) = encoded(frames.clone(), &Settings::default());
    let (_, one) = encoded(frames, &Settings { refinements: vec![100], ..Settings::default() });
    let (told, real) = (saving(&five, Tool::Refinements).bits, bits(&one) - bits(&five));
    assert!(told < 0.0 && real < 0.0 && (told - real).abs() < 0.5 * real.abs(), "{told} {real}");
    assert!(one.savings.iter().all(|saving| saving.tool != Tool::Refinements));
}

#[test]
fn layers_cost_what_is_told() {
    let scene = BuiltinScene { gaussians: 1_000, frames: 2, sh_degree: 0, ..BuiltinScene::default() };
    let frames: Vec<_> = (0..2).map(|number| scene.frame(number)).collect();
    let layered = Settings {
        structure: Structure::Predicted { layers: 1 },
        spatial_layers: 2,
        gop: 2,
        ..Settings::default()
    };
    let (_, report) = encoded(frames, &layered);
    let told = saving(&report, Tool::SpatialLayers);
    assert!(told.basis == Basis::Measured && (-12.0..0.0).contains(&told.bits), "{told:?}");
    // Positions of the lowest layer are coarser than those that all layers add up to.
    let refinements = saving(&report, Tool::Refinements).bits;
    assert!((-8.0..-0.5).contains(&refinements), "{refinements}");
}

#[test]
fn the_coding_of_harmonics_is_weighed_against_the_other() {
    let frames = vec![builtin(4_000, 2)];
    let (_, chosen) = encoded(frames.clone(), &Settings::default());
    assert!(saving(&chosen, Tool::ShCoding).bits >= 0.0);
    let other = match chosen.sh_codebook_entries {
        0 => ShChoice::VectorQuantised,
        _ => ShChoice::Coefficients,
    };
    let (_, forced) = encoded(frames, &Settings { sh: other, ..Settings::default() });
    // Only the one that is chosen by itself is compared with the other.
    let of_forced = forced.savings.iter().find(|saving| saving.tool == Tool::ShCoding);
    assert!(of_forced.is_none_or(|saving| saving.bits <= 0.0), "{of_forced:?}");
    assert!(saving(&chosen, Tool::ShTransform).bits > 0.0);
}

#[test]
fn steps_that_follow_from_gaussians_are_estimated_where_they_are_fitted() {
    let (_, fitted) = encoded(vec![builtin(3_000, 0)], &Settings { psnr: Some(45.0), ..Settings::default() });
    assert!(saving(&fitted, Tool::AdaptiveSteps).bits.is_finite());
    let (_, given) = encoded(vec![builtin(3_000, 0)], &Settings::default());
    assert!(given.savings.iter().all(|saving| saving.tool != Tool::AdaptiveSteps));
}
