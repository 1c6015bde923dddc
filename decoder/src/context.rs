//! Clause 8.5: the values that choose the context of a symbol.

use crate::block::CodedBlock;
use splatstream_format::entropy::model::{AxisLookup, ContextAxis, Source};
use std::borrow::Cow;

/// The last four coded values of a plane, and what the two serial sources make of them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Neighbours {
    last: [i32; 4],
}

impl Neighbours {
    /// Remembers a coded value.
    #[inline(always)]
    pub fn push(&mut self, value: i32) {
        let [a, b, c, _] = self.last;
        self.last = [value, a, b, c];
    }

    /// The value of a serial source; 0 for any other.
    #[inline(always)]
    pub fn value(&self, source: Source) -> i32 {
        let sum = |values: [i32; 4]| values.iter().fold(0_i32, |sum, &value| sum.wrapping_add(value));
        match source {
            Source::NeighbourSum => sum(self.last),
            Source::NeighbourMagnitude => sum(self.last.map(i32::wrapping_abs)),
            _ => 0,
        }
    }
}

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

/// 0 for 0, else one more than the index of the leading one.
#[inline(always)]
pub fn bit_length(value: u64) -> u32 {
    u64::BITS.wrapping_sub(value.leading_zeros())
}

/// True if the source's values depend on values of the plane itself.
pub fn is_serial(source: Source) -> bool {
    matches!(source, Source::NeighbourSum | Source::NeighbourMagnitude)
}

/// The values of a source that is not serial for every Gaussian of a block, known before `plane` is read.
pub fn values(source: Source, plane: usize, block: &CodedBlock) -> Cow<'_, [i32]> {
    let coded = |plane: usize| block.coded.get(plane).map(Vec::as_slice).unwrap_or_default();
    let [largest, middle, smallest] = &block.log_scale;
    match source {
        Source::None | Source::NeighbourSum | Source::NeighbourMagnitude => Cow::default(),
        Source::PreviousPlane => coded(plane.wrapping_sub(1)).into(),
        Source::GroupMagnitude => block.magnitudes_before(plane).into(),
        Source::LargestLogScale => largest.into(),
        Source::MiddleLogScale => middle.into(),
        Source::LogVolume => largest
            .iter()
            .zip(middle)
            .zip(smallest)
            .map(|((&a, &b), &c)| a.wrapping_add(b).wrapping_add(c))
            .collect(),
        Source::Anisotropy => largest.iter().zip(smallest).map(|(&a, &b)| a.wrapping_sub(b)).collect(),
        Source::Opacity => (&block.opacity).into(),
        Source::PositionSpacing => spacing(&block.deltas).into(),
    }
}

fn spacing(deltas: &[u64]) -> Vec<i32> {
    let lengths = deltas.iter().map(|&delta| bit_length(delta));
    let next = deltas.iter().skip(1).map(|&delta| bit_length(delta)).chain([0]);
    lengths.zip(next).map(|(here, next)| here.wrapping_add(next).cast_signed()).collect()
}

/// The contexts of one axis for every Gaussian; empty if the axis has no or a serial source.
pub fn axis_contexts(axis: &ContextAxis, plane: usize, block: &CodedBlock) -> Vec<u8> {
    if axis.source == Source::None || is_serial(axis.source) {
        return Vec::new();
    }
    let values = values(axis.source, plane, block);
    let mut contexts = vec![0_u8; values.len()];
    for &threshold in &axis.thresholds {
        for (context, &value) in contexts.iter_mut().zip(values.iter()) {
            *context = context.wrapping_add(u8::from(threshold <= value));
        }
    }
    contexts
}

/// The contexts of a plane whose values are known: what the encoder codes with.
///
/// `values` are the plane's coded values; the position plane goes through [`delta_contexts`].
pub fn plane_contexts(axes: &[ContextAxis; 2], plane: usize, block: &CodedBlock, values: &[i32]) -> Vec<u8> {
    let [first, second] = axes;
    if first.source == Source::None {
        return Vec::new();
    }
    let on_axis = |axis: &ContextAxis| {
        if is_serial(axis.source) { serial_contexts(axis, values) } else { axis_contexts(axis, plane, block) }
    };
    combine(&on_axis(first), &on_axis(second), second.contexts())
}

/// The contexts of the deltas of a block.
pub fn delta_contexts(axes: &[ContextAxis; 2], deltas: &[u64]) -> Vec<u8> {
    let [first, second] = axes;
    if first.source == Source::None {
        return Vec::new();
    }
    let mut neighbours = DeltaNeighbours::default();
    let context = |&delta: &u64| {
        let [a, b] = [first, second].map(|axis| usize::from(axis.context(neighbours.value())));
        neighbours.push(delta);
        u8::try_from(a.wrapping_mul(second.contexts()).wrapping_add(b)).unwrap_or(0)
    };
    deltas.iter().map(context).collect()
}

fn serial_contexts(axis: &ContextAxis, values: &[i32]) -> Vec<u8> {
    let lookup = AxisLookup::new(axis);
    let mut neighbours = Neighbours::default();
    values
        .iter()
        .map(|&value| {
            let context = lookup.context(neighbours.value(axis.source));
            neighbours.push(value);
            context
        })
        .collect()
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
