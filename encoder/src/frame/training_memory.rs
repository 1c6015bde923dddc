//! Whether a network is trained while a sequence is encoded, and what memory its samples take: known from the settings, before
//! anything is read.

use super::recorder::Recorder;
use crate::error::Error;
use crate::settings::{NetworkSource, Settings};
use crate::transformer::{Architecture, Sample};
use splatstream_decoder::predictor::Predictor;
use splatstream_decoder::transformer::LANES;
use splatstream_format::syntax::Profile;

/// Where the network comes from, if one is used.
pub(super) fn used(settings: &Settings) -> Option<NetworkSource> {
    let may_be_used =
        settings.profile() != Profile::Intra && settings.predictors.allows(Predictor::Transformer);
    // Among other predictors it seldom saves what it takes.
    let is_sought = !settings.predictors.allows(Predictor::Bilateral);
    may_be_used.then(|| settings.network.clone().or(is_sought.then_some(NetworkSource::Fitted))).flatten()
}

/// Bytes of the samples that networks are trained with while a sequence is encoded, whose frames have so many Gaussians.
pub(crate) fn bytes_of_training(settings: &Settings, gaussians: u64, frames: u32) -> u64 {
    let architectures = match used(settings) {
        None | Some(NetworkSource::Given(_) | NetworkSource::Registered) => return 0,
        Some(NetworkSource::Fitted) => Architecture::BASES.to_vec(),
        Some(NetworkSource::Trained(architecture)) => vec![architecture],
    };
    // An architecture that is not allowed is refused before anything is sampled.
    let of_samples = |architecture| bytes_of_samples(settings, architecture, gaussians, frames).unwrap_or(0);
    architectures.iter().map(of_samples).fold(0, u64::saturating_add)
}

/// Bytes that the [samples](crate::samples) of a sequence take at most, whose frames have so many Gaussians.
///
/// # Errors
/// An architecture that 6.17.1 does not allow.
pub fn bytes_of_samples(
    settings: &Settings,
    architecture: &Architecture,
    gaussians: u64,
    frames: u32,
) -> Result<u64, Error> {
    let header = architecture.header()?;
    let of_gop = frames.min(settings.gop_length());
    // Gaussians are new in one layer only.
    let units = u64::from(of_gop).saturating_mul(settings.refinements.len() as u64);
    let all = gaussians.saturating_mul(frames.into()).div_ceil(LANES as u64);
    let batches = all.min(Recorder::most(units));
    let rows = u64::from(settings.neighbours).saturating_mul((header.inputs() as u64).saturating_add(3));
    let of_batch = rows.saturating_add((header.outputs() as u64).saturating_mul(size_of::<i32>() as u64));
    let of_sample = of_batch.saturating_mul(LANES as u64).saturating_add(size_of::<Sample>() as u64);
    Ok(batches.saturating_mul(of_sample))
}
