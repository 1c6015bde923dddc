//! How much memory encoding takes: known from the number of Gaussians, before any of it is taken.
//!
//! Nearly all of it goes with the number of Gaussians. A frame is there in several forms at the same time, as floats of its
//! source, on its grids, in lists as a decoder has them, as values that are coded, and each form has as many planes of 32 bits as
//! the source has values. Places, orders and rankings take as much for a Gaussian of any degree. So what is taken is a number of
//! [copies](Share::copies) of the frame, some [bytes](Share::bytes) of each Gaussian beside, and pictures, whose size is known. How many
//! copies there are follows from what is done: that has been measured, of each kind of work by itself, and a test compares it with
//! what is taken.

use crate::error::Error;
use crate::frame::training_memory::bytes_of_training;
use crate::settings::{Preset, Settings};
use crate::strips::{FEW, MANY};
use crate::verification::EVERY;
use splatstream_gaussians::{GaussianFrame, sh_planes};

/// What does not go with Gaussians, bytes: models, tables, what threads have.
const FIXED: u64 = 4 << 20;

/// A picture, bytes: the colour and the alpha of each pixel. And pictures that are there at the same time: those in which steps are fitted, and those of the source and
/// of the stream by which it is judged, of which those of a single frame are known already.
const OF_PICTURE: u64 = 960 * 540 * 16;
const PICTURES_OF_ONE: u64 = 9;
const PICTURES: u64 = 16;

/// Frames that are kept to judge the stream by, at most: one of each type in the middle, the first and the last.
const JUDGED: u64 = 5;

/// Copies of what is coded of a frame that wait to be written, be judged or be decoded, of a GOP; and of a stream of which the
/// size is given, of which the best is kept beside the last.
const OF_GOP: u64 = 3;
const OF_STREAM: u64 = 2;

/// Bytes of the planes of a frame.
pub(crate) fn bytes_of(frame: &GaussianFrame) -> u64 {
    values(frame.sh_degree()).saturating_mul(frame.len() as u64)
}

/// Bytes of the values of a Gaussian.
fn values(sh_degree: u8) -> u64 {
    (sh_planes(sh_degree) as u64).saturating_add(14).saturating_mul(4)
}

impl Settings {
    /// The memory that encoding takes at most, bytes, where GOPs are coded one after the other: of a sequence of so many frames, of
    /// which the largest has so many Gaussians with spherical harmonics of some degree. What is less than
    /// [`Settings::max_memory`] is encoded. No more than about twice what is taken where there are many Gaussians. While a frame is
    /// asked for, a third of it is not taken, or twice what the frame takes if that is less.
    ///
    /// ```
    /// use splatstream_encoder::{Preset, Settings};
    ///
    /// let [fast, small] = [Preset::Fast, Preset::Small].map(|preset| Settings::of(preset).memory(1_000_000, 3, 1));
    /// assert!(fast < small);
    /// ```
    pub fn memory(&self, gaussians: u64, sh_degree: u8, frames: u32) -> u64 {
        Footprint { gaussians, sh_degree, frames, settings: self }.bytes()
    }
}

/// A part of what is taken, of each Gaussian.
#[derive(Clone, Copy)]
struct Share {
    /// Tenths of a copy of its values.
    copies: u64,
    /// Bytes beside.
    bytes: u64,
}

impl Share {
    const fn of(self, values: u64) -> u64 {
        values.saturating_mul(self.copies).div_ceil(10).saturating_add(self.bytes)
    }
}

/// Ranking, coding and judging an I frame. What is more than for the fast preset are small pictures from which Gaussians are taken
/// away, and codebooks.
const INTRA_FAST: Share = Share { copies: 27, bytes: 80 };
const INTRA: Share = Share { copies: 33, bytes: 240 };
/// Gaussians that are in the strips of the views in which steps are fitted, were they seven times as large as usual; where there are
/// many, the balanced preset has as few strips as the fast one.
const IN_STRIPS_FAST: Share = Share { copies: 20, bytes: 10 };
const IN_STRIPS: Share = Share { copies: 40, bytes: 20 };
/// The numbers of those Gaussians, in six views.
const ROWS_IN_STRIPS: u64 = 24;
/// The frame that steps are fitted to, and what they make of the Gaussians of a view.
const TRIAL: Share = Share { copies: 20, bytes: 60 };
/// Coding predicted frames: references, what pairs them with the frame, and what becomes of each Gaussian in two ways.
const PREDICTED_FAST: Share = Share { copies: 87, bytes: 240 };
const PREDICTED: Share = Share { copies: 108, bytes: 430 };
/// Each temporal layer above the second has a reference more, and whole anchors have the lists of the I frame.
const REFERENCE: Share = Share { copies: 10, bytes: 16 };
/// Fitting values to pictures: the slopes of two views, their means and those of their squares, the mean of the values, and what
/// judges liked most.
const FITTED: Share = Share { copies: 200, bytes: 280 };
/// Weighing what can be left out.
const PRUNED: Share = Share { copies: 15, bytes: 200 };

/// What encoding frames of a size takes.
pub(crate) struct Footprint<'a> {
    gaussians: u64,
    sh_degree: u8,
    /// Of the sequence, or of so much of it as is encoded together.
    frames: u32,
    settings: &'a Settings,
}

impl<'a> Footprint<'a> {
    /// Of a sequence whose frames are like one.
    pub(crate) fn of(frame: &GaussianFrame, frames: u32, settings: &'a Settings) -> Self {
        Self { gaussians: frame.len() as u64, sh_degree: frame.sh_degree(), frames, settings }
    }

    /// Of a sequence of which this is the largest frame.
    pub(crate) const fn new(gaussians: u64, sh_degree: u8, frames: u32, settings: &'a Settings) -> Self {
        Self { gaussians, sh_degree, frames, settings }
    }

    /// Refuses a frame that takes more than is allowed.
    ///
    /// # Errors
    /// [`Error::OverMemory`].
    pub(crate) fn check(&self, frame: u32, allowed: u64) -> Result<(), Error> {
        let asked = self.bytes();
        match asked <= allowed {
            true => Ok(()),
            false => Err(Error::OverMemory { frame, gaussians: self.gaussians, asked, allowed }),
        }
    }

    /// All that is taken at most, bytes, with one GOP at a time.
    pub(crate) fn bytes(&self) -> u64 {
        let frames = u64::from(self.frames.max(1));
        let is_judged = self.settings.verify || self.settings.has_target();
        let judged = if is_judged { frames.min(JUDGED).saturating_sub(1) } else { 0 };
        let judged = values(self.sh_degree).saturating_mul(judged);
        let stream = match self.settings.size {
            Some(_) => OF_STREAM.saturating_mul(frames).saturating_mul(self.coded()),
            None => 0,
        };
        // What the views hold is let go before anything is coded, but for which Gaussians these are.
        let coding = self.coding().saturating_add(self.waiting()).saturating_add(ROWS_IN_STRIPS);
        let each = coding.max(self.fitting_steps()).saturating_add(judged).saturating_add(stream);
        let training = bytes_of_training(self.settings, self.gaussians, self.frames);
        let other = self.pictures().saturating_add(training).saturating_add(FIXED);
        each.saturating_mul(self.gaussians).saturating_add(other)
    }

    /// What a GOP takes more that is coded at the same time as others, bytes: its frames, and what coding them takes.
    pub(crate) fn of_another_gop(&self) -> u64 {
        let coding = self.coding().saturating_add(self.waiting()).saturating_mul(self.gaussians);
        let fitting = self.settings.finetune.as_ref().map_or(0, |_| self.pictures());
        self.frames_of_gop_in_memory().saturating_add(coding).saturating_add(fitting)
    }

    /// The frames of a GOP, bytes.
    pub(crate) fn frames_of_gop_in_memory(&self) -> u64 {
        values(self.sh_degree).saturating_mul(self.frames_of_gop()).saturating_mul(self.gaussians)
    }

    fn frames_of_gop(&self) -> u64 {
        self.frames.min(self.settings.gop_length()).max(1).into()
    }

    /// What coding the frames of a GOP takes, bytes of a Gaussian.
    fn coding(&self) -> u64 {
        let of = |share: Share| share.of(values(self.sh_degree));
        let layers = self.settings.temporal_layers();
        let predicted = match (layers > 0, self.settings.preset) {
            (false, Preset::Fast) => INTRA_FAST,
            (false, Preset::Balanced | Preset::Small) => INTRA,
            (true, Preset::Fast) => PREDICTED_FAST,
            (true, Preset::Balanced | Preset::Small) => PREDICTED,
        };
        let references =
            u64::from(layers.saturating_sub(2)).saturating_add(self.settings.whole_anchor().into());
        let coded = of(predicted).saturating_add(of(REFERENCE).saturating_mul(references));
        let fitted = self.settings.finetune.as_ref().map_or(0, |_| of(FITTED));
        let pruned = self.settings.prune.map_or(0, |_| of(PRUNED));
        coded.max(fitted).saturating_add(pruned)
    }

    /// What fitting steps takes, bytes of a Gaussian: what the views hold in which they are fitted, and what is made of it.
    fn fitting_steps(&self) -> u64 {
        let share = match (self.settings.has_target(), self.settings.preset) {
            (false, _) => return 0,
            (true, Preset::Fast) => IN_STRIPS_FAST,
            (true, Preset::Balanced | Preset::Small) if self.gaussians > MANY as u64 => IN_STRIPS_FAST,
            (true, Preset::Balanced | Preset::Small) => IN_STRIPS,
        };
        let values = values(self.sh_degree);
        share.of(values).saturating_add(TRIAL.of(values))
    }

    /// What waits of the frames of a GOP once they are coded, bytes of a Gaussian.
    fn waiting(&self) -> u64 {
        self.frames_of_gop().saturating_mul(OF_GOP).saturating_mul(self.coded())
    }

    /// What is coded of a Gaussian, bytes: a fifth of its values at usual qualities, at the highest nearly a half.
    fn coded(&self) -> u64 {
        values(self.sh_degree) / 5
    }

    /// Pictures, bytes.
    fn pictures(&self) -> u64 {
        let fitted =
            self.settings.finetune.as_ref().map_or(0, |finetune| finetune.bytes_of_pictures(self.settings));
        let pictures = if self.frames > 1 { PICTURES } else { PICTURES_OF_ONE };
        // Of fewer Gaussians whole pictures are looked at, of more no more than so many strips of them.
        let [every, _] = if self.gaussians < FEW as u64 { [1; 2] } else { EVERY };
        pictures.saturating_mul(OF_PICTURE.div_ceil(every.into())).saturating_add(fitted)
    }
}
