//! Scenes made from a seed, so that everything can be tried and tested without any input file.
//!
//! A scene resembles a capture of a small stage at 30 frames a second: two thirds are still surroundings
//! (ground, back wall, columns, foliage), one third moves (a tumbling ring, an arm of three jointed
//! segments, a waving cloth). Gaussians lie flat on surfaces; sizes are heavy-tailed and some are needles;
//! textures are smooth with noise on top; opacities are mostly near 1 with a tail of low ones.
//!
//! Light is fixed in the world. So colour and spherical harmonics are those of the surface as it stands in
//! a frame: highlights wander over what turns, and no coefficients have to be rotated.
//!
//! Equal scenes give equal bytes on every machine: integer random numbers, IEEE arithmetic and `libm` only.

mod gaussian;
mod light;
mod movers;
pub mod noise;
mod random;
mod recapture;
mod surface;
mod surroundings;

use gaussian::Gaussian;
use random::Random;
use splatstream_gaussians::{GaussianFrame, MAX_SH_DEGREE, Planes};
use surface::Sample;

/// Frames a second.
const RATE: f64 = 30.0;

/// Whether Gaussian `i` of one frame is Gaussian `i` of the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tracking {
    /// It is: same order, same count, moved.
    Tracked,
    /// It is not, as if each frame had been trained by itself: another order, values jittered, about 3 % of
    /// the Gaussians missing and about 3 % split in two.
    Untracked,
}

/// What a scene is made of. Equal fields make equal frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuiltinScene {
    /// Gaussians: exactly so many where tracked, nearly where not. 100 to 1,000,000; clamped to that.
    pub gaussians: u32,
    /// Frames that the scene is meant to have. [`BuiltinScene::frame`] makes any frame, also later ones.
    pub frames: u32,
    /// Chooses the scene among others like it.
    pub seed: u64,
    /// Whether Gaussians keep their identity.
    pub tracking: Tracking,
    /// Degree of the spherical harmonics, 0 to 3; clamped to that.
    pub sh_degree: u8,
}

impl Default for BuiltinScene {
    fn default() -> Self {
        Self { gaussians: 20_000, frames: 8, seed: 1, tracking: Tracking::Tracked, sh_degree: MAX_SH_DEGREE }
    }
}

impl BuiltinScene {
    /// Frame `t`, at `t` / 30 seconds. Random access: no other frame is made.
    #[expect(clippy::expect_used, reason = "the planes are made for the degree and filled a row at a time")]
    pub fn frame(&self, t: u32) -> GaussianFrame {
        let stage = Stage::new(self);
        let sh_degree = self.sh_degree.min(MAX_SH_DEGREE);
        let mut planes = Planes::with_capacity(sh_degree, stage.gaussians as usize);
        for index in stage.order(self, t) {
            let gaussian = stage.gaussian(index, f64::from(t) / RATE);
            match self.tracking {
                Tracking::Tracked => gaussian.push(&mut planes),
                Tracking::Untracked => {
                    let mut random = Random::new([self.seed, 2, u64::from(t), u64::from(index)]);
                    recapture::again(gaussian, &mut random).iter().for_each(|again| again.push(&mut planes));
                }
            }
        }
        GaussianFrame::from_planes(sh_degree, planes)
            .expect("planes of one length, as many as the degree has")
    }
}

/// The parts of a scene, and which Gaussians each has.
struct Stage {
    seed: u64,
    gaussians: u32,
    /// The first Gaussian of the ring, of the arm and of the cloth; those before are surroundings.
    starts: [u32; 3],
}

impl Stage {
    fn new(scene: &BuiltinScene) -> Self {
        let gaussians = scene.gaussians.clamp(100, 1_000_000);
        let moving = gaussians / 3;
        let ring = gaussians - moving;
        let starts = [ring, ring + moving / 3, ring + moving / 3 * 2];
        Self { seed: scene.seed, gaussians, starts }
    }

    /// The order of the Gaussians: shuffled, as that of a trained scene says nothing about its parts.
    fn order(&self, scene: &BuiltinScene, t: u32) -> Vec<u32> {
        let mut random = match scene.tracking {
            Tracking::Tracked => Random::new([self.seed, 0, 0, 0]),
            Tracking::Untracked => Random::new([self.seed, 0, 1, u64::from(t)]),
        };
        let mut order: Vec<u32> = (0..self.gaussians).collect();
        for last in (1..order.len()).rev() {
            order.swap(last, random.below(last as u64 + 1) as usize);
        }
        order
    }

    /// One Gaussian at a time in seconds. Random numbers do not depend on the time, so it stays itself.
    fn gaussian(&self, index: u32, seconds: f64) -> Gaussian {
        let mut random = Random::new([self.seed, 1, u64::from(index), 0]);
        let [ring, arm, cloth] = self.starts;
        let sample = if index < ring {
            surroundings::sample(&mut random, ring)
        } else if index < arm {
            movers::ring(&mut random, arm - ring, seconds + self.phase())
        } else if index < cloth {
            movers::arm(&mut random, cloth - arm, seconds + self.phase())
        } else {
            movers::cloth(&mut random, self.gaussians - cloth, seconds + self.phase())
        };
        Gaussian::on(&sample, &mut random)
    }

    /// Seconds into the movements at frame 0.
    fn phase(&self) -> f64 {
        Random::new([self.seed, 3, 0, 0]).unit() * 10.0
    }
}
