//! Pictures of one moment at each operating point, and of the source.

use crate::failure::Failure;
use crate::output_file::{OutputFile, make_directory};
use serde::Serialize;
use splatstream_decoder::operating_point::OperatingPoint;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::camera::{Up, ring};
use splatstream_render::metrics::psnr;
use splatstream_render::{Camera, Image, render};
use std::path::{Path, PathBuf};

/// Rows of a picture.
const HEIGHT: u32 = 540;

/// The camera of a ring of eight that looks at the scene a little from above.
const VIEW: usize = 1;

/// The directory of the pictures, and the right one.
pub(super) struct Album {
    directory: PathBuf,
    source: Option<(u32, Camera, Image)>,
}

/// A picture that was written.
#[derive(Serialize)]
pub(super) struct Drawn {
    /// Its path in the directory of the demo.
    pub(super) picture: String,
    pub(super) frame: u32,
    /// Against the same view of the source; none if both are the same.
    pub(super) psnr_db: Option<f64>,
}

/// The pictures' directory in that of the demo.
const DIRECTORY: &str = "pictures";

impl Album {
    pub(super) fn start(out: &Path) -> Result<Self, Failure> {
        let directory = out.join(DIRECTORY);
        make_directory(&directory)?;
        Ok(Self { directory, source: None })
    }

    /// Draws a frame as an operating point shows it; nothing if the source has no such frame.
    pub(super) fn draw(
        &mut self,
        point: OperatingPoint,
        number: u32,
        frame: &GaussianFrame,
        source: &[GaussianFrame],
    ) -> Result<Option<Drawn>, Failure> {
        if self.source.as_ref().is_none_or(|(drawn, ..)| *drawn != number) {
            let Some(original) = source.get(number as usize) else { return Ok(None) };
            let Some(camera) = ring(original, Up::MinusY, 8, HEIGHT).into_iter().nth(VIEW) else {
                return Ok(None);
            };
            let picture = picture(original, &camera);
            self.write("source", &picture)?;
            self.source = Some((number, camera, picture));
        }
        let Some((_, camera, right)) = &self.source else { return Ok(None) };
        let picture = picture(frame, camera);
        let psnr_db = Some(psnr(right, &picture)).filter(|decibels| decibels.is_finite());
        let picture = self.write(&point.to_string().replace(',', ""), &picture)?;
        Ok(Some(Drawn { picture, frame: number, psnr_db }))
    }

    fn write(&self, name: &str, picture: &Image) -> Result<String, Failure> {
        let file = format!("{name}.png");
        let path = self.directory.join(&file);
        let failed = |error| Failure::other(format!("{}: cannot write: {error}", path.display()));
        OutputFile::write(&path, &picture.to_png().map_err(failed)?)?;
        Ok(format!("{DIRECTORY}/{file}"))
    }
}

fn picture(frame: &GaussianFrame, camera: &Camera) -> Image {
    render(frame, camera, [0.0; 3]).colour
}
