//! The values of a block as they are coded.
//!
//! Planes are pushed in the order of the layout, each of as many values as there are deltas, and nothing is asked of planes that are
//! not there. Values are not checked yet and no sum overflows all the same (annex F.2).

use crate::attribute;
use crate::buffers::Buffers;
use crate::layout::{Attribute, Layout, PlaneInfo, Section};
use crate::stage::Stage;
use crate::steps::{Exponents, StepRule};
use splatstream_format::entropy::lanes::Segments;
use std::sync::OnceLock;

/// The values of a block as they are coded, and what contexts need of the reconstruction.
///
/// The decoder fills it plane by plane, the encoder before it chooses models.
#[derive(Debug, Clone)]
pub struct CodedBlock {
    /// Morton deltas, the first from 0.
    pub deltas: Vec<u64>,
    /// Coded values (bias not added) by plane; the position plane is empty.
    pub coded: Vec<Vec<i32>>,
    /// Log-scales without predictions, of new Gaussians: the largest first if the axes are canonical.
    pub log_scale: [Vec<i32>; 3],
    /// Opacity without predictions, of new Gaussians.
    pub opacity: Vec<i32>,
    lanes_log2: u8,
    steps: StepRule,
    /// The exponents of the steps of each attribute, as soon as what they follow from is there.
    pub(crate) exponents: [Exponents; 5],
    /// What several planes take contexts from, as soon as one asks for it.
    derived: Derived,
    /// For each plane the sum of the magnitudes of the attribute's planes up to it; kept as planes are added,
    /// so that a group of n planes costs n additions and not n squared.
    magnitudes: Vec<Vec<i32>>,
}

/// Values that follow from those of a block.
#[derive(Debug, Clone, Default)]
struct Derived {
    log_volumes: OnceLock<Vec<i32>>,
    anisotropies: OnceLock<Vec<i32>>,
    spacings: OnceLock<Vec<i32>>,
}

/// A value as thresholds see it: these have 32 bits.
#[inline(always)]
fn limited(value: i64) -> i32 {
    value.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

/// 0 for 0, else one more than the index of the leading one.
#[inline(always)]
pub fn bit_length(value: u64) -> u32 {
    u64::BITS.wrapping_sub(value.leading_zeros())
}

/// How far the deltas before and after each entry are, in bits.
fn spacings(deltas: &[u64]) -> Vec<i32> {
    let lengths = || deltas.iter().map(|&delta| bit_length(delta));
    lengths()
        .zip(lengths().skip(1).chain([0]))
        .map(|(here, next)| here.wrapping_add(next).cast_signed())
        .collect()
}

/// The sums of magnitudes up to a plane: of those before it, if they are of the same attribute, and its own.
fn sums_up_to(before: Option<Vec<i32>>, coded: &[i32]) -> Vec<i32> {
    let Some(mut sums) = before else { return coded.iter().map(|&value| value.wrapping_abs()).collect() };
    let each = sums.iter_mut().zip(coded);
    each.for_each(|(sum, &value)| *sum = sum.wrapping_add(value.wrapping_abs()));
    sums
}

impl CodedBlock {
    /// A block of 2^`lanes_log2` lanes with these deltas, and no planes yet. A block without positions has as many
    /// deltas of 0.
    pub fn new(deltas: Vec<u64>, lanes_log2: u8, steps: StepRule) -> Self {
        Self {
            deltas,
            coded: Vec::new(),
            log_scale: [const { Vec::new() }; 3],
            opacity: Vec::new(),
            lanes_log2,
            steps,
            exponents: [const { Exponents::Same(0) }; 5],
            derived: Derived::default(),
            magnitudes: Vec::new(),
        }
    }

    /// The segments of its lanes.
    pub fn segments(&self) -> Segments {
        Segments::new(self.len(), self.lanes_log2)
    }

    /// The exponents of the steps of an attribute of new Gaussians; the planes that they follow from have been added.
    pub fn exponents(&self, stage: Stage) -> &Exponents {
        const ABSENT: &Exponents = &Exponents::Same(0);
        self.exponents.get(stage as usize).unwrap_or(ABSENT)
    }

    /// Adds the next plane in coding order; `bias` is that of its model.
    pub fn push(&mut self, info: PlaneInfo, coded: Vec<i32>, bias: i32) {
        let before = if info.index > 0 { self.magnitudes.last().cloned() } else { None };
        self.push_with(before, info, coded, bias);
    }

    /// The same where no plane but the next needs what is known of the planes before; `has_sums` says whether a later one
    /// of the attribute needs sums of magnitudes.
    pub(crate) fn push_decoded(
        &mut self,
        info: PlaneInfo,
        coded: Vec<i32>,
        bias: i32,
        has_sums: bool,
        buffers: &mut Buffers,
    ) {
        let last = self.magnitudes.last_mut().map(core::mem::take).unwrap_or_default();
        let is_first = info.index == 0;
        match (has_sums, is_first) {
            (true, false) => self.push_with(Some(last), info, coded, bias),
            (true, true) => {
                let mut sums = if last.is_empty() { buffers.plane(self.len()) } else { last };
                sums.fill(0);
                self.push_with(Some(sums), info, coded, bias);
            }
            (false, _) => {
                buffers.take(last);
                self.push_with(Some(Vec::new()), info, coded, bias);
            }
        }
    }

    /// Takes memory for what contexts need of the reconstruction.
    pub(crate) fn reserve(&mut self, buffers: &mut Buffers) {
        for plane in self.log_scale.iter_mut().chain([&mut self.opacity]) {
            *plane = buffers.plane(0);
        }
    }

    /// Adds a plane and the sums of magnitudes up to it; `before` are those up to the plane before, if it is of the same
    /// attribute.
    fn push_with(&mut self, before: Option<Vec<i32>>, info: PlaneInfo, coded: Vec<i32>, bias: i32) {
        if info.section == Section::New {
            self.reconstruct(info, &coded, bias);
        }
        self.magnitudes.push(sums_up_to(before, &coded));
        self.coded.push(coded);
    }

    /// The same with the sums that [contexts](crate::context::plane_contexts) of any of its planes are taken from. Decoding keeps
    /// no more of them than the next plane needs.
    pub fn with_sums(mut self, layout: &Layout) -> Self {
        self.magnitudes.clear();
        for (info, coded) in layout.planes().iter().zip(&self.coded) {
            let before = self.magnitudes.last().filter(|_| info.index > 0).cloned();
            self.magnitudes.push(sums_up_to(before, coded));
        }
        self
    }

    /// Reconstructs what later planes take contexts and steps from; ranges are checked later.
    ///
    /// Values are below 98,304 and steps at most 6144, so that a sum of three products stays below 2^31.
    fn reconstruct(&mut self, info: PlaneInfo, coded: &[i32], bias: i32) {
        let copy = |exponents: &Exponents, plane: &mut Vec<i32>| {
            plane.extend_from_slice(coded);
            exponents.scale(plane, bias);
        };
        let [largest, middle, smallest] = &mut self.log_scale;
        let [of_log_scale, of_opacity, ..] = &self.exponents;
        match (info.attribute, info.index) {
            (Attribute::LogScale, 0) => {
                copy(&Exponents::Same(self.steps.of_largest()), largest);
                self.prepare(&[Stage::LogScale]);
            }
            (Attribute::LogScale, 1) => {
                copy(of_log_scale, middle);
                attribute::next_log_scale(largest, middle);
            }
            (Attribute::LogScale, _) => {
                copy(of_log_scale, smallest);
                attribute::next_log_scale(middle, smallest);
                self.prepare(&[Stage::Opacity]);
            }
            (Attribute::Opacity, _) => {
                copy(of_opacity, &mut self.opacity);
                self.prepare(&[Stage::Rotation, Stage::Dc, Stage::Sh]);
            }
            _ => {}
        }
    }

    /// Computes the exponents of some attributes.
    fn prepare(&mut self, stages: &[Stage]) {
        for &stage in stages {
            let log_scale = self.log_scale.each_ref().map(Vec::as_slice);
            let exponents = self.steps.exponents(stage, log_scale, &self.opacity);
            if let Some(slot) = self.exponents.get_mut(stage as usize) {
                *slot = exponents;
            }
        }
    }

    /// The sums of the magnitudes of the attribute's planes before `plane`, which is not its first.
    pub(crate) fn magnitudes_before(&self, plane: usize) -> &[i32] {
        let before = plane.checked_sub(1).and_then(|before| self.magnitudes.get(before));
        before.map(Vec::as_slice).unwrap_or_default()
    }

    /// The sums of the three log-scales, which are there.
    pub(crate) fn log_volumes(&self) -> &[i32] {
        self.derived.log_volumes.get_or_init(|| {
            let [a, b, c] = &self.log_scale;
            let sum = |((&a, &b), &c): ((&i32, &i32), &i32)| {
                limited(i64::from(a).wrapping_add(b.into()).wrapping_add(c.into()))
            };
            a.iter().zip(b).zip(c).map(sum).collect()
        })
    }

    /// The largest log-scales less the smallest, which are there.
    pub(crate) fn anisotropies(&self) -> &[i32] {
        self.derived.anisotropies.get_or_init(|| {
            let [a, _, c] = &self.log_scale;
            let difference = |(&a, &c): (&i32, &i32)| limited(i64::from(a).wrapping_sub(c.into()));
            a.iter().zip(c).map(difference).collect()
        })
    }

    /// How far the neighbours in Morton order are.
    pub(crate) fn spacings(&self) -> &[i32] {
        self.derived.spacings.get_or_init(|| spacings(&self.deltas))
    }

    /// Leaves its memory to the blocks after it.
    pub(crate) fn leave(self, buffers: &mut Buffers) {
        let Self { deltas, coded, log_scale, opacity, magnitudes, .. } = self;
        buffers.deltas = deltas;
        let planes = coded.into_iter().chain(log_scale).chain([opacity]).chain(magnitudes);
        planes.for_each(|plane| buffers.take(plane));
    }

    /// Gaussians in the block.
    pub fn len(&self) -> usize {
        self.deltas.len()
    }

    /// True if there is no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.deltas.is_empty()
    }
}
