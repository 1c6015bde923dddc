//! Gaussians that are left out because pictures hardly miss them.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is a failed test")]

#[path = "common/mod.rs"]
mod common;

use common::{builtin, decoded, encoded, sequence, strict};
use splatstream_decoder::output::to_gaussians;
use splatstream_encoder::{Encoder, Error, Plan, Preset, Settings, Structure, encode, plan};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, ring};
use splatstream_render::{ReferencePictures, metrics};

fn settings(prune: Option<f32>) -> Settings {
    Settings { preset: Preset::Fast, prune, ..Settings::default() }
}

/// A scene with as many Gaussians more that hardly show: as small as dust and as thin as glass.
fn with_dust(frame: &GaussianFrame) -> GaussianFrame {
    let count = frame.len();
    let twice: Vec<u32> = (0..count as u32).chain(0..count as u32).collect();
    let mut dusty = frame.select(&twice);
    let planes = dusty.planes_mut();
    planes.log_scale.into_iter().for_each(|plane| plane[count..].iter_mut().for_each(|value| *value -= 3.0));
    planes.opacity_logit[count..].fill(-3.0);
    dusty
}

/// PSNR of one frame against another in views that nothing is chosen by, the worst, decibels.
fn worst(one: &GaussianFrame, other: &GaussianFrame) -> f64 {
    let pictures = ReferencePictures::new(one, ring(one, Up::default(), 5, 540));
    pictures.psnr(other).map(|decibels| decibels.min(metrics::LOSSLESS_DB)).fold(f64::INFINITY, f64::min)
}

#[test]
fn dust_is_left_out_and_pictures_keep_what_was_asked_for() {
    let scene = builtin(1_500, 0);
    let dusty = with_dust(&scene);
    let (bytes, report) = encoded(vec![dusty.clone()], &settings(Some(55.0)));
    let [pruned] = report.pruned.as_slice() else { panic!("{:?}", report.pruned) };
    assert!(pruned.gaussians > 1_000 && pruned.psnr.unwrap() >= 55.0, "{pruned:?}");
    assert_eq!(report.gaussians + u64::from(pruned.gaussians) + report.invisible, dusty.len() as u64);
    let (all, whole) = encoded(vec![dusty.clone()], &settings(None));
    assert!(whole.pruned.is_empty() && bytes.len() * 10 < all.len() * 9, "{} of {}", bytes.len(), all.len());
    assert_eq!(decoded(&bytes, &strict()).0.remove(0).into_shown().len() as u64, report.gaussians);
}

#[test]
fn a_lower_threshold_leaves_out_more() {
    let counts = [70.0, 55.0, 40.0].map(|least| {
        let (_, report) = encoded(vec![builtin(1_500, 0)], &settings(Some(least)));
        report.pruned[0].gaussians
    });
    assert!(counts[0] <= counts[1] && counts[1] < counts[2], "{counts:?}");
}

#[test]
fn the_psnr_asked_for_is_that_against_all_gaussians() {
    let dusty = with_dust(&builtin(1_500, 0));
    let asked = Settings { psnr: Some(45.0), ..settings(Some(50.0)) };
    let (bytes, report) = encoded(vec![dusty.clone()], &asked);
    let told = report.pictures.unwrap().fitted_psnr().unwrap();
    assert!((told - 45.0).abs() < 0.6, "{told}");
    let frame = decoded(&bytes, &strict()).0.remove(0).into_shown();
    assert!(worst(&dusty, &to_gaussians(frame, &sequence(&bytes)).unwrap()) > 41.0);
}

#[test]
fn what_cannot_be_pruned_is_refused() {
    let mut frames = vec![builtin(200, 0), builtin(200, 0)];
    let refused = |settings: &Settings, frames: &mut Vec<GaussianFrame>| {
        matches!(
            encode(frames, settings, &mut Vec::new(), &mut |_, _| {}),
            Err(Error::Setting { name: "prune", .. })
        )
    };
    let predicted = Settings { structure: Structure::Predicted { layers: 1 }, ..settings(Some(50.0)) };
    assert!(refused(&predicted, &mut frames));
    assert!(refused(&settings(Some(10.0)), &mut frames));
    assert!(matches!(plan(&mut frames, &settings(Some(50.0))), Err(Error::Setting { name: "prune", .. })));
    // Nor with the plan of a run without it.
    let record = plan(&mut frames, &settings(None)).unwrap().record().unwrap();
    let planned = Plan::from_record(&record, &settings(Some(50.0)));
    assert!(matches!(planned, Err(Error::Setting { name: "prune", .. })));
    let mut pushed = Encoder::new(Vec::new(), Settings { gop: 1, ..settings(Some(50.0)) });
    let results = [pushed.push(frames[0].clone()), pushed.push(frames[1].clone())];
    assert!(results.iter().any(Result::is_err) || pushed.finish().is_err());
}
