//! What is written beside the pictures of a capture: cameras and points, for nerfstudio and for COLMAP.

use glam::{DMat3, DQuat, DVec3};
use serde::Serialize;
use splatstream_render::Camera;
use splatstream_render::camera::CapturedPoint;
use std::fmt::Write;

/// A file of a capture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedBytes {
    /// Its path below the directory of the capture, with slashes.
    pub path: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}

/// Cameras, points and the time of a capture.
#[derive(Clone, Copy, Debug)]
pub struct CaptureFiles<'a> {
    /// From where pictures are taken; each has its name.
    pub cameras: &'a [Camera],
    /// Points of the scene.
    pub points: &'a [CapturedPoint],
    /// When they are taken, seconds.
    pub seconds: f64,
}

#[derive(Serialize)]
struct Transforms<'a> {
    camera_model: &'static str,
    ply_file_path: &'static str,
    frames: Vec<TransformFrame<'a>>,
}

/// A camera with its intrinsics, which all readers take from a frame too.
#[derive(Serialize)]
struct TransformFrame<'a> {
    file_path: String,
    transform_matrix: [[f32; 4]; 4],
    time: f64,
    w: u32,
    h: u32,
    fl_x: &'a f32,
    fl_y: &'a f32,
    cx: &'a f32,
    cy: &'a f32,
}

/// Points beside `transforms.json`, as nerfstudio calls them.
const POINTS: &str = "sparse_pc.ply";

impl CaptureFiles<'_> {
    /// Where the picture of a camera belongs, below the directory of the capture.
    #[must_use]
    pub fn picture_path(camera: &Camera) -> String {
        format!("images/{}", picture_name(camera))
    }

    /// `transforms.json` with its points, and a model of COLMAP as text in `sparse/0`.
    #[must_use]
    pub fn files(&self) -> Vec<NamedBytes> {
        let named = |path: &str, bytes: Vec<u8>| NamedBytes { path: path.to_owned(), bytes };
        vec![
            named("transforms.json", self.transforms().into_bytes()),
            named(POINTS, self.ply()),
            named("sparse/0/cameras.txt", self.lenses().into_bytes()),
            named("sparse/0/images.txt", self.images().into_bytes()),
            named("sparse/0/points3D.txt", self.points().into_bytes()),
        ]
    }

    fn transforms(&self) -> String {
        let frame = |camera: &'_ Camera| {
            let [right, down, ahead] = camera.rotation;
            let row = |axis: usize| {
                // Their camera looks back along z, with y up.
                let of = |vector: [f32; 3]| vector.get(axis).copied().unwrap_or_default();
                [of(right), -of(down), -of(ahead), of(camera.position)]
            };
            (format!("images/{}", picture_name(camera)), [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
        };
        let frames = self.cameras.iter().map(|camera| {
            let (file_path, transform_matrix) = frame(camera);
            let Camera { width: w, height: h, focal: [fl_x, fl_y], principal: [cx, cy], .. } = camera;
            TransformFrame {
                file_path,
                transform_matrix,
                time: self.seconds,
                w: *w,
                h: *h,
                fl_x,
                fl_y,
                cx,
                cy,
            }
        });
        let all = Transforms { camera_model: "PINHOLE", ply_file_path: POINTS, frames: frames.collect() };
        // Strings and finite numbers are always JSON.
        let text = serde_json::to_string_pretty(&all).unwrap_or_default();
        format!("{text}\n")
    }

    fn ply(&self) -> Vec<u8> {
        let mut text =
            format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", self.points.len());
        for name in ["x", "y", "z"] {
            text.push_str(&format!("property float {name}\n"));
        }
        for name in ["red", "green", "blue"] {
            text.push_str(&format!("property uchar {name}\n"));
        }
        text.push_str("end_header\n");
        let mut bytes = text.into_bytes();
        for point in self.points {
            point.position.iter().for_each(|part| bytes.extend_from_slice(&part.to_le_bytes()));
            bytes.extend_from_slice(&point.colour);
        }
        bytes
    }

    /// One lens for each camera.
    fn lenses(&self) -> String {
        let mut text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n".to_owned();
        for (number, camera) in (1..).zip(self.cameras) {
            let Camera { width, height, focal: [fx, fy], principal: [cx, cy], .. } = camera;
            add(&mut text, format_args!("{number} PINHOLE {width} {height} {fx} {fy} {cx} {cy}\n"));
        }
        text
    }

    fn images(&self) -> String {
        let mut text =
            "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n"
                .to_owned();
        for (number, camera) in (1..).zip(self.cameras) {
            let wide = |row: [f32; 3]| DVec3::from(row.map(f64::from));
            // Columns are the camera's axes in the world: the way back.
            let axes = DMat3::from_cols_array_2d(&camera.rotation.map(|row| wide(row).to_array()));
            let [x, y, z, w] = DQuat::from_mat3(&axes.transpose()).normalize().to_array();
            let position = wide(camera.position);
            let [tx, ty, tz] = camera.rotation.map(|row| -wide(row).dot(position));
            let name = picture_name(camera);
            add(&mut text, format_args!("{number} {w} {x} {y} {z} {tx} {ty} {tz} {number} {name}\n\n"));
        }
        text
    }

    fn points(&self) -> String {
        let mut text =
            "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n".to_owned();
        for (number, CapturedPoint { position: [x, y, z], colour: [r, g, b] }) in (1..).zip(self.points) {
            add(&mut text, format_args!("{number} {x} {y} {z} {r} {g} {b} 0\n"));
        }
        text
    }
}

fn picture_name(camera: &Camera) -> String {
    format!("{}.png", camera.name)
}

/// Appends; text takes whatever is written.
fn add(text: &mut String, more: std::fmt::Arguments<'_>) {
    let _always_room = text.write_fmt(more);
}
