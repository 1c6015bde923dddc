//! What the examples write for the scripts of `render/checks`: a scene, and views of it.

use serde_json::{Value, json};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::{ReadLimits, read_scene};
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use splatstream_render::camera::{Up, ring};
use std::error::Error;
use std::path::{Path, PathBuf};

/// A scene, views of it, and the folder that both are in as files.
pub(crate) struct Files {
    pub(crate) folder: PathBuf,
    pub(crate) frame: GaussianFrame,
    pub(crate) cameras: Vec<Camera>,
}

impl Files {
    /// Takes scene, count of views, height and folder from the command line; writes `scene.f32` and `views.json`. The scene is
    /// a file, or `builtin` with so many Gaussians.
    pub(crate) fn write(gaussians: u32) -> Result<Self, Box<dyn Error>> {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let [scene, count, height, folder] = arguments.as_slice() else {
            return Err("which views? See the head of the example's source".into());
        };
        let frame = match scene.as_str() {
            "builtin" => BuiltinScene { gaussians, ..BuiltinScene::default() }.frame(0),
            file => read_scene(Path::new(file), &ReadLimits::default())?,
        };
        let cameras = ring(&frame, Up::default(), count.parse()?, height.parse()?);
        let files = Self { folder: folder.into(), frame, cameras };
        let description = json!({
            "gaussians": files.frame.len(),
            "sh_degree": files.frame.sh_degree(),
            "views": files.cameras.iter().map(describe).collect::<Vec<Value>>(),
        });
        std::fs::write(files.folder.join("views.json"), description.to_string())?;
        files.add("scene.f32", files.frame.planes().iter().flatten())?;
        Ok(files)
    }

    /// Writes values as a file, lowest byte first.
    pub(crate) fn add<'a>(&self, name: &str, values: impl Iterator<Item = &'a f32>) -> std::io::Result<()> {
        let bytes: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
        std::fs::write(self.folder.join(name), bytes)
    }
}

fn describe(camera: &Camera) -> Value {
    json!({
        "size": [camera.width, camera.height],
        "focal": camera.focal,
        "principal": camera.principal,
        "rotation": camera.rotation,
        "position": camera.position,
    })
}
