//! Which predictor new Gaussians take: by estimated bits, or by the paper's sum of absolute residuals.
#![expect(clippy::arithmetic_side_effects, reason = "counts of bits, runs and rows of one list")]
#![expect(
    clippy::indexing_slicing,
    reason = "candidates, planes and rows are counted by what they index; tokens are below the number of symbols"
)]

use super::new_list::NewList;
use super::recorder::Recorder;
use super::residuals::Wanted;
use super::unit::{Draft, UnitCoder};
use crate::error::Error;
use crate::settings::{PredictorChoice, Predictors};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::increment::prediction::{Predicting, Prediction};
use splatstream_decoder::increment::residual::{AttributeValues, Attributes};
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::increment::{Situation, reference_set};
use splatstream_decoder::interrupt::Interrupt;
use splatstream_decoder::layout::{Section, ShCoding};
use splatstream_decoder::list::GaussianList;
use splatstream_decoder::position::refine;
use splatstream_decoder::predictor::Predictor;
use splatstream_decoder::steps::Stage;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::entropy::token::zigzag;
use splatstream_format::syntax::IncrementHeader;

/// log2 of the new Gaussians that share a predictor chosen by bits.
const RUN_LOG2: u8 = 6;

/// The largest that is allowed, for units of one predictor.
const WHOLE_LOG2: u8 = 16;

/// Weights of the bilateral predictor: e^-1 at the last neighbour, and at 8 squared steps of attribute difference.
const SPATIAL: u8 = 32;
const FEATURE: u8 = 255;

/// New Gaussians below which prediction is not tried.
const FEW: usize = 64;

/// A unit is predicted if that saves a bit for each of so many Gaussians that a decoder has to search.
const SEARCHED_FOR_A_BIT: usize = 16;

/// Bits that prediction may save a new Gaussian, at most; where even that is too little it is not tried.
const MAX_SAVED: usize = 10;

/// Values from which on a histogram counts powers of two.
const DIRECT: u32 = 32;

/// How predictors are chosen.
#[derive(Clone, Copy)]
pub(crate) struct Chooser<'r> {
    pub(crate) predictors: Predictors,
    pub(crate) choice: PredictorChoice,
    /// Neighbours of a prediction.
    pub(crate) neighbours: u8,
    /// What the network is trained with, while that is being collected.
    pub(crate) recorder: Option<&'r Recorder>,
}

/// log2 of the Gaussians of a run, and for each run the index of its predictor among those tried.
type Choice = (u8, Vec<usize>);

/// Residual planes of new Gaussians under one predictor, in plane order.
type Residuals = Vec<Vec<i32>>;

impl Chooser<'_> {
    /// Whether a Gaussian may be predicted.
    pub(crate) fn predicts(self) -> bool {
        self.predictors != Predictors::NONE
    }

    /// Gives each new Gaussian of a draft, which has them without prediction, the predictor that suits it, and tells how
    /// many bytes that saves, where both were coded. `all`: what the Gaussians of the frame shall become, of which the
    /// draft adds those of `new`.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn choose(
        self,
        coder: &UnitCoder<'_>,
        draft: &mut Draft,
        parents: &GaussianList,
        situation: &Situation<'_>,
        (all, new): (&Wanted, &NewList),
        models: &ModelsInForce,
    ) -> Result<usize, Error> {
        let Some(set) = self.set(coder, draft, parents, situation, new.len())? else { return Ok(0) };
        let candidates = self.candidates(coder, draft, &set, &all.select(&new.added))?;
        // What is estimated knows nothing of contexts, which find much of what neighbours have in common.
        let is_compared = self.is_frugal() && !candidates.is_empty();
        let plain = if is_compared { coder.new_bytes(draft, &new.coded, models)? } else { 0 };
        let searched = set.len() / (8 * SEARCHED_FOR_A_BIT);
        let mut least = if is_compared { plain.saturating_sub(searched) } else { usize::MAX };
        let mut saved = 0;
        let only = candidates.len() == 1 && !self.is_frugal();
        for candidate in candidates {
            let bytes = if only { 0 } else { coder.new_bytes(&candidate, &new.coded, models)? };
            if bytes < least {
                (least, saved) = (bytes, plain.saturating_sub(bytes));
                *draft = candidate;
            }
        }
        Ok(saved)
    }

    /// What the new Gaussians of a draft may be predicted from; none where nothing is to be tried.
    fn set(
        self,
        coder: &UnitCoder<'_>,
        draft: &Draft,
        parents: &GaussianList,
        situation: &Situation<'_>,
        count: usize,
    ) -> Result<Option<QuantizedFrame>, Error> {
        // A codebook is made for whole values, not for residuals.
        let codebook = matches!(coder.colour.mode, ShCoding::VectorQuantised { .. });
        if !self.predicts() || count < FEW || codebook {
            return Ok(None);
        }
        let set = match situation.temporal {
            Some(_) => reference_set(situation, &parents.planes),
            None => {
                let mut before = draft.clone();
                before.header.new_count = 0;
                before.values.set(Section::New, SectionValues::default());
                let changed = coder.apply(&before, parents.clone(), situation)?;
                reference_set(situation, &changed.list.planes)
            }
        };
        let too_large = self.is_frugal() && set.len() / SEARCHED_FOR_A_BIT > count * MAX_SAVED;
        Ok(Some(set).filter(|set| !set.is_empty() && !too_large))
    }

    /// Drafts with predictors that seem to save something.
    fn candidates(
        self,
        coder: &UnitCoder<'_>,
        draft: &Draft,
        set: &QuantizedFrame,
        wanted: &Wanted,
    ) -> Result<Vec<Draft>, Error> {
        let header = IncrementHeader {
            predictor_block_log2: 0,
            neighbour_count: self.neighbours,
            bilateral_spatial: SPATIAL,
            bilateral_feature: FEATURE,
            ..draft.header
        };
        if let Some(recorder) = self.recorder {
            predicted(coder, &header, set, wanted, Predictor::Transformer, &mut |prediction, now| {
                recorder.take(prediction, now, wanted);
            })?;
            return Ok(Vec::new());
        }
        let SectionValues { deltas, block, planes } = draft.values.section(Section::New).clone();
        let mut tried = self.tried(coder, &header, set, wanted, planes)?;
        let mut chosen = self.chosen(&tried);
        if chosen.iter().any(|choice| learned(choice, wanted.len(), &tried) > coder.max_learned as usize) {
            tried.retain(|(predictor, _)| *predictor != Predictor::Transformer);
            chosen = self.chosen(&tried);
        }
        let candidate = |(run_log2, taken): Choice| {
            let codes: Vec<i32> = taken.iter().map(|&index| tried[index].0.code()).collect();
            if codes.iter().all(|&code| code == 0) {
                return None;
            }
            let run = 1_usize << run_log2;
            let planes = (0..tried[0].1.len())
                .map(|plane| (0..wanted.len()).map(|row| tried[taken[row / run]].1[plane][row]).collect())
                .collect();
            let header = IncrementHeader { predictor_block_log2: run_log2, ..header };
            let mut predicted = Draft { header, values: draft.values.clone() };
            predicted.values.set(Section::New, SectionValues { deltas: deltas.clone(), planes, block });
            predicted.values.set(Section::Predictors, coder.section(vec![codes]));
            Some(predicted)
        };
        Ok(chosen.into_iter().filter_map(candidate).collect())
    }

    /// Whether prediction has to pay.
    fn is_frugal(self) -> bool {
        self.choice == PredictorChoice::Bits && self.predictors.allows(Predictor::None)
    }

    /// The residuals under each predictor that Gaussians may take; `plain`: under none.
    fn tried(
        self,
        coder: &UnitCoder<'_>,
        header: &IncrementHeader,
        set: &QuantizedFrame,
        wanted: &Wanted,
        plain: Residuals,
    ) -> Result<Vec<(Predictor, Residuals)>, Error> {
        let mut tried = Vec::new();
        for predictor in [Predictor::Knn, Predictor::Bilateral, Predictor::Transformer] {
            let has_network = predictor != Predictor::Transformer || coder.network.is_some();
            if self.predictors.allows(predictor) && has_network {
                tried.push((predictor, predicted(coder, header, set, wanted, predictor, &mut |_, _| ())?));
            }
        }
        if self.predictors.allows(Predictor::None) || tried.is_empty() {
            tried.insert(0, (Predictor::None, plain));
        }
        Ok(tried)
    }

    /// Choices that are worth a closer look.
    fn chosen(self, tried: &[(Predictor, Residuals)]) -> Vec<Choice> {
        match self.choice {
            PredictorChoice::Difference => vec![(0, by_difference(tried))],
            PredictorChoice::Bits => by_bits(tried),
        }
    }
}

/// Residuals where every Gaussian has the same predictor.
fn predicted(
    coder: &UnitCoder<'_>,
    header: &IncrementHeader,
    set: &QuantizedFrame,
    wanted: &Wanted,
    predictor: Predictor,
    observe: &mut dyn FnMut(&Prediction<'_>, &Attributes),
) -> Result<Residuals, Error> {
    let shift = header.position_shift;
    let position = wanted
        .position
        .each_ref()
        .map(|plane| -> Vec<u32> { plane.iter().map(|place| refine(place.code(shift), shift)).collect() });
    let sh_planes = usize::from(coder.sequence.sh_dimension());
    let mut now = Attributes::unpredicted(wanted.len(), &coder.colour, sh_planes);
    let predictors = vec![predictor; wanted.len()];
    let slices = position.each_ref().map(Vec::as_slice);
    let mut planes = Vec::new();
    let by = Predicting {
        interrupt: Interrupt::NEVER,
        header,
        colour: coder.colour,
        network: coder.network,
        feature_shift: coder.sequence.feature_shift,
    };
    let rule = coder.steps(header.attribute_step);
    let mut prediction = Prediction::new(set, slices, &predictors, &by);
    for stage in Stage::ALL {
        if let Some(prediction) = &prediction {
            if stage == Stage::Dc {
                observe(prediction, &now);
            }
            prediction.predict(stage, &mut now);
        }
        planes.extend(wanted.residuals(stage, &now, &rule, coder, true));
        now.add_stage(stage, AttributeValues(&planes), &coder.coding(header.attribute_step), 0)?;
        if let Some(prediction) = &mut prediction {
            prediction.learn(stage, &now);
        }
    }
    Ok(planes)
}

/// Gaussians whose runs have chosen the transformer, at most.
fn learned((run_log2, indices): &Choice, count: usize, tried: &[(Predictor, Residuals)]) -> usize {
    let runs = indices.iter().filter(|&&index| tried[index].0 == Predictor::Transformer).count();
    (runs << run_log2).min(count)
}

/// For each Gaussian the predictor with the smallest sum of absolute residuals; of equal ones the first.
fn by_difference(tried: &[(Predictor, Residuals)]) -> Vec<usize> {
    let count = tried[0].1[0].len();
    let sum = |residuals: &Residuals, row: usize| -> u64 {
        residuals.iter().map(|plane| u64::from(plane[row].unsigned_abs())).sum()
    };
    let best = |row: usize| (0..tried.len()).min_by_key(|&index| (sum(&tried[index].1, row), index));
    (0..count).map(|row| best(row).unwrap_or(0)).collect()
}

/// For each run the predictor with the fewest estimated bits, and for all runs the one with the fewest: mixing spoils the
/// tables of contexts, of which estimates know nothing.
fn by_bits(tried: &[(Predictor, Residuals)]) -> Vec<Choice> {
    let count = tried[0].1[0].len();
    let run = 1_usize << RUN_LOG2;
    let costs: Vec<Vec<f64>> = tried.iter().map(|(_, residuals)| run_bits(residuals, run)).collect();
    let cheapest = |cost: &dyn Fn(usize) -> f64| {
        (0..tried.len()).min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or(0)
    };
    let indices: Vec<usize> =
        (0..count.div_ceil(run)).map(|at| cheapest(&|index| costs[index][at])).collect();
    let one = cheapest(&|index| costs[index].iter().sum());
    let whole = (count.max(1).next_power_of_two().ilog2() as u8).clamp(RUN_LOG2, WHOLE_LOG2);
    let mut choices = vec![(whole, vec![one; count.div_ceil(1 << whole)])];
    if indices.iter().any(|&index| index != one) {
        choices.insert(0, (RUN_LOG2, indices));
    }
    choices
}

/// Zero-order bits of each run.
fn run_bits(residuals: &Residuals, run: usize) -> Vec<f64> {
    let count = residuals[0].len();
    let mut bits = vec![0.0; count.div_ceil(run)];
    for plane in residuals {
        let sum: i64 = plane.iter().map(|&value| i64::from(value)).sum();
        let mean = sum.div_euclid(count.max(1) as i64) as i32;
        let symbol = |value: i32| -> (usize, u32) {
            let u = zigzag(value.wrapping_sub(mean));
            if u < DIRECT { (u as usize, 0) } else { ((DIRECT + u.ilog2()) as usize, u.ilog2()) }
        };
        let mut histogram = [0_u32; 64];
        plane.iter().for_each(|&value| histogram[symbol(value).0] += 1);
        let cost = histogram.map(|n| libm::log2(count as f64 / f64::from(n.max(1))));
        for (index, &value) in plane.iter().enumerate() {
            let (token, raw) = symbol(value);
            bits[index / run] += cost[token] + f64::from(raw);
        }
    }
    bits
}

/// New Gaussians by the code of their predictor.
pub(crate) fn used(draft: &Draft) -> [u64; 4] {
    let total = draft.header.new_count as usize;
    if !draft.is_predicted() {
        return [total as u64, 0, 0, 0];
    }
    let mut counts = [0; 4];
    let run = 1_usize << draft.header.predictor_block_log2;
    for (index, &code) in draft.values.plane(Section::Predictors, 0).iter().enumerate() {
        counts[code as usize] += (total - index * run).min(run) as u64;
    }
    counts
}
