//! Compressed PLY: vertices packed into four 32-bit words, with ranges shared by chunks of 256.
//!
//! | word | bits, high to low | meaning |
//! |---|---|---|
//! | `packed_position`, `packed_scale` | 11, 10, 11 | fractions of the chunk's range in x, y, z |
//! | `packed_rotation` | 2, 10, 10, 10 | place of the largest of w, x, y, z; the others, ±1/√2 |
//! | `packed_color` | 8, 8, 8, 8 | red, green, blue, opacity; colour is a fraction of the chunk's range if it has one |
//!
//! Optional element `sh`: `f_rest_*` as bytes, a channel after another, over −4 to 4.

mod write;

use std::f64::consts::SQRT_2;

use crate::byte_values::logit_of_byte;
use crate::error::SceneError;
use crate::limits::{Budget, ReadLimits};
use crate::ply::{Body, Element, Header, Rest, parse_header, planes_of_rest, require};
use crate::reading::{checked, frame_of};
use crate::smallest_three::from_smallest_three;
use splatstream_gaussians::activation::dc_of_colour;
use splatstream_gaussians::{GaussianFrame, Planes};

pub use write::{clamped, write};

/// Gaussians that share a row of the element `chunk`.
const CHUNK: usize = 256;

/// The 18 properties of a chunk: minima and maxima of position, log scale and, in newer files, colour.
const RANGES: [&str; 18] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
    "min_r",
    "min_g",
    "min_b",
    "max_r",
    "max_g",
    "max_b",
];

const WORDS: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];

/// Reads a compressed PLY file. Opacity 0 and 255 become finite logits, half a step inside.
///
/// # Errors
/// A header that is not understood, missing elements or properties (all are named), fewer chunks than the
/// vertices need, more than `limits` allow, or a value that no frame may hold.
pub fn read(bytes: &[u8], limits: &ReadLimits) -> Result<GaussianFrame, SceneError> {
    checked(read_as_is(bytes, &mut Budget::new(limits))?)
}

/// As [`read`], with values as they are: none is checked.
pub(crate) fn read_as_is(bytes: &[u8], budget: &mut Budget) -> Result<GaussianFrame, SceneError> {
    let header = parse_header(bytes, budget)?;
    let layout = Layout::of(&header, budget)?;
    let (mut ranges, mut rest) = (Vec::new(), Vec::new());
    let mut words: [Vec<u32>; 4] = Default::default();
    let mut body = Body::new(bytes, &header);
    for element in &header.elements {
        match element.name.as_str() {
            "chunk" => ranges = body.columns(element, &layout.ranges, budget)?,
            "vertex" => {
                let columns = body.columns(element, &owned(&WORDS), budget)?;
                words.iter_mut().zip(columns).for_each(|(to, from)| *to = from);
            }
            "sh" => rest = body.columns(element, &layout.rest, budget)?,
            _ => body.skip(element)?,
        }
    }
    body.end(core::iter::empty(), budget);
    let mut planes = unpack(&ranges, &words, budget)?;
    planes.sh = planes_of_rest(layout.sh_degree, rest);
    planes.sh.iter_mut().flatten().for_each(|value| *value = sh_of_byte(*value));
    frame_of(layout.sh_degree, planes)
}

/// Which properties a file has, of those that may be absent.
struct Layout {
    ranges: Vec<String>,
    rest: Vec<String>,
    sh_degree: u8,
}

impl Layout {
    /// Checks that a header has what it needs, and enough chunks for its vertices.
    fn of(header: &Header, budget: &mut Budget) -> Result<Self, SceneError> {
        let (vertex, chunk) = (wanted(header, "vertex")?, wanted(header, "chunk")?);
        require(vertex, &owned(&WORDS))?;
        let coloured = chunk.has("min_r");
        let ranges = owned(if coloured { &RANGES } else { &RANGES[..12] });
        require(chunk, &ranges)?;
        if chunk.count < vertex.count.div_ceil(CHUNK as u64) {
            let what = format!("{} chunks of 256 cannot hold {} vertices", chunk.count, vertex.count);
            return Err(SceneError::inconsistent(what, "export the file again"));
        }
        let Some(sh) = header.element("sh") else {
            return Ok(Self { ranges, rest: Vec::new(), sh_degree: 0 });
        };
        let rest = Rest::of(sh, budget)?;
        let names: Vec<_> = rest.names().collect();
        require(sh, &names)?;
        Ok(Self { ranges, rest: names, sh_degree: rest.sh_degree })
    }
}

fn wanted<'a>(header: &'a Header, name: &str) -> Result<&'a Element, SceneError> {
    header.element(name).ok_or_else(|| {
        SceneError::inconsistent(format!("no element is called {name}"), "this is no compressed PLY")
    })
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// The planes of vertices: `ranges` holds columns in the order of [`RANGES`], `words` in that of [`WORDS`].
fn unpack(ranges: &[Vec<f32>], words: &[Vec<u32>; 4], budget: &mut Budget) -> Result<Planes, SceneError> {
    let [positions, rotations, scales, colours] = words;
    let mut planes = budget.planes(0, positions.len() as u64)?;
    let rows = positions.iter().zip(rotations).zip(scales).zip(colours);
    for (row, (((&position, &turn), &scale), &colour)) in rows.enumerate() {
        let chunk = row / CHUNK;
        let [red, green, blue, opacity] = colour.to_be_bytes();
        let colour = [red, green, blue].map(|byte| f64::from(byte) / 255.0);
        let position = within(ranges.get(..6), chunk, fractions(position));
        let scale = within(ranges.get(6..12), chunk, fractions(scale));
        let colour = within(ranges.get(12..), chunk, colour);
        planes.position.iter_mut().zip(position).for_each(|(plane, value)| plane.push(value as f32));
        planes.log_scale.iter_mut().zip(scale).for_each(|(plane, value)| plane.push(value as f32));
        planes.dc.iter_mut().zip(colour).for_each(|(plane, value)| plane.push(dc_of_colour(value)));
        planes.opacity_logit.push(logit_of_byte(opacity));
        for (plane, part) in planes.rotation.iter_mut().zip(rotation(turn)) {
            plane.push(part);
        }
    }
    Ok(planes)
}

/// Fractions of a chunk's ranges in x, y, z: six columns, the minima of three axes and then the maxima; without
/// columns, or where a column has no such chunk, the range is 0 to 1.
fn within(ranges: Option<&[Vec<f32>]>, chunk: usize, fractions: [f64; 3]) -> [f64; 3] {
    let Some([min_x, min_y, min_z, max_x, max_y, max_z]) = ranges else { return fractions };
    let [x, y, z] = fractions;
    [(min_x, max_x, x), (min_y, max_y, y), (min_z, max_z, z)].map(|(low, high, fraction)| {
        let (Some(&low), Some(&high)) = (low.get(chunk), high.get(chunk)) else { return fraction };
        f64::from(low) + (f64::from(high) - f64::from(low)) * fraction
    })
}

/// 11, 10 and 11 bits as fractions 0 to 1.
fn fractions(word: u32) -> [f64; 3] {
    let part = |shift: u32, mask: u32| f64::from(word >> shift & mask) / f64::from(mask);
    [part(21, 0x7ff), part(11, 0x3ff), part(0, 0x7ff)]
}

fn rotation(word: u32) -> [f32; 4] {
    let part = |shift: u32| (f64::from(word >> shift & 0x3ff) / 1023.0 - 0.5) * SQRT_2;
    from_smallest_three((word >> 30) as usize, [part(20), part(10), part(0)])
}

/// A coefficient of its byte, 0 to 255: both ends mean ±4, what lies between the middle of its 256th part.
fn sh_of_byte(byte: f32) -> f32 {
    let fraction = match byte {
        0.0 => 0.0,
        255.0 => 1.0,
        between => (between + 0.5) / 256.0,
    };
    (fraction - 0.5) * 8.0
}
