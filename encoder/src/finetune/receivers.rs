//! Operating points, and what receivers of an I frame have there.
//!
//! A receiver of spatial layer s and refinement r has the lists up to r, each as the highest layer up to s has left it. Where
//! later lists are missing it raises log-scales and opacities by the compensation of the last one. Values are fitted to pictures
//! of exactly that, so that a value counts at every point that shows it.

use super::request::{Finetune, PointWeight};
use crate::error::Error;
use crate::frame::ladder::Ladder;
use crate::settings::Settings;
use splatstream_decoder::operating_point::OperatingPoint;
use std::collections::BTreeSet;

/// Lines of a picture: those at which quality is meant. Fuzzing wants streams, not pictures.
pub(super) const LINES: u32 = if cfg!(fuzzing) { 12 } else { 540 };

/// A receiver whose pictures count where the values of a spatial layer are fitted.
pub(super) struct Receiver {
    /// What it takes.
    pub(super) point: OperatingPoint,
    /// As it was given.
    pub(super) given_weight: f64,
    /// Of all receivers of the layer together 1.
    pub(super) weight: f64,
    /// Lines of its pictures that slopes are taken of, in turn.
    pub(super) lines: Vec<u32>,
    /// Lines that its spatial layer is for.
    pub(super) own_lines: u32,
    /// For each list that it has, from the first on, whether its values are those that are fitted. The others are those of a
    /// lower layer.
    pub(super) lists: Vec<bool>,
}

impl Receiver {
    /// Those who see the values that a layer codes: of the lowest layer receivers of that one alone, and of the highest all
    /// others, who may see values of the lowest as well. `layers`: those of the frame, which may be fewer than the settings have.
    pub(super) fn of_layer(
        layer: u8,
        layers: u8,
        ladder: &Ladder,
        (settings, finetune): (&Settings, &Finetune),
    ) -> Vec<Self> {
        let last = layers.saturating_sub(1);
        let of_frame = |point: &OperatingPoint| OperatingPoint { spatial: point.spatial.min(last), ..*point };
        let is_own = |given: &&PointWeight| (of_frame(&given.point).spatial > 0) == (layer > 0);
        let points = finetune.points(layers, settings);
        let all: f64 = points.iter().filter(is_own).map(weight).sum();
        let receiver = |given: &PointWeight| {
            let point = of_frame(&given.point);
            let own_lines =
                finetune.own_lines(given.point.spatial, settings.spatial_layer_count().max(layers));
            let lines = match finetune.resolutions.is_empty() {
                true => vec![own_lines],
                false => finetune.resolutions.clone(),
            };
            let lists = (0..=usize::from(point.refinement))
                .map(|list| layer == 0 || ladder.is_final(point.spatial, list));
            Self {
                point,
                given_weight: given.weight,
                weight: given.weight / all,
                lines,
                own_lines,
                lists: lists.collect(),
            }
        };
        points.iter().filter(is_own).map(receiver).collect()
    }
}

impl Finetune {
    /// The operating points that count: those that are given, or all lists of each layer, of the highest alone where frames are
    /// predicted.
    fn points(&self, layers: u8, settings: &Settings) -> Vec<PointWeight> {
        if !self.optimise_for.is_empty() {
            return self.optimise_for.clone();
        }
        let refinement = top_refinement(settings);
        let of_layer =
            |spatial| PointWeight { point: OperatingPoint { spatial, temporal: 0, refinement }, weight: 1.0 };
        // Frames that are predicted follow what the highest layer has, and lower ones cost it bits.
        let lowest = if settings.temporal_layers() > 0 { layers.saturating_sub(1) } else { 0 };
        (lowest..layers).map(of_layer).collect()
    }

    /// The lines of all pictures that are there at the same time: those of the lowest layer by themselves, of which others have more.
    pub(super) fn lines_of_pictures(&self, settings: &Settings) -> BTreeSet<u32> {
        let layers = settings.spatial_layer_count();
        let points = self.points(layers, settings);
        let own = points.iter().map(|given| self.own_lines(given.point.spatial, layers));
        own.chain(self.resolutions.iter().copied()).collect()
    }

    /// The share of the weights of points that show all Gaussians: at the others finer steps do not bring what they should.
    pub(crate) fn share_of_everything(&self, settings: &Settings) -> f64 {
        let layers = settings.spatial_layer_count();
        let points = self.points(layers, settings);
        // What receivers of the lowest layer see is fitted by itself.
        let is_beside = |given: &&PointWeight| layers == 1 || given.point.spatial > 0;
        let has_all = |given: &&PointWeight| given.point.refinement == top_refinement(settings);
        let beside = || points.iter().filter(is_beside);
        let [of_all, all] = [beside().filter(has_all).map(weight).sum(), beside().map(weight).sum::<f64>()];
        if all > 0.0 { of_all / all } else { 0.0 }
    }

    /// Lines of the pictures that a layer of so many is for.
    fn own_lines(&self, layer: u8, layers: u8) -> u32 {
        let usual = match layers {
            1 => [LINES; 4],
            2 => [LINES, 2 * LINES, 2 * LINES, 2 * LINES],
            _ => [LINES, LINES / 3 * 4, 2 * LINES, 4 * LINES],
        };
        let place = usize::from(layer);
        self.lines.get(place).or(usual.get(place)).copied().unwrap_or(LINES)
    }

    /// Whether the stream has the operating points, and weights can be compared.
    ///
    /// # Errors
    /// The first that is not so.
    pub(super) fn check_points(&self, settings: &Settings) -> Result<(), Error> {
        let highest = OperatingPoint {
            spatial: settings.spatial_layer_count().saturating_sub(1),
            temporal: settings.temporal_layers().max(1).saturating_sub(1),
            refinement: top_refinement(settings),
        };
        for &PointWeight { point, weight } in &self.optimise_for {
            if point.at_most(highest) != point {
                return Err(Error::Setting {
                    name: "operating point to optimise for",
                    value: format!("{point} of a stream whose highest is {highest}"),
                    allowed: "any up to the highest",
                });
            }
            if !(WEIGHTS.contains(&weight)) {
                return Err(Error::Setting {
                    name: "weight of an operating point",
                    value: weight.to_string(),
                    allowed: "0.000001 to 1000000",
                });
            }
        }
        Ok(())
    }
}

/// Weights of operating points.
const WEIGHTS: core::ops::RangeInclusive<f64> = 1e-6..=1e6;

fn weight(given: &PointWeight) -> f64 {
    given.weight
}

/// The refinement that has all Gaussians.
fn top_refinement(settings: &Settings) -> u8 {
    u8::try_from(settings.refinements.len().saturating_sub(1)).unwrap_or(u8::MAX)
}
