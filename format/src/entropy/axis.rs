//! Clause 8.5: the contexts of a plane - where they come from, and the thresholds that cut values into them.

use super::machine::Machine;

/// What a context is computed from (table of clause 8.5). The decoder crate computes the values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// No context.
    None,
    /// The sum of the four coded values before this one in the plane.
    NeighbourSum,
    /// The sum of the magnitudes of the four coded values before this one in the plane.
    NeighbourMagnitude,
    /// The coded value of the plane before.
    PreviousPlane,
    /// The sum of the magnitudes of the coded values of the attribute's planes before this one.
    GroupMagnitude,
    /// The largest log-scale.
    LargestLogScale,
    /// The middle log-scale.
    MiddleLogScale,
    /// The sum of the three log-scales.
    LogVolume,
    /// The largest log-scale less the smallest.
    Anisotropy,
    /// The opacity.
    Opacity,
    /// How far the neighbours in Morton order are.
    PositionSpacing,
    /// The exponent of the step of the plane's own attribute.
    StepExponent,
}

impl Source {
    /// Every source, in the order of the codes.
    pub const ALL: [Self; 12] = [
        Self::None,
        Self::NeighbourSum,
        Self::NeighbourMagnitude,
        Self::PreviousPlane,
        Self::GroupMagnitude,
        Self::LargestLogScale,
        Self::MiddleLogScale,
        Self::LogVolume,
        Self::Anisotropy,
        Self::Opacity,
        Self::PositionSpacing,
        Self::StepExponent,
    ];

    /// The code in the stream.
    pub fn code(self) -> u8 {
        Self::ALL
            .iter()
            .position(|&source| source == self)
            .and_then(|code| u8::try_from(code).ok())
            .unwrap_or(0)
    }

    /// The name in the table of clause 8.5.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::NeighbourSum => "neighbour_sum",
            Self::NeighbourMagnitude => "neighbour_magnitude",
            Self::PreviousPlane => "previous_plane",
            Self::GroupMagnitude => "group_magnitude",
            Self::LargestLogScale => "largest_log_scale",
            Self::MiddleLogScale => "middle_log_scale",
            Self::LogVolume => "log_volume",
            Self::Anisotropy => "anisotropy",
            Self::Opacity => "opacity",
            Self::PositionSpacing => "position_spacing",
            Self::StepExponent => "step_exponent",
        }
    }

    /// The source of a code; codes above 11 are reserved.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }
}

/// Most thresholds of one source.
pub const MAX_THRESHOLDS: usize = 16;
/// Most contexts of one plane.
pub const MAX_CONTEXTS: usize = 64;

/// One source and the thresholds that cut its values into contexts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ContextAxis {
    /// Where the value comes from.
    pub source: Source,
    /// Strictly increasing; empty only if the source is [`Source::None`].
    pub thresholds: Vec<i32>,
}

impl ContextAxis {
    /// The axis without contexts.
    pub const NONE: Self = Self { source: Source::None, thresholds: Vec::new() };

    /// How many contexts the axis distinguishes.
    pub fn contexts(&self) -> usize {
        self.thresholds.len().wrapping_add(1)
    }

    /// The number of thresholds that do not exceed `value`.
    #[inline]
    pub fn context(&self, value: i32) -> u8 {
        self.thresholds.iter().map(|&threshold| u8::from(threshold <= value)).fold(0, u8::wrapping_add)
    }
}

/// Values of which contexts are added side by side.
const SIDE_BY_SIDE: usize = 16;

/// The contexts of an axis, times a factor, for many values at a time.
///
/// All values are compared with all thresholds: vectors do that faster than a search or a table does, both of which wait
/// for memory or for a branch that no processor guesses.
#[derive(Debug, Clone)]
pub struct AxisLookup {
    thresholds: Vec<i32>,
    /// The same in 16 bits, if they fit: machines compare twice as many of these at a time.
    narrow: Option<Vec<i16>>,
    factor: u8,
}

impl AxisLookup {
    /// The contexts of an axis, times a factor. A plane has at most 64 contexts, so that no product is above 255.
    pub fn new(axis: &ContextAxis, factor: u8) -> Self {
        let narrow = |&threshold: &i32| i16::try_from(threshold).ok().filter(|&narrow| narrow > i16::MIN);
        let narrow = axis.thresholds.iter().map(narrow).collect();
        Self { thresholds: axis.thresholds.clone(), narrow, factor }
    }

    /// [`ContextAxis::context`] of the axis, times the factor.
    #[inline(always)]
    pub fn context(&self, value: i32) -> u8 {
        let count = self.thresholds.iter().map(|&threshold| u8::from(threshold <= value));
        count.fold(0, u8::wrapping_add).wrapping_mul(self.factor)
    }

    /// Turns vectors of signed values into their contexts.
    ///
    /// A loop and no closure: what is called in a closure is not compiled for the machine unless it is inlined.
    #[inline(always)]
    pub fn contexts<M: Machine, const COUNT: usize>(&self, machine: M, values: &mut [M::V; COUNT]) {
        let factor = machine.splat(self.factor.into());
        if let (Some(thresholds), (fours, [])) = (&self.narrow, values.as_chunks_mut::<4>()) {
            for values in fours {
                *values = machine.reached(*values, thresholds);
                for count in values {
                    *count = machine.mul(*count, factor);
                }
            }
            return;
        }
        for value in values {
            *value = machine.mul(self.reached(machine, *value), factor);
        }
    }

    /// How many thresholds of 32 bits each value of a vector reaches. They are rare: on WebAssembly, where vectors are not
    /// enabled by function, this is code of its own, and once.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn reached<M: Machine>(&self, machine: M, values: M::V) -> M::V {
        let mut count = machine.splat(u32::try_from(self.thresholds.len()).unwrap_or(0));
        for &threshold in &self.thresholds {
            count = machine.add(count, machine.greater(machine.splat(threshold.cast_unsigned()), values));
        }
        count
    }

    /// Adds the contexts of some values to others.
    ///
    /// Threshold by threshold for a few values at a time: vectors of every machine do that.
    pub fn add_contexts(&self, values: &[i32], contexts: &mut [u8]) {
        let (values, last_values) = values.as_chunks::<SIDE_BY_SIDE>();
        let (contexts, last_contexts) = contexts.as_chunks_mut::<SIDE_BY_SIDE>();
        for (contexts, values) in contexts.iter_mut().zip(values) {
            let mut reached = [0_u8; SIDE_BY_SIDE];
            for &threshold in &self.thresholds {
                for (count, &value) in reached.iter_mut().zip(values) {
                    *count = count.wrapping_add(u8::from(threshold <= value));
                }
            }
            for (context, count) in contexts.iter_mut().zip(reached) {
                *context = context.wrapping_add(count.wrapping_mul(self.factor));
            }
        }
        for (context, &value) in last_contexts.iter_mut().zip(last_values) {
            *context = context.wrapping_add(self.context(value));
        }
    }
}
