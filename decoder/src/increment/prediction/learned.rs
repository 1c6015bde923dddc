//! Clause 7.17.6: from neighbours to what the network sees, and from its outputs to colour.

use super::{Attributes, at};
use crate::colour::Colour;
use crate::frame::QuantizedFrame;
use crate::home::canonical;
use crate::neighbours::Neighbour;
use crate::predictor::weighted_mean;
use crate::transformer::batch::Seen;
use crate::transformer::{Batch, LANES, LaneNetwork, OUTPUTS_MAX};
use rayon::prelude::*;
use splatstream_format::payload::{Network, Transform};
use splatstream_format::syntax::NetworkHeader;

/// The largest magnitude of a colour.
const COLOUR_MAX: i64 = 1 << 30;

/// The network of a GOP and the transforms it works in.
#[derive(Debug)]
pub struct Learned<'s> {
    header: NetworkHeader,
    network: LaneNetwork,
    dc: &'s Transform,
    sh: Option<&'s Transform>,
    set: &'s QuantizedFrame,
}

/// A new Gaussian that the network predicts.
#[derive(Debug, Clone, Copy)]
pub struct Target<'n> {
    /// Its place among the new Gaussians.
    pub row: u32,
    /// Its position.
    pub position: [u32; 3],
    /// Its neighbours in the reference set.
    pub neighbours: &'n [Neighbour],
    /// What they weigh for dc, 7.17.4.
    pub weights: [i64; 16],
}

/// The weighted means of the neighbours.
struct Base {
    dc: Vec<i32>,
    sh: Vec<i32>,
}

/// The colours predicted for some targets: dc, then sh.
type Predicted = Vec<(u32, Vec<i32>)>;

impl<'s> Learned<'s> {
    /// A network that predicts from a set of Gaussians.
    pub fn new(network: &Network, colour: &Colour<'s>, set: &'s QuantizedFrame) -> Self {
        let (dc, sh) = (colour.dc, colour.sh);
        Self { header: network.header, network: LaneNetwork::new(network), dc, sh, set }
    }

    /// Puts the colours that the network predicts in the place of what `attributes` holds for the targets. Their
    /// log-scales, opacities and rotations have been reconstructed.
    pub fn predict(&self, targets: &[Target<'_>], attributes: &mut Attributes) {
        let components = self.components(targets);
        let of_run = |run: &[Target<'_>]| self.colours(run, attributes, &components);
        let predicted: Vec<Predicted> = targets.par_chunks(LANES).map(of_run).collect();
        for (row, colours) in predicted.into_iter().flatten() {
            let row = usize::try_from(row).unwrap_or(usize::MAX);
            let planes = attributes.dc.iter_mut().chain(&mut attributes.sh);
            for (plane, colour) in planes.zip(colours) {
                if let Some(slot) = plane.get_mut(row) {
                    *slot = colour;
                }
            }
        }
    }

    /// What the network sees of targets, [`LANES`] of them in each batch. The encoder trains with it.
    pub fn batches(&self, targets: &[Target<'_>], attributes: &Attributes) -> Vec<Batch> {
        let components = self.components(targets);
        targets.par_chunks(LANES).map(|run| self.seen(run, attributes, &components).0).collect()
    }

    /// What the outputs should be for each target, in step/64: the components of its colour in the planes `dc` and
    /// `sh` less those of its base.
    pub fn wanted(&self, targets: &[Target<'_>], dc: &[Vec<i32>], sh: &[Vec<i32>]) -> Vec<Vec<i32>> {
        let of_target = |target: &Target<'_>| -> Vec<i32> {
            let base = self.base(target);
            let mut components = vec![0_i64; self.header.outputs()];
            let value = |plane: &Vec<i32>| at(plane, target.row);
            self.add_components(&mut components, dc.iter().map(value), sh.iter().map(value), 1);
            self.add_components(&mut components, base.dc.into_iter(), base.sh.into_iter(), -1);
            components.into_iter().map(|sum| round12(sum) as i32).collect()
        };
        targets.par_iter().map(of_target).collect()
    }

    /// The components of every Gaussian of the set that is a neighbour, times 2^12.
    fn components(&self, targets: &[Target<'_>]) -> Components {
        let width = self.header.outputs();
        let mut places = vec![u32::MAX; self.set.len()];
        let mut used = Vec::new();
        for neighbour in targets.iter().flat_map(|target| target.neighbours) {
            if let Some(place) = places.get_mut(neighbour.index as usize).filter(|place| **place == u32::MAX)
            {
                *place = u32::try_from(used.len()).unwrap_or(u32::MAX);
                used.push(neighbour.index);
            }
        }
        let mut values = vec![0; used.len().wrapping_mul(width)];
        values.par_chunks_mut(width.max(1)).zip(&used).for_each(|(values, &index)| {
            let value = |plane: &Vec<i32>| at(plane, index);
            self.add_components(values, self.set.dc.iter().map(value), self.set.sh.iter().map(value), 1);
        });
        Components { places, values, width }
    }

    /// Adds `sign` times the components of a colour.
    fn add_components(
        &self,
        out: &mut [i64],
        dc: impl Iterator<Item = i32> + Clone,
        sh: impl Iterator<Item = i32> + Clone,
        sign: i64,
    ) {
        let (dc_out, sh_out) = out.split_at_mut_checked(self.header.dc_count.into()).unwrap_or_default();
        add_forward(self.dc, dc, dc_out, sign);
        if let Some(transform) = self.sh {
            // The planes are read once for every component.
            let sh: Vec<i32> = sh.collect();
            add_forward(transform, sh.iter().copied(), sh_out, sign);
        }
    }

    fn base(&self, target: &Target<'_>) -> Base {
        let mean = |plane: &Vec<i32>| {
            let values = target.neighbours.iter().map(|neighbour| at(plane, neighbour.index));
            weighted_mean(&target.weights, values)
        };
        Base { dc: self.set.dc.iter().map(mean).collect(), sh: self.set.sh.iter().map(mean).collect() }
    }

    fn seen(
        &self,
        targets: &[Target<'_>],
        attributes: &Attributes,
        components: &Components,
    ) -> (Batch, Vec<Base>) {
        let count = targets.first().map_or(1, |target| target.neighbours.len());
        let mut batch = Batch::new(&self.header, count);
        let mut bases = Vec::with_capacity(targets.len());
        for (lane, target) in targets.iter().enumerate() {
            let base = self.base(target);
            let mut own = vec![0; components.width];
            self.add_components(&mut own, base.dc.iter().copied(), base.sh.iter().copied(), 1);
            bases.push(base);
            let farthest = target.neighbours.last().map_or(0, |neighbour| neighbour.distance);
            let geometry = geometry_of(attributes, target.row);
            for (rank, (neighbour, &weight)) in target.neighbours.iter().zip(&target.weights).enumerate() {
                let difference = |(theirs, own): (&i64, &i64)| theirs.wrapping_sub(*own);
                let theirs = components.of(neighbour.index);
                let apart: Vec<i64> = theirs.iter().zip(&own).map(difference).collect();
                let theirs = geometry_in(self.set, neighbour.index);
                let mut geometry = geometry.into_iter();
                let geometry = theirs.map(|theirs| theirs.wrapping_sub(geometry.next().unwrap_or(0)));
                let seen = Seen { components: &apart, geometry, weight, distance: neighbour.distance };
                batch.set_token(&self.header, (lane, rank), &seen, farthest);
            }
            batch.set_near(lane, &self.offsets(target));
        }
        (batch, bases)
    }

    /// Neighbours' positions less the target's, in lattice steps.
    fn offsets(&self, target: &Target<'_>) -> Vec<[i32; 3]> {
        let offset = |neighbour: &Neighbour| {
            let mut own = target.position.into_iter();
            self.set
                .position
                .each_ref()
                .map(|plane| at(plane, neighbour.index).wrapping_sub(own.next().unwrap_or(0)).cast_signed())
        };
        target.neighbours.iter().map(offset).collect()
    }

    /// The colours of a run of targets.
    fn colours(&self, targets: &[Target<'_>], attributes: &Attributes, components: &Components) -> Predicted {
        let (batch, bases) = self.seen(targets, attributes, components);
        let outputs = self.network.outputs(&batch);
        let colour = |(lane, (target, base)): (usize, (&Target<'_>, Base))| {
            let mut own = [0; OUTPUTS_MAX];
            for (own, row) in own.iter_mut().zip(&outputs) {
                *own = row.get(lane).copied().unwrap_or(0);
            }
            let (dc, sh) = own.split_at_checked(self.header.dc_count.into()).unwrap_or_default();
            let sh = sh.get(..self.header.sh_count.into()).unwrap_or_default();
            let mut colours = added(self.dc, base.dc, dc);
            colours.extend(match self.sh {
                Some(transform) => added(transform, base.sh, sh),
                None => base.sh,
            });
            (target.row, colours)
        };
        targets.iter().zip(bases).enumerate().map(colour).collect()
    }
}

/// Components times 2^12 of those Gaussians of a set that are in use.
struct Components {
    /// Of each Gaussian of the set, its place among those in use.
    places: Vec<u32>,
    values: Vec<i64>,
    width: usize,
}

impl Components {
    fn of(&self, index: u32) -> &[i64] {
        let place = self.places.get(index as usize).copied().unwrap_or(u32::MAX) as usize;
        let start = place.wrapping_mul(self.width);
        self.values.get(start..start.wrapping_add(self.width)).unwrap_or_default()
    }
}

/// Adds `sign` times the sums of basis and colour to the components that the transform has.
fn add_forward(transform: &Transform, colour: impl Iterator<Item = i32> + Clone, out: &mut [i64], sign: i64) {
    for (out, row) in out.iter_mut().zip(transform.rows()) {
        let term = |(&weight, value): (&i16, i32)| i64::from(weight).wrapping_mul(value.into());
        let sum = row.iter().zip(colour.clone()).map(term).fold(0, i64::wrapping_add);
        *out = out.wrapping_add(sum.wrapping_mul(sign));
    }
}

/// A base and what the outputs add to it.
fn added(transform: &Transform, base: Vec<i32>, outputs: &[i32]) -> Vec<i32> {
    let mut sums = vec![0_i64; base.len()];
    for (row, &output) in transform.rows().zip(outputs) {
        for (sum, &weight) in sums.iter_mut().zip(row) {
            *sum = sum.wrapping_add(i64::from(weight).wrapping_mul(output.into()));
        }
    }
    let value = |(base, sum): (i32, i64)| {
        i64::from(base).wrapping_add(round12(sum)).clamp(COLOUR_MAX.wrapping_neg(), COLOUR_MAX) as i32
    };
    base.into_iter().zip(sums).map(value).collect()
}

fn round12(sum: i64) -> i64 {
    sum.wrapping_add(1 << 11).wrapping_shr(12)
}

/// log_scale, opacity and rotation of a new Gaussian as reconstructed.
fn geometry_of(attributes: &Attributes, row: u32) -> [i32; 7] {
    let [a, b, c] = attributes.log_scale.each_ref().map(|plane| at(plane, row));
    let [x, y, z] = attributes.rotation_fine.each_ref().map(|plane| canonical(at(plane, row)));
    [a, b, c, at(&attributes.opacity, row), x, y, z]
}

/// Those of a Gaussian of the set.
fn geometry_in(set: &QuantizedFrame, index: u32) -> [i32; 7] {
    let [a, b, c] = set.log_scale.each_ref().map(|plane| at(plane, index));
    let [x, y, z] = set.rotation.each_ref().map(|plane| at(plane, index));
    [a, b, c, at(&set.opacity, index), x, y, z]
}
