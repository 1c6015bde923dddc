//! What a decoder claims to support. Cases that need more are not run, and count neither as passed nor as failed.

use crate::case::Case;
use crate::error::{Error, Result, read_json};
use crate::feature;
use crate::suggest::closest;
use crate::vector::Mode;
use serde::{Deserialize, Serialize};
use splatstream_format::Class;
use std::path::Path;

/// What `schema` of a claim says.
const SCHEMA: &str = "splatstream-capabilities/1";

/// The claim of a decoder, `conformance/schema/capabilities.schema.json`. Keys that are left out claim everything.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Capabilities {
    /// The schema's name and version.
    pub schema: String,
    /// The name of the decoder in reports.
    pub name: String,
    /// Profiles of annex A.
    #[serde(default = "all_profiles")]
    pub profiles: Vec<u8>,
    /// The highest level of annex A.
    #[serde(default = "highest_level")]
    pub level: u8,
    /// Features as vectors name them; none: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub features: Option<Vec<String>>,
    /// Modes.
    #[serde(default = "all_modes")]
    pub modes: Vec<Mode>,
    /// Operating points.
    #[serde(default)]
    pub points: Points,
    /// Whether it writes entropy states, `u%04d.entropy`.
    #[serde(default)]
    pub entropy: bool,
    /// Whether it writes the output of 7.10, `f%04d.f32`.
    #[serde(default)]
    pub output: bool,
}

/// Operating points that a decoder supports.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Points {
    /// Any.
    #[default]
    All,
    /// Only the highest of a stream.
    Full,
    /// Only the lowest of a stream.
    Base,
}

impl Capabilities {
    /// The claim of everything but the optional files.
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
    /// The file cannot be read, is not a claim, or has unknown words: with those, cases would be left out by mistake.
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

    /// What is claimed but does not exist, and what exists.
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
        let similar = closest(stranger, feature::names());
        let similar = similar.first().map_or("", |name| name);
        Some(format!(
            "there is no feature '{stranger}'; did you mean {similar}? There are {}",
            all.join(", ")
        ))
    }

    /// What a case needs that is not claimed; none if everything is. A stream of a claimed profile that every decoder shall
    /// call unsupported, and of which nothing is shown, needs nothing else.
    pub fn missing(&self, case: &Case<'_>) -> Option<String> {
        let vector = case.vector;
        if !self.profiles.contains(&vector.profile) {
            return Some(format!("profile {}", vector.profile));
        }
        if vector.expect.class == Some(Class::Unsupported) && vector.states.is_empty() {
            return None;
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
    Mode::ALL.to_vec()
}
