//! Trains the learned predictor of 7.17.6.
//!
//! A [`Sample`] is a batch as the decoder sees it and the outputs that would leave nothing to code. [`train`] changes
//! the parameters of a network so that its L1 distance to them falls. The pass forwards is the integer network itself,
//! to the last bit, with the parameters rounded; the slopes are those of the same network without rounding. So there is
//! no network in floating point that would have to be quantised: the losses in the [`TrainingReport`] are those of the
//! decoder.
//!
//! The same samples, architecture and schedule give the same network on every machine and with any number of threads.
//!
//! | module | holds |
//! |---|---|
//! | `parameters` | where the parameters of a network stand, and those to start from |
//! | `model`, `attention` | the pass forwards |
//! | `gradient`, `backward` | the slopes of the parameters |
//! | `descent` | steps against the slopes |
//! | `loss` | how far outputs are from those wanted |
//! | `lane`, `matrix` | arithmetic on 16 Gaussians |

mod architecture;
mod attention;
mod backward;
mod descent;
mod gradient;
mod lane;
mod loss;
mod matrix;
mod model;
mod parameters;
#[cfg(test)]
mod tests;

pub use architecture::Architecture;
pub use loss::Loss;

use crate::Error;
use descent::Descent;
use lane::Whole;
use model::Model;
use parameters::Layout;
use splatstream_decoder::transformer::{Batch, LANES};
use splatstream_format::payload::Network;
use splatstream_format::syntax::NetworkHeader;
use splatstream_gaussians::random::SplitMix64;
use std::ops::ControlFlow;

/// What a network is to learn from, or to be judged by: new Gaussians, at most [`LANES`], with equally many neighbours.
#[derive(Debug, Clone)]
pub struct Sample {
    /// What the network sees.
    pub batch: Batch,
    /// What its outputs should be, in step/64: row k has output k of each Gaussian.
    pub wanted: Vec<[i32; LANES]>,
    /// Gaussians: the first so many lanes. The others count for nothing.
    pub used: usize,
}

/// How to train.
#[derive(Debug, Clone, Copy)]
pub struct Schedule<'s> {
    /// Chooses the first parameters and the order of the samples.
    pub seed: u64,
    /// How often every sample is seen, at most.
    pub epochs: usize,
    /// Samples between steps.
    pub batch: usize,
    /// The length of the first steps, in units of a weight. They become shorter with the cosine of the time.
    pub learning_rate: f32,
    /// Epochs without a smaller loss in the validation after which training ends.
    pub patience: usize,
    /// What each output counts; none: all the same.
    pub weights: Option<&'s [f32]>,
    /// A network of the same header to start from.
    pub start: Option<&'s Network>,
}

impl Default for Schedule<'_> {
    fn default() -> Self {
        let (weights, start) = (None, None);
        Self { seed: 0, epochs: 10, batch: 16, learning_rate: 1.0, patience: 4, weights, start }
    }
}

/// What has been learnt after an epoch.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// Epochs that are done.
    pub epoch: usize,
    /// Weighted L1 of the samples while they were learnt from, a Gaussian.
    pub training: f64,
    /// Weighted L1 of the validation, a Gaussian.
    pub validation: f64,
    /// The least of those seen, the start included.
    pub best: f64,
}

/// What training has done to the validation.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TrainingReport {
    /// With outputs 0, that is of the base.
    pub base: Loss,
    /// Of the network that training started from; of a new one, that is `base`.
    pub start: Loss,
    /// Of the network that training gave.
    pub best: Loss,
    /// The epoch after which that was found; 0: it is the start.
    pub best_epoch: usize,
    /// Each epoch.
    pub epochs: Vec<Progress>,
}

/// Trains a network of an architecture. What comes back is the best one seen, judged by `validation`, or by `training`
/// if that is empty; so it is never worse than what training started from. `progress` is called after each epoch and
/// can end the training.
///
/// # Errors
/// An architecture that 6.17.1 does not allow; samples, weights or a start that are not of its header; a schedule
/// without steps.
#[expect(clippy::arithmetic_side_effects, reason = "a count of epochs")]
pub fn train(
    architecture: &Architecture,
    training: &[Sample],
    validation: &[Sample],
    schedule: &Schedule<'_>,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<(Network, TrainingReport), Error> {
    let header = architecture.header()?;
    let validation = if validation.is_empty() { training } else { validation };
    check(&header, training.iter().chain(validation), schedule)?;
    let layout = Layout::new(header);
    let mut trainer = Trainer::new(&layout, validation, schedule)?;
    let mut order: Vec<&Sample> = training.iter().collect();
    let mut random = SplitMix64::new(schedule.seed);
    let mut descent = Descent::new(&layout, schedule, training.len());
    let mut without = 0;
    for epoch in 1..=schedule.epochs {
        random.shuffle(&mut order);
        let learnt = trainer.epoch(&order, &mut descent);
        let better = trainer.judge(epoch, learnt)?;
        without = if better { 0 } else { without + 1 };
        let stopped = trainer.report.epochs.last().is_some_and(|epoch| progress(epoch).is_break());
        if stopped || without >= schedule.patience.max(1) {
            break;
        }
    }
    Ok((trainer.best, trainer.report))
}

/// A training on its way.
struct Trainer<'t> {
    layout: &'t Layout,
    schedule: &'t Schedule<'t>,
    validation: &'t [Sample],
    /// What each output counts.
    weights: Vec<f32>,
    parameters: Vec<f32>,
    best: Network,
    report: TrainingReport,
}

impl<'t> Trainer<'t> {
    fn new(layout: &'t Layout, validation: &'t [Sample], schedule: &'t Schedule<'t>) -> Result<Self, Error> {
        let outputs = layout.header.outputs();
        let weights = schedule.weights.map_or_else(|| vec![1.0; outputs], <[f32]>::to_vec);
        let initial = || layout.initial(schedule.seed);
        let parameters = schedule.start.map_or_else(initial, |network| layout.of(network));
        let best = layout.network(&parameters)?;
        let start = Loss::of(&best, validation);
        let report = TrainingReport {
            base: Loss::of_base(validation, outputs),
            best: start.clone(),
            start,
            best_epoch: 0,
            epochs: Vec::new(),
        };
        Ok(Self { layout, schedule, validation, weights, parameters, best, report })
    }

    /// Learns from every sample once. Gives the loss on the way.
    fn epoch(&mut self, order: &[&Sample], descent: &mut Descent) -> Loss {
        let mut learnt = Loss::new(self.layout.header.outputs());
        for samples in order.chunks(self.schedule.batch) {
            let model = Model::new::<Whole>(self.layout, &self.parameters);
            let (slopes, loss) = loss::slopes(&model, samples, &self.weights);
            descent.step(&mut self.parameters, &slopes);
            self.layout.confine(&mut self.parameters);
            learnt.add(&loss);
        }
        learnt
    }

    /// Compares what has been learnt with the best before. Tells whether it is better.
    fn judge(&mut self, epoch: usize, learnt: Loss) -> Result<bool, Error> {
        let network = self.layout.network(&self.parameters)?;
        let loss = Loss::of(&network, self.validation);
        let (validation, best) = (loss.weighted(&self.weights), self.report.best.weighted(&self.weights));
        let training = learnt.weighted(&self.weights);
        let better = validation < best;
        if better {
            (self.best, self.report.best, self.report.best_epoch) = (network, loss, epoch);
        }
        self.report.epochs.push(Progress { epoch, training, validation, best: best.min(validation) });
        Ok(better)
    }
}

/// Whether samples, weights and start fit a header, and the schedule has steps.
fn check<'s>(
    header: &NetworkHeader,
    mut samples: impl Iterator<Item = &'s Sample>,
    schedule: &Schedule<'_>,
) -> Result<(), Error> {
    let setting = |name, value, allowed| Err(Error::Setting { name, value, allowed });
    let fits = |sample: &Sample| {
        sample.batch.neighbours() > 0
            && sample.batch.token(0).len() == header.inputs()
            && sample.wanted.len() == header.outputs()
            && (1..=LANES).contains(&sample.used)
    };
    if !samples.all(fits) {
        return setting(
            "sample",
            "of another shape".to_owned(),
            "the inputs and outputs of the architecture",
        );
    }
    if let Some(weights) = schedule.weights {
        let fine = |weight: &f32| weight.is_finite() && *weight >= 0.0;
        if weights.len() != header.outputs() || !weights.iter().all(fine) {
            return setting("weights", format!("{weights:?}"), "a number from 0 for each output");
        }
    }
    if schedule.start.is_some_and(|network| network.header != *header) {
        return setting("start", "another architecture".to_owned(), "a network of the same header");
    }
    if schedule.batch == 0 {
        return setting("batch", schedule.batch.to_string(), "1 and more");
    }
    if !schedule.learning_rate.is_finite() || schedule.learning_rate <= 0.0 {
        return setting("learning rate", schedule.learning_rate.to_string(), "above 0");
    }
    Ok(())
}
