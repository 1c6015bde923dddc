//! Clause 8.5: the values that choose the context of a symbol.
//!
//! No sum overflows (annex F.2), and sources are known before they are asked for: the layout has been checked against them.

use crate::coded_block::CodedBlock;
pub use crate::coded_block::bit_length;
use crate::stage::Stage;
use crate::steps::Exponents;
use splatstream_format::entropy::lanes::Segments;
use splatstream_format::entropy::layout::PlaneInfo;
use splatstream_format::entropy::machine::{Machine, WIDE};
use splatstream_format::entropy::model::{AxisLookup, ContextAxis, Source};
use splatstream_format::entropy::reader::vector;
use std::borrow::Cow;

pub(crate) mod lanes;

/// The context value of a Morton delta: the bit lengths of the two deltas before it.
#[derive(Debug, Clone, Copy, Default)]
pub struct DeltaNeighbours {
    last: u32,
    before: u32,
}

impl DeltaNeighbours {
    /// Remembers a delta.
    #[inline(always)]
    pub fn push(&mut self, delta: u64) {
        self.before = self.last;
        self.last = bit_length(delta);
    }

    /// Twice the last bit length plus the one before.
    #[inline(always)]
    pub fn value(&self) -> i32 {
        self.last.wrapping_mul(2).wrapping_add(self.before).cast_signed()
    }
}

/// True if the source's values depend on values of the plane itself.
pub fn is_serial(source: Source) -> bool {
    matches!(source, Source::NeighbourSum | Source::NeighbourMagnitude)
}

/// The values of a source that is not serial, of which all entries are known before the plane is read.
#[derive(Debug, Clone, Copy)]
pub(crate) enum SourceValues<'b> {
    /// The same for all entries.
    Same(i32),
    /// Those of a plane.
    Plane(&'b [i32]),
    /// Exponents of steps.
    Exponents(&'b [u8]),
}

impl<'b> SourceValues<'b> {
    /// The values of a source for plane number `plane` of a block.
    pub(crate) fn of(source: Source, plane: usize, info: PlaneInfo, block: &'b CodedBlock) -> Self {
        let [largest, middle, _] = block.log_scale.each_ref().map(Vec::as_slice);
        match source {
            Source::None | Source::NeighbourSum | Source::NeighbourMagnitude => Self::Same(0),
            Source::PreviousPlane => {
                let before = plane.checked_sub(1).and_then(|before| block.coded.get(before));
                Self::Plane(before.map(Vec::as_slice).unwrap_or_default())
            }
            Source::GroupMagnitude => Self::Plane(block.magnitudes_before(plane)),
            Source::LargestLogScale => Self::Plane(largest),
            Source::MiddleLogScale => Self::Plane(middle),
            Source::LogVolume => Self::Plane(block.log_volumes()),
            Source::Anisotropy => Self::Plane(block.anisotropies()),
            Source::Opacity => Self::Plane(&block.opacity),
            Source::PositionSpacing => Self::Plane(block.spacings()),
            Source::StepExponent => match Stage::of(info.attribute).map(|stage| block.exponents(stage)) {
                None => Self::Same(0),
                Some(Exponents::Same(exponent)) => Self::Same((*exponent).into()),
                Some(Exponents::Each(exponents)) => Self::Exponents(exponents),
            },
        }
    }

    /// The values of eight entries of each of eight lanes, from `first` on; 0 where there are no entries.
    #[inline(always)]
    pub(crate) fn vectors<M: Machine>(&self, machine: M, first: [usize; WIDE]) -> [M::V; WIDE] {
        let mut vectors = [machine.splat(0); WIDE];
        match *self {
            Self::Same(value) => vectors.fill(machine.splat(value.cast_unsigned())),
            Self::Plane(plane) => {
                for (slot, first) in vectors.iter_mut().zip(first) {
                    // Each loads its own: an array that is either of two is copied by a call on WebAssembly.
                    let rest = plane.get(first..).unwrap_or_default();
                    *slot = match rest.first_chunk() {
                        Some(values) => vector(machine, values),
                        None => vector(machine, &last(rest)),
                    };
                }
            }
            Self::Exponents(exponents) => {
                for (slot, first) in vectors.iter_mut().zip(first) {
                    *slot = machine.load(eight(exponents, first).map(u32::from));
                }
            }
        }
        vectors
    }
}

/// Eight exponents from `first` on; 0 where there are none.
#[inline(always)]
fn eight(exponents: &[u8], first: usize) -> [u8; WIDE] {
    let rest = exponents.get(first..).unwrap_or_default();
    match rest.first_chunk() {
        Some(values) => *values,
        None => last(rest),
    }
}

#[cold]
fn last<T: Copy + Default>(rest: &[T]) -> [T; WIDE] {
    let mut values = [T::default(); WIDE];
    values.iter_mut().zip(rest).for_each(|(slot, &value)| *slot = value);
    values
}

/// The values of a source that is not serial for every entry of a block, known before `plane` is read; none of a serial
/// source.
pub fn values(source: Source, plane: usize, info: PlaneInfo, block: &CodedBlock) -> Cow<'_, [i32]> {
    match SourceValues::of(source, plane, info, block) {
        _ if source == Source::None || is_serial(source) => Cow::default(),
        SourceValues::Plane(plane) => plane.into(),
        SourceValues::Same(value) => vec![value; block.len()].into(),
        SourceValues::Exponents(exponents) => exponents.iter().map(|&exponent| exponent.into()).collect(),
    }
}

/// The contexts of one axis for every entry; empty if the axis has no or a serial source.
fn axis_contexts(axis: &ContextAxis, plane: usize, info: PlaneInfo, block: &CodedBlock) -> Vec<u8> {
    if axis.source == Source::None || is_serial(axis.source) {
        return Vec::new();
    }
    contexts_of(axis, &values(axis.source, plane, info, block))
}

/// The contexts of a plane whose values are known: what the encoder codes with.
///
/// `values` are the plane's coded values; the position plane goes through [`delta_contexts`].
pub fn plane_contexts(
    axes: &[ContextAxis; 2],
    plane: usize,
    info: PlaneInfo,
    block: &CodedBlock,
    values: &[i32],
) -> Vec<u8> {
    let [first, second] = axes;
    if first.source == Source::None {
        return Vec::new();
    }
    let on_axis = |axis: &ContextAxis| match is_serial(axis.source) {
        true => contexts_of(axis, &serial_values(axis.source, values, block.segments())),
        false => axis_contexts(axis, plane, info, block),
    };
    combine(&on_axis(first), &on_axis(second), second.contexts())
}

/// The contexts of the deltas of a block.
pub fn delta_contexts(axes: &[ContextAxis; 2], deltas: &[u64], segments: Segments) -> Vec<u8> {
    let [first, second] = axes;
    if first.source == Source::None {
        return Vec::new();
    }
    let before = delta_values(deltas, segments);
    combine(&contexts_of(first, &before), &contexts_of(second, &before), second.contexts())
}

/// The context values of the deltas of a block, which start again in each segment.
pub fn delta_values(deltas: &[u64], segments: Segments) -> Vec<i32> {
    let mut values = Vec::with_capacity(deltas.len());
    for deltas in deltas.chunks(segments.length()) {
        let mut neighbours = DeltaNeighbours::default();
        values.extend(deltas.iter().map(|&delta| {
            let value = neighbours.value();
            neighbours.push(delta);
            value
        }));
    }
    values
}

/// The values of a serial source for a plane whose values are known; they start again in each segment.
pub fn serial_values(source: Source, values: &[i32], segments: Segments) -> Vec<i32> {
    let mut sums = Vec::with_capacity(values.len());
    for values in values.chunks(segments.length()) {
        let mut last = [0; 4];
        sums.extend(values.iter().map(|&value| {
            let sum = last.iter().fold(0_i32, |sum, &value| sum.wrapping_add(value));
            let [a, b, c, _] = last;
            last = [term(source, value), a, b, c];
            sum
        }));
    }
    sums
}

/// What a value adds to a serial source of the four entries after it.
#[inline(always)]
pub(crate) fn term(source: Source, value: i32) -> i32 {
    if source == Source::NeighbourMagnitude { value.wrapping_abs() } else { value }
}

/// The contexts of values on one axis.
pub fn contexts_of(axis: &ContextAxis, values: &[i32]) -> Vec<u8> {
    let mut contexts = vec![0; values.len()];
    AxisLookup::new(axis, 1).add_contexts(values, &mut contexts);
    contexts
}

/// `first * second_contexts + second`; an empty second axis is all 0.
pub fn combine(first: &[u8], second: &[u8], second_contexts: usize) -> Vec<u8> {
    let width = u8::try_from(second_contexts).unwrap_or(u8::MAX);
    let mut contexts: Vec<u8> = first.iter().map(|&context| context.wrapping_mul(width)).collect();
    for (context, &second) in contexts.iter_mut().zip(second) {
        *context = context.wrapping_add(second);
    }
    contexts
}
