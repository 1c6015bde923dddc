//! Clause 7.7.6: from neighbours to what the network sees, and from its outputs to colour.
//!
//! No sum overflows (annex F.6). Neighbours are rows, and rows have the columns of the planes of the set.

use super::projection::{COLOURS_MAX, Colour, Components, Projection};
use super::rows::Rows;
use super::{Attributes, Prediction, RUN, at, set_row};
use crate::cores;
use crate::frame::QuantizedFrame;
use crate::interrupt::Interrupt;
use crate::list::canonical;
use crate::neighbours::Neighbour;
use crate::predictor::{NEIGHBOURS_MAX, WeightedMean};
use crate::stage::Stage;
use crate::transformer::{Batch, INPUTS_MAX, LANES, LaneNetwork, OUTPUTS_MAX, Seen};

/// The network of a GOP, what it works in, and the set it predicts from.
#[derive(Debug)]
pub struct Learned<'s> {
    pub(super) network: &'s LaneNetwork,
    pub(super) projection: Projection,
    pub(super) set: &'s QuantizedFrame,
    pub(super) rows: &'s Rows,
    /// Low bits of differences that are ignored.
    pub(super) feature_shift: u8,
    pub(super) interrupt: &'s Interrupt,
}

/// A new Gaussian that the network predicts.
#[derive(Debug, Clone, Copy)]
pub struct Target<'n> {
    /// Its index among the new Gaussians.
    pub row: u32,
    /// Its position.
    pub(super) position: [u32; 3],
    /// Its neighbours in the reference set.
    pub(super) neighbours: &'n [Neighbour],
    /// Their rows.
    pub(super) indices: &'n [u32],
    /// What they weigh in the base.
    pub(super) weights: [i64; NEIGHBOURS_MAX],
    /// What they weigh for dc, 7.7.4; 0 if the network is not gated.
    pub(super) affinities: [i64; NEIGHBOURS_MAX],
}

/// Values that the network works on for so many targets, in each of its layers.
fn values_of(targets: usize) -> usize {
    targets.saturating_mul(INPUTS_MAX)
}

impl Learned<'_> {
    /// Overwrites the colours of the Gaussians that the network predicts. Their log-scales, opacities and rotations have been
    /// reconstructed. Each run of [`LANES`] is looked at by itself, so that nothing is held for all of them but their colours.
    pub(super) fn predict(&self, prediction: &Prediction<'_>, attributes: &mut Attributes) {
        let items = prediction.learned_items();
        let indices = items.iter().take_while(|_| !self.interrupt.is_requested());
        let components =
            self.components(indices.map(|&item| prediction.rows.indices(prediction.range(item))));
        let of_run = |run: &[usize]| -> Vec<(u32, Colour)> {
            if self.interrupt.is_requested() {
                return Vec::new();
            }
            let targets: Vec<_> = run.iter().map(|&item| prediction.target(item)).collect();
            let colours = self.colours(&targets, attributes, &components);
            targets.iter().map(|target| target.row).zip(colours).collect()
        };
        let runs = items.chunks(LANES).collect();
        let predicted = cores::map(values_of(items.len()), runs, of_run);
        let runs = predicted.iter().take_while(|_| !self.interrupt.is_requested());
        for (row, colour) in runs.flatten() {
            let (dc, sh) = colour.split_at(3);
            set_row(&mut attributes.dc, *row, dc.iter().copied());
            set_row(&mut attributes.sh, *row, sh.iter().copied());
        }
        self.interrupt.leave((predicted, components));
    }

    /// What the network sees of targets, [`LANES`] of them in each batch. The encoder trains with it.
    pub fn batches(&self, targets: &[Target<'_>], attributes: &Attributes) -> Vec<Batch> {
        let components = self.components(targets.iter().map(|target| target.indices));
        let batch = |run: &[Target<'_>]| self.batch(run, &self.bases(run), attributes, &components);
        cores::map(values_of(targets.len()), targets.chunks(LANES).collect(), batch)
    }

    /// What the outputs should be for each target, in step/64: the components of its colour in the planes `dc` and
    /// `sh` less those of its base.
    pub fn wanted(&self, targets: &[Target<'_>], dc: &[Vec<i32>], sh: &[Vec<i32>]) -> Vec<Vec<i32>> {
        let of_target = |target: &Target<'_>| -> Vec<i32> {
            let mut own = [0; COLOURS_MAX];
            let planes = dc.iter().take(3).chain(sh);
            own.iter_mut().zip(planes).for_each(|(value, plane)| *value = at(plane, target.row));
            let own = self.projection.components(&own);
            let base = self.projection.components(&self.base(target));
            let pairs = own.iter().zip(base).take(self.network.header().outputs());
            pairs.map(|(own, base)| round12(own.wrapping_sub(base)) as i32).collect()
        };
        cores::map(values_of(targets.len()), targets.iter().collect(), of_target)
    }

    /// The components of every row that is a neighbour of a target, whose `indices` these are; of the others 0.
    fn components<'i>(&self, indices: impl Iterator<Item = &'i [u32]>) -> Vec<Components> {
        let mut used = vec![false; self.rows.len()];
        for &index in indices.flatten() {
            if let Some(used) = used.get_mut(index as usize) {
                *used = true;
            }
        }
        let start = self.rows.columns(Stage::Dc).start;
        let mut components = vec![[0; OUTPUTS_MAX]; self.rows.len()];
        let values = components.len().saturating_mul(OUTPUTS_MAX);
        let firsts = (0_u32..).step_by(RUN);
        let runs = components.chunks_mut(RUN).zip(used.chunks(RUN)).zip(firsts);
        cores::for_each(self.interrupt, values, runs, |((components, used), first)| {
            let rows = components.iter_mut().zip(first..).zip(used);
            for ((components, row), _) in rows.filter(|(_, used)| **used) {
                *components = self.projection.components(self.rows.row(row).get(start..).unwrap_or_default());
            }
        });
        components
    }

    /// The weighted mean of the neighbours' colours.
    fn base(&self, target: &Target<'_>) -> Colour {
        let mut base = [0; COLOURS_MAX];
        let (dc, sh) = base.split_at_mut(3);
        let weighted = WeightedMean::new(&target.weights);
        for (stage, out) in [(Stage::Dc, dc), (Stage::Sh, sh)] {
            let columns = self.rows.columns(stage);
            let rows = target.indices.iter().filter_map(|&index| self.rows.row(index).get(columns.clone()));
            weighted.of_rows(rows, out);
        }
        base
    }

    fn bases(&self, targets: &[Target<'_>]) -> Vec<Colour> {
        targets.iter().map(|target| self.base(target)).collect()
    }

    fn batch(
        &self,
        targets: &[Target<'_>],
        bases: &[Colour],
        attributes: &Attributes,
        components: &[Components],
    ) -> Batch {
        let count = targets.first().map_or(1, |target| target.neighbours.len());
        let header = self.network.header();
        let mut batch = Batch::new(header, count);
        for (lane, (target, base)) in targets.iter().zip(bases).enumerate() {
            let own = self.projection.components(base);
            let farthest = target.neighbours.last().map_or(0, |neighbour| neighbour.distance);
            let geometry = geometry_of(attributes, target.row);
            let neighbours = target.neighbours.iter().zip(target.indices).zip(target.affinities);
            for (rank, ((neighbour, &index), affinity)) in neighbours.enumerate() {
                let mut apart = components.get(index as usize).copied().unwrap_or_default();
                apart.iter_mut().zip(&own).for_each(|(apart, own)| *apart = apart.wrapping_sub(*own));
                let mut theirs = self.rows.row(index).iter();
                let difference = |own: i32| theirs.next().map_or(0, |theirs| theirs.wrapping_sub(own));
                let geometry = geometry.map(difference);
                let seen = Seen {
                    components: &apart,
                    geometry,
                    feature_shift: self.feature_shift,
                    affinity,
                    distance: neighbour.distance,
                };
                batch.set_token(header, (lane, rank), &seen, farthest);
            }
            let offsets = self.offsets(target);
            batch.set_near(lane, offsets.get(..target.neighbours.len()).unwrap_or_default());
        }
        batch
    }

    /// Neighbours' positions less the target's, in grid steps.
    fn offsets(&self, target: &Target<'_>) -> [[i32; 3]; NEIGHBOURS_MAX] {
        let mut offsets = [[0; 3]; NEIGHBOURS_MAX];
        for (offset, neighbour) in offsets.iter_mut().zip(target.neighbours) {
            let mut own = target.position.into_iter();
            let apart = |plane: &Vec<u32>| at(plane, neighbour.index).wrapping_sub(own.next().unwrap_or(0));
            *offset = self.set.position.each_ref().map(apart).map(u32::cast_signed);
        }
        offsets
    }

    /// The colours of a run of targets.
    fn colours(
        &self,
        targets: &[Target<'_>],
        attributes: &Attributes,
        components: &[Components],
    ) -> Vec<Colour> {
        let mut colours = self.bases(targets);
        let outputs = self.network.outputs(&self.batch(targets, &colours, attributes, components));
        for (lane, colour) in colours.iter_mut().enumerate() {
            let outputs = outputs.iter().map(|row| row.get(lane).copied().unwrap_or(0));
            self.projection.add(outputs, colour);
        }
        colours
    }
}

fn round12(sum: i64) -> i64 {
    sum.wrapping_add(1 << 11).wrapping_shr(12)
}

/// log_scale, opacity and rotation of a new Gaussian as reconstructed, in the order of the columns of a row.
fn geometry_of(attributes: &Attributes, row: u32) -> [i32; 7] {
    let [a, b, c] = attributes.log_scale.each_ref().map(|plane| at(plane, row));
    let [x, y, z] = attributes.rotation_fine.each_ref().map(|plane| canonical(at(plane, row)));
    [a, b, c, at(&attributes.opacity, row), x, y, z]
}
