//! Sections that decode: small values, coded with one table per plane, explicit or parametric.

use crate::entropy::frequencies::Frequencies;
use crate::entropy::layout::{Attribute, Layout, PlaneInfo, Section};
use crate::entropy::model::{ContextAxis, PlaneModel, Source, write_models};
use crate::entropy::parametric::Parametric;
use crate::entropy::token::{Alphabet, zigzag};
use crate::entropy::writer::{BlockWriter, PlaneEncoder};
use crate::payload::SectionBytes;

/// log2 of the values that have tokens of their own, which are all that occur.
const DIRECT_LOG2: u8 = 4;
/// The largest of these values.
const MAX_DELTA: u64 = 15;
/// The code of a Gaussian that is removed.
const REMOVED: i32 = 4;

/// Values from a seed: a section of hundreds takes eight bytes of an input.
pub(super) struct Values {
    state: u64,
    /// The last predictor that is defined.
    last_predictor: i32,
}

impl Values {
    pub(super) const fn new(seed: u64) -> Self {
        Self { state: seed, last_predictor: 2 }
    }

    /// Values of a GOP that may have a network.
    pub(super) fn of_gop(seed: u64, has_network: bool) -> Self {
        Self { last_predictor: if has_network { 3 } else { 2 }, ..Self::new(seed) }
    }

    /// The next number below `bound` (SplitMix64).
    fn below(&mut self, bound: u64) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.state ^ self.state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ mixed >> 31).checked_rem(bound).unwrap_or(0)
    }

    pub(super) fn between(&mut self, least: i32, most: i32) -> i32 {
        let span = u64::from(most.abs_diff(least)).saturating_add(1);
        least.saturating_add(i32::try_from(self.below(span)).unwrap_or(0))
    }

    /// What becomes of the parents of a unit: so many are removed.
    pub(super) fn modes(&mut self, parents: u32, removed: u32, intra: bool) -> Vec<i32> {
        let mut left = (u64::from(parents), if intra { 0 } else { u64::from(removed) });
        (0..parents)
            .map(|_| {
                let is_removed = self.below(left.0) < left.1;
                left = (left.0.saturating_sub(1), left.1.saturating_sub(is_removed.into()));
                if is_removed { REMOVED } else { self.between(0, 3) }
            })
            .collect()
    }

    /// A value that the processes mostly accept; deltas are at most `delta`.
    fn of_plane(&mut self, plane: PlaneInfo, delta: i32) -> i32 {
        match plane.attribute {
            Attribute::Cell => self.between(1, delta.max(1)),
            Attribute::Position => self.between(0, delta),
            // Positions lie near the origin, beyond which nothing may move.
            Attribute::Stale | Attribute::Move => self.between(0, 1),
            Attribute::Predictor => self.between(0, self.last_predictor),
            Attribute::MovePredictor => self.between(0, 3),
            _ if plane.alphabet == Alphabet::Index => 0,
            _ => self.between(-2, 2),
        }
    }
}

/// A section of `count` values a plane, positions of `axis_bits` on each axis; `modes` are those of the section of
/// that name.
pub(super) fn coded(
    layout: &Layout,
    (count, axis_bits): (u32, u8),
    modes: &[i32],
    block_log2: u8,
    values: &mut Values,
) -> SectionBytes {
    let points = 1_u64.checked_shl(u32::from(axis_bits).saturating_mul(3)).unwrap_or(u64::MAX);
    let room = points.saturating_sub(1).checked_div(count.into()).unwrap_or(0).min(MAX_DELTA);
    let delta = i32::try_from(room).unwrap_or(0);
    let lanes_log2 = u8::try_from(values.below(6)).unwrap_or(0);
    let models: Vec<PlaneModel> =
        layout.planes().iter().map(|plane| model(table(plane.alphabet, values))).collect();
    let encoders: Vec<PlaneEncoder> = models.iter().map(PlaneEncoder::new).collect();
    let size = 1_u32.wrapping_shl(block_log2.into());
    let mut modes = modes.iter().copied();
    let mut block = |start: u32| {
        let mut writer = BlockWriter::new(lanes_log2);
        for (&plane, encoder) in layout.planes().iter().zip(&encoders) {
            let of_plane = |_| match (plane.section, modes.next()) {
                (Section::Modes, Some(mode)) => mode,
                _ => values.of_plane(plane, delta),
            };
            let length = usize::try_from(count.saturating_sub(start).min(size)).unwrap_or(0);
            let numbers: Vec<u64> = (0..length).map(of_plane).map(|value| unsigned(plane, value)).collect();
            // Every value has a token of the table.
            let _ = writer.plane(encoder, &[], numbers.into_iter());
        }
        writer.finish()
    };
    let starts = (0..count.div_ceil(size)).map(|block| block.saturating_mul(size));
    let blocks = starts.map(&mut block).collect();
    SectionBytes { lanes_log2, model: write_models(&models, &layout.alphabets(), None), blocks }
}

fn unsigned(plane: PlaneInfo, value: i32) -> u64 {
    match plane.alphabet {
        Alphabet::Attribute => zigzag(value).into(),
        _ => u64::try_from(value).unwrap_or(0),
    }
}

/// A table of every small value: all as likely as the others, or by any distribution.
fn table(alphabet: Alphabet, values: &mut Values) -> Frequencies {
    if values.below(2) == 0 {
        return Frequencies::from_counts(&[1; 1 << DIRECT_LOG2]);
    }
    let mut element = |bound: u64| u8::try_from(values.below(bound)).unwrap_or(0);
    let last = element(20).saturating_add((1 << DIRECT_LOG2) - 1);
    let [shape, zero_level, scale] = [4, 16, 64].map(&mut element);
    let centre = if alphabet == Alphabet::Attribute { values.between(-40, 40) } else { 0 };
    let parameters = Parametric { last, shape, zero_level, scale, centre };
    Frequencies::parametric(parameters, alphabet, DIRECT_LOG2)
}

/// A model without contexts.
fn model(table: Frequencies) -> PlaneModel {
    let axis = || ContextAxis { source: Source::None, thresholds: Vec::new() };
    PlaneModel {
        bias: 0,
        direct_log2: DIRECT_LOG2,
        axes: [axis(), axis()],
        tables: vec![table],
        table_of_context: vec![0],
    }
}
