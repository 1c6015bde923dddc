//! SPZ's attribute streams: bytes to planes, and back.

use std::f64::consts::FRAC_1_SQRT_2;

use super::WriteOptions;
use super::container::{Shape, Streams};
use crate::axes::Flip;
use crate::byte_values::{byte_of_logit, logit_of_byte, to_byte};
use crate::clamped::{Clamped, is_no_byte};
use crate::error::SceneError;
use crate::half::float_of_half;
use crate::reading::row_of;
use crate::smallest_three::{from_smallest_three, to_smallest_three};
use splatstream_gaussians::rotation::normalised;
use splatstream_gaussians::{GaussianFrame, Planes, sh_planes};

/// How much of a DC coefficient makes one of colour: less than the basis function, to leave room outside 0–1.
const COLOUR_SCALE: f64 = 0.15;
/// Magnitudes of the smallest three have nine bits.
const LARGEST_MAGNITUDE: f64 = 511.0;
/// A 24-bit centre goes from −2²³ to this.
const LARGEST_FIXED: f64 = 8_388_607.0;

/// The planes of streams that have the lengths `shape` gives them; `planes` are empty and have room for them.
pub(crate) fn unpack(shape: &Shape, streams: &Streams, mut planes: Planes) -> Planes {
    let [positions, alphas, colours, scales, rotations, sh] = streams;
    unpack_positions(shape, positions, &mut planes);
    planes.opacity_logit.extend(alphas.iter().map(|&byte| logit_of_byte(byte)));
    for (axis, plane) in planes.dc.iter_mut().enumerate() {
        let bytes = colours.iter().skip(axis).step_by(3);
        plane.extend(bytes.map(|&byte| ((f64::from(byte) / 255.0 - 0.5) / COLOUR_SCALE) as f32));
    }
    for (axis, plane) in planes.log_scale.iter_mut().enumerate() {
        plane.extend(scales.iter().skip(axis).step_by(3).map(|&byte| f32::from(byte) / 16.0 - 10.0));
    }
    unpack_rotations(shape, rotations, &mut planes);
    let signs = shape.flip.sh();
    // A file of degree 4 has more coefficients than the planes take: those of band 4 come last.
    let stride = sh_planes(shape.stored_degree).max(1);
    // Three channels have the sign of their coefficient.
    for ((at, plane), sign) in
        planes.sh.iter_mut().enumerate().zip(signs.into_iter().flat_map(|sign| [sign; 3]))
    {
        let bytes = sh.iter().skip(at).step_by(stride);
        plane.extend(bytes.map(|&byte| sign * (f32::from(byte) - 128.0) / 128.0));
    }
    planes
}

fn unpack_positions(shape: &Shape, bytes: &[u8], planes: &mut Planes) {
    let signs = shape.flip.position();
    if shape.version == 1 {
        for row in bytes.as_chunks::<2>().0.as_chunks::<3>().0 {
            for ((plane, &half), sign) in planes.position.iter_mut().zip(row).zip(signs) {
                plane.push(float_of_half(u16::from_le_bytes(half)) * sign);
            }
        }
        return;
    }
    let step = 1.0 / (1_u64 << shape.fractional_bits) as f32;
    for row in bytes.as_chunks::<3>().0.as_chunks::<3>().0 {
        for ((plane, &[low, middle, high]), sign) in planes.position.iter_mut().zip(row).zip(signs) {
            // Read at the top of 32 bits, so that the shift back extends the sign.
            let fixed = i32::from_le_bytes([0, low, middle, high]) >> 8;
            plane.push(fixed as f32 * step * sign);
        }
    }
}

fn unpack_rotations(shape: &Shape, bytes: &[u8], planes: &mut Planes) {
    let signs = shape.flip.rotation();
    let mut push = |[x, y, z, w]: [f32; 4]| {
        for (plane, part) in planes.rotation.iter_mut().zip([w, x * signs[0], y * signs[1], z * signs[2]]) {
            plane.push(part);
        }
    };
    if shape.version < 3 {
        for xyz in bytes.as_chunks::<3>().0 {
            // w is not stored and not negative, as if it were always the largest.
            push(from_smallest_three(3, xyz.map(|byte| f64::from(byte) / 127.5 - 1.0)));
        }
        return;
    }
    for &word in bytes.as_chunks::<4>().0 {
        let word = u32::from_le_bytes(word);
        let part = |shift: u32| {
            let magnitude = f64::from(word >> shift & 0x1ff) / LARGEST_MAGNITUDE * FRAC_1_SQRT_2;
            if word >> shift >> 9 & 1 == 1 { -magnitude } else { magnitude }
        };
        push(from_smallest_three((word >> 30) as usize, [part(20), part(10), part(0)]));
    }
}

/// The streams of version 3.
pub(crate) fn pack(frame: &GaussianFrame, options: &WriteOptions) -> Result<(Shape, Streams), SceneError> {
    check_sh_bits(options)?;
    let fractional_bits = fractional_bits(frame, options)?;
    let shape = Shape {
        version: 3,
        gaussians: frame.len(),
        sh_degree: frame.sh_degree(),
        stored_degree: frame.sh_degree(),
        fractional_bits,
        antialiased: frame.antialiased(),
        flip: Flip::default(),
    };
    let streams = [
        pack_positions(frame, &shape),
        frame.opacity_logit().iter().map(|&logit| byte_of_logit(logit)).collect(),
        interleave(frame.dc(), |dc| to_byte(scaled_dc(dc))),
        interleave(frame.log_scale(), |log| to_byte(scaled_log(log))),
        (0..frame.len()).flat_map(|row| pack_rotation(frame, row, shape.flip)).collect(),
        pack_sh(frame, options, shape.flip),
    ];
    Ok((shape, streams))
}

/// The values that [`pack`] puts at the ends of their ranges.
pub(crate) fn clamped(frame: &GaussianFrame, options: &WriteOptions) -> Vec<Clamped> {
    if check_sh_bits(options).is_err() {
        return Vec::new();
    }
    let signs = Flip::default().sh();
    let sign = |plane: usize| signs.get(plane / 3).copied().unwrap_or(1.0);
    let sh = |plane: usize, value: f32| {
        let (steps, step) = sh_steps(value * sign(plane), sh_bits(plane, options));
        !(0.0..=256.0 - step).contains(&(steps * step))
    };
    let found = [
        Clamped::of("dc", frame.dc(), |_, dc| is_no_byte(scaled_dc(dc))),
        Clamped::of("log_scale", frame.log_scale(), |_, log| is_no_byte(scaled_log(log))),
        Clamped::of("sh", frame.sh(), sh),
    ];
    found.into_iter().flatten().collect()
}

/// A DC coefficient on the scale of bytes.
fn scaled_dc(dc: f32) -> f64 {
    (f64::from(dc) * COLOUR_SCALE + 0.5) * 255.0
}

/// The log of a semi-axis on the scale of bytes.
fn scaled_log(log: f32) -> f64 {
    (f64::from(log) + 10.0) * 16.0
}

/// The bytes of three planes, row by row.
fn interleave(planes: &[Vec<f32>; 3], byte: impl Fn(f32) -> u8) -> Vec<u8> {
    let [a, b, c] = planes;
    let rows = a.iter().zip(b).zip(c);
    rows.flat_map(|((&a, &b), &c)| [byte(a), byte(b), byte(c)]).collect()
}

fn check_sh_bits(options: &WriteOptions) -> Result<(), SceneError> {
    for (name, bits) in [("sh1_bits", options.sh1_bits), ("sh_rest_bits", options.sh_rest_bits)] {
        if !(1..=8).contains(&bits) {
            return Err(SceneError::unsupported(format!("{name} is {bits}"), "choose 1 to 8"));
        }
    }
    Ok(())
}

/// The fractional bits asked for, or the most that fit.
fn fractional_bits(frame: &GaussianFrame, options: &WriteOptions) -> Result<u8, SceneError> {
    let farthest = frame.position().iter().flatten().fold(0.0_f32, |most, value| most.max(value.abs()));
    let fits = |bits: u8| (f64::from(farthest) * f64::from(1_u32 << bits)).round() <= LARGEST_FIXED;
    let bits = match options.fractional_bits {
        Some(bits) => Some(bits).filter(|&bits| bits <= 23 && fits(bits)),
        None => (0..=23).rev().find(|&bits| fits(bits)),
    };
    bits.ok_or_else(|| {
        let asked = options.fractional_bits.unwrap_or(0);
        let what =
            format!("a centre {farthest} from the origin does not fit in 24 bits with {asked} fractional");
        SceneError::unsupported(what, "remove outliers, or ask for fewer fractional bits, 0 to 23")
    })
}

fn pack_positions(frame: &GaussianFrame, shape: &Shape) -> Vec<u8> {
    let steps = f64::from(1_u32 << shape.fractional_bits);
    let mut out = Vec::with_capacity(frame.len().saturating_mul(9));
    for row in 0..frame.len() {
        for (value, sign) in row_of(frame.position(), row).into_iter().zip(shape.flip.position()) {
            let fixed = (f64::from(value * sign) * steps).round() as i32;
            let [low, middle, high, _] = fixed.to_le_bytes();
            out.extend_from_slice(&[low, middle, high]);
        }
    }
    out
}

fn pack_rotation(frame: &GaussianFrame, row: usize, flip: Flip) -> [u8; 4] {
    let [w, x, y, z] = row_of(frame.rotation(), row);
    // Validated: no quaternion is zero.
    let [w, x, y, z] = normalised([w, x, y, z]).unwrap_or([1.0, 0.0, 0.0, 0.0]);
    let [sx, sy, sz] = flip.rotation();
    let (largest, smallest) = to_smallest_three([x * sx, y * sy, z * sz, w]);
    let word = smallest.iter().fold(largest as u32, |word, &part| {
        let magnitude = (part.abs() / FRAC_1_SQRT_2 * LARGEST_MAGNITUDE).round().min(LARGEST_MAGNITUDE);
        word << 10 | u32::from(part < 0.0) << 9 | magnitude as u32
    });
    word.to_le_bytes()
}

fn pack_sh(frame: &GaussianFrame, options: &WriteOptions, flip: Flip) -> Vec<u8> {
    let signs = flip.sh();
    let mut out = Vec::with_capacity(frame.len().saturating_mul(frame.sh().len()));
    for row in 0..frame.len() {
        let signs = signs.into_iter().flat_map(|sign| [sign; 3]);
        for ((at, plane), sign) in frame.sh().iter().enumerate().zip(signs) {
            let value = plane.get(row).map_or(0.0, |value| value * sign);
            out.push(sh_byte(value, sh_bits(at, options)));
        }
    }
    out
}

/// The nearest byte with zeros below its `bits` highest bits, so that 0 is exact whatever the bits.
fn sh_byte(value: f32, bits: u8) -> u8 {
    let (steps, step) = sh_steps(value, bits);
    to_byte((steps * step).min(256.0 - step))
}

/// The nearest number of steps, and the step on the scale of bytes.
fn sh_steps(value: f32, bits: u8) -> (f64, f64) {
    let step = f64::from(256_u32 >> bits);
    (((f64::from(value) * 128.0 + 128.0) / step).round(), step)
}

/// Bits of the coefficients in a plane.
fn sh_bits(plane: usize, options: &WriteOptions) -> u8 {
    if plane < 9 { options.sh1_bits } else { options.sh_rest_bits }
}
