//! Scenes of any size, frame by frame: none is held.

use crate::measured::processor_time;
use splatstream_encoder::FrameSource;
use splatstream_files::builtin::BuiltinScene;
use splatstream_gaussians::{GaussianFrame, Planes};
use std::time::Duration;

/// The largest built-in scene.
const MOST: u32 = 1_000_000;
/// How far copies of it are apart, which is more than its extent.
const APART: f32 = 20.0;

/// Frames that are made whenever they are asked for, as files are read; and what making them has taken.
#[derive(Clone)]
pub(crate) struct Source {
    scene: BuiltinScene,
    /// So many scenes side by side.
    copies: u32,
    /// All frames are the first.
    is_still: bool,
    taken: Duration,
}

impl Source {
    /// One frame.
    pub(crate) fn single(gaussians: u32) -> Self {
        let copies = gaussians.div_ceil(MOST);
        let gaussians = gaussians / copies;
        let scene = BuiltinScene { gaussians, frames: 1, sh_degree: 2, ..BuiltinScene::default() };
        Self { scene, copies, is_still: false, taken: Duration::ZERO }
    }

    /// A sequence of frames of so many Gaussians.
    pub(crate) fn sequence(gaussians: u32, frames: u32) -> Self {
        let scene = BuiltinScene { gaussians, frames, sh_degree: 1, ..BuiltinScene::default() };
        Self { scene, copies: 1, is_still: false, taken: Duration::ZERO }
    }

    /// The same where nothing moves.
    pub(crate) fn still(self) -> Self {
        Self { is_still: true, ..self }
    }

    pub(crate) fn is_sequence(&self) -> bool {
        self.scene.frames > 1
    }

    /// Processor time of making frames so far.
    pub(crate) fn processor_seconds(&self) -> f64 {
        self.taken.as_secs_f64()
    }

    fn make(&self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        if self.copies == 1 {
            return Ok(self.scene.frame(number));
        }
        let total = (self.scene.gaussians * self.copies) as usize;
        let mut planes = Planes::with_capacity(self.scene.sh_degree, total);
        for copy in 0..self.copies {
            let scene = BuiltinScene { seed: self.scene.seed + u64::from(copy), ..self.scene };
            append(&mut planes, scene.frame(number).into_planes(), copy as f32 * APART);
        }
        Ok(GaussianFrame::from_planes(self.scene.sh_degree, planes)?)
    }
}

/// Puts Gaussians behind others, moved along x.
fn append(planes: &mut Planes, mut more: Planes, x: f32) {
    more.position[0].iter_mut().for_each(|at| *at += x);
    let pairs = planes.position.iter_mut().zip(&more.position);
    let pairs = pairs.chain(planes.log_scale.iter_mut().zip(&more.log_scale));
    let pairs = pairs.chain(planes.rotation.iter_mut().zip(&more.rotation));
    let pairs = pairs.chain([(&mut planes.opacity_logit, &more.opacity_logit)]);
    let pairs = pairs.chain(planes.dc.iter_mut().zip(&more.dc)).chain(planes.sh.iter_mut().zip(&more.sh));
    pairs.for_each(|(plane, more)| plane.extend_from_slice(more));
}

impl FrameSource for Source {
    fn len(&self) -> u32 {
        self.scene.frames
    }

    fn frame(&mut self, number: u32) -> Result<GaussianFrame, Box<dyn std::error::Error + Send + Sync>> {
        let start = processor_time();
        let frame = self.make(if self.is_still { 0 } else { number });
        self.taken += processor_time().saturating_sub(start);
        frame
    }
}
