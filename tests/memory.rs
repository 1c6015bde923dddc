//! What a decoder says that it needs is what it takes at most: a program of its own, so that no other test takes memory
//! meanwhile.
#![allow(clippy::unwrap_used, missing_docs, reason = "a panic is a failed test")]

use peak_alloc::PeakAlloc;
use splatstream::settings::{Anchor, Preset, Structure};
use splatstream::{Decoder, Error, Limits, Settings, encode};
use splatstream_files::builtin::BuiltinScene;
use splatstream_format::ErrorKind;
use std::sync::Arc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// A decoder, of two frames at a time or of one.
fn decoder(bytes: &Arc<[u8]>, is_ahead: bool) -> Decoder {
    let decoder = Decoder::from_bytes(bytes.clone());
    if is_ahead { decoder.ahead() } else { decoder }
}

/// What decoding a stream is said to take, found by allowing less.
fn announced(bytes: &Arc<[u8]>, is_ahead: bool) -> u64 {
    let mut allowed = 1;
    loop {
        let limits = Limits { max_memory: allowed, ..Limits::default() };
        let mut decoder = decoder(bytes, is_ahead).with_limits(limits);
        match decoder.find_map(Result::err) {
            None => return allowed,
            Some(Error::Stream(error)) => match error.kind {
                ErrorKind::OverLimit { asked, .. } if asked > allowed => allowed = asked,
                _ => panic!("{error}"),
            },
            Some(error) => panic!("{error}"),
        }
    }
}

fn stream(scene: &BuiltinScene, settings: &Settings) -> Arc<[u8]> {
    let mut frames: Vec<_> = (0..scene.frames).map(|number| scene.frame(number)).collect();
    let mut bytes = Vec::new();
    encode(&mut frames, settings, &mut bytes, &mut |_, _| ()).unwrap();
    bytes.into()
}

#[test]
fn no_more_memory_is_taken_than_was_announced() {
    let scene = |gaussians, frames, sh_degree| BuiltinScene {
        gaussians,
        frames,
        sh_degree,
        ..BuiltinScene::default()
    };
    let fast = Settings { preset: Preset::Fast, ..Settings::default() };
    let predicted = Settings { structure: Structure::Predicted { layers: 3 }, gop: 8, ..fast.clone() };
    let layered = Settings { spatial_layers: 3, ..predicted.clone() };
    let whole = Settings { anchor: Anchor::Whole, ..layered.clone() };
    let cases = [
        ("static, no harmonics", scene(150_000, 1, 0), &fast),
        ("static, degree 3", scene(60_000, 1, 3), &fast),
        ("intra frames", scene(40_000, 3, 2), &fast),
        ("predicted", scene(30_000, 8, 1), &predicted),
        ("layers", scene(30_000, 8, 0), &layered),
        ("whole anchors", scene(30_000, 4, 2), &whole),
        ("predicted, degree 3", scene(30_000, 4, 3), &predicted),
    ];
    for (name, scene, settings) in cases {
        let bytes = stream(&scene, settings);
        for is_ahead in [false, true] {
            let announced = announced(&bytes, is_ahead);
            let before = MEMORY.current_usage() as u64;
            MEMORY.reset_peak_usage();
            // Without limits nothing asks the machine whether it has what is announced. The caller holds the frame that it was
            // given while it converts it.
            for frame in decoder(&bytes, is_ahead).with_limits(Limits::UNLIMITED) {
                let frame = frame.unwrap();
                let gaussians = frame.gaussians();
                assert_eq!(gaussians.len(), frame.len());
            }
            let taken = MEMORY.peak_usage() as u64 - before;
            assert!(taken <= announced, "{name}, ahead {is_ahead}: {announced} announced, {taken} taken");
        }
    }
}
