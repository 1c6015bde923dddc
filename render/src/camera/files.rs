//! Files of cameras, their pictures and points: the `cameras.json` of INRIA's trainer, nerfstudio's, instant-ngp's and
//! Blender's `transforms.json`, and COLMAP's models, as text or binary.
//!
//! Cameras are pinholes: what a lens bends is said ([`CapturedView::is_distorted`]) and not drawn.

mod colmap;
mod json;

use super::Camera;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Why a file gives no cameras.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The file could not be read.
    #[error("cannot read: {0}; check the path")]
    Io(#[from] std::io::Error),
    /// A file without bytes.
    #[error("it is empty; check what wrote it, or copy it again")]
    Empty,
    /// Neither of the two forms.
    #[error(
        "neither a cameras.json (a list of id, width, height, position, rotation, fx, fy) nor a transforms.json \
         (w, h, fl_x or camera_angle_x, frames with transform_matrix): {0}"
    )]
    Form(#[from] serde_json::Error),
    /// A camera that cannot be used.
    #[error("camera {camera}: {why}")]
    Camera {
        /// Its place in the file, from 0.
        camera: usize,
        /// What is wrong and what to do.
        why: &'static str,
    },
    /// More cameras in a JSON file than are read.
    #[error("there are more than {most} cameras: give a part of the file")]
    TooMany {
        /// Cameras that are read at most.
        most: usize,
    },
    /// A file of COLMAP that is not one.
    #[error("{file}: {place}: {why}")]
    Colmap {
        /// Which file of the model.
        file: String,
        /// The line, from 1, or the byte, from 0.
        place: String,
        /// What is wrong and what to do.
        why: String,
    },
    /// A directory without a model.
    #[error(
        "there is neither a transforms.json nor a model of COLMAP (cameras and images, .bin or .txt) in this directory, \
         in its sparse/0 or in its sparse; give the directory that has them"
    )]
    Directory,
}

/// What was captured: views with their pictures, and points of the scene where the file has any.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Capture {
    /// From where pictures were taken, in the order of the file; of COLMAP by name.
    pub views: Vec<CapturedView>,
    /// Points of the scene, in the order of the file.
    pub points: Vec<CapturedPoint>,
    /// A PLY file of points that a `transforms.json` names.
    pub points_file: Option<PathBuf>,
    /// The directory that names of pictures start from.
    pub pictures: PathBuf,
}

/// A view and its picture.
#[derive(Clone, Debug, PartialEq)]
pub struct CapturedView {
    /// From where it was taken.
    pub camera: Camera,
    /// The name of the picture as the file has it, which may lack its ending.
    pub picture: Option<PathBuf>,
    /// Whether the lens bends straight lines, which the camera does not say.
    pub is_distorted: bool,
}

/// A point of the scene with its colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CapturedPoint {
    /// Where it is, scene units.
    pub position: [f32; 3],
    /// Red, green, blue, as in pictures.
    pub colour: [u8; 3],
}

/// Views that are read at most, and lenses.
const MAX_VIEWS: usize = 100_000;

/// The largest file of cameras in JSON, bytes.
const MAX_JSON: u64 = 1 << 26;

/// The cameras of a file, or of a directory as [`read_capture`] takes it.
///
/// # Errors
/// A file that cannot be read, that has another form, or a camera without size, focal length or finite pose.
pub fn read_cameras(path: &Path) -> Result<Vec<Camera>, CameraError> {
    read_views(path).map(cameras_of)
}

/// A `cameras.json` of these cameras, from which [`read_cameras`] gets the same: INRIA's form, with the principal point as `cx` and
/// `cy`, which readers that do not know them leave out.
///
/// ```
/// use splatstream_render::Camera;
/// use splatstream_render::camera::{read_cameras, write_cameras};
/// let camera = Camera::of_pose("front".into(), [0.0, 0.0, -3.0], [1.0, 0.0, 0.0, 0.0], 0.8, [960, 540]);
/// let path = std::env::temp_dir().join(format!("splatstream-cameras-{}.json", std::process::id()));
/// std::fs::write(&path, write_cameras(std::slice::from_ref(&camera)))?;
/// assert_eq!(read_cameras(&path)?, [camera]);
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn write_cameras(cameras: &[Camera]) -> String {
    json::list(cameras)
}

/// As [`read_capture`], but without the points of a model of COLMAP, which are most of it.
///
/// # Errors
/// As [`read_cameras`]; more views than [`read_capture`] reads.
pub fn read_views(path: &Path) -> Result<Capture, CameraError> {
    if path.is_dir() { colmap_or_json(path, false) } else { json_file(path) }
}

/// What was captured: of a `cameras.json`, a `transforms.json`, or a directory that has a `transforms.json` or a model of
/// COLMAP in itself, in its `sparse/0` or in its `sparse`.
///
/// Pictures are neither opened nor looked for. Sides of pictures are 1 to 16,384 pixels: whoever draws for cameras of strangers
/// must reckon with the 5 GB that a drawing of that size takes, or scale them ([`Camera::scaled_to_height`]). At most 100,000 views and 10,000,000 points are read, and nothing else is
/// kept of a model, whatever its size.
///
/// # Errors
/// As [`read_cameras`]; more views or points than that.
pub fn read_capture(path: &Path) -> Result<Capture, CameraError> {
    if path.is_dir() { colmap_or_json(path, true) } else { json_file(path) }
}

fn colmap_or_json(folder: &Path, with_points: bool) -> Result<Capture, CameraError> {
    let capture = match (folder.join("transforms.json"), colmap::find(folder)) {
        (file, _) if file.is_file() => return json_file(&file),
        (_, Some(model)) => colmap::read(&model, with_points)?,
        (_, None) => return Err(CameraError::Directory),
    };
    checked(capture)
}

fn json_file(path: &Path) -> Result<Capture, CameraError> {
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_JSON.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_JSON {
        let error = format!("the file has more than {MAX_JSON} bytes");
        return Err(std::io::Error::new(std::io::ErrorKind::FileTooLarge, error).into());
    }
    if bytes.is_empty() {
        return Err(CameraError::Empty);
    }
    of_json(&bytes, path.parent().unwrap_or(Path::new("")))
}

/// What the bytes of a file in `folder` say.
fn of_json(bytes: &[u8], folder: &Path) -> Result<Capture, CameraError> {
    checked(json::parse(bytes, folder)?)
}

fn cameras_of(capture: Capture) -> Vec<Camera> {
    capture.views.into_iter().map(|view| view.camera).collect()
}

fn checked(capture: Capture) -> Result<Capture, CameraError> {
    capture.views.iter().enumerate().try_for_each(|(at, view)| {
        check(at, &view.camera)?;
        check_names(at, view)
    })?;
    Ok(capture)
}

/// What a view is called that took this picture.
fn stem(path: &str) -> Option<String> {
    Some(Path::new(path).file_stem()?.to_str()?.to_owned())
}

/// The largest side of a picture, pixels.
const MAX_SIDE: u32 = 16_384;

fn check(at: usize, camera: &Camera) -> Result<(), CameraError> {
    let why = |why| Err(CameraError::Camera { camera: at, why });
    if !(1..=MAX_SIDE).contains(&camera.width) || !(1..=MAX_SIDE).contains(&camera.height) {
        return why("width and height must be 1 to 16384");
    }
    if !camera.focal.iter().all(|focal| focal.is_finite() && *focal > 0.0) {
        return why("focal lengths must be above 0");
    }
    let pose = camera.rotation.iter().flatten().chain(&camera.position).chain(&camera.principal);
    if !pose.into_iter().all(|value| value.is_finite()) {
        return why("position, rotation and principal point must be finite");
    }
    let off = |row: &[f32; 3]| (row.iter().map(|part| part * part).sum::<f32>() - 1.0).abs() > 1e-2;
    if camera.rotation.iter().any(off) {
        return why("the rotation must have rows of length 1");
    }
    Ok(())
}

/// Names go into messages and onto terminals, which obey characters of control; no program writes them into names.
fn check_names(at: usize, view: &CapturedView) -> Result<(), CameraError> {
    let picture = view.picture.as_ref().map(|picture| picture.to_string_lossy());
    let steers = |name: &str| name.contains(char::is_control);
    match steers(&view.camera.name) || picture.as_deref().is_some_and(steers) {
        true => {
            let why = "the name of its picture has characters of control: rename it";
            Err(CameraError::Camera { camera: at, why })
        }
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_cameras(bytes: &[u8]) -> Result<Vec<Camera>, CameraError> {
        Ok(cameras_of(of_json(bytes, Path::new(""))?))
    }

    #[test]
    fn both_forms_give_the_same_camera() {
        let trainer = br#"[{"id": 0, "img_name": "a", "width": 64, "height": 32, "fx": 50.0, "fy": 50.0,
            "position": [1, 2, 3], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]"#;
        let studio = br#"{"w": 64, "h": 32, "fl_x": 50.0, "frames": [{"file_path": "images/a.png",
            "transform_matrix": [[1, 0, 0, 1], [0, -1, 0, 2], [0, 0, -1, 3], [0, 0, 0, 1]]}]}"#;
        assert_eq!(parse_cameras(trainer).unwrap(), parse_cameras(studio).unwrap());
    }

    #[test]
    fn a_camera_without_size_says_what_to_add() {
        let studio = br#"{"h": 32, "camera_angle_x": 0.7, "frames": [{"transform_matrix": [[1]]}]}"#;
        let error = parse_cameras(studio).unwrap_err();
        assert_eq!(error.to_string(), "camera 0: there is no picture size: add w and h to the file");
    }

    #[test]
    fn an_angle_alone_is_that_of_a_nerf_synthetic_scene() {
        let bare = br#"{"camera_angle_x": 0.7, "frames": [{"transform_matrix": [[1, 0, 0, 1], [0, -1, 0, 2],
            [0, 0, -1, 3], [0, 0, 0, 1]]}]}"#;
        let camera = parse_cameras(bare).unwrap().remove(0);
        assert_eq!((camera.width, camera.height), (800, 800));
        assert!((camera.focal[0] - 400.0 / libm::tanf(0.35)).abs() < 1e-2);
    }

    #[test]
    fn a_rotation_that_is_none_is_refused() {
        let trainer = br#"[{"width": 64, "height": 32, "fx": 50.0, "fy": 50.0,
            "position": [1, 2, 3], "rotation": [[2, 0, 0], [0, 1, 0], [0, 0, 1]]}]"#;
        assert!(parse_cameras(trainer).unwrap_err().to_string().contains("length 1"));
    }
}
