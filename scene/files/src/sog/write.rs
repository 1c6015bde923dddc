//! Writing SOG as a ZIP archive.

use std::f64::consts::SQRT_2;
use std::io::{Cursor, Write};

use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder};
use serde_json::{Value, json};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::META;
use super::codebook::{Weighed, codebook, nearest};
use super::palette::{Rows, palette};
use super::planes::{ENTRIES_A_ROW, FIRST_LARGEST};
use crate::byte_values::{byte_of_logit, to_byte};
use crate::error::SceneError;
use crate::morton::morton_order;
use crate::reading::row_of;
use crate::smallest_three::to_smallest_three;
use splatstream_gaussians::activation::sigmoid;
use splatstream_gaussians::rotation::normalised;
use splatstream_gaussians::{GaussianFrame, sh_coefficients};

/// The largest side of a WebP image.
const MOST_PIXELS: usize = 16383;

/// The most entries that a palette of spherical harmonics has; a label has 16 bits.
const MOST_ENTRIES: usize = 64 << 10;

/// Writes SOG version 2 as a ZIP archive, Gaussians in Morton order.
///
/// Centres have 16 bits over the logarithm of their range, rotations 8 bits; scales, colours and coefficients choose from 256 values
/// each that suit the scene, and spherical harmonics from a palette of up to 65,536 rows, one for some eight Gaussians or fewer.
/// No value is outside a range. A scene of half a million Gaussians with spherical harmonics takes some seconds.
///
/// # Errors
/// A frame that does not pass [`GaussianFrame::validate`], without Gaussians, or with more than 268 million.
pub fn write_zip(frame: &GaussianFrame) -> Result<Vec<u8>, SceneError> {
    frame.validate()?;
    let mut files = Files::for_frame(frame)?;
    let order = morton_order(frame);
    let means = means(frame, &order, &mut files)?;
    files.add("quats.webp", order.iter().map(|&row| rotation(frame, row as usize)))?;
    let weights = visible(frame);
    let weighed = |planes: &[Vec<f32>; 3]| {
        let values = planes.iter().flat_map(|plane| plane.iter().zip(&weights));
        codebook(values.map(|(&value, &weight)| Weighed { value, weight }).collect())
    };
    let scales = weighed(frame.log_scale());
    files.add(
        "scales.webp",
        order.iter().map(|&row| {
            let [x, y, z] = row_of(frame.log_scale(), row as usize).map(|log| nearest(&scales, log));
            [x, y, z, 255]
        }),
    )?;
    let colours = weighed(frame.dc());
    files.add(
        "sh0.webp",
        order.iter().map(|&row| {
            let [red, green, blue] = row_of(frame.dc(), row as usize).map(|dc| nearest(&colours, dc));
            let opacity = frame.opacity_logit().get(row as usize).map_or(0, |&logit| byte_of_logit(logit));
            [red, green, blue, opacity]
        }),
    )?;
    let mut meta = json!({
        "version": 2,
        "asset": { "generator": concat!("SplatStream ", env!("CARGO_PKG_VERSION")) },
        "count": frame.len(),
        "means": means,
        "scales": { "codebook": scales, "files": ["scales.webp"] },
        "quats": { "files": ["quats.webp"] },
        "sh0": { "codebook": colours, "files": ["sh0.webp"] },
    });
    if let (Some(rest), Value::Object(meta)) = (harmonics(frame, &order, &mut files)?, &mut meta) {
        meta.insert("shN".to_owned(), rest);
    }
    files.finish(&meta)
}

/// The images of an archive, of one size but for the palette.
struct Files {
    archive: ZipWriter<Cursor<Vec<u8>>>,
    width: usize,
    height: usize,
}

impl Files {
    /// A nearly square image of a pixel for each Gaussian, sides multiples of four.
    fn for_frame(frame: &GaussianFrame) -> Result<Self, SceneError> {
        let count = frame.len();
        let width =
            count.isqrt().saturating_add(usize::from(count.isqrt().saturating_mul(count.isqrt()) < count));
        let width = width.next_multiple_of(4);
        let height = count.div_ceil(width.max(1)).next_multiple_of(4);
        if count == 0 || width.max(height) > MOST_PIXELS {
            let what = format!("SOG of {count} Gaussians");
            return Err(SceneError::unsupported(what, "it holds 1 to 268 million; write PLY"));
        }
        Ok(Self { archive: ZipWriter::new(Cursor::new(Vec::new())), width, height })
    }

    /// Adds an image of pixels row by row; those that lack are 0.
    fn add(&mut self, name: &str, pixels: impl Iterator<Item = [u8; 4]>) -> Result<(), SceneError> {
        let (width, height) = (self.width, self.height);
        self.add_of_size(name, pixels, width, height)
    }

    fn add_of_size(
        &mut self,
        name: &str,
        pixels: impl Iterator<Item = [u8; 4]>,
        width: usize,
        height: usize,
    ) -> Result<(), SceneError> {
        let mut bytes: Vec<u8> = pixels.flatten().collect();
        bytes.resize(width.saturating_mul(height).saturating_mul(4), 0);
        let mut webp = Vec::new();
        WebPEncoder::new_lossless(&mut webp)
            .write_image(&bytes, width as u32, height as u32, ExtendedColorType::Rgba8)
            .map_err(|error| failed(name, &error))?;
        self.store(name, &webp)
    }

    /// Stores a file as it is: images are compressed already.
    fn store(&mut self, name: &str, content: &[u8]) -> Result<(), SceneError> {
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        self.archive.start_file(name, options).map_err(|error| failed(name, &error))?;
        Ok(self.archive.write_all(content)?)
    }

    fn finish(mut self, meta: &Value) -> Result<Vec<u8>, SceneError> {
        self.store(META, meta.to_string().as_bytes())?;
        Ok(self.archive.finish().map_err(|error| failed("the archive", &error))?.into_inner())
    }
}

fn failed(name: &str, error: &dyn std::fmt::Display) -> SceneError {
    SceneError::unsupported(format!("{name} cannot be written: {error}"), "write another format")
}

/// What the square of a difference in each Gaussian counts for: its area times its opacity, which is about how much of a picture it
/// is, as a share of the mean, and 1, so that what is small counts too.
fn visible(frame: &GaussianFrame) -> Vec<f64> {
    let log_area = |row: usize| {
        let logs = row_of(frame.log_scale(), row).map(f64::from);
        logs.iter().sum::<f64>() - logs.into_iter().fold(f64::INFINITY, f64::min)
    };
    // None overflows.
    let most = (0..frame.len()).map(log_area).fold(f64::NEG_INFINITY, f64::max);
    let opacities = frame.opacity_logit().iter().map(|&logit| sigmoid(logit.into()));
    let areas: Vec<f64> =
        opacities.enumerate().map(|(row, opacity)| libm::exp(log_area(row) - most) * opacity).collect();
    let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    areas.iter().map(|area| if mean > 0.0 { 1.0 + area / mean } else { 1.0 }).collect()
}

/// Centres in 16 bits of sign(x) ln(1 + |x|), low bytes and high bytes apart.
fn means(frame: &GaussianFrame, order: &[u32], files: &mut Files) -> Result<Value, SceneError> {
    let log = |value: f32| libm::log1p(f64::from(value.abs())).copysign(value.into());
    let ends = |from: f64, of: fn(f64, f64) -> f64| {
        frame.position().each_ref().map(|plane| plane.iter().map(|&value| log(value)).fold(from, of))
    };
    let (mins, maxs) = (ends(f64::INFINITY, f64::min), ends(f64::NEG_INFINITY, f64::max));
    let code = |row: u32| {
        let mut codes = [0_u16; 3];
        let values = row_of(frame.position(), row as usize).into_iter().zip(mins.into_iter().zip(maxs));
        for (code, (value, (least, most))) in codes.iter_mut().zip(values) {
            let extent = most - least;
            // `as` saturates.
            *code = if extent > 0.0 { ((log(value) - least) / extent * 65535.0).round() as u16 } else { 0 };
        }
        codes.map(u16::to_le_bytes)
    };
    files.add(
        "means_l.webp",
        order.iter().map(|&row| {
            let [[x, _], [y, _], [z, _]] = code(row);
            [x, y, z, 255]
        }),
    )?;
    files.add(
        "means_u.webp",
        order.iter().map(|&row| {
            let [[_, x], [_, y], [_, z]] = code(row);
            [x, y, z, 255]
        }),
    )?;
    Ok(json!({ "mins": mins, "maxs": maxs, "files": ["means_l.webp", "means_u.webp"] }))
}

/// The smallest three parts, and which part is the largest.
fn rotation(frame: &GaussianFrame, row: usize) -> [u8; 4] {
    // Validated: no quaternion is zero.
    let unit = normalised(row_of(frame.rotation(), row)).unwrap_or([1.0, 0.0, 0.0, 0.0]);
    let (largest, smallest) = to_smallest_three(unit);
    let [a, b, c] = smallest.map(|part| to_byte((part / SQRT_2 + 0.5) * 255.0));
    [a, b, c, FIRST_LARGEST.saturating_add(largest as u8)]
}

/// The palette of spherical harmonics, and the entry of each Gaussian; nothing for degree 0.
fn harmonics(frame: &GaussianFrame, order: &[u32], files: &mut Files) -> Result<Option<Value>, SceneError> {
    if frame.sh().is_empty() {
        return Ok(None);
    }
    let values =
        (0..frame.len()).flat_map(|row| frame.sh().iter().filter_map(move |plane| plane.get(row).copied()));
    let rows = Rows { values: values.collect(), width: frame.sh().len() };
    let (entries, labels) = palette(&rows, entries_for(frame.len()));
    drop(rows);
    let codes = codebook(entries.values.iter().copied().map(Weighed::alike).collect());
    let pixels = entries.values.as_chunks::<3>().0.iter().map(|colour| {
        let [red, green, blue] = colour.map(|value| nearest(&codes, value));
        [red, green, blue, 255]
    });
    let count = entries.len();
    let width = sh_coefficients(frame.sh_degree()).saturating_mul(ENTRIES_A_ROW);
    files.add_of_size("shN_centroids.webp", pixels, width, count.div_ceil(ENTRIES_A_ROW))?;
    files.add(
        "shN_labels.webp",
        order.iter().map(|&row| {
            let [low, high, ..] = labels.get(row as usize).copied().unwrap_or(0).to_le_bytes();
            [low, high, 0, 255]
        }),
    )?;
    Ok(Some(json!({
        "count": count, "bands": frame.sh_degree(), "codebook": codes,
        "files": ["shN_centroids.webp", "shN_labels.webp"],
    })))
}

/// How many entries a palette may have: a power of two, one for up to two Gaussians of a small scene; more of them cost
/// more than they are worth.
fn entries_for(gaussians: usize) -> usize {
    let power = (gaussians / 1024).checked_ilog2().map_or(1, |bits| 1_usize << bits);
    power.saturating_mul(1024).min(MOST_ENTRIES)
}
