//! How much a sequence flickers: pictures of one frame against those of the frame before, where nothing moves.

use serde::Serialize;
use splatstream_render::metrics::{LOSSLESS_DB, psnr_masked, still};
use splatstream_render::{Image, Rendering};

/// PSNR between consecutive frames over still pixels, mean of the decibels of each picture; nothing where no two
/// frames follow each other, or everything moves.
#[derive(Serialize, Default, Clone, Copy)]
pub(super) struct Flicker {
    temporal_psnr_a_db: Option<f64>,
    temporal_psnr_b_db: Option<f64>,
    /// Part of the pixels that is still, percent.
    still_percent: Option<f64>,
}

/// Sums from which means follow.
#[derive(Default)]
pub(super) struct FlickerSums {
    decibels: [f64; 2],
    /// Pictures with still pixels.
    pictures: usize,
    still: usize,
    pixels: usize,
}

impl FlickerSums {
    /// Adds a view of a frame of A and of B, and of the frames before them. What is still is decided by the mean of A
    /// and B: if one of them decided, its noise would be what is small there, and that of the other would not.
    pub(super) fn add(&mut self, before: &[Rendering; 2], after: [&Rendering; 2]) {
        let mask = still(&mean(&before[0], &before[1]), &mean(after[0], after[1]));
        self.still += mask.count();
        self.pixels += mask.included().len();
        let temporal = |side: usize| {
            psnr_masked(&before[side].colour, &after[side].colour, &mask).map(|db| db.min(LOSSLESS_DB))
        };
        if let (Some(a), Some(b)) = (temporal(0), temporal(1)) {
            self.decibels[0] += a;
            self.decibels[1] += b;
            self.pictures += 1;
        }
    }

    /// The means of all that was added.
    pub(super) fn means(&self) -> Flicker {
        let mean = |side: usize| (self.pictures > 0).then(|| self.decibels[side] / self.pictures as f64);
        Flicker {
            temporal_psnr_a_db: mean(0),
            temporal_psnr_b_db: mean(1),
            still_percent: (self.pixels > 0).then(|| 100.0 * self.still as f64 / self.pixels as f64),
        }
    }
}

fn mean(a: &Rendering, b: &Rendering) -> Rendering {
    let pixels = a.colour.pixels().iter().zip(b.colour.pixels());
    let pixels = pixels.map(|(a, b)| [0, 1, 2].map(|channel: usize| 0.5 * (a[channel] + b[channel])));
    Rendering {
        colour: Image::new(a.colour.width(), pixels.collect()),
        alpha: a.alpha.iter().zip(&b.alpha).map(|(a, b)| 0.5 * (a + b)).collect(),
    }
}

impl Flicker {
    /// A line for people; nothing without two frames.
    pub(super) fn text(&self) -> String {
        let Self { temporal_psnr_a_db: Some(a), temporal_psnr_b_db: Some(b), still_percent } = self else {
            return String::new();
        };
        let share = still_percent.unwrap_or(0.0);
        format!(
            "from frame to frame, where nothing moves ({share:.1} % of the pixels): A {a:.2} dB, B {b:.2} dB\n"
        )
    }
}
