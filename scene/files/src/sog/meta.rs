//! `meta.json`: which images there are and how their bytes map to values.

use serde::Deserialize;

use super::META;
use crate::error::SceneError;
use crate::limits::Budget;

/// Entries that a byte can choose from.
const CODES: usize = 256;

/// Bytes that a byte of JSON turns into, at most: an empty string of three takes 24, and a vector that grows
/// has twice the room.
const PARSED: u64 = 16;

const EXPORT: &str = "export the scene again";

#[derive(Deserialize)]
pub(crate) struct Meta {
    version: Option<u32>,
    count: Option<u64>,
    pub(crate) means: Means,
    pub(crate) scales: Coded,
    pub(crate) quats: Files,
    pub(crate) sh0: Coded,
    #[serde(rename = "shN")]
    pub(crate) rest: Option<Coded>,
}

#[derive(Deserialize)]
pub(crate) struct Means {
    shape: Option<Vec<u64>>,
    pub(crate) mins: [f64; 3],
    pub(crate) maxs: [f64; 3],
    files: Vec<String>,
}

#[derive(Deserialize)]
pub(crate) struct Files {
    files: Vec<String>,
}

/// An attribute in bytes: a codebook from version 2 on, ranges before.
#[derive(Deserialize)]
pub(crate) struct Coded {
    codebook: Option<Vec<f64>>,
    mins: Option<Range>,
    maxs: Option<Range>,
    files: Vec<String>,
}

/// One value for all channels, or one each.
#[derive(Clone, Deserialize)]
#[serde(untagged)]
enum Range {
    All(f64),
    Each(Vec<f64>),
}

/// The value of every byte of one channel.
pub(crate) type Codebook = Vec<f64>;

impl Meta {
    pub(crate) fn parse(json: &[u8], budget: &mut Budget) -> Result<Self, SceneError> {
        budget.take((json.len() as u64).saturating_mul(PARSED), META)?;
        let meta: Self = serde_json::from_slice(json).map_err(|error| broken(error.to_string()))?;
        match meta.version.unwrap_or(1) {
            1 | 2 => Ok(meta),
            other => Err(SceneError::unsupported(format!("SOG version {other}"), "export it as version 2")),
        }
    }

    /// Gaussians, as the file says: not yet compared with anything.
    pub(crate) fn count(&self) -> Result<u64, SceneError> {
        let shape = self.means.shape.as_ref().and_then(|shape| shape.first());
        self.count.or(shape.copied()).ok_or_else(|| broken("the count is missing"))
    }

    /// Whether opacity is a byte of its own; before version 2 it is a logit, coded as colour is.
    pub(crate) fn has_plain_opacity(&self) -> bool {
        self.version.unwrap_or(1) >= 2
    }
}

impl Means {
    /// The images of the low and of the high bytes.
    pub(crate) fn files(&self) -> Result<[&str; 2], SceneError> {
        match self.files.as_slice() {
            [low, high, ..] => Ok([low, high]),
            _ => Err(broken("means needs two files")),
        }
    }
}

impl Files {
    pub(crate) fn file(&self) -> Result<&str, SceneError> {
        first(&self.files)
    }
}

impl Coded {
    pub(crate) fn file(&self) -> Result<&str, SceneError> {
        first(&self.files)
    }

    /// The file whose name has `part` in it: labels and centroids come in either order.
    pub(crate) fn file_with(&self, part: &str) -> Result<&str, SceneError> {
        let found = self.files.iter().find(|name| name.contains(part));
        found.map(String::as_str).ok_or_else(|| broken(format!("shN has no {part} file")))
    }

    /// What the bytes of `channel` mean.
    pub(crate) fn codebook(&self, channel: usize) -> Result<Codebook, SceneError> {
        if let Some(codebook) = &self.codebook {
            if codebook.len() < CODES {
                return Err(broken(format!("a codebook has {} entries, 256 are needed", codebook.len())));
            }
            return Ok(codebook.clone());
        }
        let end = |range: &Option<Range>| match range {
            Some(Range::All(value)) => Some(*value),
            Some(Range::Each(values)) => values.get(channel).copied(),
            None => None,
        };
        let (Some(low), Some(high)) = (end(&self.mins), end(&self.maxs)) else {
            return Err(broken("an attribute has neither a codebook nor mins and maxs"));
        };
        Ok((0..CODES).map(|code| low + (high - low) * code as f64 / 255.0).collect())
    }
}

fn first(files: &[String]) -> Result<&str, SceneError> {
    files.first().map(String::as_str).ok_or_else(|| broken("an attribute has no file"))
}

fn broken(what: impl Into<String>) -> SceneError {
    SceneError::inconsistent(format!("{META}: {}", what.into()), EXPORT)
}
