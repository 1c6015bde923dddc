//! What the network of a sequence is trained with, collected while it is encoded; and the unit that carries it.

use super::residuals::Wanted;
use crate::error::Error;
use crate::transformer::Sample;
use core::cell::RefCell;
use splatstream_decoder::increment::prediction::Prediction;
use splatstream_decoder::increment::residual::Attributes;
use splatstream_decoder::transformer::{Batch, LANES};
use splatstream_format::payload::{Network, REGISTRY, Weights};

/// Batches that a unit gives, at most: a network is trained on many frames.
const OF_A_UNIT: usize = 1 << 9;

/// Batches that a network is trained with, at most.
const MOST: usize = 1 << 13;

/// Collects what a network is trained with, while a sequence is encoded.
#[derive(Default)]
pub(crate) struct Recorder {
    samples: RefCell<Vec<Sample>>,
}

impl Recorder {
    /// Takes some of the Gaussians that a unit predicts.
    pub(crate) fn take(&self, prediction: &Prediction<'_>, now: &Attributes, wanted: &Wanted) {
        let Some(learned) = prediction.learned() else { return };
        let targets = prediction.targets();
        let stride = targets.len().div_ceil(LANES).div_ceil(OF_A_UNIT).max(1);
        let some: Vec<_> = targets.chunks_exact(LANES).step_by(stride).flatten().copied().collect();
        let batches = learned.batches(&some, now);
        let outputs = learned.wanted(&some, &wanted.dc, &wanted.sh);
        let mut samples = self.samples.borrow_mut();
        samples
            .extend(batches.into_iter().zip(outputs.chunks(LANES)).map(|(batch, rows)| sample(batch, rows)));
    }

    /// Batches that are collected at most, where a GOP has so many units: none is begun once there is enough.
    pub(crate) fn most(units: u64) -> u64 {
        units.saturating_mul(OF_A_UNIT as u64).saturating_add(MOST as u64)
    }

    /// Whether that is enough.
    pub(crate) fn is_full(&self) -> bool {
        self.samples.borrow().len() >= MOST
    }

    /// What was collected.
    pub(crate) fn into_samples(self) -> Vec<Sample> {
        self.samples.into_inner()
    }
}

/// The payload of the weights unit of a network: its name, if it is registered.
///
/// # Errors
/// A network that a decoder would refuse.
pub(crate) fn weights(network: &Network) -> Result<Weights, Error> {
    let bytes = network.to_bytes()?;
    let registered = REGISTRY.iter().find(|(_, known)| **known == bytes[..]);
    Ok(registered
        .map_or_else(|| Weights::Carried(Box::new(network.clone())), |(name, _)| Weights::Registered(*name)))
}

/// A batch, and for each of its Gaussians the outputs that would leave nothing to code.
#[expect(clippy::indexing_slicing, reason = "a batch has at most LANES rows")]
fn sample(batch: Batch, rows: &[Vec<i32>]) -> Sample {
    let outputs = rows.first().map_or(0, Vec::len);
    let mut wanted = vec![[0; LANES]; outputs];
    for (lane, row) in rows.iter().enumerate() {
        wanted.iter_mut().zip(row).for_each(|(wanted, &value)| wanted[lane] = value);
    }
    Sample { batch, wanted, used: rows.len() }
}
