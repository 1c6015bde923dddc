//! Contexts while a plane is decoded, for all lanes of a block together.

use super::{DeltaNeighbours, SourceValues, is_serial, term};
use crate::coded_block::CodedBlock;
use splatstream_format::entropy::MAX_LANES;
use splatstream_format::entropy::layout::PlaneInfo;
use splatstream_format::entropy::model::{AxisLookup, Source};
use splatstream_format::entropy::reader::{Contexts, PlaneDecoder};

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
    source: Source,
    sums: [i32; MAX_LANES],
    /// The terms of the last four steps, the oldest at `oldest`.
    terms: [[i32; MAX_LANES]; 4],
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

impl Contexts<i32> for PlaneContexts<'_> {
    #[inline(always)]
    fn gather(&self, first: usize, contexts: &mut [u8]) {
        for axis in &self.axes {
            let AxisValues::Known(values) = &axis.values else { continue };
            if let SourceValues::Plane(plane) = values {
                axis.lookup.add_contexts(plane.get(first..).unwrap_or_default(), contexts);
                continue;
            }
            let mut of_axis = [0; MAX_LANES];
            let of_axis = of_axis.get_mut(..contexts.len()).unwrap_or_default();
            values.write(first, of_axis);
            axis.lookup.add_contexts(of_axis, contexts);
        }
    }

    #[inline(always)]
    fn complete(&self, contexts: &mut [u8]) {
        for axis in &self.axes {
            let AxisValues::Serial(sums) = &axis.values else { continue };
            axis.lookup.add_contexts(&sums.sums, contexts);
        }
    }

    #[inline(always)]
    fn follow(&mut self, values: &[i32]) {
        for axis in &mut self.axes {
            if let AxisValues::Serial(sums) = &mut axis.values {
                sums.follow(values);
            }
        }
    }
}

impl Sums {
    fn new(source: Source) -> Self {
        Self { source, sums: [0; MAX_LANES], terms: [[0; MAX_LANES]; 4], oldest: 0 }
    }

    #[inline(always)]
    fn follow(&mut self, values: &[i32]) {
        let Some(oldest) = self.terms.get_mut(self.oldest & 3) else { return };
        for ((sum, before), &value) in self.sums.iter_mut().zip(oldest).zip(values) {
            let term = term(self.source, value);
            *sum = sum.wrapping_add(term).wrapping_sub(*before);
            *before = term;
        }
        self.oldest = self.oldest.wrapping_add(1);
    }
}

/// The contexts of a plane of the position alphabet.
pub(crate) struct DeltaContexts<'b> {
    /// Each axis that has a source.
    axes: [Option<&'b AxisLookup>; 2],
    neighbours: [DeltaNeighbours; MAX_LANES],
}

impl<'b> DeltaContexts<'b> {
    pub(crate) fn new(decoder: &'b PlaneDecoder) -> Self {
        let [has_first, has_second] = decoder.axes().each_ref().map(|axis| axis.source != Source::None);
        let [first, second] = decoder.lookups();
        let axes = [has_first.then_some(first), has_second.then_some(second)];
        Self { axes, neighbours: [DeltaNeighbours::default(); MAX_LANES] }
    }
}

impl Contexts<u64> for DeltaContexts<'_> {
    fn gather(&self, _: usize, _: &mut [u8]) {}

    #[inline(always)]
    fn complete(&self, contexts: &mut [u8]) {
        for lookup in self.axes.iter().flatten() {
            for (context, neighbours) in contexts.iter_mut().zip(&self.neighbours) {
                *context = context.wrapping_add(lookup.context(neighbours.value()));
            }
        }
    }

    #[inline(always)]
    fn follow(&mut self, values: &[u64]) {
        self.neighbours.iter_mut().zip(values).for_each(|(neighbours, &delta)| neighbours.push(delta));
    }
}
