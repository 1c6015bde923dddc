//! Which Gaussians come first.

use crate::grid::Spacing;
use crate::settings::{Importance, Preset, Settings};
use splatstream_format::syntax::prefix_length;
use splatstream_render::Camera;
use splatstream_render::camera::{Up, spiral};
use splatstream_render::contribution::{contribution, worth};
use splatstream_scene::{GaussianFrame, importance};

/// Orders the frames of a sequence, most important Gaussian first.
pub(crate) struct Ranking {
    importance: Importance,
    /// Shares of the Gaussians at which what is kept is weighed again, percent; falling.
    rounds: Vec<u8>,
    cameras: Vec<Camera>,
    preset: Preset,
    /// The order of the first frame, if it was needed early.
    known_order: Option<Vec<u32>>,
}

impl Ranking {
    /// What the settings ask for. With one refinement there is nothing to rank.
    pub(crate) fn new(settings: &Settings) -> Self {
        let by_preset = match settings.preset {
            Preset::Fast => Importance::Volume,
            Preset::Balanced | Preset::Small => Importance::Removal,
        };
        let importance = match settings.refinements.len() {
            1 => Importance::Volume,
            _ => settings.importance.unwrap_or(by_preset),
        };
        Self {
            importance,
            rounds: rounds(&settings.refinements, settings.preset),
            cameras: settings.cameras.clone(),
            preset: settings.preset,
            known_order: None,
        }
    }

    /// What it goes by.
    pub(crate) fn importance(&self) -> Importance {
        self.importance
    }

    /// Which Gaussians may be coarser: those of the last refinement, if they come last because pictures hardly show
    /// them.
    pub(crate) fn spacing(&self, order: &[u32], settings: &Settings) -> Spacing {
        let last_but_one = settings.refinements.iter().rev().nth(1);
        match last_but_one {
            Some(&percent) if settings.tools.coarse_tail && self.importance != Importance::Volume => {
                let kept = prefix_length(percent, order.len() as u32) as usize;
                Spacing::of_last(order, order.len() - kept)
            }
            _ => Spacing::default(),
        }
    }

    /// The order of the first frame, which [`Ranking::order`] will not compute again.
    pub(crate) fn order_first(&mut self, frame: &GaussianFrame) -> Vec<u32> {
        let order = self.order(frame);
        self.known_order = Some(order.clone());
        order
    }

    /// The Gaussians of a frame, most important first.
    pub(crate) fn order(&mut self, frame: &GaussianFrame) -> Vec<u32> {
        if let Some(order) = self.known_order.take() {
            return order;
        }
        let volume = importance::opacity_volume(frame);
        if self.importance == Importance::Volume {
            return importance::order(&volume);
        }
        self.cameras(frame);
        match self.importance {
            Importance::Removal => self.eliminate(frame, &volume),
            _ => ranked(&contribution(frame, &self.cameras), &volume, &all(frame)),
        }
    }

    /// The cameras in use: those of the settings, or made for the first frame that they are asked for.
    pub(crate) fn cameras(&mut self, frame: &GaussianFrame) -> &[Camera] {
        if self.cameras.is_empty() {
            let (count, height) = if self.preset == Preset::Small { (24, 360) } else { (10, 270) };
            self.cameras = spiral(frame, Up::default(), count, height);
        }
        &self.cameras
    }

    /// From the last to the first: what pictures miss least goes, the rest is weighed again without it.
    ///
    /// One look at the whole frame would keep none of two Gaussians that hide each other's loss. The score is the
    /// geometric mean of what a Gaussian gives and what is lost without it: the loss alone takes no account of what
    /// goes at the same time, the contribution alone none of how alike things look.
    fn eliminate(&self, frame: &GaussianFrame, volume: &[f64]) -> Vec<u32> {
        let mut kept = all(frame);
        let mut gone: Vec<u32> = Vec::new();
        for &percent in &self.rounds {
            let worth = worth(&frame.select(&kept), &self.cameras);
            let scores: Vec<f64> = worth.iter().map(|w| (w.contribution * w.loss).sqrt()).collect();
            kept = ranked(&scores, volume, &kept);
            let going = kept.split_off(prefix_length(percent, frame.len() as u32) as usize);
            gone = going.into_iter().chain(gone).collect();
        }
        kept.extend(gone);
        kept
    }
}

fn all(frame: &GaussianFrame) -> Vec<u32> {
    (0..frame.len() as u32).collect()
}

/// `gaussians` by falling score; those that no view tells apart by opacity times volume. `scores` go with
/// `gaussians`, `volume` with the frame.
fn ranked(scores: &[f64], volume: &[f64], gaussians: &[u32]) -> Vec<u32> {
    let mut rows: Vec<(f64, u32)> = scores.iter().copied().zip(gaussians.iter().copied()).collect();
    rows.sort_unstable_by(|a, b| {
        let volumes = volume[b.1 as usize].total_cmp(&volume[a.1 as usize]);
        b.0.total_cmp(&a.0).then(volumes).then(a.1.cmp(&b.1))
    });
    rows.into_iter().map(|(_, gaussian)| gaussian).collect()
}

/// The refinements from the last but one down; where time is no matter, with steps between them so that no
/// more than a quarter goes at once.
fn rounds(refinements: &[u8], preset: Preset) -> Vec<u8> {
    let mut rounds = Vec::new();
    for pair in refinements.windows(2).rev() {
        let [low, mut high] = [pair[0], pair[1]];
        if preset == Preset::Small {
            while u32::from(high) * 3 / 4 > u32::from(low) {
                high = (u32::from(high) * 3 / 4) as u8;
                rounds.push(high);
            }
        }
        rounds.push(low);
    }
    rounds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_fall_to_the_first_refinement() {
        assert_eq!(rounds(&[10, 20, 30, 50, 100], Preset::Balanced), [50, 30, 20, 10]);
        assert_eq!(rounds(&[10, 50, 100], Preset::Small), [75, 56, 50, 37, 27, 20, 15, 11, 10]);
    }

    #[test]
    fn ties_go_by_volume_and_then_by_place() {
        assert_eq!(ranked(&[0.0, 2.0, 0.0, 0.0], &[1.0, 0.0, 5.0, 1.0], &[0, 1, 2, 3]), [1, 2, 0, 3]);
    }
}
