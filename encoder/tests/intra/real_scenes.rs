//! Real captures, where `../shared/data` stands beside the checkout.

use crate::common::{Random, decoded, encoded, strict};
use splatstream_encoder::Settings;
use splatstream_files::{ReadLimits, read_scene};
use splatstream_gaussians::GaussianFrame;
use std::path::Path;

fn scene(file: &str) -> Option<GaussianFrame> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data").join(file);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    Some(read_scene(&path, &ReadLimits::default()).unwrap())
}

/// Encodes and decodes with one thread and with two, then damages the stream 130 times.
fn survives(file: &str, most_bpg: f64) {
    let Some(frame) = scene(file) else { return };
    let pools = [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap());
    let [(bytes, report), (again, _)] =
        pools.each_ref().map(|pool| pool.install(|| encoded(vec![frame.clone()], &Settings::default())));
    assert!(bytes == again, "{file}: the stream depends on the number of threads");
    let bpg = bytes.len() as f64 * 8.0 / report.gaussians as f64;
    println!("{file}: {bpg:.2} bits per Gaussian");
    assert!(bpg < most_bpg, "{file}: {bpg} bits per Gaussian");
    let digests = |bytes: &[u8]| {
        let (frames, summary) = decoded(bytes, &strict());
        (frames.iter().filter_map(|frame| frame.digest).collect::<Vec<_>>(), summary.verdict())
    };
    for pool in &pools {
        assert_eq!(pool.install(|| digests(&bytes)), (report.digests.clone(), None), "{file}");
    }
    let mut random = Random::new(7);
    for round in 0..130 {
        let damaged = random.mutated(&bytes);
        if let (found, None) = digests(&damaged) {
            assert_eq!(found, report.digests, "{file}: damage {round} is decoded silently wrong");
        }
    }
}

#[test]
fn plant() {
    survives("static/plant.splat", 75.0);
}

#[test]
fn biker() {
    survives("static/biker.compressed.ply", 75.0);
}

/// A quarter of playbot: the whole scene has the same statistics and takes four times as long.
#[test]
fn playbot() {
    survives("static/playbot/2_0", 115.0);
}

#[test]
fn a_head_of_a_sequence() {
    survives("dynamic/lam_p2/frame_0007.ply", 75.0);
}
