//! Writing `.glb`.

use super::EXTENSION;
use super::accessor::{FLOAT, UNSIGNED_BYTE};
use super::container::{BINARY, JSON, MAGIC, VERSION};
use super::primitive::{REQUIRED, sh_names};
use crate::axes::Flip;
use crate::byte_values::{byte_of_logit, is_beyond_scales, scale_of_log, to_byte};
use crate::clamped::Clamped;
use crate::error::SceneError;
use crate::reading::row_of;
use crate::srgb;
use serde_json::{Map, Value, json};
use splatstream_gaussians::GaussianFrame;
use splatstream_gaussians::activation::{colour_of_dc, sigmoid};
use splatstream_gaussians::rotation::normalised;

/// What a bufferView of attributes is for.
const ARRAY_BUFFER: u32 = 34962;

/// Writes a frame as a `.glb`: one primitive with all attributes as floats, in the order of the frame, and `COLOR_0` for viewers
/// that show points.
///
/// Centres, rotations and coefficients are exact but for signs. Log scales come back within 2⁻²² of their size plus 2⁻²²,
/// down to ln 1e-10, below which they come back as that; opacities within 2⁻²⁴.
///
/// # Errors
/// A frame that does not pass [`GaussianFrame::validate`], or more than the 4 GiB that the format can hold.
pub fn write(frame: &GaussianFrame) -> Result<Vec<u8>, SceneError> {
    frame.validate()?;
    let mut parts = Parts::default();
    parts.add_floats(REQUIRED[0], 3, centres(frame));
    parts.add_floats(REQUIRED[1], 4, rotations(frame));
    parts.add_floats(REQUIRED[2], 3, rows(frame, |row| row_of(frame.log_scale(), row).map(scale_of_log)));
    let opacity = |&logit: &f32| sigmoid(logit.into()) as f32;
    parts.add_floats(REQUIRED[3], 1, frame.opacity_logit().iter().map(opacity).collect());
    parts.add_floats(REQUIRED[4], 3, rows(frame, |row| row_of(frame.dc(), row)));
    let coefficients = frame.sh().as_chunks::<3>().0.iter();
    for ((planes, name), sign) in coefficients.zip(sh_names(frame.sh_degree())).zip(Flip::of_gltf().sh()) {
        parts.add_floats(&name, 3, rows(frame, |row| row_of(planes, row).map(|value| value * sign)));
    }
    parts.add_colours(frame);
    if let Some(Value::Object(centres)) = parts.accessors.first_mut() {
        let (least, most) = bounds(frame);
        centres.insert("min".to_owned(), json!(least));
        centres.insert("max".to_owned(), json!(most));
    }
    container(&parts)
}

/// The values that [`write()`] cannot keep: semi-axes beyond the largest float.
pub fn clamped(frame: &GaussianFrame) -> Vec<Clamped> {
    Clamped::of("log_scale", frame.log_scale(), |_, log| is_beyond_scales(log)).into_iter().collect()
}

/// Values of each Gaussian, one Gaussian after another.
fn rows<const N: usize>(frame: &GaussianFrame, row: impl Fn(usize) -> [f32; N]) -> Vec<f32> {
    (0..frame.len()).flat_map(row).collect()
}

fn centres(frame: &GaussianFrame) -> Vec<f32> {
    let [x, y, z] = Flip::of_gltf().position();
    rows(frame, |row| {
        let centre = row_of(frame.position(), row);
        [centre[0] * x, centre[1] * y, centre[2] * z]
    })
}

/// x, y, z, w at unit length.
fn rotations(frame: &GaussianFrame) -> Vec<f32> {
    let signs = Flip::of_gltf().rotation();
    rows(frame, |row| {
        // Validated: no quaternion is zero.
        let [w, x, y, z] = normalised(row_of(frame.rotation(), row)).unwrap_or([1.0, 0.0, 0.0, 0.0]);
        [x * signs[0], y * signs[1], z * signs[2], w]
    })
}

/// The least and the greatest coordinates, which glTF wants of centres; floats as they are, in double precision.
fn bounds(frame: &GaussianFrame) -> ([f64; 3], [f64; 3]) {
    let signs = Flip::of_gltf().position();
    let (mut least, mut most) = ([0.0; 3], [0.0; 3]);
    let axes = frame.position().iter().zip(signs).zip(least.iter_mut().zip(&mut most));
    for ((plane, sign), (least, most)) in axes {
        let values = || plane.iter().map(|&value| f64::from(value * sign));
        if !plane.is_empty() {
            *least = values().fold(f64::INFINITY, f64::min);
            *most = values().fold(f64::NEG_INFINITY, f64::max);
        }
    }
    (least, most)
}

/// The attributes so far, and their bytes.
#[derive(Default)]
struct Parts {
    attributes: Map<String, Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    binary: Vec<u8>,
}

impl Parts {
    /// Adds floats, as many to a value as its type has.
    fn add_floats(&mut self, name: &str, width: usize, values: Vec<f32>) {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let count = values.len().checked_div(width).unwrap_or(0);
        let kind = ["SCALAR", "SCALAR", "VEC2", "VEC3", "VEC4"].get(width).copied().unwrap_or("SCALAR");
        self.add(name, &bytes, json!({ "componentType": FLOAT, "count": count, "type": kind }));
    }

    /// Adds what viewers show that do not know Gaussians: their colours, which glTF wants in linear light, and opacities.
    fn add_colours(&mut self, frame: &GaussianFrame) {
        let linear = |dc: f32| to_byte(srgb::decode(colour_of_dc(dc).clamp(0.0, 1.0)) * 255.0);
        let colours = frame.opacity_logit().iter().enumerate().flat_map(|(row, &logit)| {
            let [red, green, blue] = row_of(frame.dc(), row).map(linear);
            [red, green, blue, byte_of_logit(logit)]
        });
        let description = json!({
            "componentType": UNSIGNED_BYTE, "normalized": true, "count": frame.len(), "type": "VEC4"
        });
        self.add("COLOR_0", &colours.collect::<Vec<u8>>(), description);
    }

    /// Adds values whose bytes are a multiple of four.
    fn add(&mut self, name: &str, bytes: &[u8], mut accessor: Value) {
        let index = self.accessors.len();
        if let Value::Object(fields) = &mut accessor {
            fields.insert("bufferView".to_owned(), index.into());
        }
        self.attributes.insert(name.to_owned(), index.into());
        self.accessors.push(accessor);
        self.views.push(json!({
            "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len(), "target": ARRAY_BUFFER
        }));
        self.binary.extend_from_slice(bytes);
    }
}

/// The whole file: a header, the JSON padded with blanks, and the attributes.
fn container(parts: &Parts) -> Result<Vec<u8>, SceneError> {
    let gaussians = json!({
        "kernel": "ellipse", "colorSpace": "srgb_rec709_display",
        "sortingMethod": "cameraDistance", "projection": "perspective",
    });
    let document = json!({
        "asset": { "version": "2.0", "generator": concat!("SplatStream ", env!("CARGO_PKG_VERSION")) },
        "extensionsUsed": [EXTENSION],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "mode": 0, "attributes": parts.attributes, "extensions": { EXTENSION: gaussians },
        }] }],
        "accessors": parts.accessors,
        "bufferViews": parts.views,
        "buffers": [{ "byteLength": parts.binary.len() }],
    });
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = json.len().saturating_add(parts.binary.len()).saturating_add(28);
    let [length, of_json, of_binary] = [length, json.len(), parts.binary.len()].map(u32::try_from);
    let (Ok(length), Ok(of_json), Ok(of_binary)) = (length, of_json, of_binary) else {
        let what = format!("{} bytes of attributes", parts.binary.len());
        return Err(SceneError::unsupported(what, "a .glb holds 4 GiB; split the scene"));
    };
    let mut out = Vec::with_capacity(length as usize);
    out.extend([MAGIC, VERSION.to_le_bytes(), length.to_le_bytes()].as_flattened());
    out.extend([of_json.to_le_bytes(), JSON].as_flattened());
    out.extend(json);
    out.extend([of_binary.to_le_bytes(), BINARY].as_flattened());
    out.extend_from_slice(&parts.binary);
    Ok(out)
}
