//! How good decoded frames look: rendered from the cameras of the chart and compared with the source.

use splatstream_gaussians::GaussianFrame;
use splatstream_render::metrics::{Comparison, StLpips, compare};
use splatstream_render::{Camera, Rendering, render};
use std::collections::BTreeMap;

/// Behind every scene.
pub(crate) const BACKGROUND: [f32; 3] = [0.0; 3];

/// The cameras, and what they show of the source.
pub(crate) struct Judge<'a> {
    cameras: Vec<Camera>,
    /// By frame, then by camera.
    references: Vec<Vec<Rendering>>,
    learned: Option<&'a StLpips>,
    /// Frames judged before: tools that only save bits decode to the same Gaussians.
    known: BTreeMap<FrameKey, Vec<Comparison>>,
}

/// What makes two decoded frames the same: sequence parameters, number, digest of the planes.
pub(crate) type FrameKey = (Vec<u8>, u32, u64);

impl<'a> Judge<'a> {
    /// Renders the source.
    pub(crate) fn new(
        frames: &[GaussianFrame],
        cameras: Vec<Camera>,
        learned: Option<&'a StLpips>,
        on_frame: impl Fn(),
    ) -> Self {
        let of_frame = |frame| {
            let views = cameras.iter().map(|camera| render(frame, camera, BACKGROUND)).collect();
            on_frame();
            views
        };
        let references = frames.iter().map(of_frame).collect();
        Self { cameras, references, learned, known: BTreeMap::new() }
    }

    /// The cameras.
    pub(crate) fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// What a camera shows of a frame of the source.
    pub(crate) fn reference(&self, number: usize, camera: usize) -> Option<&Rendering> {
        self.references.get(number)?.get(camera)
    }

    /// Compares a frame with its source, camera by camera.
    pub(crate) fn views(&self, number: u32, frame: &GaussianFrame) -> Vec<Comparison> {
        let references = self.references.get(number as usize).map(Vec::as_slice).unwrap_or_default();
        let one = |(camera, reference): (&Camera, &Rendering)| {
            let rendering = render(frame, camera, BACKGROUND);
            compare(&reference.colour, &reference.alpha, &rendering.colour, self.learned)
        };
        self.cameras.iter().zip(references).map(one).collect()
    }

    /// As [`Judge::views`], once for each key.
    pub(crate) fn views_of(&mut self, key: FrameKey, frame: &GaussianFrame) -> Vec<Comparison> {
        if let Some(known) = self.known.get(&key) {
            return known.clone();
        }
        let views = self.views(key.1, frame);
        self.known.insert(key, views.clone());
        views
    }
}
