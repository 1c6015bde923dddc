//! How much memory measuring takes, known before any of it is taken.

use crate::charting::{Charting, Subject};
use crate::gop;
use splatstream_encoder::Settings;
use splatstream_gaussians::{GaussianFrame, sh_planes};
use splatstream_render::Camera;

/// A pixel of a picture of the source that is kept, bytes: its colour and its alpha.
const OF_PIXEL: u64 = 16;
/// A pixel of the picture that is compared with it, bytes: what drawing and its metrics hold; and what the learned metric does.
const OF_COMPARED: u64 = 256;
const OF_LEARNED: u64 = 2048;

/// Streams take no more than this part of the values that they code.
const OF_STREAM: u64 = 3;

/// What measuring takes beside the frames of the source, bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Footprint {
    /// Encoding, and decoding and drawing what was encoded, which takes less.
    pub encoding: u64,
    /// Pictures and streams that are kept meanwhile.
    pub beside: u64,
}

impl Footprint {
    /// All together.
    pub fn bytes(self) -> u64 {
        self.encoding.saturating_add(self.beside)
    }
}

/// Bytes of a frame.
pub(crate) fn bytes_of(frame: &GaussianFrame) -> u64 {
    let values = (14 + sh_planes(frame.sh_degree())) as u64;
    (frame.len() as u64).saturating_mul(values).saturating_mul(size_of::<f32>() as u64)
}

/// Pixels of a picture.
fn pixels(camera: &Camera) -> u64 {
    u64::from(camera.width).saturating_mul(camera.height.into())
}

impl Charting<'_> {
    /// What [`Charting::run`] takes at most beside the frames of the subjects, where encoding is [bounded](Self::bound) to its part.
    pub fn footprint(&self, subjects: &[Subject]) -> Footprint {
        let (mut encoding, mut pictures, mut streams) = (0, 0, 0_u64);
        for subject in subjects {
            encoding = encoding.max(self.encoding(subject));
            pictures = pictures.max(self.pictures(subject));
            let values = subject.scene.frames.iter().map(bytes_of).fold(0, u64::saturating_add);
            let kept = (values / OF_STREAM).saturating_mul(self.sweep.runs().count() as u64);
            streams = streams.saturating_add(kept);
        }
        Footprint { encoding, beside: streams.saturating_add(pictures) }
    }

    /// Has encoding take so many bytes at most: with little, fewer GOPs are coded at once.
    pub fn bound(&mut self, max_memory: u64) {
        let variants = self.sweep.variants.iter_mut().chain(&mut self.sweep.efforts);
        variants.for_each(|variant| variant.settings.max_memory = max_memory);
    }

    /// What encoding takes with the settings that take most.
    fn encoding(&self, Subject { scene, .. }: &Subject) -> u64 {
        let gaussians = scene.frames.iter().map(GaussianFrame::len).max().unwrap_or(0) as u64;
        let (degree, frames) = (scene.sh_degree(), scene.frames.len() as u32);
        let of = |settings: Settings, frames: u32| settings.memory(gaussians, degree, frames);
        let quality = self.sweep.quality();
        let runs = self.sweep.variants.iter().map(|variant| of(variant.at(quality), frames));
        let of_front = |count: u32| {
            let contenders = self.contenders(scene, count);
            contenders.into_iter().map(|variant| of(variant.at(quality), count)).max()
        };
        let fronts = self.fronts(scene).into_iter().filter_map(of_front);
        let of_gop = of(gop::settings(self.sweep.headline(), self.gop), frames.min(self.gop));
        runs.chain(fronts).chain([of_gop]).max().unwrap_or(0)
    }

    fn pictures(&self, Subject { scene, cameras }: &Subject) -> u64 {
        let all = cameras.iter().map(pixels).fold(0, u64::saturating_add);
        let kept = all.saturating_mul(OF_PIXEL).saturating_mul(scene.frames.len() as u64);
        let of_compared = OF_COMPARED + self.learned.as_ref().map_or(0, |_| OF_LEARNED);
        let largest = cameras.iter().map(pixels).max().unwrap_or(0);
        kept.saturating_add(largest.saturating_mul(of_compared))
    }
}
