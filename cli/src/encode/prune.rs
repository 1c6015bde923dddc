//! The option that leaves out what pictures hardly miss.

use super::choice::Choice;
use super::{PSNR_ALLOWED, parse_psnr};
use crate::failure::Failure;
use clap::Args;
use splatstream_chart::numbers::{grouped, percent};
use splatstream_encoder::{Report, Settings};

/// How much better pictures without some Gaussians are than those of the stream, decibels, where nothing is said: a sixth of
/// the squared error of the view that misses them most.
const ABOVE: f32 = 8.0;

/// How much better they must be: with less, no steps of the rest are fine enough.
const LEAST_ABOVE: f32 = 3.0;

/// Which Gaussians are left out.
#[derive(Args, Debug)]
pub(super) struct PruneArgs {
    /// Leave out the Gaussians that pictures miss least: as many as can go until pictures without them fall to a PSNR of DB
    /// decibels, 20 to 90 and 3 above the quality at least, against pictures with them. That holds in the worst of eight views from near and far, or near
    /// --cameras, that look past the middle of the scene as well. What no view shows, as from inside of something
    /// closed, may be left out. Without a number DB is 8 more than the quality. The quality of the stream stays that against
    /// all Gaussians. Only for frames that each stand for themselves.
    #[arg(long, value_name = "DB", num_args = 0..=1, default_missing_value = "auto", value_parser = parse_threshold)]
    prune: Option<Threshold>,
}

/// The PSNR of pictures without what is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Threshold {
    /// So much above that of the stream.
    Above(f32),
    /// As it stands.
    Decibels(f32),
}

fn parse_threshold(text: &str) -> Result<Threshold, String> {
    if text == "auto" {
        return Ok(Threshold::Above(ABOVE));
    }
    let decibels = parse_psnr(text).map_err(|error| format!("{error}; without one put --prune last"))?;
    Ok(Threshold::Decibels(decibels))
}

impl PruneArgs {
    /// The threshold for a stream whose pictures shall have a PSNR.
    pub(super) fn threshold(&self, psnr: Option<f32>) -> Result<Option<f32>, Failure> {
        let decibels = match (self.prune, psnr) {
            (None, _) => return Ok(None),
            (Some(Threshold::Decibels(decibels)), _) => decibels,
            (Some(Threshold::Above(above)), Some(psnr)) => (psnr + above).min(*PSNR_ALLOWED.end()),
            (Some(Threshold::Above(_)), None) => {
                return Err(Failure::Usage(
                    "--prune needs a PSNR where a size is asked for, as --prune 58".into(),
                ));
            }
        };
        match psnr {
            Some(psnr) if decibels < psnr + LEAST_ABOVE => Err(too_near(decibels, psnr)),
            _ => Ok(Some(decibels)),
        }
    }
}

/// The failure of a threshold that leaves no room for the quality of the stream.
fn too_near(decibels: f32, psnr: f32) -> Failure {
    let least = psnr + LEAST_ABOVE;
    let higher =
        if PSNR_ALLOWED.contains(&least) { format!("--prune {least} or more, or ") } else { String::new() };
    Failure::Usage(format!(
        "--prune {decibels} leaves no room for a quality of {psnr} dB, which counts what is left out as well: give \
         {higher}a lower --psnr"
    ))
}

/// What was left out, what that costs, and what it saves.
pub(super) fn pruned(report: &Report, settings: &Settings) -> Option<Choice> {
    let least = settings.prune?;
    let gaussians: u64 = report.pruned.iter().map(|frame| u64::from(frame.gaussians)).sum();
    let bytes: u64 = report.pruned.iter().map(|frame| frame.bytes).sum();
    let all = report.gaussians + report.invisible + gaussians;
    let choice = format!("{} left out ({:.2} %)", grouped(gaussians), percent(gaussians, all));
    let worst = report.pruned.iter().filter_map(|frame| frame.psnr).reduce(f64::min);
    let Some(worst) = worst else {
        return Some(Choice::new(
            "pruned",
            choice,
            format!("pictures without any would fall below {least} dB"),
        ));
    };
    let lost = report.pictures.as_ref().and_then(|pictures| pictures.psnr()).map(|psnr| {
        // Of the squared error of the stream this part would not be there.
        let part = 10.0_f64.powf(0.1 * (psnr - worst)).min(0.99);
        format!(", {:.2} dB of the {psnr:.2} dB of the stream at most", -10.0 * (1.0 - part).log10())
    });
    let why = format!(
        "pictures without them have {worst:.1} dB against pictures with them in the worst view{}; about {} bytes \
         fewer, before steps become finer for what is lost",
        lost.unwrap_or_default(),
        grouped(bytes)
    );
    Some(Choice::new("pruned", choice, why))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_threshold_is_given_or_follows_from_the_quality() {
        let args = |text| PruneArgs { prune: Some(parse_threshold(text).unwrap()) };
        assert_eq!(args("auto").threshold(Some(50.0)).unwrap(), Some(58.0));
        assert_eq!(args("60").threshold(None).unwrap(), Some(60.0));
        assert_eq!(args("auto").threshold(Some(87.0)).unwrap(), Some(90.0));
        assert!(args("auto").threshold(None).is_err());
        for (text, advice) in [("auto", "give a lower --psnr"), ("90", "give a lower --psnr")] {
            let refused = args(text).threshold(Some(88.0)).unwrap_err().to_string();
            assert!(refused.contains(advice), "{refused}");
        }
        assert!(parse_threshold("garden.ply").is_err() && parse_threshold("95").is_err());
    }
}
