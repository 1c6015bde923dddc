//! Plans on their way from machine to machine.

use super::Plan;
use crate::error::Error;
use crate::laws::Laws;
use crate::prune::refuse_pruning;
use crate::report::TargetReport;
use crate::sequence::{Analysis, check};
use crate::settings::{NetworkSource, Settings, ShChoice};
use crate::steps::Steps;
use crate::value_digest::digest_of;
use serde::{Deserialize, Serialize};
use splatstream_format::Limits;
use splatstream_format::payload::Network;
use splatstream_format::syntax::{MAX_REFINEMENTS, SequenceParameters};
use std::collections::BTreeMap;

/// A [plan](Plan) as plain values, to be written with serde in any format. A plan that is read from it gives the same bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanRecord {
    /// What the plan was made with: each setting by its name, and the version of the encoder.
    pub settings: BTreeMap<String, String>,
    /// Gaussians of each frame of the sequence, as it is read.
    pub gaussians: Vec<u32>,
    /// A digest of each frame, as it is read: XXH64 of its degree of SH, 1 or 0 for antialiased, and the values of its planes as
    /// single precision, least significant byte first.
    pub frame_digests: Vec<u64>,
    /// Steps that were found.
    pub steps: PlannedSteps,
    /// How steps follow from what is known of a Gaussian: powers of area, opacity and anisotropy, and the area and the
    /// anisotropy from which steps are as asked for.
    pub laws: [Single; 5],
    /// Half octaves by which the steps of each refinement are coarser.
    pub coarser: [u8; MAX_REFINEMENTS as usize],
    /// Whether each frame stands for itself in one layer although frames might have been predicted.
    pub stands_alone: bool,
    /// The payload of the sequence_parameters unit.
    pub sequence_parameters: Vec<u8>,
    /// Level of the stream.
    pub level: u8,
    /// Gaussians of the largest frame that can be seen.
    pub largest: u32,
    /// SH degree of the source.
    pub source_sh_degree: u8,
    /// Bits per Gaussian of scale and rotation with sorted axes, and as they come.
    pub axes_trial: [Single; 2],
    /// The corners of the box of all Gaussians that can be seen, scene units.
    pub bounds: Option<[[Single; 3]; 2]>,
    /// The network that GOPs may use, as clause 6.17 has it.
    pub network: Option<Vec<u8>>,
    /// How the steps were found; none if they were given.
    pub target: Option<PlannedTarget>,
}

/// Quantiser steps of a plan, as those of [`Steps`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedSteps {
    /// Bits of a position.
    pub position_bits: Single,
    /// Natural log of the semi-axes.
    pub log_scale: Single,
    /// Quaternion components.
    pub rotation: Single,
    /// Opacity logit.
    pub opacity: Single,
    /// Components of dc.
    pub dc: Single,
    /// Components of SH.
    pub sh: Single,
}

/// How steps of a plan were found, as [`TargetReport`] says it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedTarget {
    /// The PSNR that they were fitted for, decibels.
    pub fitted: Single,
    /// Times that the whole sequence is encoded for it.
    pub encodings: u32,
    /// Times that a part of it was encoded.
    pub trials: u32,
    /// Whether values are not fitted to pictures although the settings say so.
    pub without_finetune: bool,
    /// Whether SH has no codebook although the settings leave it open.
    pub without_codebook: bool,
}

impl PlannedTarget {
    /// Settings without what was given up.
    fn settled(&self, settings: Settings) -> Settings {
        Settings {
            finetune: settings.finetune.filter(|_| !self.without_finetune),
            sh: if self.without_codebook { ShChoice::Coefficients } else { settings.sh },
            ..settings
        }
    }
}

/// A number of single precision that any format keeps to the last bit: it is written in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "f64", into = "f64")]
pub struct Single(pub f32);

impl From<f64> for Single {
    fn from(value: f64) -> Self {
        Self(value as f32)
    }
}

impl From<Single> for f64 {
    fn from(Single(value): Single) -> Self {
        value.into()
    }
}

impl PlanRecord {
    /// A number that two plans have in common only if they are the same.
    pub fn digest(&self) -> u64 {
        digest_of(self)
    }
}

impl Plan {
    /// The plan as plain values.
    ///
    /// # Errors
    /// None of a plan that was made.
    pub fn record(&self) -> Result<PlanRecord, Error> {
        let (analysis, Laws { area, opacity, anisotropy, area_reference, anisotropy_reference, coarser }) =
            (&self.analysis, self.settings.laws);
        let target = |target: TargetReport| PlannedTarget {
            fitted: Single(target.fitted),
            encodings: target.encodings,
            trials: target.trials,
            without_finetune: target.without_finetune,
            without_codebook: target.without_codebook,
        };
        Ok(PlanRecord {
            settings: named(&self.asked),
            gaussians: analysis.counts.clone(),
            frame_digests: self.frame_digests.clone(),
            steps: PlannedSteps::from(self.settings.steps),
            laws: [area, opacity, anisotropy, area_reference, anisotropy_reference].map(Single),
            coarser,
            stands_alone: self.stands_alone,
            sequence_parameters: analysis.parameters.to_bytes()?,
            level: analysis.level,
            largest: u32::try_from(analysis.largest).unwrap_or(u32::MAX),
            source_sh_degree: analysis.source_sh_degree,
            axes_trial: analysis.axes_trial.map(Single::from),
            bounds: analysis.bounds.map(|corners| corners.map(|corner| corner.map(Single))),
            network: self.network.as_ref().map(Network::to_bytes).transpose()?,
            target: self.target.map(target),
        })
    }

    /// The plan of a record. `settings` shall be those that it was made with.
    ///
    /// # Errors
    /// Other settings, another version of the encoder, a record that is none of a plan.
    pub fn from_record(record: &PlanRecord, settings: &Settings) -> Result<Self, Error> {
        check(settings)?;
        refuse_pruning(settings)?;
        same_settings(record, settings)?;
        let [area, opacity, anisotropy, area_reference, anisotropy_reference] = record.laws.map(|law| law.0);
        let coarser = record.coarser;
        let laws = Laws { area, opacity, anisotropy, area_reference, anisotropy_reference, coarser };
        let settled = Settings { steps: record.steps.into(), laws, ..settings.clone() };
        let settled = match record.target {
            Some(target) => target.settled(settled),
            None => settled,
        };
        let settled = if record.stands_alone { settled.alone() } else { settled };
        let target = |target: PlannedTarget| TargetReport {
            fitted: target.fitted.0,
            encodings: target.encodings,
            trials: target.trials,
            without_finetune: target.without_finetune,
            without_codebook: target.without_codebook,
        };
        Ok(Self {
            asked: settings.clone(),
            analysis: analysis(record, &settled)?,
            network: network(record, settings)?,
            settings: settled,
            ranking: None,
            target: record.target.map(target),
            tried: None,
            stands_alone: record.stands_alone,
            frame_digests: record.frame_digests.clone(),
        })
    }
}

fn analysis(record: &PlanRecord, settled: &Settings) -> Result<Analysis, Error> {
    let parameters = SequenceParameters::parse_payload(&record.sequence_parameters, 0, settled.profile());
    let parameters = parameters.map_err(|_| Error::Plan("its sequence parameters are none"))?;
    let frames = parameters.frame_count as usize;
    if [record.gaussians.len(), record.frame_digests.len()] != [frames; 2] || frames == 0 {
        return Err(Error::Plan("it has not as many frames as it says"));
    }
    if !Limits::LEVELS.contains(&record.level) {
        return Err(Error::Plan("there is no such level"));
    }
    Ok(Analysis {
        parameters,
        level: record.level,
        largest: record.largest as usize,
        source_sh_degree: record.source_sh_degree,
        axes_trial: record.axes_trial.map(f64::from),
        bounds: record.bounds.map(|corners| corners.map(|corner| corner.map(|value| value.0))),
        counts: record.gaussians.clone(),
    })
}

fn network(record: &PlanRecord, settings: &Settings) -> Result<Option<Network>, Error> {
    let parse = |bytes: &Vec<u8>| Network::parse(bytes, 0).map_err(|_| Error::Plan("its network is none"));
    let network = record.network.as_ref().map(parse).transpose()?;
    match &settings.network {
        Some(NetworkSource::Given(given)) if network.as_ref().is_some_and(|planned| *planned != **given) => {
            let (found, planned) = ("another file".to_owned(), "the network that it carries".to_owned());
            Err(Error::OtherSetting { name: "network", found, planned })
        }
        _ => Ok(network),
    }
}

/// The settings of a record are these.
fn same_settings(record: &PlanRecord, settings: &Settings) -> Result<(), Error> {
    for (name, found) in described(settings) {
        let planned = record.settings.get(name).ok_or(Error::Plan("it lacks a setting"))?;
        if *planned != found {
            return Err(Error::OtherSetting { name, found, planned: planned.clone() });
        }
    }
    Ok(())
}

fn named(settings: &Settings) -> BTreeMap<String, String> {
    described(settings).into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// Everything that the bytes of a stream follow from, beside its frames.
pub(crate) fn described(settings: &Settings) -> Vec<(&'static str, String)> {
    let Settings {
        preset,
        steps,
        laws,
        psnr,
        size,
        verify,
        drop_invalid,
        gop,
        structure,
        anchor,
        spatial_layers,
        predictors,
        predictor_choice,
        neighbours,
        network,
        refinements,
        sh_degree,
        sh,
        keep_invisible,
        prune,
        importance,
        cameras,
        fidelity,
        tolerance,
        finetune,
        tools,
        block_log2,
        ticks,
        description,
        // How much is coded at once changes nothing.
        gop_memory: _,
        max_memory: _,
    } = settings;
    let network = match network {
        Some(NetworkSource::Given(_)) => "given".to_owned(),
        other => format!("{other:?}"),
    };
    let cameras = match cameras.len() {
        0 => "none".to_owned(),
        count => format!("{count}, digest {:016x}", digest_of(cameras)),
    };
    let finetune = finetune.as_ref().map_or("none".to_owned(), |finetune| {
        format!("{} iterations, digest {:016x}", finetune.iterations, digest_of(finetune))
    });
    let psnr = psnr.map_or("none".to_owned(), |decibels| format!("{decibels} dB"));
    vec![
        ("encoder", env!("CARGO_PKG_VERSION").to_owned()),
        ("preset", format!("{preset:?}")),
        ("psnr", psnr),
        ("size", format!("{size:?}")),
        ("finetune", finetune),
        ("steps", format!("{steps:?}")),
        ("laws", format!("{laws:?}")),
        ("verify", verify.to_string()),
        ("drop_invalid", drop_invalid.to_string()),
        ("gop", gop.to_string()),
        ("structure", format!("{structure:?}")),
        ("anchor", format!("{anchor:?}")),
        ("spatial_layers", spatial_layers.to_string()),
        ("predictors", format!("{predictors:?}")),
        ("predictor_choice", format!("{predictor_choice:?}")),
        ("neighbours", neighbours.to_string()),
        ("network", network),
        ("refinements", format!("{refinements:?}")),
        ("sh_degree", format!("{sh_degree:?}")),
        ("sh", format!("{sh:?}")),
        ("keep_invisible", keep_invisible.to_string()),
        ("prune", format!("{prune:?}")),
        ("importance", format!("{importance:?}")),
        ("cameras", cameras),
        ("fidelity", format!("{fidelity:?}")),
        ("tolerance", tolerance.to_string()),
        ("tools", format!("{tools:?}")),
        ("block_log2", block_log2.to_string()),
        ("ticks", format!("{ticks:?}")),
        ("description", format!("{description:?}")),
    ]
}

impl From<Steps> for PlannedSteps {
    fn from(Steps { position_bits, log_scale, rotation, opacity, dc, sh }: Steps) -> Self {
        let [position_bits, log_scale, rotation, opacity, dc, sh] =
            [position_bits, log_scale, rotation, opacity, dc, sh].map(Single);
        Self { position_bits, log_scale, rotation, opacity, dc, sh }
    }
}

impl From<PlannedSteps> for Steps {
    fn from(PlannedSteps { position_bits, log_scale, rotation, opacity, dc, sh }: PlannedSteps) -> Self {
        let [position_bits, log_scale, rotation, opacity, dc, sh] =
            [position_bits, log_scale, rotation, opacity, dc, sh].map(|step| step.0);
        Self { position_bits, log_scale, rotation, opacity, dc, sh }
    }
}
