//! Clause 7.7: new Gaussians predicted from their neighbours in the reference set.
//!
//! Attributes are predicted in coding order, each just before its residual is added, because the bilateral
//! predictor compares what is known of a Gaussian with its neighbours.
//!
//! No sum overflows (annex F.5). There is a run of predictors for each new Gaussian and K neighbours for each item, as
//! [`Prediction::new`] makes them; planes have a value for each row, so that nothing is taken in place of one.

use super::residual::{AttributeCoding, AttributeValues, Attributes};
use crate::colour::Colour;
use crate::cores;
use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use crate::list::{FINE, canonical};
use crate::neighbours::{Neighbour, NeighbourSearch};
use crate::predictor::{NEIGHBOURS_MAX, Predictor, WeightedMean, bilateral_weights, knn_weights};
use crate::stage::Stage;
use crate::transformer::LaneNetwork;
use core::ops::Range;
use projection::Projection;
use rows::Rows;
use splatstream_format::Result;
use splatstream_format::payload::Network;
use splatstream_format::syntax::IncrementHeader;

mod learned;
mod projection;
mod rows;

pub use learned::{Learned, Target};

/// What the predictors of a unit go by.
#[derive(Debug, Clone, Copy)]
pub struct Predicting<'a> {
    /// The fixed part.
    pub header: &'a IncrementHeader,
    /// The transforms of the frame.
    pub colour: Colour<'a>,
    /// The network of the GOP.
    pub network: Option<&'a Network>,
    /// `feature_shift` of the sequence.
    pub feature_shift: u8,
    /// Ends the work: what is predicted means nothing then.
    pub interrupt: &'a Interrupt,
}

/// Items that one thread does together.
const RUN: usize = 64;

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
    colour: Colour<'s>,
    items: Vec<Item>,
    /// Where the items are.
    position: [Vec<u32>; 3],
    /// `count` for each item.
    neighbours: Vec<Neighbour>,
    count: usize,
    rows: Rows,
    /// Squared differences of the attributes known so far, for each of `neighbours`.
    features: Vec<u64>,
    falloff: [u8; 2],
    /// Low bits of differences that are ignored.
    feature_shift: u8,
    /// The network, if a Gaussian takes it.
    network: Option<LaneNetwork>,
    interrupt: &'s Interrupt,
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
            .filter_map(|(row, (index, _))| predictor_of(index).map(|predictor| Item { row, predictor }))
            .filter(|item| item.predictor != Predictor::None)
            .collect();
        if items.is_empty() || set.is_empty() {
            return None;
        }
        let pick = |plane: &[u32]| -> Vec<u32> { items.iter().map(|item| at(plane, item.row)).collect() };
        let position = [pick(x), pick(y), pick(z)];
        let count = usize::from(header.neighbour_count).min(set.len());
        let search = NeighbourSearch::new_unless(by.interrupt, set.position.each_ref().map(Vec::as_slice));
        let neighbours = search.nearest_unless(by.interrupt, position.each_ref().map(Vec::as_slice), count);
        if by.interrupt.is_requested() {
            by.interrupt.leave((search, neighbours));
            return None;
        }
        let features = vec![0; neighbours.len()];
        let falloff = [header.bilateral_spatial, header.bilateral_feature];
        let network = by.network.filter(|_| predictors.contains(&Predictor::Transformer));
        let network = network.map(LaneNetwork::new);
        let (rows, colour, feature_shift) =
            (Rows::new_unless(by.interrupt, set, &neighbours), by.colour, by.feature_shift);
        Some(Self {
            set,
            colour,
            items,
            position,
            neighbours,
            count,
            rows,
            features,
            falloff,
            feature_shift,
            network,
            interrupt: by.interrupt,
        })
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
        let done = Stage::ALL.into_iter().try_for_each(|stage| {
            self.interrupt.check()?;
            self.predict(stage, attributes);
            self.interrupt.check()?;
            attributes.add_stage(stage, values, coding, at)?;
            self.learn(stage, attributes);
            Ok(())
        });
        self.interrupt.leave((self.neighbours, self.features, self.rows));
        done
    }

    /// Overwrites one attribute of the predicted Gaussians with its prediction.
    pub fn predict(&self, stage: Stage, attributes: &mut Attributes) {
        let unit = if stage == Stage::Rotation { FINE } else { 1 };
        self.means(stage, attributes.stage_mut(stage), unit);
        if stage == Stage::Dc
            && let Some(learned) = self.learned()
        {
            learned.predict(self, attributes);
        }
    }

    /// Updates the attribute differences with one attribute as it is reconstructed.
    pub fn learn(&mut self, stage: Stage, attributes: &Attributes) {
        let same: fn(i32) -> i32 = |value| value;
        let (grid, shift) = match stage {
            Stage::LogScale | Stage::Opacity => (same, self.feature_shift),
            Stage::Rotation => (canonical as fn(i32) -> i32, self.feature_shift),
            Stage::Dc => (same, self.feature_shift.wrapping_add(6)),
            // Nothing is predicted after it.
            Stage::Sh => return,
        };
        self.compare(stage, attributes.stage(stage), grid, shift.into());
    }

    /// The network, if a Gaussian takes it.
    pub fn learned(&self) -> Option<Learned<'_>> {
        let Self { network, set, rows, colour, feature_shift, interrupt, .. } = self;
        network.as_ref().map(|network| {
            let projection = Projection::new(network.header(), colour.dc, colour.sh);
            Learned { network, projection, set, rows, feature_shift: *feature_shift, interrupt }
        })
    }

    /// The items that the network predicts, once all attributes before dc are known.
    pub fn targets(&self) -> Vec<Target<'_>> {
        let items = self.learned_items();
        cores::map(items.len().saturating_mul(self.count), items, |item| self.target(item))
    }

    /// The numbers of the items that the network predicts.
    fn learned_items(&self) -> Vec<usize> {
        let items = self.items.iter().enumerate();
        items.filter(|(_, item)| item.predictor == Predictor::Transformer).map(|(number, _)| number).collect()
    }

    /// An item that the network predicts.
    fn target(&self, number: usize) -> Target<'_> {
        let gated = self.network.as_ref().is_some_and(|network| network.header().gated());
        let weights = self.weights(number, Predictor::Transformer);
        // No other network looks at them.
        let affinities = if gated { self.weights(number, Predictor::Bilateral) } else { [0; NEIGHBOURS_MAX] };
        let neighbours = self.neighbours.get(self.range(number)).unwrap_or_default();
        let indices = self.rows.indices(self.range(number));
        let position = self.position.each_ref().map(|plane| plane.get(number).copied().unwrap_or(0));
        let row = self.items.get(number).map_or(0, |item| item.row);
        Target { row, position, neighbours, indices, weights, affinities }
    }

    /// The indices of an item's neighbours.
    fn range(&self, item: usize) -> Range<usize> {
        let start = item.wrapping_mul(self.count);
        start..start.wrapping_add(self.count)
    }

    /// What the neighbours of an item weigh.
    fn weights(&self, item: usize, predictor: Predictor) -> [i64; NEIGHBOURS_MAX] {
        let neighbours = self.neighbours.get(self.range(item)).unwrap_or_default();
        let [spatial, feature] = self.falloff;
        let by_distance = match predictor {
            Predictor::None | Predictor::Knn => true,
            Predictor::Bilateral => false,
            Predictor::Transformer => {
                self.network.as_ref().is_some_and(|network| network.header().knn_base())
            }
        };
        if by_distance {
            return knn_weights(neighbours);
        }
        let features = self.features.get(self.range(item)).unwrap_or_default();
        bilateral_weights(neighbours, spatial, feature, features)
    }

    /// Whether the attribute differences of an item's neighbours are used.
    fn is_compared(&self, item: &Item) -> bool {
        let header = self.network.as_ref().map(|network| network.header());
        let learned = header.is_some_and(|header| header.gated() || !header.knn_base());
        item.predictor == Predictor::Bilateral || item.predictor == Predictor::Transformer && learned
    }

    /// Overwrites the items in `out` with the means of their neighbours, times `unit`; except those whose colour the
    /// network predicts.
    fn means(&self, stage: Stage, out: &mut [Vec<i32>], unit: i32) {
        let colour = matches!(stage, Stage::Dc | Stage::Sh);
        let columns = self.rows.columns(stage);
        let width = out.len();
        let mut means = vec![0; self.items.len().wrapping_mul(width)];
        let of_item = |(means, (index, item)): (&mut [i32], (usize, &Item))| {
            let is_learned = colour && item.predictor == Predictor::Transformer;
            if !is_learned {
                let rows = self.rows.of(self.range(index)).filter_map(|row| row.get(columns.clone()));
                let weighted = WeightedMean::new(&self.weights(index, item.predictor));
                weighted.of_rows(rows, means);
            }
        };
        let values = means.len().saturating_mul(self.count);
        let starts = (0..).step_by(RUN);
        let runs = means.chunks_mut(width.max(1).wrapping_mul(RUN)).zip(self.items.chunks(RUN)).zip(starts);
        cores::for_each(self.interrupt, values, runs, |((means, items), start)| {
            means.chunks_mut(width.max(1)).zip((start..).zip(items)).for_each(of_item);
        });
        cores::for_each(self.interrupt, means.len(), out.iter_mut().enumerate(), |(number, plane)| {
            let column = means.iter().skip(number).step_by(width);
            for (item, mean) in self.items.iter().zip(column) {
                let is_learned = colour && item.predictor == Predictor::Transformer;
                if let Some(slot) = plane.get_mut(item.row as usize).filter(|_| !is_learned) {
                    *slot = mean.wrapping_mul(unit);
                }
            }
        });
    }

    /// Adds the squares of the differences between the items and their neighbours in an attribute, rounded to steps of
    /// 2^shift. `grid` brings values of the items to the grid of the neighbours.
    fn compare(&mut self, stage: Stage, own: &[Vec<i32>], grid: fn(i32) -> i32, shift: u32) {
        let columns = self.rows.columns(stage);
        let mut mine = [0; 3];
        for (index, item) in self.items.iter().enumerate() {
            if !self.is_compared(item) || self.interrupt.is_requested() {
                continue;
            }
            mine.iter_mut().zip(own).for_each(|(mine, plane)| *mine = grid(at(plane, item.row)));
            let range = self.range(index);
            let rows = self.rows.of(range.clone()).filter_map(|row| row.get(columns.clone()));
            for (feature, row) in self.features.get_mut(range).unwrap_or_default().iter_mut().zip(rows) {
                for (theirs, mine) in row.iter().zip(mine) {
                    let difference =
                        rounded(i64::from(mine).wrapping_sub((*theirs).into()), shift).unsigned_abs();
                    *feature = feature.saturating_add(difference.wrapping_mul(difference));
                }
            }
        }
    }
}

/// `Round(value, bits)` of clause 4.
fn rounded(value: i64, bits: u32) -> i64 {
    value.wrapping_add(1_i64.wrapping_shl(bits) >> 1).wrapping_shr(bits)
}

/// Writes a value to a row of each plane.
fn set_row(planes: &mut [Vec<i32>], row: u32, values: impl Iterator<Item = i32>) {
    let row = usize::try_from(row).unwrap_or(usize::MAX);
    for (plane, value) in planes.iter_mut().zip(values) {
        if let Some(slot) = plane.get_mut(row) {
            *slot = value;
        }
    }
}

fn at<T: Copy + Default>(plane: &[T], row: u32) -> T {
    usize::try_from(row).ok().and_then(|row| plane.get(row)).copied().unwrap_or_default()
}
