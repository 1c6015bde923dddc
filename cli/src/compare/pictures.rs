//! How far apart two scenes look: renderings of both from the same cameras.

use super::flicker::{Flicker, FlickerSums};
use crate::cameras::{BackgroundArg, CameraArgs, Views, refuse_distorted};
use crate::failure::Failure;
use crate::memory_bound::{MemoryBound, PixelBytes, bytes_of};
use crate::numbers::counted;
use crate::whole_file::read_whole;
use clap::Args;
use serde::Serialize;
use splatstream_chart::table::Table;
use splatstream_format::payload::SceneDescription;
use splatstream_gaussians::GaussianFrame;
use splatstream_render::metrics::{Comparison, StLpips, compare};
use splatstream_render::{Camera, Image, Rendering, render};
use std::path::{Path, PathBuf};

/// What is drawn and compared.
#[derive(Args)]
pub(crate) struct PictureArgs {
    /// Draw both from these cameras and compare the pictures: a cameras.json or transforms.json; ring:N and
    /// forward:N make N cameras for the first frame of A.
    #[arg(long, value_name = "CAMS.json|ring:N|forward:N")]
    cameras: Option<Views>,
    #[command(flatten)]
    views: CameraArgs,
    #[command(flatten)]
    background: BackgroundArg,
    /// Weights of the learned metric ST-LPIPS (an .npz file); without them it is left out.
    #[arg(long, value_name = "WEIGHTS.npz", requires = "cameras")]
    st_lpips: Option<PathBuf>,
    /// Photographs, one PNG file per camera and named after it: both scenes are compared with these as well.
    #[arg(long, value_name = "DIR", requires = "cameras")]
    photos: Option<PathBuf>,
}

/// A pixel of a comparison, bytes; more with the learned metric, and with a photograph.
const OF_COMPARISON: u64 = 112;
const OF_LEARNED: u64 = 512;
const OF_PHOTO: u64 = 64;
/// A pixel of two renderings that are kept.
const OF_BOTH: u64 = 32;

/// Means over all frames and views; nothing where no cameras are given. A is the reference.
#[derive(Serialize, Default)]
pub(super) struct PictureErrors {
    #[serde(flatten)]
    rendered: Figures,
    /// A and B against photographs.
    #[serde(skip_serializing_if = "Option::is_none")]
    photos: Option<[Figures; 2]>,
    /// How much A and B flicker.
    #[serde(flatten)]
    flicker: Flicker,
    /// Pictures compared.
    pictures: usize,
    /// Each of them.
    each_picture: Vec<PictureError>,
    /// Pictures that show nothing of A and nothing of B: they are no part of the means.
    blank_pictures: usize,
}

/// One picture.
#[derive(Serialize, Clone)]
struct PictureError {
    frame: u32,
    view: String,
    #[serde(flatten)]
    rendered: Figures,
    #[serde(skip_serializing_if = "Option::is_none")]
    photos: Option<[Figures; 2]>,
}

/// The figures of a comparison, all of them null where there is none.
#[derive(Serialize, Default, Clone, Copy)]
pub(super) struct Figures {
    psnr_db: Option<f64>,
    psnr_masked_db: Option<f64>,
    yuv_psnr_db: Option<f64>,
    ssim: Option<f64>,
    ssim_masked: Option<f64>,
    st_lpips: Option<f64>,
}

/// Compares pictures as frames come by.
pub(super) struct Pictures<'a> {
    args: &'a PictureArgs,
    /// What the streams say about the scene.
    description: SceneDescription,
    learned: Option<StLpips>,
    cameras: Vec<Camera>,
    rendered: Vec<Comparison>,
    photos: [Vec<Comparison>; 2],
    each: Vec<PictureError>,
    /// What pictures may take.
    memory: MemoryBound,
    /// Whether there may be more than one frame.
    is_sequence: bool,
    /// The renderings of the frame before, A and B of each camera.
    before: Vec<[Rendering; 2]>,
    flicker: FlickerSums,
    blank: usize,
}

impl PictureArgs {
    /// Ready for the first frame; the weights are read. `is_sequence`: whether there may be another.
    pub(super) fn start(
        &self,
        description: SceneDescription,
        memory: MemoryBound,
        is_sequence: bool,
    ) -> Result<Pictures<'_>, Failure> {
        if let (Some(_), Some(Views::File(path))) = (&self.photos, &self.cameras) {
            refuse_distorted(path)?;
        }
        let learned = self.st_lpips.as_deref().map(read_weights).transpose()?;
        let photos = [const { Vec::new() }; 2];
        Ok(Pictures {
            args: self,
            description,
            learned,
            cameras: Vec::new(),
            rendered: Vec::new(),
            photos,
            each: Vec::new(),
            memory,
            is_sequence,
            before: Vec::new(),
            flicker: FlickerSums::default(),
            blank: 0,
        })
    }
}

/// The weights of the learned metric in a file.
pub(crate) fn read_weights(path: &Path) -> Result<StLpips, Failure> {
    Failure::refuse_standard_input(path)?;
    StLpips::read(path).map_err(|error| Failure::other(format!("{}: {error}", path.display())))
}

impl Pictures<'_> {
    /// Draws and compares one frame of each.
    pub(super) fn add(&mut self, frame: u32, [a, b]: [&GaussianFrame; 2]) -> Result<(), Failure> {
        let Some(views) = &self.args.cameras else { return Ok(()) };
        if self.cameras.is_empty() {
            self.cameras = self.args.views.cameras(Some(views), a, &self.description)?;
            [a, b].iter().for_each(|frame| self.memory.keep(bytes_of(frame)));
            self.of_pixel().check(&self.cameras, self.memory)?;
        }
        let background = self.args.background.colour(&self.description);
        let mut before = core::mem::take(&mut self.before).into_iter();
        for view in 0..self.cameras.len() {
            let Some(camera) = self.cameras.get(view) else { break };
            let drawn = [a, b].map(|frame| render(frame, camera, background));
            if let Some(before) = before.next() {
                self.flicker.add(&before, drawn.each_ref());
            }
            self.compare(frame, view, &drawn)?;
            if self.is_sequence {
                self.before.push(drawn);
            }
        }
        Ok(())
    }

    /// What a pixel takes.
    fn of_pixel(&self) -> PixelBytes {
        let learned = if self.learned.is_some() { OF_LEARNED } else { 0 };
        let photo = if self.args.photos.is_some() { OF_PHOTO } else { 0 };
        let of_each = if self.is_sequence { OF_BOTH } else { 0 };
        PixelBytes { of_one: OF_COMPARISON + learned + photo, of_each }
    }

    /// Compares the renderings of a frame from one of the cameras, with each other and with a photograph.
    fn compare(&mut self, frame: u32, view: usize, [a, b]: &[Rendering; 2]) -> Result<(), Failure> {
        let Some(camera) = self.cameras.get(view) else { return Ok(()) };
        let learned = self.learned.as_ref();
        let photos = match &self.args.photos {
            Some(directory) => {
                let photo = read_photo(directory, camera)?;
                Some([a, b].map(|drawn| compare(&photo, &a.alpha, &drawn.colour, learned)))
            }
            None => None,
        };
        if let Some([of_a, of_b]) = photos {
            self.photos[0].push(of_a);
            self.photos[1].push(of_b);
        }
        // Two pictures of nothing are equal, and say nothing.
        if [a, b].iter().all(|drawn| drawn.alpha.iter().all(|&alpha| alpha <= 0.0)) {
            self.blank += 1;
            return Ok(());
        }
        let compared = compare(&a.colour, &a.alpha, &b.colour, learned);
        self.rendered.push(compared);
        self.each.push(PictureError {
            frame,
            view: camera.name.clone(),
            rendered: compared.into(),
            photos: photos.map(|photos| photos.map(Figures::from)),
        });
        Ok(())
    }

    /// Means over everything that was added.
    pub(super) fn errors(&self) -> PictureErrors {
        PictureErrors {
            rendered: Figures::of(&self.rendered),
            photos: self.args.photos.as_ref().map(|_| self.photos.each_ref().map(|list| Figures::of(list))),
            flicker: self.flicker.means(),
            pictures: self.rendered.len(),
            each_picture: self.each.clone(),
            blank_pictures: self.blank,
        }
    }
}

/// The most of a photograph that is read, bytes.
const MAX_PHOTO: u64 = 512 << 20;

/// The photograph of a camera, which must be of its size.
fn read_photo(directory: &Path, camera: &Camera) -> Result<Image, Failure> {
    let stem = Path::new(&camera.name).file_stem().unwrap_or(camera.name.as_ref());
    let path = directory.join(stem).with_extension("png");
    let bytes = read_whole(&path, MAX_PHOTO)?;
    let photo =
        Image::from_png(&bytes).map_err(|error| Failure::other(format!("{}: {error}", path.display())))?;
    let (width, height) = (camera.width, camera.height);
    if (photo.width(), photo.height()) != (width as usize, height as usize) {
        return Err(Failure::other(format!(
            "{}: is {} x {} pixels, its camera {width} x {height}\n  scale the photographs, or set --height to theirs",
            path.display(),
            photo.width(),
            photo.height(),
        )));
    }
    Ok(photo)
}

impl Figures {
    fn of(pictures: &[Comparison]) -> Self {
        Comparison::mean(pictures).map(Self::from).unwrap_or_default()
    }

    fn row(&self, what: &str) -> [String; 7] {
        let cell = |figure: Option<f64>, digits: usize| {
            figure.map_or_else(|| "-".to_owned(), |figure| format!("{figure:.digits$}"))
        };
        [
            what.to_owned(),
            cell(self.psnr_db, 2),
            cell(self.psnr_masked_db, 2),
            cell(self.yuv_psnr_db, 2),
            cell(self.ssim, 4),
            cell(self.ssim_masked, 4),
            cell(self.st_lpips, 4),
        ]
    }
}

impl From<Comparison> for Figures {
    fn from(compared: Comparison) -> Self {
        Self {
            psnr_db: Some(compared.psnr_db),
            psnr_masked_db: compared.psnr_masked_db,
            yuv_psnr_db: Some(compared.yuv_psnr_db),
            ssim: compared.ssim,
            ssim_masked: compared.ssim_masked,
            st_lpips: compared.st_lpips,
        }
    }
}

impl PictureErrors {
    /// What to say where pictures show nothing; none if all show something.
    pub(super) fn warning(&self) -> Option<String> {
        let (blank, all) = (self.blank_pictures, self.pictures + self.blank_pictures);
        let (all, verb) = (counted(all as u64, "picture"), if blank == 1 { "is" } else { "are" });
        (blank > 0).then(|| {
            format!(
                "warning: {blank} of {all} {verb} blank on both sides, and left out: the cameras do not see the \
                 scene; check --cameras, or let --cameras ring:8 make some"
            )
        })
    }

    /// A table for people; nothing if no picture shows anything.
    pub(super) fn text(&self) -> String {
        if self.pictures == 0 {
            return String::new();
        }
        let mut rows = vec![self.rendered.row("B against A")];
        if let Some([a, b]) = &self.photos {
            rows.push(a.row("A against photographs"));
            rows.push(b.row("B against photographs"));
        }
        let mut table =
            Table::new(["", "PSNR dB", "covered dB", "YUV dB", "SSIM", "covered SSIM", "ST-LPIPS"]);
        rows.into_iter().for_each(|row| table.row(row));
        format!(
            "\n{}, means over all of them\n{}{}{}",
            counted(self.pictures as u64, "picture"),
            table.text(),
            self.lowest(),
            self.flicker.text()
        )
    }

    /// Which of several pictures is worst.
    fn lowest(&self) -> String {
        let of = |picture: &PictureError| picture.rendered.psnr_db.unwrap_or(f64::INFINITY);
        let worst = self.each_picture.iter().min_by(|a, b| of(a).total_cmp(&of(b)));
        match worst {
            Some(worst) if self.each_picture.len() > 1 => {
                format!("lowest: {:.2} dB, frame {} from {}\n", of(worst), worst.frame, worst.view)
            }
            _ => String::new(),
        }
    }
}
