//! Facts: what scikit-image, scipy and a forward pass in NumPy say of the stored pictures and curves.
//! `render/checks/metrics.py` writes them.

#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a panic is a failed test; a skipped one says so"
)]

use serde_json::Value;
use splatstream_render::Image;
use splatstream_render::metrics::{RatePoint, StLpips, bd_psnr, bd_rate, compare};
use std::fs;
use std::path::{Path, PathBuf};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pictures").join(name)
}

fn expected(kind: &str) -> serde_json::Map<String, Value> {
    let expected: Value = serde_json::from_slice(&fs::read(file("expected.json")).unwrap()).unwrap();
    expected[kind].as_object().unwrap().clone()
}

fn picture(name: &str) -> Option<Image> {
    fs::read(file(&format!("{name}.png"))).ok().map(|bytes| Image::from_png(&bytes).unwrap())
}

/// Compares each figure that is in both, within 1e-4: of the figure itself if it is small.
fn assert_agree(name: &str, expected: &Value, found: &Value) {
    for (figure, found) in found.as_object().unwrap() {
        let (Some(expected), Some(found)) = (expected[figure].as_f64(), found.as_f64()) else { continue };
        let scale = if figure == "st_lpips" { expected } else { 1.0 };
        assert!((expected - found).abs() <= 1e-4 * scale, "{figure} of {name}: {found}, not {expected}");
    }
}

#[test]
fn figures_of_the_stored_pictures_are_those_of_scikit_image() {
    for (name, expected) in expected("pictures") {
        let reference = picture(&format!("{name}-reference")).unwrap();
        let alpha: Vec<f32> = match picture(&format!("{name}-mask")) {
            Some(mask) => mask.pixels().iter().map(|pixel| pixel[0]).collect(),
            None => vec![1.0; reference.pixels().len()],
        };
        let found = compare(&reference, &alpha, &picture(&format!("{name}-picture")).unwrap(), None);
        assert_agree(&name, &expected, &serde_json::to_value(found).unwrap());
    }
}

#[test]
fn learned_distances_of_the_stored_pictures_are_those_of_the_network() {
    let weights = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/metric/st-lpips-alex.npz");
    if !weights.exists() {
        eprintln!("skipped: no {}", weights.display());
        return;
    }
    let learned = StLpips::read(&weights).unwrap();
    for (name, expected) in expected("pictures") {
        let [reference, image] =
            ["reference", "picture"].map(|layer| picture(&format!("{name}-{layer}")).unwrap());
        let distance = learned.distance(&reference, &image);
        assert_agree(&name, &expected, &serde_json::json!({ "st_lpips": distance }));
        if name == "small" {
            let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            assert_eq!(alone.install(|| learned.distance(&reference, &image)), distance);
            assert_eq!(learned.distance(&reference, &reference), Some(0.0));
        }
    }
}

#[test]
fn mean_differences_of_curves_are_those_of_scipy() {
    let points = |curve: &Value| -> Vec<RatePoint> {
        let points: Vec<(f64, f64)> = serde_json::from_value(curve.clone()).unwrap();
        points.into_iter().map(|(rate, quality)| RatePoint { rate, quality }).collect()
    };
    for (name, expected) in expected("curves") {
        let (anchor, test) = (points(&expected["anchor"]), points(&expected["test"]));
        let found = [bd_rate(&anchor, &test).unwrap(), bd_psnr(&anchor, &test).unwrap()];
        for (found, figure) in found.into_iter().zip(["bd_rate", "bd_psnr"]) {
            let expected = expected[figure].as_f64().unwrap();
            assert!((found - expected).abs() < 1e-9, "{figure} of {name}: {found}, not {expected}");
        }
    }
}
