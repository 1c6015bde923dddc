//! Some tiles of the pictures of a frame, to compare those of another frame with.
//!
//! Tiles that are spread over a picture have nearly the errors of all of it, and are drawn in a part of the time. They are
//! of the size at which quality is meant, since small pictures hide errors that large ones show.

use crate::error::Error;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::metrics::{LOSSLESS_DB, psnr};
use splatstream_render::{Camera, PreparedFrame, Rendering, Tiles};

/// Around the scene.
const BACKGROUND: [f32; 3] = [0.0; 3];

/// Of frames of fewer Gaussians than the first more tiles are drawn, for the errors of a few Gaussians are in few places; of
/// those of more than the second fewer.
const FEW: usize = 1 << 17;
const MANY: usize = 1 << 19;

/// A tile in so many, of a frame of so many Gaussians, where it is one in `every` of usual frames.
#[expect(clippy::arithmetic_side_effects, reason = "small constants, and Gaussians in memory")]
fn tile_of(every: u32, gaussians: usize) -> u32 {
    match gaussians < FEW {
        true => (every as usize * gaussians / FEW).max(1) as u32,
        false => every * gaussians.div_ceil(MANY) as u32,
    }
}

/// Which tiles are taken of a view: at other places in each.
#[expect(clippy::arithmetic_side_effects, reason = "counts of cameras, and small constants")]
fn tiles(number: u32, every: u32) -> Tiles {
    Tiles { first: every / 2 + number * (every / 3).max(1), every }
}

/// A view of some tiles, and the Gaussians that these show.
pub(crate) struct SampledView {
    camera: Camera,
    tiles: Tiles,
    picture: Rendering,
    /// The Gaussians, and which they are.
    pub(crate) frame: GaussianFrame,
    pub(crate) rows: Vec<u32>,
}

impl SampledView {
    /// Of a frame that is prepared.
    fn new(frame: &GaussianFrame, prepared: &PreparedFrame<'_>, camera: &Camera, tiles: Tiles) -> Self {
        let rows = prepared.touching(camera, tiles);
        let frame = frame.select(&rows);
        let picture = PreparedFrame::new(&frame).tiles(camera, BACKGROUND, tiles);
        Self { camera: camera.clone(), tiles, picture, frame, rows }
    }

    /// PSNR of another version of the same Gaussians, dB; none if nothing can be seen.
    pub(crate) fn psnr(&self, frame: &GaussianFrame) -> Option<f64> {
        let drawn = PreparedFrame::new(frame).tiles(&self.camera, BACKGROUND, self.tiles);
        compared(&self.picture, &drawn)
    }
}

/// The mean of the decibels of the views in which something can be seen; none if there is no such view.
pub(crate) fn mean(decibels: impl Iterator<Item = Result<Option<f64>, Error>>) -> Result<Option<f64>, Error> {
    let decibels: Vec<f64> = decibels.filter_map(Result::transpose).collect::<Result<_, Error>>()?;
    Ok((!decibels.is_empty()).then(|| decibels.iter().sum::<f64>() / decibels.len() as f64))
}

/// Tiles of views in which frames are compared that are not in memory at the same time.
pub(crate) struct SampledViews {
    cameras: Vec<Camera>,
    every: u32,
}

impl SampledViews {
    /// One tile in `every` of each view, for frames of so many Gaussians.
    pub(crate) fn new(cameras: Vec<Camera>, every: u32, gaussians: usize) -> Self {
        Self { cameras, every: tile_of(every, gaussians) }
    }

    /// The tiles of a frame, to compare others of the same Gaussians with: of the views at some places.
    pub(crate) fn of(&self, frame: &GaussianFrame, places: impl Iterator<Item = usize>) -> Vec<SampledView> {
        let prepared = PreparedFrame::new(frame);
        let view = |place: usize| {
            let tiles = tiles(place as u32, self.every);
            Some(SampledView::new(frame, &prepared, self.cameras.get(place)?, tiles))
        };
        places.filter_map(view).collect()
    }

    /// How many views there are.
    pub(crate) fn len(&self) -> usize {
        self.cameras.len()
    }

    /// The tiles of a frame, view by view.
    pub(crate) fn draw(&self, frame: &GaussianFrame) -> impl Iterator<Item = Rendering> {
        let prepared = PreparedFrame::new(frame);
        let views = self.cameras.iter().zip(0..);
        views.map(move |(camera, number)| prepared.tiles(camera, BACKGROUND, tiles(number, self.every)))
    }

    /// Their mean PSNR where those of another frame have been drawn, dB; none if nothing can be seen in any.
    pub(crate) fn mean_psnr(
        &self,
        original: &GaussianFrame,
        decoded: &[Rendering],
    ) -> Result<Option<f64>, Error> {
        mean(self.draw(original).zip(decoded).map(|(original, decoded)| Ok(compared(&original, decoded))))
    }
}

fn compared(one: &Rendering, other: &Rendering) -> Option<f64> {
    let is_blank = one.alpha.iter().chain(&other.alpha).all(|&alpha| alpha <= 0.0);
    (!is_blank).then(|| psnr(&one.colour, &other.colour).min(LOSSLESS_DB))
}
