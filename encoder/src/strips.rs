//! Strips of the pictures of a frame, to compare those of another frame with.
//!
//! Every so many lines of a picture have nearly the errors of all of them, and are drawn in a part of the time. They are
//! of the size at which quality is meant, since small pictures hide errors that large ones show.

use crate::error::Error;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::metrics::{LOSSLESS_DB, psnr};
use splatstream_render::{Camera, PreparedFrame, Rendering, Strips, draw_strips, touching_strips};

/// Around the scene.
const BACKGROUND: [f32; 3] = [0.0; 3];

/// Frames of fewer Gaussians than the first have more strips, for the errors of a few small Gaussians are in few places;
/// those of more than the second have fewer, if they have [enough](FEWEST).
pub(crate) const FEW: usize = 1 << 15;
pub(crate) const MANY: usize = 1 << 19;

/// Of each view there are about so many strips at least: of a picture whose middle is full and whose edges are empty, one strip
/// says either too much or too little.
const FEWEST: u32 = 3;

/// Strips that touch this part of what whole pictures show are enough, of however few Gaussians: these are large.
const NEARLY_ALL: f64 = 0.99;

/// A strip in so many, of a frame in some views, where it is one in `every` of usual frames.
#[expect(clippy::arithmetic_side_effects, reason = "small constants, and Gaussians in memory")]
fn strip_of(every: u32, cameras: &[Camera], frame: &GaussianFrame) -> u32 {
    let gaussians = frame.len();
    if gaussians >= FEW {
        let lines = cameras.iter().map(|camera| camera.height).min().unwrap_or_default();
        let farthest = lines.div_ceil(Strips::LINES).div_ceil(FEWEST).max(1);
        return (every * gaussians.div_ceil(MANY) as u32).min(farthest);
    }
    let touched = |every: u32| -> usize {
        let views = cameras.iter().zip(0..);
        views.map(|(camera, number)| touching_strips(frame, camera, strips(number, every)).len()).sum()
    };
    let fewest = (every as usize * gaussians / FEW).max(1) as u32;
    let enough = NEARLY_ALL * touched(1) as f64;
    let halves = core::iter::successors(Some(every), |&every| Some(every / 2));
    halves
        .take_while(|&every| every > fewest)
        .find(|&every| touched(every) as f64 >= enough)
        .unwrap_or(fewest)
}

/// Which strips are taken of a view: at another height in each.
#[expect(clippy::arithmetic_side_effects, reason = "counts of cameras, and small constants")]
fn strips(number: u32, every: u32) -> Strips {
    Strips { first: every / 2 + number * (every / 3).max(1), every }
}

/// A view of some strips, and the Gaussians that these show.
pub(crate) struct StripView {
    camera: Camera,
    strips: Strips,
    picture: Rendering,
    /// Which Gaussians these are, and what they are unless that has been [let go](Self::let_go).
    pub(crate) rows: Vec<u32>,
    pub(crate) frame: GaussianFrame,
}

impl StripView {
    /// Of a frame.
    fn new(frame: &GaussianFrame, camera: &Camera, strips: Strips) -> Self {
        let rows = touching_strips(frame, camera, strips);
        let frame = frame.select(&rows);
        let picture = PreparedFrame::new(&frame).strips(camera, BACKGROUND, strips);
        Self { camera: camera.clone(), strips, picture, frame, rows }
    }

    /// Forgets the Gaussians, which fill much memory, and knows only which they are.
    pub(crate) fn let_go(&mut self) {
        self.frame = GaussianFrame::default();
    }

    /// Takes the Gaussians again from the frame that it is of.
    pub(crate) fn hold(&mut self, frame: &GaussianFrame) {
        self.frame = frame.select(&self.rows);
    }

    /// PSNR of another version of the same Gaussians, dB; none if nothing can be seen.
    pub(crate) fn psnr(&self, frame: &GaussianFrame) -> Option<f64> {
        let drawn = PreparedFrame::new(frame).strips(&self.camera, BACKGROUND, self.strips);
        compared(&self.picture, &drawn)
    }
}

/// The mean of the decibels of the views in which something can be seen; none if there is no such view.
pub(crate) fn mean(decibels: impl Iterator<Item = Result<Option<f64>, Error>>) -> Result<Option<f64>, Error> {
    let decibels: Vec<f64> = decibels.filter_map(Result::transpose).collect::<Result<_, Error>>()?;
    Ok((!decibels.is_empty()).then(|| decibels.iter().sum::<f64>() / decibels.len() as f64))
}

/// Strips of views in which frames are compared that are not in memory at the same time.
#[derive(Clone)]
pub(crate) struct StripViews {
    cameras: Vec<Camera>,
    every: u32,
}

impl StripViews {
    /// One strip in `every` of each view, for frames like one.
    pub(crate) fn new(cameras: Vec<Camera>, every: u32, frame: &GaussianFrame) -> Self {
        Self { every: strip_of(every, &cameras, frame), cameras }
    }

    /// The strips of a frame, to compare others of the same Gaussians with: of the views at some places.
    pub(crate) fn of(&self, frame: &GaussianFrame, places: impl Iterator<Item = usize>) -> Vec<StripView> {
        let view = |place: usize| {
            let strips = strips(place as u32, self.every);
            Some(StripView::new(frame, self.cameras.get(place)?, strips))
        };
        places.filter_map(view).collect()
    }

    /// The same with the pictures of a frame that has more Gaussians.
    pub(crate) fn beside(&self, frame: &GaussianFrame, whole: &GaussianFrame) -> Vec<StripView> {
        let views = self.of(frame, 0..self.len());
        let pictures = self.draw(whole);
        views.into_iter().zip(pictures).map(|(view, picture)| StripView { picture, ..view }).collect()
    }

    /// How many views there are.
    pub(crate) fn len(&self) -> usize {
        self.cameras.len()
    }

    /// The strips of a frame, view by view.
    pub(crate) fn draw(&self, frame: &GaussianFrame) -> impl Iterator<Item = Rendering> {
        let views = self.cameras.iter().zip(0..);
        views.map(|(camera, number)| draw_strips(frame, camera, BACKGROUND, strips(number, self.every)))
    }

    /// Their mean PSNR where those of another frame have been drawn, dB; none if nothing can be seen in any.
    pub(crate) fn mean_psnr(
        &self,
        original: &GaussianFrame,
        decoded: &[Rendering],
    ) -> Result<Option<f64>, Error> {
        mean(self.draw(original).zip(decoded).map(|(original, decoded)| Ok(compared(&original, decoded))))
    }

    /// The lowest PSNR of the views, between strips that have been drawn and those of another frame, dB; none if nothing can be
    /// seen in any.
    pub(crate) fn least_psnr(&self, frame: &GaussianFrame, drawn: &[Rendering]) -> Option<f64> {
        let decibels = self.draw(frame).zip(drawn).filter_map(|(one, other)| compared(&one, other));
        decibels.reduce(f64::min)
    }
}

fn compared(one: &Rendering, other: &Rendering) -> Option<f64> {
    let is_blank = one.alpha.iter().chain(&other.alpha).all(|&alpha| alpha <= 0.0);
    (!is_blank).then(|| psnr(&one.colour, &other.colour).min(LOSSLESS_DB))
}
