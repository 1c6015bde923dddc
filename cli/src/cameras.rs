//! From where scenes are looked at: a camera file, or cameras made for the scene.

use crate::capture_files::files_at;
use crate::failure::Failure;
use clap::{Args, ValueEnum};
use splatstream_capture::LoadError;
use splatstream_encoder::up_of;
use splatstream_format::payload::{SceneDescription, UpAxis};
use splatstream_format::syntax::Camera as StreamCamera;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::Camera;
use splatstream_render::camera::{Up, forward, read_cameras, read_views, ring};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Rows of a picture where neither the user nor a file says.
const HEIGHT: u32 = 540;
/// Cameras that are made where neither the user nor the stream has any.
const COUNT: u32 = 8;

/// The options of every command that draws.
#[derive(Args, Debug, Clone)]
pub(crate) struct CameraArgs {
    /// Rows of the pictures, 540, 720 and 1080 as a rule; default is what the camera file says, or 540.
    #[arg(long, value_name = "ROWS", value_parser = clap::value_parser!(u32).range(1..=8640))]
    pub(crate) height: Option<u32>,
    /// What points up in the scene, for cameras that are made for it; default is what the stream says, or -y, as trainers
    /// write it.
    #[arg(long, value_enum, allow_hyphen_values = true)]
    pub(crate) up: Option<UpName>,
}

/// The colour around the scene.
#[derive(Args, Debug, Clone, Copy)]
pub(crate) struct BackgroundArg {
    /// Red, green and blue around the scene, each 0 to 1; default is what the stream says, or black.
    #[arg(long, value_name = "R,G,B", value_parser = parse_colour)]
    pub(crate) background: Option<[f32; 3]>,
}

impl BackgroundArg {
    /// The colour that the user, or else the stream, asks for.
    pub(crate) fn colour(self, description: &SceneDescription) -> [f32; 3] {
        self.background.or(description.background).unwrap_or_default()
    }
}

fn parse_colour(text: &str) -> Result<[f32; 3], String> {
    let parts: Option<Vec<f32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let colour = parts.and_then(|parts| <[f32; 3]>::try_from(parts).ok());
    let in_range = colour.filter(|colour| colour.iter().all(|part| (0.0..=1.0).contains(part)));
    in_range.ok_or_else(|| {
        format!("'{text}' is not a colour; write red, green and blue from 0 to 1, as in 1,1,1")
    })
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
    /// x points down.
    #[value(name = "-x")]
    MinusX,
    /// x points up.
    #[value(name = "x")]
    PlusX,
}

impl From<UpName> for UpAxis {
    fn from(name: UpName) -> Self {
        match name {
            UpName::MinusY => Self::MinusY,
            UpName::PlusY => Self::PlusY,
            UpName::MinusZ => Self::MinusZ,
            UpName::PlusZ => Self::PlusZ,
            UpName::MinusX => Self::MinusX,
            UpName::PlusX => Self::PlusX,
        }
    }
}

/// Where cameras come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Views {
    /// A `cameras.json`, a `transforms.json`, or a directory with one of the latter or a model of COLMAP.
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

impl Views {
    /// The files that they are read from, with the pictures that these name; none where they are made.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        self.files_with(None)
    }

    /// The same where the pictures are in a directory of their own.
    pub(crate) fn files_with(&self, images: Option<&Path>) -> Vec<PathBuf> {
        match self {
            Self::File(path) => files_at(path, images),
            Self::Ring(_) | Self::Forward(_) => Vec::new(),
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
    /// The cameras; those that are made look at `frame`, the first of its sequence. Without `views` they are those of the
    /// stream, if it has any.
    pub(crate) fn cameras(
        &self,
        views: Option<&Views>,
        frame: &GaussianFrame,
        description: &SceneDescription,
    ) -> Result<Vec<Camera>, Failure> {
        let height = self.height.unwrap_or(HEIGHT);
        let up = self.up(description);
        match views {
            Some(Views::Ring(count)) => Ok(ring(frame, up, *count, height)),
            Some(Views::Forward(count)) => Ok(forward(frame, up, *count, height)),
            Some(Views::File(path)) => self.of_file(path),
            None if description.cameras.is_empty() => Ok(ring(frame, up, COUNT, height)),
            None => Ok(of_stream(description, height)),
        }
    }

    /// What points up, as the user or else the stream says; -y where neither does.
    pub(crate) fn up(&self, description: &SceneDescription) -> Up {
        up_of(self.up_axis(description)).unwrap_or_default()
    }

    /// The axis that the user, or else the stream, says points up.
    pub(crate) fn up_axis(&self, description: &SceneDescription) -> UpAxis {
        self.up.map_or(description.up_axis, UpAxis::from)
    }

    fn of_file(&self, path: &Path) -> Result<Vec<Camera>, Failure> {
        Failure::refuse_standard_input(path)?;
        let cameras =
            read_cameras(path).map_err(|error| Failure::other(format!("{}: {error}", path.display())))?;
        if cameras.is_empty() {
            return Err(Failure::other(format!("{}: there is no camera in it", path.display())));
        }
        Ok(match self.height {
            None => cameras,
            Some(height) => cameras.iter().map(|camera| camera.scaled_to_height(height)).collect(),
        })
    }
}

/// Refuses cameras whose lenses bend lines, where they stand for more than a pose: pictures are drawn without that, so that
/// photographs differ from any scene, and files of pinholes do not say it.
pub(crate) fn refuse_distorted(path: &Path) -> Result<(), Failure> {
    let failed = |error| Failure::other(format!("{}: {error}", path.display()));
    let views = read_views(path).map_err(failed)?.views;
    match views.iter().find(|view| view.is_distorted) {
        None => Ok(()),
        Some(view) => {
            let error = LoadError::Distorted(view.camera.name.clone());
            Err(Failure::other(format!("{}: {error}", path.display())))
        }
    }
}

/// The cameras of a scene description, which says nothing of the width of pictures: they are 16:9.
pub(crate) fn of_stream(description: &SceneDescription, height: u32) -> Vec<Camera> {
    let size = [(height * 16 / 9).max(1), height];
    let one = |(index, camera): (usize, &StreamCamera)| {
        let StreamCamera { position, rotation, vertical_field_of_view } = *camera;
        Camera::of_pose(format!("camera_{index:02}"), position, rotation, vertical_field_of_view, size)
    };
    description.cameras.iter().enumerate().map(one).collect()
}

/// Cameras as a scene description holds them.
pub(crate) fn to_stream(cameras: &[Camera]) -> Vec<StreamCamera> {
    let one = |camera: &Camera| StreamCamera {
        position: camera.position,
        rotation: camera.quaternion(),
        vertical_field_of_view: camera.vertical_field(),
    };
    cameras.iter().map(one).collect()
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

    #[test]
    fn a_colour_is_three_shares() {
        assert_eq!(parse_colour("1,0.5, 0"), Ok([1.0, 0.5, 0.0]));
        assert!(["", "1,1", "1,1,2", "1,1,x", "1,1,NaN"].iter().all(|text| parse_colour(text).is_err()));
    }
}
