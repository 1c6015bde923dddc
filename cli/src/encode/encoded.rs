//! What is said of a stream that was written.

use super::choice::Choice;
use super::choices::choices;
use super::finetune::Fitted;
use super::pictures::{Goal, Pictures};
use super::shards::ShardReport;
use super::warnings::{Warning, warnings};
use crate::numbers::hex_digest;
use serde::Serialize;
use splatstream_chart::numbers::{bits_per_gaussian, grouped};
use splatstream_encoder::{Report, Settings};
use std::path::{Path, PathBuf};

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Encoded {
    pub(super) output: PathBuf,
    /// Of the stream.
    pub(super) bytes: u64,
    /// Of the page that holds it; none if a stream was written.
    pub(super) page_bytes: Option<u64>,
    /// What it is a part of; none if it is a whole sequence.
    pub(super) shard: Option<ShardReport>,
    pub(super) frames: u32,
    pub(super) gaussians: u64,
    pub(super) bpg: f64,
    pub(super) seconds: f64,
    pub(super) invisible: u64,
    /// Gaussians left out because of values that are not finite.
    pub(super) dropped: u64,
    pub(super) chosen: Vec<Choice>,
    #[serde(flatten)]
    pub(super) pictures: Pictures,
    /// What fitting frames to pictures has done; empty where it was not asked for.
    pub(super) finetuned: Vec<Fitted>,
    pub(super) warnings: Vec<Warning>,
    pub(super) digests: Vec<String>,
}

impl Encoded {
    /// What is known of a stream once it is whole.
    pub(super) fn new(
        out: &Path,
        report: &Report,
        settings: &Settings,
        name_of: &dyn Fn(u32) -> String,
        seconds: f64,
    ) -> Self {
        Self {
            output: out.to_path_buf(),
            bytes: report.bytes,
            page_bytes: None,
            shard: None,
            frames: report.frames,
            gaussians: report.gaussians,
            bpg: bits_per_gaussian(report.bytes, report.gaussians),
            seconds,
            invisible: report.invisible,
            dropped: report.dropped.iter().map(|dropped| u64::from(dropped.gaussians)).sum(),
            chosen: choices(report, settings),
            pictures: Pictures::of(report, settings, Goal::of(settings)),
            finetuned: Fitted::of(report),
            warnings: warnings(report, settings, name_of),
            digests: report.digests.iter().copied().map(hex_digest).collect(),
        }
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        let chosen: String = self.chosen.iter().map(Choice::text).collect();
        let page =
            self.page_bytes.map(|bytes| format!(", in a page of {}", grouped(bytes))).unwrap_or_default();
        let shard = self.shard.as_ref().map(ShardReport::text).unwrap_or_default();
        format!(
            "{}\n{shard}  frames             {}\n  Gaussians          {}\n  bytes              {}{page}\n  \
             bits per Gaussian  {:.2}\n  seconds            {:.2}\n{}{}chosen\n{chosen}",
            self.output.display(),
            grouped(self.frames.into()),
            grouped(self.gaussians),
            grouped(self.bytes),
            self.bpg,
            self.seconds,
            self.pictures.text(),
            Fitted::text(&self.finetuned),
        )
    }
}
