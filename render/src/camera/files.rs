//! Camera files: the `cameras.json` of INRIA's trainer, and nerfstudio's and Blender's `transforms.json`.
//!
//! Lens distortion in a `transforms.json` is not drawn.

use super::Camera;
use serde::Deserialize;
use std::path::Path;

/// Why a file gives no cameras.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// The file could not be read.
    #[error("cannot read: {0}; check the path")]
    Io(#[from] std::io::Error),
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
}

/// The cameras of a file.
///
/// # Errors
/// A file that cannot be read, that has another form, or a camera without size, focal length or finite pose.
pub fn read_cameras(path: &Path) -> Result<Vec<Camera>, CameraError> {
    parse_cameras(&std::fs::read(path)?)
}

/// The cameras in the bytes of a file.
pub(crate) fn parse_cameras(bytes: &[u8]) -> Result<Vec<Camera>, CameraError> {
    let value: serde_json::Value = serde_json::from_slice(bytes)?;
    let cameras = if value.is_array() {
        let cameras: Vec<TrainerCamera> = serde_json::from_value(value)?;
        cameras.into_iter().enumerate().map(|(at, camera)| camera.camera(at)).collect()
    } else {
        let transforms: Transforms = serde_json::from_value(value)?;
        transforms.cameras()?
    };
    cameras.iter().enumerate().try_for_each(|(at, camera)| check(at, camera))?;
    Ok(cameras)
}

/// A camera of INRIA's `cameras.json`: `rotation` and `position` lead from the camera to the world.
#[derive(Deserialize)]
struct TrainerCamera {
    img_name: Option<String>,
    width: u32,
    height: u32,
    position: [f32; 3],
    rotation: [[f32; 3]; 3],
    fx: f32,
    fy: f32,
}

impl TrainerCamera {
    fn camera(self, at: usize) -> Camera {
        Camera {
            name: self.img_name.unwrap_or_else(|| format!("camera_{at:04}")),
            width: self.width,
            height: self.height,
            focal: [self.fx, self.fy],
            principal: [0.5 * self.width as f32, 0.5 * self.height as f32],
            rotation: transposed(self.rotation),
            position: self.position,
        }
    }
}

/// `transforms.json`. Intrinsics stand in the file or with a frame, which wins.
#[derive(Deserialize)]
struct Transforms {
    #[serde(flatten)]
    intrinsics: Intrinsics,
    frames: Vec<TransformFrame>,
}

#[derive(Deserialize, Clone, Copy)]
struct Intrinsics {
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f32>,
    fl_y: Option<f32>,
    cx: Option<f32>,
    cy: Option<f32>,
    camera_angle_x: Option<f32>,
}

#[derive(Deserialize)]
struct TransformFrame {
    file_path: Option<String>,
    transform_matrix: Vec<Vec<f32>>,
    #[serde(flatten)]
    intrinsics: Intrinsics,
}

/// The side of the pictures of NeRF-synthetic, pixels.
const NERF_SYNTHETIC_SIDE: f64 = 800.0;

impl Transforms {
    fn cameras(self) -> Result<Vec<Camera>, CameraError> {
        let shared = self.intrinsics;
        let camera = |(at, frame): (usize, &TransformFrame)| {
            frame.camera(&shared, at).map_err(|why| CameraError::Camera { camera: at, why })
        };
        self.frames.iter().enumerate().map(camera).collect()
    }
}

impl TransformFrame {
    fn camera(&self, shared: &Intrinsics, at: usize) -> Result<Camera, &'static str> {
        let own = &self.intrinsics;
        // The files of the NeRF-synthetic scenes say nothing but the angle: their pictures are squares of one size.
        let is_bare = [own.w, own.h, shared.w, shared.h].iter().all(Option::is_none)
            && [own.fl_x, shared.fl_x].iter().all(Option::is_none);
        let assumed = is_bare.then_some(NERF_SYNTHETIC_SIDE);
        let side = |own: Option<f64>, shared: Option<f64>| {
            let side = own.or(shared).or(assumed).map(|side| side as u32);
            side.ok_or("there is no picture size: add w and h to the file")
        };
        let (width, height) = (side(own.w, shared.w)?, side(own.h, shared.h)?);
        let from_angle = own
            .camera_angle_x
            .or(shared.camera_angle_x)
            .map(|angle| 0.5 * width as f32 / libm::tanf(0.5 * angle));
        let focal_x = own.fl_x.or(shared.fl_x).or(from_angle);
        let focal_x = focal_x.ok_or("there is no focal length: add fl_x or camera_angle_x to the file")?;
        let [rows @ .., _] = self.transform_matrix.as_slice() else {
            return Err("transform_matrix has no rows: it must have 4");
        };
        let [right, up, back, position] =
            columns(rows).ok_or("transform_matrix must have 4 rows of 4 numbers")?;
        Ok(Camera {
            name: self.file_path.as_deref().and_then(stem).unwrap_or_else(|| format!("camera_{at:04}")),
            width,
            height,
            focal: [focal_x, own.fl_y.or(shared.fl_y).unwrap_or(focal_x)],
            principal: [
                own.cx.or(shared.cx).unwrap_or(0.5 * width as f32),
                own.cy.or(shared.cy).unwrap_or(0.5 * height as f32),
            ],
            // Their camera looks back along z, with y up.
            rotation: [right, up.map(|part| -part), back.map(|part| -part)],
            position,
        })
    }
}

/// The columns of the first three rows of a 4 x 4 matrix.
fn columns(rows: &[Vec<f32>]) -> Option<[[f32; 3]; 4]> {
    let [x, y, z] = rows else { return None };
    let mut columns = [[0.0; 3]; 4];
    for (column, values) in columns.iter_mut().enumerate() {
        *values = [*x.get(column)?, *y.get(column)?, *z.get(column)?];
    }
    Some(columns)
}

fn stem(path: &str) -> Option<String> {
    Some(Path::new(path).file_stem()?.to_str()?.to_owned())
}

#[expect(clippy::indexing_slicing, reason = "columns are 0, 1 and 2")]
fn transposed(rows: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
    [0, 1, 2].map(|column| rows.map(|row| row[column]))
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

#[cfg(test)]
mod tests {
    use super::*;

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
