//! C.8: the manifest, which says what every range of bytes is and what it hashes to.
//!
//! Servers are not trusted: [`Manifest::parse`] refuses what cannot be true before anybody acts on it.

mod check;
mod ladder;

use serde::{Deserialize, Serialize};
use std::fmt;
use std::hash::Hasher;
use xxhash_rust::xxh64::Xxh64;

/// A manifest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`Manifest::FORMAT`].
    pub format: String,
    /// [`Manifest::VERSION`].
    pub version: u32,
    /// The stream that was packaged.
    pub stream: StreamInfo,
    /// What a subsegment is: `gop` or `frame`.
    pub layout: String,
    /// C.9: of a live package.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub live: Option<LiveInfo>,
    /// In order of dependence.
    pub representations: Vec<RepresentationInfo>,
    /// In order.
    pub gops: Vec<GopInfo>,
    /// What operating points look like, where that was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<Vec<QualityInfo>>,
}

/// A stream.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StreamInfo {
    /// The version of the specification.
    pub specification: String,
    /// Annex A: 0 or 1.
    pub profile: u8,
    /// Annex A: 1 to 4.
    pub level: u8,
    /// Bytes of the stream; none while it grows.
    pub bytes: Option<u64>,
    /// Of the stream; none while it grows.
    pub digest: Option<String>,
    /// Frames up to the end of the last GOP, up to 2^32.
    pub frames: u64,
    /// Degree of the spherical harmonics, 0 to 3.
    pub sh_degree: u8,
    /// Spatial layers, 1 to 4.
    pub spatial_layers: u8,
    /// Temporal layers, 1 to 4.
    pub temporal_layers: u8,
    /// Percent of the Gaussians of a frame up to each refinement; increasing to 100.
    pub refinements: Vec<u8>,
    /// Whether predicted frames need the whole I frame, for receivers of all spatial layers.
    pub whole_anchor: bool,
    /// Ticks in a second, 1 or more.
    pub ticks_per_second: u32,
    /// Ticks from a frame to the next, 1 or more; where the stream does not say, those of a second.
    pub ticks_per_frame: u32,
}

/// A live package: of segment files, to which more come while it grows. Times are those of the packager's clock.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LiveInfo {
    /// `growing` or `ended`.
    pub state: String,
    /// Number of the first GOP in [`Manifest::gops`], counted from 0.
    pub first_gop: u64,
    /// When the frame with display index 0 was made, milliseconds since 1970.
    pub started_ms: u64,
    /// When this manifest was written, milliseconds since 1970.
    pub published_ms: u64,
    /// Time from capture to display that players aim at, milliseconds.
    pub target_latency_ms: u32,
    /// Time from one manifest to the next while it grows, milliseconds, 1 or more.
    pub update_ms: u32,
}

/// A Representation: a file, or files of which this is the first.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RepresentationInfo {
    /// `s0` to `s3`, `t0` to `t3`.
    pub id: String,
    /// The name of its file, beside the manifest; of a live package that of the initialisation segment.
    pub file: String,
    /// `I`, `P` or `B`.
    pub frame_type: String,
    /// The spatial layer of I frames, the temporal layer of others.
    pub layer: u8,
    /// All Representations that it needs.
    pub depends_on: Vec<String>,
    /// Bits per second of it and of all that it needs.
    pub bandwidth: u64,
    /// Bits per second of each refinement of it alone.
    pub level_bandwidths: Vec<u64>,
    /// Samples of a track.
    pub frames: u32,
    /// Bytes of the file.
    pub bytes: u64,
    /// `ftyp` and `moov`.
    pub init: ByteRange,
    /// `sidx` and `ssix`; none without GOPs, and in a live package.
    pub index: Option<ByteRange>,
    /// `gssT`, in the base alone.
    pub tail: Option<ByteRange>,
    /// The file that the tail of a live package is in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tail_file: Option<String>,
}

/// Bytes of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ByteRange {
    /// Of the first byte.
    pub offset: u64,
    /// How many.
    pub size: u64,
    /// XXH64 with seed 0, 16 hexadecimal digits.
    pub digest: String,
}

/// A GOP.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GopInfo {
    /// `gop_index`.
    pub index: u32,
    /// Display index of its first frame.
    pub first_frame: u32,
    /// Its frames, 1 or more.
    pub frame_count: u32,
    /// Whether it has predicted frames.
    pub predicted: bool,
    /// `temporal_depth`, 0 to 3.
    pub temporal_depth: u8,
    /// Whether frames of it may still come.
    #[serde(default, skip_serializing_if = "is_false")]
    pub growing: bool,
    /// By Representation, then in order.
    pub subsegments: Vec<SubsegmentInfo>,
}

/// A subsegment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SubsegmentInfo {
    /// Of which Representation.
    pub representation: String,
    /// The file of a live package that it is in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Its frames, which are the samples of each track; none where the GOP has nothing for the Representation.
    pub frames: Vec<FrameInfo>,
    /// A range of bytes for each refinement, one after the other.
    pub levels: Vec<LevelInfo>,
}

/// A frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameInfo {
    /// Display index.
    pub frame: u32,
    /// `I`, `P` or `B`.
    #[serde(rename = "type")]
    pub frame_type: String,
    /// 0 is the base layer.
    pub temporal_layer: u8,
    /// Display index of the frame that it refers to.
    pub reference: Option<u32>,
}

/// A refinement of the frames of a subsegment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LevelInfo {
    /// From 0.
    pub refinement: u8,
    /// Percent of the Gaussians of a frame up to it.
    pub percent: u8,
    /// Where it is.
    #[serde(flatten)]
    pub bytes: ByteRange,
    /// Gaussians of its lists, over all frames.
    pub gaussians: u64,
    /// `8 * size / gaussians`; none without Gaussians.
    pub bits_per_gaussian: Option<f64>,
    /// What is in it.
    pub units: Vec<UnitCount>,
    /// What its increments are predicted by.
    pub predictors: Predictors,
}

/// Units of a type.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitCount {
    /// The name of 6.3, or `other`.
    #[serde(rename = "type")]
    pub unit_type: String,
    /// How many.
    pub count: u32,
}

/// What increments are predicted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Predictors {
    /// New Gaussians that are predicted from neighbours.
    pub predicted: u64,
    /// The most neighbours of a prediction, 0 to 16.
    pub neighbours: u8,
    /// Increments whose moves are predicted.
    pub moves: u32,
    /// Increments that extrapolate opacities.
    pub extrapolations: u32,
}

/// What an operating point looks like.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct QualityInfo {
    /// Such as `s0,t1,r2`.
    pub point: String,
    /// Number of the GOP in [`Manifest::gops`]; none for the whole stream.
    pub gop: Option<u32>,
    /// PSNR of pictures, dB.
    pub psnr_db: Option<f64>,
    /// SSIM of pictures, up to 1.
    pub ssim: Option<f64>,
}

/// Why a manifest is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ManifestError {
    /// Where: a path of keys, or line and column where the text is no manifest at all.
    pub at: String,
    /// The clause of annex C.
    pub clause: &'static str,
    /// What is wrong.
    pub message: String,
}

impl fmt::Display for ManifestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { at, clause, message } = self;
        write!(f, "{at}: {message} (clause {clause})")
    }
}

impl std::error::Error for ManifestError {}

/// Whether a key is left out.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references")]
const fn is_false(value: &bool) -> bool {
    !*value
}

/// The clause that defines the manifest.
pub(crate) const CLAUSE: &str = "C.8";

impl Manifest {
    /// What `format` is.
    pub const FORMAT: &'static str = "splatstream-manifest";
    /// What `version` is. Later versions may add keys, which readers pass over, without another number.
    pub const VERSION: u32 = 1;
    /// The most bytes of a manifest that is read.
    pub const MAX_BYTES: usize = 1 << 28;

    /// Reads and checks a manifest.
    ///
    /// # Errors
    /// Text that is no manifest, or one that contradicts itself: what, and where.
    pub fn parse(bytes: &[u8]) -> Result<Self, ManifestError> {
        let refused = |at: String, message: String| ManifestError { at, clause: CLAUSE, message };
        if bytes.len() > Self::MAX_BYTES {
            let message =
                format!("the manifest has {} bytes, at most {} are read", bytes.len(), Self::MAX_BYTES);
            return Err(refused("manifest".into(), message));
        }
        let manifest: Self = serde_json::from_slice(bytes).map_err(|error| {
            refused(format!("line {}, column {}", error.line(), error.column()), error.to_string())
        })?;
        manifest.check()?;
        Ok(manifest)
    }

    /// Whether a stream is the one that was packaged.
    pub fn describes(&self, stream: &[u8]) -> bool {
        let bytes = u64::try_from(stream.len()).ok();
        bytes.is_some() && bytes == self.stream.bytes && Some(digest_of(&[stream])) == self.stream.digest
    }

    /// Whether GOPs, or frames of the last one, may still come.
    pub fn is_growing(&self) -> bool {
        self.live.as_ref().is_some_and(|live| live.state == LiveInfo::GROWING)
    }

    /// Number of the first GOP that is listed, counted from 0.
    pub fn first_gop(&self) -> u64 {
        self.live.as_ref().map_or(0, |live| live.first_gop)
    }

    /// The manifest as JSON, with a line feed at the end.
    pub fn to_json(&self) -> String {
        // Keys are strings and values are finite: nothing can fail.
        let mut text = serde_json::to_string(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// The manifest as JSON with GOPs in JSON in place of its own, of which there are none.
    pub(crate) fn to_json_with<'a>(&self, gops: impl Iterator<Item = &'a str>) -> String {
        let text = self.to_json();
        // Quotes within strings have a backslash before them, so no string has these characters.
        let Some((before, after)) = text.split_once("\"gops\":[]") else { return text };
        let gops: Vec<&str> = gops.collect();
        [before, "\"gops\":[", &gops.join(","), "]", after].concat()
    }
}

impl LiveInfo {
    /// What `state` is while GOPs may come.
    pub const GROWING: &'static str = "growing";
    /// What `state` is from the end of the stream on.
    pub const ENDED: &'static str = "ended";
}

impl ByteRange {
    /// Whether bytes are those that were packaged.
    pub fn holds(&self, bytes: &[u8]) -> bool {
        u64::try_from(bytes.len()) == Ok(self.size) && digest_of(&[bytes]) == self.digest
    }
}

/// The digest of bytes that follow each other.
pub(crate) fn digest_of(parts: &[&[u8]]) -> String {
    let mut digest = Digest::default();
    parts.iter().for_each(|part| digest.add(part));
    digest.text()
}

/// The digest of bytes that come in pieces.
pub(crate) struct Digest(Xxh64);

impl Digest {
    pub(crate) fn add(&mut self, bytes: &[u8]) {
        self.0.write(bytes);
    }

    /// Of all bytes so far.
    pub(crate) fn text(&self) -> String {
        format!("{:016x}", self.0.finish())
    }
}

impl Default for Digest {
    fn default() -> Self {
        Self(Xxh64::new(0))
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Digest").field(&self.text()).finish()
    }
}
