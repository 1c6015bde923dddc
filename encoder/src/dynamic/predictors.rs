//! Which predictor new Gaussians take: by estimated bits, or by the paper's sum of absolute residuals.

use super::learning::Recorder;
use super::unit::{Draft, UnitCoder};
use super::wanted::Wanted;
use crate::error::Error;
use crate::settings::{NEIGHBOURS, PredictorChoice, Predictors};
use splatstream_decoder::frame::QuantizedFrame;
use splatstream_decoder::home::Home;
use splatstream_decoder::increment::prediction::{Predicting, Prediction};
use splatstream_decoder::increment::residual::{AttributeValues, Attributes, Stage};
use splatstream_decoder::increment::values::SectionValues;
use splatstream_decoder::increment::{Applied, Situation, reference_set};
use splatstream_decoder::layout::{Section, ShCoding};
use splatstream_decoder::position::refine;
use splatstream_decoder::predictor::Predictor;
use splatstream_format::entropy::in_force::ModelsInForce;
use splatstream_format::entropy::token::zigzag;
use splatstream_format::payload::SectionBytes;
use splatstream_format::syntax::{IncrementHeader, NO_PREDICTOR};

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
const MOST_SAVED: usize = 10;

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

/// log2 of the Gaussians of a run, and for each run the place of its predictor among those tried.
type Choice = (u8, Vec<usize>);

/// Residual planes of new Gaussians under one predictor, in plane order.
type Residuals = Vec<Vec<i32>>;

impl Chooser<'_> {
    /// Predicts nothing.
    pub(crate) const UNPREDICTED: Self = Self {
        predictors: Predictors::NONE,
        choice: PredictorChoice::Bits,
        neighbours: NEIGHBOURS,
        recorder: None,
    };

    /// Gives a draft its new Gaussians, each with its predictor, and what a decoder makes of it. Their positions are in
    /// the draft.
    ///
    /// # Errors
    /// What the decoder's own checks refuse.
    pub(crate) fn choose(
        self,
        coder: &UnitCoder<'_>,
        draft: &mut Draft,
        parents: Home,
        situation: &Situation<'_>,
        wanted: &Wanted,
        models: &ModelsInForce,
    ) -> Result<Applied, Error> {
        let plain = unpredicted(coder, wanted, draft.header.position_shift)?;
        let mut new = draft.values.section(Section::New).clone();
        new.planes.clone_from(&plain);
        draft.values.set(Section::New, new);
        let (candidates, searched) = self.predict(coder, draft, &parents, situation, wanted, plain)?;
        // What is estimated knows nothing of contexts, which find much of what neighbours have in common.
        let mut least = match self.is_frugal() && !candidates.is_empty() {
            true => new_bytes(coder, draft, models)?.saturating_sub(searched / (8 * SEARCHED_FOR_A_BIT)),
            false => usize::MAX,
        };
        let only = candidates.len() == 1 && !self.is_frugal();
        for candidate in candidates {
            let bytes = if only { 0 } else { new_bytes(coder, &candidate, models)? };
            if bytes < least {
                least = bytes;
                *draft = candidate;
            }
        }
        coder.apply(draft, parents, situation)
    }

    /// Drafts with predictors that seem to save something, and the size of the set to search.
    fn predict(
        self,
        coder: &UnitCoder<'_>,
        draft: &Draft,
        parents: &Home,
        situation: &Situation<'_>,
        wanted: &Wanted,
        plain: Residuals,
    ) -> Result<(Vec<Draft>, usize), Error> {
        // A codebook is made for whole values, not for residuals.
        let codebook = matches!(coder.colour.mode, ShCoding::VectorQuantised { .. });
        let tries = self.predictors != Predictors::NONE && wanted.len() >= FEW && !codebook;
        let set = if tries { self.set(coder, draft, parents, situation)? } else { QuantizedFrame::default() };
        let SectionValues { deltas, block, .. } = draft.values.section(Section::New).clone();
        let too_large = set.len() / SEARCHED_FOR_A_BIT > wanted.len() * MOST_SAVED;
        if set.is_empty() || too_large && self.is_frugal() {
            return Ok((Vec::new(), 0));
        }
        let header = IncrementHeader {
            predictor_block_log2: 0,
            neighbour_count: self.neighbours,
            bilateral_spatial: SPATIAL,
            bilateral_feature: FEATURE,
            ..draft.header
        };
        if let Some(recorder) = self.recorder {
            predicted(coder, &header, &set, wanted, Predictor::Transformer, &mut |prediction, now| {
                recorder.take(prediction, now, wanted);
            })?;
        }
        let mut tried = self.tried(coder, &header, &set, wanted, plain)?;
        let mut chosen = self.chosen(&tried);
        if chosen.iter().any(|choice| learned(choice, wanted.len(), &tried) > coder.most_learned as usize) {
            tried.retain(|(predictor, _)| *predictor != Predictor::Transformer);
            chosen = self.chosen(&tried);
        }
        let drafts = chosen.into_iter().filter_map(|(run_log2, places)| {
            let codes: Vec<i32> = places.iter().map(|&place| tried[place].0.code()).collect();
            if codes.iter().all(|&code| code == 0) {
                return None;
            }
            let run = 1_usize << run_log2;
            let planes = (0..tried[0].1.len())
                .map(|plane| (0..wanted.len()).map(|row| tried[places[row / run]].1[plane][row]).collect())
                .collect();
            let header = IncrementHeader { predictor_block_log2: run_log2, ..header };
            let mut predicted = Draft { header, values: draft.values.clone() };
            predicted.values.set(Section::New, SectionValues { deltas: deltas.clone(), planes, block });
            let predictors = SectionValues { deltas: Vec::new(), planes: vec![codes], block };
            predicted.values.set(Section::Predictors, predictors);
            Some(predicted)
        });
        Ok((drafts.collect(), set.len()))
    }

    /// Whether prediction has to pay.
    fn is_frugal(self) -> bool {
        self.choice == PredictorChoice::Bits && self.predictors.allows(Predictor::None)
    }

    /// The residuals under each predictor that Gaussians may take.
    fn tried(
        self,
        coder: &UnitCoder<'_>,
        header: &IncrementHeader,
        set: &QuantizedFrame,
        wanted: &Wanted,
        plain: Residuals,
    ) -> Result<Vec<(Predictor, Residuals)>, Error> {
        let mut tried = Vec::new();
        // What is only recorded needs no choice.
        if self.predictors.allows(Predictor::None) || self.recorder.is_some() {
            tried.push((Predictor::None, plain.clone()));
        }
        if self.recorder.is_some() {
            return Ok(tried);
        }
        for predictor in [Predictor::Knn, Predictor::Bilateral, Predictor::Transformer] {
            let has_network = predictor != Predictor::Transformer || coder.network.is_some();
            if self.predictors.allows(predictor) && has_network {
                tried.push((predictor, predicted(coder, header, set, wanted, predictor, &mut |_, _| ())?));
            }
        }
        if tried.is_empty() {
            tried.push((Predictor::None, plain));
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

    /// What new Gaussians may be predicted from.
    fn set(
        self,
        coder: &UnitCoder<'_>,
        draft: &Draft,
        parents: &Home,
        situation: &Situation<'_>,
    ) -> Result<QuantizedFrame, Error> {
        if !situation.parents_follow {
            return Ok(reference_set(situation, &parents.planes));
        }
        let mut before = draft.clone();
        before.header.new_count = 0;
        before.values.set(Section::New, SectionValues::default());
        let changed = coder.apply(&before, parents.clone(), situation)?;
        Ok(reference_set(situation, &changed.home.planes))
    }
}

/// Bytes of the sections that predictors change.
fn new_bytes(coder: &UnitCoder<'_>, draft: &Draft, models: &ModelsInForce) -> Result<usize, Error> {
    let mut only = draft.clone();
    for section in [Section::Cells, Section::Modes, Section::Moves, Section::Updates] {
        only.values.set(section, SectionValues::default());
    }
    let header = &mut only.header;
    (header.cell_count, header.parent_count, header.move_count, header.update_count) = (0, 0, 0, 0);
    let sections = coder.sections(&only, &mut models.clone())?;
    let bytes =
        |section: &SectionBytes| section.model.len() + section.blocks.iter().map(Vec::len).sum::<usize>();
    Ok(sections.iter().map(bytes).sum())
}

fn sh_planes(coder: &UnitCoder<'_>) -> usize {
    usize::from(coder.sequence.sh_dimension())
}

/// Residuals on top of nothing.
fn unpredicted(coder: &UnitCoder<'_>, wanted: &Wanted, shift: u8) -> Result<Residuals, Error> {
    let mut now = Attributes::unpredicted(wanted.len(), &coder.colour, sh_planes(coder));
    let mut planes = Vec::new();
    for stage in Stage::ALL {
        planes.extend(wanted.residuals(stage, &now, shift, &coder.colour, true));
        let coding = coder.coding([shift; 5]);
        now.add_stage(stage, AttributeValues(&planes), &coding, 0)?;
    }
    Ok(planes)
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
        .map(|plane| -> Vec<u32> { plane.iter().map(|&value| refine(value >> shift, shift)).collect() });
    let mut now = Attributes::unpredicted(wanted.len(), &coder.colour, sh_planes(coder));
    let predictors = vec![predictor; wanted.len()];
    let slices = position.each_ref().map(Vec::as_slice);
    let mut planes = Vec::new();
    let by = Predicting { header, colour: coder.colour, network: coder.network };
    let mut prediction = Prediction::new(set, slices, &predictors, &by);
    for stage in Stage::ALL {
        if let Some(prediction) = &prediction {
            if stage == Stage::Dc {
                observe(prediction, &now);
            }
            prediction.predict(stage, &mut now);
        }
        planes.extend(wanted.residuals(stage, &now, shift, &coder.colour, true));
        now.add_stage(stage, AttributeValues(&planes), &coder.coding([shift; 5]), 0)?;
        if let Some(prediction) = &mut prediction {
            prediction.learn(stage, &now);
        }
    }
    Ok(planes)
}

/// Gaussians whose runs have chosen the transformer, at most.
fn learned((run_log2, places): &Choice, count: usize, tried: &[(Predictor, Residuals)]) -> usize {
    let runs = places.iter().filter(|&&place| tried[place].0 == Predictor::Transformer).count();
    (runs << run_log2).min(count)
}

/// For each Gaussian the predictor with the smallest sum of absolute residuals; of equal ones the first.
fn by_difference(tried: &[(Predictor, Residuals)]) -> Vec<usize> {
    let count = tried[0].1[0].len();
    let sum = |residuals: &Residuals, row: usize| -> u64 {
        residuals.iter().map(|plane| u64::from(plane[row].unsigned_abs())).sum()
    };
    let best = |row: usize| (0..tried.len()).min_by_key(|&place| (sum(&tried[place].1, row), place));
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
    let places: Vec<usize> = (0..count.div_ceil(run)).map(|at| cheapest(&|place| costs[place][at])).collect();
    let one = cheapest(&|place| costs[place].iter().sum());
    let whole = (count.max(1).next_power_of_two().ilog2() as u8).clamp(RUN_LOG2, WHOLE_LOG2);
    let mut choices = vec![(whole, vec![one; count.div_ceil(1 << whole)])];
    if places.iter().any(|&place| place != one) {
        choices.insert(0, (RUN_LOG2, places));
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
        for (place, &value) in plane.iter().enumerate() {
            let (place_in_histogram, raw) = symbol(value);
            bits[place / run] += cost[place_in_histogram] + f64::from(raw);
        }
    }
    bits
}

/// New Gaussians by the code of their predictor.
pub(crate) fn used(draft: &Draft) -> [u64; 4] {
    let mut counts = [0; 4];
    let total = draft.header.new_count as usize;
    if draft.header.predictor_block_log2 == NO_PREDICTOR {
        counts[0] = total as u64;
        return counts;
    }
    let run = 1_usize << draft.header.predictor_block_log2;
    for (place, &code) in draft.values.plane(Section::Predictors, 0).iter().enumerate() {
        counts[code as usize] += (total - place * run).min(run) as u64;
    }
    counts
}
