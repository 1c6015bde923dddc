//! Streams of profile Dynamic: layers, predicted frames, operating points, losses, cuts.

mod common;

use common::{directory, fail, fixture, json, run, succeed, text};
use serde_json::Value;
use splatstream_encoder::{Preset, Quality, Settings, Structure, encode};
use splatstream_scene::builtin::BuiltinScene;
use std::fs;
use std::path::{Path, PathBuf};

/// Frames of a GOP, and refinements.
const GOP: u64 = 5;
const REFINEMENTS: usize = 3;

/// Ten frames in two GOPs, two spatial and three temporal layers, three refinements. Committed, so that tests change
/// with the bitstream and not with the encoder.
fn dynamic() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/dynamic.gss")
}

/// For a change of the bitstream `BLESS=1 cargo test -p splatstream-cli --test dynamic the_fixture` writes it anew.
#[test]
fn the_fixture_is_a_stream_of_today() {
    let mut scene = BuiltinScene { gaussians: 150, frames: 10, sh_degree: 1, ..BuiltinScene::default() };
    let settings = Settings {
        steps: Quality::Medium.steps(),
        refinements: vec![25, 50, 100],
        block_log2: 6,
        gop: GOP as u32,
        preset: Preset::Fast,
        structure: Structure::Predicted { layers: 3 },
        spatial_layers: 2,
        ..Settings::default()
    };
    if std::env::var_os("BLESS").is_some() {
        let mut stream = Vec::new();
        encode(&mut scene, &settings, &mut stream, &mut |_, _| ()).unwrap();
        fs::write(dynamic(), stream).unwrap();
    }
    let verdict = json(&["validate", text(&dynamic())]);
    assert_eq!((&verdict["outcome"], &verdict["frames"]), (&"accept".into(), &10.into()));
}
