//! What `decode` reports: figures, frame by frame what is there, and what is not.

use super::loss::Loss;
use crate::encode::warnings::Warning;
use crate::failure::{StreamFault, faults_text};
use crate::numbers::{counted, hex_digest};
use crate::seek::Seek;
use serde::Serialize;
use splatstream_chart::numbers::grouped;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_decoder::process::DecodedFrame;
use splatstream_format::Error;
use splatstream_format::syntax::{FrameType, SequenceParameters};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// What `--json` prints.
#[derive(Serialize)]
pub(super) struct Report {
    pub(super) output: Option<PathBuf>,
    /// Whether nothing is written because frames of an earlier run are there.
    #[serde(skip)]
    pub(super) keeps_earlier: bool,
    pub(super) frames: u32,
    /// Frames that the stream says it has.
    pub(super) frames_in_stream: Option<u32>,
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
    #[serde(flatten)]
    pub(super) loss: Loss,
    pub(super) reduced: Vec<Reduced>,
    pub(super) complete: bool,
    /// What the format of the files cannot keep.
    pub(super) warnings: Vec<Warning>,
}

/// The frames asked for; each list has an entry per frame.
#[derive(Default, Serialize)]
pub(super) struct Shown {
    numbers: Vec<u32>,
    types: Vec<&'static str>,
    pub(super) digests: Vec<Option<String>>,
    carried_digests: Vec<Option<String>>,
    levels: Vec<u8>,
    spatial_layers: Vec<u8>,
    carried: Vec<u64>,
    /// What is known of each frame for the list of those that are reduced.
    #[serde(skip)]
    states: Vec<State>,
}

/// Whether a frame is all there, and what it shows in words.
struct State {
    is_intra: bool,
    is_reduced: bool,
    /// The highest spatial layer of the sequence.
    top: u8,
    error: Option<Error>,
    shows: String,
}

/// A frame that is not all there.
#[derive(Serialize)]
pub(super) struct Reduced {
    frame: u32,
    #[serde(rename = "type")]
    kind: &'static str,
    /// Exact lists that are shown.
    level: u8,
    /// What is shown, in words.
    shows: String,
    /// What is wrong with the frame itself; none if a unit is missing, or wrong in a frame that it refers to.
    error: Option<StreamFault>,
}

impl Shown {
    /// Takes note of a frame.
    pub(super) fn take(&mut self, sequence: &SequenceParameters, frame: &DecodedFrame) {
        self.numbers.push(frame.index);
        self.types.push(frame.frame_type.name());
        self.digests.push(frame.digest.map(hex_digest));
        self.carried_digests.push(frame.carried_digest.map(hex_digest));
        self.levels.push(frame.level);
        self.spatial_layers.push(frame.spatial_layer);
        self.carried.push(frame.carried as u64);
        self.states.push(State {
            is_intra: frame.frame_type == FrameType::Intra,
            is_reduced: frame.is_reduced,
            top: sequence.spatial_layer_count.saturating_sub(1),
            error: frame.error,
            shows: shows(sequence, frame),
        });
    }

    /// Display indices of the frames.
    pub(super) fn indices(&self) -> BTreeSet<u32> {
        self.numbers.iter().copied().collect()
    }

    /// How many frames there are.
    pub(super) fn len(&self) -> usize {
        self.numbers.len()
    }

    /// The most that frames show, up to an operating point.
    pub(super) fn most(&self, point: OperatingPoint) -> OperatingPoint {
        let most = |values: &[u8]| values.iter().max().copied().unwrap_or(0);
        let refinement = most(&self.levels).saturating_sub(1).min(point.refinement);
        OperatingPoint { spatial: most(&self.spatial_layers), refinement, ..point }
    }

    /// The frames of a stream with errors that are not all there: the decoder knows of it, or they show less than an operating
    /// point has, or the stream lacks increments of them (`short`). Predicted frames have refinements in the highest spatial layer alone.
    pub(super) fn reduced(&self, point: OperatingPoint, short: &BTreeSet<u32>) -> Vec<Reduced> {
        let is_reduced = |&frame: &usize| {
            let State { is_intra, is_reduced, top, .. } = self.states[frame];
            let is_less = self.levels[frame] <= point.refinement && (is_intra || point.spatial >= top)
                || is_intra && self.spatial_layers[frame] < point.spatial;
            is_reduced || is_less || short.contains(&self.numbers[frame])
        };
        let one = |frame: usize| Reduced {
            frame: self.numbers[frame],
            kind: self.types[frame],
            level: self.levels[frame],
            shows: self.states[frame].shows.clone(),
            error: self.states[frame].error.map(StreamFault::from),
        };
        (0..self.len()).filter(is_reduced).map(one).collect()
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

/// What a frame shows, clause 7.20.
fn shows(sequence: &SequenceParameters, frame: &DecodedFrame) -> String {
    if frame.is_lost {
        return "is lost: shows nothing".to_owned();
    }
    let mut text = format!("shows {} of {} refinements", frame.level, sequence.refinement_count);
    if frame.spatial_layer.saturating_add(1) < sequence.spatial_layer_count
        && frame.frame_type == FrameType::Intra
    {
        text += &format!(" of spatial layer {}", frame.spatial_layer);
    }
    if frame.carried > 0 {
        text += &format!(" and {} carried from the I frame", counted(frame.carried as u64, "Gaussian"));
    }
    text
}

impl Report {
    /// The stream has an error, and frames of an earlier run stay.
    pub(super) fn keep_earlier(&mut self) {
        (self.output, self.keeps_earlier) = (None, true);
    }

    /// The report for people.
    pub(super) fn text(&self) -> String {
        let output = match &self.output {
            Some(path) => path.display().to_string(),
            None if self.keeps_earlier => "nothing written: frames of an earlier run stay".to_owned(),
            None => "nothing written (--dry-run)".to_owned(),
        };
        let of_stream = match self.frames_in_stream {
            Some(count) if count != self.frames => format!(" of {}", grouped(count.into())),
            _ => String::new(),
        };
        let mut text = format!(
            "{output}\n  frames       {}{of_stream}{}\n  Gaussians    {}{}\n  \
             decoding     {:.3} s, {} Gaussians per second\n  in all       {:.3} s\n  digests      {}\n",
            grouped(self.frames.into()),
            self.shown.types(),
            grouped(self.gaussians),
            self.carried(),
            self.seconds,
            grouped(self.gaussians_per_second as u64),
            self.seconds_total,
            self.digests(),
        );
        if let Some(Seek { frame, byte }) = self.seek {
            text += &format!("  started      at frame {frame}, byte {byte:#x}, by the index\n");
        }
        text += &faults_text(&self.loss.errors);
        if let Some(frames) = self.loss.frames() {
            text += &format!("  lost         {frames}\n");
        }
        for Reduced { frame, kind, shows, .. } in &self.reduced {
            text += &format!("  frame {frame} ({kind}) {shows}\n");
        }
        text
    }

    fn digests(&self) -> String {
        let wrong = self.loss.errors.iter().filter(|fault| fault.code == "DIGEST").count();
        match wrong {
            _ if !self.verified => "not compared (--no-verify)".to_owned(),
            0 => "agree with the frames shown".to_owned(),
            wrong => format!("{wrong} wrong; the others agree with the frames shown"),
        }
    }

    fn carried(&self) -> String {
        match self.shown.carried.iter().sum::<u64>() {
            0 if self.subset => ", those of the operating point alone (--subset)".to_owned(),
            0 => String::new(),
            carried => format!(", {} of them carried from I frames", grouped(carried)),
        }
    }
}
