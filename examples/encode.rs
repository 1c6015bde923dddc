//! Frames to a stream: `cargo run --example encode OUT.gss`. An earlier version of the encoder made examples/talk.gss so.
#![expect(clippy::print_stdout, reason = "an example shows what it has")]

use splatstream::settings::Structure;
use splatstream::{Encoder, Settings};
use splatstream_files::builtin::BuiltinScene;
use std::fs::File;
use std::io::BufWriter;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give the name of the stream to write")?;
    let scene = BuiltinScene { gaussians: 400, frames: 12, sh_degree: 0, ..BuiltinScene::default() };
    let settings = Settings {
        gop: 4,
        structure: Structure::Predicted { layers: 2 },
        refinements: vec![20, 50, 100],
        ..Settings::default()
    };
    let mut encoder = Encoder::new(BufWriter::new(File::create(&path)?), settings);
    for number in 0..scene.frames {
        encoder.push(scene.frame(number))?;
    }
    let report = encoder.finish()?;
    println!("{path}: {} frames, {} Gaussians, {} bytes", report.frames, report.gaussians, report.bytes);
    Ok(())
}
