//! The pictures that values are fitted to, and how far those of the decoded frame are from them.
#![expect(clippy::arithmetic_side_effects, reason = "sums and products of floats; counts of pictures")]

use super::{Finetune, Photograph};
use crate::settings::Settings;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Scattered, Up};
use splatstream_render::metrics::{LOSSLESS_DB, psnr};
use splatstream_render::{Camera, Image, PreparedFrame, render};

/// Around the scene.
pub(super) const BACKGROUND: [f32; 3] = [0.0; 3];

/// Lines of a picture: those at which quality is meant. Fuzzing wants streams, not pictures.
pub(super) const LINES: u32 = if cfg!(fuzzing) { 12 } else { 540 };

/// Views by which it is judged what is kept, of none of which a slope is taken.
const JUDGES: usize = 6;

/// Of so many photographs one is a judge.
const JUDGE_OF: usize = 8;

/// Seeds of the views that slopes are taken of, and of those of judges.
const SEEDS: [u64; 2] = [1, 2];

/// A view, and what it should show.
pub(super) struct View {
    pub(super) camera: Camera,
    pub(super) wanted: Image,
}

/// Where views come from.
enum Supply<'a> {
    /// From anywhere: no view comes twice.
    Scattered(&'a GaussianFrame, Scattered),
    /// In turn.
    Photographs(Vec<&'a Photograph>),
}

/// Views without end, and some to judge by.
pub(super) struct Pictures<'a> {
    supply: Supply<'a>,
    judges: Vec<View>,
    /// Lines of the views, in turn.
    lines: Vec<u32>,
    taken: usize,
}

impl<'a> Pictures<'a> {
    /// Of a source, or the photographs that were given.
    pub(super) fn new(
        source: &'a GaussianFrame,
        finetune: &'a Finetune,
        settings: &Settings,
        lines: Vec<u32>,
    ) -> Self {
        let taken = 0;
        let of_judges = lines.first().copied().unwrap_or(LINES);
        if !finetune.photographs.is_empty() {
            let numbered = || finetune.photographs.iter().enumerate();
            let is_judge = |number: usize| number % JUDGE_OF == JUDGE_OF / 2;
            let judges = numbered()
                .filter(|(number, _)| is_judge(*number))
                .map(|(_, photograph)| photograph.view(of_judges));
            let others =
                numbered().filter(|(number, _)| !is_judge(*number)).map(|(_, photograph)| photograph);
            let supply = Supply::Photographs(others.collect());
            return Self { judges: judges.collect(), supply, lines, taken };
        }
        let [own, others] =
            SEEDS.map(|seed| Scattered::new(source, Up::default(), &settings.cameras, seed, of_judges));
        let judges = others.take(JUDGES).map(|camera| drawn(source, camera)).collect();
        Self { supply: Supply::Scattered(source, own), judges, lines, taken }
    }

    /// Mean PSNR of a frame as judges see it, dB.
    pub(super) fn judge(&self, frame: &GaussianFrame) -> f64 {
        let prepared = PreparedFrame::new(frame);
        let of_view = |View { camera, wanted }: &View| {
            psnr(wanted, &prepared.draw(camera, BACKGROUND).rendering().colour).min(LOSSLESS_DB)
        };
        self.judges.iter().map(of_view).sum::<f64>() / self.judges.len().max(1) as f64
    }

    /// The next view.
    pub(super) fn next(&mut self) -> Option<View> {
        let lines = self.lines.get(self.taken % self.lines.len().max(1)).copied().unwrap_or(LINES);
        let number = self.taken;
        self.taken = number.wrapping_add(1);
        match &mut self.supply {
            Supply::Scattered(source, cameras) => {
                cameras.next().map(|camera| drawn(source, camera.scaled_to_height(lines)))
            }
            Supply::Photographs(photographs) => {
                Some(photographs.get(number % photographs.len().max(1))?.view(lines))
            }
        }
    }
}

fn drawn(source: &GaussianFrame, camera: Camera) -> View {
    let wanted = render(source, &camera, BACKGROUND).colour;
    View { camera, wanted }
}

impl Photograph {
    /// In the lines of other pictures, if it has more.
    fn view(&self, lines: u32) -> View {
        let lines = self.camera.height.min(lines);
        let camera = self.camera.scaled_to_height(lines);
        let wanted = self.picture.averaged(camera.width as usize, camera.height as usize);
        View { camera, wanted }
    }
}

/// The sum of squared differences of two pictures as a screen shows them, and its slope by each value of the second. What is
/// beyond a screen's range has the slope that leads back to what is wanted.
pub(super) fn squared_error(wanted: &Image, picture: &Image) -> (f64, Image) {
    let mut sum = 0.0;
    let pixel = |(wanted, shown): (&[f32; 3], &[f32; 3])| {
        let mut slopes = [0.0; 3];
        for ((slope, wanted), &shown) in slopes.iter_mut().zip(wanted).zip(shown) {
            let difference = shown.clamp(0.0, 1.0) - wanted.clamp(0.0, 1.0);
            sum += f64::from(difference * difference);
            *slope = 2.0 * difference;
        }
        slopes
    };
    let slopes = wanted.pixels().iter().zip(picture.pixels()).map(pixel).collect();
    (sum, Image::new(picture.width(), slopes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_that_a_screen_shows() {
        let wanted = Image::new(2, vec![[0.5, 0.0, 1.0], [1.0; 3]]);
        let picture = Image::new(2, vec![[0.75, 0.0, 3.0], [1.0, 1.0, 0.5]]);
        let (sum, slopes) = squared_error(&wanted, &picture);
        assert_eq!(sum, 0.0625 + 0.25);
        assert_eq!(slopes.pixels(), [[0.5, 0.0, 0.0], [0.0, 0.0, -1.0]]);
    }
}
