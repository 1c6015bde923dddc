//! Clause 7.17: new Gaussians predicted from their neighbours in the reference set.
//!
//! Attributes are predicted in coding order, each just before its residual is added, because the bilateral
//! predictor compares what is known of a Gaussian with its neighbours.

use super::residual::{AttributeCoding, AttributeValues, Attributes, Stage};
use crate::frame::QuantizedFrame;
use crate::home::{FINE, canonical};
use crate::neighbours::{Neighbour, NeighbourSearch};
use crate::predictor::{Predictor, bilateral_weights, knn_weights, weighted_mean};
use rayon::prelude::*;
use splatstream_format::Result;
use splatstream_format::syntax::IncrementHeader;

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
    /// `count` for each item.
    neighbours: Vec<Neighbour>,
    count: usize,
    /// Squared differences of the attributes known so far, for each of `neighbours`.
    features: Vec<u64>,
    falloff: [u8; 2],
}

impl<'s> Prediction<'s> {
    /// Finds the neighbours of the new Gaussians at `position` whose run of `2^predictor_block_log2` has a
    /// predictor. None if nothing is predicted or there is nothing to predict from.
    pub fn new(
        set: &'s QuantizedFrame,
        position: [&[u32]; 3],
        predictors: &[Predictor],
        header: &IncrementHeader,
    ) -> Option<Self> {
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
        let [x, y, z] = [pick(x), pick(y), pick(z)];
        let count = usize::from(header.neighbour_count).min(set.len());
        let search = NeighbourSearch::new(set.position.each_ref().map(Vec::as_slice));
        let neighbours = search.nearest_to_all([&x, &y, &z], count);
        let features = vec![0; neighbours.len()];
        let falloff = [header.bilateral_spatial, header.bilateral_feature];
        Some(Self { set, items, neighbours, count, features, falloff })
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
            Stage::LogScale => self.means(&planes(&set.log_scale), &mut attributes.log_scale, 1),
            Stage::Opacity => {
                self.means(&[&set.opacity], core::slice::from_mut(&mut attributes.opacity), 1);
            }
            Stage::Rotation => self.means(&planes(&set.rotation), &mut attributes.rotation_fine, FINE),
            Stage::Dc => self.means(&planes(&set.dc), &mut attributes.dc, 1),
            Stage::Sh => self.means(&planes(&set.sh), &mut attributes.sh, 1),
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

    /// Neighbours, and their feature distances, of an item.
    fn of(&self, item: usize) -> (&[Neighbour], &[u64]) {
        let start = item.wrapping_mul(self.count);
        let range = start..start.wrapping_add(self.count);
        (self.neighbours.get(range.clone()).unwrap_or_default(), self.features.get(range).unwrap_or_default())
    }

    /// Puts the means of the neighbours, times `unit`, in the place of what `out` holds for the items.
    fn means(&self, from: &[&Vec<i32>], out: &mut [Vec<i32>], unit: i32) {
        let means = |(place, item): (usize, &Item)| -> Vec<i32> {
            let (neighbours, features) = self.of(place);
            let [spatial, feature] = self.falloff;
            let weights = match item.predictor {
                Predictor::Bilateral => bilateral_weights(neighbours, spatial, feature, features),
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
        let runs = self.neighbours.chunks_exact(self.count.max(1));
        let features = self.features.chunks_exact_mut(self.count.max(1));
        for (item, (neighbours, features)) in self.items.iter().zip(runs.zip(features)) {
            if item.predictor != Predictor::Bilateral {
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
