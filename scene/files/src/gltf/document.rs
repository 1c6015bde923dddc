//! The JSON of glTF, as far as Gaussians need it. Indices and counts are as the file has them: not yet compared with
//! anything.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::EXPORT;
use crate::error::SceneError;
use crate::limits::Budget;

/// Bytes that a byte of JSON turns into, at most: the shortest nodes, of three bytes, take 80, and a vector that grows is there
/// twice for a moment.
const PARSED: u64 = 64;

/// The extensions for compressed Gaussians that are read: the newest first.
pub(super) const SPZ: [&str; 3] = [
    "KHR_gaussian_splatting_compression_spz_2",
    "KHR_gaussian_splatting_compression_spz",
    "KHR_spz_gaussian_splats_compression",
];

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    asset: Asset,
    pub(super) scene: Option<u32>,
    #[serde(default)]
    pub(super) scenes: Vec<Scene>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default)]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub(super) buffers: Vec<Buffer>,
    #[serde(default)]
    extensions_required: Vec<String>,
}

#[derive(Deserialize)]
struct Asset {
    version: String,
}

#[derive(Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub(super) nodes: Box<[u32]>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub(super) mesh: Option<u32>,
    #[serde(default)]
    pub(super) children: Box<[u32]>,
    /// Column by column.
    pub(super) matrix: Option<Box<[f64; 16]>>,
    pub(super) translation: Option<Box<[f64; 3]>>,
    /// x, y, z, w.
    pub(super) rotation: Option<Box<[f64; 4]>>,
    pub(super) scale: Option<Box<[f64; 3]>>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) primitives: Box<[Primitive]>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, u32>,
    pub(super) mode: Option<u32>,
    #[serde(default)]
    pub(super) extensions: PrimitiveExtensions,
}

#[derive(Deserialize, Default)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_gaussian_splatting")]
    pub(super) gaussians: Option<Box<Gaussians>>,
    /// A draft that stood by itself.
    #[serde(rename = "KHR_spz_gaussian_splats_compression")]
    pub(super) spz_draft: Option<Compressed>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Gaussians {
    pub(super) kernel: Option<String>,
    pub(super) color_space: Option<String>,
    #[serde(default)]
    pub(super) extensions: BTreeMap<String, Compressed>,
}

/// A compressed primitive.
#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    pub(super) buffer_view: Option<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<u32>,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) sparse: Option<Sparse>,
}

/// That there is one.
#[derive(Deserialize)]
pub(super) struct Sparse {}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: u32,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: Option<u64>,
    #[serde(default)]
    pub(super) extensions: BufferViewExtensions,
}

#[derive(Deserialize, Default)]
pub(super) struct BufferViewExtensions {
    #[serde(alias = "KHR_meshopt_compression")]
    #[serde(rename = "EXT_meshopt_compression")]
    pub(super) meshopt: Option<Sparse>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: u64,
}

impl Primitive {
    /// Whether it holds Gaussians.
    pub(super) fn is_gaussians(&self) -> bool {
        self.extensions.gaussians.is_some() || self.extensions.spz_draft.is_some()
    }
}

/// Bytes of memory that so many bytes of JSON turn into, at most.
pub(super) fn parsed_bytes(json: u64) -> u64 {
    json.saturating_mul(PARSED)
}

impl Document {
    pub(super) fn parse(json: &[u8], budget: &mut Budget) -> Result<Self, SceneError> {
        budget.take(parsed_bytes(json.len() as u64), "the JSON of the file")?;
        let document: Self = serde_json::from_slice(json).map_err(|error| broken(error.to_string()))?;
        let version = &document.asset.version;
        if version.split('.').next() != Some("2") {
            let what = format!("glTF of version \"{}\"", version.escape_default());
            return Err(SceneError::unsupported(what, "export the file as glTF 2.0"));
        }
        match document.extensions_required.iter().find(|name| is_unknown(name)) {
            Some(name) => {
                let what = format!("the file needs the extension {}", name.escape_default());
                Err(SceneError::unsupported(what, "export it without that extension"))
            }
            None => Ok(document),
        }
    }
}

/// Beginnings of the names of extensions that change nothing about Gaussians: of materials, textures, lights and animation.
const HARMLESS: [&str; 6] =
    ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "EXT_lights_", "KHR_animation_"];

/// Whether a file must not be read without an extension that is not known.
fn is_unknown(name: &str) -> bool {
    let is_known = name == super::EXTENSION || SPZ.contains(&name);
    !is_known && !HARMLESS.iter().any(|harmless| name.starts_with(harmless))
}

pub(super) fn broken(what: impl Into<String>) -> SceneError {
    SceneError::inconsistent(format!("glTF: {}", what.into()), EXPORT)
}
