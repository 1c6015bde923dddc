//! From where scenes are looked at: a camera file, or cameras made for the scene.

use crate::failure::Failure;
use clap::{Args, ValueEnum};
use splatstream_render::Camera;
use splatstream_render::camera::{Up, forward, read_cameras, ring};
use splatstream_scene::GaussianFrame;
use std::path::PathBuf;
use std::str::FromStr;

/// Rows of a picture where neither the user nor a file says.
const HEIGHT: u32 = 540;

/// The options of every command that draws.
#[derive(Args, Debug, Clone)]
pub(crate) struct CameraArgs {
    /// Rows of the pictures, 540, 720 and 1080 as a rule; default is what the camera file says, or 540.
    #[arg(long, value_name = "ROWS", value_parser = clap::value_parser!(u32).range(1..=8640))]
    pub(crate) height: Option<u32>,
    /// What points up in the scene, for cameras that are made for it.
    #[arg(long, value_enum, allow_hyphen_values = true, default_value_t = UpName::MinusY)]
    pub(crate) up: UpName,
}

/// An axis and its sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum UpName {
    /// y points down, as trainers write it.
    #[value(name = "-y")]
    MinusY,
    /// y points up.
    #[value(name = "y")]
    PlusY,
    /// z points down.
    #[value(name = "-z")]
    MinusZ,
    /// z points up.
    #[value(name = "z")]
    PlusZ,
}

impl From<UpName> for Up {
    fn from(name: UpName) -> Self {
        match name {
            UpName::MinusY => Self::MinusY,
            UpName::PlusY => Self::PlusY,
            UpName::MinusZ => Self::MinusZ,
            UpName::PlusZ => Self::PlusZ,
        }
    }
}

/// Where cameras come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Views {
    /// A `cameras.json` or `transforms.json`.
    File(PathBuf),
    /// So many around the scene.
    Ring(u32),
    /// So many in front of the scene.
    Forward(u32),
}

impl FromStr for Views {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let made = |count: &str| {
            count
                .parse()
                .ok()
                .filter(|count| (1..=1000).contains(count))
                .ok_or_else(|| format!("'{text}': the number of views must be 1 to 1000, as in ring:8"))
        };
        match text.split_once(':') {
            Some(("ring", count)) => made(count).map(Self::Ring),
            Some(("forward", count)) => made(count).map(Self::Forward),
            _ => Ok(Self::File(PathBuf::from(text))),
        }
    }
}

impl std::fmt::Display for Views {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Ring(count) => write!(f, "ring:{count}"),
            Self::Forward(count) => write!(f, "forward:{count}"),
        }
    }
}

impl CameraArgs {
    /// The cameras; those that are made look at `frame`, the first of its sequence.
    pub(crate) fn cameras(&self, views: &Views, frame: &GaussianFrame) -> Result<Vec<Camera>, Failure> {
        let height = self.height.unwrap_or(HEIGHT);
        match views {
            Views::Ring(count) => Ok(ring(frame, self.up.into(), *count, height)),
            Views::Forward(count) => Ok(forward(frame, self.up.into(), *count, height)),
            Views::File(path) => {
                let cameras = read_cameras(path)
                    .map_err(|error| Failure::other(format!("{}: {error}", path.display())))?;
                if cameras.is_empty() {
                    return Err(Failure::other(format!("{}: there is no camera in it", path.display())));
                }
                Ok(match self.height {
                    None => cameras,
                    Some(height) => cameras.iter().map(|camera| camera.scaled_to_height(height)).collect(),
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_a_file_or_a_number_of_them() {
        assert_eq!("ring:8".parse(), Ok(Views::Ring(8)));
        assert_eq!("forward:3".parse(), Ok(Views::Forward(3)));
        assert_eq!("a/cameras.json".parse(), Ok(Views::File("a/cameras.json".into())));
        assert!(["ring:", "ring:0", "ring:x"].iter().all(|text| text.parse::<Views>().is_err()));
        assert_eq!("ring:8".parse::<Views>().map(|views| views.to_string()), Ok("ring:8".to_owned()));
    }
}
