//! Reading a scene without being told its format.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use crate::announced;
use crate::error::SceneError;
use crate::format::{SceneFormat, detect, read_whole, sog_directory};
use crate::limits::{Budget, ReadLimits};
use crate::reading::{checked, read_file};
use crate::scene::Scene;
use crate::sequence::{Sequence, SequenceOptions};
use crate::sog;
use splatstream_gaussians::GaussianFrame;

/// Reads the scene at `path`: a file of any supported format, a SOG directory, or the `meta.json` in one. Of a sequence of
/// one frame it reads that.
///
/// # Errors
/// Those of [`detect`] and of the format's reader, with the path; a sequence of several frames.
pub fn read_scene(path: &Path, limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_scene_as_is(path, limits)?.frame).map_err(|error| error.in_file(path))
}

/// As [`read_scene`], with what the reader has noted, and with all values as they are, even those that no frame may hold: see
/// [`GaussianFrame::defects`].
///
/// # Errors
/// As [`read_scene`], without those of values.
pub fn read_scene_as_is(path: &Path, limits: &ReadLimits) -> Result<Scene, SceneError> {
    let mut budget = Budget::new(limits);
    if let Some(directory) = sog_directory(path) {
        let frame = sog::read_dir_as_is(&directory, &mut budget)?;
        return Ok(Scene { frame, notes: budget.into_notes() });
    }
    let format = detect(path)?;
    if format.is_sequence() {
        return only_frame(path, limits);
    }
    let mut read = || {
        // Of what is no file, a pipe, nothing is known before it is read.
        if path.metadata()?.is_file() {
            if format == SceneFormat::Sog {
                return sog::read_zip_as_is(BufReader::new(File::open(path)?), &mut budget);
            }
            announced::check(format, File::open(path)?, &mut budget)?;
        }
        let bytes = read_file(path, &mut budget)?;
        read_whole(&bytes, path, path.parent(), &mut budget)
    };
    let frame = read().map_err(|error| error.in_file(path))?;
    Ok(Scene { frame, notes: budget.into_notes() })
}

/// The frame of a sequence that has one.
fn only_frame(path: &Path, limits: &ReadLimits) -> Result<Scene, SceneError> {
    let mut sequence = Sequence::open(path, limits, &SequenceOptions::default())?;
    match sequence.len() {
        1 => sequence.frame(0),
        frames => {
            let what = format!("the file holds {frames} frames");
            Err(SceneError::unsupported(what, "read it as a sequence").in_file(path))
        }
    }
}
