//! What a decoder claims to do. What it does not claim is not asked of it, and counts as nothing.

use crate::case::Case;
use crate::error::{Error, Result, read_json};
use crate::feature;
use crate::nearest::nearest;
use crate::vector::Mode;
use serde::{Deserialize, Serialize};
use splatstream_format::Class;
use std::path::Path;

/// What `schema` of a claim says.
const SCHEMA: &str = "splatstream-capabilities/1";

/// The claim of a decoder, `conformance/schema/capabilities.schema.json`. What is left out is claimed.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Capabilities {
    /// The schema's name and version.
    pub schema: String,
    /// Of the decoder, as reports shall call it.
    pub name: String,
    /// Profiles of annex A.
    #[serde(default = "all_profiles")]
    pub profiles: Vec<u8>,
    /// The highest level of annex A.
    #[serde(default = "highest_level")]
    pub level: u8,
    /// Features as vectors name them; none is all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub features: Option<Vec<String>>,
    /// What can be shown.
    #[serde(default = "all_modes")]
    pub modes: Vec<Mode>,
    /// Operating points that can be asked for.
    #[serde(default)]
    pub points: Points,
    /// Whether it writes the states of its entropy decoder, `u%04d.entropy`.
    #[serde(default)]
    pub entropy: bool,
    /// Whether it writes the output of 7.10, `f%04d.f32`.
    #[serde(default)]
    pub output: bool,
}

/// Operating points that a decoder can be asked for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Points {
    /// Any.
    #[default]
    All,
    /// The highest of a stream alone.
    Full,
    /// The lowest of a stream alone.
    Base,
}

impl Capabilities {
    /// The claim of a decoder that claims everything but what is optional.
    pub fn everything(name: &str) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            name: name.to_owned(),
            profiles: all_profiles(),
            level: highest_level(),
            features: None,
            modes: all_modes(),
            points: Points::All,
            entropy: false,
            output: false,
        }
    }

    /// Reads a claim.
    ///
    /// # Errors
    /// The file cannot be read, or is no claim, or claims what there is not: a word that nobody knows would be passed over, and
    /// the cases with it.
    pub fn read(path: &Path) -> Result<Self> {
        let claim: Self = read_json(path)?;
        if claim.schema != SCHEMA {
            return Err(Error::content(
                path,
                format!("the schema is {}, this runner knows {SCHEMA}", claim.schema),
            ));
        }
        match claim.unknown() {
            Some(message) => Err(Error::content(path, message)),
            None => Ok(claim),
        }
    }

    /// What is claimed and does not exist, and what does.
    fn unknown(&self) -> Option<String> {
        if self.name.trim().is_empty() {
            return Some("the name is empty; reports need one".to_owned());
        }
        if let Some(profile) = self.profiles.iter().find(|profile| !all_profiles().contains(profile)) {
            return Some(format!("there is no profile {profile}; there are 0 and 1"));
        }
        if !(1..=highest_level()).contains(&self.level) {
            return Some(format!("there is no level {}; there are 1 to {}", self.level, highest_level()));
        }
        let claimed = self.features.iter().flatten();
        let stranger = claimed.into_iter().find(|claimed| feature::names().all(|name| name != *claimed))?;
        let all: Vec<&str> = feature::names().collect();
        let near = nearest(stranger, feature::names());
        let near = near.first().map_or("", |name| name);
        Some(format!("there is no feature '{stranger}', perhaps {near}; there are {}", all.join(", ")))
    }

    /// What a case needs that is not claimed; none if everything is. A stream that every decoder shall call
    /// unsupported needs nothing.
    pub fn missing(&self, case: &Case<'_>) -> Option<String> {
        let vector = case.vector;
        if vector.expect.class == Some(Class::Unsupported) {
            return None;
        }
        if !self.profiles.contains(&vector.profile) {
            return Some(format!("profile {}", vector.profile));
        }
        if vector.level > self.level {
            return Some(format!("level {}", vector.level));
        }
        let claimed =
            |feature: &&String| self.features.as_ref().is_none_or(|claimed| claimed.contains(feature));
        if let Some(feature) = vector.features.iter().find(|feature| !claimed(feature)) {
            return Some(format!("feature {feature}"));
        }
        if !self.modes.contains(&case.mode()) {
            return Some(format!("mode {}", case.mode()));
        }
        let has_point = match self.points {
            Points::All => true,
            Points::Full => case.is_extreme(true),
            Points::Base => case.is_extreme(false),
        };
        (!has_point).then(|| format!("operating point {}", case.op()))
    }
}

fn all_profiles() -> Vec<u8> {
    vec![0, 1]
}

fn highest_level() -> u8 {
    4
}

fn all_modes() -> Vec<Mode> {
    vec![Mode::Full, Mode::Subset]
}
