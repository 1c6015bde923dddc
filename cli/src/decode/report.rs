//! What `decode` tells: figures, frame by frame what is there, and what is not.

use crate::completeness::{self, Complete};
use crate::failure::StreamFault;
use crate::numbers::{grouped, hex_digest};
use crate::seek::Seek;
use serde::Serialize;
use splatstream_decoder::process::DecodedFrame;
use splatstream_format::syntax::{FrameType, SequenceParameters};
use std::path::PathBuf;

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Report {
    pub(super) output: Option<PathBuf>,
    pub(super) frames: u32,
    pub(super) gaussians: u64,
    pub(super) bytes: u64,
    pub(super) seconds: f64,
    pub(super) seconds_total: f64,
    pub(super) gaussians_per_second: f64,
    pub(super) verified: bool,
    pub(super) subset: bool,
    pub(super) seek: Option<Seek>,
    #[serde(flatten)]
    pub(super) shown: Shown,
    pub(super) error: Option<StreamFault>,
    pub(super) complete: Option<Vec<Complete>>,
}

/// The frames asked for; lists have a place a frame.
#[derive(Default, Serialize)]
pub(super) struct Shown {
    numbers: Vec<u32>,
    types: Vec<&'static str>,
    pub(super) digests: Vec<Option<String>>,
    carried_digests: Vec<Option<String>>,
    refinements: Vec<u8>,
    spatial_layers: Vec<u8>,
    carried: Vec<u64>,
    frozen: Vec<Option<u32>>,
    lost: Vec<Lost>,
}

/// A frame that is not all there.
#[derive(Serialize)]
struct Lost {
    frame: u32,
    #[serde(rename = "type")]
    kind: &'static str,
    /// Refinements that are there.
    refinements: u8,
    /// What is shown, in words.
    shows: String,
    #[serde(flatten)]
    fault: StreamFault,
}

impl Shown {
    /// Takes note of a frame.
    pub(super) fn take(&mut self, sequence: &SequenceParameters, frame: &DecodedFrame) {
        self.numbers.push(frame.number);
        self.types.push(frame.frame_type.name());
        self.digests.push(frame.digest.map(hex_digest));
        self.carried_digests.push(frame.carried_digest.map(hex_digest));
        self.refinements.push(frame.refinements);
        self.spatial_layers.push(frame.spatial_layer);
        self.carried.push(frame.carried as u64);
        self.frozen.push(frame.frozen);
        for error in frame.lost.into_iter().chain(frame.carried_fault) {
            self.lost.push(Lost {
                frame: frame.number,
                kind: frame.frame_type.name(),
                refinements: frame.refinements,
                shows: shows(sequence, frame),
                fault: StreamFault::from(error),
            });
        }
    }

    /// The last frame, in words; none if there is no frame.
    fn last(&self) -> Option<String> {
        let (number, kind) = (self.numbers.last()?, self.types.last()?);
        Some(format!("the last frame, {number} ({kind}), has {} refinements", self.refinements.last()?))
    }

    /// How many frames there are of each type, where not all are intra frames.
    fn types(&self) -> String {
        let count = |name| self.types.iter().filter(|&&kind| kind == name).count();
        let types = [FrameType::Intra, FrameType::Predicted, FrameType::Enhancement].map(FrameType::name);
        if types.into_iter().skip(1).all(|name| count(name) == 0) {
            return String::new();
        }
        let there = types.into_iter().filter(|name| count(name) > 0);
        let counts: Vec<String> = there.map(|name| format!("{} {name}", count(name))).collect();
        format!(" ({})", counts.join(", "))
    }
}

/// What a frame that is not all there shows, clause 7.20.
fn shows(sequence: &SequenceParameters, frame: &DecodedFrame) -> String {
    if frame.planes.is_empty() {
        return "shows nothing".to_owned();
    }
    if let Some(number) = frame.frozen {
        return format!("is frozen: shows frame {number} again");
    }
    let mut text = format!("shows {} of {} refinements", frame.refinements, sequence.refinement_count);
    if frame.spatial_layer.saturating_add(1) < sequence.spatial_layer_count
        && frame.frame_type == FrameType::Intra
    {
        text += &format!(" of spatial layer {}", frame.spatial_layer);
    }
    if frame.carried > 0 {
        text +=
            &format!(" and {} Gaussians carried over from the intra frame", grouped(frame.carried as u64));
    }
    text
}

impl Report {
    /// The report for people.
    pub(super) fn text(&self) -> String {
        let place = match &self.output {
            Some(path) => path.display().to_string(),
            None => "nothing written (--dry-run)".to_owned(),
        };
        let digests = self.digests();
        let mut text = format!(
            "{place}\n  frames       {}{}\n  Gaussians    {}{}\n  decoding     {:.3} s, {} Gaussians a second\n  \
             in all       {:.3} s\n  digests      {digests}\n",
            grouped(self.frames.into()),
            self.shown.types(),
            grouped(self.gaussians),
            self.carried(),
            self.seconds,
            grouped(self.gaussians_per_second as u64),
            self.seconds_total,
        );
        if let Some(Seek { frame, byte }) = self.seek {
            text += &format!("  started      at frame {frame}, byte {byte:#x}, by the index\n");
        }
        for lost in &self.shown.lost {
            text += &format!("  frame {} ({}) {}; {}\n", lost.frame, lost.kind, lost.shows, lost.fault);
        }
        if let (Some(_), Some(last)) = (&self.error, self.shown.last()) {
            text += &format!("  stopped early; {last}\n");
        }
        text + &self.complete.as_deref().map(completeness::text).unwrap_or_default()
    }

    fn digests(&self) -> String {
        let wrong = self.shown.lost.iter().filter(|lost| lost.fault.code == "DIGEST").count();
        match wrong {
            _ if !self.verified => "not compared (--no-verify)".to_owned(),
            0 => "agree with the frames shown".to_owned(),
            wrong => format!("{wrong} wrong, as said below; the others agree with the frames shown"),
        }
    }

    fn carried(&self) -> String {
        match self.shown.carried.iter().sum::<u64>() {
            0 if self.subset => ", those of the operating point alone (--subset)".to_owned(),
            0 => String::new(),
            carried => format!(", {} of them carried over from intra frames", grouped(carried)),
        }
    }
}
