//! A frame of Gaussians to a picture: projection, depth order, tiles, blending.
//!
//! Source: Kerbl et al., "3D Gaussian splatting for real-time radiance field rendering", 2023, after Zwicker et
//! al., "EWA splatting", 2002; the compensation of the low-pass filter after Yu et al., "Mip-Splatting", 2024.
//! Where the programs in use differ: a Gaussian reaches as far as its alpha is 1/255 or more (no cut at 3
//! sigma), alpha is at most 0.99, and a pixel is done when less than 1/10,000 of the light would pass.

mod block;
mod project;
mod rows;
mod tile;

use crate::camera::Camera;
use crate::image::Image;
pub(crate) use block::Block;
pub(crate) use project::{LOW_PASS, Shapes, Splat, near, seen_slopes};
use project::{project, touching};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use rows::TileRows;
use splatstream_gaussians::GaussianFrame;
pub(crate) use tile::{Blend, LOG2_MAX_ALPHA, Lanes, MAX_ALPHA, Tile, blend_tile, exp2};

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
    PreparedFrame::new(frame).tiles(camera, background, Tiles::ALL)
}

/// A frame, and what is the same of it in all views, worked out once.
pub struct PreparedFrame<'a> {
    pub(crate) frame: &'a GaussianFrame,
    pub(crate) shapes: Shapes,
}

impl<'a> PreparedFrame<'a> {
    /// Prepares a frame to be drawn.
    #[must_use]
    pub fn new(frame: &'a GaussianFrame) -> Self {
        Self { frame, shapes: Shapes::of(frame) }
    }

    /// Draws some tiles of a picture. Each pixel is as in the [whole picture](render); those of less than all tiles come one
    /// below the other, the lines of a row of tiles from the top.
    #[must_use]
    pub fn tiles(&self, camera: &Camera, background: [f32; 3], tiles: Tiles) -> Rendering {
        draw(self, camera, background, (tiles, pulp::Arch::new()))
    }

    /// The Gaussians that may touch some tiles of a picture, by rising row: a frame of these draws the same tiles.
    #[must_use]
    pub fn touching(&self, camera: &Camera, tiles: Tiles) -> Vec<u32> {
        touching(self.frame, &self.shapes, &Sight::of_tiles(camera, tiles))
    }
}

/// Draws with the instructions of `arch`, which change nothing but the time.
fn draw(
    prepared: &PreparedFrame<'_>,
    camera: &Camera,
    background: [f32; 3],
    (tiles, arch): (Tiles, pulp::Arch),
) -> Rendering {
    let sight = Sight::of_tiles(camera, tiles);
    paint(&View::new(prepared.frame, &prepared.shapes, &sight), &sight, background, arch)
}

/// Draws what a camera sees.
#[expect(clippy::arithmetic_side_effects, reason = "sizes of a picture in memory")]
pub(crate) fn paint(view: &View, sight: &Sight<'_>, background: [f32; 3], arch: pulp::Arch) -> Rendering {
    let (width, height) = (sight.camera.width as usize, sight.camera.height as usize);
    let of_row = |row: usize| {
        let widths = sight.tiles.columns(row, width.div_ceil(TILE)).map(|column| across(column, width));
        widths.sum::<usize>() * across(row, height)
    };
    let sizes: Vec<usize> = (0..height.div_ceil(TILE)).map(of_row).collect();
    let mut pixels = vec![[0.0; 3]; sizes.iter().sum()];
    let mut alpha = vec![0.0; pixels.len()];
    let mut left = (pixels.as_mut_slice(), alpha.as_mut_slice());
    let row = |(row, size): (usize, usize)| {
        let (pixels, rest) = core::mem::take(&mut left.0).split_at_mut(size);
        let (alpha, other) = core::mem::take(&mut left.1).split_at_mut(size);
        left = (rest, other);
        DrawRow { view, row, tiles: sight.tiles, pixels, alpha, background }
    };
    let rows: Vec<DrawRow<'_>> = sizes.into_iter().enumerate().map(row).collect();
    rows.into_par_iter().with_max_len(1).for_each(|row| arch.dispatch(row));
    let line = if sight.tiles == Tiles::ALL { width } else { 1 };
    Rendering { colour: Image::new(line, pixels), alpha }
}

/// Pixels of a row or column of tiles, of a picture of so many.
#[expect(clippy::arithmetic_side_effects, reason = "tiles begin within the picture")]
fn across(tile: usize, size: usize) -> usize {
    TILE.min(size - tile * TILE)
}

/// Some of the tiles of a picture, squares of 16 pixels, spread evenly over all of it: the errors of a few of them are
/// nearly those of the whole picture, and cost little.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiles {
    /// The first tile of the first row, counted from the left.
    pub first: u32,
    /// From one tile of a row to the next, 1 or more; of a row with fewer tiles than this one is drawn.
    pub every: u32,
}

impl Tiles {
    /// The whole picture.
    pub const ALL: Self = Self { first: 0, every: 1 };

    /// As many of them, of a picture that has so many in a row.
    pub(crate) fn within(self, across: usize) -> Self {
        let every = self.every.clamp(1, across.max(1) as u32);
        Self { first: self.first.checked_rem(every).unwrap_or_default(), every }
    }

    /// The first that is drawn in a row: further to the right from row to row, so that none of their columns stand out.
    #[expect(clippy::arithmetic_side_effects, reason = "sizes of a picture in memory; `every` is 1 or more")]
    fn start(self, row: usize) -> usize {
        let every = self.every.max(1) as usize;
        (self.first as usize + row * (3 * every / 8 | 1)) % every
    }

    /// The columns that are drawn of a row with so many tiles.
    pub(crate) fn columns(self, row: usize, across: usize) -> impl Iterator<Item = usize> {
        (self.start(row)..across).step_by(self.every.max(1) as usize)
    }

    /// Whether one of those is drawn that lie from the first to the second column and row.
    #[inline(always)]
    #[expect(clippy::arithmetic_side_effects, reason = "sizes of a picture in memory; `every` is 1 or more")]
    pub(crate) fn any(self, [left, right]: [usize; 2], [top, bottom]: [usize; 2]) -> bool {
        let every = self.every.max(1) as usize;
        // Every so many columns of a row, or rows of a column, hold one.
        let wide = right + 1 - left;
        wide >= every || (top..=bottom).any(|row| (self.start(row) + every - left % every) % every < wide)
    }
}

/// A camera, and what is drawn of its picture.
#[derive(Clone, Copy)]
pub(crate) struct Sight<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) tiles: Tiles,
}

impl<'a> Sight<'a> {
    /// A whole picture.
    pub(crate) const fn of(camera: &'a Camera) -> Self {
        Self { camera, tiles: Tiles::ALL }
    }

    /// Some tiles of a picture.
    fn of_tiles(camera: &'a Camera, tiles: Tiles) -> Self {
        Self { camera, tiles: tiles.within((camera.width as usize).div_ceil(TILE)) }
    }
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
    pub(crate) fn new(frame: &GaussianFrame, shapes: &Shapes, sight: &Sight<'_>) -> Self {
        let splats = project(frame, shapes, sight);
        let rows = TileRows::new(&splats, sight);
        Self { splats, rows }
    }
}

/// Draws the tiles of a row, side by side.
struct DrawRow<'a> {
    view: &'a View,
    row: usize,
    tiles: Tiles,
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
        let [width, height] = rows.size();
        let line = self.pixels.len() / across(self.row, height);
        let mut left = 0;
        for column in self.tiles.columns(self.row, entries.tiles()) {
            let mut tile = Tile::new(self.row, column, rows.size());
            let mut ink = Ink::default();
            blend_tile(splats, entries.of_tile(column), &mut tile, &mut ink);
            let right = left + across(column, width);
            let lines = self.pixels.chunks_mut(line).zip(self.alpha.chunks_mut(line));
            for ((pixels, alpha), (light, passed)) in lines.zip(ink.light.iter().zip(tile.transmittance())) {
                let line = pixels[left..right].iter_mut().zip(&mut alpha[left..right]);
                for (lane, (pixel, alpha)) in line.enumerate() {
                    *pixel = [0, 1, 2].map(|c| light[c][lane] + passed[lane] * self.background[c]);
                    *alpha = 1.0 - passed[lane];
                }
            }
            left = right;
        }
    }
}

/// Red, green and blue of each line of a tile.
pub(crate) type Light = [[Lanes; 3]; TILE];

/// Collects the colour of a tile: at first it has no light.
#[derive(Default)]
pub(crate) struct Ink {
    pub(crate) light: Light,
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
            let plain =
                draw(&PreparedFrame::new(&frame), &camera, [0.5; 3], (Tiles::ALL, pulp::Arch::Scalar));
            assert_eq!(render(&frame, &camera, [0.5; 3]), plain);
        }
    }

    #[test]
    fn tiles_are_parts_of_the_picture() {
        let frame = BuiltinScene { gaussians: 5_000, ..BuiltinScene::default() }.frame(0);
        for (camera, first) in ring(&frame, Up::default(), 3, 133).iter().zip(0..) {
            let whole = render(&frame, camera, [0.5; 3]);
            let (width, height) = (camera.width as usize, camera.height as usize);
            let tiles = Tiles { first, every: 4 };
            let mut expected = Vec::new();
            for row in 0..height.div_ceil(TILE) {
                let columns: Vec<usize> = tiles.columns(row, width.div_ceil(TILE)).collect();
                for line in row * TILE..height.min((row + 1) * TILE) {
                    for column in &columns {
                        let part = column * TILE..width.min((column + 1) * TILE);
                        expected.extend_from_slice(&whole.colour.pixels()[line * width..][part]);
                    }
                }
            }
            let prepared = PreparedFrame::new(&frame);
            assert_eq!(prepared.tiles(camera, [0.5; 3], tiles).colour.pixels(), expected);
            // So do those alone that touch them, where the near plane is the same.
            let touching = prepared.touching(camera, tiles);
            assert!(touching.len() < frame.len());
            let alone = frame.select(&touching);
            let drawn = PreparedFrame::new(&alone).tiles(camera, [0.5; 3], tiles);
            assert_eq!(drawn.colour.pixels(), expected);
        }
    }

    #[test]
    fn a_part_of_a_picture_holds_a_tile_where_one_is_drawn_in_it() {
        for (every, first) in [(1, 0), (3, 2), (7, 4), (16, 9)] {
            let tiles = Tiles { first, every };
            for left in 0..20 {
                for right in left..left + 5 {
                    for top in 0..9 {
                        let is_drawn = |row| tiles.columns(row, 30).any(|c| (left..=right).contains(&c));
                        let expected = (top..=top + 1).any(is_drawn);
                        assert_eq!(tiles.any([left, right], [top, top + 1]), expected);
                    }
                }
            }
        }
    }
}
