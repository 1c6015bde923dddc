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

mod files;

use files::Files;
use splatstream_render::render;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let files = Files::write(30_000)?;
    for (variant, antialiased) in [("classic", false), ("antialiased", true)] {
        let frame = files.frame.clone().with_antialiased(antialiased);
        for (number, camera) in files.cameras.iter().enumerate() {
            let rendering = render(&frame, camera, [0.0; 3]);
            let pixels = rendering.colour.pixels().iter().zip(&rendering.alpha);
            let values = pixels.flat_map(|(colour, alpha)| colour.iter().chain(std::iter::once(alpha)));
            files.add(&format!("view-{number}-{variant}.f32"), values)?;
        }
    }
    Ok(())
}
