//! Contexts while a plane is decoded, for all lanes of a block together.
//!
//! The oldest of a ring is counted modulo its length.

use super::{DeltaNeighbours, SourceValues, is_serial};
use crate::coded_block::CodedBlock;
use splatstream_format::entropy::MAX_LANES;
use splatstream_format::entropy::layout::PlaneInfo;
use splatstream_format::entropy::machine::{Machine, WIDE};
use splatstream_format::entropy::model::{AxisLookup, Source};
use splatstream_format::entropy::reader::{Contexts, PlaneDecoder, signed, vector};

/// The contexts of a plane that is not of the position alphabet.
pub(crate) struct PlaneContexts<'b> {
    axes: [Axis<'b>; 2],
}

/// One axis: where its contexts come from.
struct Axis<'b> {
    lookup: &'b AxisLookup,
    values: AxisValues<'b>,
}

enum AxisValues<'b> {
    /// There is one context only.
    None,
    Known(SourceValues<'b>),
    Serial(Box<Sums>),
}

/// The sums of the last four values of each lane.
struct Sums {
    is_magnitude: bool,
    sums: [[i32; WIDE]; MAX_LANES / WIDE],
    /// The terms of the last four steps, the oldest at `oldest`.
    terms: [[[i32; WIDE]; MAX_LANES / WIDE]; 4],
    oldest: usize,
}

impl<'b> PlaneContexts<'b> {
    /// Of plane number `plane` of a block, which has the planes before it.
    pub(crate) fn new(
        decoder: &'b PlaneDecoder,
        plane: usize,
        info: PlaneInfo,
        block: &'b CodedBlock,
    ) -> Self {
        let [first, second] = decoder.lookups();
        let [of_first, of_second] = decoder.axes().each_ref().map(|axis| match axis.source {
            Source::None => AxisValues::None,
            source if is_serial(source) => AxisValues::Serial(Box::new(Sums::new(source))),
            source => AxisValues::Known(SourceValues::of(source, plane, info, block)),
        });
        let axes = [Axis { lookup: first, values: of_first }, Axis { lookup: second, values: of_second }];
        Self { axes }
    }
}

/// Adds vectors to others.
#[inline(always)]
fn add<M: Machine, const COUNT: usize>(machine: M, sums: &mut [M::V; COUNT], terms: &[M::V; COUNT]) {
    for (sum, &term) in sums.iter_mut().zip(terms) {
        *sum = machine.add(*sum, term);
    }
}

/// Adds the contexts of vectors of values on an axis to others.
#[inline(always)]
fn add_contexts<M: Machine, const COUNT: usize>(
    machine: M,
    axis: &AxisLookup,
    mut values: [M::V; COUNT],
    contexts: &mut [M::V; COUNT],
) {
    axis.contexts(machine, &mut values);
    add(machine, contexts, &values);
}

impl<M: Machine> Contexts<M, i32> for PlaneContexts<'_> {
    #[inline(always)]
    fn known(&self, machine: M, first: [usize; WIDE]) -> Option<[M::V; WIDE]> {
        let mut known: Option<[M::V; WIDE]> = None;
        for axis in &self.axes {
            if let AxisValues::Known(values) = &axis.values {
                let mut contexts = values.vectors(machine, first);
                axis.lookup.contexts(machine, &mut contexts);
                if let Some(known) = known {
                    add(machine, &mut contexts, &known);
                }
                known = Some(contexts);
            }
        }
        known
    }

    #[inline(always)]
    fn add_serial<const GROUPS: usize>(&self, machine: M, contexts: &mut [M::V; GROUPS]) {
        for axis in &self.axes {
            if let AxisValues::Serial(sums) = &axis.values {
                add_contexts(machine, axis.lookup, sums.vectors(machine), contexts);
            }
        }
    }

    #[inline(always)]
    fn follow<const GROUPS: usize>(&mut self, machine: M, values: &[[i32; WIDE]; GROUPS]) {
        for axis in &mut self.axes {
            if let AxisValues::Serial(sums) = &mut axis.values {
                sums.follow(machine, values);
            }
        }
    }
}

impl Sums {
    fn new(source: Source) -> Self {
        let none = [[0; WIDE]; MAX_LANES / WIDE];
        Self { is_magnitude: source == Source::NeighbourMagnitude, sums: none, terms: [none; 4], oldest: 0 }
    }

    #[inline(always)]
    fn vectors<M: Machine, const GROUPS: usize>(&self, machine: M) -> [M::V; GROUPS] {
        let mut vectors = [machine.splat(0); GROUPS];
        for (slot, sums) in vectors.iter_mut().zip(&self.sums) {
            *slot = vector(machine, sums);
        }
        vectors
    }

    #[inline(always)]
    fn follow<M: Machine, const GROUPS: usize>(&mut self, machine: M, values: &[[i32; WIDE]; GROUPS]) {
        let Some(oldest) = self.terms.get_mut(self.oldest & 3) else { return };
        for ((sums, before), values) in self.sums.iter_mut().zip(oldest).zip(values) {
            let values = vector(machine, values);
            let term = if self.is_magnitude { machine.magnitude(values) } else { values };
            let change = machine.sub(term, vector(machine, before));
            *sums = signed(machine, machine.add(vector(machine, sums), change));
            *before = signed(machine, term);
        }
        self.oldest = self.oldest.wrapping_add(1);
    }
}

/// The contexts of a plane of the position alphabet.
pub(crate) struct DeltaContexts<'b> {
    /// Each axis that has a source.
    axes: [Option<&'b AxisLookup>; 2],
    neighbours: [[DeltaNeighbours; WIDE]; MAX_LANES / WIDE],
}

impl<'b> DeltaContexts<'b> {
    pub(crate) fn new(decoder: &'b PlaneDecoder) -> Self {
        let [has_first, has_second] = decoder.axes().each_ref().map(|axis| axis.source != Source::None);
        let [first, second] = decoder.lookups();
        let axes = [has_first.then_some(first), has_second.then_some(second)];
        Self { axes, neighbours: [[DeltaNeighbours::default(); WIDE]; MAX_LANES / WIDE] }
    }
}

impl<M: Machine> Contexts<M, u64> for DeltaContexts<'_> {
    #[inline(always)]
    fn known(&self, _: M, _: [usize; WIDE]) -> Option<[M::V; WIDE]> {
        None
    }

    #[inline(always)]
    fn add_serial<const GROUPS: usize>(&self, machine: M, contexts: &mut [M::V; GROUPS]) {
        let mut values = [machine.splat(0); GROUPS];
        for (slot, neighbours) in values.iter_mut().zip(&self.neighbours) {
            *slot = vector(machine, &neighbours.each_ref().map(DeltaNeighbours::value));
        }
        for lookup in self.axes.iter().flatten() {
            add_contexts(machine, lookup, values, contexts);
        }
    }

    #[inline(always)]
    fn follow<const GROUPS: usize>(&mut self, _: M, values: &[[u64; WIDE]; GROUPS]) {
        for (neighbours, values) in self.neighbours.iter_mut().zip(values) {
            neighbours.iter_mut().zip(values).for_each(|(neighbours, &delta)| neighbours.push(delta));
        }
    }
}
