//! The built-in scene as a package, for those who have nothing to serve yet.

use crate::demo;
use crate::failure::Failure;
use crate::output_file::OutputFile;
use crate::package::{package, write};
use crate::progress::Progress;
use crate::stream_file::StreamFile;
use splatstream_decoder::process;
use splatstream_encoder::encode;
use splatstream_files::builtin::BuiltinScene;
use splatstream_gaussians::GaussianFrame;
use splatstream_stream::package::Options;
use std::path::Path;

/// A scene that is encoded in some seconds.
const SCENE: BuiltinScene = BuiltinScene {
    gaussians: 4000,
    frames: 48,
    seed: 1,
    tracking: splatstream_files::builtin::Tracking::Tracked,
    sh_degree: 2,
};

/// Makes, encodes and packages the scene.
pub(super) fn make(directory: &Path) -> Result<(), Failure> {
    let mut frames: Vec<GaussianFrame> = (0..SCENE.frames).map(|number| SCENE.frame(number)).collect();
    let progress = Progress::frames("encoding", SCENE.frames);
    let mut bytes = Vec::new();
    encode(&mut frames, &demo::settings(SCENE.frames), &mut bytes, &mut |done, _| progress.at(done))
        .map_err(|error| Failure::other(error.to_string()))?;
    let stream = StreamFile { path: directory.join("built-in.gss"), bytes };
    let package = package(&stream, &Options::default(), &process::Options::default(), true)?;
    write(&package, &mut |name| OutputFile::create(&directory.join(name), &[]))?;
    Ok(())
}
