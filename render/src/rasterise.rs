//! A frame of Gaussians to a picture: projection, depth order, tiles, blending.
//!
//! Source: Kerbl et al., "3D Gaussian splatting for real-time radiance field rendering", 2023, after Zwicker et
//! al., "EWA splatting", 2002; the compensation of the low-pass filter after Yu et al., "Mip-Splatting", 2024.
//! Where the programs in use differ: a Gaussian reaches as far as its alpha is 1/255 or more (no cut at 3
//! sigma), alpha is at most 0.99, and a pixel is done when less than 1/10,000 of the light would pass.

mod block;
mod lanes;
mod project;
mod reach;
mod rows;
mod tile;

use crate::camera::Camera;
use crate::image::Image;
pub(crate) use lanes::{Lanes, TILE};
pub use project::LOW_PASS;
use project::project;
pub(crate) use project::{Shapes, Splat, near, opacity, seen_slopes, semi_axes};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use reach::reachable;
use rows::{RowEntries, TileRows};
use splatstream_gaussians::GaussianFrame;
pub(crate) use tile::{Blend, LOG2_MAX_ALPHA, MAX_ALPHA, Tile, blend_tile, exp2};

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
    PreparedFrame::new(frame).strips(camera, background, Strips::ALL)
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

    /// Draws some strips of a picture, one below the other. Each pixel is as in the [whole picture](render).
    #[must_use]
    pub fn strips(&self, camera: &Camera, background: [f32; 3], strips: Strips) -> Rendering {
        draw(self, camera, background, (strips, pulp::Arch::new()))
    }
}

/// The Gaussians that touch some strips of a picture, by rising row, and a few that nearly do: a frame of these draws the
/// same strips, but for what is too near to be drawn.
#[must_use]
pub fn touching_strips(frame: &GaussianFrame, camera: &Camera, strips: Strips) -> Vec<u32> {
    reachable(frame, &Sight::strips(camera, strips))
}

/// Draws some strips of a picture, one below the other, as [`PreparedFrame::strips`] does, but works out nothing of the
/// Gaussians that do not touch them: faster than that for a few strips of one view.
#[must_use]
pub fn draw_strips(
    frame: &GaussianFrame,
    camera: &Camera,
    background: [f32; 3],
    strips: Strips,
) -> Rendering {
    let (sight, near) = (Sight::strips(camera, strips), near(frame, camera));
    let shown = frame.select(&reachable(frame, &sight));
    let view = View::beyond(&shown, &Shapes::of(&shown), &sight, near);
    paint(&view, &sight, background, pulp::Arch::new())
}

/// Draws with the instructions of `arch`, which change nothing but the time.
fn draw(
    prepared: &PreparedFrame<'_>,
    camera: &Camera,
    background: [f32; 3],
    (strips, arch): (Strips, pulp::Arch),
) -> Rendering {
    let sight = Sight::strips(camera, strips);
    paint(&View::new(prepared.frame, &prepared.shapes, &sight), &sight, background, arch)
}

/// Draws what a camera sees.
#[expect(clippy::arithmetic_side_effects, reason = "sizes of a picture in memory")]
pub(crate) fn paint(view: &View, sight: &Sight<'_>, background: [f32; 3], arch: pulp::Arch) -> Rendering {
    let (width, height) = (sight.camera.width as usize, sight.camera.height as usize);
    let rows: Vec<usize> = sight.strips.rows(height.div_ceil(TILE)).collect();
    let lines: usize = rows.iter().map(|row| TILE.min(height - row * TILE)).sum();
    let mut pixels = vec![[0.0; 3]; width * lines];
    let mut alpha = vec![0.0; width * lines];
    let bands = pixels.par_chunks_mut(width * TILE).zip(alpha.par_chunks_mut(width * TILE));
    bands.zip(rows).with_max_len(1).for_each(|((pixels, alpha), row)| {
        let entries = arch.dispatch(SortRow { view, row });
        // One row may hold nearly all that is drawn.
        blocks(pixels, alpha, width).into_par_iter().enumerate().for_each(|(number, pixels)| {
            arch.dispatch(DrawBlock { view, row, entries: &entries, number, pixels, background });
        });
    });
    Rendering { colour: Image::new(width, pixels), alpha }
}

/// Strips of 16 lines of a picture: errors of a few of them are nearly those of the whole picture, and cost little.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strips {
    /// The first strip, counted from the top.
    pub first: u32,
    /// From one strip to the next, 1 or more. Of a picture with fewer strips than this, one is drawn.
    pub every: u32,
}

impl Strips {
    /// The whole picture.
    pub const ALL: Self = Self { first: 0, every: 1 };

    /// Lines of a strip.
    pub const LINES: u32 = TILE as u32;

    /// As many of them, of a picture of so many strips.
    fn within(self, count: usize) -> Self {
        let every = self.every.clamp(1, count.max(1) as u32);
        Self { first: self.first.checked_rem(every).unwrap_or_default(), every }
    }

    /// The rows of tiles among so many.
    fn rows(self, count: usize) -> impl Iterator<Item = usize> {
        (self.first as usize..count).step_by(self.every.max(1) as usize)
    }
}

/// A camera, and what is drawn of its picture.
#[derive(Clone, Copy)]
pub(crate) struct Sight<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) strips: Strips,
}

impl<'a> Sight<'a> {
    /// A whole picture.
    pub(crate) const fn of(camera: &'a Camera) -> Self {
        Self { camera, strips: Strips::ALL }
    }

    /// Some strips of it.
    fn strips(camera: &'a Camera, strips: Strips) -> Self {
        Self { camera, strips: strips.within((camera.height as usize).div_ceil(TILE)) }
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
        Self::beyond(frame, shapes, sight, near(frame, sight.camera))
    }

    /// The same of what is at least so deep in the view.
    fn beyond(frame: &GaussianFrame, shapes: &Shapes, sight: &Sight<'_>, near: f32) -> Self {
        let splats = project(frame, shapes, sight, near);
        let rows = TileRows::new(&splats, sight);
        Self { splats, rows }
    }
}

/// Tiles of a block: some of a row that lie side by side.
const BLOCK: usize = 4;

/// Colours and alpha of the pixels of a line.
type Line<'a> = (&'a mut [[f32; 3]], &'a mut [f32]);

/// The lines of each block of a row of tiles, from the pixels of that row.
fn blocks<'a>(pixels: &'a mut [[f32; 3]], alpha: &'a mut [f32], width: usize) -> Vec<Vec<Line<'a>>> {
    let lines = pixels.chunks_mut(width).zip(alpha.chunks_mut(width));
    let cut = |(pixels, alpha): Line<'a>| pixels.chunks_mut(BLOCK * TILE).zip(alpha.chunks_mut(BLOCK * TILE));
    let mut lines: Vec<_> = lines.map(cut).collect();
    (0..width.div_ceil(BLOCK * TILE)).map(|_| lines.iter_mut().filter_map(Iterator::next).collect()).collect()
}

/// Sorts the ellipses of a row into its tiles.
struct SortRow<'a> {
    view: &'a View,
    row: usize,
}

impl WithSimd for SortRow<'_> {
    type Output = RowEntries;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> RowEntries {
        let View { splats, rows } = self.view;
        rows.entries(self.row, splats)
    }
}

/// Draws one block of a row of tiles.
struct DrawBlock<'a> {
    view: &'a View,
    row: usize,
    entries: &'a RowEntries,
    number: usize,
    pixels: Vec<Line<'a>>,
    background: [f32; 3],
}

impl WithSimd for DrawBlock<'_> {
    type Output = ();

    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "tiles lie within the block, lanes and lines within tiles")]
    #[expect(clippy::arithmetic_side_effects, reason = "sizes of a picture in memory")]
    fn with_simd<S: Simd>(self, _: S) {
        let View { splats, rows } = self.view;
        let Self { row, entries, number, mut pixels, background, .. } = self;
        let first = number * BLOCK;
        for column in first..entries.tiles().min(first + BLOCK) {
            let mut tile = Tile::new(row, column, rows.size());
            let mut ink = Ink::default();
            blend_tile(splats, entries.of_tile(column), &mut tile, &mut ink);
            let left = (column - first) * TILE;
            let lines = pixels.iter_mut().zip(ink.light.iter().zip(tile.transmittance()));
            for ((pixels, alpha), (light, passed)) in lines {
                let line = pixels[left..].iter_mut().zip(&mut alpha[left..]).take(TILE);
                for (lane, (pixel, alpha)) in line.enumerate() {
                    *pixel = [0, 1, 2].map(|c| light[c][lane] + passed[lane] * background[c]);
                    *alpha = 1.0 - passed[lane];
                }
            }
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
                draw(&PreparedFrame::new(&frame), &camera, [0.5; 3], (Strips::ALL, pulp::Arch::Scalar));
            assert_eq!(render(&frame, &camera, [0.5; 3]), plain);
        }
    }

    #[test]
    fn strips_are_parts_of_the_picture() {
        let frame = BuiltinScene { gaussians: 5_000, ..BuiltinScene::default() }.frame(0);
        for (camera, first) in ring(&frame, Up::default(), 3, 133).iter().zip(0..) {
            let whole = render(&frame, camera, [0.5; 3]);
            let strips = Strips { first, every: 4 };
            let drawn = PreparedFrame::new(&frame).strips(camera, [0.5; 3], strips);
            let line = camera.width as usize * TILE;
            let chunks: Vec<&[[f32; 3]]> = whole.colour.pixels().chunks(line).collect();
            let expected: Vec<[f32; 3]> =
                strips.within(chunks.len()).rows(chunks.len()).flat_map(|row| chunks[row]).copied().collect();
            assert_eq!(drawn.colour.pixels(), expected);
            assert_eq!(draw_strips(&frame, camera, [0.5; 3], strips), drawn);
        }
    }
}
