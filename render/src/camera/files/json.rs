//! The `cameras.json` of INRIA's trainer, and nerfstudio's, instant-ngp's and Blender's `transforms.json`.
//!
//! What is read goes straight into what is kept of it, and what is not known is not kept: a tree of the whole file, or a copy of
//! what a flattened structure does not know, takes up to ninety times its bytes.

mod reading;

use super::{CameraError, Capture, CapturedView, MAX_VIEWS};
use crate::camera::Camera;
use reading::{Limited, Matrix, Object, Taken};
use serde::de::{Deserialize, Deserializer, IgnoredAny, MapAccess};
use std::path::{Path, PathBuf};

/// What the bytes of a file in `folder` say.
///
/// # Errors
/// Neither of the two forms, more than [`MAX_VIEWS`] cameras, or a camera without size, focal length or pose.
pub(super) fn parse(bytes: &[u8], folder: &Path) -> Result<Capture, CameraError> {
    if bytes.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'[') {
        let cameras: Limited<TrainerCamera> = serde_json::from_slice(bytes)?;
        let cameras = cameras.all().ok_or(CameraError::TooMany { most: MAX_VIEWS })?;
        let views = cameras.into_iter().enumerate().map(|(at, camera)| camera.view(at)).collect();
        return Ok(Capture { views, pictures: folder.join("images"), ..Capture::default() });
    }
    let transforms: Transforms = serde_json::from_slice(bytes)?;
    let points_file = transforms.ply_file_path.as_ref().map(|file| folder.join(file));
    Ok(Capture {
        views: transforms.views()?,
        points_file,
        pictures: folder.to_path_buf(),
        points: Vec::new(),
    })
}

/// Cameras as a `cameras.json`, as [`parse`] reads it: a camera a line.
pub(super) fn list(cameras: &[Camera]) -> String {
    let line = |(id, camera): (usize, &Camera)| {
        let camera = TrainerCamera::new(id, camera);
        // Strings and finite numbers are always JSON.
        serde_json::to_string(&camera).unwrap_or_default()
    };
    let lines: Vec<String> = cameras.iter().enumerate().map(line).collect();
    format!("[\n{}\n]\n", lines.join(",\n"))
}

/// A camera of INRIA's `cameras.json`: `rotation` and `position` lead from the camera to the world. Their trainer writes no
/// principal point, which is then in the middle.
#[derive(serde::Deserialize, serde::Serialize)]
struct TrainerCamera {
    #[serde(default, skip_deserializing)]
    id: usize,
    img_name: Option<String>,
    width: u32,
    height: u32,
    position: [f32; 3],
    rotation: [[f32; 3]; 3],
    fx: f32,
    fy: f32,
    #[serde(default)]
    cx: Option<f32>,
    #[serde(default)]
    cy: Option<f32>,
}

impl TrainerCamera {
    fn new(id: usize, camera: &Camera) -> Self {
        let &Camera { width, height, position, focal: [fx, fy], principal: [cx, cy], .. } = camera;
        let rotation = transposed(camera.rotation);
        let (img_name, cx, cy) = (Some(camera.name.clone()), Some(cx), Some(cy));
        Self { id, img_name, width, height, position, rotation, fx, fy, cx, cy }
    }

    fn view(self, at: usize) -> CapturedView {
        let camera = Camera {
            name: self.img_name.clone().unwrap_or_else(|| format!("camera_{at:04}")),
            width: self.width,
            height: self.height,
            focal: [self.fx, self.fy],
            principal: [
                self.cx.unwrap_or(0.5 * self.width as f32),
                self.cy.unwrap_or(0.5 * self.height as f32),
            ],
            rotation: transposed(self.rotation),
            position: self.position,
        };
        CapturedView { camera, picture: self.img_name.map(PathBuf::from), is_distorted: false }
    }
}

/// `transforms.json`. Intrinsics stand in the file or with a frame, which wins.
#[derive(Default)]
struct Transforms {
    intrinsics: Intrinsics,
    frames: Option<Limited<TransformFrame>>,
    /// Points of nerfstudio: a PLY file beside this one.
    ply_file_path: Option<String>,
}

impl Taken for Transforms {
    fn take<'de, A: MapAccess<'de>>(&mut self, key: &str, map: &mut A) -> Result<(), A::Error> {
        match key {
            "frames" => self.frames = Some(map.next_value()?),
            "ply_file_path" => self.ply_file_path = map.next_value()?,
            _ => self.intrinsics.take(key, map)?,
        }
        Ok(())
    }

    fn missing(&self) -> Option<&'static str> {
        self.frames.is_none().then_some("frames")
    }
}

impl<'de> Deserialize<'de> for Transforms {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Object::new("transforms"))
    }
}

#[derive(Default)]
struct Intrinsics {
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f32>,
    fl_y: Option<f32>,
    cx: Option<f32>,
    cy: Option<f32>,
    camera_angle_x: Option<f32>,
    camera_angle_y: Option<f32>,
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

impl Taken for Intrinsics {
    fn take<'de, A: MapAccess<'de>>(&mut self, key: &str, map: &mut A) -> Result<(), A::Error> {
        match key {
            "w" => self.w = map.next_value()?,
            "h" => self.h = map.next_value()?,
            "fl_x" => self.fl_x = map.next_value()?,
            "fl_y" => self.fl_y = map.next_value()?,
            "cx" => self.cx = map.next_value()?,
            "cy" => self.cy = map.next_value()?,
            "camera_angle_x" => self.camera_angle_x = map.next_value()?,
            "camera_angle_y" => self.camera_angle_y = map.next_value()?,
            "camera_model" => self.camera_model = map.next_value()?,
            "is_fisheye" => self.is_fisheye = map.next_value()?,
            "k1" => self.k1 = map.next_value()?,
            "k2" => self.k2 = map.next_value()?,
            "k3" => self.k3 = map.next_value()?,
            "k4" => self.k4 = map.next_value()?,
            "p1" => self.p1 = map.next_value()?,
            "p2" => self.p2 = map.next_value()?,
            _ => drop(map.next_value::<IgnoredAny>()?),
        }
        Ok(())
    }
}

impl Intrinsics {
    /// Whether the lens bends straight lines.
    fn is_distorted(&self) -> bool {
        let Self { k1, k2, k3, k4, p1, p2, .. } = self;
        [k1, k2, k3, k4, p1, p2].into_iter().flatten().any(|&part| part != 0.0)
    }

    /// # Errors
    /// A model of a camera that is not a pinhole, even without distortion.
    fn check_model(&self) -> Result<(), &'static str> {
        let is_pinhole = match self.camera_model.as_deref() {
            None => true,
            Some(model) => ["PINHOLE", "SIMPLE_PINHOLE", "OPENCV", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV"]
                .contains(&model),
        };
        if is_pinhole && self.is_fisheye != Some(true) {
            return Ok(());
        }
        Err(
            "camera_model is that of a fisheye or panoramic lens: undistort the pictures to PINHOLE cameras first",
        )
    }
}

#[derive(Default)]
struct TransformFrame {
    file_path: Option<String>,
    transform_matrix: Option<Matrix>,
    intrinsics: Intrinsics,
}

impl Taken for TransformFrame {
    fn take<'de, A: MapAccess<'de>>(&mut self, key: &str, map: &mut A) -> Result<(), A::Error> {
        match key {
            "file_path" => self.file_path = map.next_value()?,
            "transform_matrix" => self.transform_matrix = Some(map.next_value()?),
            _ => self.intrinsics.take(key, map)?,
        }
        Ok(())
    }

    fn missing(&self) -> Option<&'static str> {
        self.transform_matrix.is_none().then_some("transform_matrix")
    }
}

impl<'de> Deserialize<'de> for TransformFrame {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Object::new("a frame"))
    }
}

/// The side of the pictures of NeRF-synthetic, pixels.
const NERF_SYNTHETIC_SIDE: f64 = 800.0;

impl Transforms {
    fn views(self) -> Result<Vec<CapturedView>, CameraError> {
        let shared = &self.intrinsics;
        let frames = self.frames.unwrap_or_default().all();
        let frames = frames.ok_or(CameraError::TooMany { most: MAX_VIEWS })?;
        let view = |(at, frame): (usize, TransformFrame)| {
            let refused = |why| CameraError::Camera { camera: at, why };
            shared.check_model().and_then(|()| frame.intrinsics.check_model()).map_err(refused)?;
            Ok(CapturedView {
                camera: frame.camera(shared, at).map_err(refused)?,
                is_distorted: shared.is_distorted() || frame.intrinsics.is_distorted(),
                picture: frame.file_path.map(PathBuf::from),
            })
        };
        frames.into_iter().enumerate().map(view).collect()
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
        let of_angle =
            |angle: Option<f32>, side: u32| angle.map(|angle| 0.5 * side as f32 / libm::tanf(0.5 * angle));
        let from_angle = of_angle(own.camera_angle_x.or(shared.camera_angle_x), width);
        let from_height = of_angle(own.camera_angle_y.or(shared.camera_angle_y), height);
        let focal_x = own.fl_x.or(shared.fl_x).or(from_angle);
        let focal_x = focal_x.ok_or("there is no focal length: add fl_x or camera_angle_x to the file")?;
        let [right, up, back, position] = self.transform_matrix.unwrap_or_default().columns()?;
        Ok(Camera {
            name: self
                .file_path
                .as_deref()
                .and_then(super::stem)
                .unwrap_or_else(|| format!("camera_{at:04}")),
            width,
            height,
            focal: [focal_x, own.fl_y.or(shared.fl_y).or(from_height).unwrap_or(focal_x)],
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

#[expect(clippy::indexing_slicing, reason = "columns are 0, 1 and 2")]
fn transposed(rows: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
    [0, 1, 2].map(|column| rows.map(|row| row[column]))
}
