//! The record of a vector, `vector.json`: what its stream tests and what a decoder shall make of it.
//!
//! The fields are those of `conformance/schema/vector.schema.json`. An unknown field is an error: a runner that ignores
//! part of an expectation passes decoders that violate it.

use crate::attribute::Attribute;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use splatstream_format::Class;
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

/// What `schema` of a record says.
pub const SCHEMA: &str = "splatstream-vector/1";

/// A vector without its stream.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vector {
    /// [`SCHEMA`].
    pub schema: String,
    /// Unique in the suite; the folder of the vector.
    pub name: String,
    /// The folder above it.
    pub area: String,
    /// The folder above that.
    pub kind: Kind,
    /// What it tests, in one sentence.
    pub purpose: String,
    /// What to read in the specification.
    pub clauses: Vec<String>,
    /// Requirements that it tests.
    #[serde(default)]
    pub requirements: Vec<String>,
    /// What a decoder has to support to decode it.
    #[serde(default)]
    pub features: Vec<String>,
    /// Profile that the stream states, annex A.
    pub profile: u8,
    /// Level that the stream states, annex A.
    pub level: u8,
    /// Of the vector.
    pub license: String,
    /// Length of the stream.
    pub bytes: u64,
    /// SHA-256 of the stream, hexadecimal.
    pub sha256: String,
    /// What a decoder shall answer.
    pub expect: Verdict,
    /// Offset of the gop_header at which decoding starts (B.3); none for the whole stream.
    pub inside: Option<u64>,
    /// Rejections that are right: for kind either instead of accepting, for kind invalid instead of the one in `expect`,
    /// because the unit has several faults.
    #[serde(default)]
    pub acceptable: Vec<Rejection>,
    /// The decoder is asked for every proper prefix of the stream.
    pub sweep: Option<Sweep>,
    /// Frames as they are shown at some operating point; points refer to them by index.
    #[serde(default)]
    pub states: Vec<State>,
    /// Operating points at which the stream is decoded. None: everything, in full.
    #[serde(default)]
    pub points: Vec<Point>,
    /// The units of the stream, in order.
    #[serde(default)]
    pub units: Vec<UnitRecord>,
    /// The vector that this one was made from by `patch`.
    pub parent: Option<String>,
    /// Changes to the bytes of the parent.
    pub patch: Option<Vec<Patch>>,
    /// What the patch breaks.
    pub fault: Option<String>,
    /// How it was generated.
    pub generator: Option<Generator>,
}

/// What a vector is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A stream that every decoder of its profile and level accepts.
    Valid,
    /// A stream with one fault.
    Invalid,
    /// A stream that may be accepted or rejected.
    Either,
}

/// Accepted, or why not.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Verdict {
    /// Whether the stream is accepted.
    pub outcome: Acceptance,
    /// Class of clause 9.1, of a rejection.
    #[serde(default, deserialize_with = "class_of_name")]
    pub class: Option<Class>,
    /// Code of clause 9.2.
    pub code: Option<String>,
    /// The broken clause.
    pub clause: Option<String>,
    /// The earliest byte at which the fault can be known.
    pub byte: Option<u64>,
}

/// A rejection by class and code.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rejection {
    /// Class of clause 9.1.
    #[serde(deserialize_with = "known_class")]
    pub class: Class,
    /// Code of clause 9.2.
    pub code: String,
}

/// A stream that is cut at every byte.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Where it is cut.
    pub cut: Cut,
    /// What is shown of its prefixes.
    pub steps: Vec<Step>,
}

/// Where a stream is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum Cut {
    /// After 0 bytes, after 1 byte, and so on up to the last byte but one.
    #[serde(rename = "every byte")]
    EveryByte,
}

/// What is shown of the prefixes of this length and longer ones, up to the next step.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Length of the first of these prefixes.
    pub bytes: u64,
    /// The frames that are output: indices into `states`.
    pub states: Vec<usize>,
}

fn class_of_name<'d, D: Deserializer<'d>>(deserializer: D) -> Result<Option<Class>, D::Error> {
    known_class(deserializer).map(Some)
}

fn known_class<'d, D: Deserializer<'d>>(deserializer: D) -> Result<Class, D::Error> {
    let name = String::deserialize(deserializer)?;
    let class = Class::ALL.into_iter().find(|class| class.name() == name);
    class.ok_or_else(|| D::Error::custom(format!("'{name}' is not a class of clause 9.1")))
}

/// Whether a stream is accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Acceptance {
    /// Exit code 0.
    Accept,
    /// The exit code of a class.
    Reject,
}

/// A frame as it is shown.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Display index.
    pub frame: u32,
    /// I, P or B.
    #[serde(rename = "type")]
    pub frame_type: Option<String>,
    /// Gaussians in the frame.
    pub gaussians: u64,
    /// Gaussians in its exact lists (7.8.2).
    pub exact: Option<u64>,
    /// Gaussians in its carried lists (7.8.1).
    pub carried: Option<u64>,
    /// SHA-256 of the planes of each attribute.
    pub planes: BTreeMap<Attribute, String>,
    /// SHA-256 of the output of 7.10, f32, plane after plane: position, log-scale, opacity, rotation w x y z, dc, sh.
    pub f32: Option<String>,
}

/// The stream decoded at an operating point.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// As 7.11 writes it.
    pub op: String,
    /// What is shown.
    pub mode: Mode,
    /// The frames that are output: indices into `states`.
    pub states: Option<Vec<usize>>,
    /// SHA-256 of the extraction (7.11).
    pub extraction: Option<String>,
    /// Display indices of lost frames that are not output, as ranges with both ends included (SS-ER-005).
    #[serde(default)]
    pub lost: Vec<[u32; 2]>,
    /// Where it differs from `expect` of the vector: errors in units that do not belong are not found.
    pub expect: Option<Verdict>,
}

/// How a decoder starts, and what it shows of P and B frames (7.8.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// The exact and the carried Gaussians.
    Full,
    /// Only the exact Gaussians of frames that have some.
    Subset,
    /// Like full, but the input starts inside a stream (B.3).
    Inside,
}

/// Where a unit stands.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitRecord {
    /// Absolute offset of its header.
    pub at: u64,
    /// Header and payload.
    pub bytes: u64,
    /// Name of its type, clause 6.3.
    #[serde(rename = "type")]
    pub unit_type: String,
    /// `frame` of its header.
    pub frame: Option<u32>,
    /// `spatial_layer` of its header.
    pub spatial_layer: Option<u8>,
    /// `temporal_layer` of its header.
    pub temporal_layer: Option<u8>,
    /// `refinement` of its header.
    pub refinement: Option<u8>,
    /// XXH64 over the final states of its entropy decoder and the values decoded, 16 hexadecimal digits.
    pub entropy: Option<String>,
}

/// A change to the bytes of the parent.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Patch {
    /// Offset in the parent.
    pub at: u64,
    /// Number of bytes removed.
    pub remove: u64,
    /// Bytes inserted, hexadecimal.
    pub insert: String,
}

/// How a vector was generated.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Generator {
    /// The part of the generator.
    pub recipe: String,
    /// Seed of its random numbers.
    pub seed: Option<u64>,
}

impl Verdict {
    /// The exit code that says so.
    pub fn exit_code(&self) -> i32 {
        self.class.map_or(0, |class| class.exit_code().into())
    }

    /// Whether it has a class if and only if it is a rejection.
    pub(crate) fn is_consistent(&self) -> bool {
        (self.outcome == Acceptance::Reject) == self.class.is_some()
    }
}

impl From<&Rejection> for Verdict {
    fn from(rejection: &Rejection) -> Self {
        Self {
            outcome: Acceptance::Reject,
            class: Some(rejection.class),
            code: Some(rejection.code.clone()),
            clause: None,
            byte: None,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.class, &self.code) {
            (None, _) => f.write_str("accept"),
            (Some(class), None) => f.write_str(class.name()),
            (Some(class), Some(code)) => write!(f, "{} {code}", class.name()),
        }
    }
}

impl Kind {
    /// The word in records and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Valid => "valid",
            Self::Invalid => "invalid",
            Self::Either => "either",
        }
    }
}

impl Mode {
    /// All modes.
    pub const ALL: [Self; 3] = [Self::Full, Self::Subset, Self::Inside];

    /// The word in records and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Subset => "subset",
            Self::Inside => "inside",
        }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Mode {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|mode| mode.name() == text)
            .ok_or_else(|| format!("'{text}' is not a mode; write full, subset or inside"))
    }
}
