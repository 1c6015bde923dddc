//! Chooses the model of a plane: token split, contexts, tables. The decoder's functions give the contexts.
#![expect(clippy::arithmetic_side_effects, reason = "counts of values in memory")]
#![expect(
    clippy::indexing_slicing,
    reason = "contexts, tables and tokens are numbers below the lengths that the model was made with"
)]

use crate::blocks::{Blocks, contexts, unsigned_values};
use crate::clusters::{Clustering, cluster};
use crate::entropy_cost::Histogram;
use crate::parametric_fit::fitted;
use crate::settings::{Preset, Tools};
use core::slice;
use rayon::prelude::*;
use splatstream_decoder::block::CodedBlock;
use splatstream_decoder::context::{self, contexts_of, is_serial};
use splatstream_decoder::layout::{Attribute, PlaneInfo, Section, is_available};
use splatstream_format::bits::BitWriter;
use splatstream_format::entropy::frequencies::Frequencies;
use splatstream_format::entropy::model::{ContextAxis, PlaneModel, Source, write_models};
use splatstream_format::entropy::token::{Alphabet, split, zigzag};

/// Gaussians that are looked at for the choice of a model, nearly: whole blocks.
const SAMPLE: usize = 1 << 15;
const SAMPLE_FAST: usize = 1 << 14;
/// Gaussians whose tokens are counted at once.
const COUNTED: usize = 1 << 16;
/// Thresholds of the first and of the second axis.
const FIRST_THRESHOLDS: usize = 15;
const SECOND_THRESHOLDS: usize = 3;

/// The sources worth trying for a plane, the most promising first.
fn candidates(info: PlaneInfo, preset: Preset, tools: Tools) -> Vec<Source> {
    use Source::{
        Anisotropy, GroupMagnitude, LargestLogScale, LogVolume, MiddleLogScale, NeighbourMagnitude,
        NeighbourSum, Opacity, PositionSpacing, PreviousPlane, StepExponent,
    };
    if !tools.contexts {
        return Vec::new();
    }
    let listed: &[Source] = match (preset, info.attribute, info.index) {
        (Preset::Small, _, _) => &Source::ALL[1..],
        _ if info.section == Section::Updates => &[GroupMagnitude, NeighbourMagnitude, PreviousPlane],
        (_, Attribute::Position, _) => &[NeighbourSum],
        (_, Attribute::LogScale, 0) => &[NeighbourSum, PositionSpacing],
        (_, Attribute::LogScale, 1) => &[LargestLogScale, NeighbourSum],
        (_, Attribute::LogScale, _) => &[MiddleLogScale, NeighbourSum, PreviousPlane],
        (_, Attribute::Opacity, _) => &[StepExponent, LogVolume, NeighbourSum, LargestLogScale],
        (_, Attribute::Rotation, _) => {
            &[StepExponent, NeighbourSum, GroupMagnitude, PreviousPlane, Anisotropy]
        }
        (_, Attribute::Dc, _) => &[StepExponent, NeighbourSum, GroupMagnitude, Opacity],
        (_, Attribute::Sh, 0) => &[StepExponent, NeighbourMagnitude, Opacity, LargestLogScale],
        (_, Attribute::Sh, _) => &[GroupMagnitude, StepExponent, Opacity, LargestLogScale],
        (_, Attribute::Cell | Attribute::Mode, _) => &[NeighbourSum],
        (_, Attribute::Stale | Attribute::Predictor | Attribute::MovePredictor, _) => &[NeighbourSum],
        (_, Attribute::Translation | Attribute::CellRotation, _) => &[NeighbourMagnitude, GroupMagnitude],
        (_, Attribute::Move, _) => &[NeighbourMagnitude, GroupMagnitude, NeighbourSum],
    };
    let few = if preset == Preset::Fast { 1 } else { listed.len() };
    listed.iter().copied().filter(|&source| is_available(info, source)).take(few).collect()
}

/// The values of a source for one block, serial or not.
fn source_values(source: Source, info: PlaneInfo, plane: usize, block: &CodedBlock) -> Vec<i32> {
    if info.is_position() {
        return context::delta_values(&block.deltas, block.segments());
    }
    if is_serial(source) {
        return context::serial_values(source, &block.coded[plane], block.segments());
    }
    context::values(source, plane, info, block).into_owned()
}

/// The context of a value; without [contexts] all have the first.
fn context_at(contexts: &[u8], index: usize) -> usize {
    if contexts.is_empty() { 0 } else { contexts[index].into() }
}

/// Thresholds that cut the values in parts of about equal size.
fn quantile_thresholds(values: &[i32], parts: usize) -> Vec<i32> {
    let mut sample: Vec<i32> = values.iter().step_by(values.len().div_ceil(4096).max(1)).copied().collect();
    sample.sort_unstable();
    let mut thresholds: Vec<i32> =
        (1..=parts).filter_map(|part| sample.get(part * sample.len() / (parts + 1)).copied()).collect();
    thresholds.dedup();
    // A threshold not above the smallest value parts nothing.
    thresholds.retain(|&threshold| sample.first().is_some_and(|&least| threshold > least));
    thresholds
}

/// What a plane looks like to the chooser.
struct PlaneView<'a> {
    info: PlaneInfo,
    plane: usize,
    blocks: &'a [CodedBlock],
    tokens: Vec<u8>,
    /// All tokens are below this.
    token_count: usize,
}

/// Tables over contexts, and what they would cost.
struct Candidate {
    axes: [ContextAxis; 2],
    clustering: Clustering,
    bits: f64,
}

/// Bits that carrying an axis takes, nearly: codes and counts, and an exp-Golomb number a threshold.
fn axis_bits(axis: &ContextAxis) -> f64 {
    if axis.source == Source::None { 4.0 } else { 8.0 + 8.0 * axis.thresholds.len() as f64 }
}

impl PlaneView<'_> {
    fn values(&self, source: Source) -> Vec<i32> {
        let of_block = |block| source_values(source, self.info, self.plane, block);
        self.blocks.iter().map(of_block).collect::<Vec<Vec<i32>>>().concat()
    }

    fn candidate(&self, axes: [ContextAxis; 2], contexts: &[u8]) -> Candidate {
        let [first, second] = &axes;
        let count = first.contexts() * second.contexts();
        let mut histograms = vec![Histogram::of_tokens(self.token_count); count];
        match contexts {
            [] => self.tokens.iter().for_each(|&token| histograms[0].add(token)),
            _ => self
                .tokens
                .iter()
                .zip(contexts)
                .for_each(|(&token, &at)| histograms[usize::from(at)].add(token)),
        }
        let clustering = cluster(histograms, second.contexts());
        let bits = clustering.bits + axis_bits(first) + axis_bits(second);
        Candidate { bits, axes, clustering }
    }

    /// The best pair of axes among the sources.
    fn best(&self, sources: &[Source], two_axes: bool) -> Candidate {
        let axis = |source, values: &[i32], parts| ContextAxis {
            source,
            thresholds: quantile_thresholds(values, parts),
        };
        let values: Vec<Vec<i32>> = sources.iter().map(|&source| self.values(source)).collect();
        let mut best = self.candidate([ContextAxis::NONE, ContextAxis::NONE], &[]);
        let mut first = None;
        for (index, (&source, values)) in sources.iter().zip(&values).enumerate() {
            let axis = axis(source, values, FIRST_THRESHOLDS);
            if axis.thresholds.is_empty() {
                continue;
            }
            let contexts = contexts_of(&axis, values);
            let candidate = self.candidate([axis.clone(), ContextAxis::NONE], &contexts);
            if candidate.bits < best.bits {
                best = candidate;
                first = Some((index, axis, contexts));
            }
        }
        let Some((taken, first, on_first)) = first.filter(|_| two_axes) else { return best };
        for (index, (&source, values)) in sources.iter().zip(&values).enumerate() {
            let second = axis(source, values, SECOND_THRESHOLDS);
            if index == taken || second.thresholds.is_empty() {
                continue;
            }
            let contexts = context::combine(&on_first, &contexts_of(&second, values), second.contexts());
            let candidate = self.candidate([first.clone(), second], &contexts);
            if candidate.bits < best.bits {
                best = candidate;
            }
        }
        best
    }
}

/// The number of values with tokens of their own: nearly all of them.
fn direct_log2(info: PlaneInfo, values: &[u64]) -> u8 {
    if info.alphabet == Alphabet::Position {
        return 4;
    }
    let mut sample: Vec<u64> = values.iter().step_by(values.len().div_ceil(4096).max(1)).copied().collect();
    sample.sort_unstable();
    let most = sample.get(sample.len() * 97 / 100).copied().unwrap_or(0);
    (3..=7).find(|&log2| 1 << log2 > most).unwrap_or(7)
}

/// The model of one plane of a unit without its tables, chosen for some of the unit's values. `bias` has been taken off the
/// coded values already.
fn choose(
    info: PlaneInfo,
    plane: usize,
    blocks: &[CodedBlock],
    bias: i32,
    two_axes: bool,
    (preset, tools): (Preset, Tools),
) -> PlaneModel {
    let of_block = |block| unsigned_values(info, plane, block);
    let values = blocks.iter().map(of_block).collect::<Vec<Vec<u64>>>().concat();
    let direct_log2 = direct_log2(info, &values);
    let tokens: Vec<u8> = values.iter().map(|&value| split(value, direct_log2).token).collect();
    let token_count = tokens.iter().max().map_or(1, |&last| usize::from(last) + 1);
    let view = PlaneView { info, plane, blocks, tokens, token_count };
    let best = view.best(&candidates(info, preset, tools), two_axes);
    let (axes, table_of_context) = best.clustering.simplified(best.axes);
    PlaneModel { bias, direct_log2, axes, tables: Vec::new(), table_of_context }
}

/// Counts the tokens of some blocks, each for the table of its context.
fn count(
    histograms: &mut [Histogram],
    model: &PlaneModel,
    info: PlaneInfo,
    plane: usize,
    blocks: &[CodedBlock],
) {
    for block in blocks {
        let contexts = contexts(model, info, plane, block);
        for (index, value) in unsigned_values(info, plane, block).into_iter().enumerate() {
            let context = context_at(&contexts, index);
            let table = usize::from(model.table_of_context[context]);
            histograms[table].add(split(value, model.direct_log2).token);
        }
    }
}

/// The explicit table of the counts, or a parametric one if that saves bits.
fn table(counts: &[u64], alphabet: Alphabet, direct_log2: u8) -> Frequencies {
    let explicit = Frequencies::from_counts(counts);
    if explicit.single_token().is_some() {
        return explicit;
    }
    let Some(parameters) = fitted(counts, alphabet, direct_log2) else { return explicit };
    let parametric = Frequencies::parametric(parameters, alphabet, direct_log2);
    let largest = alphabet.last_token(direct_log2).unwrap_or(u8::MAX);
    let bits = |table: &Frequencies| {
        let mut carried = BitWriter::new();
        table.write(&mut carried, alphabet, largest);
        let cost = |(&count, cost): (&u64, f64)| if count > 0 { count as f64 * cost } else { 0.0 };
        carried.len_bits() as f64 + counts.iter().zip(token_costs(table)).map(cost).sum::<f64>()
    };
    if bits(&parametric) < bits(&explicit) { parametric } else { explicit }
}

/// Models for all planes of a section: contexts that suit a part of its blocks, tables that fit all of its tokens.
pub(crate) fn choose_all(blocks: &Blocks<'_>, preset: Preset, tools: Tools) -> Vec<PlaneModel> {
    if blocks.len() == 0 {
        return Vec::new();
    }
    let most = match preset {
        Preset::Fast => SAMPLE_FAST,
        Preset::Balanced | Preset::Small => SAMPLE,
    };
    let stride = blocks.values().div_ceil(most).max(1);
    let two_axes = preset != Preset::Fast && blocks.values() >= 1024;
    let sample = blocks.cut((0..blocks.len()).step_by(stride));
    let planes = blocks.planes().par_iter().zip(blocks.biases()).enumerate();
    let mut counted: Vec<(PlaneModel, Vec<Histogram>)> = planes
        .map(|(plane, (&info, &bias))| {
            let model = choose(info, plane, &sample, bias, two_axes, (preset, tools));
            let tables = model.table_of_context.iter().max().map_or(0, |&last| usize::from(last) + 1);
            (model, vec![Histogram::default(); tables])
        })
        .collect();
    let mut add = |some: &[CodedBlock]| {
        let each = counted.par_iter_mut().zip(blocks.planes()).enumerate();
        each.for_each(|(plane, ((model, histograms), &info))| count(histograms, model, info, plane, some));
    };
    if stride == 1 {
        add(&sample);
    } else {
        drop(sample);
        let all: Vec<usize> = (0..blocks.len()).collect();
        let at_once = (COUNTED * blocks.len()).div_ceil(blocks.values());
        all.chunks(at_once).for_each(|some| add(&blocks.cut(some.iter().copied())));
    }
    let with_tables = counted.into_par_iter().zip(blocks.planes()).map(|((model, histograms), info)| {
        let table = |histogram: &Histogram| table(&histogram.counts(), info.alphabet, model.direct_log2);
        PlaneModel { tables: histograms.iter().map(table).collect(), ..model }
    });
    with_tables.collect()
}

/// For each plane its own model, or the one before if that has the same bias and saves its tables.
pub(crate) fn cheapest(own: &[PlaneModel], before: &[PlaneModel], blocks: &Blocks<'_>) -> Vec<PlaneModel> {
    let (planes, cut) = (blocks.planes(), blocks.cut(0..blocks.len()));
    let choose = |(plane, own): (usize, &PlaneModel)| {
        let Some(before) = before.get(plane).filter(|before| before.bias == own.bias) else {
            return own.clone();
        };
        let bits = |model: &PlaneModel| -> Option<f64> {
            cut.iter().map(|block| symbol_bits(model, planes[plane], plane, block)).sum()
        };
        let own_bits = bits(own).map(|bits| bits + model_bits(own, planes[plane].alphabet));
        match (bits(before), own_bits) {
            (Some(reused), Some(own_bits)) if reused <= own_bits => before.clone(),
            _ => own.clone(),
        }
    };
    own.par_iter().enumerate().map(choose).collect()
}

/// Makes each value of a plane take more than half a bit: one of the four smallest values becomes as frequent as all
/// values together.
pub(crate) fn dilute(model: &mut PlaneModel) {
    for table in &mut model.tables {
        let mut counts: Vec<u64> = table.of_token().iter().map(|&frequency| frequency.into()).collect();
        counts.resize(counts.len().max(4), 0);
        let rarest = (0..4).min_by_key(|&token: &usize| counts[token]).unwrap_or(0);
        counts[rarest] += 4096;
        *table = Frequencies::from_counts(&counts);
    }
}

/// Bits of a plane's symbols under a model; none if a token cannot be coded.
fn symbol_bits(model: &PlaneModel, info: PlaneInfo, plane: usize, block: &CodedBlock) -> Option<f64> {
    let contexts = contexts(model, info, plane, block);
    let costs: Vec<Vec<f64>> = model.tables.iter().map(token_costs).collect();
    let mut bits = 0.0;
    for (index, value) in unsigned_values(info, plane, block).into_iter().enumerate() {
        let context = context_at(&contexts, index);
        let token = split(value, model.direct_log2);
        let costs = &costs[usize::from(model.table_of_context[context])];
        let cost = costs.get(usize::from(token.token)).copied().filter(|cost| cost.is_finite())?;
        bits += cost + f64::from(token.raw_bits);
    }
    Some(bits)
}

/// What the values of a plane cost.
pub(crate) struct PlaneCosts {
    /// Taken off each value.
    pub(crate) bias: i32,
    /// The table of each value.
    pub(crate) table_of_value: Vec<u8>,
    /// Bits of values under each table.
    pub(crate) tables: Vec<ValueBits>,
    /// Bits of all values.
    pub(crate) bits: f64,
}

/// Bits of values under one table.
pub(crate) struct ValueBits {
    of_token: Vec<f32>,
    direct_log2: u8,
}

/// Bits of a token that a table does not have.
const ABSENT: f32 = 14.0;

impl ValueBits {
    fn new(table: &Frequencies, direct_log2: u8) -> Self {
        let bits = |cost: f64| (cost as f32).min(ABSENT);
        Self { of_token: token_costs(table).into_iter().map(bits).collect(), direct_log2 }
    }

    /// Of a value, less the bias.
    pub(crate) fn of(&self, value: i32) -> f32 {
        let token = split(zigzag(value).into(), self.direct_log2);
        let bits = self.of_token.get(usize::from(token.token)).copied().unwrap_or(ABSENT);
        bits + token.raw_bits as f32
    }
}

/// What the values of each plane of a section cost under its models.
pub(crate) fn costs(models: &[PlaneModel], blocks: &Blocks<'_>) -> Vec<PlaneCosts> {
    let (planes, cut) = (blocks.planes(), blocks.cut(0..blocks.len()));
    let of_plane = |(plane, model): (usize, &PlaneModel)| {
        let of_block = |block: &CodedBlock| -> Vec<u8> {
            let contexts = contexts(model, planes[plane], plane, block);
            (0..block.len()).map(|index| model.table_of_context[context_at(&contexts, index)]).collect()
        };
        let bits = cut.iter().filter_map(|block| symbol_bits(model, planes[plane], plane, block)).sum();
        PlaneCosts {
            bias: model.bias,
            table_of_value: cut.iter().flat_map(of_block).collect(),
            tables: model.tables.iter().map(|table| ValueBits::new(table, model.direct_log2)).collect(),
            bits,
        }
    };
    models.par_iter().enumerate().map(of_plane).collect()
}

/// Bits of a section: under its models, and with one table for each plane, all included; and those of the models alone.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ContextWorth {
    pub(crate) own: f64,
    pub(crate) plain: f64,
    pub(crate) models: f64,
}

/// What contexts are worth to a section, from some of its blocks.
pub(crate) fn worth_of_contexts(models: &[PlaneModel], blocks: &Blocks<'_>) -> ContextWorth {
    let planes = blocks.planes();
    let stride = blocks.values().div_ceil(SAMPLE_FAST).max(1);
    let sample = blocks.cut((0..blocks.len()).step_by(stride));
    let taken: usize = sample.iter().map(CodedBlock::len).sum();
    let scale = blocks.values() as f64 / taken.max(1) as f64;
    let of_plane = |(plane, model): (usize, &PlaneModel)| {
        let info = planes[plane];
        let axes = [ContextAxis::NONE, ContextAxis::NONE];
        let mut plain = PlaneModel { axes, table_of_context: vec![0], tables: Vec::new(), ..model.clone() };
        let mut histogram = [Histogram::default()];
        count(&mut histogram, &plain, info, plane, &sample);
        plain.tables = histogram.map(|h| table(&h.counts(), info.alphabet, model.direct_log2)).to_vec();
        let symbols = |model: &PlaneModel| -> f64 {
            scale * sample.iter().filter_map(|block| symbol_bits(model, info, plane, block)).sum::<f64>()
        };
        let [own, other] = [model, &plain].map(|model| model_bits(model, info.alphabet));
        ContextWorth { own: symbols(model) + own, plain: symbols(&plain) + other, models: own }
    };
    let worths: Vec<ContextWorth> = models.par_iter().enumerate().map(of_plane).collect();
    worths.into_iter().fold(ContextWorth::default(), |sum, worth| ContextWorth {
        own: sum.own + worth.own,
        plain: sum.plain + worth.plain,
        models: sum.models + worth.models,
    })
}

/// Bits of a model that is carried, to the next byte.
fn model_bits(model: &PlaneModel, alphabet: Alphabet) -> f64 {
    8.0 * write_models(slice::from_ref(model), &[alphabet], None).len() as f64
}

fn token_costs(table: &Frequencies) -> Vec<f64> {
    table.of_token().iter().map(|&frequency| 12.0 - libm::log2(f64::from(frequency))).collect()
}
