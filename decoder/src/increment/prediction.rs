//! Clause 7.17: new Gaussians predicted from their neighbours in the reference set.
//!
//! Attributes are predicted in coding order, each just before its residual is added, because the bilateral
//! predictor compares what is known of a Gaussian with its neighbours.

use super::residual::{AttributeCoding, AttributeValues, Attributes, Stage};
use crate::colour::Colour;
use crate::frame::QuantizedFrame;
use crate::home::{FINE, canonical};
use crate::neighbours::{Neighbour, NeighbourSearch};
use crate::predictor::{Predictor, bilateral_weights, knn_weights, weighted_mean};
use learned::{Learned, Target};
use rayon::prelude::*;
use splatstream_format::Result;
use splatstream_format::payload::Network;
use splatstream_format::syntax::IncrementHeader;

pub mod learned;

/// What the predictors of a unit go by.
#[derive(Debug, Clone, Copy)]
pub struct Predicting<'a> {
    /// The fixed part.
    pub header: &'a IncrementHeader,
    /// The transforms of the frame.
    pub colour: Colour<'a>,
    /// The network of the GOP.
    pub network: Option<&'a Network>,
}

/// A new Gaussian that is predicted.
#[derive(Debug, Clone, Copy)]
struct Item {
    row: u32,
    predictor: Predictor,
}

/// The predicted Gaussians of a unit and their neighbours.
#[derive(Debug)]
pub struct Prediction<'s> {
    set: &'s QuantizedFrame,
    items: Vec<Item>,
    /// Where the items are.
    position: [Vec<u32>; 3],
    /// `count` for each item.
    neighbours: Vec<Neighbour>,
    count: usize,
    /// Squared differences of the attributes known so far, for each of `neighbours`.
    features: Vec<u64>,
    falloff: [u8; 2],
    /// The network, if a Gaussian takes it.
    learned: Option<Learned<'s>>,
}

impl<'s> Prediction<'s> {
    /// Finds the neighbours of the new Gaussians at `position` whose run of `2^predictor_block_log2` has a
    /// predictor. None if nothing is predicted or there is nothing to predict from.
    pub fn new(
        set: &'s QuantizedFrame,
        position: [&[u32]; 3],
        predictors: &[Predictor],
        by: &Predicting<'s>,
    ) -> Option<Self> {
        let header = by.header;
        let run = 1_usize.wrapping_shl(header.predictor_block_log2.into());
        let [x, y, z] = position;
        let predictor_of = |row: usize| predictors.get(row.checked_div(run)?).copied();
        let items: Vec<Item> = (0_u32..)
            .zip(x.iter().enumerate())
            .filter_map(|(row, (place, _))| predictor_of(place).map(|predictor| Item { row, predictor }))
            .filter(|item| item.predictor != Predictor::None)
            .collect();
        if items.is_empty() || set.is_empty() {
            return None;
        }
        let pick = |plane: &[u32]| -> Vec<u32> { items.iter().map(|item| at(plane, item.row)).collect() };
        let position = [pick(x), pick(y), pick(z)];
        let count = usize::from(header.neighbour_count).min(set.len());
        let search = NeighbourSearch::new(set.position.each_ref().map(Vec::as_slice));
        let neighbours = search.nearest_to_all(position.each_ref().map(Vec::as_slice), count);
        let features = vec![0; neighbours.len()];
        let falloff = [header.bilateral_spatial, header.bilateral_feature];
        let network = by.network.filter(|_| predictors.contains(&Predictor::Transformer));
        let learned = network.map(|network| Learned::new(network, &by.colour, set));
        Some(Self { set, items, position, neighbours, count, features, falloff, learned })
    }

    /// Predicts and adds residuals, attribute by attribute.
    ///
    /// # Errors
    /// As [`Attributes::add`].
    pub fn reconstruct(
        mut self,
        attributes: &mut Attributes,
        values: AttributeValues<'_>,
        coding: &AttributeCoding<'_>,
        at: u64,
    ) -> Result<()> {
        for stage in Stage::ALL {
            self.predict(stage, attributes);
            attributes.add_stage(stage, values, coding, at)?;
            self.learn(stage, attributes);
        }
        Ok(())
    }

    /// Puts the prediction of one attribute in the place of what `attributes` holds for the predicted Gaussians.
    pub fn predict(&self, stage: Stage, attributes: &mut Attributes) {
        let set = self.set;
        match stage {
            Stage::LogScale => self.means(stage, &planes(&set.log_scale), &mut attributes.log_scale, 1),
            Stage::Opacity => {
                self.means(stage, &[&set.opacity], core::slice::from_mut(&mut attributes.opacity), 1);
            }
            Stage::Rotation => self.means(stage, &planes(&set.rotation), &mut attributes.rotation_fine, FINE),
            Stage::Dc => {
                self.means(stage, &planes(&set.dc), &mut attributes.dc, 1);
                if let Some(learned) = &self.learned {
                    learned.predict(&self.targets(), attributes);
                }
            }
            Stage::Sh => self.means(stage, &planes(&set.sh), &mut attributes.sh, 1),
        }
    }

    /// Takes note of one attribute as it is reconstructed.
    pub fn learn(&mut self, stage: Stage, attributes: &Attributes) {
        let set = self.set;
        match stage {
            Stage::LogScale => self.compare(&planes(&set.log_scale), &attributes.log_scale, |value| value),
            Stage::Opacity => {
                self.compare(&[&set.opacity], core::slice::from_ref(&attributes.opacity), |value| value);
            }
            Stage::Rotation => {
                let plane = |plane: &Vec<i32>| plane.iter().copied().map(canonical).collect();
                let own = attributes.rotation_fine.each_ref().map(plane);
                self.compare(&planes(&set.rotation), &own, |value| value);
            }
            Stage::Dc => self.compare(&planes(&set.dc), &attributes.dc, canonical),
            // Nothing is predicted after it.
            Stage::Sh => {}
        }
    }

    /// The network, if a Gaussian takes it.
    pub fn learned(&self) -> Option<&Learned<'s>> {
        self.learned.as_ref()
    }

    /// The items that the network predicts, once all attributes before dc are known.
    pub fn targets(&self) -> Vec<Target<'_>> {
        let [spatial, feature] = self.falloff;
        let target = |(place, item): (usize, &Item)| {
            let (neighbours, features) = self.of(place);
            let weights = bilateral_weights(neighbours, spatial, feature, features);
            let position = self.position.each_ref().map(|plane| plane.get(place).copied().unwrap_or(0));
            Target { row: item.row, position, neighbours, weights }
        };
        let items = self.items.par_iter().enumerate();
        items.filter(|(_, item)| item.predictor == Predictor::Transformer).map(target).collect()
    }

    /// Neighbours, and their feature distances, of an item.
    fn of(&self, item: usize) -> (&[Neighbour], &[u64]) {
        let start = item.wrapping_mul(self.count);
        let range = start..start.wrapping_add(self.count);
        (self.neighbours.get(range.clone()).unwrap_or_default(), self.features.get(range).unwrap_or_default())
    }

    /// Puts the means of the neighbours, times `unit`, in the place of what `out` holds for the items; not of those
    /// whose colour the network predicts.
    fn means(&self, stage: Stage, from: &[&Vec<i32>], out: &mut [Vec<i32>], unit: i32) {
        let colour = matches!(stage, Stage::Dc | Stage::Sh);
        let means = |(place, item): (usize, &Item)| -> Vec<i32> {
            if colour && item.predictor == Predictor::Transformer {
                return Vec::new();
            }
            let (neighbours, features) = self.of(place);
            let [spatial, feature] = self.falloff;
            let weights = match item.predictor {
                Predictor::Bilateral | Predictor::Transformer => {
                    bilateral_weights(neighbours, spatial, feature, features)
                }
                Predictor::Knn | Predictor::None => knn_weights(neighbours),
            };
            let mean = |plane: &&Vec<i32>| {
                let values = neighbours.iter().map(|neighbour| at(plane, neighbour.index));
                weighted_mean(&weights, values).wrapping_mul(unit)
            };
            from.iter().map(mean).collect()
        };
        let predicted: Vec<Vec<i32>> = self.items.par_iter().enumerate().map(means).collect();
        for (item, means) in self.items.iter().zip(predicted) {
            let row = usize::try_from(item.row).unwrap_or(usize::MAX);
            for (plane, mean) in out.iter_mut().zip(means) {
                if let Some(slot) = plane.get_mut(row) {
                    *slot = mean;
                }
            }
        }
    }

    /// Adds the squared differences between the items and their neighbours in some planes.
    fn compare(&mut self, from: &[&Vec<i32>], own: &[Vec<i32>], lattice: impl Fn(i32) -> i32) {
        let compared = |predictor| matches!(predictor, Predictor::Bilateral | Predictor::Transformer);
        let runs = self.neighbours.chunks_exact(self.count.max(1));
        let features = self.features.chunks_exact_mut(self.count.max(1));
        for (item, (neighbours, features)) in self.items.iter().zip(runs.zip(features)) {
            if !compared(item.predictor) {
                continue;
            }
            for (neighbour, feature) in neighbours.iter().zip(features) {
                for (theirs, own) in from.iter().zip(own) {
                    let difference =
                        lattice(at(own, item.row)).abs_diff(lattice(at(theirs, neighbour.index)));
                    let square = u64::from(difference).wrapping_mul(u64::from(difference));
                    *feature = feature.saturating_add(square);
                }
            }
        }
    }
}

fn planes(planes: &[Vec<i32>]) -> Vec<&Vec<i32>> {
    planes.iter().collect()
}

fn at<T: Copy + Default>(plane: &[T], row: u32) -> T {
    usize::try_from(row).ok().and_then(|row| plane.get(row)).copied().unwrap_or_default()
}
