//! A scene, views of it, slopes by their pixels and the gradients that follow from them, for `render/checks/gradients.py`:
//!
//! ```text
//! gradients SCENE COUNT HEIGHT FOLDER
//! ```
//!
//! SCENE is a file, or `builtin`: 3,000 Gaussians made from a seed, many of them long and thin.
//!
//! `scene.f32` and `views.json` are those of the example `views`. `slopes-N.f32` holds what a loss gains with red, green and
//! blue of each pixel of view N: noise, and 0 outside of a few hundred pixels. `gradients-N-classic.f32` and
//! `gradients-N-antialiased.f32` hold planes as `scene.f32` does. Values are `f32`, lowest byte first.

mod files;

use files::Files;
use splatstream_gaussians::random::SplitMix64;
use splatstream_render::gradient::Gradients;
use splatstream_render::{Camera, Image, PreparedFrame};
use std::error::Error;

/// Pixels of a view that have slopes.
const PIXELS: usize = 400;

fn main() -> Result<(), Box<dyn Error>> {
    let files = Files::write(3_000)?;
    for (number, camera) in files.cameras.iter().enumerate() {
        let slopes = slopes(number as u64, camera);
        files.add(&format!("slopes-{number}.f32"), slopes.pixels().iter().flatten())?;
        for (variant, antialiased) in [("classic", false), ("antialiased", true)] {
            let frame = files.frame.clone().with_antialiased(antialiased);
            let mut gradients = Gradients::zero(&frame);
            PreparedFrame::new(&frame).draw(camera, [0.0; 3]).backward(&slopes, &mut gradients)?;
            let name = format!("gradients-{number}-{variant}.f32");
            files.add(&name, gradients.planes().iter().flatten())?;
        }
    }
    Ok(())
}

fn slopes(seed: u64, camera: &Camera) -> Image {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut random = SplitMix64::new(seed);
    let mut pixels = vec![[0.0; 3]; width * height];
    // In the middle third, where the scene is.
    for _ in 0..PIXELS {
        let (x, y) = (width / 3 + random.below(width / 3), height / 3 + random.below(height / 3));
        pixels[y * width + x] = [(); 3].map(|()| random.signed());
    }
    Image::new(width, pixels)
}
