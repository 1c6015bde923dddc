//! Writing compressed PLY.

use std::f64::consts::SQRT_2;

use super::{CHUNK, RANGES, WORDS};
use crate::byte_values::{byte_of_logit, to_byte};
use crate::clamped::{Clamped, is_no_byte};
use crate::error::SceneError;
use crate::morton::morton_order;
use crate::reading::row_of;
use crate::smallest_three::to_smallest_three;
use splatstream_gaussians::activation::colour_of_dc;
use splatstream_gaussians::rotation::normalised;
use splatstream_gaussians::{GaussianFrame, rest_index};

/// Writes a compressed PLY, Gaussians in Morton order: those that share ranges lie close to each other.
///
/// What comes back differs by at most half a step:
///
/// | attribute | step | range |
/// |---|---|---|
/// | centre, log scale | that of 256 Gaussians / 2047, of y / 1023 | fits always |
/// | rotation, the smallest three | 1/723 | fits always |
/// | colour | that of 256 Gaussians / 255 | fits always |
/// | opacity | 1/255 | 0 to 1 |
/// | SH | 1/32 | −4 to 4 |
///
/// # Errors
/// A frame that does not pass [`GaussianFrame::validate`].
pub fn write(frame: &GaussianFrame) -> Result<Vec<u8>, SceneError> {
    frame.validate()?;
    let order = morton_order(frame);
    let mut out = header(frame).into_bytes();
    let (mut words, mut ranges) = (Vec::new(), Vec::new());
    for rows in order.chunks(CHUNK) {
        let chunk = Chunk::of(frame, rows);
        ranges.extend(chunk.ranges().iter().flat_map(|value| value.to_le_bytes()));
        words.extend(rows.iter().flat_map(|&row| chunk.pack(frame, row as usize)).flat_map(u32::to_le_bytes));
    }
    out.extend(ranges);
    out.extend(words);
    for row in order {
        out.extend(coefficients(frame, row as usize));
    }
    Ok(out)
}

/// The values that [`write()`] cannot keep: coefficients outside −4 to 4.
pub fn clamped(frame: &GaussianFrame) -> Vec<Clamped> {
    Clamped::of("sh", frame.sh(), |_, value| is_no_byte(scaled_sh(value))).into_iter().collect()
}

fn header(frame: &GaussianFrame) -> String {
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    let properties = |kind: &'static str, names: &[&str]| -> String {
        names.iter().map(|name| format!("property {kind} {name}\n")).collect()
    };
    text.push_str(&format!(
        "element chunk {}\n{}",
        frame.len().div_ceil(CHUNK),
        properties("float", &RANGES)
    ));
    text.push_str(&format!("element vertex {}\n{}", frame.len(), properties("uint", &WORDS)));
    if !frame.sh().is_empty() {
        text.push_str(&format!("element sh {}\n", frame.len()));
        (0..frame.sh().len()).for_each(|at| text.push_str(&format!("property uchar f_rest_{at}\n")));
    }
    text.push_str("end_header\n");
    text
}

/// The coefficients of a Gaussian, one channel after another.
fn coefficients(frame: &GaussianFrame, row: usize) -> Vec<u8> {
    let mut bytes = vec![0; frame.sh().len()];
    for (plane, values) in frame.sh().iter().enumerate() {
        let value = values.get(row).copied().unwrap_or(0.0);
        let to = bytes.get_mut(rest_index(plane, frame.sh_degree()));
        to.into_iter().for_each(|to| *to = to_byte(scaled_sh(value)));
    }
    bytes
}

/// A coefficient on the scale of bytes, of which each stands for the middle of its 256th part of −4 to 4.
fn scaled_sh(value: f32) -> f64 {
    (f64::from(value) / 8.0 + 0.5) * 256.0 - 0.5
}

/// The range of values that some Gaussians have: least and greatest.
type Range = [f32; 2];

/// The ranges of up to 256 Gaussians.
struct Chunk {
    position: [Range; 3],
    log_scale: [Range; 3],
    colour: [Range; 3],
}

impl Chunk {
    fn of(frame: &GaussianFrame, rows: &[u32]) -> Self {
        let range = |plane: &Vec<f32>, value: &dyn Fn(f32) -> f32| {
            let values =
                || rows.iter().filter_map(|&row| plane.get(row as usize)).map(|&stored| value(stored));
            [values().fold(f32::INFINITY, f32::min), values().fold(f32::NEG_INFINITY, f32::max)]
        };
        let plain = |planes: &[Vec<f32>; 3]| planes.each_ref().map(|plane| range(plane, &|value| value));
        Self {
            position: plain(frame.position()),
            log_scale: plain(frame.log_scale()),
            colour: frame.dc().each_ref().map(|plane| range(plane, &|dc| colour_of_dc(dc) as f32)),
        }
    }

    /// In the order of the properties: of each attribute the least values, then the greatest.
    fn ranges(&self) -> Vec<f32> {
        let ends =
            |ranges: &[Range; 3]| [ranges.map(|[least, _]| least), ranges.map(|[_, most]| most)].concat();
        [&self.position, &self.log_scale, &self.colour].into_iter().flat_map(ends).collect()
    }

    /// The words of a Gaussian, in the order of their properties.
    fn pack(&self, frame: &GaussianFrame, row: usize) -> [u32; 4] {
        let rotation = row_of(frame.rotation(), row);
        // Validated: no quaternion is zero.
        let (largest, smallest) = to_smallest_three(normalised(rotation).unwrap_or([1.0, 0.0, 0.0, 0.0]));
        let rotation = smallest
            .iter()
            .fold(largest as u32, |word, part| word << 10 | ((part / SQRT_2 + 0.5) * 1023.0).round() as u32);
        let colour = row_of(frame.dc(), row).map(|dc| colour_of_dc(dc) as f32);
        let [red, green, blue] = fractions(colour, &self.colour).map(|part| to_byte(part * 255.0));
        let opacity = frame.opacity_logit().get(row).map_or(0, |&logit| byte_of_logit(logit));
        [
            mixed(fractions(row_of(frame.position(), row), &self.position)),
            rotation,
            mixed(fractions(row_of(frame.log_scale(), row), &self.log_scale)),
            u32::from_be_bytes([red, green, blue, opacity]),
        ]
    }
}

/// Where values lie in their ranges, 0 to 1.
fn fractions(values: [f32; 3], ranges: &[Range; 3]) -> [f64; 3] {
    let mut parts = [0.0; 3];
    for ((part, value), &[least, most]) in parts.iter_mut().zip(values).zip(ranges) {
        let extent = f64::from(most) - f64::from(least);
        *part = if extent > 0.0 { (f64::from(value) - f64::from(least)) / extent } else { 0.0 };
    }
    parts
}

/// Fractions in 11, 10 and 11 bits.
fn mixed([x, y, z]: [f64; 3]) -> u32 {
    let part = |value: f64, most: f64| (value * most).round() as u32;
    part(x, 2047.0) << 21 | part(y, 1023.0) << 11 | part(z, 2047.0)
}
