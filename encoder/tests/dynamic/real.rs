//! A real sequence, where `../shared/data` stands beside the checkout.

use crate::common::dynamic::{coded, predicted};
use splatstream_encoder::{Quality, Settings};
use splatstream_files::{ReadLimits, read_scene};
use splatstream_format::syntax::FrameType;
use std::path::Path;

/// A head that speaks: rows keep their meaning from frame to frame.
#[test]
fn predicted_frames_of_a_tracked_head_take_less_than_six_bits_a_gaussian() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/dynamic/lam_p2");
    if !folder.exists() {
        println!("skipped: {} is not there", folder.display());
        return;
    }
    let read = |number: u32| {
        let path = folder.join(format!("frame_{number:04}.ply"));
        read_scene(&path, &ReadLimits::default()).unwrap()
    };
    let frames: Vec<_> = (0..8).map(read).collect();
    let settings = Settings { steps: Quality::High.steps(), ..predicted(1) };
    let (_, report) = coded(&frames, &Settings { block_log2: 14, ..settings }, "a head");
    let predicted = report.coded.iter().filter(|frame| frame.frame_type != FrameType::Intra);
    let (bytes, gaussians) =
        predicted.fold((0, 0), |(bytes, all), frame| (bytes + frame.bytes, all + u64::from(frame.gaussians)));
    let bpg = bytes as f64 * 8.0 / gaussians as f64;
    println!("{bpg:.2} bits per Gaussian in predicted frames");
    assert!(bpg < 6.0, "{bpg} bits per Gaussian in predicted frames");
}
