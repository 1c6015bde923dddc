//! Models of COLMAP: cameras, images and points3D, as text or binary.
//!
//! Source: the documentation of COLMAP, "Output format", and "Camera models". A world-to-camera rotation is a quaternion w, x, y,
//! z; camera axes are x right, y down, z forward, and the middle of the top left pixel is at 0.5, as with
//! [`Camera`]. Where in pictures points were found is ignored.

mod binary;
mod text;

use super::{CameraError, Capture, CapturedPoint, CapturedView, MAX_VIEWS};
use crate::camera::Camera;
use glam::{DMat3, DQuat, DVec3};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Points that are read at most.
const MAX_POINTS: usize = 10_000_000;

/// A directory with a model.
pub(super) struct Model {
    folder: PathBuf,
    is_binary: bool,
}

/// The model in a directory, or in the places below it where COLMAP puts one.
pub(super) fn find(folder: &Path) -> Option<Model> {
    let places = [folder.to_path_buf(), folder.join("sparse/0"), folder.join("sparse")];
    places.into_iter().find_map(|folder| {
        let has = |ending| {
            ["cameras", "images"].iter().all(|name| folder.join(format!("{name}.{ending}")).is_file())
        };
        let is_binary = has("bin");
        (is_binary || has("txt")).then_some(Model { folder, is_binary })
    })
}

/// What a model says; its points if they are asked for and there.
///
/// # Errors
/// Files that cannot be read or are none of COLMAP's, models of cameras that are not pinholes.
pub(super) fn read(model: &Model, with_points: bool) -> Result<Capture, CameraError> {
    let read = |name: &str| Source::open(model, name);
    let (cameras, images) = (read("cameras")?, read("images")?);
    let (lenses, poses) = match model.is_binary {
        true => (binary::lenses(cameras)?, binary::poses(images)?),
        false => (text::lenses(cameras)?, text::poses(images)?),
    };
    let mut views = poses.into_iter().map(|pose| pose.view(&lenses, model)).collect::<Result<Vec<_>, _>>()?;
    views.sort_by(|a, b| a.picture.cmp(&b.picture));
    let ending = model.ending();
    let points = match model.folder.join(format!("points3D.{ending}")).is_file() && with_points {
        false => Vec::new(),
        true if model.is_binary => binary::points(read("points3D")?)?,
        true => text::points(read("points3D")?)?,
    };
    Ok(Capture { views, points, points_file: None, pictures: model.pictures() })
}

impl Model {
    fn ending(&self) -> &'static str {
        if self.is_binary { "bin" } else { "txt" }
    }

    /// The nearest directory called images, beside the model or up to two above.
    fn pictures(&self) -> PathBuf {
        let above = self.folder.ancestors().take(3).map(|folder| folder.join("images"));
        above.into_iter().find(|folder| folder.is_dir()).unwrap_or_else(|| self.folder.clone())
    }
}

/// A file of a model.
struct Source {
    reader: BufReader<File>,
    name: String,
}

impl Source {
    fn open(model: &Model, name: &str) -> Result<Self, CameraError> {
        let name = format!("{name}.{}", model.ending());
        let file = File::open(model.folder.join(&name))?;
        Ok(Self { reader: BufReader::new(file), name })
    }
}

/// What a camera of COLMAP is to several images.
struct Lens {
    size: [u32; 2],
    focal: [f32; 2],
    principal: [f32; 2],
    is_distorted: bool,
}

/// A model of a lens: its name, parameters and focal lengths, and whether it is a pinhole where all other parameters are 0.
/// They come in this order: focal lengths, principal point, distortion.
type LensModel = (&'static str, usize, usize, bool);

/// By the numbers of COLMAP.
const MODELS: [LensModel; 11] = [
    ("SIMPLE_PINHOLE", 3, 1, true),
    ("PINHOLE", 4, 2, true),
    ("SIMPLE_RADIAL", 4, 1, true),
    ("RADIAL", 5, 1, true),
    ("OPENCV", 8, 2, true),
    ("OPENCV_FISHEYE", 8, 2, false),
    ("FULL_OPENCV", 12, 2, true),
    ("FOV", 5, 2, false),
    ("SIMPLE_RADIAL_FISHEYE", 4, 1, false),
    ("RADIAL_FISHEYE", 5, 1, false),
    ("THIN_PRISM_FISHEYE", 12, 2, false),
];

/// The most parameters that a model has.
const MAX_PARAMETERS: usize = 12;

impl Lens {
    /// # Errors
    /// A model that is no pinhole whatever its parameters, or another number of parameters.
    fn new(model: LensModel, size: [u64; 2], parameters: &[f64]) -> Result<Self, String> {
        let (name, count, focals, is_pinhole) = model;
        if !is_pinhole {
            return Err(format!(
                "{name} is not a pinhole camera: run colmap image_undistorter and use its output"
            ));
        }
        if parameters.len() != count {
            return Err(format!("{name} has {count} parameters, there are {}", parameters.len()));
        }
        let (focal, rest) = parameters.split_at_checked(focals).unwrap_or_default();
        let (&[fx, .., fy] | &[fx @ fy], &[cx, cy, ref bends @ ..]) = (focal, rest) else {
            return Err(format!("{name} lacks parameters"));
        };
        // What is too large here is refused where all cameras are checked.
        let side = |side: u64| u32::try_from(side).unwrap_or(u32::MAX);
        Ok(Self {
            size: size.map(side),
            focal: [fx as f32, fy as f32],
            principal: [cx as f32, cy as f32],
            is_distorted: bends.iter().any(|&bend| bend != 0.0),
        })
    }
}

/// What an image of COLMAP is.
struct Pose {
    /// Quaternion w, x, y, z from the world to the camera.
    rotation: [f64; 4],
    /// Where the origin of the world is in the camera's axes.
    translation: [f64; 3],
    lens: u32,
    name: String,
    /// Where it stands in the file, for messages.
    place: String,
}

impl Pose {
    #[expect(clippy::arithmetic_side_effects, reason = "products of matrices of floats")]
    fn view(self, lenses: &BTreeMap<u32, Lens>, model: &Model) -> Result<CapturedView, CameraError> {
        let refused = |why: String| {
            let file = format!("images.{}", model.ending());
            colmap_error(file, self.place.clone(), &format!("{}: {why}", self.name))
        };
        let lens = lenses.get(&self.lens);
        let lens = lens.ok_or_else(|| refused(format!("there is no camera {} in cameras", self.lens)))?;
        let [w, x, y, z] = self.rotation;
        let rotation = DQuat::from_xyzw(x, y, z, w);
        // Not for NaN.
        if !(rotation.length() > 0.0 && rotation.length() < f64::INFINITY) {
            return Err(refused("its rotation has no direction".to_owned()));
        }
        let to_world = DMat3::from_quat(rotation.normalize()).transpose();
        let position = -(to_world * DVec3::from(self.translation));
        let camera = Camera {
            name: super::stem(&self.name).unwrap_or_else(|| self.name.clone()),
            width: lens.size[0],
            height: lens.size[1],
            focal: lens.focal,
            principal: lens.principal,
            // Columns of the way to the world are the camera's axes in it.
            rotation: to_world.to_cols_array_2d().map(|axis| axis.map(|part| part as f32)),
            position: position.to_array().map(|part| part as f32),
        };
        let picture = Some(PathBuf::from(&self.name));
        Ok(CapturedView { camera, picture, is_distorted: lens.is_distorted })
    }
}

/// What is wrong with a file of a model. `why` may have words of the file, of which terminals must not obey any.
fn colmap_error(file: String, place: String, why: &str) -> CameraError {
    let why = why.chars().fold(String::new(), |mut shown, c| {
        match c.is_control() {
            true => shown.extend(c.escape_default()),
            false => shown.push(c),
        }
        shown
    });
    CameraError::Colmap { file, place, why }
}

/// # Errors
/// No room for one more.
fn room(count: usize, most: usize, what: &str) -> Result<(), String> {
    if count < most {
        Ok(())
    } else {
        Err(format!("there are more than {most} {what}: give a part of the model"))
    }
}

/// A point, if it is finite.
fn point(position: [f64; 3], colour: [u8; 3]) -> Result<CapturedPoint, String> {
    let position = position.map(|part| part as f32);
    match position.iter().all(|part| part.is_finite()) {
        true => Ok(CapturedPoint { position, colour }),
        false => Err("the position of a point must be finite".to_owned()),
    }
}
