//! A frame of Gaussians to a picture: projection, depth order, tiles, blending.
//!
//! Source: Kerbl et al., "3D Gaussian splatting for real-time radiance field rendering", 2023, after Zwicker et
//! al., "EWA splatting", 2002; the compensation of the low-pass filter after Yu et al., "Mip-Splatting", 2024.
//! Where the programs in use differ: a Gaussian reaches as far as its alpha is 1/255 or more (no cut at 3
//! sigma), alpha is at most 0.99, and a pixel is done when less than 1/10,000 of the light would pass.

mod project;
mod rows;
mod tile;

use crate::camera::Camera;
use crate::image::Image;
pub(crate) use project::Shapes;
use project::{Splat, project};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use rows::TileRows;
use splatstream_gaussians::GaussianFrame;
pub(crate) use tile::{Blend, Lanes, Tile, blend_tile};

/// Pixels on a side of a tile.
pub(crate) const TILE: usize = 16;

/// A picture and how much of each pixel the Gaussians cover.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendering {
    /// Colour over the background.
    pub colour: Image,
    /// 1 less the transmittance of each pixel, 0 to 1; row by row as the picture.
    pub alpha: Vec<f32>,
}

/// Draws a frame over one colour, with the compensation of the low-pass filter if the frame was made for it. The
/// picture is the same with any number of threads and on every machine.
///
/// Gaussians nearer to the camera than 1/256 of the mean depth of the scene in front of it, or with a projection that is
/// not finite, are left out.
/// Gaussians at one depth are drawn in the order of the frame.
pub fn render(frame: &GaussianFrame, camera: &Camera, background: [f32; 3]) -> Rendering {
    draw(frame, camera, background, pulp::Arch::new())
}

/// Draws with the instructions of `arch`, which change nothing but the time.
#[expect(clippy::arithmetic_side_effects, reason = "sizes of a picture in memory")]
fn draw(frame: &GaussianFrame, camera: &Camera, background: [f32; 3], arch: pulp::Arch) -> Rendering {
    let view = View::new(frame, &Shapes::of(frame), camera);
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut pixels = vec![[0.0; 3]; width * height];
    let mut alpha = vec![0.0; width * height];
    let bands = pixels.par_chunks_mut(width * TILE).zip(alpha.par_chunks_mut(width * TILE));
    bands.enumerate().with_max_len(1).for_each(|(row, (pixels, alpha))| {
        arch.dispatch(DrawRow { view: &view, row, pixels, alpha, background });
    });
    Rendering { colour: Image::new(width, pixels), alpha }
}

/// A frame as one camera sees it, before blending.
pub(crate) struct View {
    /// Ellipses, nearest first.
    pub(crate) splats: Vec<Splat>,
    /// Which of them touch which tiles.
    pub(crate) rows: TileRows,
}

impl View {
    /// Projects and sorts.
    pub(crate) fn new(frame: &GaussianFrame, shapes: &Shapes, camera: &Camera) -> Self {
        let splats = project(frame, shapes, camera);
        let rows = TileRows::new(&splats, camera);
        Self { splats, rows }
    }
}

/// Draws one row of tiles into the pixels of its lines.
struct DrawRow<'a> {
    view: &'a View,
    row: usize,
    pixels: &'a mut [[f32; 3]],
    alpha: &'a mut [f32],
    background: [f32; 3],
}

impl WithSimd for DrawRow<'_> {
    type Output = ();

    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "tiles lie within the picture, lanes and lines within tiles")]
    #[expect(clippy::arithmetic_side_effects, reason = "sizes of a picture in memory")]
    fn with_simd<S: Simd>(self, _: S) {
        let View { splats, rows } = self.view;
        let entries = rows.entries(self.row, splats);
        let [width, _] = rows.size();
        for column in 0..entries.tiles() {
            let mut tile = Tile::new(self.row, column, rows.size());
            let mut ink = Ink::default();
            blend_tile(splats, entries.of_tile(column), &mut tile, &mut ink);
            let left = column * TILE;
            let lines = self.pixels.chunks_mut(width).zip(self.alpha.chunks_mut(width));
            for ((pixels, alpha), (light, passed)) in lines.zip(ink.light.iter().zip(tile.transmittance())) {
                let line = pixels[left..].iter_mut().zip(&mut alpha[left..]).take(TILE);
                for (lane, (pixel, alpha)) in line.enumerate() {
                    *pixel = [0, 1, 2].map(|c| light[c][lane] + passed[lane] * self.background[c]);
                    *alpha = 1.0 - passed[lane];
                }
            }
        }
    }
}

/// Collects the colour of a tile: at first it has no light.
#[derive(Default)]
pub(crate) struct Ink {
    /// Red, green and blue of each line.
    pub(crate) light: [[Lanes; 3]; TILE],
}

impl Blend for Ink {
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "tiles lie within the picture, lanes and lines within tiles")]
    fn line(&mut self, colour: [f32; 3], line: usize, visible: &Lanes, _passing: &Lanes) {
        for (light, colour) in self.light[line].iter_mut().zip(colour) {
            for (light, visible) in light.iter_mut().zip(visible) {
                *light += visible * colour;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Up, ring};
    use splatstream_files::builtin::BuiltinScene;

    #[test]
    fn vector_instructions_draw_the_same_bits_as_plain_ones() {
        let frame = BuiltinScene { gaussians: 5_000, ..BuiltinScene::default() }.frame(0);
        for camera in ring(&frame, Up::default(), 2, 133) {
            let plain = draw(&frame, &camera, [0.5; 3], pulp::Arch::Scalar);
            assert_eq!(render(&frame, &camera, [0.5; 3]), plain);
        }
    }
}
