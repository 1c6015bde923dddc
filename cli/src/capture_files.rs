//! The files of a capture, which no output of a command that reads it may replace.

use splatstream_render::camera::{Capture, read_views};
use std::path::{Path, PathBuf};

/// Where the model of a capture is, below its directory.
const PLACES: [&str; 3] = ["", "sparse/0", "sparse"];
/// The files of a model of COLMAP.
const MODEL: [&str; 6] =
    ["cameras.bin", "cameras.txt", "images.bin", "images.txt", "points3D.bin", "points3D.txt"];

/// The files of the capture at a path, as far as it can be read; its pictures are in `images`, if not where it says.
pub(crate) fn files_at(path: &Path, images: Option<&Path>) -> Vec<PathBuf> {
    files_of(path, &read_views(path).unwrap_or_default(), images)
}

/// The files of the capture that was read from a path; its pictures are in `images`, if not where it says. Some of them
/// may not be there.
pub(crate) fn files_of(path: &Path, capture: &Capture, images: Option<&Path>) -> Vec<PathBuf> {
    let model = PLACES.iter().flat_map(|place| MODEL.map(|name| path.join(place).join(name)));
    let mut files: Vec<PathBuf> = model.collect();
    files.extend([path.to_path_buf(), path.join("transforms.json")]);
    files.extend(capture.points_file.clone());
    let folder = images.unwrap_or(&capture.pictures);
    for name in capture.views.iter().filter_map(|view| view.picture.as_deref()) {
        // In a folder that was given, a picture may be found by the last part of its name.
        let last = name.file_name().map(Path::new).filter(|_| images.is_some());
        for picture in [Some(name), last].into_iter().flatten().map(|name| folder.join(name)) {
            let mut with_ending = picture.clone().into_os_string();
            with_ending.push(".png");
            files.extend([picture, with_ending.into()]);
        }
    }
    files
}
