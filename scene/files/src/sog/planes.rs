//! SOG's images to the planes of a frame.

use std::f64::consts::SQRT_2;

use super::META;
use super::image::Image;
use super::meta::{Codebook, Coded, Meta};
use crate::byte_values::logit_of_byte;
use crate::error::SceneError;
use crate::limits::{Budget, bytes_of_planes, refused};
use crate::reading::frame_of;
use crate::smallest_three::from_smallest_three;
use splatstream_gaussians::{GaussianFrame, MAX_SH_DEGREE, Planes, sh_coefficients};

/// Palette entries in a row of the centroid image.
pub(super) const ENTRIES_A_ROW: usize = 64;
/// Alpha of a rotation whose largest component is the first.
pub(super) const FIRST_LARGEST: u8 = 252;

const EXPORT: &str = "export the scene again";

/// Images hold one pixel a Gaussian and some padding: more than twice as many, and these, are refused.
const PADDING: u64 = 1 << 16;
/// Labels of 16 bits choose among this many rows of the palette at most.
const PALETTE_PIXELS: u64 = 1024 * 960;

/// Fetches files by name and reads the scene they make; values are not checked.
pub(crate) fn read(
    mut fetch: impl FnMut(&str, &mut Budget) -> Result<Vec<u8>, SceneError>,
    budget: &mut Budget,
) -> Result<GaussianFrame, SceneError> {
    let meta = Meta::parse(&fetch(META, budget)?, budget)?;
    let count = meta.count()?;
    // Without spherical harmonics, of which the images tell: refused before any image is decoded.
    let least = bytes_of_planes(0, count);
    budget.take(least, "the frame")?;
    let rows = usize::try_from(count).map_err(|_| refused(least, "the frame"))?;
    let images = Images::fetch(&meta, rows, fetch, budget)?;
    let sh_degree = images.palette.as_ref().map_or(0, |(_, palette)| palette.sh_degree);
    budget.give_back(least);
    let mut planes = budget.planes(sh_degree, count)?;
    let pixels = |image| Image::pixels(image).take(rows);
    positions(&meta, pixels(&images.low).zip(images.high.pixels()), &mut planes);
    rotations(pixels(&images.quats), &mut planes)?;
    for (channel, plane) in planes.log_scale.iter_mut().enumerate() {
        look_up(&meta.scales, channel, pixels(&images.scales), plane)?;
    }
    for (channel, plane) in planes.dc.iter_mut().enumerate() {
        look_up(&meta.sh0, channel, pixels(&images.colours), plane)?;
    }
    let colours = pixels(&images.colours);
    if meta.has_plain_opacity() {
        planes.opacity_logit.extend(colours.map(|[.., opacity]| logit_of_byte(opacity)));
    } else {
        look_up(&meta.sh0, 3, colours, &mut planes.opacity_logit)?;
    }
    if let Some((labels, palette)) = &images.palette {
        palette.look_up(pixels(labels), &mut planes.sh)?;
    }
    frame_of(sh_degree, planes)
}

/// The images of a scene, each compared with the count before any plane gets room for it.
struct Images {
    low: Image,
    high: Image,
    quats: Image,
    scales: Image,
    colours: Image,
    palette: Option<(Image, Palette)>,
}

impl Images {
    fn fetch(
        meta: &Meta,
        rows: usize,
        mut fetch: impl FnMut(&str, &mut Budget) -> Result<Vec<u8>, SceneError>,
        budget: &mut Budget,
    ) -> Result<Self, SceneError> {
        let mut image = |name: &str| {
            let image = Image::decode(
                name,
                &fetch(name, budget)?,
                (rows as u64).saturating_mul(2).saturating_add(PADDING),
                budget,
            )?;
            if image.len() < rows {
                let what = format!("{name} has {} pixels for {rows} Gaussians", image.len());
                return Err(SceneError::inconsistent(what, EXPORT));
            }
            Ok(image)
        };
        let [low, high] = meta.means.files()?;
        let (low, high) = (image(low)?, image(high)?);
        let (quats, scales) = (image(meta.quats.file()?)?, image(meta.scales.file()?)?);
        let colours = image(meta.sh0.file()?)?;
        let Some(rest) = &meta.rest else {
            return Ok(Self { low, high, quats, scales, colours, palette: None });
        };
        let labels = image(rest.file_with("label")?)?;
        let name = rest.file_with("centroid")?;
        let centroids = Image::decode(name, &fetch(name, budget)?, PALETTE_PIXELS, budget)?;
        let palette = Some((labels, Palette::read(rest, name, &centroids, budget)?));
        Ok(Self { low, high, quats, scales, colours, palette })
    }
}

fn positions(meta: &Meta, pixels: impl Iterator<Item = ([u8; 4], [u8; 4])>, planes: &mut Planes) {
    for (low, high) in pixels {
        let codes = low.into_iter().zip(high).map(|(low, high)| u16::from_le_bytes([low, high]));
        let ranges = meta.means.mins.into_iter().zip(meta.means.maxs);
        for ((plane, code), (least, most)) in planes.position.iter_mut().zip(codes).zip(ranges) {
            let log = least + (most - least) * f64::from(code) / 65535.0;
            // The log keeps its sign apart, and is of one more, so that small centres stay small.
            plane.push((libm::expm1(log.abs()) * log.signum()) as f32);
        }
    }
}

fn rotations(pixels: impl Iterator<Item = [u8; 4]>, planes: &mut Planes) -> Result<(), SceneError> {
    let part = |byte: u8| (f64::from(byte) / 255.0 - 0.5) * SQRT_2;
    for (row, [a, b, c, alpha]) in pixels.enumerate() {
        let largest = alpha.checked_sub(FIRST_LARGEST).ok_or_else(|| {
            let what = format!("Gaussian {row}: rotation alpha is {alpha}, 252 to 255 are known");
            SceneError::inconsistent(what, EXPORT)
        })?;
        let rotation = from_smallest_three(usize::from(largest), [part(a), part(b), part(c)]);
        for (plane, part) in planes.rotation.iter_mut().zip(rotation) {
            plane.push(part);
        }
    }
    Ok(())
}

fn look_up(
    coded: &Coded,
    channel: usize,
    pixels: impl Iterator<Item = [u8; 4]>,
    plane: &mut Vec<f32>,
) -> Result<(), SceneError> {
    let codebook = coded.codebook(channel)?;
    plane.extend(pixels.map(|pixel| value_of(&codebook, pixel.get(channel).copied().unwrap_or(0))));
    Ok(())
}

/// What a byte stands for: a codebook has an entry for each.
fn value_of(codebook: &Codebook, code: u8) -> f32 {
    codebook.get(usize::from(code)).map_or(f32::NAN, |&value| value as f32)
}

/// The SH coefficients that labels choose from.
struct Palette {
    sh_degree: u8,
    /// Entry by entry, in the order of the planes of a frame.
    values: Vec<f32>,
}

impl Palette {
    fn read(coded: &Coded, name: &str, image: &Image, budget: &mut Budget) -> Result<Self, SceneError> {
        let degree = |&degree: &u8| sh_coefficients(degree).saturating_mul(ENTRIES_A_ROW) == image.width;
        let sh_degree = (1..=MAX_SH_DEGREE).find(degree).ok_or_else(|| {
            let what = format!("{name} is {} pixels wide; 192, 512 and 960 are known", image.width);
            SceneError::inconsistent(what, EXPORT)
        })?;
        let books = [coded.codebook(0)?, coded.codebook(1)?, coded.codebook(2)?];
        let colours = image.pixels().flat_map(|pixel| books.iter().zip(pixel));
        let mut values = budget.room((image.len() as u64).saturating_mul(3), "the palette")?;
        values.extend(colours.map(|(book, code)| value_of(book, code)));
        Ok(Self { sh_degree, values })
    }

    fn look_up(
        &self,
        labels: impl Iterator<Item = [u8; 4]>,
        planes: &mut [Vec<f32>],
    ) -> Result<(), SceneError> {
        for (row, [low, high, ..]) in labels.enumerate() {
            let label = usize::from(u16::from_le_bytes([low, high]));
            let first = label.saturating_mul(planes.len());
            let entry =
                self.values.get(first..).and_then(|rest| rest.get(..planes.len())).ok_or_else(|| {
                    let what = format!("Gaussian {row}: label {label} is past the end of the palette");
                    SceneError::inconsistent(what, EXPORT)
                })?;
            for (plane, &value) in planes.iter_mut().zip(entry) {
                plane.push(value);
            }
        }
        Ok(())
    }
}
