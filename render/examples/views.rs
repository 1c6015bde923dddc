//! A scene, views of it and their raw pixels as files, for `render/checks/gsplat.py`:
//!
//! ```text
//! views SCENE COUNT HEIGHT FOLDER
//! ```
//!
//! SCENE is a file, or `builtin`: 30,000 Gaussians made from a seed, many of them long and thin.
//!
//! `scene.f32` holds the planes one after another: position, log_scale, rotation, opacity, dc, SH.
//! `view-N-classic.f32` holds red, green, blue and alpha of each pixel over black, and
//! `view-N-antialiased.f32` the same with compensation of the low-pass filter. Values are `f32`, lowest byte
//! first. `views.json` says the rest.

use serde_json::{Value, json};
use splatstream_files::builtin::BuiltinScene;
use splatstream_files::{ReadLimits, read_scene};
use splatstream_render::camera::{Up, ring};
use splatstream_render::{Camera, Rendering, render};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, count, height, folder] = arguments.as_slice() else {
        return Err("which views? See the head of the example's source".into());
    };
    let folder = Path::new(folder);
    let frame = match scene.as_str() {
        "builtin" => BuiltinScene { gaussians: 30_000, ..BuiltinScene::default() }.frame(0),
        file => read_scene(Path::new(file), &ReadLimits::default())?,
    };
    let cameras = ring(&frame, Up::default(), count.parse()?, height.parse()?);
    let description = json!({
        "gaussians": frame.len(),
        "sh_degree": frame.sh_degree(),
        "views": cameras.iter().map(describe).collect::<Vec<Value>>(),
    });
    std::fs::write(folder.join("views.json"), description.to_string())?;
    std::fs::write(folder.join("scene.f32"), bytes(frame.planes().iter().flatten()))?;
    for (variant, antialiased) in [("classic", false), ("antialiased", true)] {
        let frame = frame.clone().with_antialiased(antialiased);
        for (number, camera) in cameras.iter().enumerate() {
            let rendering = render(&frame, camera, [0.0; 3]);
            std::fs::write(folder.join(format!("view-{number}-{variant}.f32")), pixels(&rendering))?;
        }
    }
    Ok(())
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

fn pixels(rendering: &Rendering) -> Vec<u8> {
    let pixels = rendering.colour.pixels().iter().zip(&rendering.alpha);
    bytes(pixels.flat_map(|(colour, alpha)| colour.iter().chain(std::iter::once(alpha))))
}

fn bytes<'a>(values: impl Iterator<Item = &'a f32>) -> Vec<u8> {
    values.flat_map(|value| value.to_le_bytes()).collect()
}
