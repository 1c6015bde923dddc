//! Gaussians as the renderer's textures hold them: texels of four 32-bit words, [`ROW`] Gaussians in a row of a texture.
//!
//! | word | of a Gaussian |
//! |---|---|
//! | 0 to 2 | position, binary32 |
//! | 3 | log-scales of axes 0 and 1, 16 bits each: (value + 32) * 1024 |
//! | 4 | log-scale of axis 2, and in the high half opacity: 0 is 0, 65535 is 1 |
//! | 5 | rotation: two of the three smaller components, 15 bits each, and in bits 30 and 31 which one (w, x, y, z) is the largest |
//! | 6 | the last of the smaller components, 16 bits, and in the high half red, binary16 |
//! | 7 | green and blue, binary16 |
//!
//! Colours are those of degree 0: 0.5 + 0.2821 dc. The smaller components of the rotation keep their order; they are
//! scaled from -1/√2 ... 1/√2 to all codes, for the sign with which the largest one is positive. The texture of the
//! spherical harmonics has two binary16 in a word, in the order of the planes, filled with 0 to whole texels.

use core::ops::Range;
use splatstream::Planes;

/// Gaussians in a row of a texture.
pub const ROW: usize = 512;
/// Words of a texel.
const TEXEL: usize = 4;
/// Words of a Gaussian without spherical harmonics.
const WORDS: usize = 2 * TEXEL;
/// Gaussians that are written at a time: loops over so many become vectors.
const BLOCK: usize = 16;
/// The constant basis function of the spherical harmonics, 1 / (2 √π).
const SH_C0: f32 = 0.282_094_8;

/// Values of a block.
type Floats = [f32; BLOCK];
/// Words of a block.
type Codes = [u32; BLOCK];

/// The texels of all slots.
#[derive(Default)]
pub struct Texels {
    /// Geometry and colour of degree 0.
    pub base: Texture,
    /// Spherical harmonics; empty at degree 0.
    pub sh: Texture,
    opacities: Vec<Opacities>,
}

/// A texture and what has changed in it.
#[derive(Default)]
pub struct Texture {
    /// Texels, row by row.
    pub words: Vec<u32>,
    /// Rows that have changed, as first row and row after the last, increasing.
    pub dirty: Vec<u32>,
    /// Words of a Gaussian.
    stride: usize,
}

impl Texture {
    fn resize(&mut self, gaussians: usize, stride: usize) {
        self.stride = stride;
        self.words.clear();
        self.words.resize(gaussians * stride, 0);
    }

    /// The texels of a block, Gaussian by Gaussian.
    fn block(&mut self, block: usize) -> &mut [u32] {
        let words = BLOCK * self.stride;
        self.words.get_mut(block * words..(block + 1) * words).unwrap_or_default()
    }

    /// Writes word `number` of each Gaussian of a block; the bits that change.
    fn write(texels: &mut [u32], stride: usize, number: usize, codes: &Codes) -> u32 {
        let mut changed = 0;
        for (word, &code) in texels.iter_mut().skip(number).step_by(stride).zip(codes) {
            changed |= *word ^ code;
            *word = code;
        }
        changed
    }

    /// Adds the row of a block, at or after the last one, to those that have changed.
    fn mark(&mut self, block: usize) {
        let row = (block * BLOCK / ROW) as u32;
        match self.dirty.last_mut() {
            Some(end) if *end > row => {}
            Some(end) if *end == row => *end = row + 1,
            _ => self.dirty.extend([row, row + 1]),
        }
    }

    fn mark_all(&mut self) {
        let rows = self.words.len().checked_div(self.stride * ROW).unwrap_or(0);
        self.dirty.clear();
        if rows > 0 {
            self.dirty.extend([0, rows as u32]);
        }
    }
}

impl Texels {
    /// Words of the spherical harmonics of a Gaussian, in whole texels.
    pub fn sh_words(planes: usize) -> usize {
        planes.div_ceil(2).next_multiple_of(TEXEL)
    }

    /// Writes the slots of some ranges, increasing. With `is_new`, the number of slots, a multiple of [`ROW`], or of planes
    /// has changed, and everything counts as changed.
    pub fn write(&mut self, planes: &Planes, ranges: &[Range<usize>], is_new: bool) {
        if is_new {
            let slots = planes.opacity_logit.len();
            self.base.resize(slots, WORDS);
            self.sh.resize(slots, Self::sh_words(planes.sh.len()));
            self.opacities.clear();
            self.opacities.resize_with(slots / BLOCK, Opacities::default);
        }
        self.base.dirty.clear();
        self.sh.dirty.clear();
        let mut next = 0;
        for range in ranges {
            let end = range.end.div_ceil(BLOCK);
            for block in next.max(range.start / BLOCK)..end {
                self.write_block(planes, block);
            }
            next = next.max(end);
        }
        if is_new {
            self.base.mark_all();
            self.sh.mark_all();
        }
    }

    fn write_block(&mut self, planes: &Planes, block: usize) {
        let Some(opacities) = self.opacities.get_mut(block) else { return };
        let codes = base(planes, block, opacities);
        let texels = self.base.block(block);
        let changed = codes
            .iter()
            .enumerate()
            .map(|(number, codes)| Texture::write(texels, WORDS, number, codes))
            .fold(0, core::ops::BitOr::bitor);
        if changed != 0 {
            self.base.mark(block);
        }
        let stride = self.sh.stride;
        let texels = self.sh.block(block);
        let mut changed = 0;
        for (number, pair) in planes.sh.chunks(2).enumerate() {
            let [low, high] = [0, 1].map(|of| pair.get(of).map_or([0.0; BLOCK], |plane| *part(plane, block)));
            changed |= Texture::write(texels, stride, number, &joined(&low.map(half), &high.map(half)));
        }
        if changed != 0 {
            self.sh.mark(block);
        }
    }
}

/// The opacities of a block before the sigmoid, and their codes: opacities seldom change, and exponentials take long.
#[derive(Default)]
struct Opacities {
    logits: Floats,
    codes: Codes,
    is_known: bool,
}

impl Opacities {
    fn codes(&mut self, logits: &Floats) -> &Codes {
        if !self.is_known || self.logits != *logits {
            self.logits = *logits;
            self.codes = logits.map(|logit| fixed(65535.0 / (1.0 + (-logit).exp()), 65535.0));
            self.is_known = true;
        }
        &self.codes
    }
}

/// The values of a block; 0 if the plane has fewer.
fn part(plane: &[f32], block: usize) -> &Floats {
    plane.as_chunks().0.get(block).unwrap_or(&[0.0; BLOCK])
}

/// Words with these low and high halves.
fn joined(low: &Codes, high: &Codes) -> Codes {
    let mut words = *low;
    words.iter_mut().zip(high).for_each(|(word, &high)| *word |= high << 16);
    words
}

/// The words of a block.
fn base(planes: &Planes, block: usize, opacities: &mut Opacities) -> [Codes; WORDS] {
    let [x, y, z] = planes.position.each_ref().map(|plane| part(plane, block).map(f32::to_bits));
    let log_scale =
        |plane: &Vec<f32>| part(plane, block).map(|value| fixed((value + 32.0) * 1024.0, 65535.0));
    let [a, b, c] = planes.log_scale.each_ref().map(log_scale);
    let opacity = opacities.codes(part(&planes.opacity_logit, block));
    let (pair, last) = rotations(planes.rotation.each_ref().map(|plane| part(plane, block)));
    let colour = |plane: &Vec<f32>| part(plane, block).map(|value| half(0.5 + SH_C0 * value));
    let [red, green, blue] = planes.dc.each_ref().map(colour);
    [x, y, z, joined(&a, &b), joined(&c, opacity), pair, joined(&last, &red), joined(&green, &blue)]
}

/// Words 5 and 6 of a block, without red, of unit quaternions w, x, y, z.
fn rotations([w, x, y, z]: [&Floats; 4]) -> (Codes, Codes) {
    let (mut pairs, mut lasts) = ([0; BLOCK], [0; BLOCK]);
    let quaternions = w.iter().zip(x).zip(y.iter().zip(z));
    for ((pair, last), ((&w, &x), (&y, &z))) in pairs.iter_mut().zip(&mut lasts).zip(quaternions) {
        (*pair, *last) = rotation([w, x, y, z]);
    }
    (pairs, lasts)
}

/// Words 5 and 6 of a unit quaternion, without red. Choices of values, not branches, so that loops become vectors.
#[inline(always)]
fn rotation([w, x, y, z]: [f32; 4]) -> (u32, u32) {
    let (mut largest, mut value) = (0, w);
    for (place, part) in [(1, x), (2, y), (3, z)] {
        let is_larger = part.abs() > value.abs();
        largest = if is_larger { place } else { largest };
        value = if is_larger { part } else { value };
    }
    let sign = if value < 0.0 { -1.0 } else { 1.0 };
    let others = [
        if largest == 0 { x } else { w },
        if largest <= 1 { y } else { x },
        if largest <= 2 { z } else { y },
    ];
    let [a, b, c] = others.map(|part| sign * part * core::f32::consts::FRAC_1_SQRT_2 + 0.5);
    let (a, b, c) = (fixed(a * 32767.0, 32767.0), fixed(b * 32767.0, 32767.0), fixed(c * 65535.0, 65535.0));
    (a | b << 15 | largest << 30, c)
}

/// The nearest code from 0 to `most`; 0 of what is no number.
#[inline(always)]
fn fixed(value: f32, most: f32) -> u32 {
    (value.clamp(0.0, most) + 0.5) as u32
}

/// The nearest binary16, in the low half; the largest one of what is beyond it. Choices of values, not branches.
#[inline(always)]
fn half(value: f32) -> u32 {
    let bits = value.to_bits();
    let magnitude = f32::from_bits(bits & 0x7fff_ffff);
    // Below 2^-14 the codes are equidistant.
    let small = (magnitude * 16_777_216.0 + 0.5) as u32;
    let normal = magnitude.to_bits().wrapping_sub(112 << 23).wrapping_add(0x1000) >> 13;
    let code = if magnitude < 6.103_515_6e-5 { small } else { normal };
    let code = if magnitude < 65504.0 { code } else { 0x7bff };
    bits >> 16 & 0x8000 | code
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_those_of_the_standard() {
        let cases =
            [(0.0, 0), (1.0, 0x3c00), (-2.0, 0xc000), (65504.0, 0x7bff), (1e9, 0x7bff), (0.5, 0x3800)];
        for (value, code) in cases.into_iter().chain([(5.960_464_5e-8, 1), (6.103_515_6e-5, 0x400)]) {
            assert_eq!(half(value), code, "{value}");
        }
    }

    #[test]
    fn the_largest_component_of_a_rotation_is_left_out() {
        assert_eq!(rotation([1.0, 0.0, 0.0, 0.0]), (16384 | 16384 << 15, 32768));
        assert_eq!(rotation([0.0, 0.0, -1.0, 0.0]), (16384 | 16384 << 15 | 2 << 30, 32768));
        let part = core::f32::consts::FRAC_1_SQRT_2;
        assert_eq!(rotation([part, part, 0.0, 0.0]).0 & 0x7fff, 32767);
    }

    #[test]
    fn a_row_is_dirty_if_a_word_in_it_changes() {
        let everything = 0..3 * ROW;
        let all = core::slice::from_ref(&everything);
        let plane = vec![0.5; 3 * ROW];
        let mut planes = Planes { opacity_logit: plane.clone(), ..Planes::default() };
        planes.sh = vec![plane; 9];
        let mut texels = Texels::default();
        texels.write(&planes, &[], true);
        assert_eq!((&texels.base.dirty, &texels.sh.dirty), (&vec![0, 3], &vec![0, 3]));
        texels.write(&planes, all, false);
        texels.write(&planes, all, false);
        assert!(texels.base.dirty.is_empty() && texels.sh.dirty.is_empty());
        planes.opacity_logit[0] = 1.0;
        planes.opacity_logit[2 * ROW] = 1.0;
        texels.write(&planes, all, false);
        assert_eq!(texels.base.dirty, [0, 1, 2, 3]);
        assert!(texels.sh.dirty.is_empty());
    }
}
