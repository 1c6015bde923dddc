//! The scenes of a chart, their frames in memory: timings shall not include a disk.

use splatstream_files::builtin::BuiltinScene;
use splatstream_gaussians::GaussianFrame;
use std::path::{Path, PathBuf};

/// Frames of a GOP, and of a scene that are measured, unless the user says otherwise: the paper's GOP.
pub const FRAMES: u32 = 4;

/// A scene or the first frames of a sequence.
pub struct Scene {
    /// What the page calls it; also the start of its files' names.
    pub name: String,
    /// Where it comes from; none if built in.
    pub path: Option<PathBuf>,
    /// The frames that are measured.
    pub frames: Vec<GaussianFrame>,
    /// Frames that the source has.
    pub frames_of_source: u32,
}

impl Scene {
    /// The built-in scene.
    pub fn builtin(quick: bool, frames: Option<u32>) -> Self {
        let gaussians = if quick { 2_000 } else { BuiltinScene::default().gaussians };
        let whole = BuiltinScene { gaussians, ..BuiltinScene::default() };
        let frames = frames.unwrap_or(if quick { 2 } else { FRAMES }).min(whole.frames);
        Self {
            name: "builtin".to_owned(),
            path: None,
            frames: (0..frames).map(|number| whole.frame(number)).collect(),
            frames_of_source: whole.frames,
        }
    }

    /// Gaussians over all frames.
    pub fn gaussians(&self) -> u64 {
        self.frames.iter().map(|frame| frame.len() as u64).sum()
    }

    /// Highest degree of its spherical harmonics.
    pub fn sh_degree(&self) -> u8 {
        self.frames.iter().map(GaussianFrame::sh_degree).max().unwrap_or(0)
    }
}

/// The stem of a file in letters that every file system and every address takes.
pub fn name_of(path: &Path) -> String {
    let path = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.split('.').next().filter(|stem| !stem.is_empty()).unwrap_or("scene");
    stem.chars().map(|c| if c.is_ascii_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect()
}

/// Gives scenes of one name numbers.
pub fn tell_apart(scenes: &mut [Scene]) {
    for place in 1..scenes.len() {
        let (before, rest) = scenes.split_at_mut(place);
        let Some(scene) = rest.first_mut() else { return };
        let plain = scene.name.clone();
        let mut number = 2;
        while before.iter().any(|other| other.name == scene.name) {
            scene.name = format!("{plain}-{number}");
            number += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_of_one_name_are_told_apart() {
        let scene =
            |name: &str| Scene { name: name.to_owned(), path: None, frames: Vec::new(), frames_of_source: 0 };
        let mut scenes = [scene("a"), scene("b"), scene("a"), scene("a")];
        tell_apart(&mut scenes);
        assert_eq!(scenes.each_ref().map(|scene| scene.name.as_str()), ["a", "b", "a-2", "a-3"]);
    }

    #[test]
    fn names_fit_files() {
        assert_eq!(name_of(Path::new("/nowhere/my scene.compressed.ply")), "my_scene");
    }
}
