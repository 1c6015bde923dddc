//! Long chains of predicted frames of which units are lost on the way.

use crate::intact::{Intact, options};
use crate::{peak_of_process, so_many};
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_encoder::{PredictorChoice, Preset, Quality, Settings, Structure, encode};
use splatstream_files::builtin::{BuiltinScene, Tracking};
use splatstream_format::syntax::{FileHeader, UnitHeader, UnitType};
use splatstream_format::unit::Stream;
use splatstream_format::{Error, ErrorKind, Limits};
use splatstream_fuzz::laws::{Decoded, exact};
use splatstream_gaussians::random::SplitMix64;

const POINTS: [&str; 4] = ["s0,t0,r0", "s0,t1,r1", "s1,t0,r2", "s1,t1,r2"];

/// One GOP of so many frames, two spatial layers and two temporal ones, three refinements.
fn chain(frames: u32) -> Vec<u8> {
    let scene = BuiltinScene { gaussians: 100, frames, seed: 7, tracking: Tracking::Tracked, sh_degree: 0 };
    let settings = Settings {
        preset: Preset::Fast,
        steps: Quality::Low.steps(),
        refinements: vec![20, 50, 100],
        structure: Structure::Predicted { layers: 2 },
        predictor_choice: PredictorChoice::Difference,
        spatial_layers: 2,
        gop: frames,
        ..Settings::default()
    };
    let mut frames: Vec<_> = (0..frames).map(|number| scene.frame(number)).collect();
    let mut bytes = Vec::new();
    encode(&mut frames, &settings, &mut bytes, &mut |_, _| {}).unwrap();
    bytes
}

/// The stream without some of its increments, one of so many, and how many these are.
fn with_losses(bytes: &[u8], one_of: usize, random: &mut SplitMix64) -> (Vec<u8>, usize) {
    let mut out = bytes[..FileHeader::SIZE].to_vec();
    let mut lost = 0;
    for unit in Stream::open(bytes, &Limits::default()).unwrap().units().map(Result::unwrap) {
        if unit.header.unit_type() == UnitType::Increment && random.below(one_of) == 0 {
            lost += 1;
            continue;
        }
        let start = unit.at as usize;
        out.extend(&bytes[start..start + UnitHeader::SIZE + unit.payload.len()]);
    }
    (out, lost)
}

#[test]
fn long_chains_with_losses_never_drift() {
    let length = so_many(300).max(40) as u32;
    let bytes = chain(length);
    let intact = Intact::new(&bytes);
    let mut random = SplitMix64::new(18);
    let (mut decodes, mut lost, mut frames, mut whole) = (0, 0, 0, 0);
    for point in POINTS {
        let operating_point: OperatingPoint = point.parse().unwrap();
        let of_point = Decoded::of(&bytes, &options(operating_point));
        for one_of in [4, 30, 300] {
            let (part, units) = with_losses(&bytes, one_of, &mut random);
            let decoded = Decoded::of(&part, &options(operating_point));
            let has_drifted = |error: &Error| matches!(error.kind, ErrorKind::Digest { .. });
            assert!(!decoded.errors.iter().any(has_drifted), "{point}: {:?}", decoded.errors);
            for frame in &decoded.frames {
                assert!(intact.has(frame), "{point}: frame {} drifts", frame.index);
                let at_point = of_point.frames.iter().find(|other| other.index == frame.index);
                let is_whole = at_point.is_some_and(|whole| exact(whole) == exact(frame));
                whole += usize::from(is_whole);
            }
            (decodes, lost, frames) = (decodes + 1, lost + units, frames + decoded.frames.len());
        }
    }
    println!(
        "chains of {length} predicted frames with losses: {decodes} decodings at {} operating points; {lost} units lost; \
         frames {frames}, of these {whole} whole, the others exact as far as they go, with all digests compared; peak memory of the process {:.1} MB",
        POINTS.len(),
        peak_of_process()
    );
}
