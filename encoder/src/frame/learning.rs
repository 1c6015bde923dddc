//! The network of a sequence: where it comes from, and what it is trained with.

use super::recorder::Recorder;
use super::training_memory::used;
use crate::error::Error;
use crate::first_frame::looking;
use crate::gop::SpanCoder;
use crate::importance::Ranking;
use crate::sequence::{Analysis, analyse};
use crate::settings::{NetworkSource, Settings};
use crate::source::FrameSource;
use crate::spans::Spans;
use crate::spans::span::Common;
use crate::transformer::{Architecture, Loss, Progress, Sample, Schedule, TrainingReport, train};
use crate::writer::Coded;
use core::ops::ControlFlow;
use splatstream_format::Limits;
use splatstream_format::payload::{Layer, Network, Part, REGISTRY};
use splatstream_format::syntax::SequenceParameters;

/// Batches below which there is nothing to train with.
const LEAST: usize = 1 << 6;

/// One batch of so many is kept to judge the network by.
const HELD_OUT: usize = 8;

/// The network that the GOPs of a sequence may use.
///
/// # Errors
/// As [`encode`](crate::encode).
pub(crate) fn network(
    source: &mut dyn FrameSource,
    settings: &Settings,
    analysis: &Analysis,
) -> Result<Option<Network>, Error> {
    let sequence = &analysis.parameters;
    match used(settings) {
        None => Ok(None),
        Some(NetworkSource::Given(network)) => Ok(Some(*network)),
        Some(NetworkSource::Registered) => registered(),
        Some(NetworkSource::Fitted) => trained(source, settings, sequence, &Architecture::BASES),
        Some(NetworkSource::Trained(architecture)) => trained(source, settings, sequence, &[architecture]),
    }
}

/// A network trained on the sequence, of the architecture whose base is nearer.
fn trained(
    source: &mut dyn FrameSource,
    settings: &Settings,
    sequence: &SequenceParameters,
    architectures: &[Architecture],
) -> Result<Option<Network>, Error> {
    let mut found = Vec::new();
    for architecture in architectures {
        found.push((*architecture, recorded(source, settings, sequence, architecture)?));
    }
    let (architecture, samples) = nearer(found);
    Ok(train_network(&architecture, samples, &mut |_| {})?.map(|(network, _)| network))
}

/// The registered network, if there is one.
fn registered() -> Result<Option<Network>, Error> {
    let first = REGISTRY.first().map(|(_, bytes)| Network::parse(bytes, 0));
    Ok(first.transpose()?)
}

/// Encodes a sequence for what its new Gaussians are predicted from.
///
/// # Errors
/// As [`encode`](crate::encode).
fn recorded(
    source: &mut dyn FrameSource,
    settings: &Settings,
    sequence: &SequenceParameters,
    architecture: &Architecture,
) -> Result<Vec<Sample>, Error> {
    let recorder = Recorder::default();
    let network = zero(architecture)?;
    let (sequence, network, limits) = (*sequence, Some(&network), Limits::default());
    let common = Common { settings, sequence, limits, network };
    let ranking = looking(source, Ranking::new(settings), settings)?;
    for span in Spans::new(0..source.len(), settings.gop_length()) {
        let (mut coded, mut progress) = (Coded::default(), |_| ());
        let coder = SpanCoder::new(source, common, ranking.clone(), &mut coded, &mut progress);
        SpanCoder { recorder: Some(&recorder), ..coder }.code(span)?;
    }
    Ok(recorder.into_samples())
}

/// What the new Gaussians of a sequence can be predicted from: a network is trained with it.
///
/// # Errors
/// As [`encode`](crate::encode).
pub fn samples(
    source: &mut dyn FrameSource,
    settings: &Settings,
    architecture: &Architecture,
) -> Result<Vec<Sample>, Error> {
    let analysis = analyse(source, settings)?;
    recorded(source, settings, &analysis.parameters, architecture)
}

/// The architecture whose base leaves least, and its samples; of equal ones the first, and of none the default, without
/// samples.
#[expect(clippy::arithmetic_side_effects, reason = "two counts of eight bits")]
pub fn nearer(found: Vec<(Architecture, Vec<Sample>)>) -> (Architecture, Vec<Sample>) {
    let left = |(architecture, samples): &(Architecture, Vec<Sample>)| -> u64 {
        let outputs = usize::from(architecture.dc_count) + usize::from(architecture.sh_count);
        Loss::of_base(samples, outputs).sums.iter().sum()
    };
    found.into_iter().min_by_key(left).unwrap_or_default()
}

/// A network trained with samples; none where they are too few. `progress` is called after each epoch.
///
/// # Errors
/// As [`train`].
pub fn train_network(
    architecture: &Architecture,
    samples: Vec<Sample>,
    progress: &mut dyn FnMut(&Progress),
) -> Result<Option<(Network, TrainingReport)>, Error> {
    if samples.len() < LEAST {
        return Ok(None);
    }
    let (mut training, mut held_out) = (Vec::new(), Vec::new());
    for (index, sample) in samples.into_iter().enumerate() {
        if index % HELD_OUT == 0 { held_out.push(sample) } else { training.push(sample) }
    }
    let mut progress = |epoch: &Progress| {
        progress(epoch);
        ControlFlow::Continue(())
    };
    train(architecture, &training, &held_out, &Schedule::default(), &mut progress).map(Some)
}

/// A network of an architecture that gives 0: it predicts what its base does.
fn zero(architecture: &Architecture) -> Result<Network, Error> {
    let header = architecture.header()?;
    let layers = Part::ALL.map(|part| {
        let (weights, biases) = part.lengths(&header);
        Layer { weights: vec![0; weights], bias: vec![0; biases] }
    });
    Ok(Network::new(header, layers)?)
}
