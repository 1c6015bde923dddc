//! What cases are made from.

use super::edits::{another, thinned};
use crate::scenes::Scene;
use splatstream_encoder::{Settings, Structure};
use splatstream_files::builtin::BuiltinScene;
use splatstream_gaussians::GaussianFrame;

/// Samples have no more than this times as many Gaussians and frames as bases.
const LARGER: u64 = 4;

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// The last strength of each case on a very small scene: a look at the page.
    Quick,
    /// Minutes.
    Standard,
    /// All strengths, larger scenes.
    Full,
}

impl Size {
    /// What the options ask for.
    pub fn of(quick: bool, full: bool) -> Self {
        match (quick, full) {
            (_, true) => Self::Full,
            (true, _) => Self::Quick,
            _ => Self::Standard,
        }
    }

    fn of_three<T: Copy>(self, [quick, standard, full]: [T; 3]) -> T {
        match self {
            Self::Quick => quick,
            Self::Standard => standard,
            Self::Full => full,
        }
    }

    /// Bytes that the cases of a scene take at most: bases and samples, each of which is coded by itself.
    pub(super) fn memory(self, scene: &Scene) -> u64 {
        let (degree, frames) = (scene.sh_degree(), self.frames());
        let still = Settings::default().memory(LARGER * self.gaussians() as u64, degree, 1);
        let structure = Structure::Predicted { layers: 2 };
        let moving = Settings { structure, spatial_layers: 3, ..Settings::default() };
        let moving =
            moving.memory(LARGER * self.gaussians_in_motion() as u64, degree, LARGER as u32 * frames);
        still.saturating_add(moving)
    }

    /// Gaussians of a scene that stands still, at most.
    fn gaussians(self) -> usize {
        self.of_three([400, 2_000, 20_000])
    }

    /// Gaussians of each frame of a sequence, at most.
    fn gaussians_in_motion(self) -> usize {
        self.of_three([150, 600, 5_000])
    }

    /// Frames of a sequence.
    pub fn frames(self) -> u32 {
        self.of_three([4, 8, 16])
    }

    /// Cameras around each frame.
    pub(super) fn cameras(self) -> u32 {
        self.of_three([2, 3, 4])
    }
}

/// A scene, and a sequence if there is one.
pub(super) struct Base {
    /// What the page calls it.
    pub(super) name: String,
    /// Of cases that stand still.
    pub(super) scene: GaussianFrame,
    /// Of cases in motion; a scene of one frame has none of them.
    pub(super) frames: Vec<GaussianFrame>,
}

/// The built-in scene as a base needs it.
pub fn builtin(size: Size) -> Scene {
    let whole = BuiltinScene {
        gaussians: size.gaussians() as u32,
        frames: size.frames(),
        sh_degree: 1,
        ..BuiltinScene::default()
    };
    Scene {
        name: "builtin".to_owned(),
        path: None,
        frames: (0..whole.frames).map(|number| whole.frame(number)).collect(),
        frames_of_source: whole.frames,
    }
}

impl Base {
    /// The first frame and the sequence of a scene, both as small as they have to be.
    pub(super) fn new(scene: &Scene, size: Size) -> Self {
        let in_motion = |frame: &GaussianFrame| thinned(frame, size.gaussians_in_motion());
        let frames = match scene.frames.as_slice() {
            [] | [_] => Vec::new(),
            frames => frames.iter().map(in_motion).collect(),
        };
        let scene_of = |frame: &GaussianFrame| thinned(frame, size.gaussians());
        Self {
            name: scene.name.clone(),
            scene: scene.frames.first().map(scene_of).unwrap_or_default(),
            frames,
        }
    }

    /// Frames of the sequence.
    pub(super) fn len(&self) -> usize {
        self.frames.len()
    }

    /// A frame of the sequence, which goes on backwards where it ends.
    pub(super) fn frame(&self, number: usize) -> GaussianFrame {
        let last = self.frames.len().saturating_sub(1);
        let at = number % (2 * last).max(1);
        self.frames.get(at.min(2 * last - at)).cloned().unwrap_or_default()
    }

    /// The same frame of another sequence.
    pub(super) fn other(&self, number: usize) -> GaussianFrame {
        another(&self.frame(number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_goes_on_backwards() {
        let base = Base::new(&builtin(Size::Quick), Size::Quick);
        let at = |number: usize| base.frames.iter().position(|frame| *frame == base.frame(number));
        assert_eq!([0, 2, 3, 4, 6, 7].map(at), [0, 2, 3, 2, 0, 1].map(Some));
        assert_eq!((base.scene.len(), base.frames[0].len()), (400, 150));
    }
}
